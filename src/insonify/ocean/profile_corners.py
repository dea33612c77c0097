"""Corners of a sound-speed profile that cause artificial caustics.

A ray that is horizontal at a corner, and is refracted back more strongly beyond it, returns at a shorter range than
the rays that turn just before: range has a maximum there, and the ray tube closes to a caustic. Where
the gradient jumps, the caustic lies at the ray that grazes the corner, however weak the layers are; with
a rounded corner it lies elsewhere, or vanishes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.profile import SoundSpeedProfile

Floats = NDArray[np.float64]

SHARP = 0.5
"""Jump of the gradient below which a corner is not reported [1/s]."""
MAX_CORNERS = 8
"""Largest number of corners examined on one side of a source, the sharpest: a measured cast may have thousands."""
_RAYS = 200  # rays that turn in the layer beyond a corner


@dataclass(frozen=True, slots=True)
class ProfileCorner:
    """Corner of a profile and the range of its caustic."""

    depth: float
    """Depth of the corner [m]."""
    gradient_jump: float
    """Increase of the gradient at the corner, positive where rays are refracted back more strongly [1/s]."""
    caustic_range: float
    """Horizontal distance from the source to the nearest ray that turns beyond the corner [m]."""


def profile_corners(profile: SoundSpeedProfile, source_depth: float, max_range: float) -> Iterator[ProfileCorner]:
    """Corners that cause a caustic within a range of a source, on each side the sharpest `MAX_CORNERS`.

    Args:
        profile: Sound speed against depth.
        source_depth: Depth of the source, within the profile [m].
        max_range: Farthest horizontal distance of interest [m].

    Yields:
        The corners above the source, nearest first, then those below.
    """
    for sign in (-1.0, 1.0):
        distance, speed = _knots_from_source(profile, source_depth, sign)
        gradient = np.diff(speed) / np.diff(distance)
        jump = np.diff(gradient)
        may_be_horizontal = speed[1:-1] >= np.maximum.accumulate(speed)[1:-1]  # a ray, at the knot
        sharp = 1 + np.flatnonzero(may_be_horizontal & (jump > SHARP))
        sharpest = np.sort(sharp[np.argsort(-jump[sharp - 1], kind="stable")[:MAX_CORNERS]])
        for i in sharpest:
            caustic_range = _caustic_range(distance[: i + 2], speed[: i + 2])
            if caustic_range <= max_range:
                yield ProfileCorner(source_depth + sign * float(distance[i]), float(jump[i - 1]), caustic_range)


def _knots_from_source(profile: SoundSpeedProfile, source_depth: float, sign: float) -> tuple[Floats, Floats]:
    """Vertical distances of the source (0) and of the knots on one side [m], and their sound speeds [m/s]."""
    distance = sign * (profile.depth - source_depth)
    ahead = np.unique(distance[distance > 0])  # knots within the last bits of each other are one
    distance = np.concatenate([[0.0], ahead])
    return distance, profile.at(source_depth + sign * distance)


def _caustic_range(distance: Floats, speed: Floats) -> float:
    """Smallest horizontal distance to the turning point of rays that turn in the last layer [m].

    Arcs of circles: over a layer from speed c1 to c2 the horizontal length of a ray that turns at a speed 1 / p is
    p (c1 + c2) dz / (s1 + s2), s the sine of its elevation (Snell's law).
    """
    turning_speed = np.linspace(speed[-2], speed[-1], _RAYS + 1)[1:, None]
    last = distance[-2] + (turning_speed - speed[-2]) / (speed[-1] - speed[-2]) * (distance[-1] - distance[-2])
    z = np.concatenate([np.broadcast_to(distance[:-1], (_RAYS, distance.size - 1)), last], axis=1)
    c = np.concatenate([np.broadcast_to(speed[:-1], (_RAYS, speed.size - 1)), turning_speed], axis=1)
    sine = np.sqrt((1 - c / turning_speed) * (1 + c / turning_speed))
    length = (c[:, 1:] + c[:, :-1]) / turning_speed * np.diff(z, axis=1) / (sine[:, 1:] + sine[:, :-1])
    return float(length.sum(axis=1).min())
