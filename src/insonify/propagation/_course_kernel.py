"""Ways off a few planes, one after the other, by images. Plain numbers and arrays only."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_TINY = 1e-9


@njit(cache=True, nogil=True, error_model="numpy")
def ways(
    place: Floats, points: Floats, anchor: Floats, facing: Floats, length: Floats, departure: Floats, arrival: Floats,
    bounce: Floats, part: Floats, sine: Floats, there: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Images of a place in planes, and the ways that they unfold.

    Args:
        place: North, east, depth of the sonar [m], (3,).
        points: The same of the points [m], (n, 3).
        anchor: A point of each mirror [m], (m, n, 3).
        facing: Unit normal of each mirror, into the water, (m, n, 3).
        length: Result, of the whole way [m], (n,).
        departure: Result, direction of travel at the sonar, (n, 3).
        arrival: Result, direction of travel at the point, (n, 3).
        bounce: Result, the bounces [m], (m, n, 3).
        part: Result, part of the way that lies before each bounce, (m, n).
        sine: Result, of the grazing angle at each mirror, (m, n).
        there: Result, whether point and sonar lie on the right side of every mirror, (n,).
    """
    count = anchor.shape[0]
    image = np.empty((count + 1, 3))
    for n in range(points.shape[0]):
        image[0] = place
        for k in range(count):
            above = off_plane(image[k], anchor[k, n], facing[k, n])
            for i in range(3):
                image[k + 1, i] = image[k, i] - 2 * above * facing[k, n, i]
        squares = 0.0
        for i in range(3):
            arrival[n, i] = points[n, i] - image[count, i]
            squares += arrival[n, i] * arrival[n, i]
        length[n] = left = max(math.sqrt(squares), 1e-6)
        for i in range(3):
            arrival[n, i] /= length[n]
            departure[n, i] = arrival[n, i]
        there[n] = True
        end = points[n]
        for k in range(count - 1, -1, -1):
            above = off_plane(end, anchor[k, n], facing[k, n])
            below = -off_plane(image[k + 1], anchor[k, n], facing[k, n])
            there[n] = there[n] and above > 0 and below > 0
            behind = min(max(above / max(above + below, _TINY), 0.0), 1.0)
            turned = 0.0
            for i in range(3):
                bounce[k, n, i] = end[i] + behind * (image[k + 1, i] - end[i])
                turned += departure[n, i] * facing[k, n, i]
            for i in range(3):
                departure[n, i] -= 2 * turned * facing[k, n, i]
            left *= 1 - behind
            part[k, n] = left / length[n]
            sine[k, n] = min(abs(turned), 1.0)
            end = bounce[k, n]


@njit(cache=True, nogil=True, error_model="numpy")
def off_plane(place: Floats, anchor: Floats, facing: Floats) -> float:
    """Distance of a place from a plane, positive on the side that it faces [m]; all three of shape (3,)."""
    return (place[0] - anchor[0]) * facing[0] + (place[1] - anchor[1]) * facing[1] + (place[2] - anchor[2]) * facing[2]
