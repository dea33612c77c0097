"""Kernels of diffraction around a solid: its silhouette as columns between bearings, each with a top and a base."""

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
Singles = NDArray[np.float32]
Integers = NDArray[Any]

NARROWING = 0.7
"""Factor of the Fresnel number in t = 1 / (1 + factor nu) of `edge_fields`: degree 12 is then within 3e-6 [1]."""
LANES = 8
"""Single-precision numbers in a vector register: arrays of edges are padded to a multiple of it [1]."""
_SINE = tuple(np.float32(c) for c in (1.5707963, -0.64596410, 0.079692626, -4.6817541e-3, 1.6044118e-4, -3.5988432e-6))
_COSINE = tuple(
    np.float32(c) for c in (-1.2337006, 0.25366951, -0.020863481, 9.1926027e-4, -2.5202042e-5, 4.7108748e-7)
)
"""Taylor coefficients of sine (x, x^3, ...) and cosine (x^2, x^4, ...) of x quarters of a cycle."""


class Silhouette(NamedTuple):
    """Silhouette of a solid, c columns; distances are horizontal, from the sonar."""

    centre_bearing: float
    """Bearing of its middle from the sonar [rad]."""
    border_bearings: Floats
    """Bearings of the columns' borders re that of the middle, increasing [rad], shape (c + 1,)."""
    border_ranges: Floats
    """Distance of each border [m], shape (c + 1,)."""
    columns: Floats
    """Distance and depth of each top, of each base; nearest and farthest distance of the solid [m], shape (c, 6)."""


class SolidScreen(NamedTuple):
    """Solid that diffracts, as seen from the sonar or from its image."""

    silhouette: Silhouette
    """Its silhouette."""
    bed_depth: float
    """Least depth at which a base counts as standing on the seabed [m]."""
    row: int
    """Row of the solid among the occluders."""
    infinitely_wide: bool
    """True for an infinitely wide screen: each leg is screened by the one column in its path."""
    max_fresnel_number: float
    """Fresnel number beyond which a solid beside or below a ray is neglected [1]."""


class Outline(NamedTuple):
    """Silhouette as `blocked_part` reads it: c columns, some with a base above the seabed.

    Arrays of edges are filled up to a multiple of `LANES` with their last value: m borders and tops, q bases.
    """

    borders: Floats
    """Borders of the columns re the sonar, along the bearing of its middle and to the right [m], shape (2, m)."""
    bearings: Floats
    """Bearings of the borders re that of the middle [rad], shape (c + 1,)."""
    columns: Floats
    """Its columns as in `Silhouette`, shape (c, 6)."""
    tops: Floats
    """Distance and depth of the top of each column [m], shape (2, m)."""
    bases: Floats
    """Distance and depth of the bases above the seabed [m], shape (2, q)."""
    base_row: Integers
    """Row of the base of each column in `bases`; -1 for a column that stands on the seabed, shape (c,)."""


class EdgeScratch(NamedTuple):
    """Fresnel numbers of the edges of an `Outline`, and the fields past them, to overwrite for each leg."""

    nu: Singles
    """Fresnel numbers nu of m sides, m tops and q bases [1], shape (2 m + q,)."""
    real: Singles
    """Real parts of the pressures past these edges re that without them [1], shape (2 m + q,)."""
    imag: Singles
    """Imaginary parts of these pressures [1], shape (2 m + q,)."""


class RayEnd(NamedTuple):
    """End of a leg at its scatterer, and the straight ray that arrives there."""

    depth: float
    """Depth of the end [m]."""
    slope: float
    """Depth gained per horizontal metre of travel [1]."""
    horizontal_component: float
    """Horizontal part of the unit vector of travel [1]."""
    length: float
    """Length of the whole leg [m]."""


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
def silhouette_columns(corners: Floats, bearing: Floats, depth: float, borders: Floats, columns: Floats) -> None:
    """Tops and bases of the columns of a silhouette, where the edges of triangles cross their middles.

    Args:
        corners: Along and across the line from the sonar to the middle of the solid, and depth [m], (t, 3, 3).
        bearing: Bearing of the corners re that line [rad], (t, 3).
        depth: Depth of the sonar or of its image [m].
        borders: Bearings between the columns re that line, evenly spaced [rad], (c + 1,).
        columns: Result: as `Silhouette.columns`, but depths re that of the sonar or image [m], (c, 6).
    """
    count = columns.shape[0]
    per_width = count / (borders[count] - borders[0])
    top, base = np.full(count, np.inf), np.full(count, -np.inf)
    columns[:, 4], columns[:, 5] = np.inf, -np.inf
    middle, cosine, sine = np.empty(count), np.empty(count), np.empty(count)
    for k in range(count):
        middle[k] = (borders[k] + borders[k + 1]) / 2
        cosine[k], sine[k] = math.cos(middle[k]), math.sin(middle[k])
    for t in range(corners.shape[0]):
        for e in range(3):
            a, b = corners[t, e], corners[t, (e + 1) % 3]
            start_bearing, end_bearing = bearing[t, e], bearing[t, (e + 1) % 3]
            low, high = min(start_bearing, end_bearing), max(start_bearing, end_bearing)
            if low == high:
                continue
            first = max(int((low - borders[0]) * per_width - 0.5), 0)
            for k in range(first, count):
                if middle[k] > high:
                    break
                if middle[k] < low:
                    continue
                c, s = cosine[k], sine[k]
                from_a, from_b = c * a[1] - s * a[0], c * b[1] - s * b[0]
                fraction = from_a / (from_a - from_b)
                x, y = a[0] + fraction * (b[0] - a[0]), a[1] + fraction * (b[1] - a[1])
                z = (a[2] - depth) + fraction * ((b[2] - depth) - (a[2] - depth))
                distance = math.hypot(x, y)
                if z / distance < top[k]:
                    top[k], columns[k, 0], columns[k, 1] = z / distance, distance, z
                if z / distance > base[k]:
                    base[k], columns[k, 2], columns[k, 3] = z / distance, distance, z
                columns[k, 4], columns[k, 5] = min(columns[k, 4], distance), max(columns[k, 5], distance)


@njit(cache=True, nogil=True, error_model="numpy")
def diffract_around_solid(
    rows: Integers, legs: DiffractedLegs, f: int, water_depth: float, wavelength: float, screen: SolidScreen,
    polynomials: Singles,
) -> None:  # fmt: skip
    """Multiply the diffraction factor of one solid into the visibility of the legs of one family.

    Args:
        rows: Indices of the legs to process, (r,).
        legs: The legs; their visibility is the result: a leg that this solid cuts gets the factor of this solid alone.
        f: Row of the family.
        water_depth: Depth of the plane that reflects at the bottom [m].
        wavelength: Wavelength of the sound [m].
        screen: The solid.
        polynomials: Polynomials of `edge_fields`, (2, 13).
    """
    position, points, arrival, length = legs.position, legs.points, legs.arrival[f], legs.length[f]
    status, visibility, max_fresnel_number = legs.status[f], legs.visibility[f], screen.max_fresnel_number
    centre_bearing, borders, _, columns = screen.silhouette
    nearest, axis_n, axis_e = np.min(columns[:, 4]), math.cos(centre_bearing), math.sin(centre_bearing)
    farthest, highest = max(np.max(columns[:, 0]), np.max(columns[:, 5])), np.min(columns[:, 1])
    outline = outline_of(screen.silhouette, screen.bed_depth)
    border_x, border_y = outline.borders[0, : borders.size], outline.borders[1, : borders.size]
    size = 2 * outline.tops.shape[1] + outline.bases.shape[1]
    scratch = EdgeScratch(np.empty(size, np.float32), np.empty(size, np.float32), np.empty(size, np.float32))
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
        if reach - farthest >= max(segment_length, 0.0):  # the leg passes all columns before its last reflection
            continue
        low, high = ENDLESS, -ENDLESS
        for k in (0, borders.size - 1):
            behind = reach - (border_x[k] * cosine + border_y[k] * sine)
            edge_offset = border_y[k] * cosine - border_x[k] * sine
            nu = edge_fresnel_number(edge_offset, behind / horizontal, length[n], wavelength)
            low, high = min(low, nu), max(high, nu)
        if low > max_fresnel_number or high < -max_fresnel_number:
            continue
        end = RayEnd(points[n, 2], slope, horizontal, length[n])
        if not is_cut_here and (
            passes_above_all(end, reach - farthest, reach - nearest, highest, wavelength, max_fresnel_number)
            or passes_above(end, reach, wavelength, columns, max_fresnel_number)
        ):
            continue
        blocked, is_crossed = blocked_part(
            end, PlanView(reach, segment_length, cosine, sine), wavelength, screen, outline, polynomials, scratch
        )
        if is_cut_here:
            visibility[n] = 1 - blocked if is_crossed else 0j
        else:
            visibility[n] *= 1 - blocked


@njit(cache=True, nogil=True, error_model="numpy")
def outline_of(silhouette: Silhouette, bed_depth: float) -> Outline:
    """Silhouette as `blocked_part` reads it; bases from a depth on [m] count as standing on the seabed."""
    _, bearings, border_ranges, columns = silhouette
    count = columns.shape[0]
    base_row, rows, filled = np.full(count, -1, np.int64), np.zeros(count + LANES, np.int64), 0
    for k in range(count):
        if columns[k, 3] < bed_depth:
            base_row[k], rows[filled:] = filled, k
            filled += 1
    size, base_size = (count // LANES + 1) * LANES, (filled + LANES - 1) // LANES * LANES
    borders, tops, bases = np.empty((2, size)), np.empty((2, size)), np.empty((2, base_size))
    for k in range(size):
        border, column = min(k, count), min(k, count - 1)
        borders[0, k] = border_ranges[border] * math.cos(bearings[border])
        borders[1, k] = border_ranges[border] * math.sin(bearings[border])
        tops[0, k], tops[1, k] = columns[column, 0], columns[column, 1]
    for k in range(base_size):
        bases[0, k], bases[1, k] = columns[rows[k], 2], columns[rows[k], 3]
    return Outline(borders, bearings, columns, tops, bases, base_row)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def blocked_part(
    end: RayEnd, view: PlanView, wavelength: float, screen: SolidScreen, outline: Outline, polynomials: Singles,
    scratch: EdgeScratch,
) -> tuple[complex, bool]:  # fmt: skip
    """Pressure that a silhouette takes away, re that without it [1]; True if the ray's last segment passes a column.

    Args:
        end: End of the ray.
        view: The ray from above.
        wavelength: Wavelength of the sound [m].
        screen: The solid.
        outline: Its silhouette.
        polynomials: Polynomials of `edge_fields`.
        scratch: Arrays to overwrite.
    """
    # sum over the columns of (field past left less right side) times (field past base less top), see `silhouette`
    reach, segment_length, cosine, sine = view
    columns, bearings, bearing = outline.columns, outline.bearings, math.atan2(sine, cosine)
    (nu, real, imag), first_top = scratch, outline.tops.shape[1]
    first_base = 2 * first_top
    side_fresnel_numbers(end, view, wavelength, outline.borders, nu[:first_top])
    screen_fresnel_numbers(end, reach, wavelength, outline.tops, nu[first_top:first_base])
    screen_fresnel_numbers(end, reach, wavelength, outline.bases, nu[first_base:])
    edge_fields(nu, polynomials, real, imag)
    blocked, is_crossed = 0j, False
    for k in range(columns.shape[0]):
        is_in_bearing = bearings[k] <= bearing <= bearings[k + 1]
        is_inside = is_in_bearing and columns[k, 4] < reach < columns[k, 5]
        behind = reach - (outline.borders[0, k + 1] * cosine + outline.borders[1, k + 1] * sine)
        if is_inside or behind >= segment_length:
            is_crossed = is_crossed and not is_inside
        elif reach > columns[k, 0]:
            if nu[first_top + k] > -FAR:
                across = complex(real[k] - real[k + 1], imag[k] - imag[k + 1])
                if screen.infinitely_wide:
                    across = 1 + 0j if bearings[k] <= bearing < bearings[k + 1] else 0j
                base = first_base + outline.base_row[k]
                passes_below = outline.base_row[k] >= 0 and reach > columns[k, 2]
                below = complex(real[base], imag[base]) if passes_below else 1 + 0j
                blocked += across * (below - complex(real[first_top + k], imag[first_top + k]))
            is_crossed = is_crossed or is_in_bearing
    return blocked, is_crossed


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def side_fresnel_numbers(end: RayEnd, view: PlanView, wavelength: float, borders: Floats, nu: Singles) -> None:
    """Write Fresnel numbers of `Outline.borders`, positive to the right of the ray; +-`ENDLESS` beyond its end."""
    reach, _, cosine, sine = view
    for k in range(borders.shape[1]):
        behind = reach - (borders[0, k] * cosine + borders[1, k] * sine)
        edge_offset = np.float32(borders[1, k] * cosine - borders[0, k] * sine)
        size = fresnel_number_size(edge_offset, np.float32(behind / end.horizontal_component), end.length, wavelength)
        size = size if behind > 0 else np.float32(ENDLESS)
        nu[k] = size if edge_offset >= 0 else -size


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def screen_fresnel_numbers(end: RayEnd, reach: float, wavelength: float, edges: Floats, nu: Singles) -> None:
    """Write the `screen_fresnel_number` of edges at horizontal distances from the sonar and depths [m], (2, n)."""
    for k in range(edges.shape[1]):
        behind = reach - edges[0, k]
        edge_offset = np.float32((end.depth - behind * end.slope - edges[1, k]) * end.horizontal_component)
        size = fresnel_number_size(edge_offset, np.float32(behind / end.horizontal_component), end.length, wavelength)
        nu[k] = size if edge_offset >= 0 else -size


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def fresnel_number_size(edge_offset: Any, distance_behind: Any, length: float, wavelength: float) -> Any:
    """Size of `knife_edge_kernel.edge_fresnel_number` in single precision, in a form that compilers vectorise."""
    shortest = np.float32(wavelength)
    behind: Any = max(distance_behind, shortest)
    before: Any = max(np.float32(length) - behind, shortest)
    square = edge_offset * edge_offset
    first_sum, second_sum = math.sqrt(square + behind * behind) + behind, math.sqrt(square + before * before) + before
    return math.sqrt(np.float32(4 / wavelength) * square * (first_sum + second_sum) / (first_sum * second_sum))


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def edge_fields(nu: Singles, polynomials: Singles, real: Singles, imag: Singles) -> None:
    """Pressures past half planes, as `knife_edge_kernel.edge_diffraction` to 3e-6, in a loop that compilers vectorise.

    Sine and cosine are Taylor's series of the angle from the nearest multiple of half a cycle.

    Args:
        nu: Fresnel numbers [1], (n,).
        polynomials: Coefficients of real and imaginary part, see `knife_edge.edge_polynomials`, (2, 13).
        real: Result: real parts re the pressure without the half plane [1], (n or more,).
        imag: Result: imaginary parts [1], (n or more,).
    """
    p, q = polynomials
    one, two, half = np.float32(1), np.float32(2), np.float32(0.5)
    s0, s1, s2, s3, s4, s5 = _SINE
    c0, c1, c2, c3, c4, c5 = _COSINE
    for k in range(nu.size):
        size = abs(nu[k])
        t = one / (one + np.float32(NARROWING) * size)
        x = two * t - one
        a, b = t * polynomial(p, x), t * polynomial(q, x)
        half_turns = half * size * size  # phase pi nu^2 / 2, in half cycles
        whole = np.floor(half_turns + half)
        angle = two * (half_turns - whole)  # quarters of a cycle
        y = angle * angle
        sine = angle * (s0 + y * (s1 + y * (s2 + y * (s3 + y * (s4 + y * s5)))))
        cosine = one + y * (c0 + y * (c1 + y * (c2 + y * (c3 + y * (c4 + y * c5)))))
        sign = one - two * two * (half * whole - np.floor(half * whole))  # -1 after an odd number of half turns
        a, b = sign * a, sign * b
        field_real, field_imag = a * cosine + b * sine, b * cosine - a * sine
        real[k] = field_real if nu[k] >= 0 else one - field_real
        imag[k] = field_imag if nu[k] >= 0 else -field_imag


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def polynomial(p: Singles, x: float) -> float:
    """Value at x of the polynomial of degree 12 with coefficients p, the constant first, (13,)."""
    high = p[7] + x * (p[8] + x * (p[9] + x * (p[10] + x * (p[11] + x * p[12]))))
    return p[0] + x * (p[1] + x * (p[2] + x * (p[3] + x * (p[4] + x * (p[5] + x * (p[6] + x * high))))))


@njit(cache=True, nogil=True, error_model="numpy")
def passes_above_all(
    end: RayEnd, min_behind: float, max_behind: float, top: float, wavelength: float, max_fresnel_number: float
) -> bool:
    """Return True only if `passes_above` is true for any columns between two distances, none higher than a top.

    Each of the two terms of `excess_path_length` decreases with its distance: the largest of each give a bound.

    Args:
        end: End of the ray.
        min_behind: Horizontal distance from the farthest column to the end of the ray [m].
        max_behind: Horizontal distance from the nearest column to the end of the ray [m].
        top: Depth of the highest column [m].
        wavelength: Wavelength of the sound [m].
        max_fresnel_number: Fresnel number beyond which a solid below a ray is neglected [1].
    """
    depth, slope, horizontal_component, length = end
    clearance = (top - depth + min(min_behind * slope, max_behind * slope)) * horizontal_component
    if min_behind <= 0 or clearance <= 0:
        return False
    behind = max(max_behind / horizontal_component, wavelength)
    before = max(length - min_behind / horizontal_component, wavelength)
    square = clearance * clearance
    excess = square / (math.sqrt(square + behind * behind) + behind)
    excess += square / (math.sqrt(square + before * before) + before)
    # nu^2 = 4 excess / wavelength; 1e-6 more for rounding
    return 4 * excess > 1.000001 * max_fresnel_number * max_fresnel_number * wavelength


@njit(cache=True, nogil=True, error_model="numpy")
def passes_above(end: RayEnd, distance: float, wavelength: float, columns: Floats, max_fresnel_number: float) -> bool:
    """Return True if a ray of a horizontal distance [m] passes so far above columns that its pressure is unchanged."""
    for k in range(columns.shape[0]):
        behind = distance - columns[k, 0]
        if behind <= 0 or columns[k, 4] < distance < columns[k, 5]:
            return False
        top, horizontal = columns[k, 1], end.horizontal_component
        nu = screen_fresnel_number(end.depth, end.slope, horizontal, behind, top, end.length, wavelength)
        if nu > -max_fresnel_number:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def screen_fresnel_number(
    depth: float, slope: float, horizontal_component: float, distance_behind: float, edge: float, length: float,
    wavelength: float,
) -> float:  # fmt: skip
    """Fresnel number [1] of a horizontal edge at a depth [m]; horizontal distance from it to the end of the ray [m]."""
    return edge_fresnel_number(
        (depth - distance_behind * slope - edge) * horizontal_component,
        distance_behind / horizontal_component,
        length,
        wavelength,
    )
