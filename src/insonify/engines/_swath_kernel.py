"""Walks along lines of the ground that gather everything about it in one go: where it is lit, and by which legs.

One line is one azimuth. Its ground is looked up in the map, sample after sample outwards; shadows of every family
follow by the rules of `insonify.engines.skyline`; what is left are columns of points that some family reaches.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

CELLS = 64
"""Cells along a piece of the map."""
AROUND = 512
GOLDEN = 0.6180339887498949
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_E = tuple(np.float32(c) for c in (1.0, 0.69314718, 0.24022651, 0.05550411, 0.00961813, 0.00133336, 0.00015404))


@njit(inline="always")
def exp2_of(x: Any) -> Any:
    """2^x for x up to 0, within 1e-6 of itself; nothing below 2^-100."""
    y: Any = max(x, np.float32(-100.0))
    whole = np.int32(y - np.float32(0.5))  # towards 0: nearest, for all that is not above 0
    part = y - np.float32(whole)
    scale = np.int32((whole + np.int32(127)) << 23).view(np.float32)
    e0, e1, e2, e3, e4, e5, e6 = _E
    return scale * (e0 + part * (e1 + part * (e2 + part * (e3 + part * (e4 + part * (e5 + part * e6))))))


@njit(cache=True, nogil=True, error_model="numpy")
def pieces_on_lines(
    along: float, across: float, lines: Floats, step: float, cell: float, mark: Integers, found: Integers
) -> int:
    """Numbers of the pieces of the map that some lines cross.

    Args:
        along: Where the lines start, in the frame of the map [m].
        across: Likewise [m].
        lines: As of `walk`.
        step: Distance of samples [m].
        cell: Side of a cell of the map [m].
        mark: Scratch, zeros on entry, (AROUND, AROUND).
        found: Result, (most, 2).

    Returns:
        How many there are, `most` at the most.
    """
    count = 0
    for s in range(lines.shape[0]):
        last_a = last_b = -(1 << 60)
        for k in range(int(lines[s, 5] / step) + 1):
            r = (k + lines[s, 6]) * step
            a = math.floor((along + r * lines[s, 0]) / cell) >> 6
            b = math.floor((across + r * lines[s, 1]) / cell) >> 6
            if a != last_a or b != last_b:
                last_a, last_b = a, b
                if mark[a & (AROUND - 1), b & (AROUND - 1)] == 0:
                    mark[a & (AROUND - 1), b & (AROUND - 1)] = 1
                    found[count, 0], found[count, 1] = a, b
                    count += 1
                    if count == found.shape[0]:
                        return count
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def look_up(
    along: float, across: float, line: Floats, step: float, count: int, cell: float, slot: Integers,
    pieces: Singles, flat: bool, height: Singles, slope: Singles,
) -> None:  # fmt: skip
    """Ground along one line: heights linear between nodes, slopes of the nearest node, so that none gets gentler.

    Args:
        along: As of `walk`.
        across: As of `walk`.
        line: One row of `lines`, (8,).
        step: As of `walk`.
        count: Samples wanted.
        cell: As of `walk`.
        slot: As of `walk`.
        pieces: As of `walk`.
        flat: As of `walk`.
        height: Result [m], (at least count,).
        slope: Result, along the frame's axes [1], (2, at least count).
    """
    if flat:
        height[:count] = 0
        slope[:, :count] = 0
        return
    last_a = last_b = -(1 << 60)
    row = 0
    start_a, start_b = along / cell, across / cell
    pace = step / cell
    step_a, step_b = line[0] * pace, line[1] * pace
    for k in range(count):
        x = start_a + (k + line[6]) * step_a
        y = start_b + (k + line[6]) * step_b
        i, j = math.floor(x), math.floor(y)
        f, g = np.float32(x - i), np.float32(y - j)
        a, b = i >> 6, j >> 6
        if a != last_a or b != last_b:
            last_a, last_b = a, b
            row = slot[a & (AROUND - 1), b & (AROUND - 1)]
        u, v = np.uint64(i & (CELLS - 1)), np.uint64(j & (CELLS - 1))
        piece = pieces[row]
        one = np.uint64(1)
        low = piece[u, v, 0] + g * (piece[u, v + one, 0] - piece[u, v, 0])
        high = piece[u + one, v, 0] + g * (piece[u + one, v + one, 0] - piece[u + one, v, 0])
        height[k] = low + f * (high - low)
        p = u + one if f >= np.float32(0.5) else u
        q = v + one if g >= np.float32(0.5) else v
        slope[0, k], slope[1, k] = piece[p, q, 1], piece[p, q, 2]


@njit(cache=True, nogil=True, error_model="numpy")
def bounds_of(ground: Singles, image: float, rising: bool, step: float, first: float, count: int,
              launch: Singles, bound: Singles) -> None:  # fmt: skip
    """Launch that meets the ground at each sample of a line, and what hides by it, as in `skyline._Lines.of`.

    Args:
        ground: Depth of the ground [m], (at least count,).
        image: Depth of the image source of a family [m].
        rising: Whether the family's last bounce is off the bottom.
        step: Distance of samples [m].
        first: Place of the first sample in steps.
        count: Samples of the line.
        launch: Result, tangents [1], (at least count,).
        bound: Result, smallest tangent so far, or largest from here on [1], (at least count,).
    """
    if rising:
        most = np.float32(-np.inf)
        for k in range(count - 1, -1, -1):
            x = np.float32((image - ground[k]) / ((k + first) * step))
            launch[k] = x if x == x else np.float32(-np.inf)
            most = max(most, launch[k])
            bound[k] = most
    else:
        least = np.float32(np.inf)
        for k in range(count):
            x = np.float32((ground[k] - image) / ((k + first) * step))
            launch[k] = x if x == x else np.float32(np.inf)
            least = min(least, launch[k])
            bound[k] = least


@njit(cache=True, nogil=True, error_model="numpy")
def reached_by(
    family: int, lit: Integers, begin: int, count: int, first: float, step: float, ground: Singles, image: float,
    source: float, water_depth: float, wavelength: float, letters: Integers, prefix: Integers, launch: Singles,
    bound: Singles,
) -> None:  # fmt: skip
    """Mark the samples of a line that one family reaches, segment by segment; for ground below the sonar only.

    Args:
        family: Row of the family, and the bit that is set.
        lit: Bits of the families that reach each sample, (at least count,).
        begin: First sample that is asked for.
        count: Samples of the line.
        first: Place of the first sample in steps.
        step: Distance of samples [m].
        ground: Depth [m], (at least count,).
        image: Depth of the family's image source [m].
        source: Depth of the sonar [m].
        water_depth: Of the mean plane [m].
        wavelength: Of the sound, for the size of a bounce's mirror [m].
        letters: Bounces of each family, 1 surface, 2 bottom, 0 no more, (f, most).
        prefix: Row in `launch` of what has been passed up to each segment, (f, most + 1).
        launch: Of `bounds_of`, (rows, samples).
        bound: Likewise.
    """
    bounces = 0
    while bounces < letters.shape[1] and letters[family, bounces] > 0:
        bounces += 1
    own, bit = prefix[family, bounces], 1 << family
    for k in range(begin, count):
        if launch[own, k] <= bound[own, k]:
            if bounces == 0:
                lit[k] |= bit
            else:
                reach = (k + first) * step
                tangent = abs(ground[k] - image) / reach
                if passes(family, bounces, reach, tangent, count, first, step, source, water_depth, wavelength,
                          letters, prefix, launch, bound):  # fmt: skip
                    lit[k] |= bit


@njit(cache=True, nogil=True, error_model="numpy")
def passes(
    family: int, bounces: int, reach: float, tangent: float, count: int, first: float, step: float, source: float,
    water_depth: float, wavelength: float, letters: Integers, prefix: Integers, launch: Singles, bound: Singles,
) -> bool:  # fmt: skip
    """Whether a ray to a distance meets no ground before its last bounce; arguments as of `reached_by`."""
    stretch = math.sqrt(1 + tangent * tangent)
    begin = water_depth - source if letters[family, 0] == 2 else source
    before, before_half = 0.0, 0.0
    for s in range(bounces):
        stop, half = (begin + s * water_depth) / tangent, 0.0
        if letters[family, s] == 2:
            share = min(max(stop / reach, 0.0), 1.0)
            half = math.sqrt(wavelength * reach * stretch * share * (1 - share)) * stretch / tangent
        passed = prefix[family, s]
        if s > 0 and letters[family, s - 1] == 2:
            m = max(math.ceil((before + before_half) / step - first), 0)
            end = min(math.floor((stop - half) / step - first) + 1, count)
            if m < end and bound[passed, m] > tangent:
                while m < end:
                    if launch[passed, m] > tangent:
                        return False
                    m += 1
        elif s > 0 or letters[family, 0] == 2:
            m = min(math.floor((stop - half) / step - first), count - 1)
            if m >= 0 and tangent > bound[passed, m]:
                return False
        before, before_half = stop, half
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def walk(
    along: float, across: float, heading: float, source: float, water_depth: float, speed: float,
    wavelength: float, lines: Floats, step: float, cell: float, slot: Integers, pieces: Singles, flat: bool,
    images: Floats, letters: Integers, prefix: Integers, way_images: Floats, way_rising: NDArray[np.bool_],
    mirrors: NDArray[np.complex64], loss: float, delay: Floats, amplitude: NDArray[np.complex64], departure: Singles,
    arrival: Singles, normal: Singles, area: Singles,
) -> int:  # fmt: skip
    """Points of the ground along some lines that any family reaches, and their legs.

    Args:
        along: Where the lines start, in the frame of the map [m].
        across: Likewise [m].
        heading: Of that frame in the world [rad].
        source: Depth of the sonar [m].
        water_depth: Of the mean plane [m].
        speed: Of sound [m/s].
        wavelength: Of the sound [m].
        lines: Cosine and sine of each line in the frame of the map; width of its cell [rad]; width over which the
            beam is asked in turn, 0 for its middle alone [rad]; start and stop of what is heard [m]; place of its first
            sample in steps; its number; (s, 8).
        step: Distance of samples [m].
        cell: Side of a cell of the map [m].
        slot: Row in `pieces` of each piece of the map, by its numbers modulo AROUND, (AROUND, AROUND).
        pieces: Height [m] and slopes [1] on nodes, (pieces, 65, 65, 3).
        flat: Whether the bed is level, and has no map.
        images: Depth of the image source of each family [m], (f,).
        letters: As of `reached_by`.
        prefix: As of `reached_by`.
        way_images: Depth of the image source of each row of launches [m], (ways,).
        way_rising: Whether its last bounce is off the bottom, (ways,).
        mirrors: Product of all bounces of a family, over evenly spaced sines of the grazing angle [1], (f, nodes).
        loss: Absorption [octaves of pressure/m].
        delay: Result, one-way travel time [s], (f, most).
        amplitude: Result, pressure re 1 m [1]; 0 where there is no path, (f, most).
        departure: Result, direction of travel at the sonar, in the world, (f, 3, most).
        arrival: Result, direction of travel at the point, (f, 3, most).
        normal: Result, unit normal into the water, (3, most).
        area: Result [m^2], (most,).

    Returns:
        Number of points.
    """
    longest = 1
    for s in range(lines.shape[0]):
        longest = max(longest, int(lines[s, 5] / step) + 1)
    ground, slope = np.empty(longest, np.float32), np.empty((2, longest), np.float32)
    launch, bound = np.empty((2, way_images.size, longest), np.float32)
    lit, bits = np.empty(longest, np.int32), np.empty((2, longest), np.int32)
    kept, facet = np.empty((2, longest)), np.empty((3, longest), np.float32)
    n = 0
    for s in range(lines.shape[0]):
        count, first = int(lines[s, 5] / step), lines[s, 6]
        look_up(along, across, lines[s], step, count, cell, slot, pieces, flat, ground, slope)
        for k in range(count):
            ground[k] = np.float32(water_depth) - ground[k]
            lit[k] = 0
        for w in range(way_images.size):
            bounds_of(ground, way_images[w], way_rising[w], step, first, count, launch[w], bound[w])
        begin = max(math.ceil(lines[s, 4] / step - first), 0)
        for f in range(images.size):
            reached_by(f, lit, begin, count, first, step, ground, images[f], source, water_depth, wavelength, letters,
                       prefix, launch, bound)  # fmt: skip
        n = legs_along(lines[s], heading, begin, count, step, speed, loss, ground, slope, lit, images, letters,
                       mirrors, kept, facet, bits, n, delay, amplitude, departure, arrival, normal, area)  # fmt: skip
    return n


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def tilted(
    reach: Floats, along: Singles, across: Singles, cos_h: float, sin_h: float, share: float, north: Singles,
    east: Singles, down: Singles, area: Singles,
) -> None:  # fmt: skip
    """Unit normals into the water, and areas, of facets.

    Args:
        reach: Horizontal distance [m], (n,).
        along: Slope along the frame's first axis [1], (n,).
        across: Along its second [1], (n,).
        cos_h: Cosine of the frame's heading.
        sin_h: Its sine.
        share: Step times width of the line's cell [m].
        north: Result, (n,).
        east: Result, (n,).
        down: Result, (n,).
        area: Result [m^2], (n,).
    """
    c, s = np.float32(cos_h), np.float32(sin_h)
    for i in range(reach.size):
        a, b = c * along[i] - s * across[i], s * along[i] + c * across[i]
        stretch = math.sqrt(np.float32(1) + a * a + b * b)
        up = np.float32(1) / stretch
        north[i], east[i], down[i] = -a * up, -b * up, -up
        area[i] = np.float32(reach[i] * share) * stretch


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def straight(
    reach: Floats, depth: Floats, image: float, slowness: float, loss: float, cosine: float, sine: float,
    turned: float, bit: int, bits: Integers, normal_n: Singles, normal_e: Singles, normal_d: Singles, delay: Floats,
    into_n: Singles, into_e: Singles, into_d: Singles, out_d: Singles, size: Singles,
) -> None:  # fmt: skip
    """Straight legs of one family to points of one line: delay, directions, spreading with absorption.

    Args:
        reach: Horizontal distance [m], (n,).
        depth: Of the points [m], (n,).
        image: Depth of the image source [m].
        slowness: One over the speed of sound [s/m].
        loss: Absorption [octaves of pressure/m].
        cosine: Of the line's bearing.
        sine: Likewise.
        turned: -1 for an odd number of bounces, else 1.
        bit: Of the family in `bits`.
        bits: Families that reach each point, (n,).
        normal_n: Of the facets, (n,).
        normal_e: Likewise.
        normal_d: Likewise.
        delay: Result [s], (n,).
        into_n: Result, direction of travel at the point, (n,).
        into_e: Likewise.
        into_d: Likewise.
        out_d: Result, vertical part of the direction at the sonar, (n,).
        size: Result, pressure re 1 m but for bounces, 0 where the leg is not there [1], (n,).
    """
    c, s, t = np.float32(cosine), np.float32(sine), np.float32(turned)
    mask, least = np.int32(1 << bit), np.float32(loss)
    for i in range(reach.size):
        dz = depth[i] - image
        length = math.sqrt(reach[i] * reach[i] + dz * dz)
        inverse = 1.0 / length
        delay[i] = length * slowness
        level, fall = np.float32(reach[i] * inverse), np.float32(dz * inverse)
        x, y = level * c, level * s
        into_n[i], into_e[i], into_d[i], out_d[i] = x, y, fall, fall * t
        there = ((bits[i] & mask) != 0) & (x * normal_n[i] + y * normal_e[i] + fall * normal_d[i] < np.float32(0))
        value = np.float32(inverse) * exp2_of(-least * np.float32(length))
        size[i] = value if there else np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def aside(which: Integers, shift: float, width: float, cosine: float, sine: float, out_n: Singles, out_e: Singles,
          into_n: Singles, into_e: Singles) -> None:  # fmt: skip
    """Directions at the sonar, turned within the width of the line's cell, another part of it for each sample.

    Args:
        which: Number of each sample, (n,).
        shift: Place within the width of sample 0 [1].
        width: Of the cell, 0 for its middle alone [rad].
        cosine: Of the line's bearing.
        sine: Likewise.
        out_n: Result, (n,).
        out_e: Result, (n,).
        into_n: Direction at the point, (n,).
        into_e: Likewise.
    """
    for i in range(which.size):
        place = shift + (which[i] + 0.5) * GOLDEN
        turn = np.float32((place - math.floor(place) - 0.5) * width)
        middle = np.float32(1) - np.float32(0.5) * turn * turn
        out_n[i] = into_n[i] * middle - into_e[i] * turn
        out_e[i] = into_e[i] * middle + into_n[i] * turn


@njit(cache=True, nogil=True, error_model="numpy")
def legs_along(
    line: Floats, heading: float, begin: int, count: int, step: float, speed: float, loss: float, ground: Singles,
    slope: Singles, lit: Integers, images: Floats, letters: Integers, mirrors: NDArray[np.complex64],
    kept: Floats, facet: Singles, bits: Integers, n: int, delay: Floats, amplitude: NDArray[np.complex64],
    departure: Singles, arrival: Singles, normal: Singles, area: Singles,
) -> int:  # fmt: skip
    """Legs to the lit samples of one line, appended to the columns from row n on; arguments as of `walk`.

    Returns:
        Number of points.
    """
    m, room, first = 0, area.size - n, line[6]
    for k in range(begin, count):
        if lit[k] != 0 and ground[k] > 0 and m < room:
            kept[0, m], kept[1, m] = (k + first) * step, ground[k]
            facet[0, m], facet[1, m] = slope[0, k], slope[1, k]
            bits[0, m], bits[1, m] = lit[k], k
            m += 1
    stop = n + m
    cos_h, sin_h = math.cos(heading), math.sin(heading)
    cosine, sine = cos_h * line[0] - sin_h * line[1], sin_h * line[0] + cos_h * line[1]
    reach, depth, size = kept[0, :m], kept[1, :m], facet[2, :m]
    north, east, down = normal[0, n:stop], normal[1, n:stop], normal[2, n:stop]
    tilted(reach, facet[0, :m], facet[1, :m], cos_h, sin_h, step * line[2], north, east, down, area[n:stop])
    nodes = mirrors.shape[1] - 1
    for f in range(images.size):
        odd = 1.0
        for q in range(letters.shape[1]):
            odd = -odd if letters[f, q] > 0 else odd
        straight(reach, depth, images[f], 1 / speed, loss, cosine, sine, odd, f, bits[0, :m], north, east, down,
                 delay[f, n:stop], arrival[f, 0, n:stop], arrival[f, 1, n:stop], arrival[f, 2, n:stop],
                 departure[f, 2, n:stop], size)  # fmt: skip
        aside(bits[1, :m], line[7] * GOLDEN, line[3], cosine, sine, departure[f, 0, n:stop], departure[f, 1, n:stop],
              arrival[f, 0, n:stop], arrival[f, 1, n:stop])  # fmt: skip
        for i in range(m):
            value = np.complex64(size[i])
            if letters[f, 0] > 0 and size[i] != 0:
                at = min(abs(arrival[f, 2, n + i]), np.float32(1)) * np.float32(nodes)
                q = min(int(at), nodes - 1)
                value *= mirrors[f, q] + np.float32(at - q) * (mirrors[f, q + 1] - mirrors[f, q])
            amplitude[f, n + i] = value
    return stop
