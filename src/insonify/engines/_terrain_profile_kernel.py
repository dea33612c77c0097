"""Slices of azimuth about one end of the sonar: the slice of each point, and the depth of the seabed along each."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._prefetch import prefetch
from insonify.jit import njit
from insonify.scene.heightmap_cache import CELLS, NODES, SHIFT, HeightmapTiles

Floats = NDArray[np.floating[Any]]
Integers = NDArray[np.int64]
Rows = NDArray[np.int32]

EAST_NEIGHBOUR, NORTH_NEIGHBOUR = np.uint32(1), np.uint32(NODES)
"""Offsets from a node of the map to its neighbours."""
SAMPLES_PER_RUN = 64
"""Number of samples of one line before those of the next: neighbouring lines read the same tile of the map."""
POINTS_AT_ONCE = 128
"""Number of points whose distances and bearings are computed before their slices."""
MERGE_BLOCK_LOG2 = 3
"""Two to this power slices are merged in one decision."""


class ProfileLines(NamedTuple):
    """Lines from the sonar along which the seabed is sampled, evenly spaced; their directions change with the zone."""

    start: Floats
    """Start of the lines on the map [m], (2,)."""
    direction: Floats
    """Directions of the lines in each zone, unit vectors, (s, zones, 2)."""
    step: float
    """Distance of samples along a line [m]; sample k lies (k + 1) steps out."""
    firsts: Integers
    """Index of the first sample in each zone, and the number of samples, (zones + 1,)."""


class AzimuthSlices(NamedTuple):
    """Slices of azimuth about the sonar, in zones of distance: narrower ones farther out."""

    heading: float
    """Heading from which bearings are counted [rad]."""
    edges: Floats
    """Outer edge of each zone, increasing [m], (zones,)."""
    counts: Integers
    """Number of slices in each zone, (zones,)."""
    starts: Integers
    """Index of the first slice of each zone, (zones or more,)."""
    merged: NDArray[np.uint8]
    """Base-2 logarithm of the number of slices with one profile, for every 2^`MERGE_BLOCK_LOG2` of all slices."""
    batch: Rows
    """Index of the batch that holds the profile of each slice, -1 for none, (slices,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def sample_profiles(
    lines: ProfileLines, plane: float, heightmap: HeightmapTiles, missing: NDArray[np.bool_], done: NDArray[np.bool_],
    depth: Floats,
) -> bool:  # fmt: skip
    """Fill depths of the seabed along lines, bilinear between the nodes of the map.

    The map is larger than the processor's caches: nodes of the next line are prefetched while one is evaluated.

    Args:
        lines: The lines, s of them.
        plane: Depth of the plane from which heights are counted [m].
        heightmap: Tiles of terrain heights.
        missing: Result, True for the tiles that are missing, (rows, columns) of tiles.
        done: True for runs of `SAMPLES_PER_RUN` samples of a zone that are complete already, (runs,).
        depth: Result [m], (s, samples).

    Returns:
        True if all depths are complete.
    """
    all_complete, plane_depth, run, firsts, direction = True, np.float32(plane), 0, lines.firsts, lines.direction
    node_offset, cell_fraction = np.empty((2, SAMPLES_PER_RUN), np.uint32), np.empty((4, SAMPLES_PER_RUN), np.float32)
    for zone in range(firsts.size - 1):
        for begin in range(firsts[zone], firsts[zone + 1], SAMPLES_PER_RUN):
            if not done[run]:
                run_complete, end = True, min(begin + SAMPLES_PER_RUN, firsts[zone + 1])
                for s in range(depth.shape[0] + 1):
                    own, last = s & 1, (s - 1) & 1
                    if s < depth.shape[0]:
                        cells = node_offset[own], cell_fraction[2 * own], cell_fraction[2 * own + 1]
                        run_complete &= _locate_samples(
                            lines, direction[s, zone], begin, end, heightmap, missing, cells
                        )
                    if s > 0:
                        cells = node_offset[last], cell_fraction[2 * last], cell_fraction[2 * last + 1]
                        _interpolate_depths(heightmap.heights, plane_depth, cells, depth[s - 1, begin:end])
                done[run] = run_complete
                all_complete &= run_complete
            run += 1
    return all_complete


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _locate_samples(
    lines: ProfileLines, line_direction: Floats, first: int, stop: int, heightmap: HeightmapTiles,
    missing: NDArray[np.bool_], cells: tuple[NDArray[np.uint32], Floats, Floats],
) -> bool:  # fmt: skip
    """Locate a run of samples of one line in the map, from sample `first` to before `stop`.

    The results in `cells` are the index of the southwestern node of each cell, and the position in it to the north and
    the east [cells], shape (SAMPLES_PER_RUN,). Samples on missing tiles are put on the first tile. Returns True if no
    tile is missing. Other arguments are those of `sample_profiles`.
    """
    node_offset, north_fraction, east_fraction = cells
    x0, y0 = lines.start[0] / heightmap.cell, lines.start[1] / heightmap.cell
    dx, dy = line_direction[0] * lines.step / heightmap.cell, line_direction[1] * lines.step / heightmap.cell
    slot_of_tile, height, width = heightmap.row_of, missing.shape[0], missing.shape[1]
    is_complete, k = True, first
    while k < stop:
        i, j = math.floor(x0 + (k + 1) * dx) >> SHIFT, math.floor(y0 + (k + 1) * dy) >> SHIFT
        row, column, slot = i - heightmap.corner_a, j - heightmap.corner_b, -1
        if 0 < row < height - 1 and 0 < column < width - 1:
            slot = slot_of_tile[row * width + column]
        else:
            row, column = 0, 0
        if slot < 0:
            missing[row, column], is_complete, slot = True, False, 0
        south, west, tile = float(i << SHIFT), float(j << SHIFT), np.uint32(slot * NODES * NODES)
        end = min(k + _samples_on_tile(x0 - south, dx, k), k + _samples_on_tile(y0 - west, dy, k), stop)
        node, f, g = (
            node_offset[k - first : end - first], north_fraction[k - first : end - first],
            east_fraction[k - first : end - first],
        )  # fmt: skip
        for m in range(np.uint64(end - k)):
            x, y = x0 + (k + m + 1) * dx - south, y0 + (k + m + 1) * dy - west
            a, b = np.int32(x), np.int32(y)
            node[m], f[m], g[m] = tile + np.uint32(a * NODES + b), np.float32(x - a), np.float32(y - b)
        k = end
    for m in range(0, stop - first, 2):
        prefetch(heightmap.heights, np.uint64(node_offset[m]))
        prefetch(heightmap.heights, np.uint64(node_offset[m] + NORTH_NEIGHBOUR))
    return is_complete


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _interpolate_depths(
    heights: Floats, plane_depth: np.float32, cells: tuple[NDArray[np.uint32], Floats, Floats], depth: Floats
) -> None:
    """Fill the depths of the samples of a run [m] from the results of `_locate_samples`."""
    node_offset, north_fraction, east_fraction = cells
    for m in range(np.uint64(depth.size)):
        node, f, g = node_offset[m], north_fraction[m], east_fraction[m]  # unsigned: no index from the end
        south = heights[node] + g * (heights[node + EAST_NEIGHBOUR] - heights[node])
        north_node = node + NORTH_NEIGHBOUR
        north = heights[north_node] + g * (heights[north_node + EAST_NEIGHBOUR] - heights[north_node])
        depth[m] = plane_depth - (south + f * (north - south))


@njit(cache=True, nogil=True, error_model="numpy")
def _samples_on_tile(start: float, step: float, first: int) -> int:
    """Number of successive samples of a line that certainly lie on the tile of the first one, along one axis.

    Args:
        start: Start of the line, from the edge of the tile [cells].
        step: Spacing of the samples [cells].
        first: Index of that sample, which lies first + 1 steps from the start.
    """
    edge = float(CELLS) if step > 0 else 0.0
    if abs(step) < 1e-9:
        return 1
    count = max(min(math.floor((edge - start) / step) - first - 1, SAMPLES_PER_RUN), 1)
    last = start + (first + count) * step
    return count if 0 <= last < CELLS else 1


@njit(cache=True, nogil=True, error_model="numpy")
def profiles_of(
    sonar: Floats, position: Floats, slices: AzimuthSlices, distance: Floats, slice_of: Integers,
    to_sample: NDArray[np.bool_],
) -> int:  # fmt: skip
    """Fill distances of points, and the azimuth slices in which they lie.

    Args:
        sonar: North and east of the sonar [m], (2 or more,).
        position: North and east of the points [m], (n, 2 or more).
        slices: The slices.
        distance: Result, horizontal [m], (n,).
        slice_of: Result, index of the slice of each point, of merged ones the first, (n,).
        to_sample: Result, True for slices with points whose profiles are not stored, (slices,).

    Returns:
        Number of points whose profile is not stored.
    """
    heading, edges, counts, starts, merged, batch = slices
    c, s, missing, zones = math.cos(heading), math.sin(heading), 0, edges.size
    offset, turn = np.empty((2, POINTS_AT_ONCE)), np.empty(POINTS_AT_ONCE)
    for begin in range(0, distance.size, POINTS_AT_ONCE):  # loops without branches first, in vectors
        end = min(begin + POINTS_AT_ONCE, distance.size)
        points, reach, slice_number = position[begin:end], distance[begin:end], slice_of[begin:end]
        for n in range(np.uint64(end - begin)):
            offset[0, n], offset[1, n] = points[n, 0] - sonar[0], points[n, 1] - sonar[1]
        for n in range(np.uint64(end - begin)):
            north, east = offset[0, n], offset[1, n]
            reach[n] = math.sqrt(north * north + east * east)
            turn[n] = bearing_in_turns(north * c + east * s, east * c - north * s)
        for n in range(np.uint64(end - begin)):
            zone = zones - 1
            while zone > 0 and reach[n] <= edges[np.uint64(zone - 1)]:
                zone -= 1
            index = starts[np.uint64(zone)] + min(int(turn[n] * counts[np.uint64(zone)]), counts[np.uint64(zone)] - 1)
            power = merged[np.uint64(index >> MERGE_BLOCK_LOG2)]
            index = (index >> power) << power
            slice_number[n] = index
            if batch[np.uint64(index)] < 0:
                to_sample[np.uint64(index)] = True
                missing += 1
    return missing


@njit(cache=True, nogil=True, error_model="numpy")
def bearing_in_turns(x: float, y: float) -> float:
    """Bearing of a direction from the first axis to the second, in turns, 0 to 1, to 4e-9.

    Source: Abramowitz & Stegun (1964), Handbook of Mathematical Functions, 4.4.49 (not verified; error measured).
    """
    x_size, y_size = abs(x), abs(y)
    q = min(x_size, y_size) / max(x_size, y_size, 1e-300)
    z = q * q
    a = 0.0429096138 + z * (-0.0161657367 + z * 0.0028662257)
    a = -0.1420889944 + z * (0.1065626393 + z * (-0.0752896400 + z * a))
    a = q * (1 + z * (-0.3333314528 + z * (0.1999355085 + z * a))) * (0.5 / math.pi)
    a = 0.25 - a if y_size > x_size else a
    a = 0.5 - a if x < 0 else a
    return 1 - a if y < 0 else a


@njit(cache=True, nogil=True, error_model="numpy")
def profile_bearings(
    slices: Integers, zone: int, counts: Integers, starts: Integers, merged: NDArray[np.uint8], bearing: Floats,
    direction: Floats,
) -> None:  # fmt: skip
    """Fill bearings of the middles of some slices of one zone, and of the wider slices of nearer zones they lie in.

    Args:
        slices: Indices of the slices, of merged ones the first, (s,).
        zone: Index of their zone.
        counts: See `AzimuthSlices`.
        starts: See `AzimuthSlices`.
        merged: See `AzimuthSlices`.
        bearing: Result, bearings re the heading of the slices [rad], (s, zone + 1).
        direction: Result, cosine and sine of these [1], (s, zone + 1, 2).
    """
    for n in range(slices.size):
        index, own_middle = slices[n] - starts[zone], 0.0
        for k in range(zone, -1, -1):
            power = merged[(starts[k] + index) >> MERGE_BLOCK_LOG2]
            middle = ((index >> power) << power) + (1 << power) / 2
            bearing[n, k] = middle * (2 * math.pi / counts[k])
            direction[n, k, 0], direction[n, k, 1] = math.cos(bearing[n, k]), math.sin(bearing[n, k])
            # the slice's own middle throughout: that of merged slices is the border of two wider ones
            own_middle = middle if k == zone else own_middle
            index = int(own_middle * counts[k - 1] / counts[zone]) if k > 0 else index


@njit(cache=True, nogil=True, error_model="numpy")
def group_by_profile(
    slice_of: Integers, batch: Rows, row: Rows, starts: Integers, points: Integers, rows: Integers
) -> None:
    """Sort points by the batch that holds the profile of their slice, otherwise in their order.

    Args:
        slice_of: Slice of each point, (n,).
        batch: Index of the batch that holds the profile of each slice, (slices,).
        row: Row of the profile in its batch, (slices,).
        starts: Result, start of each batch among `points`, and n, (batches + 1,).
        points: Result, indices of the points by batch, (n,).
        rows: Result, row of the profile of each of these, (n,).
    """
    starts[:] = 0
    for n in range(slice_of.size):
        starts[batch[slice_of[n]] + 1] += 1
    for number in range(starts.size - 1):
        starts[number + 1] += starts[number]
    next_index = starts[:-1].copy()
    for n in range(slice_of.size):
        number = batch[slice_of[n]]
        points[next_index[number]], rows[next_index[number]] = n, row[slice_of[n]]
        next_index[number] += 1
