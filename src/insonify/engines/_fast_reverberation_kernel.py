"""Seabed legs along radials: line of sight, delays and amplitudes of all samples of a radial in one pass.

A radial is a line of one azimuth. Its depths are read from the map, sample after sample outwards; shadows of every
family follow by the rules of `insonify.engines.terrain_occlusion`. The results are columns of the points on its list.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines._line_of_sight_kernel import mark_reached_samples, running_horizon
from insonify.engines._radial_legs_kernel import legs_along_radial
from insonify.engines._radial_samples_kernel import SampleLists
from insonify.engines._radial_terrain_kernel import sample_radial_terrain
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def walk_radials(
    along: float, across: float, heading: float, source: float, water_depth: float, speed: float,
    wavelength: float, radials: Floats, step: float, lists: SampleLists, chosen: Integers, cell: float, slot: Integers,
    pieces: Singles, flat: bool, images: Floats, bounce_codes: Integers, horizon_row: Integers,
    launch_image_depths: Floats,
    launch_rising: NDArray[np.bool_], mirrors: NDArray[np.complex64], factor: Singles, loss: float, place: Floats,
    delay: Floats, amplitude: NDArray[np.complex64], departure: Singles, arrival: Singles, normal: Singles,
    rows: Integers, weight: Singles, found: Integers, first_of: Integers, interference_ranges: Integers,
) -> int:  # fmt: skip
    """The points of the seabed along some lines that any pair of families wants, and their legs.

    Args:
        along: Where the lines start, in the frame of the map, from the first node of its window [m].
        across: Offset across the frame [m].
        heading: Heading of that frame in the world [rad].
        source: Depth of the sonar [m].
        water_depth: Depth of the mean seabed [m].
        speed: Sound speed [m/s].
        wavelength: Acoustic wavelength [m].
        radials: Cosine and sine of each line in the frame of the map; width of its cell [rad]; width over which the
            beam is evaluated in turn, 0 for its middle alone [rad]; start and stop of what is received [m]; place of
            its first sample in its own steps; its number; how many steps its own are; (s, 9).
        step: Distance of samples [m].
        lists: Points of each line, and of each pair.
        chosen: Which of the lists each line has, (s,).
        cell: Side of a cell of the map [m].
        slot: Row in `pieces` of each piece of the window, (any, any).
        pieces: Height [m] and slopes [1] on nodes, (pieces, 65, 65, 3).
        flat: True if the seabed is level, and has no map.
        images: Depth of the image source of each family [m], (f,).
        bounce_codes: See `mark_reached_samples`.
        horizon_row: See `mark_reached_samples`.
        launch_image_depths: Depth of the image source of each row of launches [m], (paths,).
        launch_rising: True if its last bounce is off the bottom, (paths,).
        mirrors: Product of all bounces of a family, over evenly spaced sines of the grazing angle [1], (f, nodes).
        factor: Of a law that is a product of one for each direction, see `CompiledLaw.factor`; empty for any other.
        loss: Absorption [octaves of pressure/m].
        place: Result, horizontal distance and depth of each point [m], (2, most).
        delay: Result, one-way travel time [s], (f, most).
        amplitude: Result, pressure re 1 m, times the root of the direction's factor if there is one [1]; 0 where there
            is no path, (f, most).
        departure: Result, direction of travel at the sonar, in the world, (f, 3, most).
        arrival: Result, direction of travel at the point, (f, 3, most).
        normal: Result, unit normal into the water, (3, most).
        rows: Result, points of each pair, (p, most).
        weight: Result, ground that they represent [m^2], (p, most).
        found: Result, numbers of points, (p,).
        first_of: Result, first point of each line, (s + 1,).
        interference_ranges: Result, first point and after the last of ranges where pairs may arrive within one pulse,
            (any, 2).

    Returns:
        Number of these ranges.
    """
    longest, most = 0, 0
    for one in chosen:
        longest, most = max(longest, lists.samples[one]), max(most, lists.first[one + 1] - lists.first[one])
    ground, slope = np.empty(longest, np.float32), np.empty((2, longest), np.float32)
    launch, bound = np.empty((2, launch_image_depths.size, longest), np.float32)
    facet, bits = np.empty((5, most), np.float32), np.empty(most, np.int32)
    where = np.empty(longest, np.uint32)
    n, ranges = 0, 0
    found[:] = 0
    for s in range(radials.shape[0]):
        first_of[s], one = n, chosen[s]
        begin, stop = lists.first[one], lists.first[one + 1]
        if stop == begin:
            continue
        own, first, count, m = step * radials[s, 8], radials[s, 6], lists.samples[one], stop - begin
        sample_radial_terrain(
            along, across, radials[s], own, count, cell, water_depth, slot, pieces, flat, where, ground, slope
        )
        for w in range(launch_image_depths.size):
            if lists.passed[one, w]:
                running_horizon(
                    ground, launch_image_depths[w], launch_rising[w], own, first, count, launch[w], bound[w]
                )
        place[0, n : n + m] = lists.reach[begin:stop]
        gather_samples(lists.sample[begin:stop], ground, slope, place[1, n : n + m], facet, bits)
        for f in range(images.size):
            mark_reached_samples(f, bits, lists.sample[begin:stop], lists.wanted[begin:stop], count, first, own, ground,
                       images[f], source, water_depth, wavelength, bounce_codes, horizon_row, launch,
                       bound)  # fmt: skip
        legs_along_radial(radials[s], heading, own, m, speed, loss, images, bounce_codes, mirrors, factor,
                          lists.families[one],
                   lists.ahead[0, begin:stop], lists.ahead[1, begin:stop], facet, bits, n, place, delay, amplitude,
                   departure, arrival, normal)  # fmt: skip
        append_pair_samples(lists, one, facet[3], n, rows, weight, found)
        ranges = append_interference_ranges(lists, one, n, interference_ranges, ranges)
        n += m
    first_of[radials.shape[0]] = n
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def gather_samples(
    sample: Integers, ground: Singles, slope: Singles, depth: Floats, facet: Singles, bits: Integers
) -> None:
    """Gather the seabed at the points of one line.

    Args:
        sample: Number of each point along the line, (m,).
        ground: Depth [m], (samples,).
        slope: Along the axes of the map [1], (2, samples).
        depth: Result [m], (m,).
        facet: Result, slopes [1] in the first two rows, (5, at least m).
        bits: Result, no family yet, (at least m,).
    """
    one, two, to_one, to_two = slope[0], slope[1], facet[0], facet[1]
    for i in range(sample.size):
        k = np.uint32(sample[i])
        depth[i], to_one[i], to_two[i], bits[i] = ground[k], one[k], two[k], 0


@njit(cache=True, nogil=True, error_model="numpy")
def append_pair_samples(
    lists: SampleLists, one: int, area: Singles, n: int, rows: Integers, weight: Singles, found: Integers
) -> None:
    """Append the points of one line to those of each pair.

    Args:
        lists: See `walk_radials`.
        one: Which of them the line has.
        area: Areas of the points [m^2], (points,).
        n: Number of the line's first point.
        rows: See `walk_radials`.
        weight: See `walk_radials`.
        found: See `walk_radials`, added to.
    """
    for p in range(found.size):
        begin, stop = lists.pair_first[one, p], lists.pair_first[one, p + 1]
        row, more = lists.row[begin:stop], lists.more[begin:stop]
        to_row, to_weight = rows[p, found[p] : found[p] + row.size], weight[p, found[p] : found[p] + row.size]
        for q in range(row.size):
            to_row[q], to_weight[q] = n + row[q], area[np.uint32(row[q])] * more[q]
        found[p] += row.size


@njit(cache=True, nogil=True, error_model="numpy")
def append_interference_ranges(lists: SampleLists, one: int, n: int, interference_ranges: Integers, ranges: int) -> int:
    """Append the ranges of one line where pairs may interfere to those before; arguments see `append_pair_samples`."""
    for c in range(lists.close_first[one], lists.close_first[one + 1]):
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
        into: Result, as the law wants it, (3, m).
        out: Result, shape (3, m).
        up: Result, shape (3, m).
    """
    for c in range(3):
        one, two, three = incoming[c], outgoing[c], normal[c]
        for k in range(rows.size):
            into[c, k], out[c, k], up[c, k] = one[rows[k]], -two[rows[k]], three[rows[k]]
