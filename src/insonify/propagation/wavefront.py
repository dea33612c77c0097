"""Wavefront curvature of a leg at the sonar, from which the field at the elements of an array follows.

In the vertical plane the ray tube's width gives the curvature; across that plane, where rays are straight in plan view,
the distance does.
See `propagation.aperture_expansion` for higher orders.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation._wavefront_kernel import TubeColumns, vertical_curvatures
from insonify.propagation.families import bounce_sequence
from insonify.records.legs import Legs

Floats = NDArray[np.float64]
GRADIENT_HALF_STEP = 0.01
"""Half the depth interval over which a profile's gradient is taken [m]."""
MIN_RADIUS = 1e-9
"""Least radius of a sphere about a point [m]."""


@dataclass(frozen=True, slots=True)
class Wavefront:
    """Wavefronts of n legs at the sonar."""

    vertical_curvature: Floats
    """Curvature in the vertical plane [1/m], that of a sphere about the point positive, shape (n,)."""
    horizontal_distance: Floats
    """Horizontal distance to the point [m], shape (n,)."""
    sound_speed_gradient: float
    """Growth of the speed of sound with depth at the sonar [1/s]."""
    expansion: Floats
    """Terms of higher order, see `propagation.aperture_expansion.TERMS`; (TERMS, n), or (0, n) for none."""


def wavefronts(legs: Legs, rows: Iterable[int], position: Floats, points: Floats, water: Water) -> list[Wavefront]:
    """Wavefronts of some rows of legs at the sonar's end.

    With H the second derivatives of travel time T by the position of the array, X(p) the horizontal range of rays of
    slowness p: d2T/dR2 = dp/dR = 1 / X', known from the tube's width, and the eikonal equation gives H along the ray.
    The curvature follows from the remaining component, H across the ray.

    Args:
        legs: Legs from that end.
        rows: Rows of the legs.
        position: North, east, depth of that end [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        water: Water between.

    Source: Cerveny (2001), Seismic Ray Theory, ch. 4 (not verified); checked against exact rays to every element.
    """
    distance = np.hypot(points[:, 0] - position[0], points[:, 1] - position[1])
    no_expansion = np.zeros((0, len(distance)))
    if not water.layered:
        return [Wavefront(1 / np.maximum(legs.length[row], MIN_RADIUS), distance, 0.0, no_expansion) for row in rows]
    depth = float(position[2])
    upper_depth, lower_depth = max(depth - GRADIENT_HALF_STEP, 0.0), depth + GRADIENT_HALF_STEP
    gradient = float(water.sound_speed_at(lower_depth) - water.sound_speed_at(upper_depth)) / (
        lower_depth - upper_depth
    )
    speed, point_speed = float(water.sound_speed_at(depth)), np.asarray(water.sound_speed_at(points[:, 2]), float)
    fronts = []
    for row in rows:
        ends = TubeColumns(
            legs.departure[row, :, 2], legs.arrival[row, :, 2], legs.spreading[row], legs.length[row],
            legs.caustics[row], distance, point_speed,
        )  # fmt: skip
        curvature, bounces = np.empty(len(distance)), len(bounce_sequence(legs.families[row]))
        vertical_curvatures(ends, bounces % 2 == 1, speed, gradient, curvature)
        expansion = no_expansion if legs.aperture_expansion is None else legs.aperture_expansion[row]
        fronts.append(Wavefront(curvature, distance, gradient, expansion))
    return fronts
