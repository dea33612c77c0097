"""Delays to every element of an array, from the one ray to its centre.

An array is small beside its distance, so the wavefront over it is nearly a sphere, with one curvature in the vertical
plane, where rays bend, and another across it, where they do not. One ray to the centre gives both: the tube's width is
the first, the distance is the second. Where that is not enough, close by or across a knot of the profile, each element
gets a ray of its own.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    CAUSTICS,
    COLUMNS,
    DELAY,
    LENGTH,
    MOST,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    SLOWNESS,
    TURNS,
    solve_points,
)
from insonify.propagation.families import bounces, is_family
from insonify.propagation.layers import Column

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

FARTHEST = 3e-6
"""A ray to an element whose delay is farther than this from the expansion's is another ray [s]."""
_LEVEL = 1e-7  # sine below which a ray counts as level, for its tube says nothing of the wavefront [1]


@dataclass(frozen=True, slots=True)
class ElementDelays:
    """Delays between e elements and n points along the rays of one family."""

    delay: Floats
    """One-way travel time [s], shape (branches, e, n); NaN where there is no ray to the centre."""
    error: Floats
    """Largest error of the expansion at the outermost elements [s], shape (branches, n); 0 if it was not asked."""
    exact: Flags
    """Where every element got a ray of its own, shape (branches, n)."""


def element_delays(
    water: Column, family: str, place: Floats, points: Floats, offsets: Floats, *, tolerance: float = 1e-9,
    method: Literal["auto", "expansion", "exact"] = "auto",
) -> ElementDelays:  # fmt: skip
    """Delays between the elements of an array and some points.

    Args:
        water: Sound speed between surface and bottom.
        family: Path family, such as "D" or "BS", named from the array outward.
        place: North, east, depth of the array's centre [m], shape (3,).
        points: The points, likewise, shape (n, 3).
        offsets: Places of the elements from the centre, north, east, down [m], shape (e, 3).
        tolerance: Error that the expansion may have [s].
        method: "expansion" for all, "exact" for all, or the expansion where it holds the tolerance.

    Returns:
        Delays of every ray of the family, those to a point by launch angle. An element in a shadow that the centre
        does not share keeps the expansion's delay.

    Raises:
        ValueError: No such family or method, a tolerance that is not positive, or a centre, an element or a point
            outside the water.

    The expansion, with x the way ahead, less by the exact change of the horizontal distance, and z the way down:

        T = T0 + (sqrt((r cos a - x)^2 + (r sin a - z)^2) - r) / c + g / (2 c^2) (sin a t^2 + 2 cos a t n),

    with launch angle a, radius r of the wavefront in the vertical plane, sound speed c and its gradient g at the
    centre, and t, n the offset along the ray and across it: a sphere, and what the gradient adds by the eikonal
    equation. It is exact for one sound speed. The error grows with the cube of the array's size; it is taken from exact
    rays to the outermost elements.
    """
    place, points, offsets = np.asarray(place, float), np.atleast_2d(points), np.atleast_2d(offsets)
    _check(water, family, place, points, offsets, tolerance, method)
    depths = np.ascontiguousarray(points[:, 2], dtype=float)
    centre, count = _solve(water, family, place, points, depths)
    branches = max(1, int(count.max(initial=0)))
    there = np.arange(branches)[:, None] < count
    delay = np.full((branches, len(offsets), len(points)), np.nan)
    for k in range(branches):
        delay[k][:, there[k]] = _expanded(water, place, points[there[k]], offsets, centre[there[k], k])
    error, exact = np.zeros(there.shape), np.zeros(there.shape, bool)
    if method == "expansion":
        return ElementDelays(delay, error, exact)
    for e in _outermost(offsets):
        own = _nearest(water, family, place + offsets[e], points, depths, delay[:, e])
        error = np.fmax(error, np.abs(delay[:, e] - own))
    exact = there & ((error > tolerance) | (method == "exact"))
    some = exact.any(axis=0)
    if some.any():
        for e in range(len(offsets)):
            own = _nearest(water, family, place + offsets[e], points[some], depths[some], delay[:, e, some])
            delay[:, e, some] = np.where(exact[:, some], own, delay[:, e, some])
    return ElementDelays(delay, error, exact)


def _check(
    water: Column, family: str, place: Floats, points: Floats, offsets: Floats, tolerance: float, method: str
) -> None:
    """Refuse what has no delays."""
    if not is_family(family):
        raise ValueError(f"family is {family!r}; give D, or letters S and B in turn, such as BS")
    if method not in ("auto", "expansion", "exact"):
        raise ValueError(f"method is {method!r}; give auto, expansion or exact")
    if not tolerance > 0:
        raise ValueError(f"tolerance is {tolerance} s; give a positive time, such as 1e-9")
    for name, depth in (("place", place[2:3]), ("points", points[:, 2]), ("offsets", place[2] + offsets[:, 2])):
        outside = ~((depth >= 0) & (depth <= water.water_depth))
        if outside.any():
            wrong = float(depth[np.argmax(outside)])
            raise ValueError(f"{name}: a depth is {wrong:g} m; the water goes from 0 to {water.water_depth:g} m")


def _solve(
    water: Column, family: str, place: Floats, points: Floats, depths: Floats
) -> tuple[Floats, NDArray[np.int64]]:  # fmt: skip
    """All rays from one place, (n, MOST, COLUMNS), and how many, (n,)."""
    n, string = len(points), bounces(family)
    ranges = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1])
    rays, count, status = np.zeros((n, MOST, COLUMNS)), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    solve_points(
        water.depth, water.speed, water.plane, float(place[2]), len(string), string.startswith("S"), depths, ranges,
        rays, count, status,
    )  # fmt: skip
    return rays, count


def _nearest(water: Column, family: str, place: Floats, points: Floats, depths: Floats, expected: Floats) -> Floats:
    """Delay of the ray that comes closest to an expected delay, (branches, n); the expected one if there is none."""
    rays, count = _solve(water, family, place, points, depths)
    found = np.where(np.arange(MOST) < count[:, None], rays[:, :, DELAY], np.inf)
    nearest = np.argmin(np.abs(found - np.nan_to_num(expected)[:, :, None]), axis=2)
    own = np.take_along_axis(found, nearest.T, axis=1).T
    return np.where(np.abs(own - expected) < FARTHEST, own, expected)


def _expanded(water: Column, place: Floats, points: Floats, offsets: Floats, ray: Floats) -> Floats:
    """Delays by the wavefront about the centre, (e, n)."""
    knots, speeds = water.depth, water.speed
    layer = int(np.clip(np.searchsorted(knots, place[2], side="right") - 1, 0, len(knots) - 2))
    gradient = (speeds[layer + 1] - speeds[layer]) / (knots[layer + 1] - knots[layer])
    c = float(np.interp(place[2], knots, speeds))
    cosine, sine = ray[:, SLOWNESS] * c, ray[:, SIN_LAUNCH]
    bend = _curvature(ray, points, place, c, float(gradient), np.interp(points[:, 2], knots, speeds))
    way = points[:, :2] - place[:2]
    away = np.hypot(way[:, 0], way[:, 1])
    moved = way - offsets[:, None, :2]
    closer = away + np.hypot(moved[..., 0], moved[..., 1])
    # away - |way - offset| without the difference of two nearly equal numbers
    across = np.sum(offsets[:, None, :2] * (2 * way - offsets[:, None, :2]), axis=2)
    x = np.divide(across, closer, out=np.zeros_like(across), where=closer > 0)
    z = offsets[:, None, 2]
    along, aside = x * cosine + z * sine, z * cosine - x * sine
    square = x**2 + z**2
    root = np.sqrt(np.maximum(1 - 2 * bend * along + bend**2 * square, 0.0))
    sphere = (bend * square - 2 * along) / (1 + root) / c
    return np.asarray(
        ray[:, DELAY] + sphere + gradient / (2 * c**2) * (sine * along**2 + 2 * cosine * along * aside)
    )  # fmt: skip


def _curvature(ray: Floats, points: Floats, place: Floats, c: float, gradient: float, at_point: Floats) -> Floats:
    """Curvature of the wavefront at the centre, in the vertical plane [1/m], (n,); negative where it converges.

    With H the second derivatives of T at the array: d2T/dR2 = dp/dR = 1 / X', known from the tube's amplitude, and the
    eikonal equation gives H along the ray; what is left is H across it.
    """
    sine, slowness = ray[:, SIN_LAUNCH], ray[:, SLOWNESS]
    away = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1])
    # A tube that has closed an odd number of times more than it has turned is a mirrored one.
    sense = np.where((ray[:, TURNS] == 0) | (ray[:, CAUSTICS] == ray[:, TURNS]), 1.0, -1.0)
    level = (np.abs(sine) < _LEVEL) | (away < 1e-9)
    safe = np.where(level, 1.0, np.abs(sine))
    tube = ray[:, AMPLITUDE] ** 2 * away * np.abs(ray[:, SIN_ARRIVAL])
    rate = sense * tube / np.where(level, 1.0, at_point * c * slowness)  # 1 / (X' |sin|)
    across = (rate + gradient * np.sign(sine) * (slowness * c) ** 2 / c**2) / safe
    return np.where(level, 1 / np.maximum(ray[:, LENGTH], 1e-6), c * across)


def _outermost(offsets: Floats) -> list[int]:
    """The elements farthest out along each axis of the world, both ways: rays bend in depth, and only there."""
    ends = [int(of(offsets[:, axis])) for axis in range(3) for of in (np.argmin, np.argmax)]
    return sorted(set(ends))
