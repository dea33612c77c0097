"""Walks along the ground: which pieces of its map lie under a fan of lines, how deep it is there, what it hides."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Integers = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def mark(
    along: float, across: float, cosines: Floats, sines: Floats, step: float, first: int, stop: int, side: float,
    corner_a: int, corner_b: int, wanted: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Mark the pieces of the map that some lines cross.

    Args:
        along: First coordinate of the point from which the lines start [m].
        across: Second coordinate [m].
        cosines: Of the directions of the lines, (s,).
        sines: Likewise, (s,).
        step: Distance of samples along a line [m].
        first: Number of the first sample; sample k lies (k + 1) steps out.
        stop: Number after the last sample.
        side: Side of a piece [m].
        corner_a: Number of the first row of pieces.
        corner_b: Number of the first column.
        wanted: Result, True for the pieces crossed, (rows, columns).
    """
    for s in range(cosines.size):
        for k in range(first, stop):
            r = (k + 1) * step
            a = math.floor((along + r * cosines[s]) / side) - corner_a
            b = math.floor((across + r * sines[s]) / side) - corner_b
            wanted[a, b] = True


@njit(cache=True, nogil=True, error_model="numpy")
def sample(
    along: float, across: float, cosines: Floats, sines: Floats, step: float, first: int, stop: int, cell: float,
    corner_a: int, corner_b: int, row_of: Integers, pieces: Floats, height: Floats,
) -> None:  # fmt: skip
    """Heights along lines, linear between the nodes of the map; arguments as of `mark`.

    Args:
        along: As of `mark`.
        across: As of `mark`.
        cosines: As of `mark`.
        sines: As of `mark`.
        step: As of `mark`.
        first: As of `mark`.
        stop: As of `mark`.
        cell: Side of a cell of the map [m].
        corner_a: As of `mark`.
        corner_b: As of `mark`.
        row_of: Row of each piece in `pieces`, (rows, columns).
        pieces: Heights on the nodes [m], (pieces, cells + 1, cells + 1).
        height: Result, heights [m], (s, stop); samples before the first are left alone.
    """
    cells = pieces.shape[1] - 1
    for s in range(cosines.size):
        for k in range(first, stop):
            r = (k + 1) * step
            a, b = (along + r * cosines[s]) / cell, (across + r * sines[s]) / cell
            i, j = math.floor(a), math.floor(b)
            f, g = a - i, b - j
            big_i, big_j = i // cells, j // cells
            piece = pieces[row_of[big_i - corner_a, big_j - corner_b]]
            i -= big_i * cells
            j -= big_j * cells
            low = piece[i, j] + g * (piece[i, j + 1] - piece[i, j])
            high = piece[i + 1, j] + g * (piece[i + 1, j + 1] - piece[i + 1, j])
            height[s, k] = low + f * (high - low)


@njit(cache=True, nogil=True, error_model="numpy")
def running_minimum(launch: Floats, lowest: Floats) -> None:
    """Smallest launch up to each sample of a line: the skyline. Both (s, n)."""
    for s in range(launch.shape[0]):
        least = np.inf
        for k in range(launch.shape[1]):
            least = min(least, launch[s, k])
            lowest[s, k] = least


@njit(cache=True, nogil=True, error_model="numpy")
def maximum_ahead(launch: Floats, highest: Floats) -> None:
    """Largest launch from each sample of a line on, outwards. Both (s, n)."""
    for s in range(launch.shape[0]):
        most = -np.inf
        for k in range(launch.shape[1] - 1, -1, -1):
            most = max(most, launch[s, k])
            highest[s, k] = most


@njit(cache=True, nogil=True, error_model="numpy")
def skyline_at(lowest: Floats, rows: Integers, reach: Floats, points: Integers, found: Floats) -> None:
    """The skyline of some points at a distance, infinite before the first sample.

    Args:
        lowest: Of `running_minimum`, (s, n).
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
def ground_at(
    launch: Floats, lowest: Floats, rows: Integers, reach: Floats, points: Integers, lit: NDArray[np.bool_]
) -> None:
    """Whether the ground of a line itself is seen at a distance, linear between samples; arguments of `skyline_at`."""
    last = lowest.shape[1] - 2
    for m in range(points.size):
        n, s = points[m], rows[m]
        k = min(math.floor(reach[n]) - 1, last)
        if k >= 0:
            f = min(reach[n] - (k + 1), 1.0)
            lit[n] = launch[s, k] + f * (launch[s, k + 1] - launch[s, k]) <= lowest[s, k]


@njit(cache=True, nogil=True, error_model="numpy")
def steeper_than_ground(
    launch: Floats, highest: Floats, steepness: Floats, rows: Integers, start: Floats, stop: Floats, points: Integers,
    lit: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Whether rays that rise from a bounce stay above the ground, from one distance to another.

    Args:
        launch: Launch that would meet the ground at each sample, (s, n).
        highest: Of `maximum_ahead`, (s, n): most rays pass above all that follows, and need no walk.
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
