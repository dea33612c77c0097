"""The same question has the same result: for any threads, any choice of pings, anywhere in the world."""

import numpy as np
import pytest

from insonify.simulator import arrivals, build_simulator, simulate, simulate_pings
from oracles.arrival_sum import coherent_from_arrivals
from oracles.scenes import nominal, point
from oracles.time_series import relative_rms

SHORT = {"window": (0.19, 0.21)}


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_one_thread_and_two_give_the_same_bits(field):
    """Whole nominal scene, three families, jitter and noise: bit for bit."""
    scenario = nominal(box={}, field=field, paths={"jitter": 0.2}, track=SHORT, water={"noise_level_db": 40})
    one, two, three = (simulate(scenario, threads=n) for n in (1, 2, 3))
    assert one.identical(two)
    assert one.identical(three)


def test_a_ping_does_not_depend_on_which_others_were_requested():
    """Any subset, in any order, has each ping's own bits, jitter and noise included."""
    track = {"kind": "line", "start": (0, 0, 11), "position": None, "speed": 2.0, "pings": 4, **SHORT}
    track = {key: value for key, value in track.items() if value is not None}
    scenario = moving(track, jitter=0.3)
    whole, some = simulate(scenario), simulate(scenario, pings=[3, 1])
    for row, ping in enumerate((3, 1)):
        np.testing.assert_array_equal(some.pressure.values[row], whole.pressure.values[ping])


def test_a_ping_that_surges_does_not_depend_on_which_came_before():
    """Rough ground under a sonar that receives longer at some pings than at others: the same bits after another."""
    track = {"kind": "line", "start": (0, 0, 12), "speed": 2.0, "pings": 4, "interval": 0.4, "window": (0.0, 0.06),
             "stop_and_hop": False, "motion": {"surge": {"rms": 0.5, "period": 2.0}}}  # fmt: skip
    rough = {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.2, "outer_scale": 20.0}}
    fan = {"kind": "planar", "length": None, "width": 1.0, "height": 0.02}
    described = nominal(
        seabed=rough, transmit=fan, receive=fan, sonar={"mounting": {"bearing": np.pi / 2, "tilt": np.radians(20)}},
        paths={"max_reflections": 1, "scatterers_per_cell": 1.0},
    )  # fmt: skip
    scenario = type(described)(**{**described.model_dump(), "track": track})
    received = dict(simulate_pings(build_simulator(scenario), [0, 1, 2], 1))
    for ping in (1, 2):
        np.testing.assert_array_equal(received[ping], dict(simulate_pings(build_simulator(scenario), [ping], 1))[ping])


def moving(track, **paths):
    """The nominal scene from a platform that runs along a track."""
    scenario = nominal(box={}, paths=paths, water={"noise_level_db": 40})
    return type(scenario)(**{**scenario.model_dump(), "track": track})


def test_pings_of_a_platform_at_rest_differ_by_noise_and_jitter_only():
    """Without either they are the same bits; with jitter they are not."""
    still = simulate(nominal(track={"pings": 3, **SHORT})).pressure.values
    np.testing.assert_array_equal(still[0], still[2])
    shaken = simulate(nominal(track={"pings": 2, **SHORT}, paths={"jitter": 0.2})).pressure.values
    assert relative_rms(shaken[0], shaken[1]) > 0.1


def test_another_seed_is_another_bed():
    """Two seeds: unrelated echoes, |correlation| below 5 / sqrt(N) with N about 130 cells."""
    first, second = (simulate(nominal(seed=seed, track=SHORT)).pressure.values.ravel() for seed in (1, 2))
    assert abs(np.vdot(first, second)) / (np.linalg.norm(first) * np.linalg.norm(second)) < 0.45


def placed(north, east, turn, lattice=True):
    """The nominal scene with all that is in it moved and turned as a whole: lattice, track, box and point."""

    def moved(x, y):
        c, s = np.cos(turn), np.sin(turn)
        return float(north + c * x - s * y), float(east + s * x + c * y)

    scenario = nominal(
        targets=[
            {"shape": "box", "position": moved(0, 150.5), "size": (2, 1, 1), "heading": turn + 0.2},
            point(*moved(1, 149), 15.0),
        ],
        seabed={"depth": 20, "scatterer_grid": {"origin": moved(0, 0), "heading": turn} if lattice else {}},
        track={"position": (*moved(0, 0), 11.0), "heading": turn, "pitch": 0.02, "roll": 0.01, **SHORT},
    )
    return simulate(scenario).pressure.values


@pytest.mark.parametrize(("north", "east", "turn"), [(1024.0, -512.0, 0.0), (300.7, -4000.1, 0.0), (512.3, 77.7, 2.1)])
def test_a_scene_moved_as_a_whole_sounds_the_same(north, east, turn):
    """No place and no bearing is special: relative rms 1e-6 (seen: 0 to 2e-8).

    Over another piece of the lattice it does not.
    """
    assert relative_rms(placed(north, east, turn), placed(0.0, 0.0, 0.0)) < 1e-6
    assert relative_rms(placed(north, east, turn, lattice=False), placed(0.0, 0.0, 0.0)) > 0.01


def test_the_bed_stays_where_it_is_while_the_platform_passes():
    """Two pings of a line track, 0.2 m apart: the places that both receive are the same points with the same phase."""
    track = {"kind": "line", "start": (0, 0, 11), "heading": 0, "speed": 2.0, "interval": 0.1, "pings": 2,
             "window": (0.09, 0.0905)}  # fmt: skip
    simulator = build_simulator(moving(track, max_reflections=0))
    seen = []
    for ping in range(2):
        blocks = [pairs.scatterers for pairs in simulator.engine.all_pairs(simulator.ping_geometry(ping))]
        seen.append({
            key: (tuple(place), phase) for block in blocks
            for key, place, phase in zip(block.scatterer_id, block.position, block.phase, strict=True)
        })  # fmt: skip
    both = seen[0].keys() & seen[1].keys()
    assert len(both) > 0.5 * len(seen[0])
    assert all(seen[0][key] == seen[1][key] for key in both)


def test_every_place_of_a_ping_has_a_key_of_its_own():
    """Seabed, surface and box together: no two scatterers share a key, so no two share their jitter."""
    scenario = nominal(box={}, surface={"scattering": {"strength_db": -40}}, paths={"max_reflections": 0}, track=SHORT)
    simulator = build_simulator(scenario)
    keys = np.concatenate([p.scatterers.scatterer_id for p in simulator.engine.all_pairs(simulator.ping_geometry(0))])
    assert len(np.unique(keys)) == len(keys) > 8_000


def test_arrivals_written_out_sound_like_the_fast_path():
    """All paths of a narrow ping as rows, jitter included, received row by row: relative rms 1e-5."""
    scenario = nominal(box={}, paths={"jitter": 0.3, "beam_cutoff_db": -30}, track={"window": (0.2, 0.206)})
    simulator = build_simulator(scenario)
    received = coherent_from_arrivals(arrivals(scenario), simulator.ping_geometry(0), simulator.grid)
    assert relative_rms(received, simulate(scenario).pressure.values[0]) < 1e-5
