"""Kernel of displaced bounces: unfolded lines with a corner at every bounce on slightly tilted planes.

Plain numbers and arrays only. A line is unfolded: it runs from the sonar over a horizontal distance ahead and a
vertical travel, and reaches the reflecting boundary after given parts of the vertical travel (heights).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]

STEEPEST = 0.4
"""Largest slope of the boundary along the line; greater ones are limited to it [1]."""
WIDEST = 0.9
"""Largest displacement of a bounce to the side, as a fraction of the distance to either end [1]."""


class SurfaceBounces(NamedTuple):
    """Vertical sequence of an unfolded line with bounces on tilted planes."""

    starts_upward: bool
    """True if the line begins upwards."""
    reverses_vertically: bool
    """True for a line that ends in the vertical direction opposite to that in which it begins."""
    heights: Floats
    """Vertical travel up to each bounce [m], (b,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def bounce_offset(
    horizontal_distance: float, vertical_travel: float, height: float, along: float, across: float
) -> tuple[float, float]:
    """Position of one displaced bounce: distance ahead of the sonar, and displacement to the right [m].

    Args:
        horizontal_distance: Horizontal distance of the end of the line [m].
        vertical_travel: Vertical travel of the whole line [m].
        height: Vertical travel up to the bounce [m].
        along: Slope of the boundary ahead [1].
        across: Slope of the boundary to the right [1].
    """
    h2 = max(vertical_travel - height, 1e-6)
    slope = min(max(along, -STEEPEST), STEEPEST)
    # tan(g1 - g2) = tan 2 e with g1 = atan(height / x) and g2 = atan(h2 / (horizontal_distance - x)): a quadratic in x.
    tangent = 2 * slope / (1 - slope * slope)
    linear, constant = height + h2 + tangent * horizontal_distance, horizontal_distance - tangent * h2
    root = math.sqrt(max(linear * linear - 4 * tangent * height * constant, 0.0))
    x = 2 * height * constant / max(linear + root, 1e-12)
    r1 = math.sqrt(x * x + height * height)
    r2 = math.sqrt((horizontal_distance - x) * (horizontal_distance - x) + h2 * h2)
    limit = WIDEST * min(r1, r2)
    # to first order, and to the side on which the boundary falls: offset = -2 slope sin(grazing) / (1 / r1 + 1 / r2)
    right = -across * (height / r1 + h2 / r2) / (1 / r1 + 1 / r2)
    return x, min(max(right, -limit), limit)


@njit(cache=True, nogil=True, error_model="numpy")
def displaced_bounce_path(
    horizontal_distance: float, vertical_travel: float, north: float, east: float, bounces: SurfaceBounces,
    slopes: Floats, change: Floats,
) -> None:  # fmt: skip
    """Write the changes of one line by displaced bounces.

    Args:
        horizontal_distance: Horizontal distance of the end of the line [m].
        vertical_travel: Vertical travel of the whole line [m].
        north: Horizontal unit vector ahead, north component.
        east: East component of the unit vector.
        bounces: The b bounces of the line.
        slopes: Slope of the boundary ahead and to the right at each bounce [1], (b, 2).
        change: Result: additional length [m]; changes of the unit vectors of travel at sonar and end [1], (7,).
    """
    heights = bounces.heights
    length = math.sqrt(horizontal_distance * horizontal_distance + vertical_travel * vertical_travel)
    flat_cosine, flat_sine = horizontal_distance / length, vertical_travel / length
    down = -1.0 if bounces.starts_upward else 1.0
    px, py, pz, total = 0.0, 0.0, 0.0, 0.0
    for b in range(heights.size + 1):
        x, y, z = horizontal_distance, 0.0, vertical_travel
        if b < heights.size:
            x, y = bounce_offset(horizontal_distance, vertical_travel, heights[b], slopes[b, 0], slopes[b, 1])
            z = heights[b]
        dx, dy, dz = x - px, y - py, z - pz
        segment_length = math.sqrt(dx * dx + dy * dy + dz * dz)
        total += segment_length
        px, py, pz = x, y, z
        if b == 0 or b == heights.size:
            sense = down if b == 0 or not bounces.reverses_vertically else -down
            forward, right, to = dx / segment_length - flat_cosine, dy / segment_length, 1 if b == 0 else 4
            change[to] = forward * north - right * east
            change[to + 1] = forward * east + right * north
            change[to + 2] = sense * (dz / segment_length - flat_sine)
    change[0] = total - length


@njit(cache=True, nogil=True, error_model="numpy")
def displaced_bounce_paths(
    horizontal_distance: Floats, vertical_travel: Floats, horizontal_directions: Floats, bounces: SurfaceBounces,
    slopes: Floats, change: Floats,
) -> None:  # fmt: skip
    """Displaced bounces of n lines by `displaced_bounce_path`: slopes (n, b, 2), unit vectors (n, 2), change (n, 7)."""
    for n in range(horizontal_distance.size):
        displaced_bounce_path(
            horizontal_distance[n], vertical_travel[n], horizontal_directions[n, 0], horizontal_directions[n, 1],
            bounces, slopes[n], change[n],
        )  # fmt: skip
