"""Selection of the scatterers of tiles, and positions of those kept: the arithmetic of `engines.beam_importance`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._gain_envelope_kernel import EnvelopeArguments, gain_re_threshold
from insonify.engines._keep_probability_kernel import GridFrame, keep_probability_of
from insonify.engines._prefetch import prefetch
from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.random_keys import philox_at, uniform_from_word
from insonify.scene.scatterer_grid import BASE_PITCH, PARTS, SIDE, TILE, DrawnScatterers, Tiles
from insonify.scene.scatterers import ROW_KEY_STEP
from insonify.scene.terrain_draping_kernel import drape_point

SQUARE = 2
"""Number of cells along the side of the squares into which a part with a gain peak is divided."""
SQUARES = TILE // SQUARE
"""Number of such squares along the side of a tile."""
MIN_SUBDIVIDED = 12
"""Number of scatterers of such a part above which its squares are evaluated one by one."""
BATCH = 256
"""Number of scatterers in parts with a gain peak that are evaluated together."""
ROWS_AHEAD = 8
"""Number of scatterers from the one that is written to the one whose terrain is prefetched."""
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
ProbabilityColumns = tuple[Floats, Floats, Floats, NDArray[np.bool_], float, float]
"""Fields of `beam_importance.KeepProbabilities`; gain re that above which all scatterers are kept, below which keep
probabilities are proportional to it instead of its square; and the smallest keep probability."""


class TileRows(NamedTuple):
    """Tiles and their scatterers."""

    tiles: Tiles
    """The tiles."""
    drawn: DrawnScatterers
    """Scatterers of tiles, in order of priority."""
    start: Integers
    """First row of each tile among them, shape (tiles,)."""
    first_key: NDArray[np.uint64]
    """Key of each tile's first cell, shape (tiles,)."""


class KeptScatterers(NamedTuple):
    """The scatterers that one ping keeps of some tiles, columns of shape (n,)."""

    position: Floats
    """North, east, depth [m], shape (n, 3)."""
    normal: Floats
    """Unit normal into the water, shape (n, 3)."""
    area: Floats
    """Area of the boundary that each represents [m^2]."""
    phase: NDArray[np.complex128]
    """Random phase of each, as a complex number of magnitude 1 [1]."""
    key: NDArray[np.uint64]
    """Scatterer id."""

    def first(self, count: int) -> "KeptScatterers":
        """The first `count` of the scatterers."""
        return KeptScatterers(
            self.position[:count], self.normal[:count], self.area[:count], self.phase[:count], self.key[:count]
        )  # fmt: skip


class PendingScatterers(NamedTuple):
    """Scatterers in parts with a gain peak, n of them, before their gains are evaluated."""

    positions: Floats
    """North and east of each [m], shape (n, 2)."""
    values: Floats
    """Priority, fraction that fills the sonar's cells, largest keep probability, area of the cell [m^2] and phase
    [turns] of each, shape (n or more, 5)."""
    rows: Integers
    """Row of each among the drawn scatterers, shape (n or more,)."""
    keys: NDArray[np.uint64]
    """Scatterer id of each, shape (n or more,)."""


class _Candidates(NamedTuple):
    """Scatterers of one tile that may be kept, columns of `TILE` squared elements."""

    row: Integers
    """Number of the cell along the grid's first axis."""
    column: Integers
    """Number of the cell along the grid's second axis."""
    rank: Integers
    """Rank of its priority in the tile, from 0."""
    limit: Floats
    """Largest keep probability in its part or square [1]."""
    words: NDArray[np.uint32]
    """Random words: for position along, across, phase and priority, (4, `TILE` squared)."""
    priority: Floats
    """Priority [1]."""
    probability: Floats
    """Keep probability, in a part with a gain peak the largest of that part [1]."""
    chosen: Integers
    """Indices of those with a priority below that probability; one element longer."""


@njit(cache=True, nogil=True, error_model="numpy")
def draw_and_keep(
    tile_rows: TileRows, key: tuple[int, int], probability_columns: ProbabilityColumns, gains: EnvelopeArguments,
    frame: GridFrame, plane: tuple[float, float], kept: KeptScatterers,
) -> int:  # fmt: skip
    """Keep the scatterers of some tiles with a priority below their keep probability; return their number.

    Those over unknown terrain or land are left out.

    Args:
        tile_rows: The tiles and their scatterers, as many of each as may be kept.
        key: Both words of the key of the draws.
        probability_columns: Keep probabilities by tile.
        gains: First argument of `gain_re_threshold`.
        frame: Frame of the scatterer grid.
        plane: Mean depth of the boundary [m], and down component of its normal into the water, 1 or -1 [1].
        kept: Result.
    """
    (scale, along, across), drawn, start, first_key = tile_rows
    density, max_probability, corner, is_peaked, linear_below, min_probability = probability_columns
    north, east, c, s = frame
    integers, floats = np.empty((4, TILE * TILE + 1), np.int64), np.empty((3, TILE * TILE))
    candidates = _Candidates(
        integers[0], integers[1], integers[2], floats[0], np.empty((4, TILE * TILE), np.uint32), floats[1], floats[2],
        integers[3],
    )  # fmt: skip
    positions, pending = np.empty((BATCH + TILE * TILE, 2)), np.empty((BATCH + TILE * TILE, 5))
    pending_rows, keys = np.empty(BATCH + TILE * TILE, np.int64), np.empty(BATCH + TILE * TILE, np.uint64)
    top, first_rank = np.empty((SQUARES, SQUARES)), np.empty(PARTS * PARTS, np.int64)
    n, waiting = np.intp(0), 0  # by value: a literal zero would compile `_decide_batch` a second time
    row, column, words = candidates.row, candidates.column, candidates.words
    flat_terrain = drawn.terrain.reshape(drawn.terrain.size)
    for t in range(scale.size):
        pitch, a0, b0 = BASE_PITCH * 2.0 ** scale[t], along[t] * TILE, across[t] * TILE
        count = _possible_cells(drawn.cell[start[t] :], max_probability[t], (a0, b0), first_rank, candidates)
        if _subdivided_parts(max_probability[t], is_peaked[t]) > 0:
            _bound_squares(t, a0, b0, pitch, probability_columns, gains, frame, top)
            count = _below_bounds(count, top, (a0, b0), candidates)
        philox_at(row[:count], column[:count], scale[t], 0, key[0], key[1], words)
        probabilities = density[t], linear_below, min_probability
        found = _choose(count, corner[t], is_peaked[t], (a0, b0), probabilities, candidates)
        for k in range(found):
            if flat_terrain.size > 0:
                ahead = start[t] + candidates.rank[candidates.chosen[min(k + ROWS_AHEAD, found - 1)]]
                prefetch(flat_terrain, np.uint64(3 * ahead))
            w = candidates.chosen[k]
            x, y, phase = uniform_from_word(words[0, w]), uniform_from_word(words[1, w]), uniform_from_word(words[2, w])
            x, y = (row[w] + x) * pitch, (column[w] + y) * pitch
            x, y = north + c * x - s * y, east + s * x + c * y
            a, b, probability = row[w] - a0, column[w] - b0, candidates.probability[w]
            name, drawn_row = first_key[t] + np.uint64(a * ROW_KEY_STEP + b), start[t] + candidates.rank[w]
            if not is_peaked[t, a // SIDE, b // SIDE]:
                n = _write_kept(
                    (x, y), pitch * pitch / probability, phase, name, drawn.terrain, drawn_row, plane, kept, n
                )
                continue
            positions[waiting, 0], positions[waiting, 1] = x, y
            pending[waiting, 0], pending[waiting, 1], pending[waiting, 2] = (
                candidates.priority[w],
                density[t],
                probability,
            )
            pending[waiting, 3], pending[waiting, 4] = pitch * pitch, phase
            pending_rows[waiting], keys[waiting], waiting = drawn_row, name, waiting + 1
        if waiting > BATCH or t == scale.size - 1:
            batch = PendingScatterers(positions[:waiting], pending, pending_rows, keys)
            n = _decide_batch(batch, linear_below, min_probability, gains, drawn.terrain, plane, kept, n)
            waiting = 0
    return int(n)


@njit(cache=True, nogil=True, error_model="numpy")
def _possible_cells(
    cells: NDArray[np.uint16], max_probability: Floats, corner: tuple[int, int], first_rank: Integers,
    candidates: _Candidates,
) -> int:  # fmt: skip
    """Fill cells, ranks and limits of the scatterers of a tile below the largest keep probability of their part.

    A part has every sixteenth rank, from its first one on.

    Args:
        cells: Cells of the tile by rank.
        max_probability: Largest keep probability in each part, shape (PARTS, PARTS).
        corner: Row and column of the tile's first cell.
        first_rank: Work array, shape (PARTS * PARTS,).
        candidates: Result.
    """
    first_rank[:] = TILE * TILE
    for rank in range(min(math.ceil(max(max_probability.max(), 0.0) * (TILE * TILE)), PARTS * PARTS)):
        cell = np.uint64(cells[rank])
        first_rank[cell // np.uint64(TILE * SIDE) * np.uint64(PARTS) + cell % np.uint64(TILE) // np.uint64(SIDE)] = rank
    n = 0
    for part in range(PARTS * PARTS):
        limit = max_probability[part // PARTS, part % PARTS]
        first, end = first_rank[part], min(math.ceil(max(limit, 0.0) * (TILE * TILE)), TILE * TILE)
        for rank in range(first, end, PARTS * PARTS):
            cell = np.uint64(cells[rank])
            candidates.row[n] = corner[0] + np.int64(cell // np.uint64(TILE))
            candidates.column[n] = corner[1] + np.int64(cell % np.uint64(TILE))
            candidates.rank[n], candidates.limit[n], n = rank, limit, n + 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _below_bounds(count: int, top: Floats, corner: tuple[int, int], candidates: _Candidates) -> int:
    """Move the candidates that may lie below the largest keep probability of their square to the front.

    Args:
        count: Number of candidates.
        top: Largest keep probability in each square [1], (SQUARES, SQUARES).
        corner: Row and column of the tile's first cell.
        candidates: The candidates, changed.

    Returns:
        Number of those at the front.
    """
    left, (row, column, rank, limit) = 0, candidates[:4]
    for w in range(count):
        bound = top[(row[w] - corner[0]) // SQUARE, (column[w] - corner[1]) // SQUARE]
        if rank[w] < bound * (TILE * TILE):
            row[left], column[left], rank[left], limit[left], left = row[w], column[w], rank[w], bound, left + 1
    return left


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(
    count: int, corner_gain: Floats, is_peaked: NDArray[np.bool_], corner: tuple[int, int],
    probabilities: tuple[float, float, float], candidates: _Candidates,
) -> int:  # fmt: skip
    """Fill priorities and keep probabilities; select the candidates that are kept or whose gain is evaluated later.

    Args:
        count: Number of candidates.
        corner_gain: Gain at the corners of the tile's parts, re that above which all are kept [1],
            (PARTS + 1, PARTS + 1).
        is_peaked: True for parts whose scatterers are evaluated one by one, (PARTS, PARTS).
        corner: Row and column of the tile's first cell.
        probabilities: Fraction that fills the sonar's cells, and further arguments of `keep_probability_of`.
        candidates: The candidates; also the result.

    Returns:
        Number of selected ones, whose indices are in `chosen`.
    """
    row, column, rank, limit, words, priority, probability, chosen = candidates
    density, linear_below, min_probability = probabilities
    gain, first_gain = np.empty(TILE * TILE), corner_gain.reshape(corner_gain.size)
    lowest = np.empty(PARTS * PARTS)  # infinite in parts with a gain peak: their limit counts
    for part in range(PARTS * PARTS):
        lowest[part] = math.inf if is_peaked[part // PARTS, part % PARTS] else 0.0
    a0, b0, side, unit = corner[0], corner[1], np.uint64(SIDE), 1.0 / SIDE
    third_word = words[3]
    for w in range(np.uint64(count)):
        priority[w] = (rank[w] + uniform_from_word(third_word[w])) / (TILE * TILE)
    word_along, word_across = words[0], words[1]
    for w in range(np.uint64(count)):
        a, b = np.uint64(row[w] - a0), np.uint64(column[w] - b0)
        i, j = a // side, b // side
        x = (np.float64(a) + uniform_from_word(word_along[w])) * unit - np.float64(i)
        y = (np.float64(b) + uniform_from_word(word_across[w])) * unit - np.float64(j)
        node = i * np.uint64(PARTS + 1) + j
        g00, g01 = first_gain[node], first_gain[node + np.uint64(1)]
        g10, g11 = first_gain[node + np.uint64(PARTS + 1)], first_gain[node + np.uint64(PARTS + 2)]
        low, high = g00 + y * (g01 - g00), g10 + y * (g11 - g10)
        gain[w] = max(low + x * (high - low), lowest[i * np.uint64(PARTS) + j])
    for w in range(np.uint64(count)):
        probability[w] = min(density * keep_probability_of(gain[w], linear_below, min_probability), limit[w])
    found = 0
    for w in range(count):
        chosen[found] = w
        found += (priority[w] < probability[w]) & (priority[w] < limit[w])
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _write_kept(
    horizontal: tuple[float, float], area: float, phase: float, key: np.uint64, terrain: Floats, row: int,
    plane: tuple[float, float], kept: KeptScatterers, n: int,
) -> int:  # fmt: skip
    """Write a kept scatterer to row n, on the terrain if there is any; return the number of rows.

    Args:
        horizontal: North and east of the scatterer [m].
        area: Horizontal area that it represents [m^2].
        phase: Its random phase [turns].
        key: Its scatterer id.
        terrain: Height [m] and gradient [1] of the terrain at the drawn scatterers, (any, 3), or (0, 3).
        row: Its row among these.
        plane: See `draw_and_keep`.
        kept: Result.
        n: Row that is written.
    """
    depth, normal_down = plane
    kept.position[n, 0], kept.position[n, 1] = horizontal
    if terrain.shape[0] > 0:
        height = terrain[row, 0]
        if not height < depth:  # a hole, or land
            return n
        area *= drape_point(n, depth, height, terrain[row, 1], terrain[row, 2], kept.position, kept.normal)
    else:
        kept.position[n, 2] = depth
        kept.normal[n, 0], kept.normal[n, 1], kept.normal[n, 2] = 0.0, 0.0, normal_down
    kept.area[n], kept.key[n] = area, key
    sine, cosine = sincos_cycles(phase)
    kept.phase[n] = complex(cosine, sine)
    return n + 1


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
    t: int, a0: int, b0: int, pitch: float, probability_columns: ProbabilityColumns, gains: EnvelopeArguments,
    frame: GridFrame, top: Floats,
) -> None:  # fmt: skip
    """Fill the largest keep probability in each square of one tile.

    Args:
        t: Row of the tile.
        a0: Number of the tile's first cell along the scatterer grid's first axis.
        b0: Number of that cell along its second axis.
        pitch: Side of its cells [m].
        probability_columns: Keep probabilities by tile.
        gains: First argument of `gain_re_threshold`.
        frame: Frame of the scatterer grid.
        top: Result [1], (SQUARES, SQUARES).
    """
    density, max_probability, is_peaked = (
        probability_columns[0][t],
        probability_columns[1][t],
        probability_columns[3][t],
    )
    linear_below, min_probability = probability_columns[4], probability_columns[5]
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
    batch: PendingScatterers, linear_below: float, min_probability: float, gains: EnvelopeArguments,
    terrain: Floats, plane: tuple[float, float], kept: KeptScatterers, count: int,
) -> int:  # fmt: skip
    """Keep or leave out scatterers in parts with a gain peak.

    Args:
        batch: The scatterers.
        linear_below: See `keep_probability_of`.
        min_probability: See `keep_probability_of`.
        gains: First argument of `gain_re_threshold`.
        terrain: Height [m] and gradient [1] of the terrain at the drawn scatterers, (any, 3), or (0, 3).
        plane: See `draw_and_keep`.
        kept: Columns to which those kept are appended.
        count: Number of rows in them before.

    Returns:
        Number of rows in them after.
    """
    positions, pending, rows, keys = batch
    gain = np.empty(positions.shape[0])
    gain_re_threshold(gains, positions, np.zeros(gain.size), gain)
    for m in range(gain.size):
        probability = min(pending[m, 1] * keep_probability_of(gain[m], linear_below, min_probability), pending[m, 2])
        if pending[m, 0] < probability:
            horizontal = positions[m, 0], positions[m, 1]
            area, phase = pending[m, 3] / probability, pending[m, 4]
            count = _write_kept(horizontal, area, phase, keys[m], terrain, rows[m], plane, kept, count)
    return count
