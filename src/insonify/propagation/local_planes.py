"""Legs off planes of their own: where the bed is uneven, each bounce has the plane fitted to its Fresnel zone.

An image of the sonar in one plane after the other gives the leg to a point exactly, as between level boundaries: only
that each leg has its own planes. The bounce lies where the line from the image pierces the plane; the zone about it
tells the plane. So planes are found twice: roughly about the bounce on the mean plane, and well about the bounce that
they lead to. On an even slope once would be enough.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._course_kernel import Course, Frame, follow_bed, spread, ways, zones
from insonify.propagation.families import bounces
from insonify.scene.bed import Bed
from insonify.scene.bed_plane import FEW, PATTERN, least_half_axis

Floats = NDArray[np.float64]

_DOWN = np.array([0.0, 0.0, 1.0])
_TINY = 1e-9
_PATTERNS = tuple(np.ascontiguousarray(pattern.T, np.float32) for pattern in (FEW, PATTERN))
"""For the first planes and for the last."""


def course(place: Floats, points: Floats, anchor: Floats, facing: Floats) -> Course:
    """Images in planes, one after the other, and the way that they unfold.

    Args:
        place: North, east, depth of the sonar [m], shape (3,).
        points: The same of the points [m], shape (n, 3).
        anchor: A point of each mirror [m], shape (m, n, 3).
        facing: Unit normal of each mirror, into the water, shape (m, n, 3).

    Source: images as in Allen & Berkley (1979), J. Acoust. Soc. Am. 65, 943 (for the idea); exact for planes of any
    tilt.
    """
    made = _columns(*anchor.shape[:2])
    ways(np.asarray(place, float), points, anchor, facing, made)
    return made


def level_course(family: str, place: Floats, points: Floats, bed_depth: float) -> Course:
    """The ways of a family between the level surface and a level bed.

    Args:
        family: Name of a family with bounces.
        place: North, east, depth of the sonar [m], shape (3,).
        points: The same of the points [m], shape (n, 3).
        bed_depth: Depth of the bed [m].
    """
    return course(place, points, *_level(family, len(points), bed_depth))


class Bounces(NamedTuple):
    """What a `Course` tells of the mirrors of n ways, where no more is asked."""

    length: Floats
    part: Floats
    sine: tuple[Floats, ...]
    left: tuple[float, ...]


def level_bounces(family: str, depth: float, length: Floats, sine: Floats, bed_depth: float) -> Bounces:
    """Where the ways of a family bounce between the level surface and a level bed, by their lengths.

    Args:
        family: Name of a family with bounces.
        depth: Of the sonar [m].
        length: Of the ways [m], shape (n,).
        sine: Sine of their grazing angle, at all mirrors the same [1], shape (n,).
        bed_depth: Depth of the bed [m].
    """
    string = bounces(family)
    first = depth if string[0] == "S" else bed_depth - depth
    climb = np.array([first + k * bed_depth for k in range(len(string))])  # to each bounce, all of it counted
    part = np.clip(climb[:, None] / np.maximum(length * sine, _TINY), 0.0, 1.0)
    return Bounces(length, part, (sine,) * len(string), (0.0,) * len(string))


def local_course(
    family: str, place: Floats, points: Floats, bed: Bed, wavelength: float, *, met: Floats | None = None
) -> Course:
    """The ways of a family off the planes fitted to the bed over the first Fresnel zone of each bounce.

    Args:
        family: Name of a family with bounces.
        place: North, east, depth of the sonar [m], shape (3,).
        points: The same of the points [m], shape (n, 3).
        bed: The ground.
        wavelength: Of the sound [m].
        met: Horizontal distance at which the rays really bounce off level ground, where refraction bends them [m],
            shape (m, n): the planes are those of the ground there, moved under the bounces of straight rays.

    Returns:
        Ways in water of one sound speed; the sonar's images, the bounces and the grazing angles are exact for the
        planes fitted.
    """
    string = bounces(family)
    made = _columns(len(string), len(points))
    if not len(points):
        return made
    moved = np.empty((len(string), 0, 2))
    if met is not None:
        across = points[:, :2] - place[:2]
        ahead = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), _TINY)
        moved = place[:2] + met[..., None] * ahead - level_course(family, place, points, bed.depth).bounce[..., :2]
    lattice, done = bed.ground.terrain.lattice, np.zeros(len(points), bool)
    frame = Frame(
        *lattice.origin, np.cos(lattice.heading), np.sin(lattice.heading), bed.depth, wavelength, least_half_axis(bed)
    )
    off_bed = np.array([letter == "B" for letter in string])
    here = np.asarray(place, float)
    span = np.empty((2, 2))
    spread(here, points, frame, span)
    bed.asked(
        span,
        lambda pages, wanted: follow_bed(here, points, off_bed, moved, frame, _PATTERNS, pages, wanted, done, made),
    )
    return made


def zone(way: Course | Bounces, mirror: int, wavelength: float) -> tuple[Floats, Floats]:
    """Half the length and half the width of the first Fresnel zone of a bounce [m], each of shape (n,).

    Args:
        way: The ways.
        mirror: Number of the bounce.
        wavelength: Of the sound [m].

    Source: sqrt(wavelength r1 r2 / (r1 + r2)), along the ray over the sine of the grazing angle, r1 and r2 the ways
    before and after the bounce; no longer than the shorter one of them.
    """
    found = np.empty((2, len(way.length)))
    zones(way.length, way.part[mirror], way.sine[mirror], wavelength, found)
    return found[0], found[1]


def _columns(mirrors: int, points: int) -> Course:
    """Room for the ways of so many points off so many mirrors."""
    one, each = (points,), (mirrors, points)
    return Course(
        np.empty(one), np.empty((points, 3)), np.empty((points, 3)), np.empty((mirrors, points, 3)), np.empty(each),
        np.empty(each), np.zeros(each), np.empty(one, bool),
    )  # fmt: skip


def _level(family: str, count: int, bed_depth: float) -> tuple[Floats, Floats]:
    """A point and the normal of every mirror of a family, all level, each of shape (m, count, 3)."""
    string = bounces(family)
    anchor, facing = np.zeros((len(string), count, 3)), np.zeros((len(string), count, 3))
    for k, letter in enumerate(string):
        anchor[k, :, 2] = bed_depth if letter == "B" else 0.0
        facing[k] = -_DOWN if letter == "B" else _DOWN
    return anchor, facing
