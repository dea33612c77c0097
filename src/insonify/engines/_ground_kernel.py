"""The ground along lines, read off its map, and the pieces of the map that this takes. Numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

CELLS = 64
"""Cells along a piece of the map."""
AROUND = 512
NODE_ROW = 3 * (CELLS + 1)
_NONE, _FIRST, _SECOND, _EAST, _NORTH, _BOTH = (np.uint32(n) for n in (0, 1, 2, 3, NODE_ROW, NODE_ROW + 3))


@njit(cache=True, nogil=True, error_model="numpy")
def pieces_on_lines(
    along: float, across: float, lines: Floats, step: float, cell: float, mark: Integers, found: Integers
) -> int:
    """Numbers of the pieces of the map that some lines cross.

    Args:
        along: Where the lines start, in the frame of the map [m].
        across: Likewise [m].
        lines: As of `walk`.
        step: Distance of samples [m].
        cell: Side of a cell of the map [m].
        mark: Scratch, zeros on entry, (AROUND, AROUND).
        found: Result, (most, 2).

    Returns:
        How many there are, `most` at the most.
    """
    count = 0
    for s in range(lines.shape[0]):
        own = step * lines[s, 8]
        stop = max(math.ceil(lines[s, 5] / own - lines[s, 6]), 0)
        at = lines[s, 6] * own
        last, side = (stop + lines[s, 6]) * own, cell * CELLS
        da, db = lines[s, 0] / side, lines[s, 1] / side
        while stop > 0:
            x, y = along / side + at * da, across / side + at * db
            a, b = math.floor(x), math.floor(y)
            if mark[a & (AROUND - 1), b & (AROUND - 1)] == 0:
                mark[a & (AROUND - 1), b & (AROUND - 1)] = 1
                found[count, 0], found[count, 1] = a, b
                count += 1
                if count == found.shape[0]:
                    return count
            if at >= last:
                break
            # on to the next border, and a millionth of a step beyond
            to_a = (a + (da > 0) - x) / da if da != 0 else np.inf
            to_b = (b + (db > 0) - y) / db if db != 0 else np.inf
            at = min(at + max(min(to_a, to_b), 0.0) + 1e-6 * step, last)
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def look_up(
    along: float, across: float, line: Floats, step: float, count: int, cell: float, slot: Integers,
    pieces: Singles, flat: bool, height: Singles, slope: Singles,
) -> None:  # fmt: skip
    """Ground along one line: heights linear between nodes, slopes of the nearest node, so that none gets gentler.

    Args:
        along: As of `walk`.
        across: As of `walk`.
        line: One row of `lines`, (8,).
        step: As of `walk`.
        count: Samples wanted.
        cell: As of `walk`.
        slot: As of `walk`.
        pieces: As of `walk`.
        flat: As of `walk`.
        height: Result [m], (at least count,).
        slope: Result, along the frame's axes [1], (2, at least count).
    """
    if flat:
        height[:count] = 0
        slope[:, :count] = 0
        return
    start_a, start_b = along / cell, across / cell
    step_a, step_b = line[0] * step / cell, line[1] * step / cell
    k = 0
    while k < count:
        # all samples up to the border of a piece
        x, y = start_a + (k + line[6]) * step_a, start_b + (k + line[6]) * step_b
        a, b = math.floor(x) >> 6, math.floor(y) >> 6
        x, y = x - a * CELLS, y - b * CELLS
        more = min(steps_within(x, step_a), steps_within(y, step_b), count - k)
        stop = k + max(more, 1)
        piece = pieces[slot[a & (AROUND - 1), b & (AROUND - 1)]].ravel()
        read(piece, x, y, step_a, step_b, height[k:stop], slope[0, k:stop], slope[1, k:stop])
        k = stop


@njit(inline="always")
def steps_within(place: float, step: float) -> int:
    """Steps from a place in a piece, in cells, until it is left."""
    if step == 0:
        return 1 << 60
    return math.ceil((CELLS - place) / step if step > 0 else place / -step)


@njit(cache=True, nogil=True, error_model="numpy")
def read(
    piece: Singles, x: float, y: float, step_x: float, step_y: float, height: Singles, slope_x: Singles,
    slope_y: Singles,
) -> None:  # fmt: skip
    """Ground at even steps within one piece.

    Args:
        piece: Height [m] and slopes [1] on its nodes, node after node, (65 * 65 * 3,).
        x: Place of the first sample along the piece's first axis [cells].
        y: Along its second.
        step_x: From sample to sample [cells].
        step_y: Likewise.
        height: Result [m], (n,).
        slope_x: Result [1], (n,).
        slope_y: Result [1], (n,).
    """
    top, half = np.int32(CELLS - 1), np.float32(0.5)
    for k in range(height.size):
        u, v = x + k * step_x, y + k * step_y
        # rounding may put the first or the last a hair outside
        i, j = min(max(np.int32(u), np.int32(0)), top), min(max(np.int32(v), np.int32(0)), top)
        f, g = np.float32(u - i), np.float32(v - j)
        at = np.uint32(i * np.int32(NODE_ROW) + j * np.int32(3))
        one, two, three, four = piece[at], piece[at + _EAST], piece[at + _NORTH], piece[at + _BOTH]
        low, high = one + g * (two - one), three + g * (four - three)
        height[k] = low + f * (high - low)
        near = at + (_NORTH if f >= half else _NONE) + (_EAST if g >= half else _NONE)
        slope_x[k], slope_y[k] = piece[near + _FIRST], piece[near + _SECOND]
