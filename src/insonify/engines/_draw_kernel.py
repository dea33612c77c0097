"""Scatterers of tiles, each drawn and kept or left out at once: the arithmetic of `engines.beam_importance`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._gain_envelope_kernel import EnvelopeArguments, gain_re_threshold
from insonify.engines._keep_probability_kernel import GridFrame, keep_probability_of
from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.random_keys import philox_at, uniform_from_word
from insonify.scene.scatterer_grid import BASE_PITCH, PARTS, SIDE, TILE, Tiles, priority_ordered_cells
from insonify.scene.scatterers import ROW_KEY_STEP

SQUARE = 2
"""Cells along the side of the squares into which a part with a gain peak is divided."""
SQUARES = TILE // SQUARE
MIN_SUBDIVIDED = 12
"""Scatterers of such a part above which its squares are evaluated one by one."""
BATCH = 256
"""Scatterers in parts with a gain peak that are evaluated together."""
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
ProbabilityColumns = tuple[Floats, Floats, Floats, NDArray[np.bool_], float, float]
"""Density, most, corner and peaked of `beam_importance.KeepProbabilities`, the gain below which keep probabilities
is proportional to its square, and the smallest keep probability."""
ScattererColumns = tuple[
    Floats, Floats, NDArray[np.complex128], NDArray[np.uint64], NDArray[np.int32], NDArray[np.int32]
]
"""Position, area, phase, key, tile and rank of the scatterers kept."""


class PendingScatterers(NamedTuple):
    """Scatterers in parts with a gain peak, n of them, before their gains are evaluated."""

    positions: Floats
    """North and east of each [m], shape (n, 2)."""
    values: Floats
    """Priority, fraction that fills the sonar's cells, largest keep probability, area of the cell [m^2] and phase
    [turns] of each, shape (n or more, 5)."""
    tile_rank: Integers
    """Row of its tile and its rank, shape (n or more, 2)."""
    keys: NDArray[np.uint64]
    """Its key, shape (n or more,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def draw_and_keep(
    tiles: Tiles, first_key: NDArray[np.uint64], key: tuple[int, int], shares: ProbabilityColumns,
    gains: EnvelopeArguments, frame: GridFrame, depth: float, columns: ScattererColumns,
) -> int:  # fmt: skip
    """Draw scatterers of some tiles and keep those with a priority below their keep probability; returns the number.

    Args:
        tiles: The tiles.
        first_key: Key of each tile's first cell, shape (tiles,).
        key: Both words of the key of the draws.
        shares: Keep probabilities.
        gains: First arguments of `gain_re_threshold`.
        frame: Frame of the scatterer grid.
        depth: Put down as that of all [m].
        columns: Result.
    """
    (scale, along, across), (k0, k1) = tiles, key
    position, area, phase, scatterer_id, tile, rank = columns
    density, max_probability, corner, is_peaked, linear_below, min_probability = shares
    north, east, c, s = frame
    words = np.empty((4, TILE * TILE), np.uint32)
    row, column, order = np.empty((3, TILE * TILE), np.int64)
    positions, pending = np.empty((BATCH + TILE * TILE, 2)), np.empty((BATCH + TILE * TILE, 5))
    tile_rank, keys = np.empty((BATCH + TILE * TILE, 2), np.int64), np.empty(BATCH + TILE * TILE, np.uint64)
    top = np.empty((SQUARES, SQUARES))
    n, waiting = np.intp(0), 0  # by value: a literal zero would compile `_decide_batch` a second time
    for t in range(scale.size):
        pitch, a0, b0 = BASE_PITCH * 2.0 ** scale[t], along[t] * TILE, across[t] * TILE
        drawn = priority_ordered_cells(scale[t], along[t], across[t], max_probability[t], k0, k1, row, column, order)
        crowded = _subdivided_parts(max_probability[t], is_peaked[t])
        if crowded > 0:
            _bound_squares(t, a0, b0, pitch, shares, gains, frame, top)
            left = 0
            for w in range(drawn):
                if order[w] < top[(row[w] - a0) // SQUARE, (column[w] - b0) // SQUARE] * (TILE * TILE):
                    row[left], column[left], order[left], left = row[w], column[w], order[w], left + 1
            drawn = left
        philox_at(row[:drawn], column[:drawn], scale[t], 0, k0, k1, words)
        for w in range(drawn):
            a, b = row[w] - a0, column[w] - b0
            i, j = a // SIDE, b // SIDE
            priority = (order[w] + uniform_from_word(words[3, w])) / (TILE * TILE)
            share = top[a // SQUARE, b // SQUARE] if crowded > 0 else max_probability[t, i, j]
            if priority >= share:
                continue
            x, y = uniform_from_word(words[0, w]), uniform_from_word(words[1, w])
            if not is_peaked[t, i, j]:
                gain = _bilinear(corner[t], i, j, (a + x) / SIDE - i, (b + y) / SIDE - j)
                share = min(density[t] * keep_probability_of(gain, linear_below, min_probability), share)
                if priority >= share:
                    continue
            x, y = (row[w] + x) * pitch, (column[w] + y) * pitch
            x, y = north + c * x - s * y, east + s * x + c * y
            name = first_key[t] + np.uint64(a * ROW_KEY_STEP + b)
            if is_peaked[t, i, j]:
                positions[waiting, 0], positions[waiting, 1], pending[waiting, 0], pending[waiting, 1] = (
                    x,
                    y,
                    priority,
                    density[t],
                )
                pending[waiting, 2], pending[waiting, 3], pending[waiting, 4] = (
                    share,
                    pitch * pitch,
                    uniform_from_word(words[2, w]),
                )
                tile_rank[waiting, 0], tile_rank[waiting, 1], keys[waiting], waiting = t, order[w], name, waiting + 1
                continue
            position[n, 0], position[n, 1], position[n, 2] = x, y, depth
            area[n], scatterer_id[n], tile[n], rank[n] = pitch * pitch / share, name, t, order[w]
            sine, cosine = sincos_cycles(uniform_from_word(words[2, w]))
            phase[n], n = complex(cosine, sine), n + 1
        if waiting > BATCH or t == scale.size - 1:
            batch = PendingScatterers(positions[:waiting], pending, tile_rank, keys)
            n = _decide_batch(batch, linear_below, min_probability, gains, depth, columns, n)
            waiting = 0
    return int(n)


@njit(cache=True, nogil=True, error_model="numpy")
def _subdivided_parts(max_probability: Floats, is_peaked: NDArray[np.bool_]) -> int:
    """Number of parts of a tile with many scatterers and a gain peak."""
    count = 0
    for i in range(PARTS):
        for j in range(PARTS):
            count += is_peaked[i, j] and max_probability[i, j] * SIDE * SIDE > MIN_SUBDIVIDED
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _bound_squares(
    t: int, a0: int, b0: int, pitch: float, shares: ProbabilityColumns, gains: EnvelopeArguments, frame: GridFrame,
    top: Floats,
) -> None:  # fmt: skip
    """The largest keep probability in each square of one tile, into top (SQUARES, SQUARES).

    Args:
        t: Row of the tile.
        a0: Number of the tile's first cell along the scatterer grid's first axis.
        b0: Along its second.
        pitch: Side of its cells [m].
        shares: Keep probabilities.
        gains: First argument of `gain_re_threshold`.
        frame: Frame of the scatterer grid.
        top: Result.
    """
    density, max_probability, is_peaked = shares[0][t], shares[1][t], shares[3][t]
    linear_below, min_probability = shares[4], shares[5]
    count = _subdivided_parts(max_probability, is_peaked) * (SIDE // SQUARE) ** 2
    squares_per_part = SIDE // SQUARE
    north, east, c, s = frame
    positions, gain, n = np.empty((count, 2)), np.empty(count), 0
    for i in range(SQUARES):
        for j in range(SQUARES):
            top[i, j] = max_probability[i // squares_per_part, j // squares_per_part]
            if is_peaked[i // squares_per_part, j // squares_per_part] and top[i, j] * SIDE * SIDE > MIN_SUBDIVIDED:
                x, y = (a0 + (i + 0.5) * SQUARE) * pitch, (b0 + (j + 0.5) * SQUARE) * pitch
                positions[n, 0], positions[n, 1], n = north + c * x - s * y, east + s * x + c * y, n + 1
    gain_re_threshold(gains, positions, np.full(count, SQUARE * pitch * math.sqrt(0.5)), gain)
    n = 0
    for i in range(SQUARES):
        for j in range(SQUARES):
            if is_peaked[i // squares_per_part, j // squares_per_part] and top[i, j] * SIDE * SIDE > MIN_SUBDIVIDED:
                top[i, j], n = (
                    min(top[i, j], density * keep_probability_of(gain[n], linear_below, min_probability)),
                    n + 1,
                )


@njit(cache=True, nogil=True, error_model="numpy")
def _decide_batch(
    batch: PendingScatterers, linear_below: float, min_probability: float, gains: EnvelopeArguments, depth: float,
    columns: ScattererColumns, count: int,
) -> int:  # fmt: skip
    """Keep or leave out scatterers in parts with a gain peak.

    Args:
        batch: The scatterers.
        linear_below: See `keep_probability_of`.
        min_probability: See `keep_probability_of`.
        gains: First argument of `gain_re_threshold`.
        depth: Put down as that of all [m].
        columns: The columns, to which those kept are added.
        count: Rows in them.

    Returns:
        Rows in them now.
    """
    positions, pending, tile_rank, keys = batch
    position, area, phase, key, tile, rank = columns
    gain = np.empty(positions.shape[0])
    gain_re_threshold(gains, positions, np.zeros(gain.size), gain)
    for m in range(gain.size):
        share = min(pending[m, 1] * keep_probability_of(gain[m], linear_below, min_probability), pending[m, 2])
        if pending[m, 0] >= share:
            continue
        position[count, 0], position[count, 1], position[count, 2] = positions[m, 0], positions[m, 1], depth
        area[count], key[count], tile[count], rank[count] = (
            pending[m, 3] / share,
            keys[m],
            tile_rank[m, 0],
            tile_rank[m, 1],
        )
        sine, cosine = sincos_cycles(pending[m, 4])
        phase[count], count = complex(cosine, sine), count + 1
    return count


@njit(cache=True, nogil=True)
def _bilinear(corner: Floats, i: int, j: int, x: float, y: float) -> float:
    """Value in a part between its four corners, at the fractions x and y of its sides from the first."""
    low = corner[i, j] + y * (corner[i, j + 1] - corner[i, j])
    high = corner[i + 1, j] + y * (corner[i + 1, j + 1] - corner[i + 1, j])
    return low + x * (high - low)
