"""Seabed legs along radials: line of sight, delays and amplitudes of all samples of a radial in one pass.

A radial is a line of one azimuth. Its depths are read from the map, sample by sample outwards; occlusion of every
family by terrain follows by the rules of `insonify.engines.terrain_occlusion`. The results are columns of its listed
samples.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation._line_of_sight_kernel import (
    RadialProfile,
    first_occluding_sample,
    mark_clear_bounces,
    mark_lit_samples,
    mark_reached_samples,
    mark_used_horizons,
    running_extreme,
    running_horizon,
)
from insonify.engines.fast_reverberation._radial_legs_kernel import (
    Facets,
    FamilyImage,
    FamilyLegs,
    RadialBearings,
    SampleBlock,
    apply_direction_factor,
    facet_normals,
    straight_legs,
)
from insonify.engines.fast_reverberation._radial_terrain_kernel import sample_radial_terrain
from insonify.engines.fast_reverberation._refraction_kernel import (
    interpolate_refraction,
    refracted_launch_slopes,
    refracted_legs,
)
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

BLOCK = 256
"""Samples of whole radials, at least, whose legs are evaluated together: long loops, in the first-level cache."""


@njit(cache=True, nogil=True, error_model="numpy")
def walk_radials(
    frame: RadialFrame, channel: IsovelocityChannel, radial_set: RadialSet, tiles: MapTiles, families: FamilyTable,
    legs: RadialLegs, pairs: PairSamples, interference_ranges: Integers,
) -> int:  # fmt: skip
    """Fill the listed samples of some radials, their legs, and the samples of each pair of families.

    Args:
        frame: Frame of the radials.
        channel: Water of the straight rays.
        radial_set: The radials, with the lists of their samples.
        tiles: Tiles of the seabed's map.
        families: Tables of the families.
        legs: Result.
        pairs: Result.
        interference_ranges: Result, first sample, and the one after the last, of each range in which pairs may arrive
            within one pulse, (any, 2).

    Returns:
        Number of these ranges.
    """
    radials, lists, list_rows, _ = radial_set
    max_sample_count, max_list_length = 0, 0
    for list_row in list_rows:
        max_sample_count = max(max_sample_count, lists.sample_counts[list_row])
        max_list_length = max(max_list_length, lists.list_offsets[list_row + 1] - lists.list_offsets[list_row])
    line_depth, slope = np.empty(max_sample_count, np.float32), np.empty((2, max_sample_count), np.float32)
    horizon_count = families.horizon_image_depths.size
    profile_shape = horizon_count, max_sample_count
    launch_slope, horizon = np.empty(profile_shape, np.float32), np.empty(profile_shape, np.float32)
    node_index, size = np.empty(max_sample_count, np.uint32), BLOCK + max_list_length
    lit = np.empty(max_sample_count, np.int32)
    refracted = families.refraction.nodes.size > 0
    block = SampleBlock(np.empty((6, size), np.float32), np.empty(size, np.int32), np.empty((4, size), np.float32),
                        np.empty(size), np.empty(8 * size if refracted else 0, np.float32))  # fmt: skip
    clear, used = np.empty(families.image_depths.size, np.bool_), np.empty(horizon_count, np.bool_)
    mark_clear_bounces(channel, families, clear)
    mark_used_horizons(clear, families, used)
    n, ranges, block_start, first_radial, family_bits = 0, 0, 0, 0, 0
    pairs.sample_count[:] = 0
    for s in range(radials.shape[0]):
        legs.radial_offsets[s], list_row = n, list_rows[s]
        begin, stop = lists.list_offsets[list_row], lists.list_offsets[list_row + 1]
        if stop > begin:
            spacing, start_steps = frame.step * radials[s, column.STRIDE], radials[s, column.FIRST_SAMPLE]
            first = first_occluding_sample(lists.sample_number[begin], channel, families, used)
            span = first, lists.sample_counts[list_row]
            sample_radial_terrain(frame, radials[s], span, channel.water_depth, tiles, node_index, line_depth, slope)
            for w in range(horizon_count):
                if not (used[w] and lists.needed_horizons[list_row, w]):
                    continue
                rising = families.horizon_rising[w]
                if refracted:
                    deepest = channel.water_depth if rising else np.inf
                    refracted_launch_slopes(line_depth, w, deepest, spacing, start_steps, span, families.refraction,
                                            launch_slope[w])  # fmt: skip
                    running_extreme(rising, span, launch_slope[w], horizon[w])
                else:
                    running_horizon(line_depth, families.horizon_image_depths[w], rising, spacing,
                                    start_steps, span, launch_slope[w], horizon[w])  # fmt: skip
            profile = RadialProfile(line_depth, span[1], start_steps, spacing, launch_slope, horizon)
            mark_lit_samples(lists.family_bits[list_row], profile, span[0], families, clear, lit)
            gather_samples(lists, (begin, stop, n - block_start, n), radials[s], frame, line_depth, slope, lit, block,
                           legs.range_depth)  # fmt: skip
            for f in range(families.image_depths.size):
                if not clear[f] and lists.family_bits[list_row] & (1 << f) != 0:
                    mark_reached_samples(
                        f, block.reached_families[n - block_start :], lists.sample_number[begin:stop],
                        lists.requested_families[begin:stop], profile, channel, families,
                    )  # fmt: skip
            family_bits |= lists.family_bits[list_row]
            n += stop - begin
        if n - block_start < BLOCK and s + 1 < radials.shape[0]:
            continue
        legs_to_samples((block_start, n), frame.heading, channel, families, family_bits, block, legs)
        area = block.facet[3]
        for r in range(first_radial, s + 1):
            offset = legs.radial_offsets[r]
            append_pair_samples(lists, list_rows[r], area[offset - block_start :], offset, pairs.rows, pairs.weight,
                                pairs.sample_count)  # fmt: skip
            ranges = append_interference_ranges(lists, list_rows[r], offset, interference_ranges, ranges)
        block_start, first_radial, family_bits = n, s + 1, 0
    legs.radial_offsets[radials.shape[0]] = n
    return ranges


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def legs_to_samples(
    samples: tuple[int, int], heading: float, channel: IsovelocityChannel, table: FamilyTable, family_bits: int,
    block: SampleBlock, legs: RadialLegs,
) -> None:  # fmt: skip
    """Fill the legs to the m samples of some radials.

    Args:
        samples: First column of `legs` that is filled, and the one after the last.
        heading: Heading of the frame of the radials [rad].
        channel: Water of the straight rays.
        table: Tables of the families.
        family_bits: Families requested at any of the samples, a bit for each.
        block: The samples, in the order of these columns; the fourth row of `facet` becomes the areas.
        legs: Result.
    """
    (n, stop), facet, bearing = samples, block.facet, block.bearing
    m, reached_families = stop - n, block.reached_families
    range_depth, normal, delay = legs.range_depth, legs.normal, legs.delay
    departure, arrival = legs.departure, legs.arrival
    amplitude, reflection_products, bounce_codes = legs.amplitude, table.reflection_products, table.bounce_codes
    # rows of whole arrays: the compiler must see that they are contiguous
    depth, pressure, area, root_slant = range_depth[1, n:stop], facet[2, :m], facet[3, :m], facet[4, :m]
    facets = Facets(range_depth[0, n:stop], facet[0, :m], facet[1, :m], normal[0, n:stop], normal[1, n:stop],
                    normal[2, n:stop], area)  # fmt: skip
    facet_normals(facets, math.cos(heading), math.sin(heading), block.cell_width[:m])
    bearings = RadialBearings(bearing[0, :m], bearing[1, :m], bearing[2, :m], bearing[3, :m])
    nodes = reflection_products.shape[1] - 1
    for f in range(table.image_depths.size):
        if family_bits & (1 << f) == 0:
            amplitude[f, n:stop] = 0
            continue
        sign, bounces = 1.0, 0
        for q in range(bounce_codes.shape[1]):
            if bounce_codes[f, q] > 0:
                sign, bounces = -sign, bounces + 1
        columns = FamilyLegs(delay[f, n:stop], arrival[f, 0, n:stop], arrival[f, 1, n:stop], arrival[f, 2, n:stop],
                             departure[f, 0, n:stop], departure[f, 1, n:stop], departure[f, 2, n:stop], pressure,
                             root_slant)  # fmt: skip
        image = FamilyImage(table.image_depths[f], 1 / channel.sound_speed, table.absorption_exponent, sign, f)
        bounce_sine = arrival[f, 2, n:stop]
        if table.refraction.nodes.size == 0:
            straight_legs(facets, depth, image, bearings, reached_families[:m], columns)
        else:
            bounce_sine = facet[5, :m]
            interpolate_refraction(facets.distance, depth, f, table.refraction, block.refraction)
            refracted_legs(facets, depth, image, bearings, reached_families[:m], block.refraction, columns, bounce_sine)
        if table.direction_factor.size > 0:
            apply_direction_factor(table.direction_factor, root_slant, pressure)
        if bounces == 0:
            for i in range(m):
                amplitude[f, n + i] = np.complex64(pressure[i])
            continue
        for i in range(m):
            position = min(abs(bounce_sine[i]), np.float32(1)) * np.float32(nodes)
            cell = np.uint64(min(int(position), nodes - 1))  # unsigned: a signed index costs a test
            fraction = np.float32(position - cell)
            low, high = reflection_products[f, cell], reflection_products[f, cell + np.uint64(1)]
            amplitude[f, n + i] = pressure[i] * (low + fraction * (high - low))


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def gather_samples(
    lists: SampleLists, rows: tuple[int, int, int, int], radial: Floats, frame: RadialFrame, line_depth: Singles,
    slope: Singles, lit_families: Integers, block: SampleBlock, range_depth: Floats,
) -> None:  # fmt: skip
    """Gather the listed samples of one radial into a block.

    Args:
        lists: Lists of samples.
        rows: First of the radial's points in `lists` and the one after the last; its first point in `block`; its first
            sample in `range_depth`.
        radial: One row of `RadialSet.radials`, (9,).
        frame: Frame of the radials.
        line_depth: Depth at all samples of the radial [m], (samples,).
        slope: Slopes along the axes of the map at all samples [1], (2, samples).
        lit_families: Result of `mark_lit_samples`.
        block: Result, with the requested ones of these families.
        range_depth: Result, see `RadialLegs`.
    """
    begin, stop, first, n = rows
    cos_h, sin_h = math.cos(frame.heading), math.sin(frame.heading)
    cosine, sine = radial[column.COSINE], radial[column.SINE]
    north, east = np.float32(cos_h * cosine - sin_h * sine), np.float32(sin_h * cosine + cos_h * sine)
    cell_width = frame.step * radial[column.STRIDE] * radial[column.CELL_WIDTH]
    # Unsigned indices: a possibly negative index prevents vectorisation.
    source, target, sample = np.uint64(begin), np.uint64(first), np.uint64(n)
    number, listed, beam_n, beam_e = lists.sample_number, lists.distance, lists.beam_bearing[0], lists.beam_bearing[1]
    slope_a, slope_b, facet_a, facet_b = slope[0], slope[1], block.facet[0], block.facet[1]
    requested = lists.requested_families
    cosines, sines, norths, easts = block.bearing[0], block.bearing[1], block.bearing[2], block.bearing[3]
    distance, depth, reached, width = range_depth[0], range_depth[1], block.reached_families, block.cell_width
    for i in range(np.uint64(stop - begin)):
        k = np.uint32(number[source + i])
        distance[sample + i], depth[sample + i] = listed[source + i], line_depth[k]
        facet_a[target + i], facet_b[target + i] = slope_a[k], slope_b[k]
        reached[target + i] = requested[source + i] & lit_families[k]
    for i in range(np.uint64(stop - begin)):
        cosines[target + i], sines[target + i], width[target + i] = north, east, cell_width
        norths[target + i], easts[target + i] = beam_n[source + i], beam_e[source + i]


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def append_pair_samples(
    lists: SampleLists, list_row: int, area: Singles, n: int, rows: Integers, weight: Singles, sample_count: Integers
) -> None:
    """Append the samples of one radial to those of each pair.

    Args:
        lists: Lists of samples.
        list_row: Row of the radial's list.
        area: Areas of the listed samples [m^2], (at least m,).
        n: Index of the radial's first sample in `RadialLegs`.
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


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def append_interference_ranges(
    lists: SampleLists, list_row: int, n: int, interference_ranges: Integers, ranges: int
) -> int:
    """Append the ranges of one radial in which pairs may interfere, joined where they touch; return their number.

    Args:
        lists: Lists of samples.
        list_row: Row of the radial's list.
        n: Index of the radial's first sample in `RadialLegs`.
        interference_ranges: Result, see `walk_radials`.
        ranges: Number of ranges that are there already.
    """
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
        outgoing: Directions of travel of receive legs at the samples, followed from the sonar [1], (3, n).
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
