"""Kernel of departure cones: directions of straight rays to neighbourhoods on a boundary. Plain numbers and arrays."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def departure_cones(
    position: Floats, vertical_travel: float, centre: Floats, radius: Floats, relief_height: float, axis: Floats,
    half_angle: Floats,
) -> None:  # fmt: skip
    """Axis and half angle of the cone of rays to each neighbourhood.

    Args:
        position: North, east, depth of the sonar [m], shape (3,).
        vertical_travel: Vertical travel of the departing rays to the image of the boundary [m].
        centre: North and east of the neighbourhoods' centres [m], shape (n, 2).
        radius: Radii of the neighbourhoods [m], shape (n,).
        relief_height: Largest deviation of their depth [m].
        axis: Result: unit vectors, shape (n, 3).
        half_angle: Result [rad], shape (n,); pi where the sonar may be in the neighbourhood.
    """
    for n in range(radius.size):
        north, east = centre[n, 0] - position[0], centre[n, 1] - position[1]
        length = math.sqrt(north * north + east * east + vertical_travel * vertical_travel)
        extent = radius[n] + relief_height
        axis[n, 0], axis[n, 1], axis[n, 2] = north / length, east / length, vertical_travel / length
        half_angle[n] = math.asin(min(1.0, extent / length)) if extent < length else math.pi
