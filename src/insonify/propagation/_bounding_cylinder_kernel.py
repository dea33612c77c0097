"""Kernel that finds points behind upright cylinders. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]


@njit(cache=True, nogil=True, error_model="numpy")
def points_behind_cylinder(
    position: Floats, points: Floats, directions: Floats, cylinder: Floats, clearance: float, direct: bool,
    rows: Integers,
) -> int:  # fmt: skip
    """Find points whose path passes a cylinder in plan view; return their number.

    Args:
        position: North, east, depth of the start of the paths [m], (3,).
        points: North, east, depth of the ends of the paths [m], (n, 3).
        directions: Vectors of the direction of arrival, of any length, (f, n, 3); or (0, n, 3): straight paths.
        cylinder: North, east, radius, depth of the top of the cylinder [m], and further columns, (4 or more,).
        clearance: Largest distance between cylinder and path [m].
        direct: True: paths are straight in depth too, and those that pass above the top are left out.
        rows: Result: indices of the points found, increasing, in its first entries, (n,).

    Returns:
        Number of points.
    """
    hit_count, radius = 0, cylinder[2]
    max_offset_squared = (radius + clearance) ** 2
    for n in range(points.shape[0]):
        dx, dy = points[n, 0] - cylinder[0], points[n, 1] - cylinder[1]
        north, east = points[n, 0] - position[0], points[n, 1] - position[1]
        squared_distance = north * north + east * east
        for f in range(max(directions.shape[0], 1)):
            if directions.shape[0] > 0:
                north, east = directions[f, n, 0], directions[f, n, 1]
            squared_length = north * north + east * east
            offset = dy * north - dx * east
            if offset * offset > max_offset_squared * squared_length or (
                squared_length == 0 and dx * dx + dy * dy > max_offset_squared
            ):
                continue
            projection, length = dx * north + dy * east, math.sqrt(squared_length)
            if projection >= -radius * length and projection <= (math.sqrt(squared_distance) + radius) * length:
                if direct and length > 0 and points[n, 2] > position[2]:
                    leaving_fraction = min((length - projection / length + radius + clearance) / length, 1.0)
                    if position[2] + leaving_fraction * (points[n, 2] - position[2]) < cylinder[3] - clearance:
                        break
                rows[hit_count] = n
                hit_count += 1
                break
    return hit_count
