"""Solids in the water: levels of closed form and of boxes, worlds moved as a whole, places that keep their phase."""

import numpy as np
import pytest

from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.targets import target_points
from insonify.scenario.scenario import Scenario
from insonify.scene import solid
from insonify.scene.scene import Scene
from insonify.simulator import arrivals, build_simulator, levels, simulate
from oracles.scenes import nominal
from oracles.sonar_equation import pulse_energy

WATER = {"noise_level_db": None, "absorption_db_per_m": 0.03}
PULSE_ENERGY = {"duration": 0.2e-3, "fraction": 0.2, "band": 20e3}


def seen(*targets: dict[str, object], window: tuple[float, float] = (0.1975, 0.2135), **paths: object) -> Scenario:
    """Targets alone, received about the echoes of the nominal box's place."""
    return nominal(targets=targets, water=WATER, track={"window": window}, paths={"contributions": ["target"], **paths})


def energies(scenario: Scenario) -> dict[str, float]:
    """Energy of the targets' echo by pair of families [uPa^2 s]."""
    curves = levels(scenario).level_db.sel(contribution="target")
    return {str(pair): float(np.sum(10 ** (curves.sel(pair=pair).values / 10)) / 25e3) for pair in curves.pair.values}


@pytest.mark.parametrize("heading", [0.0, 0.35])
def test_a_block_of_triangles_is_as_strong_as_a_box(heading: float) -> None:
    """The nominal box as a plate of its thickness, order 2: every pair of families within 0.1 dB (found: 0.005)."""
    lie = {"position": (0, 150.5), "heading": heading}
    box = energies(seen({"shape": "box", "size": (2, 1, 1), **lie}))
    plate = energies(seen({"shape": "plate", "length": 2, "width": 1, "thickness": 1, **lie}))
    assert len(box) == 16
    for pair, energy in box.items():
        assert 10 * np.log10(plate[pair] / energy) == pytest.approx(0, abs=0.1), pair


def test_a_rough_sphere_scatters_as_a_full_moon_of_lambert_does() -> None:
    """Direct path: mu times the integral of cos^2 over the lit half, 2 pi a^2 / 3, over R^4; within 0.1 dB.

    The sphere floats at the sonar's depth, 60 m away, in the middle of a beam that is flat over it to 0.01 dB; its
    nearer points are not stronger by more than 0.05 dB on the mean.
    """
    ball = {"shape": "sphere", "diameter": 0.4, "position": (0, 60), "base_depth": 11.2}
    scenario = nominal(targets=[ball], water=WATER, track={"window": (0.079, 0.0815)}, line={"length": 0.15},
                       paths={"contributions": ["target"], "max_reflections": 0})  # fmt: skip
    energy = energies(scenario)["D-D"]
    expected = (
        10**22 * 0.1 * 2 * np.pi * 0.2**2 / 3 / 60**4 * 10 ** (-2 * 0.03 * 60 / 10) * pulse_energy(**PULSE_ENERGY)
    )
    assert 10 * np.log10(energy / expected) == pytest.approx(0, abs=0.1)


def test_the_coherent_echo_of_a_solid_has_the_mean_of_the_incoherent_one() -> None:
    """Forty seeds of a lying cylinder, direct path: its mean energy within 0.7 dB, 3 standard errors."""
    drum = {"shape": "drum", "position": (0, 150), "heading": 0.6}
    window = (0.1995, 0.2025)
    quiet = seen(drum, window=window, max_reflections=0)
    expected = energies(quiet)["all"]
    found = []
    for seed in range(40):
        sound = simulate(quiet.model_copy(update={"seed": seed})).pressure.values
        found.append(np.sum(np.abs(sound) ** 2) / 25e3)
    assert 10 * np.log10(np.mean(found) / expected) == pytest.approx(0, abs=0.7)


def test_another_seed_has_other_points_in_the_same_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells follow from the shape alone: the surface is divided once for two seeds."""
    divided, divide = [], solid.surface_cells
    monkeypatch.setattr(solid, "surface_cells", lambda *arguments: divided.append(arguments) or divide(*arguments))
    scene = Scene(
        seabed={"depth": 20.0}, targets=[{"shape": "cylinder", "length": 0.53, "diameter": 0.29, "position": (0, 9)}]
    )
    one, other = (solid.solid_scatterers(scene.solids[0], scene.seabed, seed, 0.03, 0) for seed in (1, 2))
    assert len(divided) == 1
    apart = np.linalg.norm(one.position - other.position, axis=1)
    assert 0.01 < np.median(apart) < 0.03


def test_a_scene_moved_as_a_whole_sounds_the_same() -> None:
    """Turned by 1.1 rad and shifted by kilometres: the same series within 1e-6 of its strongest sample."""
    turn, shift = 1.1, np.array([3000.0, -2000.0])
    c, s = np.cos(turn), np.sin(turn)

    def received(there: bool) -> np.ndarray:
        def place(north: float, east: float) -> tuple[float, float]:
            moved = np.array([[c, -s], [s, c]]) @ [north, east] + shift if there else np.array([north, east])
            return float(moved[0]), float(moved[1])

        lean = turn if there else 0.0
        targets = [
            {"shape": "manta", "position": place(0, 60), "heading": lean},
            {"shape": "anchor", "position": place(1, 63), "heading": 0.5 + lean, "roll": 0.2, "burial": 0.2},
        ]
        track = {"position": (*place(0, 0), 11.0), "heading": lean, "window": (0.078, 0.09)}
        return simulate(nominal(targets=targets, track=track, paths={"contributions": ["target"]})).pressure.values

    here, there = received(False), received(True)
    assert np.abs(here - there).max() < 1e-6 * np.abs(here).max()
    assert np.abs(here).max() > 0


def test_a_target_does_not_receive_of_the_others() -> None:
    """A second target far to the side changes neither places nor phases of the first, only adds its own."""
    rock = {"shape": "rock", "position": (0, 60)}
    alone, together = (
        arrivals(nominal(targets=targets, track={"window": (0.078, 0.09)}, paths={"contributions": ["target"]}))
        for targets in ([rock], [{"shape": "drum", "position": (-30, 50)}, rock])
    )
    mine = together.take(together.object == "rock")
    np.testing.assert_array_equal(mine.amplitude, alone.amplitude)
    np.testing.assert_array_equal(mine.delay, alone.delay)


@pytest.mark.parametrize("target", [{"shape": "drum"}, {"shape": "box", "size": (2.0, 1.0, 1.0)}])
def test_a_place_on_a_target_keeps_its_phase_along_a_track(target: dict[str, object]) -> None:
    """Sailing 60 m past it and a little on, every ping reaches the same points: cells follow the closest approach."""
    paths = {"contributions": ["target"], "beam_cutoff_db": -120}  # at 45 degrees there is little but side lobes
    still = nominal(targets=[{**target, "position": (0.0, 60.0)}], paths=paths).model_dump()
    track = {"kind": "line", "start": (-60.0, 0.0, 11.0), "speed": 5.0, "pings": 13, "interval": 1.0}
    scenario = Scenario(**{**still, "track": {**track, "window": (0.05, 0.15)}})
    simulator = build_simulator(scenario)
    first, *others = (simulator.engine.all_pairs(simulator.ping_geometry(ping)) for ping in (0, 6, 12))
    positions = np.concatenate([pairs.scatterers.position for pairs in first])
    for pairs in others:
        np.testing.assert_array_equal(np.concatenate([block.scatterers.position for block in pairs]), positions)


def test_a_solid_beyond_the_window_costs_nothing() -> None:
    """No points of a target whose first echo comes after the recording; all of one whose first echo comes before."""
    for east, received in ((75.0, True), (140.0, False)):
        scenario = nominal(targets=[{"shape": "drum", "position": (0.0, east)}], track={"window": (0.0, 0.12)})
        simulator = build_simulator(scenario)
        here = simulator.ping_geometry(0)
        slant = ping_scatterers(
            scenario.scene, scenario.paths, 1, here, simulator.engine.rays
        ).resolution.slant_resolution
        assert bool(target_points(scenario.scene, scenario.paths, 1, here, slant, quadrature=False)) is received


def test_a_target_that_no_beam_comes_near_is_left_out_and_would_not_be_received() -> None:
    """A drum at 60 m, 45 degrees off a sidescan's beam: no points; drawn all the same it is 50 dB below one abeam."""
    received = {}
    for name, place, floor in (("abeam", (0.0, 60.0), -50), ("aside", (42.4, 42.4), -50), ("all", (42.4, 42.4), -120)):
        paths = {"contributions": ["target"], "max_reflections": 0, "beam_cutoff_db": floor}
        received[name] = simulate(
            nominal(field="incoherent", paths=paths, targets=[{"shape": "drum", "position": place}])
        )
    strong = {name: float(series.intensity.max()) for name, series in received.items()}
    assert strong["all"] > strong["aside"]
    assert 10 * np.log10(strong["all"] / strong["abeam"]) < -50
    quiet = simulate(nominal(field="incoherent", paths={"contributions": ["target"]}))
    np.testing.assert_allclose(received["aside"].intensity, quiet.intensity)


def test_what_lies_behind_a_solid_is_in_its_shadow() -> None:
    """The bed behind a manta-like cone, direct paths: 20 dB below the same bed without it, in the deep of its shadow.

    Height 0.5 m at 60 m under a sonar 9 m above the bed: (60 + 0.49) 0.5 / 8.5 = 3.6 m of shadow. A wide cone, so that
    the beam of 0.9 m there receives nothing beside it.
    """
    window = (0.0815, 0.0832)
    wall = {"shape": "truncated_cone", "height": 0.5, "diameter": 6, "top_diameter": 5, "position": (0, 60)}
    free, hidden = (
        simulate(nominal(field="incoherent", targets=targets, track={"window": window},
                         paths={"max_reflections": 0, "contributions": ["seabed"]})).intensity.values.mean()
        for targets in ([], [wall])
    )  # fmt: skip
    assert 10 * np.log10(hidden / free) < -20
