"""Kernels of diffraction around a solid: its silhouette as adjacent columns, each with a top and a base."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.knife_edge_kernel import (
    CLEAR,
    ENDLESS,
    FAR,
    OCCLUDED,
    STEEPEST,
    DiffractedLegs,
    edge_diffraction,
    edge_diffractions,
    edge_fresnel_number,
)

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[Any]


class Silhouette(NamedTuple):
    """Silhouette of a solid, c columns."""

    centre_bearing: float
    """Bearing of its middle from the sonar [rad]."""
    border_bearings: Floats
    """Bearings of the columns' borders re that, increasing [rad], shape (c + 1,)."""
    border_ranges: Floats
    """Horizontal distance of each border [m], shape (c + 1,)."""
    columns: Floats
    """Distance and depth of each top, of each base, nearest and farthest distance [m], shape (c, 6)."""


class SolidScreen(NamedTuple):
    """Solid that diffracts, as seen from the sonar or from its image."""

    silhouette: Silhouette
    """Its silhouette."""
    bed_depth: float
    """Depth from which on a base counts as standing on the seabed [m]."""
    row: int
    """Row of the solid among the occluders."""
    infinitely_wide: bool
    """True for an infinitely wide screen: each leg is screened by the one column in its path."""
    max_fresnel_number: float
    """Fresnel number beyond which a solid beside or below a ray is neglected [1]."""


class RayEnd(NamedTuple):
    """End of a straight ray."""

    depth: float
    """Its depth [m]."""
    slope: float
    """Depth gained per horizontal metre [1]."""
    horizontal_component: float
    """Horizontal part of the direction [1]."""
    length: float
    """Length of the leg [m]."""


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
            start_bearing, end_bearing = bearing[t, e], bearing[t, (e + 1) % 3]
            low, high = min(start_bearing, end_bearing), max(start_bearing, end_bearing)
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
    rows: Integers, legs: DiffractedLegs, f: int, water_depth: float, wavelength: float, screen: SolidScreen,
    table: Complexes,
) -> None:  # fmt: skip
    """Multiply the diffraction factor of one solid into the visibility of the legs of one family.

    Args:
        rows: Indices of the legs to process, (r,).
        legs: The legs; their visibility is the result, and a leg that this solid cuts counts as clear of all others.
        f: Row of the family.
        water_depth: Depth of the bottom [m].
        wavelength: Wavelength of the sound [m].
        screen: The solid.
        table: Table of `edge_diffraction`.
    """
    position, points, arrival, length = legs.position, legs.points, legs.arrival[f], legs.length[f]
    status, visibility, max_fresnel_number = legs.status[f], legs.visibility[f], screen.max_fresnel_number
    centre_bearing, borders, border_ranges, columns = screen.silhouette
    nearest, axis_n, axis_e = np.min(columns[:, 4]), math.cos(centre_bearing), math.sin(centre_bearing)
    farthest, highest = max(np.max(columns[:, 0]), np.max(columns[:, 5])), np.min(columns[:, 1])
    border_x, border_y = border_ranges * np.cos(borders), border_ranges * np.sin(borders)
    edges = np.ascontiguousarray(columns.T)
    fields = np.empty((17, borders.size))
    for n in rows:
        is_cut_here = status[n] == OCCLUDED and legs.occluder[f, n] == screen.row
        horizontal = math.sqrt(arrival[n, 0] ** 2 + arrival[n, 1] ** 2)
        if not (is_cut_here or (status[n] == CLEAR and visibility[n] != 0)) or horizontal < STEEPEST:
            continue
        north, east = points[n, 0] - position[0], points[n, 1] - position[1]
        reach = math.sqrt(north * north + east * east)
        cosine, sine = ((north * axis_n + east * axis_e) / reach, (east * axis_n - north * axis_e) / reach)
        if reach <= nearest or cosine < 0:
            continue
        low, high = ENDLESS, -ENDLESS
        for k in (0, borders.size - 1):
            behind = reach - (border_x[k] * cosine + border_y[k] * sine)
            off = border_y[k] * cosine - border_x[k] * sine
            number = edge_fresnel_number(off, behind / horizontal, length[n], wavelength)
            low, high = min(low, number), max(high, number)
        if low > max_fresnel_number or high < -max_fresnel_number:
            continue
        slope = arrival[n, 2] / horizontal
        end = RayEnd(points[n, 2], slope, horizontal, length[n])
        if not is_cut_here and (
            passes_above_all(end, reach - farthest, reach - nearest, highest, wavelength, max_fresnel_number)
            or passes_above(end, reach, wavelength, columns, max_fresnel_number)
        ):
            continue
        segment_length = reach
        if legs.has_bounce[f] and slope != 0:
            segment_length = min(reach, (points[n, 2] - (0.0 if slope > 0 else water_depth)) / slope)
        _fields_of_borders(end, (reach, cosine, sine), wavelength, border_x, border_y, table, fields)
        _fields_of_columns(end, reach, wavelength, edges, screen.bed_depth, table, fields)
        blocked, is_visible = _blocked_part(
            reach, math.atan2(sine, cosine), segment_length, borders, edges, screen.infinitely_wide, fields
        )
        if is_cut_here:
            visibility[n] = 1 - blocked if is_visible else 0j
        else:
            visibility[n] *= 1 - blocked


@njit(cache=True, nogil=True, error_model="numpy")
def _fields_of_borders(
    end: RayEnd, heading: tuple[float, float, float], wavelength: float, border_x: Floats, border_y: Floats,
    table: Complexes, fields: Floats,
) -> None:  # fmt: skip
    """Fill rows 0 to 3 of `fields` with the distance of each border before the end of a ray and the field past it.

    Args:
        end: End of the ray.
        heading: Horizontal distance of the end from the sonar [m], cosine and sine of its bearing.
        wavelength: Wavelength of the sound [m].
        border_x: Position of each border along the line to the middle of the solid [m], (c + 1,).
        border_y: Position of each border across it [m], (c + 1,).
        table: Table of `edge_diffraction`.
        fields: Result; rows 9 to 16 are a buffer for entries of the table, (17, c + 1).
    """
    reach, cosine, sine = heading
    behind, numbers = fields[0], fields[1]
    for k in range(border_x.size):
        behind[k] = reach - (border_x[k] * cosine + border_y[k] * sine)
        off = border_y[k] * cosine - border_x[k] * sine
        number = edge_fresnel_number(off, behind[k] / end.horizontal_component, end.length, wavelength)
        numbers[k] = math.copysign(ENDLESS, off) if behind[k] <= 0 else number
    edge_diffractions(numbers, table, fields[9:], fields[2], fields[3])


@njit(cache=True, nogil=True, error_model="numpy")
def _fields_of_columns(
    end: RayEnd, reach: float, wavelength: float, edges: Floats, bed_depth: float, table: Complexes, fields: Floats
) -> None:
    """Fill rows 4 to 8 of `fields` with the Fresnel number of each top and the fields past top and base.

    Args:
        end: End of the ray.
        reach: Its horizontal distance from the sonar [m].
        wavelength: Wavelength of the sound [m].
        edges: Columns of the silhouette, transposed, (6, c).
        bed_depth: Depth from which on a base counts as standing on the seabed [m].
        table: Table of `edge_diffraction`.
        fields: Result; rows 9 to 16 are a buffer for entries of the table, (17, c + 1).
    """
    depth, slope, horizontal, length = end
    count = edges.shape[1]
    tops = fields[4, :count]
    for k in range(count):
        tops[k] = screen_fresnel_number(depth, slope, horizontal, reach - edges[0, k], edges[1, k], length, wavelength)
    edge_diffractions(tops, table, fields[9:], fields[5, :count], fields[6, :count])
    for k in range(count):  # few columns have a gap below
        field = 1 + 0j
        if edges[3, k] < bed_depth and reach > edges[2, k]:
            base = screen_fresnel_number(depth, slope, horizontal, reach - edges[2, k], edges[3, k], length, wavelength)
            field = edge_diffraction(base, table)
        fields[7, k], fields[8, k] = field.real, field.imag


@njit(cache=True, nogil=True, error_model="numpy")
def _blocked_part(
    reach: float, turn: float, segment_length: float, borders: Floats, edges: Floats, infinitely_wide: bool,
    fields: Floats,
) -> tuple[complex, bool]:  # fmt: skip
    """Part of the pressure that all columns block [1], and True where one of them stands in the path.

    Args:
        reach: Horizontal distance of the end of the ray from the sonar [m].
        turn: Its bearing re the middle of the solid [rad].
        segment_length: Horizontal length of the last segment [m].
        borders: Bearings of the borders [rad], (c + 1,).
        edges: Columns of the silhouette, transposed, (6, c).
        infinitely_wide: See `SolidScreen`.
        fields: Results of `_fields_of_borders` and `_fields_of_columns`.
    """
    blocked, is_visible = 0j, False
    for k in range(edges.shape[1]):
        is_inside = edges[4, k] < reach < edges[5, k] and borders[k] <= turn <= borders[k + 1]
        if is_inside or fields[0, k + 1] >= segment_length:
            is_visible = is_visible and not is_inside
        elif reach > edges[0, k]:
            if fields[4, k] > -FAR:
                up = complex(fields[7, k] - fields[5, k], fields[8, k] - fields[6, k])
                across = complex(fields[2, k] - fields[2, k + 1], fields[3, k] - fields[3, k + 1])
                if infinitely_wide:
                    across = 1 + 0j if borders[k] <= turn < borders[k + 1] else 0j
                blocked += across * up
            is_visible = is_visible or borders[k] <= turn <= borders[k + 1]
    return blocked, is_visible


@njit(cache=True, nogil=True, error_model="numpy")
def passes_above_all(
    end: RayEnd, min_behind: float, max_behind: float, top: float, wavelength: float, max_fresnel_number: float
) -> bool:
    """Return True only if `passes_above` is true for any columns between two distances, none higher than a top.

    Each of the two parts of `excess_path_length` decreases with its distance.

    Args:
        end: End of the ray.
        min_behind: Horizontal distance from the farthest column to the end of the ray [m].
        max_behind: Horizontal distance from the nearest column [m].
        top: Depth of the highest column [m].
        wavelength: Wavelength of the sound [m].
        max_fresnel_number: Fresnel number beyond which a solid below a ray is neglected.
    """
    depth, slope, horizontal_component, length = end
    clear = (top - depth + min(min_behind * slope, max_behind * slope)) * horizontal_component
    if min_behind <= 0 or clear <= 0:
        return False
    behind = max(max_behind / horizontal_component, wavelength)
    before = max(length - min_behind / horizontal_component, wavelength)
    square = clear * clear
    excess = square / (math.sqrt(square + behind * behind) + behind)
    excess += square / (math.sqrt(square + before * before) + before)
    return 4 * excess > 1.000001 * max_fresnel_number * max_fresnel_number * wavelength


@njit(cache=True, nogil=True, error_model="numpy")
def passes_above(end: RayEnd, distance: float, wavelength: float, columns: Floats, max_fresnel_number: float) -> bool:
    """Return True if a ray passes so far above a silhouette that its field is unchanged."""
    for k in range(columns.shape[0]):
        behind = distance - columns[k, 0]
        if behind <= 0 or columns[k, 4] < distance < columns[k, 5]:
            return False
        top, horizontal = columns[k, 1], end.horizontal_component
        number = screen_fresnel_number(end.depth, end.slope, horizontal, behind, top, end.length, wavelength)
        if number > -max_fresnel_number:
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
