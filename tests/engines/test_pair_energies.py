"""Claims about energies of pairs along radials: each is that of its points, with the beams towards them."""

import numpy as np
import pytest

from insonify.engines.fast_reverberation._sample_allocation_kernel import POINTS_TOGETHER, pair_energies
from insonify.sonar.array import PlanarArray
from insonify.sonar.beam import beams

EDGES = np.linspace(2.0, 60.0, 13)
PAIR, IS_ODD = np.array([[0, 0], [0, 1], [1, 1]]), np.array([False, True])


@pytest.mark.parametrize("element", ["baffled", "piston", "cosine"])
@pytest.mark.parametrize("same", [True, False])
def test_energies_are_sums_over_two_or_five_points_of_each_range_bin(element, same):
    """Narrow radials and wide ones, some of them shorter than the bins, of two beams: by one gain at a time."""
    rng, count, heading = np.random.default_rng(5), 90, 0.4
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    ends = [
        beams(PlanarArray(width=w, height=0.03, columns=4, rows=2, element=element, steer=(0.1,)), 60e3, 1500.0, turn)
        for w in (0.06, 0.06 if same else 0.09)
    ]
    bearing, width = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.01, 0.2, count)
    start, stop = rng.uniform(0, 20, count), rng.uniform(25, 70, count)
    spread, blank = np.where(np.arange(count) % 3 == 0, 0.0, width), np.zeros(count)
    radials = np.column_stack(
        [np.cos(bearing), np.sin(bearing), width, spread, start, stop, blank, np.arange(count), blank + 1]
    )
    verticals, strength = rng.uniform(5, 30, (2, 12)), rng.uniform(0.5, 2.0, (3, 12))
    energy = np.empty((count, 12, 3), np.float32)
    pair_energies(radials, heading, EDGES, verticals, IS_ODD, PAIR, strength, *(end.kernel_tables for end in ends),
                  same, energy)  # fmt: skip
    expected, points = np.zeros(energy.shape), 0
    for s, b in np.ndindex(count, 12):
        near, far = max(EDGES[b], start[s]), min(EDGES[b + 1], stop[s])
        order = [1, 0] if spread[s] == 0 else [2, 3, 4, 0, 1]
        for k, place in enumerate(order if far > near else []):
            angle = spread[s] * ((k + 0.5) / len(order) - 0.5)
            c, d = np.cos(bearing[s] + heading), np.sin(bearing[s] + heading)
            distance = near + (far - near) * (place + 0.5) / len(order)
            leg = np.hypot(distance, verticals[:, b])
            down = np.where(IS_ODD, -1, 1) * verticals[:, b] / leg
            ray = np.column_stack([(c - d * angle) * distance / leg, (d + c * angle) * distance / leg, down])
            (out,), (back,) = (end.gain(ray) for end in ends)
            area = 0.5 * (far**2 - near**2) * width[s] / len(order)
            both = out[0] * back[0], out[0] * back[1] + out[1] * back[0], out[1] * back[1]
            expected[s, b] += area * strength[:, b] * np.square(both)
            points += 1
    np.testing.assert_allclose(energy, expected, rtol=1e-5, atol=1e-12 * expected.max())
    assert points > 4 * POINTS_TOGETHER and (energy > 0).any(axis=(0, 1)).all()
