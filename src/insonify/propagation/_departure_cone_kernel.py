"""Directions in which straight rays leave for neighbourhoods on a boundary. Plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def departure_cones(
    position: Floats,
    down: float,
    centre: Floats,
    radius: Floats,
    relief_height: float,
    axis: Floats,
    half_angle: Floats,
) -> None:
    """Middle and half width of the cone of rays to the neighbourhood of each place.

    Args:
        position: North, east, depth of the sonar [m], shape (3,).
        down: How far down the rays lead as they leave, to the image of the boundary [m].
        centre: North and east of the places [m], shape (n, 2).
        radius: How far the neighbourhoods extend [m], shape (n,).
        relief_height: How much farther they do up and down [m].
        axis: Result, unit vectors, shape (n, 3).
        half_angle: Result [rad], shape (n,); pi where the sonar may be in the neighbourhood.
    """
    for n in range(radius.size):
        north, east = centre[n, 0] - position[0], centre[n, 1] - position[1]
        length = math.sqrt(north * north + east * east + down * down)
        around = radius[n] + relief_height
        axis[n, 0], axis[n, 1], axis[n, 2] = north / length, east / length, down / length
        half_angle[n] = math.asin(min(1.0, around / length)) if around < length else math.pi
