"""Interpolation of aperture expansions between the nodes of a table. Plain numbers and arrays only."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


class ExpansionNodes(NamedTuple):
    """Expansions of one family at the nodes of a grid."""

    terms: Floats
    """Terms of `aperture_expansion` at each node, shape (depths, distances, terms)."""
    first_depth: float
    """Least depth [m]."""
    depth_step: float
    """Spacing of the depths [m]."""
    first_range: float
    """Least distance [m]."""
    range_step: float
    """Spacing of the distances [m]."""


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate_expansion(
    nodes: ExpansionNodes, distance: Floats, depth: Floats, is_needed: NDArray[np.bool_], terms: Floats,
    is_outside: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Interpolate the expansions of the legs of one family to n points, linearly between the nodes.

    Args:
        nodes: The nodes.
        distance: Horizontal distances of the points [m], (n,).
        depth: Depths of the points [m], (n,).
        is_needed: True for the legs to evaluate, (n,).
        terms: Result, unchanged for other legs and points outside, (terms, n).
        is_outside: Result: True for points outside the grid, (n,).
    """
    lines, columns, count = nodes.terms.shape
    for n in range(distance.size):
        v = (depth[n] - nodes.first_depth) / nodes.depth_step
        u = (distance[n] - nodes.first_range) / nodes.range_step
        is_outside[n] = not (-1e-6 <= v <= lines - 1 + 1e-6 and 0 <= u <= columns - 1)
        if is_outside[n] or not is_needed[n]:
            continue
        i, k = min(max(int(v), 0), lines - 2), min(int(u), columns - 2)
        v, u = v - i, u - k
        above, below = nodes.terms[i], nodes.terms[i + 1]
        for t in range(count):
            upper = above[k, t] + u * (above[k + 1, t] - above[k, t])
            lower = below[k, t] + u * (below[k + 1, t] - below[k, t])
            terms[t, n] = upper + v * (lower - upper)
