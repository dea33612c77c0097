"""Tables of aperture expansions: those of the legs to a boundary, by depth and distance from one depth of the sonar.

The terms of `aperture_expansion` change slowly with the point, and amount to nanoseconds: they are evaluated at nodes
and interpolated between them. Close to the vertical they change fast; points there are evaluated one by one, as are all
where several rays, none, or one near a caustic reach a node.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._expansion_table_kernel import ExpansionNodes, interpolate_expansion
from insonify.propagation.aperture_expansion import TERMS, largest_change

Floats = NDArray[np.float64]

NEAREST = 2.0
"""Least distance in a table [m]."""
RANGE_STEP, DEPTH_STEP = 0.25, 0.5
"""Spacing of the distances, and largest spacing of the at least three depths [m]."""
PROBES = 64
"""Number of random positions at which a table is compared with the expansions themselves."""
DELAY_ERROR, LOG_ERROR = 2e-10, 1e-4
"""Largest error of an element's delay [s], and of the logarithm of its pressure [1]."""


class ExpansionTable(NamedTuple):
    """Expansions of some families over depths and distances."""

    nodes: tuple[ExpansionNodes, ...]
    """Nodes of each family."""

    def read(self, distance: Floats, depth: Floats, is_needed: NDArray[np.bool_]) -> tuple[Floats, NDArray[np.bool_]]:
        """Terms of the legs to n points, interpolated.

        Args:
            distance: Horizontal distances of the points [m], (n,).
            depth: Depths of the points [m], (n,).
            is_needed: True for the legs to evaluate, (f, n); others get zeros.

        Returns:
            The terms, see `aperture_expansion.TERMS`, (f, TERMS, n), and True for points outside the table, (n,).
        """
        terms, is_outside = np.zeros((len(self.nodes), TERMS, len(distance))), np.empty(len(distance), bool)
        for row, nodes in enumerate(self.nodes):
            interpolate_expansion(nodes, distance, depth, is_needed[row], terms[row], is_outside)
        return terms, is_outside


def expansion_table(
    evaluate: Callable[[Floats, Floats], Floats | None], depth_limits: tuple[float, float], max_range: float,
    aperture_extent: tuple[float, float],
) -> ExpansionTable | None:  # fmt: skip
    """Table of the expansions of some families; None where they cannot be interpolated.

    Args:
        evaluate: Function of distances and depths [m], (n,): terms of the only ray of each family, (f, TERMS, n), NaN
            for no ray or one near a caustic; None where several rays of a family reach any of the points.
        depth_limits: Least and greatest depth of the points [m].
        max_range: Greatest horizontal distance of the points [m].
        aperture_extent: Largest offset of elements from the array's centre, horizontal and vertical [m].
    """
    low, high = depth_limits[0], max(depth_limits[1], depth_limits[0] + 1e-3)
    depths = np.linspace(low, high, max(3, int(np.ceil((high - low) / DEPTH_STEP)) + 1))
    ranges = NEAREST + RANGE_STEP * np.arange(max(2, int(np.ceil((max_range - NEAREST) / RANGE_STEP)) + 1), dtype=float)
    values = evaluate(np.tile(ranges, len(depths)), np.repeat(depths, len(ranges)))
    if values is None or np.isnan(values).any():
        return None
    by_node = values.reshape(len(values), TERMS, len(depths), len(ranges)).transpose(0, 2, 3, 1)
    table = ExpansionTable(
        tuple(
            ExpansionNodes(np.ascontiguousarray(nodes), low, float(depths[1] - depths[0]), NEAREST, RANGE_STEP)
            for nodes in by_node
        )
    )
    random = np.random.default_rng(0)
    distance, depth = NEAREST * (ranges[-1] / NEAREST) ** random.random(PROBES), random.uniform(low, high, PROBES)
    exact = evaluate(distance, depth)
    if exact is None or np.isnan(exact).any():
        return None
    interpolated, _ = table.read(distance, depth, np.ones((len(values), PROBES), bool))
    delay_error, log_error = largest_change(interpolated - exact, aperture_extent)
    return table if delay_error.max() <= DELAY_ERROR and log_error.max() <= LOG_ERROR else None
