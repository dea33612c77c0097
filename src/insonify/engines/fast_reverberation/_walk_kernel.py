"""Seabed legs along radials: line of sight, delays and amplitudes of all samples of a radial in one pass.

A radial is a line of one azimuth. Its depths are read from the map, sample by sample outwards; shadows of every family
follow by the rules of `insonify.engines.terrain_occlusion`. The results are columns of its listed samples.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation._line_of_sight_kernel import (
    RadialProfile,
    first_occluding_sample,
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
    radials, lists, list_rows, _ = part
    max_sample_count, max_list_length = 0, 0
    for list_row in list_rows:
        max_sample_count = max(max_sample_count, lists.sample_counts[list_row])
        max_list_length = max(max_list_length, lists.list_offsets[list_row + 1] - lists.list_offsets[list_row])
    line_depth, slope = np.empty(max_sample_count, np.float32), np.empty((2, max_sample_count), np.float32)
    horizon_count = families.horizon_image_depths.size
    launch_slope, horizon = np.empty((2, horizon_count, max_sample_count), np.float32)
    facet, reached_families = np.empty((5, max_list_length), np.float32), np.empty(max_list_length, np.int32)
    node_index = np.empty(max_sample_count, np.uint32)
    n, ranges = 0, 0
    pairs.sample_count[:] = 0
    for s in range(radials.shape[0]):
        legs.radial_offsets[s], list_row = n, list_rows[s]
        begin, stop = lists.list_offsets[list_row], lists.list_offsets[list_row + 1]
        if stop == begin:
            continue
        spacing, start_steps = frame.step * radials[s, column.STRIDE], radials[s, column.FIRST_SAMPLE]
        count, list_length = lists.sample_counts[list_row], stop - begin
        span = first_occluding_sample(lists.sample_number[begin], channel, families), count
        sample_radial_terrain(frame, radials[s], span, channel.water_depth, tiles, node_index, line_depth, slope)
        for w in range(horizon_count):
            if lists.needed_horizons[list_row, w]:
                running_horizon(line_depth, families.horizon_image_depths[w], families.horizon_rising[w], spacing,
                                start_steps, span, launch_slope[w], horizon[w])  # fmt: skip
        legs.range_depth[0, n : n + list_length] = lists.distance[begin:stop]
        gather_samples(lists.sample_number[begin:stop], line_depth, slope, legs.range_depth[1, n : n + list_length],
                       facet, reached_families)  # fmt: skip
        profile = RadialProfile(line_depth, count, start_steps, spacing, launch_slope, horizon)
        for f in range(families.image_depths.size):
            mark_reached_samples(f, reached_families, lists.sample_number[begin:stop],
                                 lists.requested_families[begin:stop], profile, channel, families)  # fmt: skip
        scratch = RadialScratch(facet, reached_families, n)
        legs_along_radial(radials[s], frame, channel, families, lists.family_bits[list_row],
                          lists.beam_bearing[:, begin:stop], scratch, legs)  # fmt: skip
        append_pair_samples(lists, list_row, facet[3], n, pairs.rows, pairs.weight, pairs.sample_count)
        ranges = append_interference_ranges(lists, list_row, n, interference_ranges, ranges)
        n += list_length
    legs.radial_offsets[radials.shape[0]] = n
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def gather_samples(
    sample_number: Integers, line_depth: Singles, slope: Singles, depth: Floats, facet: Singles,
    reached_families: Integers,
) -> None:  # fmt: skip
    """Gather the terrain at the listed samples of one radial.

    Args:
        sample_number: Number of each listed sample along the radial, (m,).
        line_depth: Depth at all samples [m], (samples,).
        slope: Slopes along the axes of the map at all samples [1], (2, samples).
        depth: Result [m], (m,).
        facet: Result, slopes [1] in the first two rows, (5, at least m).
        reached_families: Result, set to 0 (no family), (at least m,).
    """
    slope_a, slope_b, facet_a, facet_b = slope[0], slope[1], facet[0], facet[1]
    for i in range(sample_number.size):
        k = np.uint32(sample_number[i])
        depth[i], facet_a[i], facet_b[i], reached_families[i] = line_depth[k], slope_a[k], slope_b[k], 0


@njit(cache=True, nogil=True, error_model="numpy")
def append_pair_samples(
    lists: SampleLists, list_row: int, area: Singles, n: int, rows: Integers, weight: Singles, sample_count: Integers
) -> None:
    """Append the samples of one radial to those of each pair.

    Args:
        lists: Lists of samples.
        list_row: Row of the radial's list.
        area: Areas of the listed samples [m^2], (at least m,).
        n: Number of the radial's first sample.
        rows: See `PairSamples`.
        weight: See `PairSamples`.
        sample_count: See `PairSamples`, added to.
    """
    for p in range(sample_count.size):
        begin, stop = lists.pair_offsets[list_row, p], lists.pair_offsets[list_row, p + 1]
        points, inverse = lists.pair_points[begin:stop], lists.inverse_probability[begin:stop]
        rows_out = rows[p, sample_count[p] : sample_count[p] + points.size]
        weight_out = weight[p, sample_count[p] : sample_count[p] + points.size]
        for q in range(points.size):
            rows_out[q], weight_out[q] = n + points[q], area[np.uint32(points[q])] * inverse[q]
        sample_count[p] += points.size


@njit(cache=True, nogil=True, error_model="numpy")
def append_interference_ranges(
    lists: SampleLists, list_row: int, n: int, interference_ranges: Integers, ranges: int
) -> int:
    """Append ranges of one radial where pairs may interfere; return their number. Arguments as in `walk_radials`."""
    for c in range(lists.interference_offsets[list_row], lists.interference_offsets[list_row + 1]):
        if ranges == 0 or interference_ranges[ranges - 1, 1] != n + lists.interference_ranges[c, 0]:
            interference_ranges[ranges, 0] = n + lists.interference_ranges[c, 0]
            ranges += 1
        interference_ranges[ranges - 1, 1] = n + lists.interference_ranges[c, 1]
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def gather_directions(
    incoming: Singles, outgoing: Singles, normal: Singles, rows: Integers, incident: Singles, scattered: Singles,
    normals: Singles,
) -> None:  # fmt: skip
    """Fill the arguments of the scattering law for all samples of a pair.

    Args:
        incoming: Directions of travel of transmit legs at the samples [1], (3, n).
        outgoing: Directions of travel of receive legs at the samples, from the sonar [1], (3, n).
        normal: Unit normals at the samples, (3, n).
        rows: Samples of the pair, (m,).
        incident: Result, directions of travel towards the samples, (3, m).
        scattered: Result, directions of travel from the samples, (3, m).
        normals: Result, unit normals, (3, m).
    """
    for c in range(3):
        incoming_row, outgoing_row, normal_row = incoming[c], outgoing[c], normal[c]
        for k in range(rows.size):
            n = rows[k]
            incident[c, k], scattered[c, k], normals[c, k] = incoming_row[n], -outgoing_row[n], normal_row[n]
