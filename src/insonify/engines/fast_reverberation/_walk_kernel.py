"""Seabed legs along radials: line of sight, delays and amplitudes of all samples of a radial in one pass.

A radial is a line of one azimuth. Its depths are read from the map, sample after sample outwards; shadows of every
family follow by the rules of `insonify.engines.terrain_occlusion`. The results are columns of the points on its list.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._line_of_sight_kernel import (
    RadialProfile,
    mark_reached_samples,
    running_horizon,
)
from insonify.engines.fast_reverberation._radial_legs_kernel import RadialScratch, legs_along_radial
from insonify.engines.fast_reverberation._radial_terrain_kernel import sample_radial_terrain
from insonify.engines.radial_tables import (
    FamilyTable,
    IsovelocityChannel,
    MapTiles,
    PairSamples,
    RadialFrame,
    RadialLegs,
    RadialSet,
    SampleLists,
)
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def walk_radials(
    frame: RadialFrame, channel: IsovelocityChannel, part: RadialSet, tiles: MapTiles, families: FamilyTable,
    legs: RadialLegs, pairs: PairSamples, interference_ranges: Integers,
) -> int:  # fmt: skip
    """Fill the points of the seabed along some radials that any pair of families uses, and their legs.

    Args:
        frame: Frame of the radials.
        channel: Water of the straight rays.
        part: The radials, with the lists of their points.
        tiles: Tiles of the seabed's map.
        families: Tables of the families.
        legs: Result.
        pairs: Result.
        interference_ranges: Result, first point and after the last of ranges where pairs may arrive within one pulse,
            (any, 2).

    Returns:
        Number of these ranges.
    """
    radials, lists, chosen, _ = part
    longest, most = 0, 0
    for line in chosen:
        longest, most = max(longest, lists.samples[line]), max(most, lists.first[line + 1] - lists.first[line])
    line_depth, slope = np.empty(longest, np.float32), np.empty((2, longest), np.float32)
    rows = families.launch_image_depths.size
    launch, bound = np.empty((2, rows, longest), np.float32)
    facet, bits = np.empty((5, most), np.float32), np.empty(most, np.int32)
    where = np.empty(longest, np.uint32)
    n, ranges = 0, 0
    pairs.sample_count[:] = 0
    for s in range(radials.shape[0]):
        legs.first[s], line = n, chosen[s]
        begin, stop = lists.first[line], lists.first[line + 1]
        if stop == begin:
            continue
        own, first, count, m = frame.step * radials[s, 8], radials[s, 6], lists.samples[line], stop - begin
        sample_radial_terrain(frame, radials[s], count, channel.water_depth, tiles, where, line_depth, slope)
        for w in range(rows):
            if lists.passed[line, w]:
                running_horizon(line_depth, families.launch_image_depths[w], families.launch_rising[w], own, first,
                                count, launch[w], bound[w])  # fmt: skip
        legs.point[0, n : n + m] = lists.reach[begin:stop]
        gather_samples(lists.sample[begin:stop], line_depth, slope, legs.point[1, n : n + m], facet, bits)
        profile = RadialProfile(line_depth, count, first, own, launch, bound)
        for f in range(families.images.size):
            mark_reached_samples(
                f, bits, lists.sample[begin:stop], lists.requested[begin:stop], profile, channel, families
            )
        legs_along_radial(radials[s], frame, channel, families, lists.families[line], lists.ahead[:, begin:stop],
                          RadialScratch(facet, bits, n), legs)  # fmt: skip
        append_pair_samples(lists, line, facet[3], n, pairs.rows, pairs.weight, pairs.sample_count)
        ranges = append_interference_ranges(lists, line, n, interference_ranges, ranges)
        n += m
    legs.first[radials.shape[0]] = n
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def gather_samples(
    sample: Integers, line_depth: Singles, slope: Singles, depth: Floats, facet: Singles, bits: Integers
) -> None:
    """Gather the seabed at the points of one line.

    Args:
        sample: Number of each point along the line, (m,).
        line_depth: Depth [m], (samples,).
        slope: Along the axes of the map [1], (2, samples).
        depth: Result [m], (m,).
        facet: Result, slopes [1] in the first two rows, (5, at least m).
        bits: Result, no family yet, (at least m,).
    """
    one, two, to_one, to_two = slope[0], slope[1], facet[0], facet[1]
    for i in range(sample.size):
        k = np.uint32(sample[i])
        depth[i], to_one[i], to_two[i], bits[i] = line_depth[k], one[k], two[k], 0


@njit(cache=True, nogil=True, error_model="numpy")
def append_pair_samples(
    lists: SampleLists, line: int, area: Singles, n: int, rows: Integers, weight: Singles, sample_rows: Integers
) -> None:
    """Append the points of one line to those of each pair.

    Args:
        lists: See `walk_radials`.
        line: Row of the list of the radial.
        area: Areas of the points [m^2], (points,).
        n: Number of the line's first point.
        rows: See `PairSamples`.
        weight: See `PairSamples`.
        sample_rows: See `PairSamples`, added to.
    """
    for p in range(sample_rows.size):
        begin, stop = lists.pair_first[line, p], lists.pair_first[line, p + 1]
        row, more = lists.row[begin:stop], lists.more[begin:stop]
        to_row, to_weight = (
            rows[p, sample_rows[p] : sample_rows[p] + row.size],
            weight[p, sample_rows[p] : sample_rows[p] + row.size],
        )
        for q in range(row.size):
            to_row[q], to_weight[q] = n + row[q], area[np.uint32(row[q])] * more[q]
        sample_rows[p] += row.size


@njit(cache=True, nogil=True, error_model="numpy")
def append_interference_ranges(
    lists: SampleLists, line: int, n: int, interference_ranges: Integers, ranges: int
) -> int:
    """Append the ranges of one line where pairs may interfere to those before; arguments see `append_pair_samples`."""
    for c in range(lists.close_first[line], lists.close_first[line + 1]):
        if ranges == 0 or interference_ranges[ranges - 1, 1] != n + lists.close[c, 0]:
            interference_ranges[ranges, 0] = n + lists.close[c, 0]
            ranges += 1
        interference_ranges[ranges - 1, 1] = n + lists.close[c, 1]
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def gather_directions(
    incoming: Singles, outgoing: Singles, normal: Singles, rows: Integers, into: Singles, out: Singles, up: Singles
) -> None:
    """Arguments of the scattering law for all points of a pair.

    Args:
        incoming: Directions of travel at the points by the transmit leg, (3, n).
        outgoing: By the receive leg, (3, n).
        normal: Normals of the points, (3, n).
        rows: Points of the pair, (m,).
        into: Result, directions of travel towards the points, (3, m).
        out: Result, directions of travel from the points, (3, m).
        up: Result, unit normals, (3, m).
    """
    for c in range(3):
        one, two, three = incoming[c], outgoing[c], normal[c]
        for k in range(rows.size):
            into[c, k], out[c, k], up[c, k] = one[rows[k]], -two[rows[k]], three[rows[k]]
