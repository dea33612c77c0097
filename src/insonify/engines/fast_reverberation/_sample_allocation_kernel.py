"""Energy scattered back by the seabed along each radial, by pair of families: sonar equation over a flat seabed."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamTables, element_gain
from insonify.sonar.pattern_products import multiply_by_pattern

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

POINTS_NARROW, POINTS_WIDE = 2, 5
"""Positions in a range bin of a radial at which the beams are evaluated, for radials of one cell and for wide ones."""
ORDER_NARROW, ORDER_WIDE = (
    np.array([((2 * k + 1) * count // 2 + k) % count for k in range(count)], float)
    for count in (POINTS_NARROW, POINTS_WIDE)
)
"""Order along the bin of positions that succeed one another across it: both width and length are covered evenly."""
POINTS_TOGETHER = 512
"""Points of successive radials, at least, at which beams are evaluated together, in the first-level cache."""
GOLDEN = 0.6180339887498949


class RadialPoints(NamedTuple):
    """Points of some radials at which beams are evaluated together, in arrays that are long enough."""

    row: NDArray[np.int64]
    """Row of the radial of each point, times the number of range bins, plus the range bin."""
    range_bin: NDArray[np.int64]
    """Range bin of each point."""
    area: Floats
    """Area of flat seabed that each point represents [m^2]."""
    north: Floats
    """North component of its bearing [1]."""
    east: Floats
    """East component [1]."""
    distance: Floats
    """Horizontal distance [m]."""
    cosines: Floats
    """Scratch: cosine of the elevation at the sonar, cosines to right and down of an array, sine of the elevation,
    pattern, fraction of a row of the pattern's table [1], (6, points)."""
    first_coefficient: NDArray[np.uint32]
    """Scratch: offset of a row of a pattern's table."""


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def _append_points(
    radial: Floats, edges: Floats, bearing: tuple[float, float], first_row: int, points: RadialPoints, count: int
) -> int:
    """Append the points of one radial, by distances and across its width; return the number of all points.

    Args:
        radial: One row of the radials, (9,).
        edges: Edges of the range bins, horizontal distances [m], increasing, (b + 1,).
        bearing: North and east component of its bearing in the world [1].
        first_row: `RadialPoints.row` of its first range bin.
        points: Result.
        count: Number of points that are there already.
    """
    (c, d), spread = bearing, radial[column.BEAM_SPREAD]
    samples = POINTS_WIDE if spread > 0 else POINTS_NARROW
    for b in range(edges.size - 1):
        bin_near, bin_far = max(edges[b], radial[column.START]), min(edges[b + 1], radial[column.STOP])
        if bin_far <= bin_near:
            continue
        area = 0.5 * (bin_far * bin_far - bin_near * bin_near) * radial[column.CELL_WIDTH] / samples
        for k in range(samples):
            angle = spread * ((k + 0.5) / samples - 0.5)
            points.row[count], points.range_bin[count], points.area[count] = first_row + b, b, area
            points.north[count], points.east[count] = c - d * angle, d + c * angle
            order = (ORDER_WIDE if samples == POINTS_WIDE else ORDER_NARROW)[k]
            points.distance[count] = bin_near + (bin_far - bin_near) * (order + 0.5) / samples
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def _aim(points: RadialPoints, count: int, vertical: Floats, is_odd: bool) -> None:
    """Fill rows 0 and 3 of `cosines`: cosine and sine, positive down, of a family's elevation at the sonar.

    Args:
        points: The points.
        count: Number of points, the first ones.
        vertical: Distance times tangent of the launch angle in each range bin [m], (b,).
        is_odd: True if the family has an odd number of bounces.
    """
    distance, cosine, down = points.distance[:count], points.cosines[0], points.cosines[3]
    for q in range(count):
        down[q] = vertical[np.uint64(points.range_bin[q])]
    for q in range(count):
        inverse = 1 / math.sqrt(distance[q] * distance[q] + down[q] * down[q])
        cosine[q], down[q] = distance[q] * inverse, down[q] * inverse
        down[q] = -down[q] if is_odd else down[q]


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def _fill_amplitudes(points: RadialPoints, count: int, cosine: Floats, beams: BeamTables, amplitude: Floats) -> None:
    """Fill the pressure pattern of the first beam towards the points, as `beam_kernels.beam_gains` [1].

    Args:
        points: The points, with the sine of the elevation at the sonar.
        count: Number of points, the first ones.
        cosine: Cosine of that elevation [1], (at least count,).
        beams: The beams.
        amplitude: Result, (at least count,).
    """
    axes, scale, element = beams.axes, beams.scale[0], beams.element
    north, east, down, right, below = points.north, points.east, points.cosines[3], points.cosines[1], points.cosines[2]
    pattern = points.cosines[4]
    for q in range(count):
        x, y = north[q] * cosine[q], east[q] * cosine[q]
        right[q] = x * axes[1, 0] + y * axes[1, 1] + down[q] * axes[1, 2]
        below[q] = x * axes[2, 0] + y * axes[2, 1] + down[q] * axes[2, 2]
        amplitude[q] = scale * element_gain(element, x * axes[0, 0] + y * axes[0, 1] + down[q] * axes[0, 2])
        pattern[q] = 1.0
    first, fraction = points.first_coefficient, points.cosines[5]
    multiply_by_pattern(beams.tables[0], beams.per_unit[0], beams.steer[0, 0], right[:count], pattern, first, fraction)
    multiply_by_pattern(beams.tables[1], beams.per_unit[1], beams.steer[0, 1], below[:count], pattern, first, fraction)
    for q in range(count):
        amplitude[q] *= pattern[q]
    multiply_by_pattern(beams.tables[2], beams.per_unit[2], 0.0, right[:count], amplitude, first, fraction)
    multiply_by_pattern(beams.tables[3], beams.per_unit[3], 0.0, below[:count], amplitude, first, fraction)


@njit(cache=True, nogil=True, error_model="numpy")
def pair_energies(
    radials: Floats, heading: float, edges: Floats, verticals: Floats, is_odd: NDArray[np.bool_],
    pair: NDArray[np.int64], strength: Floats, transmit_beam: BeamTables, receive_beam: BeamTables, same_beams: bool,
    energy: Singles,
) -> None:  # fmt: skip
    """Fill the energy of every pair from each range bin of each radial, both orders of a pair together.

    With different families the two orders add as pressures.

    Args:
        radials: See `radial_columns`.
        heading: Heading of their frame in the world [rad].
        edges: Edges of the range bins, horizontal distances [m], increasing, (b + 1,).
        verticals: Distance times tangent of the launch angle of each family in each range bin, for straight rays the
            height of the image source above the seabed [m], (f, b).
        is_odd: True if the family has an odd number of bounces, (f,).
        pair: Rows of two legs, (p, 2).
        strength: Cross section per area of each pair times the squares of both legs' pressures re 1 m, in each range
            bin [m^-4], (p, b).
        transmit_beam: Beam pattern of the transmitter.
        receive_beam: Beam pattern of the receiver.
        same_beams: True if both are the same.
        energy: Result, re the energy of the pulse at 1 m [m^-2], (s, b, p).
    """
    bins, families = edges.size - 1, verticals.shape[0]
    most, flat = POINTS_TOGETHER + POINTS_WIDE * bins, energy.reshape(radials.shape[0] * bins, pair.shape[0])
    work, transmit, receive = np.empty((11, most)), np.empty((families, most)), np.empty((families, most))
    numbers, product = np.empty((2, most), np.int64), work[10]
    points = RadialPoints(
        numbers[0], numbers[1], work[0], work[1], work[2], work[3], work[4:10], np.empty(most, np.uint32)
    )
    c0, s0, count = math.cos(heading), math.sin(heading), 0
    energy[:] = 0
    for s in range(radials.shape[0]):
        cosine_in_frame, sine_in_frame = radials[s, column.COSINE], radials[s, column.SINE]
        bearing = c0 * cosine_in_frame - s0 * sine_in_frame, s0 * cosine_in_frame + c0 * sine_in_frame
        count = _append_points(radials[s], edges, bearing, s * bins, points, count)
        if count < POINTS_TOGETHER and s + 1 < radials.shape[0]:
            continue
        for f in range(families):
            _aim(points, count, verticals[f], is_odd[f])
            _fill_amplitudes(points, count, points.cosines[0], transmit_beam, transmit[f])
            if not same_beams:
                _fill_amplitudes(points, count, points.cosines[0], receive_beam, receive[f])
        back = transmit if same_beams else receive
        for p in range(pair.shape[0]):
            i, j = pair[p, 0], pair[p, 1]
            out_i, out_j, back_i, back_j, pair_energy = transmit[i], transmit[j], back[i], back[j], flat[:, p]
            reverse = 1.0 if i != j else 0.0
            for q in range(count):
                product[q] = out_i[q] * back_j[q] + reverse * (out_j[q] * back_i[q])
            for q in range(count):
                section = strength[p, np.uint64(points.range_bin[q])]
                pair_energy[np.uint64(points.row[q])] += np.float32(points.area[q] * section * product[q] * product[q])
        count = 0


@njit(cache=True, nogil=True, error_model="numpy")
def add_radials(energy: Singles, total: Floats) -> None:
    """Add the energies of all radials, (s, b * p) [m^-2]; fill the sums, (b * p,)."""
    total[:] = 0
    for s in range(energy.shape[0]):
        one = energy[s]
        for k in range(total.size):
            total[k] += one[k]


@njit(cache=True, nogil=True, error_model="numpy")
def pair_keep_probabilities(
    radials: Floats, edges: Floats, step: float, energy: Singles, row: NDArray[np.int64], full_energy: Floats,
    received: Any, pair_group: NDArray[np.int64], keep_probability: NDArray[np.uint8], full: int, minimum: int,
) -> None:  # fmt: skip
    """Fill the keep probability of every pair in each range bin of each radial.

    Args:
        radials: See `radial_columns`, (s, 9).
        edges: Edges of the range bins [m], (b + 1,).
        step: Distance of samples along radials without longer steps [m].
        energy: Result of `pair_energies` for the radials before any were split [m^-2], (any, b, p).
        row: Row of each radial in `energy`, (s,).
        full_energy: Energy of one sample for which the keep probability is 1 [m^-2], (b, p).
        received: True if the pair is not negligible in the range bin, (b, p).
        pair_group: First of the pairs that may arrive at the same time in the range bin, (b, p).
        keep_probability: Result, in units of 1 / `full`, (s, b, p).
        full: Number that represents a probability of 1.
        minimum: Smallest value for a pair that is received.
    """
    count, separate = energy.shape[2], np.ones(edges.size - 1, np.bool_)
    for b in range(separate.size):
        for p in range(count):
            separate[b] &= pair_group[b, p] == p
    keep_probability[:] = 0
    for s in range(radials.shape[0]):
        start, stop, step_length = radials[s, column.START], radials[s, column.STOP], step * radials[s, column.STRIDE]
        for b in range(separate.size):
            length = min(edges[b + 1], stop) - max(edges[b], start)
            if length <= 0:
                continue
            keep, group = keep_probability[s, b], pair_group[b]
            scale = np.float32(full / max(length / step_length, 1.0))
            for p in range(count):
                ratio = energy[row[s], b, p] * scale / np.float32(full_energy[b, p])
                steps = np.uint8(min(max(math.ceil(min(ratio, np.float32(255))), minimum), full))
                keep[p] = steps if received[b, p] and ratio > 0 else 0
            if separate[b]:
                continue
            # pairs that interfere are evaluated at the same samples: all have the largest keep probability
            for p in range(count):
                keep[group[p]] = max(keep[group[p]], keep[p])
            for p in range(count):
                keep[p] = keep[group[p]] if received[b, p] else 0


@njit(cache=True, nogil=True, error_model="numpy")
def lengthen_steps(
    radials: Floats, edges: Floats, keep_probability: NDArray[np.uint8], full: int, longest: int, result: Floats,
    row: NDArray[np.int64],
) -> int:  # fmt: skip
    """Split radials where all keep probabilities beyond are low; the farther part gets longer steps.

    With the longer step the largest keep probability there is at most a half.

    Args:
        radials: See `radial_columns`, (s, 9).
        edges: Edges of the range bins [m], (b + 1,).
        keep_probability: Keep probability by radial, range bin and pair, (s, b, p).
        full: Number that represents a probability of 1.
        longest: Longest step, in steps of the radials' frame, a power of 2 [1].
        result: Result, new radials, (2 s, 9).
        row: Result, row in `radials` of which each new one is a part, (2 s,).

    Returns:
        Number of new radials.
    """
    n, largest = 0, np.zeros(edges.size - 1, np.int64)
    for s in range(radials.shape[0]):
        start, stop = radials[s, column.START], radials[s, column.STOP]
        best, saving, split = 0, 0.1, start  # no radial is split for less than a tenth of its samples
        for b in range(edges.size - 1):
            largest[b] = keep_probability[s, b].max() if edges[b] < stop and edges[b + 1] > start else 0
        stride = longest
        while stride > max(radials[s, column.STRIDE], 1):
            last_needed = 0.0
            for b in range(edges.size - 1):
                if 2 * stride * largest[b] > full:
                    last_needed = edges[b + 1]
            last_needed = max(last_needed, start)
            fewer = (stop - last_needed) / stop * (1 - radials[s, column.STRIDE] / stride)
            if fewer > saving:
                best, saving, split = stride, fewer, last_needed
            stride //= 2
        if best == 0 or split > start:
            result[n], row[n] = radials[s], s
            result[n, column.STOP] = split if best > 0 else stop
            n += 1
        if best > 0:
            result[n], row[n] = radials[s], s
            result[n, column.START], result[n, column.STRIDE] = split, best
            n += 1
    return n
