"""Wavefront curvature of a leg at the sonar, from which the field at the elements of an array follows.

In the vertical plane the ray tube's width gives the curvature; across it, where rays are straight, the distance does.
See `propagation.aperture_expansion` for higher orders.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation.families import bounce_sequence
from insonify.records.legs import Legs

Floats = NDArray[np.float64]
GRADIENT_HALF_STEP = 0.01
"""Half the depth interval over which a profile's gradient is taken [m]."""
MIN_RADIUS = 1e-9
"""Least radius of a sphere about a point [m]."""
MIN_SINE = 1e-6
"""Sine below which a ray counts as horizontal: its tube does not determine the wavefront [1]."""


@dataclass(frozen=True, slots=True)
class Wavefront:
    """Wavefronts of n legs at the sonar."""

    vertical_curvature: Floats
    """Curvature in the vertical plane [1/m], negative for converging ones, shape (n,)."""
    horizontal_distance: Floats
    """Horizontal distance to the point [m], shape (n,)."""
    sound_speed_gradient: float
    """Growth of the speed of sound with depth at the sonar [1/s]."""
    expansion: Floats
    """Higher orders, see `propagation.aperture_expansion`; (terms, n), or (0, n) for none."""


def wavefront(legs: Legs, row: int, position: Floats, points: Floats, water: Water) -> Wavefront:
    """Wavefronts of one family's legs at the sonar's end.

    With H the second derivatives of travel time at the array: d2T/dR2 = dp/dR = 1 / X', known from the tube's width,
    and the eikonal equation gives H along the ray; the remaining component is H across it.

    Args:
        legs: Legs from that end.
        row: Row of the legs.
        position: North, east, depth of that end [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        water: Water between.

    Source: Cerveny (2001), Seismic Ray Theory, ch. 4 (from memory); checked against exact rays to every element.
    """
    length = legs.length[row]
    distance = np.hypot(points[:, 0] - position[0], points[:, 1] - position[1])
    if not water.layered:
        return Wavefront(1 / np.maximum(length, MIN_RADIUS), distance, 0.0, np.zeros((0, len(distance))))
    depth = float(position[2])
    upper_depth, lower_depth = max(depth - GRADIENT_HALF_STEP, 0.0), depth + GRADIENT_HALF_STEP
    gradient = float(water.sound_speed_at(lower_depth) - water.sound_speed_at(upper_depth)) / (
        lower_depth - upper_depth
    )
    speed, point_speed = float(water.sound_speed_at(depth)), np.asarray(water.sound_speed_at(points[:, 2]), float)
    sine, arrival_sine = legs.departure[row, :, 2], legs.arrival[row, :, 2]
    is_horizontal = (np.abs(sine) < MIN_SINE) | (np.abs(arrival_sine) < MIN_SINE) | (distance < 1e-9)
    cosine = np.sqrt(np.clip(1 - sine**2, 0, 1))
    # Each bounce, and each turning point, reverses a ray's vertical direction: their number is even or odd.
    is_odd = len(bounce_sequence(legs.families[row])) % 2 == 1
    is_turned = ((sine * arrival_sine < 0) != is_odd).astype(int)
    caustic_sign = np.where((legs.caustics[row] - is_turned) % 2 == 0, 1.0, -1.0)
    tube_area = legs.spreading[row] ** 2 * distance * np.abs(arrival_sine)
    ray_tube = caustic_sign * tube_area / np.where(is_horizontal, 1.0, point_speed * cosine)
    curvature_over_speed = ray_tube + gradient * np.sign(sine) * cosine**2 / speed**2
    curvature_over_speed = curvature_over_speed / np.where(is_horizontal, 1.0, np.abs(sine))
    expansion = np.zeros((0, len(distance))) if legs.aperture_expansion is None else legs.aperture_expansion[row]
    curvature = np.where(is_horizontal, 1 / np.maximum(length, 1e-9), speed * curvature_over_speed)
    return Wavefront(curvature, distance, gradient, expansion)
