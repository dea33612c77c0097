"""A recording behind a box with soft edges: half the pressure each way on the edge of its shadow."""

import numpy as np
import pytest

from insonify.simulator import arrivals, labels, simulate
from oracles.scenes import nominal

EDGE = 2 * np.hypot(151.0 * 9 / 8, 9.0) / 1500
"""Delay of the bed where the ray over the back of the box lands [s]."""
PULSE = 0.2e-3
BOX = {"label": "box", "size": (20.0, 1.0, 1.0)}
QUIET = {"surface": {"scattering": None}, "field": "incoherent", "track": {"window": (0.203, 0.2285)}}


def scene(edges: str, box: dict | None = None, **settings):
    """Direct paths behind a box 20 m wide."""
    return nominal(
        box=box, paths={"max_reflections": 0, "edge_diffraction": edges, "geometry": "slice"}, **{**QUIET, **settings}
    )


@pytest.fixture(scope="module")
def loss():
    """Time [s] and level behind the box re the same bed without it [dB], with soft edges."""
    free, received = (simulate(scene("knife-edge", box)).intensity for box in (None, BOX))
    return received.time.values, 10 * np.log10(received.values[0, 0] / free.values[0, 0])


def test_the_edge_of_the_shadow_is_12_db_down(loss):
    """1/2 one way is -6 dB, -12 dB both ways: at the hard shadow's end, half a pulse later, to 0.5 dB."""
    time, level = loss
    assert np.interp(EDGE + PULSE / 2, time, level) == pytest.approx(-12.04, abs=0.5)


def test_the_middle_of_the_shadow_is_38_db_down(loss):
    """Where the edge's number is 1.95, -18.9 dB each way: 18.9 * 2 dB down, to 1 dB."""
    time, level = loss
    behind = np.linspace(1, 18, 2000)
    source, edge = np.hypot(151, 8), 151 + behind
    height = 1 - 9 * behind / edge
    number = height * np.sqrt(2 / 0.015 * (1 / np.hypot(behind, 1) + 1 / source))
    near = behind[(behind > 5)][np.argmin(np.abs(number[behind > 5] - 1.95))]
    when = 2 * np.hypot(151 + near, 9) / 1500 + PULSE / 2
    assert np.interp(when, time, level) == pytest.approx(-37.8, abs=1)


def test_hard_edges_leave_nothing_behind_the_box():
    """With hard edges no path reaches the shadow's middle; with soft ones all do, and state what occludes."""
    window = 0.215, 0.2152
    assert len(arrivals(scene("none", BOX), window=window)) == 0
    assert len(arrivals(scene("knife-edge", BOX), window=window)) > 0


def test_a_shadow_ends_where_it_did():
    """Labels: the dark ground ends at the hard shadow's edge under both, within half a pulse."""
    for edges in ("none", "knife-edge"):
        masks = labels(scene(edges, BOX)).isel(channel=0)
        last = masks.time.values[masks.shadow.values].max()
        assert last == pytest.approx(EDGE + PULSE / 2, abs=PULSE / 2)
