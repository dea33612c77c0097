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
        terrain_area[n] = area[n] * drape_point(n, depth, height[n], slope[n, 0], slope[n, 1], position, normal)


@njit(cache=True, nogil=True)
def drape_point(
    n: int, depth: float, height: float, north: float, east: float, position: Floats, normal: Floats
) -> float:  # fmt: skip
    """Set depth and normal of point n from height and slope; return the ratio of terrain area to horizontal area."""
    stretch = math.sqrt(1 + north * north + east * east)
    position[n, 2] = depth - height
    normal[n, 0], normal[n, 1], normal[n, 2] = -north / stretch, -east / stretch, -1 / stretch
    return stretch
