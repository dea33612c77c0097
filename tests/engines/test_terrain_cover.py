"""Terrain that hides much of the seabed is recognised, and the general engine then gives the expected intensity."""

import numpy as np
import pytest

from engines.test_fast_reverberation import quickly, thoroughly
from insonify.engines.terrain_cover import MAX_HIDDEN_FRACTION, hidden_fraction
from insonify.records.legs import LegStatus
from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal

STEP = 2e-3


def scene(rms, window, edges="none", **changes):
    """Power-law relief of some height [m] without targets, direct paths, an expectation."""
    relief = {"kind": "power-law", "hurst": 0.8, "rms": rms, "outer_scale": 10.0}
    return nominal(
        seabed={"relief": relief, "seed": 3}, track={"window": window}, field="incoherent",
        paths={"edge_diffraction": edges, "contributions": ["seabed"], "max_reflections": 0}, **changes,
    )  # fmt: skip


def levels_db(series, time):
    """Level of each 2 ms [dB]."""
    each = round(STEP / (time[1] - time[0]))
    count = len(series) // each
    return 10 * np.log10(series[: count * each].reshape(count, each).mean(axis=1))


@pytest.mark.parametrize("rms", [0.05, 0.1, 0.2])
def test_the_part_that_terrain_hides_is_that_of_the_legs(rms):
    """Profiles of five bearings against the even points of a ping within 0.1 rad of the beam, by area: to 0.06."""
    simulator = build_simulator(scene(rms, (0.06, 0.13)))
    here = simulator.ping_geometry(0)
    hidden = whole = 0.0
    for block in simulator.engine.blocks(here, quadrature=True):
        points = block()
        out = simulator.engine.path_pairs(here, points).transmit_legs
        way = points.position - here.transmit_position
        ahead = np.abs(way[:, 0]) < 0.1 * way[:, 1]
        weight = points.area / np.hypot(way[:, 0], way[:, 1]) * ahead
        hidden, whole = hidden + weight[out.status[0] != LegStatus.CLEAR].sum(), whole + weight.sum()
    assert hidden_fraction(simulator.engine.scene.seabed.terrain, here) == pytest.approx(hidden / whole, abs=0.06)


def test_a_level_or_gentle_bed_hides_nothing_and_keeps_the_fast_path():
    """Relief of 2 cm to 100 m: not one position in a hundred is hidden, and the fast path serves."""
    simulator = build_simulator(scene(0.02, (0.03, 0.13)))
    here = simulator.ping_geometry(0)
    assert hidden_fraction(simulator.engine.scene.seabed.terrain, here) < 0.01
    assert simulator.fast_reverberation(here) is not None


@pytest.mark.parametrize("edges", ["none", "knife-edge"])
def test_what_ridges_leave_is_that_of_many_points(edges):
    """10 cm of relief, 100 to 140 m away, a third hidden: 2 ms down to 20 dB below the median like 20 points a cell.

    To 0.3 dB with soft edges, 0.6 dB with hard ones, which fall on either side of a point. The fast path itself is off
    by more than 1 dB.
    """
    scenario = scene(0.1, (0.13, 0.19), edges)
    simulator = build_simulator(scenario)
    assert hidden_fraction(simulator.engine.scene.seabed.terrain, simulator.ping_geometry(0)) > 2 * MAX_HIDDEN_FRACTION
    assert simulator.fast_reverberation(simulator.ping_geometry(0)) is None
    many = scenario.model_copy(update={"paths": scenario.paths.model_copy(update={"scatterers_per_cell": 20.0})})
    time = simulator.grid.time
    truth = levels_db(thoroughly(build_simulator(many))[0], time)
    strong = truth > np.median(truth) - 20
    found = levels_db(simulate(scenario, threads=1).intensity.values[0, 0], time)
    assert np.abs(found - truth)[strong].max() < (0.3 if edges == "knife-edge" else 0.6)
    assert np.abs(levels_db(quickly(simulator)[0], time) - truth)[strong].max() > 1.0
