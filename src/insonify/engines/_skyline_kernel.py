"""Walks along the ground: how deep it is under a fan of lines, what it hides."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.scene.pages import CELLS, NODES, SHIFT, Pages

Floats = NDArray[np.floating[Any]]
Integers = NDArray[np.int64]


ONE, NEXT = np.uint32(1), np.uint32(NODES)
CLEAR, OCCLUDED, GROUND = 0, 2, -2  # the values of records.legs.Status, and of its SEABED
TOGETHER = 64
"""Samples of one line that are taken before those of the next: neighbours read the same piece of the map."""


@njit(cache=True, nogil=True, error_model="numpy")
def sample(
    here: NDArray[np.float64], rays: NDArray[np.float64], step: float, first: int, level: float, pages: Pages,
    wanted: NDArray[np.bool_], done: NDArray[np.bool_], depth: Floats,
) -> bool:  # fmt: skip
    """Depths of the ground along lines, linear between the nodes of the map; sample k lies (k + 1) steps out.

    Args:
        here: Where the lines start on the map [m], (2,).
        rays: Their directions, (s, 2).
        step: Distance of samples along a line [m].
        first: Number of the first sample; those before it are left alone.
        level: Depth of the plane from which heights are counted [m].
        pages: The map.
        wanted: Result, True for the pieces that are missing, (rows, columns) of pieces.
        done: Which stretches of `TOGETHER` samples need not be walked again, (stretches,).
        depth: Result [m], (s, stop).

    Returns:
        Whether all is done.
    """
    every, top, stop = True, np.float32(level), depth.shape[1]
    at, part = np.empty(TOGETHER, np.uint32), np.empty((2, TOGETHER), np.float32)
    for stretch in range(done.size):
        if done[stretch]:
            continue
        begin, there = first + stretch * TOGETHER, True
        for s in range(rays.shape[0]):
            end = min(begin + TOGETHER, stop)
            there &= _sample_line(here, rays[s], step, begin, end, top, pages, wanted, at, part, depth[s])
        done[stretch] = there
        every &= there
    return every


@njit(cache=True, nogil=True, error_model="numpy")
def _sample_line(
    here: NDArray[np.float64], ray: NDArray[np.float64], step: float, first: int, stop: int, top: np.float32,
    pages: Pages, wanted: NDArray[np.bool_], at: NDArray[np.uint32], part: Floats, depth: Floats,
) -> bool:  # fmt: skip
    """Depths along a stretch of one line; whether no piece of the map is missing. Arguments as of `sample`.

    Cells and places in them are worked out first, in vectors, into `at` and `part` of (TOGETHER,), (2, TOGETHER).
    """
    x0, y0, dx, dy = here[0] / pages.cell, here[1] / pages.cell, ray[0] * step / pages.cell, ray[1] * step / pages.cell
    flat, rows, height, width = pages.heights, pages.row_of, wanted.shape[0], wanted.shape[1]
    there, k = True, first
    while k < stop:
        i, j = math.floor(x0 + (k + 1) * dx) >> SHIFT, math.floor(y0 + (k + 1) * dy) >> SHIFT
        row, column, page = i - pages.corner_a, j - pages.corner_b, -1
        if 0 < row < height - 1 and 0 < column < width - 1:
            page = rows[row * width + column]
        else:
            row, column = 0, 0
        if page < 0:
            wanted[row, column], there = True, False
            k += 1
            continue
        piece, north, east = (
            flat[page * NODES * NODES : (page + 1) * NODES * NODES],
            float(i << SHIFT),
            float(j << SHIFT),
        )
        run = min(_samples_left(x0 - north, dx, k), _samples_left(y0 - east, dy, k), stop - k)
        for m in range(run):
            x, y = x0 + (k + m + 1) * dx - north, y0 + (k + m + 1) * dy - east
            a, b = np.int32(x), np.int32(y)
            at[m], part[0, m], part[1, m] = a * NODES + b, np.float32(x - a), np.float32(y - b)
        own = depth[k : k + run]
        for m in range(run):
            node, f, g = at[m], part[0, m], part[1, m]  # unsigned: no index from the end
            low = piece[node] + g * (piece[node + ONE] - piece[node])
            high = piece[node + NEXT] + g * (piece[node + NEXT + ONE] - piece[node + NEXT])
            own[m] = top - (low + f * (high - low))
        k += run
    return there


@njit(cache=True, nogil=True, error_model="numpy")
def _samples_left(start: float, step: float, first: int) -> int:
    """How many samples of a line, from one that lies on a piece of the map on, lie there along one axis for certain.

    Args:
        start: Where the line starts, from the edge of the piece [cells].
        step: How far apart samples are [cells].
        first: Number of the first sample: it lies one more step out.
    """
    edge = float(CELLS) if step > 0 else 0.0
    if abs(step) < 1e-9:
        return 1
    count = max(min(math.floor((edge - start) / step) - first - 1, TOGETHER), 1)
    last = start + (first + count) * step
    return count if 0 <= last < CELLS else 1


@njit(cache=True, nogil=True, error_model="numpy")
def by_sector(
    azimuth: Floats, distance: Floats, heading: float, edges: Floats, slices: Integers, together: int,
    sectors: Integers, starts: Integers, points: Integers, rows: Integers,
) -> int:  # fmt: skip
    """Points sorted by the sector of the zone that they lie in, those of one sector in their order.

    Args:
        azimuth: Bearing of each point [rad], (n,).
        distance: Horizontal distance [m], (n,).
        heading: From which bearings are counted [rad].
        edges: Outer edge of each zone, increasing [m], (zones,).
        slices: Slices of azimuth in each zone, (zones,).
        together: Slices in a sector.
        sectors: Result, zone and number of each sector met, (n, 2).
        starts: Result, where each begins among `points`; the last number is the end of all, (n + 1,).
        points: Result, points by sector, (n,).
        rows: Result, slice of each of these in its sector, (n,).

    Returns:
        Number of sectors met.
    """
    count, last, zones = 0, -1, edges.size
    own, row = np.empty(azimuth.size, np.int64), np.empty(azimuth.size, np.int64)
    held = np.zeros(azimuth.size + 1, np.int64)
    for n in range(azimuth.size):
        zone = 0
        while zone < zones - 1 and distance[n] > edges[zone]:
            zone += 1
        turn = (azimuth[n] - heading) / (2 * math.pi)
        turn -= math.floor(turn)
        piece = min(int(turn * slices[zone]), slices[zone] - 1)
        sector = piece // together
        if last < 0 or sectors[last, 0] != zone or sectors[last, 1] != sector:
            last = 0
            while last < count and not (sectors[last, 0] == zone and sectors[last, 1] == sector):
                last += 1
            if last == count:
                sectors[last, 0], sectors[last, 1] = zone, sector
                count += 1
        own[n], row[n] = last, piece % together
        held[last] += 1
    starts[0] = 0
    for k in range(count):
        starts[k + 1] = starts[k] + held[k]
        held[k] = starts[k]
    for n in range(azimuth.size):
        at = held[own[n]]
        points[at], rows[at] = n, row[n]
        held[own[n]] += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def skyline_at(lowest: Floats, rows: Integers, reach: Floats, points: Integers, found: Floats) -> None:
    """The skyline of some points at a distance, infinite before the first sample.

    Args:
        lowest: Of `_crest_kernel.find_crests`, (s, n).
        rows: Line of each point, (points,).
        reach: Distance in steps of each point, (all,).
        points: Which points, (points,).
        found: Result, (all,).
    """
    last = lowest.shape[1] - 1
    for m in range(points.size):
        n = points[m]
        k = min(math.floor(reach[n]) - 1, last)
        found[n] = lowest[rows[m], k] if k >= 0 else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def steeper_than_ground(
    launch: Floats, highest: Floats, steepness: Floats, rows: Integers, start: Floats, stop: Floats, points: Integers,
    lit: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Whether rays that rise from a bounce stay above the ground, from one distance to another.

    Args:
        launch: Launch that would meet the ground at each sample, (s, n).
        highest: Largest from each sample on, (s, n): most rays pass above all that follows, and need no walk.
        steepness: Of the rays, (all,).
        rows: Line of each point, (points,).
        start: Distance in steps from which the ray is looked at, (all,).
        stop: Distance at which it ends, (all,).
        points: Which points, (points,).
        lit: Result, (all,).
    """
    for m in range(points.size):
        n, s = points[m], rows[m]
        first, end = max(math.ceil(start[n]) - 1, 0), min(math.floor(stop[n]), launch.shape[1])
        if first >= end or highest[s, first] <= steepness[n]:
            continue
        for k in range(first, end):
            if launch[s, k] > steepness[n]:
                lit[n] = False
                break


@njit(cache=True, nogil=True, error_model="numpy")
def hide(lit: NDArray[np.bool_], status: NDArray[Any], occluder: NDArray[Any]) -> None:
    """Mark the legs that the ground cuts: those that are there but not lit.

    Args:
        lit: Whether the ground lets each pass, (f, n).
        status: Changed from clear to cut, (f, n).
        occluder: Changed to the ground where that happens, (f, n).
    """
    for f in range(lit.shape[0]):
        for n in range(lit.shape[1]):
            if not lit[f, n] and status[f, n] == CLEAR:
                status[f, n], occluder[f, n] = OCCLUDED, GROUND


@njit(cache=True, nogil=True, error_model="numpy")
def as_they_were(status: NDArray[Any], visibility: NDArray[Any], left: NDArray[np.complex128]) -> None:
    """Put the visibility of legs that are not there, nor cut, into `left`; all are of shape (f, n)."""
    for f in range(left.shape[0]):
        for n in range(left.shape[1]):
            if status[f, n] != CLEAR and status[f, n] != OCCLUDED:
                left[f, n] = visibility[f, n]


@njit(cache=True, nogil=True, error_model="numpy")
def clear_of_ground(
    ways: Floats, depth: Floats, rows: Integers, reach: Floats, ends: Floats, spare: Floats, touch: float, ground: bool
) -> NDArray[np.bool_]:
    """Whether rays, given by their depths, stay above the ground of a line until they end.

    Args:
        ways: Depths of the rays at the samples [m], (n, samples).
        depth: Depth of the ground there [m], (lines, samples).
        rows: Line of each ray, (n,).
        reach: Where it ends, in steps, (n,).
        ends: Depth at which it ends [m], (n,).
        spare: Depth below which it is not asked [m], (n,).
        touch: How far it may dip into the ground [m].
        ground: Whether it is to end on the ground of its line, and leans to it from end to end.

    Returns:
        True where a ray is clear, (n,).
    """
    clear = np.ones(rows.size, np.bool_)
    for n in range(rows.size):
        line = depth[rows[n]]
        last = min(math.floor(reach[n]) - 1, ways.shape[1] - 1)
        lean = 0.0
        if ground and last >= 0 and last + 1 < line.size:
            part = min(reach[n] - (last + 1), 1.0)
            lean = line[last] + part * (line[last + 1] - line[last]) - ends[n]
        for k in range(last + 1):
            way = ways[n, k] + lean * (k + 1) / reach[n]
            if way > line[k] + touch and way <= spare[n]:
                clear[n] = False
                break
    return clear


@njit(cache=True, nogil=True, error_model="numpy")
def clear_along(
    depth: Floats, shallowest: Floats, step: float, rows: Integers, points: Integers, nodes: Floats, spared: Floats,
    ground: bool, touch: float, lit: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Whether ways of straight segments stay above the ground of a line; only what is below its highest is walked.

    Args:
        depth: Depth of the ground at the samples [m], (lines, samples).
        shallowest: Least of each line [m], (lines,).
        step: Distance of the samples [m].
        rows: Line of each point, (points,).
        points: Which points, (points,).
        nodes: Distance and depth of the ends of all segments [m], (segments + 1, all, 2).
        spared: Distance about each of them within which the ground is not asked [m], (segments + 1, all).
        ground: Whether the ways end on the ground of their line.
        touch: How far they may dip into the ground [m].
        lit: Result, False is written where a way is cut, (all,).
    """
    for m in range(points.size):
        n, line, top = points[m], depth[rows[m]], shallowest[rows[m]]
        for k in range(nodes.shape[0] - 1):
            here, z = nodes[k, n, 0], nodes[k, n, 1]
            there, end = nodes[k + 1, n, 0], nodes[k + 1, n, 1]
            if ground and k == nodes.shape[0] - 2:
                sample = min(max(math.floor(there / step) - 1, 0), line.size - 2)
                end = line[sample] + min(there / step - (sample + 1), 1.0) * (line[sample + 1] - line[sample])
            if max(z, end) <= top or there - here < 1e-9:
                continue
            slope = (end - z) / (there - here)
            first, last = here + spared[k, n], there - spared[k + 1, n]
            if slope > 0:
                first = max(first, here + (top - z) / slope)
            elif slope < 0:
                last = min(last, here + (top - z) / slope)
            for s in range(max(math.ceil(first / step) - 1, 0), min(math.floor(last / step), line.size)):
                if z + slope * ((s + 1) * step - here) > line[s] + touch:
                    lit[n] = False
                    break
