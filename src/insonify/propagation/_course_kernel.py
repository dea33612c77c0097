"""Ways off a few planes, one after the other, by images: planes that are given, or those of the ground they bounce off.

Plain numbers and arrays only.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scene._plane_kernel import Ellipses, fit_ellipses
from insonify.scene.pages import Pages

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_TINY = 1e-9
_CHUNK = 128
_C, _C2, _C3, _C4, _C5 = (np.uint64(_CHUNK * row) for row in (1, 2, 3, 4, 5))
_END, _TRAVEL, _ARRIVAL, _LEFT, _THERE, _LENGTH = (np.uint64(_CHUNK * row) for row in (0, 3, 6, 9, 10, 11))
"""Where the ways have been followed back to; direction of travel there, and at the point; the part of the way that is
left, whether it is there, its length."""
_AHEAD, _ASIDE, _X, _Y, _LONG, _WIDE = (np.uint64(_CHUNK * row) for row in (12, 13, 14, 15, 16, 17))
"""Bearing of each point, north and east; middle of a zone on the lattice, and its half axes."""
_HEIGHT, _ALONG, _ACROSS, _LOST = (np.uint64(_CHUNK * row) for row in (18, 19, 20, 21))
"""Planes fitted: height [m], slopes [1], and mean square of what is left [m^2]."""
_COSINE, _TURN = (np.uint64(_CHUNK * row) for row in (22, 23))
"""Bearing of each point on the lattice: its cosine and sine."""
_FIRST = 24
_ANCHOR, _FACING, _IMAGE, _BOUNCE, _PART, _SINE, _REST, _EACH = 0, 3, 6, 9, 12, 13, 14, 15
"""Rows of each mirror: a point of it, its normal, the image before it, the bounce, the part of the way before that, the
sine of the grazing angle, and what the plane leaves of the ground; after the last mirror comes the last image."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class Course(NamedTuple):
    """Ways of one family from one place to n points, off m mirrors each."""

    length: Floats
    """Length of the whole way [m], shape (n,)."""
    departure: Floats
    """Unit vector of travel at the sonar, shape (n, 3)."""
    arrival: Floats
    """Unit vector of travel at the point, shape (n, 3)."""
    bounce: Floats
    """North, east, depth of each bounce [m], shape (m, n, 3)."""
    part: Floats
    """Part of the way that lies before each bounce [1], shape (m, n)."""
    sine: Floats
    """Sine of the grazing angle at each mirror [1], shape (m, n)."""
    left: Floats
    """Mean square of the resolved ground about each mirror [m^2], shape (m, n)."""
    there: NDArray[np.bool_]
    """False where a mirror lies on the wrong side: the point, or the sonar, is below it, shape (n,)."""


class Frame(NamedTuple):
    """The lattice's frame in the world, and how the ground is read."""

    north: float
    """Of its origin [m]."""
    east: float
    """Likewise [m]."""
    cosine: float
    """Of its heading."""
    sine: float
    """Likewise."""
    depth: float
    """Of the bed's mean plane [m]."""
    wavelength: float
    """Of the sound [m]."""
    least: float
    """Half axis below which ellipses are not told apart [m]."""


@njit(cache=True, nogil=True, error_model="numpy")
def _room(mirrors: int) -> Floats:
    """Room for some points off so many mirrors, row by row: one array, so that loops over points become vectors."""
    return np.empty(_CHUNK * (_FIRST + _EACH * (mirrors + 1)))


@njit(cache=True, nogil=True, error_model="numpy")
def _row(mirror: int, which: int) -> np.uint64:
    """Where a row of a mirror begins."""
    return np.uint64(_CHUNK * (_FIRST + _EACH * mirror + which))


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _mirror(room: Floats, count: int, image: np.uint64, plane: np.uint64, behind: np.uint64) -> None:
    """Images of places in planes."""
    for n in range(np.uint64(count)):
        x, y, z = room[image + n], room[image + _C + n], room[image + _C2 + n]
        f, g, h = room[plane + _C3 + n], room[plane + _C4 + n], room[plane + _C5 + n]
        a, b, c = x - room[plane + n], y - room[plane + _C + n], z - room[plane + _C2 + n]
        twice = 2 * (a * f + b * g + c * h)
        room[behind + n] = x - twice * f
        room[behind + _C + n] = y - twice * g
        room[behind + _C2 + n] = z - twice * h


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _straight(room: Floats, count: int, image: np.uint64) -> None:
    """Direction and length of the line from an image to its end."""
    for n in range(np.uint64(count)):
        u, v = room[_END + n] - room[image + n], room[_END + _C + n] - room[image + _C + n]
        w = room[_END + _C2 + n] - room[image + _C2 + n]
        length = max(math.sqrt(u * u + v * v + w * w), 1e-6)
        once = 1 / length
        room[_LENGTH + n] = length
        room[_TRAVEL + n] = room[_ARRIVAL + n] = u * once
        room[_TRAVEL + _C + n] = room[_ARRIVAL + _C + n] = v * once
        room[_TRAVEL + _C2 + n] = room[_ARRIVAL + _C2 + n] = w * once


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _pierce(room: Floats, count: int, image: np.uint64, plane: np.uint64, bounce: np.uint64, part: np.uint64) -> None:
    """Ends moved along the line from the image to where it comes through the plane, and the part of the way till then.

    Whether the end lies above the plane and the image below it is kept.
    """
    for n in range(np.uint64(count)):
        ex, ey, ez = room[_END + n], room[_END + _C + n], room[_END + _C2 + n]
        x, y, z = room[image + n], room[image + _C + n], room[image + _C2 + n]
        a, b, c = room[plane + n], room[plane + _C + n], room[plane + _C2 + n]
        f, g, h = room[plane + _C3 + n], room[plane + _C4 + n], room[plane + _C5 + n]
        above = (ex - a) * f + (ey - b) * g + (ez - c) * h
        below = -((x - a) * f + (y - b) * g + (z - c) * h)
        there = room[_THERE + n]
        room[_THERE + n] = there if min(above, below) > 0 else 0.0
        behind = min(max(above / max(above + below, _TINY), 0.0), 1.0)
        room[_END + n] = room[bounce + n] = ex + behind * (x - ex)
        room[_END + _C + n] = room[bounce + _C + n] = ey + behind * (y - ey)
        room[_END + _C2 + n] = room[bounce + _C2 + n] = ez + behind * (z - ez)
        left = room[_LEFT + n] * (1 - behind)
        room[_LEFT + n] = room[part + n] = left


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turn_back(room: Floats, count: int, plane: np.uint64, sine: np.uint64) -> None:
    """Direction before a mirror from that after it, and the sine of the grazing angle."""
    for n in range(np.uint64(count)):
        u, v, w = room[_TRAVEL + n], room[_TRAVEL + _C + n], room[_TRAVEL + _C2 + n]
        f, g, h = room[plane + _C3 + n], room[plane + _C4 + n], room[plane + _C5 + n]
        turned = u * f + v * g + w * h
        room[_TRAVEL + n] = u - 2 * turned * f
        room[_TRAVEL + _C + n] = v - 2 * turned * g
        room[_TRAVEL + _C2 + n] = w - 2 * turned * h
        room[sine + n] = min(abs(turned), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _unfold(place: Floats, points: Floats, which: NDArray[np.int64], mirrors: int, room: Floats) -> None:
    """The ways of some points off the mirrors in the room.

    Args:
        place: North, east, depth of the sonar [m], (3,).
        points: The same of the points [m], (n, 3).
        which: Those that are asked, at most `_CHUNK`.
        mirrors: How many mirrors.
        room: Mirrors, and the result.
    """
    count, first = which.size, _row(0, _IMAGE)
    for q in range(np.uint64(count)):
        for i in range(np.uint64(3)):
            room[_END + i * _C + q] = points[which[q], i]
            room[first + i * _C + q] = place[i]
        room[_LEFT + q] = room[_THERE + q] = 1.0
    for k in range(mirrors):
        _mirror(room, count, _row(k, _IMAGE), _row(k, _ANCHOR), _row(k + 1, _IMAGE))
    _straight(room, count, _row(mirrors, _IMAGE))
    for k in range(mirrors - 1, -1, -1):
        _pierce(room, count, _row(k + 1, _IMAGE), _row(k, _ANCHOR), _row(k, _BOUNCE), _row(k, _PART))
        _turn_back(room, count, _row(k, _ANCHOR), _row(k, _SINE))


@njit(cache=True, nogil=True, error_model="numpy")
def _hand_out(room: Floats, which: NDArray[np.int64], mirrors: int, made: Course) -> None:
    """Write the ways in the room to their columns."""
    for q in range(np.uint64(which.size)):
        n = which[q]
        made.length[n], made.there[n] = room[_LENGTH + q], room[_THERE + q] > 0
        for i in range(np.uint64(3)):
            made.departure[n, i], made.arrival[n, i] = room[_TRAVEL + i * _C + q], room[_ARRIVAL + i * _C + q]
    for k in range(mirrors):
        bounce, part, sine = _row(k, _BOUNCE), _row(k, _PART), _row(k, _SINE)
        for q in range(np.uint64(which.size)):
            n = which[q]
            made.part[k, n], made.sine[k, n] = room[part + q], room[sine + q]
            for i in range(np.uint64(3)):
                made.bounce[k, n, i] = room[bounce + i * _C + q]


@njit(cache=True, nogil=True, error_model="numpy")
def ways(place: Floats, points: Floats, anchor: Floats, facing: Floats, made: Course) -> None:
    """Images of a place in planes, and the ways that they unfold.

    Args:
        place: North, east, depth of the sonar [m], (3,).
        points: The same of the points [m], (n, 3).
        anchor: A point of each mirror [m], (m, n, 3).
        facing: Unit normal of each mirror, into the water, (m, n, 3).
        made: Result.
    """
    mirrors = anchor.shape[0]
    room, every = _room(mirrors), np.arange(points.shape[0])
    for begin in range(0, points.shape[0], _CHUNK):
        which = every[begin : begin + _CHUNK]
        for k in range(mirrors):
            plane = _row(k, _ANCHOR)
            for q in range(np.uint64(which.size)):
                for i in range(np.uint64(3)):
                    room[plane + i * _C + q] = anchor[k, which[q], i]
                    room[plane + (i + np.uint64(3)) * _C + q] = facing[k, which[q], i]
        _unfold(place, points, which, mirrors, room)
        _hand_out(room, which, mirrors, made)


@njit(cache=True, nogil=True, error_model="numpy")
def zone(length: float, part: float, sine: float, wavelength: float) -> tuple[float, float]:
    """Half the length and half the width of the first Fresnel zone of one bounce, see `local_planes.zone` [m]."""
    width = math.sqrt(max(wavelength * length * part * (1 - part), 0.0))
    longest = length * min(part, 1 - part)
    return max(min(width / max(sine, _TINY), longest), width), width


@njit(cache=True, nogil=True, error_model="numpy")
def zones(length: Floats, part: Floats, sine: Floats, wavelength: float, found: Floats) -> None:
    """Half lengths and half widths of some zones; columns of shape (n,), the result of shape (2, n)."""
    for n in range(length.size):
        found[0, n], found[1, n] = zone(length[n], part[n], sine[n], wavelength)


@njit(cache=True, nogil=True, error_model="numpy")
def spread(place: Floats, points: Floats, frame: Frame, span: Floats) -> None:
    """Least and greatest coordinates on the lattice of a place and some points, into `span`, (2, 2)."""
    span[0], span[1] = np.inf, -np.inf
    for n in range(points.shape[0] + 1):
        x, y = (points[n, 0], points[n, 1]) if n < points.shape[0] else (place[0], place[1])
        x, y = x - frame.north, y - frame.east
        a, b = frame.cosine * x + frame.sine * y, frame.cosine * y - frame.sine * x
        span[0, 0], span[0, 1] = min(span[0, 0], a), min(span[0, 1], b)
        span[1, 0], span[1, 1] = max(span[1, 0], a), max(span[1, 1], b)


@njit(cache=True, nogil=True, error_model="numpy")
def follow_bed(
    place: Floats, points: Floats, off_bed: NDArray[np.bool_], moved: Floats, frame: Frame,
    patterns: tuple[Singles, ...], pages: Pages, wanted: NDArray[np.bool_], done: NDArray[np.bool_], made: Course,
) -> bool:  # fmt: skip
    """Ways off the planes fitted to the bed about each bounce, of those points that have none yet.

    Args:
        place: As of `ways`.
        points: As of `ways`.
        off_bed: Which mirrors are the bed's, the others being the surface, (m,).
        moved: How far from each bounce the ground is asked [m], (m, n, 2), or (m, 0, 2) for there.
        frame: The ground's frame.
        patterns: Samples of the unit disc for the first planes and for the last, see `fit_ellipse`.
        pages: The map.
        wanted: Result, see `fit_ellipse`.
        done: Which have their way, (n,).
        made: Result.

    Returns:
        Whether all points have their way.
    """
    mirrors, left = off_bed.size, np.flatnonzero(~done)
    room, known = _room(mirrors), np.empty(_CHUNK, np.bool_)
    ask = _ellipses(room)
    for begin in range(0, left.size, _CHUNK):
        which = left[begin : begin + _CHUNK]
        _level(place, points, which, off_bed, frame.depth, room)
        _unfold(place, points, which, mirrors, room)
        known[:] = True
        for pattern in patterns:
            for k in range(mirrors):
                if off_bed[k]:
                    _lay_zones(which.size, k, frame, room)
                    if moved.shape[1] > 0:
                        _move_zones(which, moved[k], frame, room)
                    fit_ellipses(ask, which.size, pattern, pages, wanted, known)
                    _put_planes(which.size, k, frame.depth, room)
            _unfold(place, points, which, mirrors, room)
        _hand_out(room, which, mirrors, made)
        for q in range(which.size):
            for k in range(mirrors):
                made.left[k, which[q]] = room[_row(k, _REST) + np.uint64(q)] if off_bed[k] else 0.0
            done[which[q]] = known[q]
    return bool(np.all(done))


@njit(cache=True, nogil=True)
def _ellipses(room: Floats) -> Ellipses:
    """The rows of the room that tell where the ground is asked, and what is found."""
    return Ellipses(
        room[_X : _X + _C], room[_Y : _Y + _C], room[_COSINE : _COSINE + _C], room[_TURN : _TURN + _C],
        room[_LONG : _LONG + _C], room[_WIDE : _WIDE + _C], room[_HEIGHT : _HEIGHT + _C],
        room[_ALONG : _ALONG + _C], room[_ACROSS : _ACROSS + _C], room[_LOST : _LOST + _C],
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _level(
    place: Floats, points: Floats, which: NDArray[np.int64], off_bed: NDArray[np.bool_], depth: float, room: Floats
) -> None:
    """Put level mirrors into the room, and the bearings of the points; arguments as of `follow_bed`."""
    for k in range(off_bed.size):
        plane = _row(k, _ANCHOR)
        for q in range(np.uint64(which.size)):
            for i in range(np.uint64(6)):
                room[plane + i * _C + q] = 0.0
            room[plane + _C2 + q] = depth if off_bed[k] else 0.0
            room[plane + _C5 + q] = -1.0 if off_bed[k] else 1.0
    for q in range(np.uint64(which.size)):
        north, east = points[which[q], 0] - place[0], points[which[q], 1] - place[1]
        level = math.sqrt(north * north + east * east)
        room[_AHEAD + q], room[_ASIDE + q] = (north / level, east / level) if level > 0 else (1.0, 0.0)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _lay_zones(count: int, k: int, frame: Frame, room: Floats) -> None:
    """Middles and half axes of the zones about the bounces off one mirror, on the lattice."""
    bounce, part, sine = _row(k, _BOUNCE), _row(k, _PART), _row(k, _SINE)
    for q in range(np.uint64(count)):
        before, length = room[part + q], room[_LENGTH + q]
        width = math.sqrt(max(frame.wavelength * length * before * (1 - before), 0.0))
        longest = length * min(before, 1 - before)
        long = max(min(width / max(room[sine + q], _TINY), longest), width)
        x, y = room[bounce + q] - frame.north, room[bounce + _C + q] - frame.east
        room[_X + q], room[_Y + q] = frame.cosine * x + frame.sine * y, frame.cosine * y - frame.sine * x
        room[_LONG + q], room[_WIDE + q] = max(long, frame.least), max(width, frame.least)
        room[_COSINE + q] = frame.cosine * room[_AHEAD + q] + frame.sine * room[_ASIDE + q]
        room[_TURN + q] = frame.cosine * room[_ASIDE + q] - frame.sine * room[_AHEAD + q]


@njit(cache=True, nogil=True, error_model="numpy")
def _move_zones(which: NDArray[np.int64], moved: Floats, frame: Frame, room: Floats) -> None:
    """Move the middles of zones to where the ground is asked, (n, 2)."""
    for q in range(np.uint64(which.size)):
        x, y = moved[which[q], 0], moved[which[q], 1]
        room[_X + q] += frame.cosine * x + frame.sine * y
        room[_Y + q] += frame.cosine * y - frame.sine * x


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _put_planes(count: int, k: int, depth: float, room: Floats) -> None:
    """Put one mirror on the planes about its bounces."""
    plane, bounce, rest = _row(k, _ANCHOR), _row(k, _BOUNCE), _row(k, _REST)
    for q in range(np.uint64(count)):
        ahead, aside, along, across = room[_AHEAD + q], room[_ASIDE + q], room[_ALONG + q], room[_ACROSS + q]
        lean_n, lean_e = ahead * along - aside * across, aside * along + ahead * across
        room[rest + q] = room[_LOST + q]
        size = 1 / math.sqrt(lean_n * lean_n + lean_e * lean_e + 1)
        room[plane + q], room[plane + _C + q] = room[bounce + q], room[bounce + _C + q]
        room[plane + _C2 + q] = depth - room[_HEIGHT + q]
        room[plane + _C3 + q], room[plane + _C4 + q] = -lean_n * size, -lean_e * size
        room[plane + _C5 + q] = -size
