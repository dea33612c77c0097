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
    edge_fresnel_number,
)

Floats = NDArray[np.float64]
Integers = NDArray[Any]

NARROWING = 0.7
"""Factor of the Fresnel number in the variable of `edge_fields`: degree 12 is then within 3e-6 [1]."""


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


class Outline(NamedTuple):
    """Silhouette as `blocked_part` reads it, c columns."""

    x: Floats
    """Borders of the columns along the bearing of its middle [m], shape (c + 1,)."""
    y: Floats
    """Borders across that bearing [m], shape (c + 1,)."""
    bearings: Floats
    """Bearings of the borders re that [rad], shape (c + 1,)."""
    columns: Floats
    """Its columns as in `Silhouette`, transposed, shape (6, c)."""


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


class PlanView(NamedTuple):
    """Last segment of a ray from above, in the frame of a silhouette."""

    reach: float
    """Horizontal distance of its end from the sonar [m]."""
    segment_length: float
    """Horizontal length of the segment [m]."""
    cosine: float
    """Cosine of the bearing of its end re the middle of the silhouette [1]."""
    sine: float
    """Sine of that bearing [1]."""


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
    polynomials: Floats,
) -> None:  # fmt: skip
    """Multiply the diffraction factor of one solid into the visibility of the legs of one family.

    Args:
        rows: Indices of the legs to process, (r,).
        legs: The legs; their visibility is the result, and a leg that this solid cuts counts as clear of all others.
        f: Row of the family.
        water_depth: Depth of the bottom [m].
        wavelength: Wavelength of the sound [m].
        screen: The solid.
        polynomials: Polynomials of `edge_fields`.
    """
    position, points, arrival, length = legs.position, legs.points, legs.arrival[f], legs.length[f]
    status, visibility, max_fresnel_number = legs.status[f], legs.visibility[f], screen.max_fresnel_number
    centre_bearing, borders, border_ranges, columns = screen.silhouette
    nearest, axis_n, axis_e = np.min(columns[:, 4]), math.cos(centre_bearing), math.sin(centre_bearing)
    farthest, highest = max(np.max(columns[:, 0]), np.max(columns[:, 5])), np.min(columns[:, 1])
    border_x, border_y = border_ranges * np.cos(borders), border_ranges * np.sin(borders)
    outline = Outline(border_x, border_y, borders, np.ascontiguousarray(columns.T))
    numbers, fields = np.empty((4, borders.size)), np.empty((6, borders.size))
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
        slope = arrival[n, 2] / horizontal
        segment_length = reach
        if legs.has_bounce[f] and slope != 0:
            segment_length = min(reach, (points[n, 2] - (0.0 if slope > 0 else water_depth)) / slope)
        if reach - farthest >= max(segment_length, 0.0):  # the leg passes all columns before its last bounce
            continue
        low, high = ENDLESS, -ENDLESS
        for k in (0, borders.size - 1):
            behind = reach - (border_x[k] * cosine + border_y[k] * sine)
            off = border_y[k] * cosine - border_x[k] * sine
            number = edge_fresnel_number(off, behind / horizontal, length[n], wavelength)
            low, high = min(low, number), max(high, number)
        if low > max_fresnel_number or high < -max_fresnel_number:
            continue
        end = RayEnd(points[n, 2], slope, horizontal, length[n])
        if not is_cut_here and (
            passes_above_all(end, reach - farthest, reach - nearest, highest, wavelength, max_fresnel_number)
            or passes_above(end, reach, wavelength, columns, max_fresnel_number)
        ):
            continue
        blocked, is_visible = blocked_part(
            end, PlanView(reach, segment_length, cosine, sine), wavelength, screen, outline, polynomials,
            (numbers, fields),
        )  # fmt: skip
        if is_cut_here:
            visibility[n] = 1 - blocked if is_visible else 0j
        else:
            visibility[n] *= 1 - blocked


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def blocked_part(
    end: RayEnd, view: PlanView, wavelength: float, screen: SolidScreen, outline: Outline, polynomials: Floats,
    scratch: tuple[Floats, Floats],
) -> tuple[complex, bool]:  # fmt: skip
    """Part of a ray's pressure that a silhouette takes away, and True where its last segment crosses a column.

    Args:
        end: End of the ray.
        view: The ray from above.
        wavelength: Wavelength of the sound [m].
        screen: The solid.
        outline: Its silhouette.
        polynomials: Polynomials of `edge_fields`.
        scratch: Two arrays to overwrite, (4, c + 1) and (6, c + 1).
    """
    reach, segment_length, cosine, sine = view
    c, bearings, turn = outline.columns, outline.bearings, math.atan2(sine, cosine)
    count, (side, top, base, behind), fields = c.shape[1], scratch[0], scratch[1]
    for k in range(count + 1):
        behind[k] = reach - (outline.x[k] * cosine + outline.y[k] * sine)
        off = outline.y[k] * cosine - outline.x[k] * sine
        number = edge_fresnel_number(off, behind[k] / end.horizontal_component, end.length, wavelength)
        side[k] = number if behind[k] > 0 else math.copysign(ENDLESS, off)
    screen_fresnel_numbers(end, reach, wavelength, c[0], c[1], top)
    edge_fields(side, polynomials, fields[0], fields[1])
    edge_fields(top[:count], polynomials, fields[2], fields[3])
    if np.min(c[3]) < screen.bed_depth:
        screen_fresnel_numbers(end, reach, wavelength, c[2], c[3], base)
        edge_fields(base[:count], polynomials, fields[4], fields[5])
    blocked, is_visible = 0j, False
    for k in range(count):
        crosses = bearings[k] <= turn <= bearings[k + 1]
        is_inside = crosses and c[4, k] < reach < c[5, k]
        if is_inside or behind[k + 1] >= segment_length:
            is_visible = is_visible and not is_inside
        elif reach > c[0, k]:
            if top[k] > -FAR:
                across = complex(fields[0, k] - fields[0, k + 1], fields[1, k] - fields[1, k + 1])
                if screen.infinitely_wide:
                    across = 1 + 0j if bearings[k] <= turn < bearings[k + 1] else 0j
                below = (
                    complex(fields[4, k], fields[5, k]) if c[3, k] < screen.bed_depth and reach > c[2, k] else 1 + 0j
                )
                blocked += across * (below - complex(fields[2, k], fields[3, k]))
            is_visible = is_visible or crosses
    return blocked, is_visible


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def screen_fresnel_numbers(
    end: RayEnd, reach: float, wavelength: float, distances: Floats, depths: Floats, numbers: Floats
) -> None:
    """Write the `screen_fresnel_number` of edges at horizontal distances from the sonar [m] and depths [m], (n,)."""
    depth, slope, horizontal, length = end
    for k in range(distances.size):
        numbers[k] = screen_fresnel_number(
            depth, slope, horizontal, reach - distances[k], depths[k], length, wavelength
        )


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def edge_fields(numbers: Floats, polynomials: Floats, real: Floats, imag: Floats) -> None:
    """Fields past half planes, as `knife_edge_kernel.edge_diffraction` to 3e-6, in a loop that compilers vectorise.

    Args:
        numbers: Fresnel numbers, (n,).
        polynomials: Coefficients of real and imaginary part, see `knife_edge.edge_polynomials`, (2, 13).
        real: Result: real parts [1], (n or more,).
        imag: Result: imaginary parts [1], (n or more,).
    """
    p, q = polynomials
    for k in range(numbers.size):
        size = abs(numbers[k])
        t = 1 / (1 + NARROWING * size)
        x = 2 * t - 1
        a, b = t * polynomial(p, x), t * polynomial(q, x)
        quarter_turns = size * size
        whole_turns = np.floor(quarter_turns + 0.5)
        angle = math.pi / 2 * (quarter_turns - whole_turns)
        y = angle * angle
        sine_part = angle * (1 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + y * (1 / 362880)))))
        cosine_part = 1 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + y * (1 / 40320 - y * (1 / 3628800)))))
        quadrant = whole_turns - 4 * np.floor(whole_turns / 4)
        is_odd = (quadrant == 1) | (quadrant == 3)
        cosine, sine = (sine_part if is_odd else cosine_part), (cosine_part if is_odd else sine_part)
        cosine = -cosine if (quadrant == 1) | (quadrant == 2) else cosine
        sine = -sine if quadrant >= 2 else sine
        field_real, field_imag = a * cosine + b * sine, b * cosine - a * sine
        real[k] = field_real if numbers[k] >= 0 else 1 - field_real
        imag[k] = field_imag if numbers[k] >= 0 else -field_imag


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def polynomial(p: Floats, x: float) -> float:
    """Polynomial of degree 12 with coefficients from the constant on."""
    high = p[7] + x * (p[8] + x * (p[9] + x * (p[10] + x * (p[11] + x * p[12]))))
    return p[0] + x * (p[1] + x * (p[2] + x * (p[3] + x * (p[4] + x * (p[5] + x * (p[6] + x * high))))))


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
