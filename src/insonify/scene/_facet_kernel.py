"""Points laid on the ground: plain numbers and arrays only."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def lay(
    depth: float, height: Floats, slope: Floats, place: Floats, area: Floats, position: Floats, normal: Floats,
    wide: Floats,
) -> None:  # fmt: skip
    """Where points of a mean plane lie on the ground, how they face, and how much ground their area is.

    Args:
        depth: Of the mean plane [m].
        height: Of the ground above it [m], shape (n,).
        slope: Gradient of the height to the north and the east [1], shape (n, 2).
        place: North and east [m], shape (n, 2).
        area: Of the mean plane [m^2], shape (n,).
        position: Result: north, east, depth [m], shape (n, 3).
        normal: Result: unit normal into the water, shape (n, 3).
        wide: Result: area of the ground [m^2], shape (n,).
    """
    for n in range(height.size):
        north, east = slope[n, 0], slope[n, 1]
        stretch = math.sqrt(1 + north * north + east * east)
        position[n, 0], position[n, 1], position[n, 2] = place[n, 0], place[n, 1], depth - height[n]
        normal[n, 0], normal[n, 1], normal[n, 2] = -north / stretch, -east / stretch, -1 / stretch
        wide[n] = area[n] * stretch
