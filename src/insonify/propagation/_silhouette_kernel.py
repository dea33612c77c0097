"""What bends around a solid: its silhouette as columns side by side, each with a top and a base."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._knife_edge_kernel import CLEAR, ENDLESS, FAR, OCCLUDED, STEEPEST, edge_number, past_edge

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[Any]


@njit(cache=True, nogil=True, error_model="numpy")
def cut_columns(corners: Floats, bearing: Floats, borders: Floats, columns: Floats) -> None:
    """Tops and bases of the columns of a silhouette, where the edges of triangles cross their middles.

    Args:
        corners: Along, across, below the way from the sonar to the middle of the solid [m], (t, 3, 3).
        bearing: Of the corners re that way [rad], (t, 3).
        borders: Bearings between the columns, evenly spaced [rad], (c + 1,).
        columns: Result, as of `around_solid`, depths re the sonar.
    """
    count = columns.shape[0]
    per_width = count / (borders[count] - borders[0])
    top, base = np.full(count, np.inf), np.full(count, -np.inf)
    columns[:, 4], columns[:, 5] = np.inf, -np.inf
    for t in range(corners.shape[0]):
        for e in range(3):
            a, b = corners[t, e], corners[t, (e + 1) % 3]
            one, other = bearing[t, e], bearing[t, (e + 1) % 3]
            low, high = min(one, other), max(one, other)
            if low == high:
                continue
            first = max(int((low - borders[0]) * per_width - 0.5), 0)
            for k in range(first, count):
                turn = (borders[k] + borders[k + 1]) / 2
                if turn > high:
                    break
                if turn < low:
                    continue
                c, s = math.cos(turn), math.sin(turn)
                from_a, from_b = c * a[1] - s * a[0], c * b[1] - s * b[0]
                part = from_a / (from_a - from_b)
                x, y, z = a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2])
                distance = math.hypot(x, y)
                if z / distance < top[k]:
                    top[k], columns[k, 0], columns[k, 1] = z / distance, distance, z
                if z / distance > base[k]:
                    base[k], columns[k, 2], columns[k, 3] = z / distance, distance, z
                columns[k, 4], columns[k, 5] = min(columns[k, 4], distance), max(columns[k, 5], distance)


@njit(cache=True, nogil=True, error_model="numpy")
def around_solid(
    rows: Integers, place: Floats, points: Floats, arrival: Floats, length: Floats, bounced: bool, water_depth: float,
    wavelength: float, facing: float, borders: Floats, away: Floats, columns: Floats, bed: float, row: int,
    wide: bool, far: float, table: Complexes, per_unit: float, status: Integers, occluder: Integers,
    visibility: Complexes,
) -> None:  # fmt: skip
    """Multiply what one solid leaves of the legs of one family into their visibility.

    Args:
        rows: Which of the legs are looked at, (r,).
        place: North, east, depth of the sonar [m], (3,).
        points: Ends of the legs [m], (n, 3).
        arrival: Direction of travel at the points, (n, 3).
        length: Length of the legs [m], (n,).
        bounced: Whether the family bounces: then the last segment is looked at.
        water_depth: Depth of the bottom [m].
        wavelength: Of the sound [m].
        facing: Bearing from the sonar to the solid [rad].
        borders: Bearings between the columns re that, increasing [rad], (c + 1,).
        away: Horizontal distance of each border from the sonar [m], (c + 1,).
        columns: Of each column: distance and depth of its top, of its base, nearest and farthest distance [m], (c, 6).
        bed: Depth from which on a base stands on the bed [m].
        row: Row of the solid among the occluders.
        wide: Whether it is taken as endlessly wide: then the one column in the way of each leg screens it.
        far: Fresnel number beyond which a solid that a ray passes beside, or above, takes nothing.
        table: See `past_edge`.
        per_unit: See `past_edge`.
        status: Of the legs, (n,).
        occluder: Of the legs, (n,).
        visibility: Result, (n,); a leg that this solid cuts is taken as clear of all others.
    """
    nearest, ahead_n, ahead_e = np.min(columns[:, 4]), math.cos(facing), math.sin(facing)
    for n in rows:
        mine = status[n] == OCCLUDED and occluder[n] == row
        level = math.sqrt(arrival[n, 0] ** 2 + arrival[n, 1] ** 2)
        if not (mine or (status[n] == CLEAR and visibility[n] != 0)) or level < STEEPEST:
            continue
        north, east = points[n, 0] - place[0], points[n, 1] - place[1]
        reach = math.sqrt(north * north + east * east)
        if reach <= nearest or north * ahead_n + east * ahead_e < 0:
            continue
        turn = math.atan2(east, north) - facing
        turn -= 2 * math.pi * math.floor(turn / (2 * math.pi) + 0.5)
        if beside(reach, turn, level, length[n], wavelength, borders, away, far):
            continue
        slope = arrival[n, 2] / level
        if not mine and above(points[n, 2], slope, level, reach, length[n], wavelength, columns, far):
            continue
        ahead = reach
        if bounced and slope != 0:
            ahead = min(reach, (points[n, 2] - (0.0 if slope > 0 else water_depth)) / slope)
        blocked, seen, before = 0j, False, 0j
        for k in range(borders.size):
            behind = reach - away[k] * math.cos(borders[k] - turn)
            off = away[k] * math.sin(borders[k] - turn)
            number = edge_number(off, behind / level, length[n], wavelength)
            if behind <= 0:
                number = math.copysign(ENDLESS, off)
            here = past_edge(number, table, per_unit)
            if k > 0:
                c = columns[k - 1]
                over = c[4] < reach < c[5] and borders[k - 1] <= turn <= borders[k]
                if over or behind >= ahead:
                    seen = seen and not over
                elif reach > c[0]:
                    top = screen_number(points[n, 2], slope, level, reach - c[0], c[1], length[n], wavelength)
                    base = -ENDLESS
                    if c[3] < bed and reach > c[2]:
                        base = screen_number(points[n, 2], slope, level, reach - c[2], c[3], length[n], wavelength)
                    if top > -FAR:
                        up = past_edge(base, table, per_unit) - past_edge(top, table, per_unit)
                        across = before - here
                        if wide:
                            across = 1 + 0j if borders[k - 1] <= turn < borders[k] else 0j
                        blocked += across * up
                    seen = seen or borders[k - 1] <= turn <= borders[k]
            before = here
        if mine:
            visibility[n] = 1 - blocked if seen else 0j
        else:
            visibility[n] *= 1 - blocked


@njit(cache=True, nogil=True, error_model="numpy")
def beside(
    reach: float, turn: float, level: float, length: float, wavelength: float, borders: Floats, away: Floats, far: float
) -> bool:
    """Whether a ray passes so far beside a silhouette that nothing is missing from it."""
    low, high = ENDLESS, -ENDLESS
    for k in (0, borders.size - 1):
        behind = reach - away[k] * math.cos(borders[k] - turn)
        off = away[k] * math.sin(borders[k] - turn)
        number = edge_number(off, behind / level, length, wavelength)
        low, high = min(low, number), max(high, number)
    return low > far or high < -far


@njit(cache=True, nogil=True, error_model="numpy")
def above(
    depth: float,
    slope: float,
    level: float,
    reach: float,
    length: float,
    wavelength: float,
    columns: Floats,
    far: float,
) -> bool:
    """Whether a ray passes so far above a silhouette that nothing is missing from it."""
    for k in range(columns.shape[0]):
        behind = reach - columns[k, 0]
        if behind <= 0 or columns[k, 4] < reach < columns[k, 5]:
            return False
        if screen_number(depth, slope, level, behind, columns[k, 1], length, wavelength) > -far:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def screen_number(
    depth: float, slope: float, level: float, behind: float, edge: float, length: float, wavelength: float
) -> float:
    """Fresnel number of a level edge at a depth [m], some way [m] before the end of a straight ray."""
    return edge_number((depth - behind * slope - edge) * level, behind / level, length, wavelength)
