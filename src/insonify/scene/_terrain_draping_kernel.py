"""Points placed on the terrain: plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@njit(cache=True, nogil=True)
def drape_points(
    depth: float, height: Floats, slope: Floats, horizontal: Floats, area: Floats, position: Floats, normal: Floats,
    terrain_area: Floats,
) -> None:  # fmt: skip
    """Positions, normals and areas on the terrain of points of a mean plane.

    Args:
        depth: Depth of the mean plane [m].
        height: Height of the terrain above it [m], shape (n,).
        slope: Gradient of the height to the north and the east [1], shape (n, 2).
        horizontal: North and east [m], shape (n, 2).
        area: Area of the mean plane [m^2], shape (n,).
        position: Result: north, east, depth [m], shape (n, 3).
        normal: Result: unit normal into the water, shape (n, 3).
        terrain_area: Result: area of the terrain [m^2], shape (n,).
    """
    for n in range(height.size):
        position[n, 0], position[n, 1] = horizontal[n, 0], horizontal[n, 1]
        terrain_area[n] = area[n] * _drape_point(n, depth, height[n], slope[n, 0], slope[n, 1], position, normal)


@njit(cache=True, nogil=True)
def drape_tiles(
    depth: float, rows: Floats, start: Integers, tile: NDArray[np.int32], rank: NDArray[np.int32], position: Floats,
    normal: Floats, area: Floats, phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> int:  # fmt: skip
    """Place points of tiles on the terrain, in place; points over unknown terrain or land are removed.

    Args:
        depth: Depth of the mean plane [m].
        rows: Height [m] and gradient to the north and the east [1] of points of tiles, shape (any, 3).
        start: First row of each tile.
        tile: Row of each point's tile in `start`, shape (n,).
        rank: Rank of the point in its tile, shape (n,).
        position: North and east [m]; the depth is a result, shape (n, 3).
        normal: Result, unit normal into the water, shape (n, 3).
        area: Area of the mean plane, replaced by that of the terrain [m^2], shape (n,).
        phase: Unit phasors of the points [1], shape (n,).
        key: Keys of the points, shape (n,).

    Returns:
        Number m of the remaining points, which are the first m rows of all columns.
    """
    m = 0
    for n in range(tile.size):
        row = start[tile[n]] + rank[n]
        if not rows[row, 0] < depth:  # a hole, or land
            continue
        position[m, 0], position[m, 1], phase[m], key[m] = position[n, 0], position[n, 1], phase[n], key[n]
        area[m] = area[n] * _drape_point(m, depth, rows[row, 0], rows[row, 1], rows[row, 2], position, normal)
        m += 1
    return m


@njit(cache=True, nogil=True)
def _drape_point(
    n: int, depth: float, height: float, north: float, east: float, position: Floats, normal: Floats
) -> float:  # fmt: skip
    """Set depth and normal of point n from height and slope; return the ratio of terrain area to horizontal area."""
    stretch = math.sqrt(1 + north * north + east * east)
    position[n, 2] = depth - height
    normal[n, 0], normal[n, 1], normal[n, 2] = -north / stretch, -east / stretch, -1 / stretch
    return stretch
