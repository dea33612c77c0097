"""Smooth noise on an endless lattice: every node has a keyed number, and nothing is stored.

A band of relief is a sum of cubic B-splines, one on each node of a square lattice. The numbers
on the nodes come from their counters, so any point can be evaluated at any time. Points that
follow one another share nodes where they can, which changes the time and not one bit.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.random_keys import philox_at
from insonify.scene.terrain._simd_stencils import POINTS, splines

Floats = NDArray[np.float64]

_OUTSIDE = 1 << 50
_WIDEST = 1024  # groups of four nodes in a window that only some points share: 32 kB
_LARGEST = 1 << 16  # in one that all share
_CHUNK = 256  # points that are evaluated together


class LatticeBand(NamedTuple):
    """One band of lattice noise."""

    pitch: float
    """Distance of nodes [m]."""
    turn: float
    """Heading of the lattice [rad]."""
    offset_a: float
    """Shift along its first axis [pitches]."""
    offset_b: float
    """Shift along its second axis [pitches]."""
    amplitude: float
    """Height of a node's unit [m]."""


class LatticeKey(NamedTuple):
    """Key of the random numbers of a band's nodes."""

    octave: int
    layer: int
    k0: int
    k1: int


@njit(cache=True, nogil=True, error_model="numpy")
def normal(word: np.uint32, quantiles: Floats) -> float:
    """A random word as a normal number [1], by linear interpolation in a table of quantiles."""
    index = np.float64(word) * (quantiles.size - 1) * 2.0**-32
    row = int(index)
    return quantiles[row] + (index - row) * (quantiles[row + 1] - quantiles[row])


@njit(cache=True, nogil=True, error_model="numpy")
def _fill(row, group, key, quantiles, words, node):  # type: ignore[no-untyped-def]
    """Numbers of groups of four neighbouring nodes, one after the other; node j belongs to group (j + 1) // 4."""
    philox_at(row, group, key.octave, key.layer, key.k0, key.k1, words)
    for n in range(row.size):
        for lane in range(4):
            node[4 * n + lane] = normal(words[lane, n], quantiles)


@njit(cache=True, nogil=True, error_model="numpy")
def _together(x, y, first, most, frame):  # type: ignore[no-untyped-def]
    """Consecutive points from the first on that share a window of groups of nodes: end of the points, and the window.

    Returns:
        Row after the last of them; first cell row, first group, rows and groups of the nodes that they reach; 0 rows
        where that are more nodes than would be drawn for each point alone.
    """
    c, s, per_pitch, offset_a, offset_b = frame
    first_i = first_j = _OUTSIDE
    last_i = last_j = -_OUTSIDE
    rows = groups = 0
    end = first
    while end < x.size:
        a, b = (c * x[end] + s * y[end]) * per_pitch + offset_a, (c * y[end] - s * x[end]) * per_pitch + offset_b
        if not (abs(a) < _OUTSIDE and abs(b) < _OUTSIDE):  # far outside: no node shares anything with it
            end += end == first
            break
        i, j = math.floor(a), math.floor(b)
        if i < first_i or i > last_i or j < first_j or j > last_j:
            low_i, high_i, low_j, high_j = min(first_i, i), max(last_i, i), min(first_j, j), max(last_j, j)
            tall, wide = high_i - low_i + 4, ((high_j + 3) >> 2) - (low_j >> 2) + 1
            if end > first and (tall > most or wide > most or tall * wide > most):
                break
            first_i, last_i, first_j, last_j, rows, groups = low_i, high_i, low_j, high_j, tall, wide
        end += 1
    if rows * groups > 6 * (end - first):  # a point alone draws some six groups
        rows = 0
    return end, first_i, first_j >> 2, rows, groups


@njit(cache=True, nogil=True, error_model="numpy")
def _window(first_i, first_group, rows, groups, row, group):  # type: ignore[no-untyped-def]
    """Names of the groups of a window, row by row; returns their number."""
    for n in range(rows * groups):
        row[n], group[n] = first_i - 1 + n // groups, first_group + n % groups
    return rows * groups


@njit(cache=True, nogil=True, error_model="numpy")
def _cells(x, y, first, end, frame, row, group):  # type: ignore[no-untyped-def]
    """Names of the groups around the cell of each of some points, two to a row; returns their number."""
    c, s, per_pitch, offset_a, offset_b = frame
    for n in range(first, end):
        i = math.floor((c * x[n] + s * y[n]) * per_pitch + offset_a)
        j = math.floor((c * y[n] - s * x[n]) * per_pitch + offset_b)
        for k in range(8):
            row[8 * (n - first) + k], group[8 * (n - first) + k] = i - 1 + (k >> 1), (j >> 2) + (k & 1)
    return 8 * (end - first)


@njit(cache=True, nogil=True, error_model="numpy")
def add_band(x: Floats, y: Floats, band: LatticeBand, key: LatticeKey, quantiles: Floats, out: Floats) -> None:
    """Add one band's height and its slopes along x and y at points x, y, into out of shape (n, 3).

    Points close together that follow one another share a window of nodes; others have 16 nodes of their own.
    """
    c, s, amplitude = math.cos(band.turn), math.sin(band.turn), band.amplitude
    per_pitch, steep = 1.0 / band.pitch, amplitude / band.pitch
    offset_a, offset_b = band.offset_a, band.offset_b
    frame = c, s, per_pitch, offset_a, offset_b
    most, end = _WIDEST, 0
    if _together(x, y, 0, most, frame)[3] == 0:
        last, _, _, rows, groups = _together(x, y, 0, min(6 * x.size, _LARGEST), frame)
        if last == x.size and rows > 0:  # in no order, but close to one another
            most = max(most, rows * groups)
    row, group = np.empty(most, np.int64), np.empty(most, np.int64)
    words, node = np.empty((4, most), np.uint32), np.empty(4 * most)
    at, f, g = np.zeros(_CHUNK, np.int64), np.zeros(_CHUNK), np.zeros(_CHUNK)
    splined = np.empty(3 * _CHUNK)
    while end < x.size:
        first = end
        end, first_i, first_group, rows, groups = _together(x, y, first, most, frame)
        if rows > 0:
            count, stride = _window(first_i, first_group, rows, groups, row, group), 4 * groups
        else:
            end = min(end, first + most // 8)
            count, stride = _cells(x, y, first, end, frame, row, group), 8
        _fill(row[:count], group[:count], key, quantiles, words, node)
        for begin in range(first, end, _CHUNK):
            size = min(end - begin, _CHUNK)
            for k in range(size):
                n = begin + k
                a = (c * x[n] + s * y[n]) * per_pitch + offset_a
                b = (c * y[n] - s * x[n]) * per_pitch + offset_b
                i, j = math.floor(a), math.floor(b)
                at[k] = (i - first_i) * stride + j - 4 * first_group if rows > 0 else 32 * (n - first) + (j & 3)
                f[k], g[k] = a - i, b - j
            for k in range(0, size, POINTS):  # the last with what others left there: all points have the same bits
                splines(node, stride, at, f, g, k, splined, _CHUNK)
            for k in range(size):
                along, across = splined[_CHUNK + k], splined[2 * _CHUNK + k]
                out[begin + k, 0] += amplitude * splined[k]
                out[begin + k, 1] += steep * (c * along - s * across)
                out[begin + k, 2] += steep * (s * along + c * across)
