"""All points of some tiles as columns, cell by cell, in the order of their priority."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.jit import njit
from insonify.scene.scatterer_grid import (
    BASE_PITCH,
    PARTS,
    SIDE,
    TILE,
    Tiles,
    max_point_count,
    priority_ordered_cells,
)  # fmt: skip
from insonify.scene.scatterers import grid_scatterer_id

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class JitteredPoints(NamedTuple):
    """Random points in cells of some tiles, columns of shape (n,)."""

    stream: int
    """Stream of the interface."""
    level: Integers
    """Level of the cell."""
    row: Integers
    """Number of the cell along the grid's first axis."""
    column: Integers
    """Number of the cell along the grid's second axis."""
    along: Floats
    """Coordinate of the scatterer along the grid's first axis [m]."""
    across: Floats
    """Coordinate of the scatterer along the grid's second axis [m]."""
    turn: Floats
    """Phase of the place, in turns."""
    priority: Floats
    """Uniform number below one that belongs to the scatterer: a part p of them are those below p."""
    tile: Integers
    """Row of the tile among the given ones."""
    rank: Integers
    """Place in the tile's order, 0 to TILE * TILE - 1: the whole part of its size times the priority."""

    @property
    def area(self) -> Floats:
        """Of the cell [m^2]."""
        return np.square(np.ldexp(BASE_PITCH, self.level))

    @property
    def phase(self) -> NDArray[np.complex128]:
        """Unit phasor of the place [1]."""
        return np.exp(2j * np.pi * self.turn)

    @property
    def scatterer_id(self) -> NDArray[np.uint64]:
        """Key of the place."""
        return grid_scatterer_id(self.stream, self.level, self.row, self.column)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> "JitteredPoints":
        """Select some rows."""
        columns: list[Any] = [column[rows] for column in self[1:]]
        return JitteredPoints(self.stream, *columns)


def jittered_points(tiles: Tiles, seed: int, stream: int, priority_limit: Floats | None = None) -> JitteredPoints:
    """Points of some tiles, tile by tile, part by part, by increasing priority; all or those below some priorities."""
    fraction = np.ones((len(tiles.scale), PARTS, PARTS)) if priority_limit is None else priority_limit
    count = max_point_count(fraction)
    kinds = (np.int64,) * 3 + (float,) * 4 + (np.int64,) * 2
    columns: list[Any] = [np.empty(count, kind) for kind in kinds]
    count = _draw(*tiles, fraction, *random_keys.stream_key(seed, stream), *columns)
    return JitteredPoints(stream, *(column[:count] for column in columns))


@njit(cache=True)
def _draw(
    tile_level: Integers, tile_along: Integers, tile_across: Integers, most: Floats, k0: int, k1: int, level: Integers,
    row: Integers, column: Integers, along: Floats, across: Floats, turn: Floats, priority: Floats, tile: Integers,
    rank: Integers,
) -> int:  # fmt: skip
    """Fill the columns of `JitteredPoints`; their number is returned."""
    words, n = np.empty((4, TILE * TILE), np.uint32), 0
    for t in range(tile_level.size):
        scale = tile_level[t]
        pitch = BASE_PITCH * 2.0**scale
        last = n + priority_ordered_cells(
            scale, tile_along[t], tile_across[t], most[t], k0, k1, row[n:], column[n:], rank[n:]
        )
        random_keys.philox_at(row[n:last], column[n:last], scale, 0, k0, k1, words)
        first = n
        for m in range(first, last):
            w = m - first
            before = (rank[m] + random_keys.uniform_from_word(words[3, w])) / (TILE * TILE)
            a, b = row[m], column[m]
            if before >= most[t, a % TILE // SIDE, b % TILE // SIDE]:
                continue
            level[n], row[n], column[n], tile[n], rank[n], priority[n] = scale, a, b, t, rank[m], before
            along[n] = (a + random_keys.uniform_from_word(words[0, w])) * pitch
            across[n] = (b + random_keys.uniform_from_word(words[1, w])) * pitch
            turn[n] = random_keys.uniform_from_word(words[2, w])
            n += 1
    return n
