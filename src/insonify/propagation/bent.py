"""Legs whose surface bounces are moved off the mirror's point, because the surface is tilted there.

Unfolded between level boundaries a leg is a straight line from an image of the sonar. Where the surface has a slope,
the bounce that serves a point lies elsewhere on the surface: the line gets a corner there. Everything is told as a
change of the mirror's leg, so that it also serves rays that refraction bends a little.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import bounces, image_depth

Floats = NDArray[np.float64]

STEEPEST = 0.4
"""Slope of the surface beyond which a facet counts as one of this slope [1]."""
WIDEST = 0.9
"""Share of the way from the mirror's point to either end that a bounce may be moved [1]."""


class Bend(NamedTuple):
    """What corners change in n legs of one family."""

    excess: Floats
    """Additional length [m], shape (n,)."""
    departure: Floats
    """Change of the unit vector of travel at the sonar [1], shape (n, 3)."""
    arrival: Floats
    """Change of that at the point [1], shape (n, 3)."""


@dataclass(frozen=True, slots=True)
class Unfolded:
    """The straight lines of one family from one place to n points, told by distance and climb."""

    start: Floats
    """North and east of the sonar [m], shape (2,)."""
    ahead: Floats
    """Horizontal unit vector towards each point, shape (n, 2)."""
    distance: Floats
    """Horizontal distance of each point [m], shape (n,)."""
    climb: Floats
    """Vertical travel of the whole way [m], shape (n,)."""
    surface: tuple[float, ...]
    """Vertical travel up to each surface bounce [m]."""
    upward: bool
    """Whether it begins upwards."""
    odd: bool
    """Whether it ends in the other sense than it began."""

    @property
    def length(self) -> Floats:
        """Length of the way [m], shape (n,)."""
        return np.asarray(np.hypot(self.distance, self.climb))

    def parts(self) -> Floats:
        """Part of the way at which each surface bounce lies, 0 to 1, shape (bounces, n)."""
        return np.array([np.minimum(height / self.climb, 1.0) for height in self.surface])

    def mirror_points(self) -> Floats:
        """North and east of each surface bounce [m], shape (bounces, n, 2)."""
        return self.start + (self.parts() * self.distance)[..., None] * self.ahead


def unfolded(family: str, place: Floats, points: Floats, water_depth: float) -> Unfolded:
    """The straight lines of a family.

    Args:
        family: Name of a family with a bounce.
        place: North, east, depth of the sonar [m], shape (3,).
        points: The same of the points [m], shape (n, 3).
        water_depth: Depth of the bottom [m].
    """
    string = bounces(family)
    across = points[:, :2] - place[:2]
    distance = np.linalg.norm(across, axis=1)
    ahead = np.where(distance[:, None] > 1e-6, across / np.maximum(distance, 1e-6)[:, None], [1.0, 0.0])
    climb = np.maximum(np.abs(points[:, 2] - image_depth(family, place[2], water_depth)), 1e-6)
    first = place[2] if string[0] == "S" else water_depth - place[2]
    surface = tuple(float(first + row * water_depth) for row, letter in enumerate(string) if letter == "S")
    return Unfolded(place[:2], ahead, distance, climb, surface, string[0] == "S", len(string) % 2 == 1)


def bend(lines: Unfolded, slopes: Floats) -> Bend:
    """Lines with a corner at every surface bounce, where the surface has the slopes given.

    In the vertical plane the corner is exact: with the elevation's slope tan(e) the rays to both ends graze at angles
    that differ by 2 e. Across it, offset = 2 slope sin(grazing) / (1/r1 + 1/r2), to first order.

    Args:
        lines: The straight lines.
        slopes: Slope of the elevation away from the sonar and to the right of that, shape (bounces, 2, n) [1].

    Source: the law of reflection, derived here.
    """
    steps = [np.zeros((3, len(lines.distance)))]
    for height, (along, across) in zip(lines.surface, slopes, strict=True):
        steps.append(_corner(lines, height, along, across))
    ones = np.ones(len(lines.distance))
    steps.append(np.stack([lines.distance, 0 * ones, lines.climb * ones]))
    pieces = np.diff(np.stack(steps), axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    straight = np.stack([lines.distance, 0 * ones, lines.climb]) / lines.length
    changes = [pieces[row] / lengths[row] - straight for row in (0, -1)]
    down = -1.0 if lines.upward else 1.0
    senses = (down, -down if lines.odd else down)
    return Bend(
        lengths.sum(axis=0) - lines.length, *(_in_world(lines, c, s) for c, s in zip(changes, senses, strict=True))
    )


def _corner(lines: Unfolded, height: float, along: Floats, across: Floats) -> Floats:
    """Where one surface bounce lies: distance, distance to the right, climb [m], shape (3, n)."""
    far, h1 = lines.distance, height
    h2 = np.maximum(lines.climb - height, 1e-6)
    slope = np.clip(along, -STEEPEST, STEEPEST)
    # tan(g1 - g2) = tan 2 e with g1 = atan(h1 / x) and g2 = atan(h2 / (far - x)): a quadratic in x.
    tangent = np.clip(2 * slope / (1 - slope**2), -WIDEST * far / h1, WIDEST * far / h2)
    linear = h1 + h2 + tangent * far
    root = np.sqrt(np.maximum(linear**2 - 4 * tangent * h1 * (far - tangent * h2), 0.0))
    x = 2 * h1 * (far - tangent * h2) / np.maximum(linear + root, 1e-12)
    r1, r2 = np.hypot(x, h1), np.hypot(far - x, h2)
    sine = (h1 / r1 + h2 / r2) / 2
    shorter = np.minimum(r1, r2)
    right = np.clip(2 * across * sine / (1 / r1 + 1 / r2), -WIDEST * shorter, WIDEST * shorter)
    return np.stack([x, right, np.full(len(far), h1)])


def _in_world(lines: Unfolded, change: Floats, sense: float) -> Floats:
    """A change of direction told ahead, to the right and as climb, in the world, shape (n, 3)."""
    ahead, right, climb = change
    east_of = np.stack([-lines.ahead[:, 1], lines.ahead[:, 0]], axis=1)
    level = ahead[:, None] * lines.ahead + right[:, None] * east_of
    return np.concatenate([level, sense * climb[:, None]], axis=1)
