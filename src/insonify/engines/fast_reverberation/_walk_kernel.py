"""Seabed legs along radials: line of sight, delays and amplitudes of all samples of a radial in one pass.

A radial is a line of one azimuth. Its depths are read from the map, sample by sample outwards; shadows of every family
follow by the rules of `insonify.engines.terrain_occlusion`. The results are columns of its listed samples.
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
    """Fill the listed samples of some radials, their legs, and the samples of each pair of families.

    Args:
        frame: Frame of the radials.
        channel: Water of the straight rays.
        part: The radials, with the lists of their samples.
        tiles: Tiles of the seabed's map.
        families: Tables of the families.
        legs: Result.
        pairs: Result.
        interference_ranges: Result, first point and after the last of ranges where pairs may arrive within one pulse,
            (any, 2).

    Returns:
        Number of these ranges.
    """
    radials, lists, entries, _ = part
    longest, most = 0, 0
    for entry in entries:
        longest, most = max(longest, lists.samples[entry]), max(most, lists.first[entry + 1] - lists.first[entry])
    line_depth, slope = np.empty(longest, np.float32), np.empty((2, longest), np.float32)
    rows = families.launch_image_depths.size
    launch, bound = np.empty((2, rows, longest), np.float32)
    facet, bits = np.empty((5, most), np.float32), np.empty(most, np.int32)
    node_index = np.empty(longest, np.uint32)
    n, ranges = 0, 0
    pairs.sample_count[:] = 0
    for s in range(radials.shape[0]):
        legs.first[s], entry = n, entries[s]
        begin, stop = lists.first[entry], lists.first[entry + 1]
        if stop == begin:
            continue
        spacing, first, count, m = frame.step * radials[s, 8], radials[s, 6], lists.samples[entry], stop - begin
        sample_radial_terrain(frame, radials[s], count, channel.water_depth, tiles, node_index, line_depth, slope)
        for w in range(rows):
            if lists.passed[entry, w]:
                running_horizon(line_depth, families.launch_image_depths[w], families.launch_rising[w], spacing, first,
                                count, launch[w], bound[w])  # fmt: skip
        legs.point[0, n : n + m] = lists.reach[begin:stop]
        gather_samples(lists.sample[begin:stop], line_depth, slope, legs.point[1, n : n + m], facet, bits)
        profile = RadialProfile(line_depth, count, first, spacing, launch, bound)
        for f in range(families.images.size):
            mark_reached_samples(
                f, bits, lists.sample[begin:stop], lists.requested[begin:stop], profile, channel, families
            )
        legs_along_radial(radials[s], frame, channel, families, lists.families[entry], lists.ahead[:, begin:stop],
                          RadialScratch(facet, bits, n), legs)  # fmt: skip
        append_pair_samples(lists, entry, facet[3], n, pairs.rows, pairs.weight, pairs.sample_count)
        ranges = append_interference_ranges(lists, entry, n, interference_ranges, ranges)
        n += m
    legs.first[radials.shape[0]] = n
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def gather_samples(
    sample: Integers, line_depth: Singles, slope: Singles, depth: Floats, facet: Singles, bits: Integers
) -> None:
    """Gather the terrain at the listed samples of one radial.

    Args:
        sample: Number of each listed sample along the radial, (m,).
        line_depth: Depth at all samples [m], (samples,).
        slope: Slopes along the axes of the map at all samples [1], (2, samples).
        depth: Result [m], (m,).
        facet: Result, slopes [1] in the first two rows, (5, at least m).
        bits: Result, set to 0 (no family), (at least m,).
    """
    slope_a, slope_b, facet_a, facet_b = slope[0], slope[1], facet[0], facet[1]
    for i in range(sample.size):
        k = np.uint32(sample[i])
        depth[i], facet_a[i], facet_b[i], bits[i] = line_depth[k], slope_a[k], slope_b[k], 0


@njit(cache=True, nogil=True, error_model="numpy")
def append_pair_samples(
    lists: SampleLists, entry: int, area: Singles, n: int, rows: Integers, weight: Singles, sample_rows: Integers
) -> None:
    """Append the samples of one radial to those of each pair.

    Args:
        lists: Lists of samples.
        entry: Row of the radial's list.
        area: Areas of the listed samples [m^2], (at least m,).
        n: Number of the radial's first sample.
        rows: See `PairSamples`.
        weight: See `PairSamples`.
        sample_rows: See `PairSamples`, added to.
    """
    for p in range(sample_rows.size):
        begin, stop = lists.pair_first[entry, p], lists.pair_first[entry, p + 1]
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
    lists: SampleLists, entry: int, n: int, interference_ranges: Integers, ranges: int
) -> int:
    """Append ranges of one radial where pairs may interfere; return their number. Arguments as in `walk_radials`."""
    for c in range(lists.close_first[entry], lists.close_first[entry + 1]):
        if ranges == 0 or interference_ranges[ranges - 1, 1] != n + lists.close[c, 0]:
            interference_ranges[ranges, 0] = n + lists.close[c, 0]
            ranges += 1
        interference_ranges[ranges - 1, 1] = n + lists.close[c, 1]
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def gather_directions(
    incoming: Singles, outgoing: Singles, normal: Singles, rows: Integers, into: Singles, out: Singles, up: Singles
) -> None:
    """Fill the arguments of the scattering law for all samples of a pair.

    Args:
        incoming: Directions of travel of transmit legs at the samples [1], (3, n).
        outgoing: Directions of travel of receive legs at the samples, from the sonar [1], (3, n).
        normal: Unit normals at the samples, (3, n).
        rows: Samples of the pair, (m,).
        into: Result, directions of travel towards the samples, (3, m).
        out: Result, directions of travel from the samples, (3, m).
        up: Result, unit normals, (3, m).
    """
    for c in range(3):
        incoming_row, outgoing_row, normal_row = incoming[c], outgoing[c], normal[c]
        for k in range(rows.size):
            into[c, k], out[c, k], up[c, k] = incoming_row[rows[k]], -outgoing_row[rows[k]], normal_row[rows[k]]
