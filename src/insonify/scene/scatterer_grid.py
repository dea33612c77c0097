"""The lattice of drawn scatterers: one point per cell, jittered in it, the same in every ping.

Cells are squares of BASE_PITCH * 2**scale in the lattice's own frame, grouped in tiles of
TILE x TILE cells. Position and phase come from the key (seed, stream, scale, cell) alone, so any
cell can be drawn at any time by any worker, and a world moved as a whole keeps its scatterers. So does each cell's
priority: a sonar with little gain towards a position keeps only those of low priority, the same in every ping.
"""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from insonify import random_keys
from insonify.jit import njit
from insonify.model import Metres, Model, Radians

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

BASE_PITCH = 0.01
"""Side of a cell at scale 0 [m]."""
FINEST_SCALE = -4
"""Scale of the smallest cells: 0.6 mm."""
TILE = 32
"""Cells along the side of a tile."""
PARTS = 4
"""Parts along the side of a tile, each with the largest gain at any of its positions."""
SIDE = TILE // PARTS
"""Cells along the side of a part."""
CELLS = SIDE * SIDE
"""Cells of a part."""
PART_ORDER, TILE_ORDER = 1, 2
"""Last counters of the draws that put the cells of a part, and the parts of a tile, in order; 0 for a cell's own."""


Coordinate = Annotated[Metres, Field(ge=-1e7, le=1e7)]


class ScattererGrid(Model):
    """Frame in which scatterers are drawn; moving it together with the whole scene changes no echo."""

    origin: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    """North and east of the lattice's origin [m]."""
    heading: Radians = 0.0
    """Compass heading of the lattice's first axis [rad]."""

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """North and east of the origin [m], cosine and sine of the heading."""
        return *self.origin, float(np.cos(self.heading)), float(np.sin(self.heading))

    def to_world(self, along: NDArray[np.float64], across: NDArray[np.float64]) -> NDArray[np.float64]:
        """North and east [m], shape (n, 2), of lattice coordinates [m], shape (n,)."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        north, east = self.origin
        position = np.empty((*np.shape(along), 2))
        position[..., 0], position[..., 1] = north + c * along - s * across, east + s * along + c * across
        return position

    def from_world(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Grid coordinates [m] of north and east [m], shape (..., 2) both."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        north, east = position[..., 0] - self.origin[0], position[..., 1] - self.origin[1]
        return np.stack([c * north + s * east, c * east - s * north], axis=-1)


class Tiles(NamedTuple):
    """Tiles of the lattice, columns of shape (n,)."""

    scale: NDArray[np.int64]
    """Scale of the tile's cells."""
    along: NDArray[np.int64]
    """Number of the tile along the lattice's first axis."""
    across: NDArray[np.int64]
    """Number of the tile along its second axis."""

    @property
    def pitch(self) -> NDArray[np.float64]:
        """Side of a cell [m], shape (n,)."""
        return np.ldexp(BASE_PITCH, self.scale)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centre of each tile in lattice coordinates [m], shape (n, 2)."""
        side = TILE * self.pitch
        return np.stack([(self.along + 0.5) * side, (self.across + 0.5) * side], axis=-1)

    def take(self, rows: NDArray[np.bool_] | Integers | slice) -> "Tiles":
        """The tiles of some rows."""
        return Tiles(self.scale[rows], self.along[rows], self.across[rows])

    def split(self) -> "Tiles":
        """Four tiles of the next finer scale for each."""
        along = (2 * self.along[:, None] + np.array([0, 0, 1, 1])).ravel()
        across = (2 * self.across[:, None] + np.array([0, 1, 0, 1])).ravel()
        return Tiles(np.repeat(self.scale - 1, 4), along, across)


def next_positions(tiles: Tiles, seed: int, stream: int, begin: Integers, end: Integers) -> tuple[Floats, Floats]:
    """Grid coordinates [m] of some scatterers of tiles, one tile after the other, by rank.

    Args:
        tiles: The tiles.
        seed: Seed of the scenario.
        stream: Stream of the interface.
        begin: First rank of each, shape (tiles,).
        end: Rank after the last of each, shape (tiles,).
    """
    along, across = np.empty((2, int(np.sum(end - begin))))
    _next_positions(*tiles, begin, end, *random_keys.stream_key(seed, stream), along, across)
    return along, across


@njit(cache=True, nogil=True)
def _next_positions(
    scale: Integers, tile_along: Integers, tile_across: Integers, begin: Integers, end: Integers, k0: int, k1: int,
    along: Floats, across: Floats,
) -> None:  # fmt: skip
    """Compiled loop of `next_positions`: fills `along` and `across` [m]."""
    words, done = np.empty((4, TILE * TILE), np.uint32), 0
    row, column, rank = np.empty((3, TILE * TILE), np.int64)
    for t in range(scale.size):
        pitch, fraction = BASE_PITCH * 2.0 ** scale[t], np.full((PARTS, PARTS), end[t] / (TILE * TILE))
        count = priority_ordered_cells(scale[t], tile_along[t], tile_across[t], fraction, k0, k1, row, column, rank)
        last = 0
        for n in range(count):
            if rank[n] >= begin[t]:
                row[last], column[last], rank[last], last = row[n], column[n], rank[n], last + 1
        random_keys.philox_at(row[:last], column[:last], scale[t], 0, k0, k1, words)
        for n in range(last):
            at = done + rank[n] - begin[t]
            along[at] = (row[n] + random_keys.uniform_from_word(words[0, n])) * pitch
            across[at] = (column[n] + random_keys.uniform_from_word(words[1, n])) * pitch
        done += end[t] - begin[t]


@njit(cache=True, nogil=True)
def tile_prefixes(tile: NDArray[np.int32], rank: NDArray[np.int32], density: Floats) -> tuple[Integers, Integers]:
    """Number of a tile's scatterers that are selected together, where its order reaches to some of them.

    Args:
        tile: Row of the tile of each scatterer, shape (n,).
        rank: Rank of each cell in the order of the tile's priorities, likewise.
        density: The largest part of a tile's scatterers that anybody keeps, shape (tiles,).

    Returns:
        Rows of the tiles that have any; and of each of them the least of that part, a quarter of it, a quarter of that,
        and so on, that holds all.
    """
    count, chosen, n = np.zeros(density.size, np.int64), np.empty(density.size, np.int64), 0
    for m in range(tile.size):
        count[tile[m]] = max(count[tile[m]], rank[m] + 1)
    for t in range(density.size):
        if count[t] == 0:
            continue
        part = np.ceil(density[t] * (TILE * TILE))
        while part >= 4 * count[t]:
            part /= 4
        chosen[n], count[n], n = t, int(np.ceil(part)), n + 1
    return chosen[:n], count[:n]


@njit(cache=True, nogil=True)
def max_point_count(fractions: Floats) -> int:
    """No fewer cells than come before some priority in each part of some tiles, shape (n, PARTS, PARTS)."""
    count = 0
    for part in fractions.flat:
        count += min(int(max(part, 0.0) * CELLS) + 1, CELLS)
    return count


@njit(cache=True, nogil=True)
def _digit(square: int, scramble: int) -> int:
    """Rank in the order of a square (two bits) of one of its four cells under a scramble (two bits)."""
    shuffled = square ^ scramble  # in the order 0, 3, 1, 2: the second lies across from the first
    return (0, 2, 3, 1)[shuffled]


@njit(cache=True, nogil=True)
def priority_ordered_cells(
    scale: int, tile_along: int, tile_across: int, most: Floats, k0: int, k1: int, row: Integers, column: Integers,
    rank: Integers,
) -> int:  # fmt: skip
    """Cells of one tile below a priority in each part: their row, column and rank.

    The order of a tile's cells is stratified: of any first 4**k one lies in each of 4**k equal squares, and the next
    are spread over these, as far from the first as they can be. Few of them are still an even lattice.

    Source: the order is a scrambled base-4 radical inverse, Owen (1995), "Randomly permuted (t,m,s)-nets and
    (t,s)-sequences", with the digits' order that keeps two of four on a diagonal.
    """
    n = 0
    coarse, _, _, _ = random_keys.philox(tile_along & 0xFFFFFFFF, tile_across & 0xFFFFFFFF, scale, TILE_ORDER, k0, k1)
    for part in range(PARTS * PARTS):
        fraction = most[part // PARTS, part % PARTS]
        half, quarter = (part >> 3) * 2 + (part >> 1 & 1), (part >> 2 & 1) * 2 + (part & 1)
        first = _digit(half, int(coarse) & 3) + 4 * _digit(quarter, int(coarse) >> (2 + 2 * half) & 3)
        if fraction <= 0 or first >= fraction * TILE * TILE:
            continue
        a0, b0 = tile_along * TILE + part // PARTS * SIDE, tile_across * TILE + part % PARTS * SIDE
        w0, w1, _, _ = random_keys.philox(a0 & 0xFFFFFFFF, b0 & 0xFFFFFFFF, scale, PART_ORDER, k0, k1)
        fine = np.uint64(w0) | np.uint64(w1) << np.uint64(32)
        for number in range(CELLS):
            order = first + PARTS * PARTS * number
            if order >= fraction * TILE * TILE:
                break
            da, db = _cell(number, fine)
            row[n], column[n], rank[n] = a0 + da, b0 + db, order
            n += 1
    return n


@njit(cache=True, nogil=True)
def _cell(number: int, scrambles: np.uint64) -> tuple[int, int]:
    """Row and column, within a part, of the cell at some rank of the part's order."""
    node, a, b, done = 0, 0, 0, 0
    for _ in range(3):
        scramble = int(scrambles >> np.uint64(2 * (done + node))) & 3
        square = (0, 3, 1, 2)[number & 3] ^ scramble
        a, b = 2 * a + (square >> 1), 2 * b + (square & 1)
        done = 4 * done + 1
        node = 4 * node + square
        number >>= 2
    return a, b
