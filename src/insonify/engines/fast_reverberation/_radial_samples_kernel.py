"""Lists of the samples of each radial, and of those at which each pair of families is evaluated.

Both depend on the radials and the keep probabilities of all pairs alone, so all pings use the same lists. Plain numbers
and arrays only.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation._sample_allocation_kernel import GOLDEN
from insonify.engines.radial_tables import FamilyTable, SampleLists
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

FULL_PROBABILITY = 32
"""Number that represents a keep probability of 1 [1]."""
_SAMPLE_INCREMENT = 3242174889  # of 2^32: the inverse of the plastic number
_RADIAL_INCREMENT = 2447445414  # of 2^32: its square


class RangeBins(NamedTuple):
    """Range bins of the plan, and the pairs of families whose keep probabilities they hold."""

    edges: Floats
    """Edges of the bins, horizontal distances [m], (b + 1,)."""
    pair: Integers
    """Rows of two families, (p, 2)."""
    interferes: NDArray[np.bool_]
    """True if several pairs of a bin may arrive within one pulse, (b,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def count_samples(radials: Floats, step: float, bins: RangeBins, keep_probability: Integers, lists: SampleLists) -> int:
    """Count the points, rows and interference ranges of each list: `sample_counts` and all offsets are set.

    Args:
        radials: See `radial_columns`, (s, 9).
        step: Spacing of samples along radials of stride 1 [m].
        bins: The range bins.
        keep_probability: Keep probability of samples by radial, range bin and pair, in units of
            1 / `FULL_PROBABILITY`, (s, b, p).
        lists: Result.

    Returns:
        Number of samples of the longest radial.
    """
    (edges, pair, interferes), sample_counts, list_offsets = bins, lists.sample_counts, lists.list_offsets
    pair_offsets, interference_offsets = lists.pair_offsets, lists.interference_offsets
    pair_count = pair.shape[0]
    first_sample, of_pair = np.empty(edges.size, np.int64), np.empty(pair_count, np.int64)
    n, ranges, rows, longest = 0, 0, 0, 0
    list_offsets[0], interference_offsets[0] = 0, 0
    for s in range(radials.shape[0]):
        keep = keep_probability[s]
        spacing = step * radials[s, column.STRIDE]
        first_bin, end_bin, count = range_bins_of(radials[s], spacing, edges, keep, first_sample)
        of_pair[:] = 0
        for b in range(first_bin, end_bin):
            probability, kept, largest = np.uint8(0), 0, 0
            for p in range(pair_count if first_sample[b + 1] > first_sample[b] else 0):
                if keep[b, p] != probability:  # else as of the pair before
                    probability = keep[b, p]
                    kept = _count_kept(radials[s, column.NUMBER], first_sample[b], first_sample[b + 1], probability)
                of_pair[p] += kept
                largest = max(largest, kept)
            n += largest
            ranges += 1 if interferes[b] and largest > 0 else 0
        for p in range(pair_count):
            pair_offsets[s, p], rows = rows, rows + of_pair[p]
        pair_offsets[s, pair_count] = rows
        sample_counts[s], longest = count, max(longest, count)
        list_offsets[s + 1], interference_offsets[s + 1] = n, ranges
    return longest


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def _count_kept(number: float, first: int, stop: int, probability: int) -> int:
    """Number of the samples of a radial, from a first one on, that have a priority below a keep probability.

    Args:
        number: `radial_columns.NUMBER` of the radial.
        first: Index of the first sample.
        stop: Index after that of the last.
        probability: The keep probability, 0 to `FULL_PROBABILITY`.
    """
    if probability >= FULL_PROBABILITY:
        return stop - first
    kept, position = 0, int(number) * _RADIAL_INCREMENT + (first + 1) * _SAMPLE_INCREMENT
    for k in range(stop - first):
        kept += ((position + k * _SAMPLE_INCREMENT) >> 27) & 31 < probability
    return kept


@njit(cache=True, nogil=True, error_model="numpy")
def list_samples(
    radials: Floats, heading: float, step: float, bins: RangeBins, keep_probability: Integers, families: FamilyTable,
    longest: int, lists: SampleLists,
) -> None:  # fmt: skip
    """Fill one list for each radial.

    Columns of points and rows are one element longer than counted by `count_samples`: samples are written, and the next
    overwrites those that are not kept. A branch on a random number takes longer.

    Args:
        radials: See `radial_columns`, (s, 9).
        heading: Heading of their frame [rad].
        step: Spacing of samples along radials of stride 1 [m].
        bins: The range bins.
        keep_probability: See `count_samples`, (s, b, p).
        families: Tables of the families.
        longest: Result of `count_samples`.
        lists: Changed, with the counts of `count_samples`.
    """
    # local names for the fields: numba counts references to an array at each use of a field
    (edges, pair, interferes), interference_ranges = bins, lists.interference_ranges
    list_offsets, needed_horizons, family_bits = lists.list_offsets, lists.needed_horizons, lists.family_bits
    sample_number, requested_families, distance = lists.sample_number, lists.requested_families, lists.distance
    beam_bearing, pair_points, inverse_probability = lists.beam_bearing, lists.pair_points, lists.inverse_probability
    first_sample, first_point = np.empty(edges.size, np.int64), np.empty(edges.size, np.int64)
    family_probability = np.empty((edges.size - 1, families.bounce_codes.shape[0]), np.uint8)
    requested, priority = np.empty(family_probability.shape[1], np.bool_), np.empty(longest + 1, np.int32)
    ranges, row = 0, 0
    for s in range(radials.shape[0]):
        spacing, keep = step * radials[s, column.STRIDE], keep_probability[s]
        begin, stop = list_offsets[s], list_offsets[s + 1]
        first_bin, end_bin, _ = range_bins_of(radials[s], spacing, edges, keep, first_sample)
        crossed = first_bin, end_bin
        family_probabilities(keep, pair, crossed, first_sample, family_probability, requested)
        mark_needed_horizons(requested, families, needed_horizons[s])
        family_bits[s] = _list_points(
            radials[s, column.NUMBER], crossed, first_sample, family_probability, sample_number[begin:],
            requested_families[begin:], priority, first_point,
        )  # fmt: skip
        _fill_positions(radials[s], heading, spacing, sample_number[begin:stop], distance[begin:stop],
                        beam_bearing[0, begin:stop], beam_bearing[1, begin:stop])  # fmt: skip
        for b in range(first_bin, end_bin):
            if interferes[b] and first_point[b + 1] > first_point[b]:
                interference_ranges[ranges, 0], interference_ranges[ranges, 1] = first_point[b], first_point[b + 1]
                ranges += 1
        row += _list_rows(keep, crossed, priority, first_point, pair_points[row:],
                          inverse_probability[row:])  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def _largest(probabilities: Integers) -> Any:
    """Largest of some keep probabilities."""
    largest, p = np.uint8(0), np.uint64(0)
    while p < np.uint64(probabilities.size):
        largest = max(largest, probabilities[p])
        p += np.uint64(1)
    return largest


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def _list_points(
    radial_number: float, crossed: tuple[int, int], first_sample: Integers, family_probability: Integers,
    sample_number: Integers, requested_families: Integers, priority: Integers, first_point: Integers,
) -> Any:  # fmt: skip
    """List the samples of one radial that any family uses.

    Args:
        radial_number: `radial_columns.NUMBER` of the radial.
        crossed: First range bin that it crosses, and the one after the last.
        first_sample: Index of the first sample in each range bin, and in the next, (b + 1,).
        family_probability: See `family_probabilities`, (b, f).
        sample_number: Result, index of each point along the radial, one element longer than the list.
        requested_families: Result, families requested at each point, a bit for each.
        priority: Result, priority of each point, see `priority_of`, one element longer than the list.
        first_point: Result, index of the first point in each range bin, and in the next, (b + 1,).

    Returns:
        Families requested at any point, a bit for each.
    """
    n: Any = 0
    all_families = np.int32(0)
    first_point[crossed[0]] = 0
    for b in range(crossed[0], crossed[1]):
        begin, first, largest = n, first_sample[b], _largest(family_probability[b])
        many = first_sample[b + 1] - first if largest > 0 else 0
        numbers, priorities, families = sample_number[n:], priority[n:], requested_families[n:]
        if largest >= FULL_PROBABILITY:
            for k in range(many):
                numbers[k], priorities[k] = first + k, priority_of(radial_number, first + k)
            n += many
        else:
            m = np.uint64(0)  # unsigned: a signed index costs a test
            for k in range(many):
                numbers[m], priorities[m] = first + k, priority_of(radial_number, first + k)
                m += np.uint64(priorities[m] < largest)
            n += np.int64(m)
        for f in range(family_probability.shape[1]):
            probability, bit, any_kept = family_probability[b, f], np.int32(1 << f), np.int32(0)
            for i in range(n - begin):
                kept = bit if priorities[i] < probability else np.int32(0)
                families[i] = kept if f == 0 else families[i] | kept
                any_kept |= kept
            all_families |= any_kept
        first_point[b + 1] = n
    return all_families


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def _list_rows(
    keep_probability: Integers, crossed: tuple[int, int], priority: Integers, first_point: Integers,
    pair_points: Integers, inverse_probability: Singles,
) -> int:  # fmt: skip
    """List the points of one radial at which each pair is evaluated.

    Args:
        keep_probability: Keep probability of the radial, in units of 1 / `FULL_PROBABILITY`, (b, p).
        crossed: First range bin that it crosses, and the one after the last.
        priority: Priority of each point.
        first_point: Index of the first point in each range bin, and in the next, (b + 1,).
        pair_points: Result, indices of points pair by pair, one element longer than the number of rows.
        inverse_probability: Result, one over the keep probability of each row [1], as long.

    Returns:
        Number of rows.
    """
    row: Any = 0
    for p in range(keep_probability.shape[1]):
        for b in range(crossed[0], crossed[1]):
            probability, first, many = keep_probability[b, p], first_point[b], first_point[b + 1] - first_point[b]
            if probability == 0:
                continue
            inverse = np.float32(FULL_PROBABILITY / probability)
            keeps_all = probability == _largest(keep_probability[b])
            points, inverses, priorities = pair_points[row:], inverse_probability[row:], priority[first:]
            if keeps_all:
                for k in range(many):
                    points[k], inverses[k] = first + k, inverse
                row += many
            else:
                m = np.uint64(0)  # unsigned: a signed index costs a test
                for k in range(many):
                    points[m], inverses[m] = first + k, inverse
                    m += np.uint64(priorities[k] < probability)
                row += np.int64(m)
    return row


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_positions(
    radial: Floats,
    heading: float,
    step: float,
    sample_number: Integers,
    distance: Floats,
    north: Singles,
    east: Singles,
) -> None:
    """Fill distances of samples, and bearings at which the beams are evaluated for them.

    Bearings of successive samples are distributed over `BEAM_SPREAD` by the golden ratio.

    Args:
        radial: One row of the radials, (9,).
        heading: Heading of their frame [rad].
        step: Spacing of the radial's samples [m].
        sample_number: Index of each listed point along the radial, (n,).
        distance: Result, horizontal distance from the sonar [m], (n,).
        north: Result, north component of the bearing [1], (n,).
        east: Result, east component of the bearing [1], (n,).
    """
    cosine = math.cos(heading) * radial[column.COSINE] - math.sin(heading) * radial[column.SINE]
    sine = math.sin(heading) * radial[column.COSINE] + math.cos(heading) * radial[column.SINE]
    turn, spread, first = radial[column.NUMBER] * GOLDEN, radial[column.BEAM_SPREAD], radial[column.FIRST_SAMPLE]
    for i in range(sample_number.size):
        distance[i] = (sample_number[i] + first) * step
        fraction = turn + (sample_number[i] + 0.5) * GOLDEN
        angle = (fraction - math.floor(fraction) - 0.5) * spread
        cosine_of_angle = 1 - 0.5 * angle * angle  # small angles
        north[i] = cosine * cosine_of_angle - sine * angle
        east[i] = sine * cosine_of_angle + cosine * angle


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def range_bins_of(
    radial: Floats, step: float, edges: Floats, keep_probability: Integers, first_sample: Integers
) -> tuple[int, int, int]:
    """Fill the index of the first sample in each range bin that a radial crosses, and in the next.

    Args:
        radial: One row of `radials`, (9,).
        step: Spacing of the radial's samples [m].
        edges: See `RangeBins`.
        keep_probability: Keep probability of the radial, in units of 1 / `FULL_PROBABILITY`, (b, p).
        first_sample: Result, (b + 1,).

    Returns:
        First of these bins; the one after the last; number of samples of the radial up to the last that any family
        uses.
    """
    start, stop, first = radial[column.START], radial[column.STOP], radial[column.FIRST_SAMPLE]
    last, begin = max(math.ceil(stop / step - first), 0), max(math.ceil(start / step - first), 0)
    bin_count, first_bin = edges.size - 1, 0
    while first_bin < bin_count - 1 and edges[first_bin + 1] <= start:
        first_bin += 1
    end_bin, count = first_bin, 0
    first_sample[first_bin] = min(max(math.ceil(edges[first_bin] / step - first), begin), last)
    while end_bin < bin_count and edges[end_bin] < stop:
        end_bin += 1
        first_sample[end_bin] = min(max(math.ceil(edges[end_bin] / step - first), begin), last)
        if end_bin == bin_count:
            first_sample[end_bin] = max(last, begin)  # rounding must not lose the last sample
        if first_sample[end_bin] > first_sample[end_bin - 1]:
            for p in range(keep_probability.shape[1]):
                count = first_sample[end_bin] if keep_probability[end_bin - 1, p] > 0 else count
    for b in range(first_bin, end_bin + 1):
        first_sample[b] = min(first_sample[b], count)
    return first_bin, end_bin, count


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def family_probabilities(
    keep_probability: Integers, pair: Integers, crossed: tuple[int, int], first_sample: Integers,
    family_probability: Integers, requested: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Fill the largest keep probability of each family in the range bins of one radial.

    Args:
        keep_probability: Keep probability of the radial, in units of 1 / `FULL_PROBABILITY`, (b, p).
        pair: See `RangeBins`.
        crossed: First range bin that the radial crosses, and the one after the last.
        first_sample: Index of the first sample in each range bin, and in the next, (b + 1,).
        family_probability: Result, 0 in range bins without samples, (b, f).
        requested: Result, True for families with a probability above 0 anywhere, (f,).
    """
    requested[:] = False
    for b in range(crossed[0], crossed[1]):
        probabilities = family_probability[b]
        for f in range(requested.size):
            probabilities[f] = 0
        for p in range(pair.shape[0] if first_sample[b + 1] > first_sample[b] else 0):
            for leg in range(2):
                g = np.uint64(pair[p, leg])
                probabilities[g] = max(probabilities[g], keep_probability[b, p])
        for f in range(requested.size):
            requested[f] |= probabilities[f] > 0


@njit(cache=True, nogil=True, error_model="numpy")
def priority_of(number: float, k: int) -> int:
    """Priority of one sample, 0..31, evenly distributed along and across radials.

    Source: Roberts (2018), "The unreasonable effectiveness of quasirandom sequences", the sequence R2; not verified.

    Args:
        number: `radial_columns.NUMBER` of the radial.
        k: Index of the sample.
    """
    return ((int(number) * _RADIAL_INCREMENT + (k + 1) * _SAMPLE_INCREMENT) >> 27) & 31


@njit(cache=True, nogil=True, error_model="numpy")
def mark_needed_horizons(requested: NDArray[np.bool_], families: FamilyTable, needed: NDArray[np.bool_]) -> None:
    """Mark the launch horizons that the requested families need.

    Args:
        requested: True for these families, (f,).
        families: Tables of the families.
        needed: Result, True for such launch horizons, (h,).
    """
    bounce_codes, horizon_row = families.bounce_codes, families.horizon_row
    needed[:] = False
    for f in range(bounce_codes.shape[0]):
        if requested[f]:
            for k in range(horizon_row.shape[1]):
                if k == 0 or bounce_codes[f, k - 1] > 0:
                    needed[horizon_row[f, k]] = True
