"""Legs off explicit waves a part at a time: their number is known late, and memory stays bounded all the same."""

import tracemalloc

import numpy as np

from insonify.engines import memory_budget
from insonify.engines.eigenray_engine import EigenrayEngine
from insonify.scattering.point_target import PointTargetLaw
from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal

BUDGET = 16e6
"""Memory of one part in these tests [bytes]: 1/16 of the usual one, for as much shorter a test."""


def shallow(**changes):
    """718 bubbles just below a rough sea, 85 m from a sonar of 22 kHz: up to 16 bounce points each."""
    school = {"position": (0.0, 85.0, 0.45), "size": (2.0, 2.0, 0.8), "volume_strength_db": -40.0}
    fixed = {
        "surface": {"reflection": "explicit", "wind_speed": 2.6, "swell": {"height": 0.15, "length": 61.0}},
        "water": {"noise_level_db": None, "patches": [school]}, "seabed": {"depth": 20.0},
        "sonar": {"pulse": {"kind": "cw", "frequency": 22e3, "duration": 0.5e-3}},
        "track": {"position": (0.0, 0.0, 4.3), "window": (0.11, 0.12)},
        "paths": {"contributions": ["water"], "max_reflections": 1},
    }  # fmt: skip
    return nominal(**{**fixed, **changes})


def test_points_with_many_bounces_are_bounded_in_memory(monkeypatch):
    """Memory traced while legs and pairs are made is under 16 MB, with five times as many legs as estimated."""
    monkeypatch.setattr(memory_budget, "BYTES_AT_ONCE", BUDGET)
    simulator = build_simulator(shallow())
    here = simulator.ping_geometry(0)
    legs = 0
    for block in simulator.engine.blocks(here):
        points = block()
        list(simulator.engine.pair_batches(here, lambda: points.take(slice(3))))  # noqa: B023
        tracemalloc.start()
        for pairs in simulator.engine.pair_batches(here, lambda: points):  # noqa: B023
            legs = max(legs, len(pairs.transmit_legs.families))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < BUDGET
    assert legs > 40


def test_points_in_parts_echo_as_the_whole(monkeypatch):
    """Parts by the number of bounce points sum to the echo of all points at once, to 1e-5."""
    scenario = shallow()
    made, parts, batches = [], [], EigenrayEngine.pair_batches

    def counted(self, here, block, **more):
        for pairs in batches(self, here, block, **more):
            parts[-1] += 1
            yield pairs

    monkeypatch.setattr(EigenrayEngine, "pair_batches", counted)
    for budget in (1e12, BUDGET):
        monkeypatch.setattr(memory_budget, "BYTES_AT_ONCE", budget)
        parts.append(0)
        made.append(simulate(scenario, threads=1)["pressure"].values)
    assert parts[1] > parts[0]
    assert np.abs(made[0]).max() > 0
    np.testing.assert_allclose(made[1], made[0], rtol=0, atol=1e-5 * np.abs(made[0]).max())


def test_the_section_of_point_targets_takes_no_angles():
    """Without a direction there is one cross section: that of all angles."""
    law = PointTargetLaw(-30.0)
    assert np.ptp(law.cross_section(*np.random.default_rng(1).uniform(0, 1.5, (3, 100)))) == 0
