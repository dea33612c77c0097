"""Kernels of departure cones: directions of rays to neighbourhoods on a boundary. Plain numbers and arrays."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


class DepartureAngles(NamedTuple):
    """Departure of the rays of f families from one depth of the sonar to a boundary.

    Straight rays have a vertical travel. Refracted ones have the extremes of their launch angles over 2^k columns of a
    travel-time curve, from each of m columns on, k from 0: least +inf and greatest -inf where there is no ray.
    """

    vertical_travel: Floats
    """Vertical travel of straight departing rays to the image of the boundary, positive down [m], (f,)."""
    relief_height: float
    """Largest deviation of the boundary from its depth, which widens the cones of straight rays [m]."""
    range_step: float
    """Spacing of the columns in horizontal distance [m]."""
    least: Floats
    """Least launch angle of refracted rays [rad, + down], (f, k, m); (f, 0, 0) for straight rays."""
    greatest: Floats
    """Greatest launch angle of refracted rays [rad, + down], of the same shape."""


@njit(cache=True, nogil=True, error_model="numpy")
def departure_cones(
    angles: DepartureAngles, family: int, position: Floats, centre: Floats, radius: Floats, axis: Floats,
    half_angle: Floats, exists: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Write axis and half angle of the cone of rays to each of n neighbourhoods.

    Args:
        angles: Departure of the rays.
        family: Row of the family.
        position: North, east, depth of the sonar [m], shape (3,).
        centre: North and east of the neighbourhoods' centres [m], shape (n, 2).
        radius: Radii of the neighbourhoods [m], shape (n,).
        axis: Result: unit vectors, shape (n, 3).
        half_angle: Result [rad], shape (n,); pi where the sonar may be in the neighbourhood.
        exists: Result: False where no ray reaches the neighbourhood, shape (n,).
    """
    if angles.least.size:
        _refracted_cones(angles, family, position, centre, radius, axis, half_angle, exists)
        return
    vertical_travel = angles.vertical_travel[family]
    for n in range(radius.size):
        north, east = centre[n, 0] - position[0], centre[n, 1] - position[1]
        length = math.sqrt(north * north + east * east + vertical_travel * vertical_travel)
        extent = radius[n] + angles.relief_height
        axis[n, 0], axis[n, 1], axis[n, 2] = north / length, east / length, vertical_travel / length
        half_angle[n] = math.asin(min(1.0, extent / length)) if extent < length else math.pi
        exists[n] = True


@njit(cache=True, nogil=True, error_model="numpy")
def _refracted_cones(
    angles: DepartureAngles, family: int, position: Floats, centre: Floats, radius: Floats, axis: Floats,
    half_angle: Floats, exists: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Write the cones of refracted rays; arguments as in `departure_cones`."""
    for n in range(radius.size):
        north, east = centre[n, 0] - position[0], centre[n, 1] - position[1]
        distance = math.hypot(north, east)
        low, high = launch_angle_bounds(angles, family, distance - radius[n], distance + radius[n])
        exists[n] = low <= high
        if low > high:
            low = high = 0.0
        middle = (low + high) / 2
        cosine = math.cos(middle)
        axis[n, 0], axis[n, 1] = (
            (cosine * north / distance, cosine * east / distance) if distance > 0 else (cosine, 0.0)
        )
        axis[n, 2] = math.sin(middle)
        half_azimuth = math.asin(radius[n] / distance) if radius[n] < distance else math.pi
        max_cosine = math.cos(0.0 if low * high <= 0 else min(abs(low), abs(high)))
        half_angle[n] = min(math.hypot((high - low) / 2, half_azimuth * max_cosine), math.pi)


@njit(cache=True, nogil=True, error_model="numpy")
def launch_angle_bounds(angles: DepartureAngles, family: int, nearest: float, farthest: float) -> tuple[float, float]:
    """Least and greatest launch angle of refracted rays to an interval of distances [rad].

    Args:
        angles: Departure of the rays.
        family: Row of the family.
        nearest: Least horizontal distance [m].
        farthest: Greatest horizontal distance [m].

    Returns:
        The angles, + down; +inf and -inf for no ray.
    """
    last = angles.least.shape[2] - 1
    # One more column on each side: rays between two columns are bounded by both.
    first = min(max(math.floor(nearest / angles.range_step) - 1, 0), last)
    stop = min(max(math.ceil(farthest / angles.range_step) + 1, 0), last)
    power = 0
    while (2 << power) <= stop - first + 1:
        power += 1
    second = stop - (1 << power) + 1
    low = min(angles.least[family, power, first], angles.least[family, power, second])
    return low, max(angles.greatest[family, power, first], angles.greatest[family, power, second])
