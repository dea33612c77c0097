"""Smooth noise on an endless lattice: every node has a keyed number, and nothing is stored.

A band of relief is a sum of cubic B-splines, one on each node of a square lattice. The numbers
on the nodes come from their counters, so any point can be evaluated at any time. Nodes met
again and again are kept in a small cache of blocks, which changes the time and not one bit.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.streams import philox

Floats = NDArray[np.float64]

BLOCK = 16
"""Cells along the side of a cached block."""
_ROWS, _COLUMNS = BLOCK + 3, BLOCK + 4  # nodes that the cells of a block reach, columns in whole groups of four
_SIZE = _ROWS * _COLUMNS
_SLOTS = 256
_NOBODY = 1 << 60
_WIDEST = 1 << 20  # cells across a window of nodes
_ONE, _TWO, _THREE = np.uint64(1), np.uint64(2), np.uint64(3)


@njit(cache=True, nogil=True, error_model="numpy")
def normal(word: np.uint32, quantiles: Floats) -> float:
    """A random word as a normal number [1], by linear interpolation in a table of quantiles."""
    place = np.float64(word) * (quantiles.size - 1) * 2.0**-32
    row = int(place)
    return quantiles[row] + (place - row) * (quantiles[row + 1] - quantiles[row])


@njit(cache=True, nogil=True, error_model="numpy")
def _group(row, group, level, layer, k0, k1, quantiles, out, at):  # type: ignore[no-untyped-def]
    """Numbers of four neighbouring nodes, into out[at : at + 4]; node j belongs to group (j + 1) // 4."""
    w0, w1, w2, w3 = philox(row, group, level, layer, k0, k1)
    out[at] = normal(w0, quantiles)
    out[at + 1] = normal(w1, quantiles)
    out[at + 2] = normal(w2, quantiles)
    out[at + 3] = normal(w3, quantiles)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_block(block_i, block_j, level, layer, k0, k1, quantiles, out, at):  # type: ignore[no-untyped-def]
    """Numbers of all nodes that the cells of a block reach, row by row."""
    for row in range(_ROWS):
        for group in range(_COLUMNS // 4):
            _group(
                block_i * BLOCK - 1 + row, block_j * (BLOCK // 4) + group, level, layer, k0, k1, quantiles,
                out, at + row * _COLUMNS + 4 * group,
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_cell(i, j, level, layer, k0, k1, quantiles, out, at):  # type: ignore[no-untyped-def]
    """Numbers of the 4 x 4 nodes around one cell, in rows of eight; returns where the first of them is."""
    first = j >> 2  # of node j - 1
    for row in range(4):
        for part in range(((j + 3) >> 2) - first + 1):
            _group(i - 1 + row, first + part, level, layer, k0, k1, quantiles, out, at + 8 * row + 4 * part)
    return at + j - 4 * first


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _stencil(node, at, stride, f, g):  # type: ignore[no-untyped-def]
    """Value and both slopes per pitch of the spline at fractions f and g of its cell."""
    b0, b1, b2, b3 = _weights(g)
    e0, e1, e2, e3 = _slopes(g)
    h0, s0 = _row(node, at, b0, b1, b2, b3, e0, e1, e2, e3)
    h1, s1 = _row(node, at + stride, b0, b1, b2, b3, e0, e1, e2, e3)
    h2, s2 = _row(node, at + stride + stride, b0, b1, b2, b3, e0, e1, e2, e3)
    h3, s3 = _row(node, at + stride + stride + stride, b0, b1, b2, b3, e0, e1, e2, e3)
    a0, a1, a2, a3 = _weights(f)
    d0, d1, d2, d3 = _slopes(f)
    value = (a0 * h0 + a1 * h1) + (a2 * h2 + a3 * h3)
    along = (d0 * h0 + d1 * h1) + (d2 * h2 + d3 * h3)
    return value, along, (a0 * s0 + a1 * s1) + (a2 * s2 + a3 * s3)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _row(node, at, b0, b1, b2, b3, e0, e1, e2, e3):  # type: ignore[no-untyped-def]
    """Value and slope of four neighbouring nodes, weighted along their row."""
    # Unsigned places: an index that may be negative costs a test at every load.
    g0, g1, g2, g3 = node[at], node[at + _ONE], node[at + _TWO], node[at + _THREE]
    return (b0 * g0 + b1 * g1) + (b2 * g2 + b3 * g3), (e0 * g0 + e1 * g1) + (e2 * g2 + e3 * g3)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _weights(f):  # type: ignore[no-untyped-def]
    """The four cubic B-splines that reach a cell."""
    r, sixth = 1.0 - f, 1.0 / 6.0
    rr, ff = r * r, f * f
    return sixth * rr * r, 2 / 3 - 0.5 * ff * (2.0 - f), 2 / 3 - 0.5 * rr * (2.0 - r), sixth * ff * f


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _slopes(f):  # type: ignore[no-untyped-def]
    """Their derivatives."""
    r = 1.0 - f
    return -0.5 * r * r, f * (1.5 * f - 2.0), -r * (1.5 * r - 2.0), 0.5 * f * f


@njit(cache=True, nogil=True, error_model="numpy")
def _window(x, y, c, s, per_pitch, offset_a, offset_b):  # type: ignore[no-untyped-def]
    """First cell row, first group, rows and groups of the nodes that some points reach together; 0 rows for too many.

    Too many are more nodes than would be drawn for each point alone.
    """
    first_i = first_j = _NOBODY
    last_i = last_j = -_NOBODY
    for n in range(x.size):
        i = math.floor((c * x[n] + s * y[n]) * per_pitch + offset_a)
        j = math.floor((c * y[n] - s * x[n]) * per_pitch + offset_b)
        first_i, last_i = min(first_i, i), max(last_i, i)
        first_j, last_j = min(first_j, j), max(last_j, j)
    if x.size == 0 or last_i - first_i > _WIDEST or last_j - first_j > _WIDEST:
        return 0, 0, 0, 0
    group = first_j >> 2
    rows, groups = last_i - first_i + 4, ((last_j + 3) >> 2) - group + 1
    if rows * groups > 6 * x.size:  # a point alone draws some six groups
        return 0, 0, 0, 0
    return first_i, group, rows, groups


@njit(cache=True, nogil=True, error_model="numpy")
def add_band(
    x: Floats, y: Floats, pitch: float, turn: float, offset_a: float, offset_b: float, amplitude: float,
    level: int, layer: int, k0: int, k1: int, quantiles: Floats, out: Floats,
) -> None:  # fmt: skip
    """Add one band's height and its slopes along x and y at points x, y, into out of shape (n, 3).

    Points close together share one window of nodes. Else a block of nodes is computed when it is met for the
    second time: scattered points pay for their own 16 nodes only, dense ones share.
    """
    c, s = math.cos(turn), math.sin(turn)
    per_pitch, steep = 1.0 / pitch, amplitude / pitch
    first_i, first_group, rows, groups = _window(x, y, c, s, per_pitch, offset_a, offset_b)
    slots = 0 if rows > 0 else _SLOTS
    seen, kept = np.full((slots, 2), _NOBODY), np.full((slots, 2), _NOBODY)
    node = np.empty(max(slots * _SIZE + 32, rows * groups * 4))  # the blocks, then the nodes of a lone cell
    for row in range(rows):
        for group in range(groups):
            _group(first_i - 1 + row, first_group + group, level, layer, k0, k1, quantiles, node,
                   4 * (row * groups + group))  # fmt: skip
    for n in range(x.size):
        a = (c * x[n] + s * y[n]) * per_pitch + offset_a
        b = (c * y[n] - s * x[n]) * per_pitch + offset_b
        i, j = math.floor(a), math.floor(b)
        if rows > 0:
            stride = 4 * groups
            at = (i - first_i) * stride + j - 4 * first_group
        else:
            at, stride = _cached(i, j, seen, kept, level, layer, k0, k1, quantiles, node)
        # One call for all, so that all give the same bits.
        value, along, across = _stencil(node, np.uint64(at), np.uint64(stride), a - i, b - j)
        out[n, 0] += amplitude * value
        out[n, 1] += steep * (c * along - s * across)
        out[n, 2] += steep * (s * along + c * across)


@njit(cache=True, nogil=True, error_model="numpy")
def _cached(i, j, seen, kept, level, layer, k0, k1, quantiles, node):  # type: ignore[no-untyped-def]
    """Where the nodes around one cell stand among the kept blocks, or behind them, and the length of their rows."""
    block_i, block_j = i >> 4, j >> 4
    slot = (block_i * 37 + block_j * 101) & (_SLOTS - 1)
    known = kept[slot, 0] == block_i and kept[slot, 1] == block_j
    if not known and seen[slot, 0] == block_i and seen[slot, 1] == block_j:
        _fill_block(block_i, block_j, level, layer, k0, k1, quantiles, node, slot * _SIZE)
        kept[slot, 0], kept[slot, 1] = block_i, block_j
        known = True
    if known:
        return slot * _SIZE + (i - BLOCK * block_i) * _COLUMNS + j - BLOCK * block_j, _COLUMNS
    seen[slot, 0], seen[slot, 1] = block_i, block_j
    return _fill_cell(i, j, level, layer, k0, k1, quantiles, node, _SLOTS * _SIZE), 8
