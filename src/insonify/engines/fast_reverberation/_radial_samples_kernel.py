"""Lists of the samples of each radial, and of those at which each pair of families is evaluated.

Both depend on the radials and the keep probabilities of all pairs alone, so all pings use the same lists. Plain numbers
and arrays only.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._sample_allocation_kernel import GOLDEN
from insonify.engines.radial_tables import FamilyTable, SampleLists
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

FULL_PROBABILITY = 32
"""Number that represents a keep probability of 1 [1]."""
_SAMPLE_PACE, _RADIAL_PACE = 3242174889, 2447445414  # of 2^32: the inverse of the plastic number, and its square


class RangeBins(NamedTuple):
    """Range bins of the plan, and the pairs of families whose keep probabilities they hold."""

    edges: Floats
    """Edges of the bins, horizontal distances [m], (b + 1,)."""
    pair: Integers
    """Rows of two families, (p, 2)."""
    close: NDArray[np.bool_]
    """True if several pairs of a bin may arrive within one pulse, (b,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def list_samples(
    radials: Floats, heading: float, step: float, bins: RangeBins, keep_probability: Integers, families: FamilyTable,
    lists: SampleLists, fill: bool,
) -> None:  # fmt: skip
    """Fill one list for each radial, or only count: `first`, `pair_first` and `close_first` are set in either case.

    Args:
        radials: See `RadialSet`, (s, 9).
        heading: Heading of their frame [rad].
        step: Distance of samples [m].
        bins: The range bins.
        keep_probability: Keep probability of samples by radial, range bin and pair, in units of
            1 / `FULL_PROBABILITY`, (s, b, p).
        families: Tables of the families.
        lists: Result.
        fill: True to fill the lists, False to count their rows.
    """
    edges, pair, close = bins
    family_count = families.bounce_codes.shape[0]
    range_bin, requested = np.empty(edges.size, np.int64), np.empty((family_count, edges.size - 1), np.uint8)
    n, ranges, row = 0, 0, 0
    lists.first[0], lists.close_first[0] = 0, 0
    for s in range(radials.shape[0]):
        pitch = step * radials[s, 8]
        count = range_bins_of(radials[s], pitch, edges, pair, keep_probability[s], range_bin, requested)
        lists.samples[s] = count
        mark_needed_launches(requested, families, lists.passed[s])
        priority, number = np.empty(count, np.int32), np.full(count, -1, np.int32)
        priorities(radials[s, 7], count, priority)
        begin, all_families = n, np.int32(0)
        for b in range(edges.size - 1):
            start = n
            for k in range(range_bin[b], range_bin[b + 1]):
                bits = np.int32(0)
                for f in range(family_count):
                    bits |= np.int32(1 << f) if priority[k] < requested[f, b] else np.int32(0)
                if bits == 0:
                    continue
                number[k] = n - begin
                all_families |= bits
                if fill:
                    lists.sample[n], lists.requested[n] = k, bits
                n += 1
            if close[b] and n > start:
                if fill:
                    lists.close[ranges, 0], lists.close[ranges, 1] = start - begin, n - begin
                ranges += 1
        lists.families[s] = all_families
        if fill:
            _positions(radials[s], heading, pitch, lists.sample[begin:n], lists.reach[begin:n], lists.ahead[:, begin:n])
        for p in range(pair.shape[0]):
            lists.pair_first[s, p] = row
            for b in range(edges.size - 1):
                for k in range(range_bin[b], range_bin[b + 1] if keep_probability[s, b, p] > 0 else 0):
                    if priority[k] < keep_probability[s, b, p]:
                        if fill:
                            lists.row[row], lists.more[row] = number[k], FULL_PROBABILITY / keep_probability[s, b, p]
                        row += 1
        lists.pair_first[s, pair.shape[0]] = row
        lists.first[s + 1], lists.close_first[s + 1] = n, ranges


@njit(cache=True, nogil=True, error_model="numpy")
def _positions(radial: Floats, heading: float, step: float, sample: Integers, reach: Floats, bearing: Singles) -> None:
    """Fill distances of samples, and bearings at which the beams are evaluated for them.

    The bearing is at another part of the radial's width for each sample, or in the middle of a radial of one cell.
    """
    cosine = math.cos(heading) * radial[0] - math.sin(heading) * radial[1]
    sine = math.sin(heading) * radial[0] + math.cos(heading) * radial[1]
    for i in range(sample.size):
        reach[i] = (sample[i] + radial[6]) * step
        fraction = radial[7] * GOLDEN + (sample[i] + 0.5) * GOLDEN
        priority = (fraction - math.floor(fraction) - 0.5) * radial[3]
        middle = 1 - 0.5 * priority * priority
        bearing[0, i], bearing[1, i] = cosine * middle - sine * priority, sine * middle + cosine * priority


@njit(cache=True, nogil=True, error_model="numpy")
def range_bins_of(
    radial: Floats, step: float, edges: Floats, pair: Integers, keep_probability: Integers, range_bin: Integers,
    requested: Integers
) -> int:  # fmt: skip
    """Fill the first sample of each range bin of a radial, and the largest keep probability of each family there.

    Args:
        radial: One row of `radials`, (9,).
        step: Distance of the radial's samples [m].
        edges: See `RangeBins`.
        pair: See `RangeBins`.
        keep_probability: Keep probability of the radial, (b, p).
        range_bin: Result, first sample of each range bin, (b + 1,).
        requested: Result, largest keep probability, (f, b).

    Returns:
        Number of samples of the radial up to the last that any family uses.
    """
    last = max(math.ceil(radial[5] / step - radial[6]), 0)
    begin = max(math.ceil(radial[4] / step - radial[6]), 0)
    requested[:] = 0
    count = 0
    for b in range(edges.size):
        range_bin[b] = min(max(math.ceil(edges[b] / step - radial[6]), begin), last)
    range_bin[edges.size - 1] = max(last, begin)  # rounding must not lose the last sample
    for b in range(edges.size - 1):
        for p in range(pair.shape[0]):
            if keep_probability[b, p] > 0:
                i, j = pair[p, 0], pair[p, 1]
                requested[i, b] = max(requested[i, b], keep_probability[b, p])
                requested[j, b] = max(requested[j, b], keep_probability[b, p])
                count = max(count, range_bin[b + 1]) if range_bin[b + 1] > range_bin[b] else count
    for b in range(edges.size):
        range_bin[b] = min(range_bin[b], count)
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
    word = int(number) * _RADIAL_PACE
    for k in range(count):
        word += _SAMPLE_PACE
        priority[k] = np.int32((word >> 27) & 31)


@njit(cache=True, nogil=True, error_model="numpy")
def mark_needed_launches(requested: Integers, families: FamilyTable, passed: NDArray[np.bool_]) -> None:
    """Mark the rows of launches of families that are requested anywhere (`requested` (f, b) above 0)."""
    bounce_codes, horizon_row = families.bounce_codes, families.horizon_row
    passed[:] = False
    for f in range(bounce_codes.shape[0]):
        if requested[f].max() > 0:
            for k in range(horizon_row.shape[1]):
                if k == 0 or bounce_codes[f, k - 1] > 0:
                    passed[horizon_row[f, k]] = True
