"""Ways off a few planes, one after the other, by images: planes that are given, or those of the ground they bounce off.

Plain numbers and arrays only.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.scene._plane_kernel import MOST_SAMPLES, fit_ellipse
from insonify.scene.pages import Pages

Floats = NDArray[np.float64]

_TINY = 1e-9
_CHUNK = 128
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


class Room(NamedTuple):
    """Some points at a time, coordinate by coordinate, so that they are worked out side by side."""

    end: Floats
    """Where the way has been followed back to, at first the point itself [m], (3, points)."""
    image: Floats
    """The sonar and its images in one mirror after the other [m], (3 (m + 1), points)."""
    anchor: Floats
    """A point of each mirror [m], (3 m, points)."""
    facing: Floats
    """Its unit normal, into the water, (3 m, points)."""
    travel: Floats
    """Direction of travel, (3, points)."""
    arrival: Floats
    """The same at the point, (3, points)."""
    bounce: Floats
    """The bounces [m], (3 m, points)."""
    numbers: Floats
    """Part and sine of each mirror, then length, what of it is left, whether the way is there, (2 m + 3, points)."""


@njit(cache=True, nogil=True, error_model="numpy")
def _room(mirrors: int) -> Room:
    """Room for some points off so many mirrors."""
    three, each = (3, _CHUNK), (3 * mirrors, _CHUNK)
    return Room(
        np.empty(three), np.empty((3 * mirrors + 3, _CHUNK)), np.empty(each), np.empty(each), np.empty(three),
        np.empty(three), np.empty(each), np.empty((2 * mirrors + 3, _CHUNK)),
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _mirror(
    x: Floats, y: Floats, z: Floats, a: Floats, b: Floats, c: Floats, f: Floats, g: Floats, h: Floats, behind_x: Floats,
    behind_y: Floats, behind_z: Floats,
) -> None:  # fmt: skip
    """Images of places in planes: places, points of the planes, their normals, and the result."""
    for n in range(x.size):
        twice = 2 * ((x[n] - a[n]) * f[n] + (y[n] - b[n]) * g[n] + (z[n] - c[n]) * h[n])
        behind_x[n] = x[n] - twice * f[n]
        behind_y[n] = y[n] - twice * g[n]
        behind_z[n] = z[n] - twice * h[n]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _straight(end: Floats, x: Floats, y: Floats, z: Floats, travel: Floats, length: Floats) -> None:
    """Direction and length of the line from an image to its end."""
    for n in range(x.size):
        u, v, w = end[0, n] - x[n], end[1, n] - y[n], end[2, n] - z[n]
        length[n] = max(math.sqrt(u * u + v * v + w * w), 1e-6)
        once = 1 / length[n]
        travel[0, n], travel[1, n], travel[2, n] = u * once, v * once, w * once


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _pierce(
    end: Floats, x: Floats, y: Floats, z: Floats, a: Floats, b: Floats, c: Floats, f: Floats, g: Floats, h: Floats,
    left: Floats, there: Floats, part: Floats,
) -> None:  # fmt: skip
    """Ends moved along the line from the image to where it comes through the plane, and the part of the way till then.

    Whether the end lies above the plane and the image below it is told by `there`.
    """
    for n in range(x.size):
        ex, ey, ez = end[0, n], end[1, n], end[2, n]
        above = (ex - a[n]) * f[n] + (ey - b[n]) * g[n] + (ez - c[n]) * h[n]
        below = -((x[n] - a[n]) * f[n] + (y[n] - b[n]) * g[n] + (z[n] - c[n]) * h[n])
        there[n] = there[n] if min(above, below) > 0 else 0.0
        behind = min(max(above / max(above + below, _TINY), 0.0), 1.0)
        end[0, n], end[1, n], end[2, n] = (
            ex + behind * (x[n] - ex),
            ey + behind * (y[n] - ey),
            ez + behind * (z[n] - ez),
        )
        left[n] *= 1 - behind
        part[n] = left[n]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turn_back(travel: Floats, f: Floats, g: Floats, h: Floats, sine: Floats) -> None:
    """Direction before a mirror from that after it, and the sine of the grazing angle."""
    for n in range(sine.size):
        u, v, w = travel[0, n], travel[1, n], travel[2, n]
        turned = u * f[n] + v * g[n] + w * h[n]
        travel[0, n], travel[1, n] = u - 2 * turned * f[n], v - 2 * turned * g[n]
        travel[2, n] = w - 2 * turned * h[n]
        sine[n] = min(abs(turned), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _unfold(place: Floats, points: Floats, which: NDArray[np.int64], count: int, room: Room) -> None:
    """The ways of some points off the mirrors in the room.

    Args:
        place: North, east, depth of the sonar [m], (3,).
        points: The same of the points [m], (n, 3).
        which: Those that are asked, (count,) and more.
        count: How many.
        room: Mirrors, and the result.
    """
    mirrors = room.anchor.shape[0] // 3
    image, anchor, facing, numbers = room.image, room.anchor, room.facing, room.numbers
    length, left, there = numbers[2 * mirrors], numbers[2 * mirrors + 1], numbers[2 * mirrors + 2]
    for q in range(count):
        for i in range(3):
            room.end[i, q] = points[which[q], i]
            image[i, q] = place[i]
        left[q] = there[q] = 1.0
    for k in range(mirrors):
        i, j = 3 * k, 3 * k + 3
        _mirror(
            image[i, :count], image[i + 1], image[i + 2], anchor[i], anchor[i + 1], anchor[i + 2], facing[i],
            facing[i + 1], facing[i + 2], image[j], image[j + 1], image[j + 2],
        )  # fmt: skip
    j = 3 * mirrors
    _straight(room.end, image[j, :count], image[j + 1], image[j + 2], room.travel, length)
    room.arrival[:, :count] = room.travel[:, :count]
    for k in range(mirrors - 1, -1, -1):
        i, j = 3 * k, 3 * k + 3
        _pierce(
            room.end, image[j, :count], image[j + 1], image[j + 2], anchor[i], anchor[i + 1], anchor[i + 2], facing[i],
            facing[i + 1], facing[i + 2], left, there, numbers[2 * k],
        )  # fmt: skip
        room.bounce[i : i + 3, :count] = room.end[:, :count]
        _turn_back(room.travel, facing[i], facing[i + 1], facing[i + 2], numbers[2 * k + 1, :count])


@njit(cache=True, nogil=True, error_model="numpy")
def _hand_out(room: Room, which: NDArray[np.int64], count: int, made: Course) -> None:
    """Write the ways in the room to their columns."""
    mirrors = room.anchor.shape[0] // 3
    for q in range(count):
        n = which[q]
        made.length[n], made.there[n] = room.numbers[2 * mirrors, q], room.numbers[2 * mirrors + 2, q] > 0
        for i in range(3):
            made.departure[n, i], made.arrival[n, i] = room.travel[i, q], room.arrival[i, q]
    for k in range(mirrors):
        for q in range(count):
            n = which[q]
            made.part[k, n], made.sine[k, n] = room.numbers[2 * k, q], room.numbers[2 * k + 1, q]
            for i in range(3):
                made.bounce[k, n, i] = room.bounce[3 * k + i, q]


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
    room, every = _room(anchor.shape[0]), np.arange(points.shape[0])
    for begin in range(0, points.shape[0], _CHUNK):
        which = every[begin : begin + _CHUNK]
        for k in range(anchor.shape[0]):
            for q in range(which.size):
                for i in range(3):
                    room.anchor[3 * k + i, q], room.facing[3 * k + i, q] = (
                        anchor[k, which[q], i], facing[k, which[q], i]
                    )  # fmt: skip
        _unfold(place, points, which, which.size, room)
        _hand_out(room, which, which.size, made)


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
def follow_bed(
    place: Floats, points: Floats, off_bed: NDArray[np.bool_], moved: Floats, frame: Frame,
    patterns: tuple[Floats, ...], pages: Pages, wanted: NDArray[np.bool_], done: NDArray[np.bool_], made: Course,
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
    at, inside = np.empty((2, MOST_SAMPLES), np.int32), np.empty((2, MOST_SAMPLES))
    corners = np.empty((4, MOST_SAMPLES), np.float32)
    for begin in range(0, left.size, _CHUNK):
        which = left[begin : begin + _CHUNK]
        for k in range(mirrors):
            room.anchor[3 * k : 3 * k + 2] = room.facing[3 * k : 3 * k + 2] = 0.0
            room.anchor[3 * k + 2] = frame.depth if off_bed[k] else 0.0
            room.facing[3 * k + 2] = -1.0 if off_bed[k] else 1.0
        _unfold(place, points, which, which.size, room)
        known[:] = True
        for pattern in patterns:
            for k in range(mirrors):
                if off_bed[k]:
                    _fit_mirror(place, points, which, k, moved, frame, pattern, pages, wanted, known, at, inside,
                                corners, room, made)  # fmt: skip
            _unfold(place, points, which, which.size, room)
        _hand_out(room, which, which.size, made)
        for q in range(which.size):
            done[which[q]] = known[q]
    return bool(np.all(done))


@njit(cache=True, nogil=True, error_model="numpy")
def _fit_mirror(
    place: Floats, points: Floats, which: NDArray[np.int64], k: int, moved: Floats, frame: Frame, pattern: Floats,
    pages: Pages, wanted: NDArray[np.bool_], known: NDArray[np.bool_], at: NDArray[np.int32], inside: Floats,
    corners: NDArray[np.float32], room: Room, made: Course,
) -> None:  # fmt: skip
    """Put one mirror of the ways in the room on the planes about their bounces; arguments as of `follow_bed`."""
    mirrors = room.anchor.shape[0] // 3
    for q in range(which.size):
        if not known[q]:
            continue
        n = which[q]
        north, east = points[n, 0] - place[0], points[n, 1] - place[1]
        level = math.sqrt(north * north + east * east)
        ahead, aside = (north / level, east / level) if level > 0 else (1.0, 0.0)
        half_length, half_width = zone(
            room.numbers[2 * mirrors, q], room.numbers[2 * k, q], room.numbers[2 * k + 1, q], frame.wavelength
        )
        here, there = room.bounce[3 * k, q], room.bounce[3 * k + 1, q]
        x, y = here - frame.north, there - frame.east
        if moved.shape[1] > 0:
            x, y = x + moved[k, n, 0], y + moved[k, n, 1]
        known[q], height, along, across, made.left[k, n] = fit_ellipse(
            frame.cosine * x + frame.sine * y, frame.cosine * y - frame.sine * x,
            frame.cosine * ahead + frame.sine * aside, frame.cosine * aside - frame.sine * ahead,
            max(half_length, frame.least), max(half_width, frame.least), pattern, pages, wanted, at, inside, corners,
        )  # fmt: skip
        lean_n, lean_e = ahead * along - aside * across, aside * along + ahead * across
        size = 1 / math.sqrt(lean_n * lean_n + lean_e * lean_e + 1)
        room.anchor[3 * k, q], room.anchor[3 * k + 1, q], room.anchor[3 * k + 2, q] = here, there, frame.depth - height
        room.facing[3 * k, q], room.facing[3 * k + 1, q] = -lean_n * size, -lean_e * size
        room.facing[3 * k + 2, q] = -size
