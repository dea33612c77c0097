"""Kernels of diffraction at edges of boxes and crests: Fresnel numbers nu (positive in shadow), Fresnel integrals."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[Any]

FAR = 30.0
"""Fresnel number beyond which an edge changes the pressure by less than 0.0075; the table ends there [1]."""
ENDLESS = 1e9
"""Fresnel number, or depth of a trough [m], that stands for an infinite one; its half counts as infinite too."""
STEEPEST = 1e-3
"""Cosine of the elevation below which a ray counts as vertical, and is not diffracted [1]."""
PER_UNIT = 96
"""Entries of the table of `edge_diffraction` per unit of the Fresnel number."""
CLEAR, OCCLUDED = 0, 2  # the values of records.legs.LegStatus


class DiffractedLegs(NamedTuple):
    """Legs of f families to n points, of which the visibility by diffraction at edges is evaluated."""

    position: Floats
    """North, east, depth of the sonar [m], (3,)."""
    points: Floats
    """North, east, depth of the points [m], (n, 3)."""
    arrival: Floats
    """Unit vectors of the direction of travel at the points [1], (f, n, 3)."""
    length: Floats
    """Length of the legs [m], (f, n)."""
    has_bounce: NDArray[np.bool_]
    """True for families with reflections, of which only the last segment is diffracted, (f,)."""
    status: Integers
    """`LegStatus` of the legs, (f, n)."""
    occluder: Integers
    """Row of the occluder that cuts each leg, (f, n)."""
    visibility: Complexes
    """Result: pressure re that without occluders [1]; at first 1 for clear legs, 0 for all others, (f, n)."""


class BoxScreens(NamedTuple):
    """Boxes that diffract, b of them."""

    boxes: Floats
    """Occluding bodies, (b, 8), see `insonify.scene.box.box_body`."""
    bed_depths: Floats
    """Least depth at which the base of each counts as standing on the seabed [m], (b,)."""
    own_box: int
    """Row of the box on which the points lie, or -1."""
    infinitely_wide: bool
    """True to treat boxes in the path as infinitely wide, and to neglect those beside it."""
    max_fresnel_number: float
    """Fresnel number beyond which a box next to a ray or below it is neglected, at most `FAR` [1]."""


class LastSegment(NamedTuple):
    """Last straight segment of a leg, which ends at its scatterer."""

    point: Floats
    """North, east, depth of its end [m], (3,)."""
    arrival: Floats
    """Unit vector of its direction of travel [1], (3,)."""
    horizontal_component: float
    """Horizontal part of the direction [1]."""
    slope: float
    """Depth gained per horizontal metre [1]."""
    horizontal_length: float
    """Its horizontal length [m]."""
    length: float
    """Length of the whole leg [m]."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def edge_diffraction(fresnel_number: float, table: Complexes) -> complex:
    """Pressure past a half plane at a Fresnel number, re that without it [1].

    Args:
        fresnel_number: Positive in the shadow, 0 on its edge.
        table: Pressure times exp(j pi number^2 / 2), from 0 on by 1 / `PER_UNIT`, two entries beyond `FAR`, (n,).
    """
    size = abs(fresnel_number)
    if size >= ENDLESS / 2:
        return 0j if fresnel_number > 0 else 1 + 0j
    if size >= FAR:
        # the first term of the asymptotic series: Born & Wolf, Principles of Optics, 8.8.1, conjugated
        real = 0.5 / (math.pi * size)
        imag = -real
    else:
        index = size * PER_UNIT
        row = min(max(int(index), 1), table.size - 3)
        t = index - row  # Lagrange's cubic through four entries
        a, b = -t * (t - 1) * (t - 2) * (1 / 6), (t + 1) * (t - 1) * (t - 2) * 0.5
        c, d = -(t + 1) * t * (t - 2) * 0.5, (t + 1) * t * (t - 1) * (1 / 6)
        p0, p1, p2, p3 = table[row - 1], table[row], table[row + 1], table[row + 2]
        real = a * p0.real + b * p1.real + c * p2.real + d * p3.real
        imag = a * p0.imag + b * p1.imag + c * p2.imag + d * p3.imag
    cosine, sine = sincos_of_quarter_turns(size * size)
    field = complex(real * cosine + imag * sine, imag * cosine - real * sine)
    return field if fresnel_number >= 0 else 1 - field


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def sincos_of_quarter_turns(quarter_turns: float) -> tuple[float, float]:
    """Cosine and sine of an angle in quarters of a cycle, to 1e-11, faster than the library's.

    Taylor's series, to the eleventh and twelfth power of at most pi / 4.
    """
    nearest = math.floor(quarter_turns + 0.5)
    x = math.pi / 2 * (quarter_turns - nearest)
    y = x * x
    s = x * (1 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + y * (1 / 362880 - y * (1 / 39916800))))))
    c = 1 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + y * (1 / 40320 + y * (-1 / 3628800 + y * (1 / 479001600))))))
    quadrant = int(nearest)
    cosine, sine = (s, c) if quadrant & 1 else (c, s)
    return -cosine if (quadrant + 1) & 2 else cosine, -sine if quadrant & 2 else sine


@njit(cache=True, nogil=True, error_model="numpy")
def diffract_around_boxes(
    rows: Integers, legs: DiffractedLegs, water_depth: float, wavelength: float, screens: BoxScreens, table: Complexes
) -> None:
    """Set the visibility of clear legs and of legs that a box cuts to the product of the diffraction factors of boxes.

    Args:
        rows: Indices of the points to process, (r,).
        legs: The legs; their visibility is the result.
        water_depth: Depth of the bottom [m].
        wavelength: Wavelength of the sound [m].
        screens: The boxes.
        table: Table of `edge_diffraction`.
    """
    position, points, arrival, length, has_bounce, status, occluder, visibility = legs
    boxes = screens.boxes
    nu = np.empty(4)
    for f in range(status.shape[0]):
        for n in rows:
            is_cut = status[f, n] == OCCLUDED
            if not (status[f, n] == CLEAR or (is_cut and 0 <= occluder[f, n] < boxes.shape[0])):
                continue
            horizontal = math.hypot(arrival[f, n, 0], arrival[f, n, 1])
            if horizontal < STEEPEST:
                continue
            segment_length = math.hypot(points[n, 0] - position[0], points[n, 1] - position[1])
            slope = arrival[f, n, 2] / horizontal
            if has_bounce[f]:
                z = 0.0 if slope > 0 else water_depth  # depth of the last reflection
                segment_length = min(segment_length, (points[n, 2] - z) / slope) if slope != 0 else segment_length
            factor, is_counted = 1 + 0j, not is_cut
            for b in range(boxes.shape[0]):
                if b == screens.own_box:
                    continue
                segment = LastSegment(points[n], arrival[f, n], horizontal, slope, segment_length, length[f, n])
                crossing = box_fresnel_numbers(
                    segment, wavelength, boxes[b], screens.bed_depths[b], screens.infinitely_wide, nu
                )
                if crossing < 0 or passes_clear(nu, screens.max_fresnel_number):
                    continue
                is_counted = is_counted or (crossing > 0 and b == occluder[f, n])
                across = edge_diffraction(nu[0], table) - edge_diffraction(nu[1], table)
                upward = edge_diffraction(nu[2], table) - edge_diffraction(nu[3], table)
                factor *= 1 - across * upward
            # a leg that its box cuts before the last reflection gets 0, its bounce point being unknown
            visibility[f, n] = factor if is_counted else 0j


@njit(cache=True, nogil=True, error_model="numpy")
def box_fresnel_numbers(
    segment: LastSegment, wavelength: float, box: Floats, bed_depth: float, infinitely_wide: bool, nu: Floats
) -> int:
    """Fresnel numbers of a box's sides, base and top for one straight last segment of a leg.

    Args:
        segment: The segment.
        wavelength: Wavelength of the sound [m].
        box: The box, (8,).
        bed_depth: Least depth at which its base counts as standing on the seabed [m].
        infinitely_wide: True for an infinitely wide box.
        nu: Result: those of both sides, increasing to the right, of the base and of the top [1], (4,).

    Returns:
        1 where the segment passes over or through the footprint, 0 where it passes beside it, -1 where the box has no
        effect.
    """
    point, arrival, horizontal_component, slope, horizontal_length, length = segment
    east, north = arrival[1] / horizontal_component, arrival[0] / horizontal_component
    low, high, behind_low, behind_high = np.inf, -np.inf, 0.0, 0.0
    last_behind, last_offset = _corner(box, 3, point, north, east)
    for k in range(4):
        behind, offset = _corner(box, k, point, north, east)
        if (behind > 0) != (last_behind > 0):  # this face reaches beyond the leg's end: an endless edge
            edge = math.copysign(ENDLESS, last_offset + (offset - last_offset) * last_behind / (last_behind - behind))
            low, behind_low = (edge, 0.0) if edge < low else (low, behind_low)
            high, behind_high = (edge, 0.0) if edge > high else (high, behind_high)
        last_behind, last_offset = behind, offset
        if behind <= 0:
            continue
        side = edge_fresnel_number(offset, min(behind, horizontal_length) / horizontal_component, length, wavelength)
        low, behind_low = (side, behind) if side < low else (low, behind_low)
        high, behind_high = (side, behind) if side > high else (high, behind_high)
    if low > high:
        return -1  # all of the box lies beyond the end
    x, y = point[0] - box[0], point[1] - box[1]
    enter, leave = footprint_interval(box, x, y, -north, -east)
    if enter <= 0 < leave:
        return -1  # the end lies over the box, or under it
    crossing = 1 if enter < leave and 0 < enter < horizontal_length else 0
    if crossing == 0:
        leave = enter = behind_low if abs(low) < abs(high) else behind_high
        if not 0 < enter < horizontal_length or infinitely_wide:
            return -1
    nu[3] = -np.inf
    for at in (enter, min(leave, horizontal_length)):
        depth = point[2] - at * slope
        top = edge_fresnel_number(
            (depth - box[6]) * horizontal_component, at / horizontal_component, length, wavelength
        )
        if top > nu[3]:
            nu[3] = top
            # below a box on the seabed no sound passes
            has_gap = box[7] < bed_depth
            nu[2] = (
                edge_fresnel_number(
                    (depth - box[7]) * horizontal_component, at / horizontal_component, length, wavelength
                )
                if has_gap
                else -ENDLESS
            )
    nu[0], nu[1] = (-ENDLESS, ENDLESS) if infinitely_wide else (low, high)
    return crossing


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def passes_clear(nu: Floats, max_fresnel_number: float) -> bool:
    """Return True if a ray passes a box at so large a distance that its field is unchanged.

    Args:
        nu: Those of the sides, the base, the top, from `box_fresnel_numbers` [1], (4,).
        max_fresnel_number: Fresnel number beyond which an edge is neglected [1].
    """
    return nu[3] < -max_fresnel_number or nu[0] > max_fresnel_number or nu[1] < -max_fresnel_number


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _corner(box: Floats, k: int, point: Floats, north: float, east: float) -> tuple[float, float]:
    """Horizontal offsets of a corner of a box re the end of a leg: back along the leg, and to the right of it [m].

    Args:
        box: The box, (8,).
        k: The corner, 0 to 3 around the outline.
        point: North, east, depth of the end [m], (3,).
        north: North component of the leg's horizontal direction [1].
        east: East component of it [1].
    """
    along = box[4] if k < 2 else -box[4]
    across = box[5] if k % 3 == 0 else -box[5]
    dx = box[0] + box[2] * along - box[3] * across - point[0]
    dy = box[1] + box[3] * along + box[2] * across - point[1]
    return -(dx * north + dy * east), dy * north - dx * east


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def edge_fresnel_number(edge_offset: float, distance_behind: float, length: float, wavelength: float) -> float:
    """Fresnel number of an edge from the path around it, to first order ITU-R P.526-15, eq. 26 (not verified).

    Args:
        edge_offset: Distance of the edge from the ray [m], with the sign of the number.
        distance_behind: Distance along the ray from the edge on to the end of the leg [m].
        length: Length of the leg [m].
        wavelength: Wavelength of the sound [m].
    """
    return math.copysign(
        2 * math.sqrt(excess_path_length(edge_offset, distance_behind, length, wavelength) / wavelength), edge_offset
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def excess_path_length(edge_offset: float, distance_behind: float, length: float, wavelength: float) -> float:
    """Length of the path around an edge, at least a wavelength from both ends, less the straight one [m]."""
    d = max(distance_behind, wavelength)
    before = max(length - d, wavelength)
    square = edge_offset * edge_offset
    first_sum, second_sum = math.sqrt(square + d * d) + d, math.sqrt(square + before * before) + before
    return square * (first_sum + second_sum) / (first_sum * second_sum)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def crest_diffraction_factor(
    clearance: float, trough_depth: float, distance_behind: float, length: float, wavelength: float, table: Complexes
) -> complex:
    """Pressure past a crest of the terrain, re that without it [1].

    The change by a knife edge, times a weight 1 - exp(-pi nu_h^2), nu_h the Fresnel number of the depth of the trough
    behind the crest. Where the ray over the crest reaches the floor of the trough, pi nu_h^2 = k depth sin(grazing),
    Rayleigh's roughness parameter: a smooth terrain casts no shadow (decision 30).

    Args:
        clearance: Height of the crest above the ray, positive in the shadow [m].
        trough_depth: Depth of the deepest terrain behind it below the ray over it [m]; `ENDLESS` for a weight of 1.
        distance_behind: Distance from the crest on to the end of the leg [m].
        length: Length of the leg [m].
        wavelength: Wavelength of the sound [m].
        table: Table of `edge_diffraction`.
    """
    return weighted_crest_factor(
        edge_fresnel_number(clearance, distance_behind, length, wavelength),
        trough_exponent(trough_depth, distance_behind, length, wavelength), trough_depth, table,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def trough_exponent(trough_depth: float, distance_behind: float, length: float, wavelength: float) -> float:
    """Exponent -pi nu_h^2 of the weight of a crest, see `crest_diffraction_factor` [1]."""
    return -4 * math.pi / wavelength * excess_path_length(trough_depth, distance_behind, length, wavelength)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def weighted_crest_factor(fresnel_number: float, exponent: float, trough_depth: float, table: Complexes) -> complex:
    """Pressure past a crest, re that without it, from its Fresnel number and the exponent of its weight [1]."""
    if fresnel_number < -FAR:
        return 1 + 0j
    if trough_depth >= ENDLESS:
        return edge_diffraction(fresnel_number, table)
    minus_weight = math.exp(exponent) - 1
    past = edge_diffraction(fresnel_number, table)
    return complex(1 + minus_weight * (1 - past.real), -minus_weight * past.imag)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def crest_is_negligible(
    h: float, trough_depth: float, distance_behind: float, length: float, wavelength: float, square: float
) -> bool:
    """Return True only if a crest changes the pressure of a ray that clears it by less than a fraction; a bound.

    Outside its shadow a half plane changes it by at most 1/2, and by at most 1 / (sqrt(2) pi nu), the first term of the
    asymptotic series. An edge at a distance h from the ray has nu^2 <= nu0^2 = h^2 2 / wavelength (1 / behind + 1 /
    before), and nu^2 >= nu0^2 near / (near + h), near = 2 min(behind, before); the weight is at most min(1, pi nu_h^2).

    square: square of the fraction [1]; other arguments as for `crest_diffraction_factor`.
    """
    d = max(distance_behind, wavelength)
    before = max(length - d, wavelength)
    # nu0^2 = h^2 total / volume; weight^2 <= scaled / volume^2; 0.05067 > 1 / (2 pi^2)
    total, volume, near = 2 * (d + before), d * before * wavelength, 2 * min(d, before)
    scaled, bound = min(volume, math.pi * trough_depth * trough_depth * total) ** 2, square * volume
    return scaled < 4 * bound * volume or scaled * 0.05067 * (near + h) < bound * h * h * total * near


@njit(cache=True, nogil=True, error_model="numpy")
def footprint_interval(box: Floats, x: float, y: float, north: float, east: float) -> tuple[float, float]:
    """Distances along a horizontal line at which it enters and leaves a box's footprint [m]; enter >= leave: it misses.

    Args:
        box: The box, (8,).
        x: Start of the line, north of the box's centre [m].
        y: Start of the line, east of the box's centre [m].
        north: North component of the line's direction.
        east: East component of the line's direction.
    """
    enter, leave = -np.inf, np.inf
    for axis in range(2):
        position = box[2] * x + box[3] * y if axis == 0 else box[2] * y - box[3] * x
        step = box[2] * north + box[3] * east if axis == 0 else box[2] * east - box[3] * north
        half = box[4 + axis]
        if abs(step) < 1e-12:
            if abs(position) >= half:
                return 1.0, 0.0
        else:
            enter = max(enter, (-math.copysign(half, step) - position) / step)
            leave = min(leave, (math.copysign(half, step) - position) / step)
    return enter, leave
