"""Fast reverberation in layered water gives the expected intensity of the eigenray engine."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from engines.test_fast_reverberation import CRATE, FRACTAL, GROUND, SIDESCAN, made, quickly, thoroughly
from insonify.engines.fast_reverberation import (
    fast_relief_reflections,
    prepare_fast_reverberation,
    refraction_columns,
    reverberation,
)
from insonify.engines.fast_reverberation._refraction_kernel import (
    interpolate_refraction,
    refracted_bounces,
    refracted_launch_slopes,
)
from insonify.engines.fast_reverberation.fast_relief_reflections import reflect_at_fitted_planes
from insonify.engines.fast_reverberation.flat_seabed_legs import flat_seabed_legs
from insonify.engines.fast_reverberation.refraction_table import RaysFromDepth, refraction_table
from insonify.engines.fast_reverberation.swath_origins import sample_positions
from insonify.engines.radial_tables import STRAIGHT, RefractionTable
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.families import image_depth
from insonify.propagation.launch_angles import StraightLaunchAngles
from insonify.scene.scatterers import Scatterers
from insonify.simulator import Simulator, build_simulator, labels, simulate

Floats = NDArray[np.float64]

DOWNWARD = [[0.0, 1505.0], [4.0, 1500.0], [10.0, 1490.0]]
DUCT = [[0.0, 1510.0], [4.0, 1490.0], [10.0, 1510.0]]
UPWARD = [[0.0, 1480.0], [10.0, 1510.0]]
FLAT = {**SIDESCAN["seabed"], "relief": None}


def in_water(profile: list[list[float]], order: int = 0, rms: str = "3 cm", **changes: Any) -> Simulator:
    """The sidescan over fractal relief in layered water."""
    seabed = {**SIDESCAN["seabed"], "relief": {**FRACTAL, "rms": rms}}
    water = {"profile": profile, "smoothing": 1.0}
    return build_simulator(made(order, **{"seabed": seabed, "water": water, **changes}))


def table_of(simulator: Simulator) -> RefractionTable | None:
    """Refraction table of the first ping; None: the fast reverberation is not used."""
    ground = simulator.fast_reverberation(simulator.ping_geometry(0))
    return None if ground is None else ground.plan.table.refraction


def levels_db(simulator: Simulator, ping: int = 0, parts: int = 17) -> Floats:
    """Level of the fast reverberation re the eigenray engine, in parts of the reverberation [dB], (parts,)."""
    fast, general = (way(simulator, ping)[0, GROUND].reshape(parts, -1).mean(axis=1) for way in (quickly, thoroughly))
    return np.asarray(10 * np.log10(fast / general))


@pytest.mark.parametrize(
    ("profile", "order", "rms"),
    [(DOWNWARD, 0, "3 cm"), (DOWNWARD, 2, "15 cm"), (DUCT, 2, "3 cm"), (UPWARD, 4, "3 cm")],
)
def test_both_engines_agree_in_layered_water(profile: list[list[float]], order: int, rms: str) -> None:
    """Mean level within 0.05 dB, and 0.1 dB rms over the 17 parts; uniform water is 0.2 dB off, and more in parts."""
    simulator = in_water(profile, order, rms)
    assert table_of(simulator) is not None
    error = levels_db(simulator)
    assert abs(error.mean()) < 0.05 and error.std() < 0.1
    in_uniform_water = quickly(
        build_simulator(made(order, seabed={**SIDESCAN["seabed"], "relief": {**FRACTAL, "rms": rms}}))
    )
    ratio = quickly(simulator)[0, GROUND].mean() / in_uniform_water[0, GROUND].mean()
    assert abs(10 * np.log10(ratio)) > 0.1


def test_a_flat_seabed_in_layered_water_has_the_same_series_by_either_engine() -> None:
    """Sample for sample 0.08 dB rms and within 0.3 dB, and 0.02 dB in the mean, as in uniform water."""
    simulator = in_water(DOWNWARD, seabed=FLAT)
    ratio = 10 * np.log10(quickly(simulator)[0, GROUND] / thoroughly(simulator)[0, GROUND])
    assert abs(ratio.mean()) < 0.02
    assert ratio.std() < 0.08 and np.abs(ratio).max() < 0.3


def test_refracted_paths_of_one_position_interfere_by_either_engine() -> None:
    """A sonar just below the surface: fringes of direct and surface path, 0.2 dB rms."""
    track = {**SIDESCAN["track"], "start": [0.0, 0.0, 0.15]}
    simulator = in_water(DOWNWARD, 1, track=track, seabed=FLAT)
    fast, general = quickly(simulator)[0, 600:1200], thoroughly(simulator)[0, 600:1200]
    ratio = 10 * np.log10(fast / general)
    assert abs(ratio.mean()) < 0.05 and ratio.std() < 0.2
    alone = quickly(in_water(DOWNWARD, 0, track=track, seabed=FLAT))[0, 600:1200]
    assert np.std(10 * np.log10(fast / alone)) > 1


def test_bounces_that_relief_may_occlude_are_tested_in_layered_water() -> None:
    """Relief of 20 cm rms is higher than the Fresnel zones of 15 mm waves are wide: 0.05 dB in the mean."""
    simulator = in_water(UPWARD, 2, "20 cm")
    table = table_of(simulator)
    assert table is not None and table.clear_bounces.tolist() == [True, True, False]
    assert abs(levels_db(simulator).mean()) < 0.05


@pytest.mark.parametrize("edge_diffraction", ["none", "knife-edge"])
def test_a_box_casts_the_same_shadow_in_layered_water(edge_diffraction: str) -> None:
    """Behind a box, with hard or soft edges: the mean of three pings within 0.5 dB, and 0.05 dB beyond."""
    paths = {"max_reflections": 0, "edge_diffraction": edge_diffraction}
    simulator = in_water(DOWNWARD, targets=[CRATE], seabed=FLAT, paths=paths)
    shadow = slice(*(np.array([2 * 22.3, 2 * 25.5]) / 1497 * simulator.grid.sample_rate).astype(int))
    fast, general = (np.array([way(simulator, ping)[0] for ping in range(3)]) for way in (quickly, thoroughly))
    for part, error in ((shadow, 0.5), (slice(shadow.stop, 1200), 0.05)):
        assert abs(10 * np.log10(fast[:, part].mean() / general[:, part].mean())) < error
    without = quickly(in_water(DOWNWARD, seabed=FLAT, paths=paths))[0, shadow]
    assert without.mean() > 2 * fast[0, shadow].mean()


def test_a_platform_that_heaves_and_rolls_in_layered_water_is_followed() -> None:
    """Each ping from another depth: within 0.05 dB of the eigenray engine."""
    motion = {name: {"rms": rms, "period": "3 s"} for name, rms in (("heave", "10 cm"), ("roll", "1 deg"))}
    simulator = in_water(DOWNWARD, 2, track={**SIDESCAN["track"], "motion": motion})
    depths = [float(simulator.ping_geometry(ping).transmit_position[2]) for ping in (0, 3)]
    assert abs(depths[1] - depths[0]) > 0.02
    for ping in (0, 3):
        assert abs(levels_db(simulator, ping).mean()) < 0.05


def test_slightly_layered_water_is_uniform() -> None:
    """1 mm/s over 10 m: the mean level of uniform water to 0.02 dB, and 0.05 dB rms over the parts."""
    layered, uniform = (
        quickly(simulator)[0, GROUND].reshape(17, -1).mean(axis=1)
        for simulator in (in_water([[0.0, 1500.0], [10.0, 1500.001]], 2), build_simulator(made(2)))
    )
    error = 10 * np.log10(layered / uniform)
    assert abs(error.mean()) < 0.02 and error.std() < 0.05


def test_water_with_a_shadow_zone_in_range_is_left_to_the_eigenray_engine() -> None:
    """Down by 4 m/s per metre rays end at 125 m, and by 1 m/s per metre, from just below the surface, at 147 m."""
    for profile, depth, start, windows in (
        ([[0.0, 1530.0], [10.0, 1490.0]], 10.0, 2.0, ("200 ms", "150 ms")),
        ([[0.0, 1500.0], [5.0, 1495.0]], 5.0, 0.2, ("196 ms", "180 ms")),
    ):
        seabed = {**SIDESCAN["seabed"], "depth": depth, "relief": {**FRACTAL, "rms": "2 cm"}}
        tables = [
            table_of(in_water(profile, seabed=seabed, track={**SIDESCAN["track"], "start": [0.0, 0.0, start],
                                                             "window": [0.0, window]}))
            for window in windows
        ]  # fmt: skip
        assert tables[0] is None and tables[1] is not None
        assert (tables[1].nodes[..., refraction_columns.PRESSURE] > 0).all()


def test_water_with_several_rays_to_a_point_is_left_to_the_eigenray_engine() -> None:
    """Rays refracted up that leave the seabed in a shadow, and a sound channel with several rays to far points."""
    for profile, depth, window in (
        (UPWARD, 8.0, "200 ms"),
        ([[0.0, 1500.0], [5.0, 1470.0], [10.0, 1500.0]], 5.0, "250 ms"),
    ):
        track = {**SIDESCAN["track"], "start": [0.0, 0.0, depth], "window": [0.0, window]}
        assert table_of(in_water(profile, 2, track=track)) is None


def test_bits_in_layered_water_depend_neither_on_threads_nor_on_the_pings_before() -> None:
    """One thread or three; the fifth ping alone or after four others."""
    scenario = made(2, water={"profile": DOWNWARD, "smoothing": 1.0})
    whole = simulate(scenario, threads=3).intensity.values
    alone = simulate(scenario, pings=[4], threads=1).intensity.values
    np.testing.assert_array_equal(whole[4:], alone)


@pytest.mark.parametrize("profile", [DOWNWARD, DUCT, UPWARD])
def test_each_refracted_leg_is_that_of_the_eigenray_engine(
    profile: list[list[float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Up to four bounces, a plane for each: delays to 50 ns rms; legs off the mean plane differ by 2 us or more.

    Directions are within 1 mrad rms, pressures times the root of the law's factor of one direction within 1 % rms.
    """
    monkeypatch.setattr(fast_relief_reflections, "MAX_BOUNCE_STEP", 0.0)
    simulator, kept = in_water(profile, 4), []
    here = simulator.ping_geometry(0)

    def recorded(*arguments: Any) -> None:
        part, legs = arguments[4], arguments[5]
        count = int(legs.radial_offsets[-1])
        level = legs.delay[:, :count].copy()
        reflect_at_fitted_planes(*arguments)
        points = sample_positions(here, part, legs).T.copy()
        columns = legs.delay, legs.departure, legs.amplitude, legs.normal
        kept.append((points, level, *(column[..., :count].copy() for column in columns)))

    monkeypatch.setattr(reverberation, "reflect_at_fitted_planes", recorded)
    quickly(simulator)
    ((points, level, delay, departure, amplitude, normal),) = kept
    count = len(points)
    law = simulator.engine.scene.seabed.law(here.frequency, 1500.0)
    assert law is not None
    ground = Scatterers("seabed", "seabed", law, points, normal.T.astype(float), np.ones(count),
                        np.ones(count, complex), np.zeros(count, np.uint64))  # fmt: skip
    legs = simulator.engine.path_pairs(here, ground).transmit_legs
    factors: list[float] = []
    for row, name in enumerate(legs.families):
        pressure = np.abs(legs.amplitude[row]) * np.sqrt(np.maximum(legs.grazing_sine[row], 0.0))
        reached = np.flatnonzero((amplitude[row] != 0) & (pressure > 0))
        assert len(reached) > 100
        error = (delay[row] - legs.delay[row])[reached]
        assert np.sqrt(np.mean(error**2)) < 0.05e-6
        if "B" in name:
            assert (level[row] - legs.delay[row])[reached].std() > 2e-6
        turned = departure[row][:, reached].T - legs.departure[row, reached]
        assert np.sqrt(np.mean(turned**2)) < 1e-3
        strength, expected = np.abs(amplitude[row, reached]), pressure[reached]
        factor = np.sum(strength * expected) / np.sum(expected**2)
        factors.append(factor)
        assert np.sqrt(np.mean((strength / factor - expected) ** 2) / np.mean(expected**2)) < 0.01
    np.testing.assert_allclose(factors, factors[0], rtol=2e-3)


@pytest.mark.parametrize("family", ["D", "S", "BS", "SBS"])
def test_the_table_is_as_exact_rays(family: str) -> None:
    """Delay to 0.1 rad at 100 kHz, sines to 0.003, pressure to 0.5 % of the exact solver at random points."""
    simulator = in_water(DOWNWARD, 3, "15 cm")
    engine, source = simulator.engine, 4.0
    ground = prepare_fast_reverberation(engine.scene, engine.path_settings, simulator.ping_geometry(0), engine.rays)
    assert ground is not None
    table, row = ground.plan.table, ground.plan.families.index(family)
    random = np.random.default_rng(5)
    low, high = engine.scene.seabed.terrain.span  # type: ignore[union-attr]
    depth, distance = random.uniform(low, high, 500), random.uniform(0.5, 37.0, 500)
    columns = np.empty(500 * refraction_columns.COUNT, np.float32)
    interpolate_refraction(distance, depth, row, table.refraction, columns)
    delay, arrival, launch, pressure = columns.reshape(500, -1)[:, :4].T
    rays, count, _ = exact_solutions(engine.rays.layers, family, source, depth, distance)  # type: ignore[attr-defined]
    assert (count == 1).all()
    exact_delay, exact_launch, exact_arrival, _, amplitude, length = rays[:, 0, :6].T
    vertical = depth - image_depth(family, source, 10.0)
    straight = np.hypot(vertical, distance)
    speed = simulator.ping_geometry(0).sound_speed
    assert np.abs(straight / speed + delay - exact_delay).max() < 0.1 / (2 * np.pi * 100e3)
    assert np.abs(vertical / straight + arrival - exact_arrival).max() < 0.003
    towards = -exact_launch if family.startswith("S") else exact_launch
    assert np.abs(vertical / straight + launch - towards).max() < 0.003
    loss = 2.0 ** (-table.absorption_exponent * (length - straight))
    assert np.abs(pressure / (amplitude * straight * loss) - 1).max() < 0.005
    assert np.abs(straight / speed - exact_delay).max() > 1e-5  # what the table holds is not nothing


def bilinear_table(families: int = 2) -> tuple[RefractionTable, Floats]:
    """Table of columns that are bilinear in distance and depth, and their coefficients (families, 8, 4)."""
    factors = np.random.default_rng(2).normal(size=(families, 8, 4))
    distance, depth = 0.25 * np.arange(9), 9.5 + 0.5 * np.arange(4)
    terms = np.stack(np.broadcast_arrays(1.0, distance, depth[:, None], distance * depth[:, None]))
    nodes = np.ascontiguousarray(np.einsum("fct,tzr->fzrc", factors, terms), np.float32)
    climb = np.ascontiguousarray(np.einsum("ft,tzr->fzr", factors[:, 0], terms), np.float32)
    return RefractionTable(9.5, 0.5, 0.25, nodes, climb, np.ones(families, bool), 1490.0), factors


def test_columns_are_bilinear_between_nodes() -> None:
    """Functions that are bilinear in distance and depth, to single precision, up to the edges of the grid."""
    table, factors = bilinear_table()
    random = np.random.default_rng(3)
    distance, depth = np.append(random.uniform(0, 2, 99), 2.0), np.append(random.uniform(9.5, 11, 99), 11.0)
    columns = np.empty(100 * 8, np.float32)
    interpolate_refraction(distance, depth, 1, table, columns)
    terms = np.stack([np.ones(100), distance, depth, distance * depth])
    np.testing.assert_allclose(columns.reshape(100, 8), terms.T @ factors[1].T, atol=2e-5)


def test_launch_slopes_along_a_radial_are_climbs_over_distances() -> None:
    """Samples of a radial; rays that rise from the mean seabed do not reach terrain below it."""
    table, factors = bilinear_table()
    terrain = np.random.default_rng(4).uniform(9.6, 10.9, 30).astype(np.float32)
    slope = np.full(30, 7.0, np.float32)
    for deepest in (np.inf, 10.0):
        refracted_launch_slopes(terrain, 1, deepest, 0.06, 0.4, (2, 30), table, slope)
        distance = (np.arange(30) + 0.4) * 0.06
        climb = np.stack([np.ones(30), distance, terrain, distance * terrain]).T @ factors[1, 0]
        expected = np.where(terrain > deepest, -np.inf, climb / distance)
        np.testing.assert_allclose(slope[2:], expected[2:], rtol=1e-4, atol=1e-4)
        assert (slope[:2] == 7).all()


def test_bounces_of_a_straight_ray_are_those_of_its_image() -> None:
    """A table without differences: bounces, launch and grazing angle of BSBS, from 4 m above 10 m of water."""
    nodes = np.zeros((1, 2, 400, 8), np.float32)
    images, distance = np.array([image_depth("BSBS", 4.0, 10.0)]), 0.25 * np.arange(400)
    slope = (10.0 - images[0]) / np.maximum(distance, 1e-3)
    first, _, third, _ = StraightLaunchAngles(4.0, 10.0).bounce_ranges("BSBS", slope)
    nodes[..., refraction_columns.BOUNCE] = first / np.maximum(distance, 1e-3)
    nodes[..., refraction_columns.PERIOD] = (third - first) / 2 / np.maximum(distance, 1e-3)
    table = STRAIGHT._replace(first_depth=9.0, range_spacing=0.25, nodes=nodes, bed_speed=1500.0)
    ray = refracted_bounces(0, 60.1, 10.0, float(images[0]), table, np.empty(2), np.empty(8, np.float32))
    tangent = 46.0 / 60.1
    assert ray.launch_tangent == pytest.approx(tangent) and ray.grazing_tangent == pytest.approx(tangent)
    assert ray.first == pytest.approx(6.0 / tangent, rel=1e-5)
    assert ray.period == pytest.approx(10.0 / tangent, rel=1e-5)


def test_flat_seabed_legs_of_uniform_water_are_straight() -> None:
    """Delay, sines and climb from the image source, without a table."""
    legs = flat_seabed_legs(STRAIGHT, np.array([4.0, -4.0]), 1500.0, np.array([3.0, 8.0]), 10.0)
    np.testing.assert_allclose(legs.delay[:, 1] * 1500, [10.0, np.hypot(8, 14)])
    np.testing.assert_allclose(legs.arrival_sine[0], [6 / np.hypot(3, 6), 0.6])
    np.testing.assert_array_equal(legs.bounce_sine, legs.arrival_sine)
    np.testing.assert_allclose(legs.climb, [[6, 6], [14, 14]])


def test_flat_seabed_legs_in_layered_water_are_rays_to_the_mean_seabed() -> None:
    """Against the exact solver: delay to 1e-7 s, launch tangent times distance to 2 cm."""
    simulator = in_water(DOWNWARD, 2)
    table, engine = table_of(simulator), simulator.engine
    assert table is not None
    distance = np.linspace(1.0, 36.0, 40)
    legs = flat_seabed_legs(table, np.array([4.0, -4.0, -16.0]), simulator.ping_geometry(0).sound_speed, distance, 10.0)
    for row, family in enumerate(("D", "S", "BS")):
        rays, _, _ = exact_solutions(engine.rays.layers, family, 4.0, np.full(40, 10.0), distance)  # type: ignore[attr-defined]
        np.testing.assert_allclose(legs.delay[row], rays[:, 0, 0], atol=1e-7)
        launch = rays[:, 0, 1] * (-1 if family == "S" else 1)
        np.testing.assert_allclose(legs.climb[row], distance * launch / np.sqrt(1 - launch**2), atol=0.02)


def test_a_table_that_does_not_reach_far_enough_is_not_made() -> None:
    """Beyond the domain of the rays there is no table."""
    simulator = in_water(DOWNWARD)
    rays = simulator.engine.rays
    end = RaysFromDepth(rays, 4.0, 1500.0, 0.005)  # type: ignore[arg-type]
    farthest = rays.domain.max_range  # type: ignore[attr-defined]
    assert refraction_table(end, ("D",), ("D",), 0.015, farthest) is not None
    assert refraction_table(end, ("D",), ("D",), 0.015, farthest + 5.0) is None


@pytest.mark.parametrize("order", [0, 2])
def test_a_window_that_ends_before_the_seabed_receives_none_of_it(order: int) -> None:
    """Six metres above it and 4 ms long: a recording and labels without seabed, as in uniform water."""
    track = {**SIDESCAN["track"], "window": [0.0, "4 ms"]}
    layered = in_water(DOWNWARD, order, track=track)
    assert layered.fast_reverberation(layered.ping_geometry(0)) is None
    recording = simulate(layered.scenario, pings=0)
    uniform = simulate(made(order, track=track), pings=0)
    np.testing.assert_allclose(recording.intensity, uniform.intensity)
    np.testing.assert_array_equal(labels(layered.scenario)["object"], labels(made(order, track=track))["object"])
