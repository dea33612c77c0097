"""Fast reverberation gives the expected intensity of the general engine."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from insonify.engines.fast_reverberation import prepare_fast_reverberation
from insonify.scenario.scenario import Scenario
from insonify.scene.terrain_map import TerrainMap
from insonify.simulator import Simulator, build_simulator, simulate
from oracles.scenes import SCATTERED

Floats = NDArray[np.float64]

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": "3 cm"}
CRATE = {"shape": "box", "label": "crate", "position": [0.0, 20.0], "size": [4.0, 2.0, 1.5]}
SIDESCAN: dict[str, Any] = {
    "seed": 3,
    "field": "incoherent",
    "seabed": {"depth": 10.0, "scattering": {"law": "lambert", "strength_db": -27}, "relief": FRACTAL},
    "sonar": {
        "source_level_db": 220,
        "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.2 ms"},
        "transmit": {"kind": "planar", "width": 0.3, "height": 0.02},
        "receive": {"kind": "planar", "width": 0.3, "height": 0.02},
        "mounting": {"bearing": "90 deg", "tilt": "20 deg"},
    },
    "track": {
        "kind": "line", "start": [0.0, 0.0, 4.0], "heading": 0.0, "speed": "2 m/s", "pings": 5, "interval": 0.1,
        "window": [0.0, "50 ms"],
    },
    "paths": {"max_reflections": 0},
}  # fmt: skip
GROUND = slice(350, 1200)


def made(order: int = 0, **changes: Any) -> Scenario:
    """The scene with legs of at most so many bounces, hard shadows, no boundary echoes, other changes at the top."""
    paths = {"max_reflections": order, "edge_diffraction": "none", "contributions": SCATTERED}
    return Scenario.model_validate({**SIDESCAN, "paths": paths, **changes})


def quickly(simulator: Simulator, ping: int = 0) -> Floats:
    """One ping, its ground by fast reverberation, all else by the general one."""
    here, engine = simulator.ping_geometry(ping), simulator.engine
    reading = simulator.incoherent_accumulator(here)
    ground = prepare_fast_reverberation(engine.scene, engine.path_settings, here, engine.rays)
    assert ground is not None
    received = reading.empty()
    ground.accumulate(map, lambda swath: reading.add_fast_reverberation(received, swath))
    for pairs in replace(engine, path_settings=ground.remaining_path_settings).all_pairs(here, quadrature=True):
        reading.add(received, pairs)
    return np.asarray(reading.time_series(received))


def thoroughly(simulator: Simulator, ping: int = 0) -> Floats:
    """The same ping, every block of it through the general engine."""
    here = simulator.ping_geometry(ping)
    reading = simulator.incoherent_accumulator(here)
    received = reading.empty()
    for pairs in simulator.engine.all_pairs(here, quadrature=True):
        reading.add(received, pairs)
    return np.asarray(reading.time_series(received))


def difference_db(simulator: Simulator, part: slice = GROUND) -> float:
    """Mean level of fast reverberation over that of the general one [dB]."""
    quick, general = quickly(simulator)[0, part], thoroughly(simulator)[0, part]
    return float(10 * np.log10(quick.mean() / general.mean()))


@pytest.mark.parametrize("order", [0, 2, 4])
def test_both_engines_agree_over_fractal_ground(order: int) -> None:
    """Direct paths, 9 pairs and 25 pairs: within 0.05 dB, mean of 850 samples, some 20 pulses' worth of ground."""
    assert abs(difference_db(build_simulator(made(order)))) < 0.05


def test_a_flat_bed_is_smooth_and_as_strong_as_by_the_general_engine() -> None:
    """Sample for sample 0.08 dB rms and within 0.3 dB, and 0.02 dB in the mean."""
    simulator = build_simulator(made(seabed={**SIDESCAN["seabed"], "relief": None}))
    ratio = 10 * np.log10(quickly(simulator)[0, GROUND] / thoroughly(simulator)[0, GROUND])
    assert abs(ratio.mean()) < 0.02
    assert ratio.std() < 0.08 and np.abs(ratio).max() < 0.3


def test_ground_under_vertical_side_lobes_is_as_strong_as_by_the_general_engine() -> None:
    """Narrow beams at 400 kHz, 43 to 58 degrees down: 0.5 dB rms over 2 m; lines of 16 cells are 9 dB off."""
    beam = {"kind": "planar", "width": 0.5, "height": 0.01}
    sonar = {**SIDESCAN["sonar"], "transmit": beam, "receive": beam,
             "pulse": {"kind": "cw", "frequency": "400 kHz", "duration": "0.2 ms"}}  # fmt: skip
    track = {**SIDESCAN["track"], "start": [0.0, 0.0, 2.0], "window": [0.0, "18 ms"]}
    flat = {**SIDESCAN["seabed"], "relief": None}
    simulator = build_simulator(made(sonar=sonar, track=track, seabed=flat))
    quick, general = quickly(simulator)[0], thoroughly(simulator)[0]
    slant = 750 * (simulator.grid.time - 0.1e-3)
    near = (slant > 9.4) & (slant < 11.0)
    ratio = 10 * np.log10(quick[near] / general[near])
    assert np.sqrt(np.mean(ratio**2)) < 0.5


def test_paths_of_one_position_interfere_as_they_do_by_the_general_engine() -> None:
    """A sonar just under the surface: direct and surface path overlap within the pulse, and make fringes."""
    track = {**SIDESCAN["track"], "start": [0.0, 0.0, 0.15]}
    flat = {**SIDESCAN["seabed"], "relief": None}
    simulator = build_simulator(made(1, track=track, seabed=flat))
    quick, general = quickly(simulator)[0, 600:1200], thoroughly(simulator)[0, 600:1200]
    alone = quickly(build_simulator(made(0, track=track, seabed=flat)))[0, 600:1200]
    ratio = 10 * np.log10(quick / general)
    assert np.std(10 * np.log10(quick / alone)) > 1
    assert abs(ratio.mean()) < 0.05
    assert np.std(ratio) < 0.2


@pytest.mark.parametrize("order", [0, 2])
def test_a_box_casts_the_same_shadow(order: int) -> None:
    """Direct paths: 7 dB down behind it. By either way within 0.5 dB, and with surface paths, which light it, too."""
    simulator = build_simulator(made(order, targets=[CRATE]))
    bare = quickly(build_simulator(made(order)))[0]
    quick, general = quickly(simulator)[0], thoroughly(simulator)[0]
    shadow = slice(*(np.array([2 * 22.3, 2 * 25.5]) / 1500 * simulator.grid.sample_rate).astype(int))
    assert order > 0 or bare[shadow].mean() > 5 * quick[shadow].mean()
    assert abs(10 * np.log10(quick[shadow].mean() / general[shadow].mean())) < 0.5


def test_a_box_has_the_same_soft_edges() -> None:
    """Only the box has edges on a flat bed: three pings are within 1 dB of the general way behind it, 0.05 dB beyond.

    Behind it the few lines of fast reverberation sample the ripples of the visible ground at the sides at single
    bearings.
    """
    flat, soft = {**SIDESCAN["seabed"], "relief": None}, {"max_reflections": 0, "edge_diffraction": "knife-edge"}
    simulator = build_simulator(made(0, targets=[CRATE], seabed=flat, paths=soft))
    shadow = slice(*(np.array([2 * 22.3, 2 * 25.5]) / 1500 * simulator.grid.sample_rate).astype(int))
    quick, general = (np.array([way(simulator, ping)[0] for ping in range(3)]) for way in (quickly, thoroughly))
    for part, apart in ((shadow, 1.0), (slice(shadow.stop, 1200), 0.05)):
        assert abs(10 * np.log10(quick[:, part].mean() / general[:, part].mean())) < apart
    hard = quickly(build_simulator(made(0, targets=[CRATE], seabed=flat)))[0]
    # 4.4 % by the general way
    assert quick[0, shadow].mean() != pytest.approx(hard[shadow].mean(), rel=0.03)


def test_the_bits_depend_neither_on_threads_nor_on_the_pings_before() -> None:
    """One thread or three; the fifth ping alone or after four others."""
    whole = simulate(made(2), threads=3).intensity.values
    alone = simulate(made(2), pings=[4], threads=1).intensity.values
    np.testing.assert_array_equal(whole[4:], alone)


def test_a_scene_turned_as_a_whole_sounds_the_same() -> None:
    """Scatterer grid, track and all by 40 degrees: the same to a millionth."""
    turned = {**SIDESCAN["seabed"], "scatterer_grid": {"heading": np.radians(40)}}
    track = {**SIDESCAN["track"], "heading": np.radians(40)}
    here, there = quickly(build_simulator(made(2))), quickly(build_simulator(made(2, seabed=turned, track=track)))
    # before the first echo stands the rounding of the transform, 104 dB below the greatest sample
    np.testing.assert_allclose(there, here, rtol=1e-3, atol=1e-9 * here.max())
    assert there.mean() == pytest.approx(here.mean(), rel=1e-5)


def test_the_map_is_the_ground() -> None:
    """Heights on the nodes of a tile within a thousandth of their rms, slopes within a hundredth."""
    bed = build_simulator(made()).engine.scene.seabed.terrain
    assert bed is not None
    kept = TerrainMap(bed)
    tile = 2, -3
    (row,) = rows = kept.claim(np.array([tile]))
    kept.synthesize(rows)
    node = np.arange(65)
    along, across = ((number * 64 + node) * kept.cell for number in tile)
    height, slope = bed.relief.resolved.sample_in_grid_axes(along[:, None], across[None, :])
    off = kept.nodes[row] - np.concatenate([height[..., None], slope], axis=-1)
    assert off[..., 0].std() < 0.005 * height.std()
    assert off[..., 1:].std() < 0.01 * slope.std()


def test_unsupported_scenes_are_left_to_the_general_engine() -> None:
    """Ends apart."""
    apart = {**SIDESCAN["sonar"], "receive": {**SIDESCAN["sonar"]["receive"], "offset": [0.0, 0.0, 0.1]}}
    simulator = build_simulator(made(sonar=apart))
    assert simulator.fast_reverberation(simulator.ping_geometry(0)) is None


def test_what_lies_below_the_floor_of_the_beam_is_not_missed() -> None:
    """Nothing of the beam is counted twice or left out: a floor of -80 dB changes the level by less than 0.02 dB."""
    deep = made(paths={"max_reflections": 0, "beam_cutoff_db": -80})
    level = quickly(build_simulator(made()))[0, GROUND].mean()
    assert abs(10 * np.log10(quickly(build_simulator(deep))[0, GROUND].mean() / level)) < 0.02


def test_what_is_kept_from_ping_to_ping_follows_the_pulse() -> None:
    """One scene, a sonar of 100 kHz, then one of 50: bounces and absorption are those of each, as from a new scene."""
    points = {"transmit": {"kind": "point"}, "receive": {"kind": "point"}}
    tones = ({**SIDESCAN["sonar"]["pulse"], "frequency": tone} for tone in ("100 kHz", "50 kHz"))
    high, low = (build_simulator(made(2, sonar={**SIDESCAN["sonar"], **points, "pulse": tone})) for tone in tones)
    engine = high.engine
    plans = []
    for scene, simulator in ((engine.scene, high), (engine.scene, low), (low.engine.scene, low)):
        ground = prepare_fast_reverberation(scene, engine.path_settings, simulator.ping_geometry(0), engine.rays)
        assert ground is not None
        plans.append(ground.plan)
    assert plans[1].table.absorption_exponent == plans[2].table.absorption_exponent < plans[0].table.absorption_exponent
    np.testing.assert_array_equal(plans[1].table.reflection_products, plans[2].table.reflection_products)
    assert np.abs(plans[1].table.reflection_products - plans[0].table.reflection_products).max() > 0.01
