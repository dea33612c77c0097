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
def list_samples(
    radials: Floats, heading: float, step: float, bins: RangeBins, keep_probability: Integers, families: FamilyTable,
    lists: SampleLists, fill: bool,
) -> None:  # fmt: skip
    """Fill one list for each radial, or only count: `first`, `pair_first` and `close_first` are set in either case.

    Args:
        radials: See `radial_columns`, (s, 9).
        heading: Heading of their frame [rad].
        step: Distance of samples [m].
        bins: The range bins.
        keep_probability: Keep probability of samples by radial, range bin and pair, in units of
            1 / `FULL_PROBABILITY`, (s, b, p).
        families: Tables of the families.
        lists: Result.
        fill: True to fill the lists, False to count their rows.
    """
    edges, pair, interferes = bins
    family_count = families.bounce_codes.shape[0]
    first_sample = np.empty(edges.size, np.int64)
    family_probability = np.empty((family_count, edges.size - 1), np.uint8)
    n, ranges, row = 0, 0, 0
    lists.list_offsets[0], lists.interference_offsets[0] = 0, 0
    for s in range(radials.shape[0]):
        sample_spacing = step * radials[s, column.STRIDE]
        count = range_bins_of(
            radials[s], sample_spacing, edges, pair, keep_probability[s], first_sample, family_probability
        )
        lists.sample_counts[s] = count
        mark_needed_horizons(family_probability, families, lists.needed_horizons[s])
        priority, point_of_sample = np.empty(count, np.int32), np.full(count, -1, np.int32)
        priorities(radials[s, column.NUMBER], count, priority)
        list_start, all_families = n, np.int32(0)
        for b in range(edges.size - 1):
            bin_start = n
            for k in range(first_sample[b], first_sample[b + 1]):
                family_bits = np.int32(0)
                for f in range(family_count):
                    family_bits |= np.int32(1 << f) if priority[k] < family_probability[f, b] else np.int32(0)
                if family_bits == 0:
                    continue
                point_of_sample[k] = n - list_start
                all_families |= family_bits
                if fill:
                    lists.sample_number[n], lists.requested_families[n] = k, family_bits
                n += 1
            if interferes[b] and n > bin_start:
                if fill:
                    lists.interference_ranges[ranges, 0] = bin_start - list_start
                    lists.interference_ranges[ranges, 1] = n - list_start
                ranges += 1
        lists.family_bits[s] = all_families
        if fill:
            listed = slice(list_start, n)
            _fill_positions(radials[s], heading, sample_spacing, lists.sample_number[listed], lists.distance[listed],
                           lists.beam_bearing[:, listed])  # fmt: skip
        for p in range(pair.shape[0]):
            lists.pair_offsets[s, p] = row
            for b in range(edges.size - 1):
                for k in range(first_sample[b], first_sample[b + 1] if keep_probability[s, b, p] > 0 else 0):
                    if priority[k] < keep_probability[s, b, p]:
                        if fill:
                            lists.pair_points[row] = point_of_sample[k]
                            lists.inverse_probability[row] = FULL_PROBABILITY / keep_probability[s, b, p]
                        row += 1
        lists.pair_offsets[s, pair.shape[0]] = row
        lists.list_offsets[s + 1], lists.interference_offsets[s + 1] = n, ranges


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_positions(
    radial: Floats, heading: float, step: float, sample_number: Integers, distance: Floats, beam_bearing: Singles
) -> None:
    """Fill distances of samples, and bearings at which the beams are evaluated for them.

    The bearing is at another part of the radial's width for each sample, or in the middle of a radial of one cell.
    """
    cosine = math.cos(heading) * radial[column.COSINE] - math.sin(heading) * radial[column.SINE]
    sine = math.sin(heading) * radial[column.COSINE] + math.cos(heading) * radial[column.SINE]
    for i in range(sample_number.size):
        distance[i] = (sample_number[i] + radial[column.FIRST_SAMPLE]) * step
        fraction = radial[column.NUMBER] * GOLDEN + (sample_number[i] + 0.5) * GOLDEN
        angle = (fraction - math.floor(fraction) - 0.5) * radial[column.BEAM_SPREAD]
        cosine_of_angle = 1 - 0.5 * angle * angle  # small angles
        beam_bearing[0, i] = cosine * cosine_of_angle - sine * angle
        beam_bearing[1, i] = sine * cosine_of_angle + cosine * angle


@njit(cache=True, nogil=True, error_model="numpy")
def range_bins_of(
    radial: Floats, step: float, edges: Floats, pair: Integers, keep_probability: Integers, first_sample: Integers,
    family_probability: Integers
) -> int:  # fmt: skip
    """Fill the first sample of each range bin of a radial, and the largest keep probability of each family there.

    Args:
        radial: One row of `radials`, (9,).
        step: Distance of the radial's samples [m].
        edges: See `RangeBins`.
        pair: See `RangeBins`.
        keep_probability: Keep probability of the radial, (b, p).
        first_sample: Result, first sample of each range bin, (b + 1,).
        family_probability: Result, largest keep probability of each family, (f, b).

    Returns:
        Number of samples of the radial up to the last that any family uses.
    """
    last = max(math.ceil(radial[column.STOP] / step - radial[column.FIRST_SAMPLE]), 0)
    begin = max(math.ceil(radial[column.START] / step - radial[column.FIRST_SAMPLE]), 0)
    family_probability[:] = 0
    count = 0
    for b in range(edges.size):
        first_sample[b] = min(max(math.ceil(edges[b] / step - radial[column.FIRST_SAMPLE]), begin), last)
    first_sample[edges.size - 1] = max(last, begin)  # rounding must not lose the last sample
    for b in range(edges.size - 1):
        for p in range(pair.shape[0]):
            if keep_probability[b, p] > 0:
                i, j = pair[p, 0], pair[p, 1]
                family_probability[i, b] = max(family_probability[i, b], keep_probability[b, p])
                family_probability[j, b] = max(family_probability[j, b], keep_probability[b, p])
                count = max(count, first_sample[b + 1]) if first_sample[b + 1] > first_sample[b] else count
    for b in range(edges.size):
        first_sample[b] = min(first_sample[b], count)
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def priorities(number: float, count: int, priority: Integers) -> None:
    """Fill priorities of the samples of one radial, 0..31, evenly distributed along and across radials.

    Source: Roberts (2018), "The unreasonable effectiveness of quasirandom sequences", the sequence R2; from memory.

    Args:
        number: Number of the radial.
        count: Number of samples.
        priority: Result, (at least count,).
    """
    word = int(number) * _RADIAL_INCREMENT
    for k in range(count):
        word += _SAMPLE_INCREMENT
        priority[k] = np.int32((word >> 27) & 31)


@njit(cache=True, nogil=True, error_model="numpy")
def mark_needed_horizons(family_probability: Integers, families: FamilyTable, needed: NDArray[np.bool_]) -> None:
    """Mark the launch horizons of families that are requested anywhere (`family_probability` (f, b) above 0)."""
    bounce_codes, horizon_row = families.bounce_codes, families.horizon_row
    needed[:] = False
    for f in range(bounce_codes.shape[0]):
        if family_probability[f].max() > 0:
            for k in range(horizon_row.shape[1]):
                if k == 0 or bounce_codes[f, k - 1] > 0:
                    needed[horizon_row[f, k]] = True
