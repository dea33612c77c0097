"""Claims about legs in layered water that only their use together shows: folds, ends apart, sides, dives, low notes."""

import warnings

import numpy as np
import pytest

from insonify.propagation.eigenray_tables import MAX_TABLES, exact_rays
from insonify.propagation.propagation_model import RayDomain
from insonify.propagation.refracted_rays import refracted_rays
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scenario.scenario import Scenario
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.simulator import build_simulator
from oracles.scenes import nominal
from oracles.wave import direct_field

DEPTH = 20.0
THERMO = [[0.0, 1510.0], [8.0, 1510.0], [14.0, 1490.0], [20.0, 1490.0]]
CAUSTIC = [[0.0, 1510.0], [4.0, 1510.0], [8.0, 1490.0], [20.0, 1490.0]]
LOW_BOX = {"shape": "box", "position": (2.0, 60.0), "size": (6.0, 4.0, 3.0)}


def rays(profile, *, targets=(), sources=(11.0,), spanned=False, depths=(0.0, DEPTH), farthest=200.0):
    """The curved rays of twenty metres of such water, which takes nothing of the sound."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # corners of these profiles are meant
        water = {"profile": profile, "absorption_db_per_m": 0.0}
        scene = Scene(water=water, seabed={"depth": DEPTH, "reflection": "medium sand"}, targets=targets)
    return refracted_rays(scene, RayDomain(sources, spanned, depths, farthest))


def points(away, depth, boundary="target"):
    """Points to the east of the sonar; on the seabed they face up."""
    away, depth = np.broadcast_arrays(np.asarray(away, float), depth)
    n = away.size
    place = np.column_stack([np.zeros(n), away, depth])
    normal = np.tile((0.0, 0.0, -1.0) if boundary == "seabed" else (0.0, 0.0, 0.0), (n, 1))
    return Scatterers(
        boundary, boundary, PointTargetLaw(0.0), place, normal, np.ones(n), np.ones(n, complex),
        np.arange(n, dtype=np.uint64), False, -1,
    )  # fmt: skip


def sonar(depth=11.0, east=0.0):
    """A place of one end."""
    return np.array([0.0, east, depth])


def test_legs_at_a_fold_add_up_to_the_wave():
    """From right beyond a fold on, the engine's own legs are within 8 % of the wave, in amplitude and phase.

    At 20 kHz; rays without the limit come out 8 dB too strong there, and without the phase of their merging 15 deg off.
    """
    away, frequency = np.linspace(129.3, 135, 24), 20e3
    legs = rays(CAUSTIC).legs(sonar(), points(away, 12.0), ("D",), frequency)
    assert np.all(legs.status == LegStatus.CLEAR) and len(legs.families) == 3
    ours = np.sum(legs.amplitude * np.exp(-2j * np.pi * frequency * legs.delay), axis=0)
    wave = direct_field([4.0, 8.0], [1510.0, 1490.0], 11.0, 12.0, away, frequency)
    assert np.abs(ours - wave).max() < 0.08 * np.abs(wave).max()


def test_ends_far_apart_receive_no_ground_beyond_their_reach():
    """Transmitter and receiver 30 m apart: every place whose pair of legs falls into the window is within reach."""
    water, families, window = rays(THERMO), ("D", "S", "BS"), (0.12, 0.15)
    away = np.linspace(1, 190, 2000)
    bed = points(away, DEPTH, "seabed")
    for east in (-30.0, 30.0):
        ring = water.reachable_range((11.0, 11.0), DEPTH, families, (window[0] / 2, window[1] / 2), 30.0)
        out = water.legs(sonar(), bed, families, 100e3)
        back = water.legs(sonar(east=east), bed, families, 100e3)
        delay = [np.where(legs.status == LegStatus.CLEAR, legs.delay, np.nan) for legs in (out, back)]
        pair = delay[0][:, None] + delay[1][None]
        received = away[np.any((pair >= window[0]) & (pair <= window[1]), axis=(0, 1))]
        assert ring.nearest <= received.min() and received.max() <= ring.farthest


def test_both_ends_and_both_sides_read_tables():
    """Ends at two depths, and two sides on a rolling hull: each is at a depth that a table was made for."""
    scenario = nominal(
        water={"noise_level_db": None, "profile": THERMO}, transmit={"offset": (0.0, 0.5, 0.0)},
        receive={"offset": (0.0, 0.5, 1.0)}, sonar={"sides": ["port", "starboard"]},
    )  # fmt: skip
    swing = {"roll": {"rms": 0.1, "period": 6.0}}
    for pings, motion in ((1, {}), (3, swing)):
        line = {"kind": "line", "start": (0.0, 0.0, 11.0), "speed": 2.0, "pings": pings, "window": (0.1, 0.13)}
        simulator = build_simulator(Scenario(**{**scenario.model_dump(), "track": {**line, "motion": motion}}))
        tables = simulator.engine.rays.tables
        for ping in range(pings):
            for here in simulator.ping_geometries(ping):
                for place in (here.transmit_position, here.receive_position):
                    tables.rays("D", "seabed", float(place[2]), np.array([DEPTH]), np.array([90.0]))
                    assert any(table.covers(place[2]) for table in tables.tables.values())


@pytest.mark.parametrize("boundary", ["seabed", "target"])
def test_a_dive_does_not_fill_the_memory(boundary):
    """A sonar that dives through 14 m: few tables are kept, each of a few depths, and where they meet nothing jumps."""
    water = rays(THERMO, targets=(LOW_BOX,), sources=(2.0, 16.0), spanned=True, depths=(19.0, 20.0), farthest=60.0)
    away, random = np.linspace(5, 55, 100), np.random.default_rng(2)
    depth = np.full(100, DEPTH) if boundary == "seabed" else random.uniform(19, 20, 100)
    for source in (2.0, 3.7, 4.0, 6.0, 9.3, 11.0, 14.0, 15.99, 16.0, 2.0):
        read = water.tables.rays("S", boundary, source, depth, away)
        solved = exact_rays(water.layers, "S", source, depth, away)
        np.testing.assert_array_equal(read.count, solved.count)
        np.testing.assert_allclose(read.rays[:, 0, 0], solved.rays[:, 0, 0], rtol=0, atol=1e-9)
        tables = water.tables.tables.values()
        assert len(tables) <= MAX_TABLES and any(table.covers(source) for table in tables)
        assert max(table.planes[-1].source_depth - table.planes[0].source_depth for table in tables) <= 2


def test_a_run_in_parts_reads_the_same_tables():
    """What was requested before, and what was put away since, changes no bit."""
    away, depths = np.linspace(5, 55, 200), (2.5, 15.0, 5.1, 8.0, 12.2, 2.5, 5.1)
    spans = {"targets": (LOW_BOX,), "sources": (2.0, 16.0), "spanned": True, "depths": (19.0, 20.0), "farthest": 60.0}
    whole = rays(THERMO, **spans).tables
    for source in depths:
        alone = rays(THERMO, **spans).tables
        one, other = (tables.rays("D", "target", source, np.full(200, 19.5), away) for tables in (whole, alone))
        np.testing.assert_array_equal(one.rays, other.rays)


def test_low_notes_feel_a_fold_from_afar():
    """At 1 kHz, read from tables or solved for: legs within 0.02 dB of each other beside a caustic too."""
    away, depth = np.linspace(100, 190, 900), np.random.default_rng(0).uniform(4, 20, 900)
    water = rays(CAUSTIC, targets=(LOW_BOX,))
    read = water.legs(sonar(), points(away, depth), ("D",), 1e3)
    solved = rays(CAUSTIC).legs(sonar(), points(away, depth), ("D",), 1e3)  # without bodies each ray is solved for
    there = (read.status == LegStatus.CLEAR) & (solved.status == LegStatus.CLEAR)
    assert np.abs(20 * np.log10(np.abs(read.amplitude[there] / solved.amplitude[there]))).max() < 0.02
