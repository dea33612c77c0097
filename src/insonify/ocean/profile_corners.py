"""Corners of a profile at which rays gather that real water would let pass.

A ray that is level where it meets a corner, and bends back faster beyond it, comes down nearer than
the rays that turn just before: range has a maximum there, and the ray tube closes to a caustic. With
the gradient that jumps, the caustic stands at the corner's own ray, however weak the layers are; with
a rounded corner it lies elsewhere, or nowhere.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.profile import SoundSpeedProfile

Floats = NDArray[np.float64]

SHARP = 0.5
"""Jump of the gradient below which a corner passes without a word [1/s]."""
MAX_CORNERS = 8
"""Corners on one side of a source that are looked into, the sharpest: a measured cast may have thousands."""
_RAYS = 200  # that turn in the layer beyond a corner


@dataclass(frozen=True, slots=True)
class ProfileCorner:
    """One corner, and where its caustic begins."""

    depth: float
    """Depth of the corner [m]."""
    gradient_jump: float
    """How much more the gradient bends rays back beyond the corner [1/s]."""
    caustic_range: float
    """Horizontal distance from the source to the nearest ray that turns beyond the corner [m]."""


def profile_corners(profile: SoundSpeedProfile, source_depth: float, max_range: float) -> Iterator[ProfileCorner]:
    """Corners that make a caustic within reach of a source; of many on one side the sharpest `MAX_CORNERS`.

    Args:
        profile: Speed of sound against depth.
        source_depth: Depth of the source, within the profile [m].
        max_range: Farthest horizontal distance of interest [m].

    Yields:
        The corners above the source, nearest first, then those below.
    """
    for sign in (-1.0, 1.0):
        distance, speed = _away(profile, source_depth, sign)
        gradient = np.diff(speed) / np.diff(distance)
        jump = np.diff(gradient)
        level = speed[1:-1] >= np.maximum.accumulate(speed)[1:-1]  # a ray may be level here, and bends back faster
        sharp = 1 + np.flatnonzero(level & (jump > SHARP))
        sharpest = np.sort(sharp[np.argsort(-jump[sharp - 1], kind="stable")[:MAX_CORNERS]])
        for i in sharpest:
            reach = _caustic_range(distance[: i + 2], speed[: i + 2])
            if reach <= max_range:
                yield ProfileCorner(source_depth + sign * float(distance[i]), float(jump[i - 1]), reach)


def _away(profile: SoundSpeedProfile, source_depth: float, sign: float) -> tuple[Floats, Floats]:
    """Distances from the source to itself and the knots on one side [m], and the speeds there [m/s]."""
    distance = sign * (profile.depth - source_depth)
    ahead = np.unique(distance[distance > 0])  # knots within the last bits of each other are one
    distance = np.concatenate([[0.0], ahead])
    return distance, profile.at(source_depth + sign * distance)


def _caustic_range(distance: Floats, speed: Floats) -> float:
    """Smallest horizontal distance to the turn of a ray that turns in the last layer [m].

    Arcs of circles: over a layer from speed c1 to c2 a ray of slowness p runs
    p (c1 + c2) dz / (s1 + s2), s the sine of its elevation (Snell's law).
    """
    turn = np.linspace(speed[-2], speed[-1], _RAYS + 1)[1:, None]
    last = distance[-2] + (turn - speed[-2]) / (speed[-1] - speed[-2]) * (distance[-1] - distance[-2])
    z = np.concatenate([np.broadcast_to(distance[:-1], (_RAYS, distance.size - 1)), last], axis=1)
    c = np.concatenate([np.broadcast_to(speed[:-1], (_RAYS, speed.size - 1)), turn], axis=1)
    sine = np.sqrt((1 - c / turn) * (1 + c / turn))
    run = (c[:, 1:] + c[:, :-1]) / turn * np.diff(z, axis=1) / (sine[:, 1:] + sine[:, :-1])
    return float(run.sum(axis=1).min())
