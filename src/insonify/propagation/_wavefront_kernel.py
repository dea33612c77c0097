"""Curvature of refracted wavefronts at the sonar: arithmetic of `propagation.wavefront`. Plain numbers and arrays."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]

MIN_SINE = 1e-6
"""Sine below which a ray counts as horizontal: its tube does not determine the wavefront [1]."""


class TubeColumns(NamedTuple):
    """Columns of one row of legs to n points that determine their ray tubes."""

    sine: Floats
    """Sines of the angles of travel below the horizontal at the sonar [1], (n,)."""
    arrival_sine: Floats
    """Sines of the angles of travel below the horizontal at the points [1], (n,)."""
    spreading: Floats
    """Pressures by ray-tube spreading re that at 1 m [1], (n,)."""
    length: Floats
    """Path lengths [m], (n,)."""
    caustics: NDArray[np.uint8]
    """Numbers of caustics touched, (n,)."""
    distance: Floats
    """Horizontal distances [m], (n,)."""
    point_speed: Floats
    """Sound speeds at the points [m/s], (n,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def vertical_curvatures(
    legs: TubeColumns, has_odd_bounces: bool, speed: float, gradient: float, curvature: Floats
) -> None:
    """Curvatures of the wavefronts of one row of legs in the vertical plane.

    Args:
        legs: The legs.
        has_odd_bounces: True for a family with an odd number of bounces.
        speed: Sound speed at the sonar [m/s].
        gradient: Derivative of the sound speed by depth at the sonar [1/s].
        curvature: Result [1/m], (n,); that of a sphere where the ray tube does not determine it.
    """
    for n in range(curvature.size):
        sine, arrival_sine, distance = legs.sine[n], legs.arrival_sine[n], legs.distance[n]
        no_tube = abs(sine) < MIN_SINE or abs(arrival_sine) < MIN_SINE or distance < 1e-9
        if no_tube or legs.spreading[n] == 0:
            curvature[n] = 1 / max(legs.length[n], 1e-9)
            continue
        cosine = math.sqrt(min(max(1 - sine * sine, 0.0), 1.0))
        # each bounce, and each turning point, reverses a ray's vertical direction: their number is even or odd
        is_turned = (sine * arrival_sine < 0) != has_odd_bounces
        caustic_sign = 1.0 if (legs.caustics[n] - int(is_turned)) % 2 == 0 else -1.0
        tube_area = legs.spreading[n] * legs.spreading[n] * distance * abs(arrival_sine)
        ray_tube = caustic_sign * tube_area / (legs.point_speed[n] * cosine)
        sign = 1.0 if sine > 0 else -1.0
        curvature_over_speed = (ray_tube + gradient * sign * (cosine * cosine) / (speed * speed)) / abs(sine)
        curvature[n] = speed * curvature_over_speed
