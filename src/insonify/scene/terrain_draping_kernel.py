"""Points placed on the terrain: plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def drape_points(
    depth: float, height: Floats, slope: Floats, horizontal: Floats, area: Floats, position: Floats, normal: Floats,
    terrain_area: Floats,
) -> None:  # fmt: skip
    """Fill positions, normals and areas on the terrain of points of a mean plane.

    Args:
        depth: Depth of the mean plane [m].
        height: Height of the terrain above it [m], shape (n,).
        slope: Gradient of the height to the north and the east [1], shape (n, 2).
        horizontal: North and east [m], shape (n, 2).
        area: Horizontal area that each point stands for [m^2], shape (n,).
        position: Result: north, east, depth [m], shape (n, 3).
        normal: Result: unit normal into the water: north, east, down [1], shape (n, 3).
        terrain_area: Result: area on the terrain that each point stands for [m^2], shape (n,).
    """
    for n in range(height.size):
        position[n, 0], position[n, 1] = horizontal[n, 0], horizontal[n, 1]
        terrain_area[n] = area[n] * drape_point(n, depth, height[n], slope[n, 0], slope[n, 1], position, normal)


@njit(cache=True, nogil=True)
def drape_point(
    n: int, depth: float, height: float, slope_north: float, slope_east: float, position: Floats, normal: Floats
) -> float:  # fmt: skip
    """Set depth [m] and unit normal of point n; return the ratio of terrain area to horizontal area [1].

    Args:
        n: Row of the point.
        depth: Depth of the mean plane [m].
        height: Height of the terrain above it [m].
        slope_north: Growth of the height to the north [1].
        slope_east: Growth of the height to the east [1].
        position: North, east, depth; the depth of row n is set [m], shape (any, 3).
        normal: Unit normals into the water; row n is set [1], shape (any, 3).
    """
    stretch = math.sqrt(1 + slope_north * slope_north + slope_east * slope_east)
    position[n, 2] = depth - height
    normal[n, 0], normal[n, 1], normal[n, 2] = -slope_north / stretch, -slope_east / stretch, -1 / stretch
    return stretch
