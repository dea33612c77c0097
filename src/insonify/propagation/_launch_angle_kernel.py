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
    """Write the launch slope of rays to positions: distance times slope is linear between the nodes of a grid.

    Args:
        nodes: Distance times launch slope at the nodes [m], NaN where there is no ray, (depths, distances).
        first_depth: First depth of the grid [m].
        row_spacing: Spacing of the depths [m].
        column_spacing: Spacing of the distances, the first of which is 0 [m].
        distance: Horizontal distance of the positions of each column [m], (n,).
        depth: Depths of the positions [m], (m, n).
        launch_slope: Result [1], NaN outside the grid, (m, n).
    """
    (lines, columns), count, one = nodes.shape, distance.size, np.uint32(1)
    column, fraction, divisor = np.empty(count, np.uint32), np.empty(count), np.empty(count)
    for n in range(count):
        u = distance[n] / column_spacing
        is_inside = 0 < u <= columns - 1
        k = min(int(u), columns - 2) if is_inside else 0
        column[n], fraction[n], divisor[n] = k, u - k, distance[n] if is_inside else np.nan
    flat, width, last = nodes.reshape(nodes.size), np.uint32(columns), float(lines - 2)
    node, down, corner = np.empty(count, np.uint32), np.empty(count), np.empty((4, count))
    near_above, far_above, near_below, far_below = corner[0], corner[1], corner[2], corner[3]
    for m in range(depth.shape[0]):
        positions, result = depth[m], launch_slope[m]
        for n in range(np.uint64(count)):  # several loops: compilers vectorise those that read no table
            v = (positions[n] - first_depth) / row_spacing
            above = v if v > 0.0 else 0.0  # 0 for NaN too
            i = np.uint32(above if above < last else last)
            node[n] = i * width + column[n]
            down[n] = v - np.float64(i) if (v >= -1e-6) & (v <= last + 1 + 1e-6) else np.nan
        for n in range(np.uint64(count)):
            at = node[n]
            near_above[n], far_above[n] = flat[at], flat[at + one]
            near_below[n], far_below[n] = flat[at + width], flat[at + width + one]
        for n in range(np.uint64(count)):
            nearer = near_above[n] + down[n] * (near_below[n] - near_above[n])
            farther = far_above[n] + down[n] * (far_below[n] - far_above[n])
            result[n] = (nearer + fraction[n] * (farther - nearer)) / divisor[n]


@njit(cache=True, nogil=True, error_model="numpy")
def unturned_distances(
    depth: Floats, ratio: Floats, source_row: int, launch_slope: Floats, range_to_surface: Floats,
    range_to_plane: Floats,
) -> None:  # fmt: skip
    """Write the horizontal distances of rays from the sonar up to the surface and down to the plane without a turn.

    Args:
        depth: Depths of the knots from surface to reflecting plane, with that of the sonar [m], (m,).
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
                squared_after = square + (1 - ratio[k]) * (1 + ratio[k])
                after = math.sqrt(max(squared_after, 0.0))
                if squared_after < 0 or root + after == 0:
                    reach = np.inf
                    break
                reach += abs(depth[k] - depth[j]) * (ratio[j] + ratio[k]) / (root + after)
                root, j = after, k
            if side == 0:
                range_to_surface[n] = reach
            else:
                range_to_plane[n] = reach
