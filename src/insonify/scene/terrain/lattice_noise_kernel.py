"""Smooth noise on an unbounded lattice: every node has a keyed random number, and nothing is stored.

A band of relief is a sum of cubic B-splines, one on each node of a square lattice. The numbers on the nodes follow from
their counters, so any point can be evaluated at any time. Nodes of consecutive points are evaluated once if they
coincide, which changes the time but no bit of the result.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.random_keys import philox_at
from insonify.scene.terrain._simd_stencils import POINTS, splines

Floats = NDArray[np.float64]

_OUTSIDE = 1 << 50  # largest magnitude of a node number
_MAX_GROUPS = 1024  # groups of four nodes in a window of some of the points: 32 kB
_MAX_COMMON_GROUPS = 1 << 16  # groups of four nodes in a window of all points
_CHUNK = 256  # points that are evaluated together


class LatticeBand(NamedTuple):
    """One band of lattice noise."""

    pitch: float
    """Spacing of the nodes [m]."""
    turn: float
    """Rotation of the lattice [rad]."""
    offset_a: float
    """Shift along its first axis [pitches]."""
    offset_b: float
    """Shift along its second axis [pitches]."""
    amplitude: float
    """Height per unit of a node's number [m]."""


class LatticeKey(NamedTuple):
    """Key of the random numbers of a band's nodes."""

    octave: int
    """Number of the octave."""
    layer: int
    """Random stream of the relief."""
    k0: int
    """First word of the key."""
    k1: int
    """Second word of the key."""


@njit(cache=True, nogil=True, error_model="numpy")
def normal(word: np.uint32, quantiles: Floats) -> float:
    """A random word as a normal number [1], by linear interpolation in a table of quantiles."""
    index = np.float64(word) * (quantiles.size - 1) * 2.0**-32
    row = int(index)
    return quantiles[row] + (index - row) * (quantiles[row + 1] - quantiles[row])


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_nodes(row, group, key, quantiles, words, node):  # type: ignore[no-untyped-def]
    """Fill the random numbers of groups of four consecutive nodes of a row."""
    philox_at(row, group, key.octave, key.layer, key.k0, key.k1, words)
    for n in range(row.size):
        for lane in range(4):
            node[4 * n + lane] = normal(words[lane, n], quantiles)


@njit(cache=True, nogil=True, error_model="numpy")
def _shared_window(x, y, first, max_groups, frame):  # type: ignore[no-untyped-def]
    """Consecutive points, from the first on, whose nodes lie in one window of at most `max_groups` groups.

    Returns:
        Row after the last of these points; first cell row, first group, and numbers of rows and groups of the window;
        0 rows if the window has more nodes than the points need one by one.
    """
    c, s, per_pitch, offset_a, offset_b = frame
    first_i = first_j = _OUTSIDE
    last_i = last_j = -_OUTSIDE
    rows = groups = 0
    end = first
    while end < x.size:
        a, b = (c * x[end] + s * y[end]) * per_pitch + offset_a, (c * y[end] - s * x[end]) * per_pitch + offset_b
        if not (abs(a) < _OUTSIDE and abs(b) < _OUTSIDE):  # too far for a window
            end += end == first
            break
        i, j = math.floor(a), math.floor(b)
        if i < first_i or i > last_i or j < first_j or j > last_j:
            low_i, high_i, low_j, high_j = min(first_i, i), max(last_i, i), min(first_j, j), max(last_j, j)
            new_rows, new_groups = high_i - low_i + 4, ((high_j + 3) >> 2) - (low_j >> 2) + 1
            if end > first and (new_rows > max_groups or new_groups > max_groups or new_rows * new_groups > max_groups):
                break
            first_i, last_i, first_j, last_j, rows, groups = low_i, high_i, low_j, high_j, new_rows, new_groups
        end += 1
    if rows * groups > 6 * (end - first):  # a single point needs about six groups
        rows = 0
    return end, first_i, first_j >> 2, rows, groups


@njit(cache=True, nogil=True, error_model="numpy")
def _common_window(x, y, max_groups, frame):  # type: ignore[no-untyped-def]
    """Window of all points, as `_shared_window` returns it, in one vectorised pass; none, of 0 points, if too large."""
    c, s, per_pitch, offset_a, offset_b = frame
    first_i = first_j = _OUTSIDE
    last_i = last_j = -_OUTSIDE
    outside = 0
    for n in range(x.size):
        a, b = (c * x[n] + s * y[n]) * per_pitch + offset_a, (c * y[n] - s * x[n]) * per_pitch + offset_b
        outside += not (abs(a) < _OUTSIDE and abs(b) < _OUTSIDE)
        i, j = math.floor(a), math.floor(b)
        first_i, last_i, first_j, last_j = min(first_i, i), max(last_i, i), min(first_j, j), max(last_j, j)
    rows, groups = last_i - first_i + 4, ((last_j + 3) >> 2) - (first_j >> 2) + 1
    if outside > 0 or rows > max_groups or groups > max_groups or rows * groups > max_groups:
        return 0, first_i, first_j >> 2, 0, 0
    return x.size, first_i, first_j >> 2, rows if rows * groups <= 6 * x.size else 0, groups


@njit(cache=True, nogil=True, error_model="numpy")
def _window_groups(first_i, first_group, rows, groups, row, group):  # type: ignore[no-untyped-def]
    """Fill row and group numbers of a window, row by row; return the number of groups."""
    for n in range(rows * groups):
        row[n], group[n] = first_i - 1 + n // groups, first_group + n % groups
    return rows * groups


@njit(cache=True, nogil=True, error_model="numpy")
def _cell_groups(x, y, first, end, frame, row, group):  # type: ignore[no-untyped-def]
    """Fill row and group numbers around the cell of each point, two in each row; return the number of groups."""
    c, s, per_pitch, offset_a, offset_b = frame
    for n in range(first, end):
        i = math.floor((c * x[n] + s * y[n]) * per_pitch + offset_a)
        j = math.floor((c * y[n] - s * x[n]) * per_pitch + offset_b)
        for k in range(8):
            row[8 * (n - first) + k], group[8 * (n - first) + k] = i - 1 + (k >> 1), (j >> 2) + (k & 1)
    return 8 * (end - first)


@njit(cache=True, nogil=True, error_model="numpy")
def add_band(x: Floats, y: Floats, band: LatticeBand, key: LatticeKey, quantiles: Floats, out: Floats) -> None:
    """Add one band's height and its slopes along both axes.

    Points close together that follow one another share a window of nodes; others have 16 nodes of their own.

    Args:
        x: Positions along the first axis [m], (n,).
        y: Positions along the second axis [m], (n,).
        band: The band.
        key: Key of its random numbers.
        quantiles: Table of `normal`.
        out: Changed: height [m] and both slopes [1], (n, 3).
    """
    c, s, amplitude = math.cos(band.turn), math.sin(band.turn), band.amplitude
    per_pitch, slope_amplitude = 1.0 / band.pitch, amplitude / band.pitch
    offset_a, offset_b = band.offset_a, band.offset_b
    frame = c, s, per_pitch, offset_a, offset_b
    max_groups, end = _MAX_GROUPS, 0
    window = _common_window(x, y, max_groups, frame)
    if window[0] == 0:
        window = _shared_window(x, y, 0, max_groups, frame)
    if window[3] == 0:
        common = _shared_window(x, y, 0, min(6 * x.size, _MAX_COMMON_GROUPS), frame)
        if common[0] == x.size and common[3] > 0:  # not in sequence, but all in one window
            max_groups, window = max(max_groups, common[3] * common[4]), common
    row, group = np.empty(max_groups, np.int64), np.empty(max_groups, np.int64)
    words, node = np.empty((4, max_groups), np.uint32), np.empty(4 * max_groups)
    first_node, f, g = np.zeros(_CHUNK, np.int64), np.zeros(_CHUNK), np.zeros(_CHUNK)
    spline_values = np.empty(3 * _CHUNK)
    while end < x.size:
        first = end
        if first > 0:
            window = _shared_window(x, y, first, max_groups, frame)
        end, first_i, first_group, rows, groups = window
        if rows > 0:
            count, stride = _window_groups(first_i, first_group, rows, groups, row, group), 4 * groups
        else:
            end = min(end, first + max_groups // 8)
            count, stride = _cell_groups(x, y, first, end, frame, row, group), 8
        _fill_nodes(row[:count], group[:count], key, quantiles, words, node)
        for begin in range(first, end, _CHUNK):
            size = min(end - begin, _CHUNK)
            chunk_x, chunk_y = x[begin : begin + size], y[begin : begin + size]
            for k in range(size):
                a = (c * chunk_x[k] + s * chunk_y[k]) * per_pitch + offset_a
                b = (c * chunk_y[k] - s * chunk_x[k]) * per_pitch + offset_b
                i, j = math.floor(a), math.floor(b)
                first_node[k] = (i - first_i) * stride + j - 4 * first_group if rows > 0 else 32 * k + (j & 3)
                f[k], g[k] = a - i, b - j
            if rows == 0:
                for k in range(size):  # an array expression would take 2 s to compile
                    first_node[k] += 32 * (begin - first)
            for k in range(0, size, POINTS):  # the last vector includes stale values, which are not used
                splines(node, stride, first_node, f, g, k, spline_values, _CHUNK)
            rows_out = out[begin : begin + size]
            for k in range(size):
                along, across = spline_values[_CHUNK + k], spline_values[2 * _CHUNK + k]
                rows_out[k, 0] += amplitude * spline_values[k]
                rows_out[k, 1] += slope_amplitude * (c * along - s * across)
                rows_out[k, 2] += slope_amplitude * (s * along + c * across)


@njit(cache=True, nogil=True, error_model="numpy")
def add_bands(x: Floats, y: Floats, bands: Floats, keys: NDArray[np.int64], quantiles: Floats, out: Floats) -> None:
    """Add several bands, see `add_band`.

    Args:
        x: Positions along the first axis [m], (n,).
        y: Positions along the second axis [m], (n,).
        bands: Columns of `LatticeBand`, (any, 5).
        keys: Columns of `LatticeKey`, (any, 4).
        quantiles: Table of `normal`.
        out: Changed: height [m] and both slopes [1], (n, 3).
    """
    for row in range(len(bands)):
        band = LatticeBand(bands[row, 0], bands[row, 1], bands[row, 2], bands[row, 3], bands[row, 4])
        key = LatticeKey(keys[row, 0], keys[row, 1], keys[row, 2], keys[row, 3])
        add_band(x, y, band, key, quantiles, out)
