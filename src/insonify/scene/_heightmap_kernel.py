"""Synthesis of a heightmap tile from the coarsest octave to the finest. Plain numbers and arrays only.

Single precision: coordinates in a window of nodes are a few dozen pitches at most, so that heights have a relative
error of 1e-6.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.random_keys import philox_consecutive
from insonify.scene._simd_splines import LANES, add_spline
from insonify.scene.terrain.lattice_noise_kernel import LatticeBand, LatticeKey, add_band

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_OUTER, _INNER = np.float32(-1 / 16), np.float32(9 / 16)  # cubic through four nodes, half way between the middle two
_WINDOW_MARGIN = 1e-3  # margin of a window beyond its positions [cells]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def add_upsampled(coarse: Singles, margin: int, count: int, fine: Singles) -> None:
    """Add values given on every second node to all nodes, by cubic interpolation through four along both axes.

    Args:
        coarse: Values on every second node, from two of them before the first to two after the last, (planes, m, any).
        margin: Nodes that are filled before the first and after the last: 0 or 2.
        count: Nodes along each axis, with margins.
        fine: Result, added to, (planes, count, at least count).
    """
    first = 1 - margin // 2  # coarse node before that of the first fine one
    half = (count + 1) // 2
    doubled = np.empty((coarse.shape[1], 2 * half), np.float32)
    for plane in range(coarse.shape[0]):
        for i in range(coarse.shape[1]):
            row, target = coarse[plane, i, first:], doubled[i]
            for u in range(half):
                target[2 * u] = row[u + 1]
                target[2 * u + 1] = _OUTER * (row[u] + row[u + 3]) + _INNER * (row[u + 1] + row[u + 2])
        nodes, out = doubled.reshape(doubled.size), fine[plane].reshape(fine.shape[1] * fine.shape[2])
        for i in range(count):
            _add_row(nodes, (i // 2 + first) * doubled.shape[1], doubled.shape[1], i % 2, out, i * fine.shape[2], count)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _add_row(nodes: Singles, first: int, width: int, midway: int, out: Singles, first_out: int, count: int) -> None:
    """Add the second of four rows, or (midway) the interpolation half way to the third, to one row of nodes.

    Args:
        nodes: Rows one after another.
        first: Index of the first of the four rows.
        width: Length of a row.
        midway: 1 for the interpolation, 0 for the second row.
        out: Result, added to.
        first_out: Index of the first node in `out`.
        count: Number of nodes.
    """
    # Unsigned indices: a possibly negative index prevents vectorisation.
    a, t = np.uint64(first), np.uint64(first_out)
    b, c, d = np.uint64(first + width), np.uint64(first + 2 * width), np.uint64(first + 3 * width)
    if midway:
        for j in range(np.uint64(count)):
            out[t + j] += _OUTER * (nodes[a + j] + nodes[d + j]) + _INNER * (nodes[b + j] + nodes[c + j])
    else:
        for j in range(np.uint64(count)):
            out[t + j] += nodes[b + j]


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_node_window(
    first_row: int, rows: int, first_group: int, groups: int, key: LatticeKey, quantiles: Floats, window: Singles
) -> None:
    """Normal random numbers of a window of nodes, row by row: those of `terrain.lattice_noise_kernel`."""
    words = np.empty((4, rows), np.uint32)
    per_word, width = (quantiles.size - 1) * 2.0**-32, np.uint64(4 * groups)
    for group in range(groups):
        philox_consecutive(first_row, first_group + group, key.octave, key.layer, key.k0, key.k1, words)
        for lane in range(4):
            lane_words, out = words[lane], window[4 * group + lane :]
            for n in range(np.uint64(rows)):
                index = np.float64(lane_words[n]) * per_word
                cell = np.uint64(np.int64(index))  # unsigned: a possibly negative index costs a test
                low, high = quantiles[cell], quantiles[cell + np.uint64(1)]
                out[n * width] = low + (index - np.float64(cell)) * (high - low)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_octave(
    x: float, y: float, step: float, count: int, octave: Floats, key_row: NDArray[np.int64], quantiles: Floats,
    out: Singles,
) -> None:  # fmt: skip
    """Add one octave on a square of nodes.

    Args:
        x: First coordinate of the first node [m].
        y: Second coordinate [m].
        step: Spacing of the nodes [m].
        count: Nodes along the first axis; along the second as many as `out` holds.
        octave: One row of `octaves` of `synthesize_octaves`, (5,).
        key_row: One row of `keys` of `synthesize_octaves`, (5,).
        quantiles: Quantiles of the normal distribution.
        out: Result, added to, (3, count, whole vectors).
    """
    pitch, amplitude, width = octave[0], octave[4], out.shape[2]
    c, s = math.cos(octave[1]), math.sin(octave[1])
    a, b = (c * x + s * y) / pitch + octave[2], (c * y - s * x) / pitch + octave[3]
    per_c, per_s = c * step / pitch, s * step / pitch
    down, right = count - 1, width - 1
    first_i = math.floor(a + min(0.0, per_c * down) + min(0.0, per_s * right) - _WINDOW_MARGIN)
    last_i = math.floor(a + max(0.0, per_c * down) + max(0.0, per_s * right) + _WINDOW_MARGIN)
    first_j = math.floor(b + min(0.0, -per_s * down) + min(0.0, per_c * right) - _WINDOW_MARGIN)
    last_j = math.floor(b + max(0.0, -per_s * down) + max(0.0, per_c * right) + _WINDOW_MARGIN)
    group = first_j >> 2
    rows, groups = last_i - first_i + 4, ((last_j + 3) >> 2) - group + 1
    if rows * groups > 6 * count * width:  # nodes far apart: pointwise each draws about six groups
        _add_octave_pointwise(x, y, step, octave, key_row, quantiles, out)
        return
    window = np.empty(4 * rows * groups, np.float32)
    key = LatticeKey(key_row[1], key_row[2], key_row[3], key_row[4])
    _fill_node_window(first_i - 1, rows, group, groups, key, quantiles, window)
    a, b = a - first_i, b - 4 * group
    slope_amplitude = amplitude / pitch
    factors = (np.float32(amplitude), np.float32(slope_amplitude * c), np.float32(slope_amplitude * s))
    single_c, single_s, values = np.float32(per_c), np.float32(per_s), out.reshape(out.size)
    for i in range(count):
        for k in range(0, width, LANES):
            add_spline(
                window, 4 * groups, np.float32(a + i * per_c + k * per_s), np.float32(b - i * per_s + k * per_c),
                single_s, single_c, factors, values, i * width + k, count * width,
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _add_octave_pointwise(
    x: float, y: float, step: float, octave: Floats, keys: NDArray[np.int64], quantiles: Floats, out: Singles
) -> None:
    """Add an octave whose pitch is so small that nodes share no random numbers; for the arguments see `_add_octave`."""
    count, width = out.shape[1], out.shape[2]
    north, east, sample = np.empty(count * width), np.empty(count * width), np.zeros((count * width, 3))
    for i in range(count):
        for j in range(width):
            north[i * width + j], east[i * width + j] = x + i * step, y + j * step
    band = LatticeBand(octave[0], octave[1], octave[2], octave[3], octave[4])
    add_band(north, east, band, LatticeKey(keys[1], keys[2], keys[3], keys[4]), quantiles, sample)
    for n in range(count * width):
        for plane in range(3):
            out[plane, n // width, n % width] += np.float32(sample[n, plane])


@njit(cache=True, nogil=True, error_model="numpy")
def synthesize_octaves(
    along: int, across: int, cell: float, octaves: Floats, keys: NDArray[np.int64], quantiles: Floats, tile: Singles
) -> None:  # fmt: skip
    """Height and slopes of octaves of relief on the nodes of one tile.

    Args:
        along: Number of the tile along the frame's first axis.
        across: Number of the tile along the frame's second axis.
        cell: Side of a cell [m].
        octaves: Pitch [m], turn [rad], both shifts [pitches] and amplitude [m] of each, (o, 5).
        keys: Step between the nodes on which each is evaluated: 16, 8, 4, 2 or 1, coarsest first; number of the octave,
            layer and two words of the key of its random numbers, (o, 5).
        quantiles: Quantiles of the normal distribution, see `add_band`.
        tile: Result, height [m] and slopes along the axes [1], (nodes, nodes, 3).
    """
    nodes = tile.shape[0]
    step, octave = keys[0, 0] if octaves.shape[0] else 1, 0
    coarser = np.zeros((3, 0, 0), np.float32)
    while step >= 1:
        margin = 2 if step > 1 else 0
        count = (nodes - 1) // step + 1 + 2 * margin
        planes = np.zeros((3, count, (count + LANES - 1) // LANES * LANES), np.float32)
        x, y = (along * (nodes - 1) - margin * step) * cell, (across * (nodes - 1) - margin * step) * cell
        while octave < octaves.shape[0] and keys[octave, 0] == step:
            _add_octave(x, y, step * cell, count, octaves[octave], keys[octave], quantiles, planes)
            octave += 1
        if coarser.shape[1] > 0:
            add_upsampled(coarser, margin, count, planes)
        coarser = planes
        step //= 2
    height, slope_along, slope_across = coarser
    for i in range(nodes):
        for j in range(nodes):
            tile[i, j, 0], tile[i, j, 1], tile[i, j, 2] = height[i, j], slope_along[i, j], slope_across[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def synthesize_tiles(
    rows: NDArray[np.int64], numbers: NDArray[np.int64], cell: float, octaves: Floats, keys: NDArray[np.int64],
    quantiles: Floats, tiles: Singles,
) -> None:  # fmt: skip
    """`synthesize_octaves` on some tiles of a map.

    Args:
        rows: Rows to fill, (n,).
        numbers: Numbers of the tile in each row, (rows, 2).
        cell: Side of a cell [m].
        octaves: See `synthesize_octaves`.
        keys: See `synthesize_octaves`.
        quantiles: Quantiles of the normal distribution.
        tiles: Result, (rows, nodes, nodes, 3).
    """
    for row in rows:
        synthesize_octaves(numbers[row, 0], numbers[row, 1], cell, octaves, keys, quantiles, tiles[row])
