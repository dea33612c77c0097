"""Claims about the work of legs off explicit waves: as many bounce points, and searches, as a run has."""

import numpy as np
import pytest

import insonify
from insonify.estimates import unit_costs
from insonify.estimates.wave_work import wave_leg_seconds
from insonify.propagation import explicit_surface
from insonify.simulator import build_simulator
from oracles.scenes import nominal

WIDE = {"transmit": {"kind": "line", "length": 0.02}, "receive": {"kind": "line", "length": 0.02}}


@pytest.mark.parametrize(("wind_speed", "reach"), [(2.5, 0.06), (2.5, 0.12), (5.0, 0.06)])
def test_the_work_of_waves_follows_searches_and_bounce_points(monkeypatch, wind_speed, reach):
    """Bounce points that a run evaluates, priced, are 0.4 to 1.2 of an estimate that has the search as well.

    Near scatterers, above which the surface is steep to few rays, take less.
    """
    scenario = nominal(
        surface={"reflection": "explicit", "wind_speed": wind_speed}, sonar=WIDE,
        track={"window": (0.8 * reach, reach)},
        paths={"max_reflections": 1, "contributions": ["seabed"], "scatterers_per_cell": 0.3},
    )  # fmt: skip
    seen, search = [], explicit_surface.bounce_points

    def spied(start, ends, is_transmit, waves, water, limits, count, points):
        search(start, ends, is_transmit, waves, water, limits, count, points)
        distance = np.hypot(*(ends.position[:, :2] - start[:2]).T)
        seen.append((waves.shape[1], len(ends.first) - 1, count.mean(), count.max(), distance.mean()))

    monkeypatch.setattr(explicit_surface, "bounce_points", spied)
    insonify.simulate(scenario, pings=0)
    waves, searches, mean, most, distance = max(seen, key=lambda one: one[1])
    simulator = build_simulator(scenario)
    each = waves * unit_costs.SECONDS_PER_WAVE + unit_costs.SECONDS_PER_WAVE_NODE
    bounces = 2 * (5 * mean * each + (most - 1) * unit_costs.SECONDS_PER_BOUNCE_ROW)
    total = wave_leg_seconds(simulator, 11.0, 20.0, np.array([distance]), np.full(1, np.inf))[0]
    assert searches > 100 and 0.4 < bounces / total < 1.2
    near = wave_leg_seconds(simulator, 11.0, 20.0, np.array([distance / 4]), np.full(1, np.inf))[0]
    assert near < 0.8 * total


def test_scatterers_in_one_cell_share_a_search():
    """A thousand scatterers in each cell cost less than half of those that lie apart."""
    scenario = nominal(surface={"reflection": "explicit", "wind_speed": 3.0}, paths={"max_reflections": 1})
    simulator, distance = build_simulator(scenario), np.array([40.0])
    apart, together = (wave_leg_seconds(simulator, 11.0, 20.0, distance, np.full(1, cell)) for cell in (np.inf, 1e-4))
    assert together < apart / 2
