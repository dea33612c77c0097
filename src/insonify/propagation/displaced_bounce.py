"""Displaced bounces: legs with surface bounces beside the flat surface's specular point, where the surface is tilted.

Unfolded between flat boundaries a leg is a straight line from an image of the sonar. Where the surface has a slope,
the reflection that reaches a point lies elsewhere on the surface: the line has a corner there. All results are
changes of the flat surface's leg, so that they also apply to slightly refracted rays.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._displaced_bounce_kernel import STEEPEST as STEEPEST
from insonify.propagation._displaced_bounce_kernel import SurfaceBounces, displaced_bounce_paths
from insonify.propagation.families import bounce_sequence, image_depth

Floats = NDArray[np.float64]


class DisplacedBounce(NamedTuple):
    """Changes of n legs of one family by displaced bounces."""

    excess_length: Floats
    """Additional length [m], shape (n,)."""
    departure_change: Floats
    """Change of the direction of travel at the sonar [1], shape (n, 3)."""
    arrival_change: Floats
    """Change of the direction of travel at the point [1], shape (n, 3)."""


@dataclass(frozen=True, slots=True)
class UnfoldedPaths:
    """Unfolded straight lines of one family from one position to n points."""

    start: Floats
    """North and east of the sonar [m], shape (2,)."""
    horizontal_direction: Floats
    """Horizontal unit vector towards each point, shape (n, 2)."""
    horizontal_distance: Floats
    """Horizontal distance of each point [m], shape (n,)."""
    vertical_travel: Floats
    """Vertical travel of the whole path [m], shape (n,)."""
    vertical_travel_to_bounces: tuple[float, ...]
    """Vertical travel up to each surface bounce, or to those of other selected boundaries [m]."""
    starts_upward: bool
    """True for a family that starts upwards."""
    reverses_vertically: bool
    """True for a family whose rays arrive in the vertical direction opposite to that in which they depart."""

    @property
    def length(self) -> Floats:
        """Length of the path [m], shape (n,)."""
        return np.asarray(np.hypot(self.horizontal_distance, self.vertical_travel))

    def bounce_fractions(self) -> Floats:
        """Fraction of the path at each surface bounce, 0 to 1, shape (bounces, n)."""
        return np.array([np.minimum(height / self.vertical_travel, 1.0) for height in self.vertical_travel_to_bounces])

    def flat_bounce_points(self) -> Floats:
        """North and east of each surface bounce [m], shape (bounces, n, 2)."""
        return self.start + (self.bounce_fractions() * self.horizontal_distance)[..., None] * self.horizontal_direction


def unfold_paths(
    family: str, position: Floats, points: Floats, water_depth: float, boundaries: str = "S"
) -> UnfoldedPaths:
    """Unfolded straight lines of a family.

    Args:
        family: Name of a family with a bounce.
        position: North, east, depth of the sonar [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        water_depth: Depth of the bottom [m].
        boundaries: Letters of the boundaries whose bounces count.
    """
    bounces = bounce_sequence(family)
    horizontal_offset = points[:, :2] - position[:2]
    distance = np.linalg.norm(horizontal_offset, axis=1)
    direction = np.where(distance[:, None] > 1e-6, horizontal_offset / np.maximum(distance, 1e-6)[:, None], [1.0, 0.0])
    vertical_travel = np.maximum(np.abs(points[:, 2] - image_depth(family, position[2], water_depth)), 1e-6)
    travel_to_bounces = vertical_travel_to_bounces(family, float(position[2]), water_depth, boundaries)
    starts_upward, is_odd = bounces[0] == "S", len(bounces) % 2 == 1
    return UnfoldedPaths(position[:2], direction, distance, vertical_travel, travel_to_bounces, starts_upward, is_odd)


def vertical_travel_to_bounces(
    family: str, depth: float, water_depth: float, boundaries: str = "S"
) -> tuple[float, ...]:
    """Vertical travel of a family's rays up to each of its bounces on some boundaries [m].

    Args:
        family: Name of a family with a bounce.
        depth: Depth of the sonar [m].
        water_depth: Depth of the bottom [m].
        boundaries: Letters of the boundaries.
    """
    bounces = bounce_sequence(family)
    first = depth if bounces[0] == "S" else water_depth - depth
    return tuple(float(first + row * water_depth) for row, letter in enumerate(bounces) if letter in boundaries)


def displace_bounces(paths: UnfoldedPaths, slopes: Floats) -> DisplacedBounce:
    """Changes of straight lines by a corner at every surface bounce, for given surface slopes.

    In the vertical plane the corner is exact: for a surface slope tan(e) the grazing angles of the rays to both ends
    differ by 2 e. Across that plane, offset = -2 slope sin(grazing) / (1/r1 + 1/r2), to first order.

    Args:
        paths: The straight lines.
        slopes: Slope of the surface away from the sonar (limited to `STEEPEST`) and to the right of that [1], shape
            (bounces, 2, n).

    Source: the law of reflection, derived here.
    """
    count = len(paths.horizontal_distance)
    change, slope_rows = np.empty((count, 7)), np.ascontiguousarray(np.moveaxis(np.asarray(slopes, float), 2, 0))
    bounces = SurfaceBounces(paths.starts_upward, paths.reverses_vertically, np.array(paths.vertical_travel_to_bounces))
    vertical_travel = paths.vertical_travel * np.ones(count)
    distance, direction = paths.horizontal_distance, paths.horizontal_direction
    displaced_bounce_paths(distance, vertical_travel, direction, bounces, slope_rows, change)
    return DisplacedBounce(change[:, 0], change[:, 1:4], change[:, 4:7])
