"""Table of refracted rays from one end to nodes of the terrain near each other, by depth and distance.

The slowness over the distance is a smooth function of depth and squared distance, with a limit where the distance is 0,
so that few rays are enough. Plain numbers and arrays only.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.layered_surface_path_kernel import SurfaceWater, refracted_path

Floats = NDArray[np.float64]

TABLE_DEPTH_STEP, TABLE_SQUARE_STEP = 0.006, 0.012
"""Spacing of tabulated rays in depth, re the height of their end above the ground, and in squares of horizontal
distance, re the square of that height [1]."""
TABLE_CLOSE = 1e-9
"""Last Newton step to a tabulated ray, relative [1]."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class SlownessTable(NamedTuple):
    """Horizontal slowness of rays from one end, re that of the reference speed, over their horizontal distance."""

    values: Floats
    """Slowness over distance [1/m], NaN where no ray arrives, (depths, squares of distances); no depths: no table."""
    square_step: float
    """Spacing of the squares of distances, from 0 [m^2]."""
    first_depth: float
    """Least depth [m]."""
    depth_step: float
    """Spacing of the depths [m]."""
    water: SurfaceWater
    """Water at these depths."""


@njit(cache=True, nogil=True, error_model="numpy")
def no_table(water: SurfaceWater) -> SlownessTable:
    """An empty table: each ray is solved."""
    return SlownessTable(np.empty((0, 0)), 1.0, 0.0, 1.0, water)


@njit(cache=True, nogil=True, error_model="numpy")
def slowness_table(
    end: Floats, square: tuple[float, float, float, float], span: tuple[float, float], nodes: int, water: SurfaceWater
) -> SlownessTable:
    """Table of rays from one end to the nodes of a square, so fine that cubics between its entries err by 1e-9.

    Args:
        end: North, east, depth of the end [m], (3,).
        square: Least and greatest north, least and greatest east of the nodes [m].
        span: Least and greatest depth of the nodes [m]; NaN: not known.
        nodes: Number of nodes; none is tabulated where the table would have a sixteenth as many entries.
        water: The water.
    """
    low, high = span
    if not low > end[2]:
        return no_table(water)
    above = low - end[2]
    north = max(abs(square[0] - end[0]), abs(square[1] - end[0]))
    east = max(abs(square[2] - end[1]), abs(square[3] - end[1]))
    square_step = TABLE_SQUARE_STEP * above * above
    columns = max(4, math.ceil((north * north + east * east) / square_step) + 2)
    rows = max(4, math.ceil((high - low) / (TABLE_DEPTH_STEP * above)) + 1)
    if 16 * rows * columns > nodes:
        return no_table(water)
    depth_step, values = max((high - low) / (rows - 1), 1e-9), np.empty((rows, columns))
    for i in range(rows):
        for k in range(columns):
            distance = math.sqrt(k * square_step)
            ray = refracted_path(distance, -end[2], low + i * depth_step, False, water, 0.0, TABLE_CLOSE)
            values[i, k] = water.speed[0] / ray.r_per_p if ray.exists else math.nan
    first = min(max(int(np.searchsorted(water.depth, low)) - 1, 0), water.depth.size - 1)
    knots = slice(first, max(int(np.searchsorted(water.depth, high)), first) + 1)
    layers = SurfaceWater(
        water.depth[knots], water.speed[knots], water.slowness, water.bed, water.bottom_before, water.bottom_after,
        water.last,
    )  # fmt: skip
    return SlownessTable(values, square_step, low, depth_step, layers)


@njit(inline="always")
def _cubic_weights(t: float) -> tuple[float, float, float, float]:
    """Weights of four nodes of the cubic through them, at t from the second in steps of nodes [1]."""
    a, b, c, d = t + 1, t, t - 1, t - 2
    return -b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6


@njit(inline="always")
def _cubic(values: Floats, first: np.uint64, weights: tuple[float, float, float, float]) -> float:
    """Weighted sum of four consecutive values."""
    a, b, c, d = weights
    return (
        a * values[first] + b * values[first + np.uint64(1)] + c * values[first + np.uint64(2)]
        + d * values[first + np.uint64(3)]
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def interpolate_speed(depth: Floats, water: SurfaceWater, speed: Floats) -> None:
    """Sound speed at some depths [m/s], (n,), layer by layer; beyond the knots that of the nearest, as `speed_at`."""
    speed[:] = water.speed[0]
    for j in range(water.depth.size - 1):
        top, thickness = water.depth[j], water.depth[j + 1] - water.depth[j]
        gradient = (water.speed[j + 1] - water.speed[j]) / thickness
        for n in range(depth.size):
            speed[n] += gradient * min(max(depth[n] - top, 0.0), thickness)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def interpolate_slowness(
    depth: Floats, x: float, first_y: float, step: float, table: SlownessTable, per_distance: Floats
) -> None:
    """Slowness over distance of rays to a row of nodes, by cubics of the table; NaN without a table or a ray.

    Args:
        depth: Depths of the nodes [m], (n,).
        x: North of the row re the end [m].
        first_y: East of its first node re the end [m].
        step: Node spacing [m].
        table: The table.
        per_distance: Result [1/m], (n,).
    """
    values, per_square, per_depth = table.values, 1 / table.square_step, 1 / table.depth_step
    if values.shape[0] == 0:
        per_distance[:] = math.nan
        return
    flat, width = values.reshape(values.size), values.shape[1]
    last_row, last_column = values.shape[0] - 4, width - 4
    for j in range(depth.size):
        y = first_y + j * step
        u, v = (x * x + y * y) * per_square, (depth[j] - table.first_depth) * per_depth
        k, i = min(max(int(u) - 1, 0), last_column), min(max(int(v) - 1, 0), last_row)
        across, down = _cubic_weights(u - k - 1), _cubic_weights(v - i - 1)
        first, after = np.uint64(i * width + k), np.uint64(width)
        one, two = _cubic(flat, first, across), _cubic(flat, first + after, across)
        three, four = _cubic(flat, first + after + after, across), _cubic(flat, first + after + after + after, across)
        per_distance[j] = down[0] * one + down[1] * two + down[2] * three + down[3] * four
