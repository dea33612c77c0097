"""Kernels of diffraction around a solid: its silhouette as adjacent columns, each with a top and a base."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.knife_edge_kernel import (
    CLEAR,
    ENDLESS,
    FAR,
    OCCLUDED,
    STEEPEST,
    edge_diffraction,
    edge_fresnel_number,
)

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[Any]


@njit(cache=True, nogil=True, error_model="numpy")
def silhouette_columns(corners: Floats, bearing: Floats, borders: Floats, columns: Floats) -> None:
    """Tops and bases of the columns of a silhouette, where the edges of triangles cross their middles.

    Args:
        corners: Along, across, below the line from the sonar to the middle of the solid [m], (t, 3, 3).
        bearing: Bearing of the corners re that line [rad], (t, 3).
        borders: Bearings between the columns, evenly spaced [rad], (c + 1,).
        columns: Result: as for `diffract_around_solid`, depths re the sonar.
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
def diffract_around_solid(
    rows: Integers, position: Floats, points: Floats, arrival: Floats, length: Floats, has_bounce: bool,
    water_depth: float, wavelength: float, centre_bearing: float, borders: Floats, border_ranges: Floats,
    columns: Floats, bed_depth: float, row: int, infinitely_wide: bool, max_fresnel_number: float, table: Complexes,
    per_unit: float, status: Integers, occluder: Integers, visibility: Complexes,
) -> None:  # fmt: skip
    """Multiply the diffraction factor of one solid into the visibility of the legs of one family.

    Args:
        rows: Indices of the legs to process, (r,).
        position: North, east, depth of the sonar [m], (3,).
        points: Ends of the legs [m], (n, 3).
        arrival: Direction of travel at the points, (n, 3).
        length: Length of the legs [m], (n,).
        has_bounce: True if the family bounces; then only the last segment is diffracted.
        water_depth: Depth of the bottom [m].
        wavelength: Wavelength of the sound [m].
        centre_bearing: Bearing from the sonar to the solid [rad].
        borders: Bearings between the columns re that, increasing [rad], (c + 1,).
        border_ranges: Horizontal distance of each border from the sonar [m], (c + 1,).
        columns: Of each column: distance and depth of its top, of its base, nearest and farthest distance [m], (c, 6).
        bed_depth: Depth from which on a base counts as standing on the seabed [m].
        row: Row of the solid among the occluders.
        infinitely_wide: True for an infinitely wide screen: each leg is screened by the one column in its path.
        max_fresnel_number: Fresnel number beyond which a solid beside or below a ray is neglected.
        table: Table of `edge_diffraction`.
        per_unit: Entries of the table per unit of the Fresnel number.
        status: `LegStatus` of the legs, (n,).
        occluder: Occluders of the legs, (n,).
        visibility: Result: (n,); a leg that this solid cuts counts as clear of all others.
    """
    nearest, ahead_n, ahead_e = np.min(columns[:, 4]), math.cos(centre_bearing), math.sin(centre_bearing)
    farthest, highest = max(np.max(columns[:, 0]), np.max(columns[:, 5])), np.min(columns[:, 1])
    for n in rows:
        mine = status[n] == OCCLUDED and occluder[n] == row
        level = math.sqrt(arrival[n, 0] ** 2 + arrival[n, 1] ** 2)
        if not (mine or (status[n] == CLEAR and visibility[n] != 0)) or level < STEEPEST:
            continue
        north, east = points[n, 0] - position[0], points[n, 1] - position[1]
        reach = math.sqrt(north * north + east * east)
        if reach <= nearest or north * ahead_n + east * ahead_e < 0:
            continue
        turn = math.atan2(east, north) - centre_bearing
        turn -= 2 * math.pi * math.floor(turn / (2 * math.pi) + 0.5)
        if passes_beside(reach, turn, level, length[n], wavelength, borders, border_ranges, max_fresnel_number):
            continue
        slope = arrival[n, 2] / level
        if not mine and (
            passes_above_all(
                points[n, 2], slope, level, reach - farthest, reach - nearest, highest, length[n], wavelength,
                max_fresnel_number,
            )
            or passes_above(points[n, 2], slope, level, reach, length[n], wavelength, columns, max_fresnel_number)
        ):  # fmt: skip
            continue
        ahead = reach
        if has_bounce and slope != 0:
            ahead = min(reach, (points[n, 2] - (0.0 if slope > 0 else water_depth)) / slope)
        blocked, seen, before = 0j, False, 0j
        for k in range(borders.size):
            behind = reach - border_ranges[k] * math.cos(borders[k] - turn)
            off = border_ranges[k] * math.sin(borders[k] - turn)
            number = edge_fresnel_number(off, behind / level, length[n], wavelength)
            if behind <= 0:
                number = math.copysign(ENDLESS, off)
            here = edge_diffraction(number, table, per_unit)
            if k > 0:
                c = columns[k - 1]
                over = c[4] < reach < c[5] and borders[k - 1] <= turn <= borders[k]
                if over or behind >= ahead:
                    seen = seen and not over
                elif reach > c[0]:
                    top = screen_fresnel_number(points[n, 2], slope, level, reach - c[0], c[1], length[n], wavelength)
                    base = -ENDLESS
                    if c[3] < bed_depth and reach > c[2]:
                        base = screen_fresnel_number(
                            points[n, 2], slope, level, reach - c[2], c[3], length[n], wavelength
                        )
                    if top > -FAR:
                        up = edge_diffraction(base, table, per_unit) - edge_diffraction(top, table, per_unit)
                        across = before - here
                        if infinitely_wide:
                            across = 1 + 0j if borders[k - 1] <= turn < borders[k] else 0j
                        blocked += across * up
                    seen = seen or borders[k - 1] <= turn <= borders[k]
            before = here
        if mine:
            visibility[n] = 1 - blocked if seen else 0j
        else:
            visibility[n] *= 1 - blocked


@njit(cache=True, nogil=True, error_model="numpy")
def passes_beside(
    distance: float, relative_bearing: float, horizontal_component: float, length: float, wavelength: float,
    borders: Floats, border_ranges: Floats, max_fresnel_number: float,
) -> bool:  # fmt: skip
    """Return True if a ray passes so far beside a silhouette that its field is unchanged."""
    low, high = ENDLESS, -ENDLESS
    for k in (0, borders.size - 1):
        behind = distance - border_ranges[k] * math.cos(borders[k] - relative_bearing)
        off = border_ranges[k] * math.sin(borders[k] - relative_bearing)
        number = edge_fresnel_number(off, behind / horizontal_component, length, wavelength)
        low, high = min(low, number), max(high, number)
    return low > max_fresnel_number or high < -max_fresnel_number


@njit(cache=True, nogil=True, error_model="numpy")
def passes_above_all(
    depth: float, slope: float, horizontal_component: float, least_behind: float, most_behind: float, top: float,
    length: float, wavelength: float, max_fresnel_number: float,
) -> bool:  # fmt: skip
    """Return True only if `passes_above` is true for any columns between two distances, none higher than a top.

    Each of the two parts of `excess_path_length` decreases with its distance.

    Args:
        depth: Depth of the end of the ray [m].
        slope: Depth gained per horizontal metre.
        horizontal_component: Horizontal part of the direction [1].
        least_behind: Horizontal distance from the farthest column to the end of the ray [m].
        most_behind: That from the nearest column [m].
        top: Depth of the highest column [m].
        length: Length of the leg [m].
        wavelength: Wavelength of the sound [m].
        max_fresnel_number: Fresnel number beyond which a solid below a ray is neglected.
    """
    clear = (top - depth + min(least_behind * slope, most_behind * slope)) * horizontal_component
    if least_behind <= 0 or clear <= 0:
        return False
    behind = max(most_behind / horizontal_component, wavelength)
    before = max(length - least_behind / horizontal_component, wavelength)
    square = clear * clear
    excess = square / (math.sqrt(square + behind * behind) + behind)
    excess += square / (math.sqrt(square + before * before) + before)
    return 4 * excess > 1.000001 * max_fresnel_number * max_fresnel_number * wavelength


@njit(cache=True, nogil=True, error_model="numpy")
def passes_above(
    depth: float, slope: float, horizontal_component: float, distance: float, length: float, wavelength: float,
    columns: Floats, max_fresnel_number: float,
) -> bool:  # fmt: skip
    """Return True if a ray passes so far above a silhouette that its field is unchanged."""
    for k in range(columns.shape[0]):
        behind = distance - columns[k, 0]
        if behind <= 0 or columns[k, 4] < distance < columns[k, 5]:
            return False
        if (
            screen_fresnel_number(depth, slope, horizontal_component, behind, columns[k, 1], length, wavelength)
            > -max_fresnel_number
        ):
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def screen_fresnel_number(
    depth: float, slope: float, horizontal_component: float, distance_behind: float, edge: float, length: float,
    wavelength: float,
) -> float:  # fmt: skip
    """Fresnel number of a horizontal edge at a depth [m], at a distance [m] before the end of a straight ray."""
    return edge_fresnel_number(
        (depth - distance_behind * slope - edge) * horizontal_component,
        distance_behind / horizontal_component,
        length,
        wavelength,
    )
