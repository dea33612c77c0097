"""Kernels of diffraction around the edges of upright boxes: Fresnel numbers, and Fresnel integrals from a table."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[Any]

FAR = 30.0
"""Fresnel number beyond which an edge is neglected: its contribution is below 0.0075 [1]."""
ENDLESS = 1e9
STEEPEST = 1e-3
"""Cosine of the elevation below which a ray counts as vertical, and passes no top."""
PER_UNIT = 96
"""Entries of the table of `edge_diffraction` per unit of the Fresnel number."""
CLEAR, OCCLUDED = 0, 2  # the values of records.legs.LegStatus


class DiffractedLegs(NamedTuple):
    """Legs of f families to n points whose visibility is that of edges."""

    position: Floats
    """North, east, depth of the sonar [m], (3,)."""
    points: Floats
    """Ends of the legs [m], (n, 3)."""
    arrival: Floats
    """Direction of travel at the points, (f, n, 3)."""
    length: Floats
    """Length of the legs [m], (f, n)."""
    has_bounce: NDArray[np.bool_]
    """True for families that bounce, of which only the last segment is diffracted, (f,)."""
    status: Integers
    """`LegStatus` of the legs, (f, n)."""
    occluder: Integers
    """Occluders of the legs, (f, n)."""
    visibility: Complexes
    """Pressure re that without occluders: 1 for a clear leg, 0 for another, before the call, (f, n)."""


class BoxScreens(NamedTuple):
    """Boxes that diffract."""

    boxes: Floats
    """Occluding bodies, (b, 8), see `insonify.scene.box.box_body`."""
    bed_depths: Floats
    """Depth from which on the base of each counts as standing on the seabed [m], (b,)."""
    own_box: int
    """Row of the box on which the points lie, or -1."""
    infinitely_wide: bool
    """True to treat boxes as infinitely wide."""
    max_fresnel_number: float
    """Fresnel number beyond which a box next to a ray or below it is neglected, at most `FAR` [1]."""


class LastSegment(NamedTuple):
    """Last straight segment of a leg."""

    point: Floats
    """Its end [m], (3,)."""
    arrival: Floats
    """Its direction, (3,)."""
    horizontal_component: float
    """Horizontal part of the direction [1]."""
    slope: float
    """Depth gained per horizontal metre [1]."""
    horizontal_length: float
    """Its horizontal length [m]."""
    length: float
    """Length of the whole leg [m]."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def edge_diffraction(number: float, table: Complexes) -> complex:
    """Field past a half plane at a Fresnel number, re that without it [1].

    Args:
        number: Positive in the shadow, 0 on its edge.
        table: Field times exp(j pi number^2 / 2), from 0 on by 1 / `PER_UNIT`, one entry beyond `FAR`, (n,).
    """
    size = abs(number)
    if size >= ENDLESS / 2:
        return 0j if number > 0 else 1 + 0j
    if size >= FAR:
        # the first term of the asymptotic series: Born & Wolf, Principles of Optics, 8.8.1, conjugated
        real = 0.5 / (math.pi * size)
        imag = -real
    else:
        index = size * PER_UNIT
        row = min(max(int(index), 1), table.size - 3)
        t = index - row
        a, b = -t * (t - 1) * (t - 2) * (1 / 6), (t + 1) * (t - 1) * (t - 2) * 0.5
        c, d = -(t + 1) * t * (t - 2) * 0.5, (t + 1) * t * (t - 1) * (1 / 6)
        p0, p1, p2, p3 = table[row - 1], table[row], table[row + 1], table[row + 2]
        real = a * p0.real + b * p1.real + c * p2.real + d * p3.real
        imag = a * p0.imag + b * p1.imag + c * p2.imag + d * p3.imag
    cosine, sine = sincos_of_quarter_turns(size * size)
    field = complex(real * cosine + imag * sine, imag * cosine - real * sine)
    return field if number >= 0 else 1 - field


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def sincos_of_quarter_turns(quarter_turns: float) -> tuple[float, float]:
    """Cosine and sine of quarters of a cycle, to 1e-11, faster than the library's.

    Taylor's series, to the eleventh and twelfth power of at most pi / 4.
    """
    nearest = math.floor(quarter_turns + 0.5)
    x = math.pi / 2 * (quarter_turns - nearest)
    y = x * x
    s = x * (1 + y * (-1 / 6 + y * (1 / 120 + y * (-1 / 5040 + y * (1 / 362880 - y * (1 / 39916800))))))
    c = 1 + y * (-1 / 2 + y * (1 / 24 + y * (-1 / 720 + y * (1 / 40320 + y * (-1 / 3628800 + y * (1 / 479001600))))))
    side = int(nearest)
    along, across = (s, c) if side & 1 else (c, s)
    return -along if (side + 1) & 2 else along, -across if side & 2 else across


@njit(cache=True, nogil=True, error_model="numpy")
def diffract_around_boxes(
    rows: Integers, legs: DiffractedLegs, water_depth: float, wavelength: float, screens: BoxScreens, table: Complexes
) -> None:
    """Multiply the diffraction factors of boxes into the visibility of legs that no other occluder cuts.

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
    numbers = np.empty(4)
    for f in range(status.shape[0]):
        for n in rows:
            cut = status[f, n] == OCCLUDED
            if not (status[f, n] == CLEAR or (cut and 0 <= occluder[f, n] < boxes.shape[0])):
                continue
            horizontal = math.hypot(arrival[f, n, 0], arrival[f, n, 1])
            if horizontal < STEEPEST:
                continue
            segment_length = math.hypot(points[n, 0] - position[0], points[n, 1] - position[1])
            slope = arrival[f, n, 2] / horizontal
            if has_bounce[f]:
                wall = 0.0 if slope > 0 else water_depth
                segment_length = min(segment_length, (points[n, 2] - wall) / slope) if slope != 0 else segment_length
            left, is_counted = 1 + 0j, not cut
            for b in range(boxes.shape[0]):
                if b == screens.own_box:
                    continue
                segment = LastSegment(points[n], arrival[f, n], horizontal, slope, segment_length, length[f, n])
                crossed = fresnel_numbers(segment, wavelength, boxes[b], screens.bed_depths[b], screens.infinitely_wide,
                                          numbers)  # fmt: skip
                if crossed < 0 or passes_clear(numbers, screens.max_fresnel_number):
                    continue
                is_counted = is_counted or (crossed > 0 and b == occluder[f, n])
                across = edge_diffraction(numbers[0], table) - edge_diffraction(numbers[1], table)
                up = edge_diffraction(numbers[2], table) - edge_diffraction(numbers[3], table)
                left *= 1 - across * up
            # a leg that its box cuts before the last bounce stays at zero
            visibility[f, n] = left if is_counted else 0j


@njit(cache=True, nogil=True, error_model="numpy")
def fresnel_numbers(
    segment: LastSegment, wavelength: float, box: Floats, bed_depth: float, infinitely_wide: bool, numbers: Floats
) -> int:
    """Fresnel numbers of a box's sides, base and top for one straight last segment of a leg.

    Args:
        segment: The segment.
        wavelength: Wavelength of the sound [m].
        box: The box, (8,).
        bed_depth: Depth at which a base stands on the seabed [m].
        infinitely_wide: True for an infinitely wide box.
        numbers: Result: numbers of both sides, the base, the top; increasing pairs, (4,).

    Returns:
        1 where the leg passes over or through the footprint, 0 where it passes beside it, -1 where the box has no
        effect.
    """
    point, arrival, horizontal_component, slope, horizontal_length, length = segment
    east, north = arrival[1] / horizontal_component, arrival[0] / horizontal_component
    low, high, a_low, a_high = np.inf, -np.inf, 0.0, 0.0
    last_back, last_off = _corner(box, 3, point, north, east)
    for k in range(4):
        back, off = _corner(box, k, point, north, east)
        if (back > 0) != (last_back > 0):  # the side runs on behind the end of the leg: it ends beside it
            edge = math.copysign(ENDLESS, last_off + (off - last_off) * last_back / (last_back - back))
            low, a_low = (edge, 0.0) if edge < low else (low, a_low)
            high, a_high = (edge, 0.0) if edge > high else (high, a_high)
        last_back, last_off = back, off
        if back <= 0:
            continue
        number = edge_fresnel_number(off, min(back, horizontal_length) / horizontal_component, length, wavelength)
        low, a_low = (number, back) if number < low else (low, a_low)
        high, a_high = (number, back) if number > high else (high, a_high)
    if low > high:
        return -1  # all of the box lies behind the end
    x, y = point[0] - box[0], point[1] - box[1]
    enter, leave = footprint_interval(box, x, y, -north, -east)
    if enter <= 0 < leave:
        return -1  # the end lies over the box, or under it
    crossed = 1 if enter < leave and 0 < enter < horizontal_length else 0
    if crossed == 0:
        leave = enter = a_low if abs(low) < abs(high) else a_high
        if not 0 < enter < horizontal_length or infinitely_wide:
            return -1
    numbers[3] = -np.inf
    for at in (enter, min(leave, horizontal_length)):
        depth = point[2] - at * slope
        top = edge_fresnel_number(
            (depth - box[6]) * horizontal_component, at / horizontal_component, length, wavelength
        )
        if top > numbers[3]:
            numbers[3] = top
            # a box on the seabed has no gap below it
            gap = box[7] < bed_depth
            numbers[2] = (
                edge_fresnel_number(
                    (depth - box[7]) * horizontal_component, at / horizontal_component, length, wavelength
                )
                if gap
                else -ENDLESS
            )
    numbers[0], numbers[1] = (-ENDLESS, ENDLESS) if infinitely_wide else (low, high)
    return crossed


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def passes_clear(numbers: Floats, max_fresnel_number: float) -> bool:
    """Return True if a ray passes a box at so large a distance that its field is unchanged.

    Args:
        numbers: Fresnel numbers of the sides, the base, the top, (4,).
        max_fresnel_number: Fresnel number beyond which it is.
    """
    return numbers[3] < -max_fresnel_number or numbers[0] > max_fresnel_number or numbers[1] < -max_fresnel_number


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _corner(box: Floats, k: int, point: Floats, north: float, east: float) -> tuple[float, float]:
    """Distance before the end of a leg, and beside it, of a corner of a box, in the order of its outline [m].

    Args:
        box: The box, (8,).
        k: The corner, 0 to 3.
        point: The end [m], (3,).
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
        distance_behind: Distance of the edge before the end of the leg [m].
        length: Length of the leg [m].
        wavelength: Wavelength of the sound [m].
    """
    return math.copysign(
        2 * math.sqrt(excess_path_length(edge_offset, distance_behind, length, wavelength) / wavelength), edge_offset
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def excess_path_length(edge_offset: float, distance_behind: float, length: float, wavelength: float) -> float:
    """Excess length of the path around an edge over the straight one [m]; arguments of `edge_fresnel_number`."""
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

    A knife edge, weighted by the depth of the hollow behind it re the Fresnel zone there: with nu_h the
    Fresnel number of that depth the crest counts by 1 - exp(-pi nu_h^2). Where the ray over the crest reaches the
    floor, pi nu_h^2 = k hollow sin(grazing), Rayleigh's roughness parameter: a smooth terrain casts no shadow.

    Args:
        clearance: Height of the crest above the ray, positive in the shadow [m].
        trough_depth: Depth of the deepest terrain behind it below the ray over it [m].
        distance_behind: Distance of the crest from the end of the leg [m].
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
def weighted_crest_factor(number: float, exponent: float, trough_depth: float, table: Complexes) -> complex:
    """Pressure past a crest, re that without it, from its Fresnel number and the exponent of its weight [1]."""
    if number < -FAR:
        return 1 + 0j
    if trough_depth >= ENDLESS:
        return edge_diffraction(number, table)
    counts = math.exp(exponent) - 1
    past = edge_diffraction(number, table)
    return complex(1 + counts * (1 - past.real), -counts * past.imag)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def crest_is_negligible(
    clear: float, trough_depth: float, distance_behind: float, length: float, wavelength: float, square: float
) -> bool:
    """Return True if a crest changes the pressure of a ray that clears it by less than some fraction.

    The argument is the square of that fraction; see `crest_diffraction_factor`.

    Beyond its shadow a half plane changes it by at most 1/2, and by at most 1 / (sqrt(2) pi nu), the first term of the
    asymptotic series. Fresnel numbers are at most off sqrt(2 / wavelength (1 / behind + 1 / before)), and less than
    that by no more than the ratio of that path to one longer by `off`.
    """
    d = max(distance_behind, wavelength)
    before = max(length - d, wavelength)
    total, part, near = 2 * (d + before), d * before * wavelength, 2 * min(d, before)
    counts, bound = min(part, math.pi * trough_depth * trough_depth * total) ** 2, square * part
    return counts < 4 * bound * part or counts * 0.05067 * (near + clear) < bound * clear * clear * total * near


@njit(cache=True, nogil=True, error_model="numpy")
def footprint_interval(box: Floats, x: float, y: float, north: float, east: float) -> tuple[float, float]:
    """Distances at which a horizontal line enters and leaves a box's footprint [m]; the first not less where it misses.

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
