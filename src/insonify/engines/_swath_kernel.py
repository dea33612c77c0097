"""Walks along lines of the ground that gather everything about it in one go: where it is lit, and by which legs.

One line is one azimuth. Its ground is looked up in the map, sample after sample outwards; shadows of every family
follow by the rules of `insonify.engines.skyline`; what is left are columns of points that some family reaches.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.engines._ground_kernel import look_up
from insonify.engines._lit_kernel import bounds_of, reached_by
from insonify.engines._straight_kernel import legs_along

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

_SAMPLE_PACE, _LINE_PACE = 3242174889, 2447445414  # of 2^32: the inverse of the plastic number, and its square


@njit(cache=True, nogil=True, error_model="numpy")
def walk(
    along: float, across: float, heading: float, source: float, water_depth: float, speed: float,
    wavelength: float, lines: Floats, step: float, cell: float, slot: Integers, pieces: Singles, flat: bool,
    images: Floats, letters: Integers, prefix: Integers, way_images: Floats, way_rising: NDArray[np.bool_],
    mirrors: NDArray[np.complex64], factor: Singles, loss: float, edges: Floats, pair: Integers, share: Integers,
    close: NDArray[np.bool_], place: Floats, delay: Floats, amplitude: NDArray[np.complex64], departure: Singles,
    arrival: Singles, normal: Singles, rows: Integers, weight: Singles, found: Integers, first_of: Integers,
    meeting: Integers,
) -> int:  # fmt: skip
    """Points of the ground along some lines that any pair of families wants and reaches, and their legs.

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
            sample in its own steps; its number; how many steps its own are; (s, 9).
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
        factor: Of a law that is a product of one for each direction, as of `FastLaw.factor`; empty for any other.
        loss: Absorption [octaves of pressure/m].
        edges: Of the stretches, horizontal distances [m], (b + 1,).
        pair: Rows of two families, (p, 2).
        share: Part of the points of each line and stretch that every pair takes, in 32nds, (s, b, p).
        close: Whether pairs of a stretch may arrive within one pulse, (b,).
        place: Result, horizontal distance and depth of each point [m], (2, most).
        delay: Result, one-way travel time [s], (f, most).
        amplitude: Result, pressure re 1 m, times the root of the direction's factor if there is one [1]; 0 where there
            is no path, (f, most).
        departure: Result, direction of travel at the sonar, in the world, (f, 3, most).
        arrival: Result, direction of travel at the point, (f, 3, most).
        normal: Result, unit normal into the water, (3, most).
        rows: Result, points of each pair, (p, most).
        weight: Result, ground that they stand for [m^2], (p, most).
        found: Result, how many they are, (p,).
        first_of: Result, first point of each line, (s + 1,).
        meeting: Result, first point and after the last of ranges where pairs may arrive within one pulse, (any, 2).

    Returns:
        Number of these ranges.
    """
    longest = 1
    for s in range(lines.shape[0]):
        longest = max(longest, int(lines[s, 5] / (step * lines[s, 8])) + 2)
    ground, slope = np.empty(longest, np.float32), np.empty((2, longest), np.float32)
    launch, bound = np.empty((2, way_images.size, longest), np.float32)
    lit, turn = np.empty((2, longest), np.int32)
    kept, facet, bits = np.empty((2, longest)), np.empty((5, longest), np.float32), np.empty((3, longest), np.int32)
    stretch, wanted = np.empty(edges.size, np.int64), np.empty((images.size, edges.size - 1), np.uint8)
    passed = np.empty(way_images.size, np.bool_)
    n, ranges = 0, 0
    found[:] = 0
    for s in range(lines.shape[0]):
        first_of[s] = n
        own = step * lines[s, 8]
        count = stretches_of(lines[s], own, edges, pair, share[s], stretch, wanted)
        if count == 0:
            continue
        ways_of(wanted, letters, prefix, passed)
        first = lines[s, 6]
        look_up(along, across, lines[s], own, count, cell, slot, pieces, flat, ground, slope)
        priorities(lines[s, 7], count, turn)
        for k in range(count):
            ground[k] = np.float32(water_depth) - ground[k]
            lit[k] = 0
        for w in range(way_images.size):
            if passed[w]:
                bounds_of(ground, way_images[w], way_rising[w], own, first, count, launch[w], bound[w])
        for f in range(images.size):
            reached_by(f, lit, turn, stretch, wanted[f], count, first, own, ground, images[f], source, water_depth,
                       wavelength, letters, prefix, launch, bound)  # fmt: skip
        m = points_of(first, own, ground, slope, lit, turn, stretch, kept, facet, bits)
        legs_along(lines[s], heading, own, m, speed, loss, images, letters, mirrors, factor, wanted, kept, facet,
                   bits, n, delay, amplitude, departure, arrival, normal)  # fmt: skip
        place[:, n : n + m] = kept[:, :m]
        pairs_along(stretch, pair, share[s], bits, facet[3], n, rows, weight, found)
        for b in range(close.size):
            if close[b] and stretch[b + 1] > stretch[b]:
                if ranges == 0 or meeting[ranges - 1, 1] != n + stretch[b]:
                    meeting[ranges, 0] = n + stretch[b]
                    ranges += 1
                meeting[ranges - 1, 1] = n + stretch[b + 1]
        n += m
    first_of[lines.shape[0]] = n
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def stretches_of(
    line: Floats, step: float, edges: Floats, pair: Integers, share: Integers, stretch: Integers, wanted: Integers
) -> int:  # fmt: skip
    """First sample of each stretch of a line, and the largest share of each family there; arguments as of `walk`.

    Args:
        line: One row of `lines`, (9,).
        step: Distance of the line's own samples [m].
        edges: As of `walk`.
        pair: As of `walk`.
        share: Of the line, (b, p).
        stretch: Result, (b + 1,).
        wanted: Result, (f, b).

    Returns:
        Samples of the line up to the last that any family wants.
    """
    last = max(math.ceil(line[5] / step - line[6]), 0)
    begin = max(math.ceil(line[4] / step - line[6]), 0)
    wanted[:] = 0
    count = 0
    for b in range(edges.size):
        stretch[b] = min(max(math.ceil(edges[b] / step - line[6]), begin), last)
    stretch[edges.size - 1] = max(last, begin)  # rounding must not lose the last sample
    for b in range(edges.size - 1):
        for p in range(pair.shape[0]):
            if share[b, p] > 0:
                i, j = pair[p, 0], pair[p, 1]
                wanted[i, b] = max(wanted[i, b], share[b, p])
                wanted[j, b] = max(wanted[j, b], share[b, p])
                count = max(count, stretch[b + 1]) if stretch[b + 1] > stretch[b] else count
    for b in range(edges.size):
        stretch[b] = min(stretch[b], count)
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def priorities(number: float, count: int, turn: Integers) -> None:
    """Priorities of the samples of one line, 0..31, spread evenly along it and from line to line.

    Source: Roberts (2018), "The unreasonable effectiveness of quasirandom sequences", the sequence R2; from memory.

    Args:
        number: Of the line.
        count: Samples.
        turn: Result, (at least count,).
    """
    now = int(number) * _LINE_PACE
    for k in range(count):
        now += _SAMPLE_PACE
        turn[k] = np.int32((now >> 27) & 31)


@njit(cache=True, nogil=True, error_model="numpy")
def ways_of(wanted: Integers, letters: Integers, prefix: Integers, passed: NDArray[np.bool_]) -> None:
    """Mark the rows of launches that any wanted family passes by; arguments as of `walk` and `stretches_of`."""
    passed[:] = False
    for f in range(letters.shape[0]):
        if wanted[f].max() > 0:
            for k in range(prefix.shape[1]):
                if k == 0 or letters[f, k - 1] > 0:
                    passed[prefix[f, k]] = True


@njit(cache=True, nogil=True, error_model="numpy")
def points_of(
    first: float, step: float, ground: Singles, slope: Singles, lit: Integers, turn: Integers, stretch: Integers,
    kept: Floats, facet: Singles, bits: Integers,
) -> int:  # fmt: skip
    """Gather the samples of a line that any family reaches.

    Args:
        first: Place of the first sample in steps.
        step: Distance of samples [m].
        ground: Depth [m], (samples,).
        slope: Along the axes of the map [1], (2, samples).
        lit: As of `reached_by`.
        turn: Likewise.
        stretch: First sample of each stretch, (b + 1,); afterwards first point.
        kept: Result, horizontal distance and depth [m], (2, samples).
        facet: Result, slopes [1] in the first two rows, (5, samples).
        bits: Result, families, number of the sample, and its priority, (3, samples).

    Returns:
        How many there are.
    """
    m, begin = 0, stretch[0]
    for b in range(stretch.size - 1):
        stop = stretch[b + 1]
        stretch[b] = m
        for k in range(begin, stop):
            kept[0, m], kept[1, m] = (k + first) * step, ground[k]
            facet[0, m], facet[1, m] = slope[0, k], slope[1, k]
            bits[0, m], bits[1, m], bits[2, m] = lit[k], k, turn[k]
            m += (lit[k] != 0) & (ground[k] > 0)  # without a branch that nobody can foretell
        begin = stop
    stretch[stretch.size - 1] = m
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def pairs_along(
    stretch: Integers, pair: Integers, share: Integers, bits: Integers, area: Singles, n: int, rows: Integers,
    weight: Singles, found: Integers,
) -> None:  # fmt: skip
    """Append the points of one line to those of each pair.

    Args:
        stretch: First point of each stretch, (b + 1,).
        pair: As of `walk`.
        share: Of the line, (b, p).
        bits: Families whose leg is there; any; priorities; (3, points).
        area: Of the points [m^2], (points,).
        n: Number of the line's first point.
        rows: As of `walk`.
        weight: As of `walk`.
        found: As of `walk`, added to.
    """
    for p in range(pair.shape[0]):
        both = np.int32((1 << pair[p, 0]) | (1 << pair[p, 1]))
        at = found[p]
        for b in range(share.shape[0]):
            part = np.int32(share[b, p])
            if part > 0:
                more = np.float32(32.0 / part)
                for i in range(stretch[b], stretch[b + 1]):
                    rows[p, at], weight[p, at] = n + i, area[i] * more
                    at += ((bits[0, i] & both) == both) & (bits[2, i] < part)
        found[p] = at


@njit(cache=True, nogil=True, error_model="numpy")
def facing(
    incoming: Singles, outgoing: Singles, normal: Singles, rows: Integers, into: Singles, out: Singles, up: Singles
) -> None:
    """The questions that a pair asks the law, side by side.

    Args:
        incoming: Directions of travel at the points by the leg out, (3, n).
        outgoing: By the leg back, (3, n).
        normal: Of the points, (3, n).
        rows: Points of the pair, (m,).
        into: Result, as the law wants it, (3, m).
        out: Result, likewise.
        up: Result, likewise.
    """
    for c in range(3):
        one, two, three = incoming[c], outgoing[c], normal[c]
        for k in range(rows.size):
            into[c, k], out[c, k], up[c, k] = one[rows[k]], -two[rows[k]], three[rows[k]]
