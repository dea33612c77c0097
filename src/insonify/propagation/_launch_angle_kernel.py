"""Kernels of launch angles interpolated on a grid of positions. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.floating[Any]]


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate_launch_slope(nodes: Floats, first_depth: float, row_spacing: float, column_spacing: float,
                             distance: Floats, depth: Floats,
               launch_slope: Floats) -> None:  # fmt: skip
    """Launch slope of rays to positions, linear between the nodes of a grid.

    Args:
        nodes: Distance times launch slope at the nodes [m], NaN where there is no ray, (depths, distances).
        first_depth: First depth of the grid [m].
        row_spacing: Spacing of the depths [m].
        column_spacing: Spacing of the distances, the first of which is 0 [m].
        distance: Horizontal distance of the positions [m], (n,), or that of their columns.
        depth: Depths of the positions [m], (m, n).
        launch_slope: Result: NaN outside the grid, (m, n).
    """
    lines, stations = nodes.shape
    column, fraction = np.empty(distance.size, np.int64), np.empty(distance.size)
    for n in range(distance.size):
        u = distance[n] / column_spacing
        column[n] = min(int(u), stations - 2) if 0 < u <= stations - 1 else -1
        fraction[n] = u - column[n]
    for m in range(depth.shape[0]):
        for n in range(depth.shape[1]):
            v, k, u = (depth[m, n] - first_depth) / row_spacing, column[n], fraction[n]
            if k < 0 or not -1e-6 <= v <= lines - 1 + 1e-6:
                launch_slope[m, n] = np.nan
                continue
            i = max(min(math.floor(v), lines - 2), 0)
            v -= i
            nearer = nodes[i, k] + v * (nodes[i + 1, k] - nodes[i, k])
            farther = nodes[i, k + 1] + v * (nodes[i + 1, k + 1] - nodes[i, k + 1])
            launch_slope[m, n] = (nearer + u * (farther - nearer)) / distance[n]


@njit(cache=True, nogil=True, error_model="numpy")
def unturned_distances(
    depth: Floats, ratio: Floats, source_row: int, launch_slope: Floats, range_to_surface: Floats,
    range_to_plane: Floats,
) -> None:  # fmt: skip
    """Horizontal distances of rays that do not turn, from the sonar up to the surface and down to the plane.

    Args:
        depth: Depths of the layers' ends between surface and plane, the sonar's among them [m], (m,).
        ratio: Sound speed at these depths over that at the sonar [1], (m,).
        source_row: Row of the sonar's depth.
        launch_slope: Launch slope of the rays [1], (n,).
        range_to_surface: Result [m], infinite for a ray that turns before, (n,).
        range_to_plane: Result [m], infinite for a ray that turns before, (n,).

    Source: Snell's law over layers of one gradient, as in `_ray_branch_kernel`.
    """
    for n in range(launch_slope.size):
        square = launch_slope[n] * launch_slope[n]
        range_to_surface[n] = range_to_plane[n] = 0.0
        for side in range(2):
            reach, root = 0.0, abs(launch_slope[n])
            j = source_row
            while j != (0 if side == 0 else depth.size - 1):
                k = j - 1 if side == 0 else j + 1
                left = square + (1 - ratio[k]) * (1 + ratio[k])
                after = math.sqrt(max(left, 0.0))
                if left < 0 or root + after == 0:
                    reach = np.inf
                    break
                reach += abs(depth[k] - depth[j]) * (ratio[j] + ratio[k]) / (root + after)
                root, j = after, k
            if side == 0:
                range_to_surface[n] = reach
            else:
                range_to_plane[n] = reach
