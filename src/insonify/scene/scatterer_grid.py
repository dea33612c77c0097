"""Grid of random scatterers: one jittered point in each cell, the same in every ping.

Cells are squares of side BASE_PITCH * 2**scale in the grid's own frame, grouped in tiles of TILE x TILE cells.
Position, phase and priority of a scatterer depend on the key (seed, stream, scale, cell) alone, so any cell can be
evaluated at any time, and a world moved as a whole keeps its scatterers. Where the gain is low, only scatterers of low
priority are kept, the same in every ping.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.jit import njit
from insonify.model import Coordinate, Heading, Model

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

BASE_PITCH = 0.01
"""Side of a cell at scale 0 [m]."""
FINEST_SCALE = -4
"""Scale of the smallest cells: 0.6 mm."""
TILE = 32
"""Number of cells along the side of a tile."""
PARTS = 4
"""Number of parts along the side of a tile; the largest gain is evaluated for each part."""
SIDE = TILE // PARTS
"""Number of cells along the side of a part."""
CELLS = SIDE * SIDE
"""Number of cells of a part."""
PART_ORDER, TILE_ORDER = 1, 2
"""Last counters of the random numbers that order the cells of a part, and the parts of a tile; 0 for a cell's own."""


class ScattererGrid(Model):
    """Frame of the random scatterers; moving it together with the whole scene changes no echo.

    Example:
        >>> grid = ScattererGrid(origin=(100, 200), heading="90 deg")
        >>> grid.to_world(np.array([10.0]), np.array([0.0])).round(3).tolist()
        [[100.0, 210.0]]
    """

    origin: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    """North and east of the frame's origin [m]: scatterers stay where they are in the frame when it is moved."""
    heading: Heading = 0.0
    """Compass heading of the frame [rad], to be turned by the same angle as the scene."""

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
        return np.stack(self.axes_from_world(position[..., 0], position[..., 1]), axis=-1)

    def axes_from_world(
        self, north: NDArray[np.float64], east: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Grid coordinates along both axes [m] of north and of east [m], broadcast shape."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        north, east = north - self.origin[0], east - self.origin[1]
        return c * north + s * east, c * east - s * north


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
        side, centre = TILE * self.pitch, np.empty((len(self.scale), 2))
        centre[:, 0], centre[:, 1] = (self.along + 0.5) * side, (self.across + 0.5) * side
        return centre

    def take(self, rows: NDArray[np.bool_] | Integers | slice) -> "Tiles":
        """The tiles of some rows."""
        return Tiles(self.scale[rows], self.along[rows], self.across[rows])

    def split(self) -> "Tiles":
        """Four tiles of the next finer scale for each."""
        along = (2 * self.along[:, None] + np.array([0, 0, 1, 1])).ravel()
        across = (2 * self.across[:, None] + np.array([0, 1, 0, 1])).ravel()
        return Tiles(np.repeat(self.scale - 1, 4), along, across)


class DrawnCells(NamedTuple):
    """Scatterers of tiles, tile by tile in order of priority, n of them."""

    cell: NDArray[np.uint16]
    """Cell of each scatterer in its tile, row times `TILE` plus column, shape (n,)."""
    along: Floats
    """Grid coordinate along the first axis [m], shape (n,)."""
    across: Floats
    """Grid coordinate along the second [m], shape (n,)."""


class DrawnScatterers(NamedTuple):
    """Scatterers of tiles, tile by tile in order of priority."""

    cell: NDArray[np.uint16]
    """Cell of each scatterer in its tile, row times `TILE` plus column, shape (any,)."""
    terrain: Floats
    """Height [m] and gradient to the north and the east [1] of the terrain there, shape (any, 3); (0, 3): flat."""


def draw_cells(tiles: Tiles, seed: int, stream: int, begin: Integers, end: Integers) -> DrawnCells:
    """Some scatterers of tiles, one tile after the other, by rank.

    Args:
        tiles: The tiles.
        seed: Seed of the scenario.
        stream: Stream of the interface.
        begin: Rank, in the order of priority, of the first scatterer of each tile, shape (tiles,).
        end: Rank after that of the last scatterer of each tile, shape (tiles,).
    """
    count = int(np.sum(end - begin))
    drawn = DrawnCells(np.empty(count, np.uint16), np.empty(count), np.empty(count))
    _draw_cells(*tiles, begin, end, *random_keys.stream_key(seed, stream), drawn)
    return drawn


@njit(cache=True, nogil=True)
def _draw_cells(
    scale: Integers, tile_along: Integers, tile_across: Integers, begin: Integers, end: Integers, k0: int, k1: int,
    drawn: DrawnCells,
) -> None:  # fmt: skip
    """Compiled loop of `draw_cells`."""
    words, start = np.empty((4, TILE * TILE), np.uint32), 0
    row, column, rank = np.empty((3, TILE * TILE), np.int64)
    for t in range(scale.size):
        pitch, fraction = BASE_PITCH * 2.0 ** scale[t], np.full((PARTS, PARTS), end[t] / (TILE * TILE))
        count = priority_ordered_cells(scale[t], tile_along[t], tile_across[t], fraction, k0, k1, row, column, rank)
        size = 0
        for n in range(count):
            if rank[n] >= begin[t]:
                row[size], column[size], rank[size], size = row[n], column[n], rank[n], size + 1
        random_keys.philox_at(row[:size], column[:size], scale[t], 0, k0, k1, words)
        for n in range(size):
            index = start + rank[n] - begin[t]
            a, b = row[n] - tile_along[t] * TILE, column[n] - tile_across[t] * TILE
            drawn.cell[index] = np.uint16(a * TILE + b)
            drawn.along[index] = (row[n] + random_keys.uniform_from_word(words[0, n])) * pitch
            drawn.across[index] = (column[n] + random_keys.uniform_from_word(words[1, n])) * pitch
        start += end[t] - begin[t]


@njit(cache=True, nogil=True)
def prefix_sizes(fractions: Floats, density: Floats) -> Integers:
    """Number of the first scatterers by rank of each tile that include all below given priorities.

    Args:
        fractions: Priority below which scatterers may be kept in each part of each tile, shape (n, PARTS, PARTS).
        density: Largest fraction of a tile's scatterers that is ever kept [1], shape (n,).

    Returns:
        The least number with all of them in the sequence of that fraction, a quarter of it, a sixteenth and so on; 0
        for a tile without any, shape (n,).
    """
    prefix_size = np.zeros(density.size, np.int64)
    for t in range(density.size):
        needed = np.ceil(min(max(fractions[t].max(), 0.0), 1.0) * (TILE * TILE))
        if needed == 0:
            continue
        size = max(np.ceil(density[t] * (TILE * TILE)), needed)
        while size >= 4 * needed:
            size /= 4
        prefix_size[t] = int(np.ceil(size))
    return prefix_size


@njit(cache=True, nogil=True)
def max_point_count(fractions: Floats) -> int:
    """Upper bound of the number of cells below given priorities in each part of some tiles (n, PARTS, PARTS)."""
    count = 0
    for part in fractions.flat:
        count += min(int(max(part, 0.0) * CELLS) + 1, CELLS)
    return count


@njit(cache=True, nogil=True)
def _cell_rank(square: int, scramble: int) -> int:
    """Rank, 0 to 3, of one of the four cells of a square (two bits: row, column) under a scramble (two bits)."""
    shuffled = square ^ scramble  # in the order 0, 3, 1, 2: the second lies across from the first
    return (0, 2, 3, 1)[shuffled]


@njit(cache=True, nogil=True)
def priority_ordered_cells(
    scale: int, tile_along: int, tile_across: int, fractions: Floats, k0: int, k1: int, row: Integers, column: Integers,
    rank: Integers,
) -> int:  # fmt: skip
    """Fill row, column and rank of the cells of one tile below a priority in each part; return their number.

    The order is stratified: each of 4**k equal squares has one of the first 4**k cells, and the next cells are as far
    from these as possible. A small number of them is therefore evenly distributed.

    Source: the order is a scrambled base-4 radical inverse, Owen (1995), "Randomly permuted (t,m,s)-nets and
    (t,s)-sequences", with the digits' order that keeps two of four on a diagonal.
    """
    n = 0
    coarse, _, _, _ = random_keys.philox(tile_along & 0xFFFFFFFF, tile_across & 0xFFFFFFFF, scale, TILE_ORDER, k0, k1)
    for part in range(PARTS * PARTS):
        fraction = fractions[part // PARTS, part % PARTS]
        half, quarter = (part >> 3) * 2 + (part >> 1 & 1), (part >> 2 & 1) * 2 + (part & 1)
        first = _cell_rank(half, int(coarse) & 3) + 4 * _cell_rank(quarter, int(coarse) >> (2 + 2 * half) & 3)
        if fraction <= 0 or first >= fraction * TILE * TILE:
            continue
        a0, b0 = tile_along * TILE + part // PARTS * SIDE, tile_across * TILE + part % PARTS * SIDE
        w0, w1, _, _ = random_keys.philox(a0 & 0xFFFFFFFF, b0 & 0xFFFFFFFF, scale, PART_ORDER, k0, k1)
        fine = np.uint64(w0) | np.uint64(w1) << np.uint64(32)
        for number in range(CELLS):
            order = first + PARTS * PARTS * number
            if order >= fraction * TILE * TILE:
                break
            da, db = _cell_of_rank(number, fine)
            row[n], column[n], rank[n] = a0 + da, b0 + db, order
            n += 1
    return n


@njit(cache=True, nogil=True)
def _cell_of_rank(number: int, scrambles: np.uint64) -> tuple[int, int]:
    """Row and column, within a part, of the cell at a rank `number` of the part's order."""
    node, a, b, level_start = 0, 0, 0, 0
    for _ in range(3):
        scramble = int(scrambles >> np.uint64(2 * (level_start + node))) & 3
        square = (0, 3, 1, 2)[number & 3] ^ scramble
        a, b = 2 * a + (square >> 1), 2 * b + (square & 1)
        level_start = 4 * level_start + 1
        node = 4 * node + square
        number >>= 2
    return a, b
