"""What bends around a solid: its silhouette as columns side by side, each with a top and a base."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.propagation._knife_edge_kernel import CLEAR, ENDLESS, FAR, OCCLUDED, STEEPEST, edge_number, past_edge

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[Any]


@njit(cache=True, nogil=True, error_model="numpy")
def around_solid(
    place: Floats, points: Floats, arrival: Floats, length: Floats, bounced: bool, water_depth: float,
    wavelength: float, facing: float, borders: Floats, away: Floats, columns: Floats, bed: float, row: int,
    wide: bool, far: float, table: Complexes, per_unit: float, status: Integers, occluder: Integers,
    visibility: Complexes,
) -> None:  # fmt: skip
    """Multiply what one solid leaves of the legs of one family into their visibility.

    Args:
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
    nearest = np.min(columns[:, 4])
    for n in range(points.shape[0]):
        mine = status[n] == OCCLUDED and occluder[n] == row
        level = math.hypot(arrival[n, 0], arrival[n, 1])
        if not (mine or (status[n] == CLEAR and visibility[n] != 0)) or level < STEEPEST:
            continue
        north, east = points[n, 0] - place[0], points[n, 1] - place[1]
        reach = math.hypot(north, east)
        turn = math.atan2(east, north) - facing
        turn -= 2 * math.pi * math.floor(turn / (2 * math.pi) + 0.5)
        if abs(turn) > math.pi / 2:
            continue
        if reach <= nearest or beside(reach, turn, level, length[n], wavelength, borders, away, far):
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
