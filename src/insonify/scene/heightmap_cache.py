"""Cache of heightmap tiles in contiguous memory, which kernels read.

A kernel that finds a tile missing marks it and continues with the next point; marked tiles are then synthesised and the
remaining points evaluated again. The positions of bounces are therefore not needed beforehand.

Memory has two halves. When the current half is full a new one is begun; tiles of the previous half that are read again
are copied into it, the others are deleted with that half.
"""

import math
from collections.abc import Callable
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]
TileNumber = tuple[int, int]
SHIFT = 6
CELLS = 1 << SHIFT
"""Cells along the side of one tile of the map."""
NODES = CELLS + 1
HALF_BYTES = 224 << 20
"""Memory of a half, 13 thousand tiles [bytes]; if a ping needs more, all are synthesised in every ping."""


class HeightmapTiles(NamedTuple):
    """Immutable view of some tiles of a map, with the row of each."""

    corner_a: int
    """Number of the first row of tiles."""
    corner_b: int
    """Number of the first column."""
    cell: float
    """Side of a cell [m]."""
    row_of: NDArray[np.int32]
    """Row of each tile in `heights`, -1 for a missing one, as always at the border, (rows x columns,)."""
    heights: Singles
    """Heights on the nodes [m], (tiles x nodes x nodes,)."""


class HeightmapCache:
    """The tiles of one map, which grow as they are read. Threads may share it."""

    def __init__(self, max_bytes: int = 2 * HALF_BYTES) -> None:
        """Create an empty cache.

        Args:
            max_bytes: Size of all tiles beyond which the least recently used are deleted [bytes].
        """
        self.max_bytes, self._lock = max_bytes, Lock()
        self._start_new_half()
        self._previous_half = self._begin, self._row_of, self._heights

    def __reduce__(self) -> tuple[type["HeightmapCache"], tuple[int]]:
        """Reduce to an empty cache: another process starts without tiles."""
        return HeightmapCache, (self.max_bytes,)

    def _start_new_half(self) -> None:
        self._begin: TileNumber = (0, 0)
        self._end: TileNumber = (0, 0)
        self._row_of = np.full((0, 0), -1, np.int32)
        self._workspace = max(self.max_bytes // 2 // (NODES**2 * 4), 2)
        # a quarter more for the tiles of one more call; pages of memory that are not written to are not allocated
        capacity = self._workspace + self._workspace // 4 + 1
        self._heights, self._used = np.empty((capacity, NODES, NODES), np.float32), 1
        self._heights[0] = 0  # read in place of missing tiles

    def serve_kernel(
        self, cell: float, low: NDArray[np.float64], high: NDArray[np.float64],
        tile: Callable[[int, int], NDArray[np.floating]],
        evaluate: Callable[[HeightmapTiles, NDArray[np.bool_]], bool],
    ) -> None:  # fmt: skip
        """Evaluate a kernel, and synthesise the tiles that it lacks, until none is missing.

        Args:
            cell: Side of a cell [m].
            low: Least coordinates on the map that are likely to be read [m], shape (2,).
            high: Greatest coordinates, shape (2,).
            tile: Function that returns the tile of a row and a column, shape (nodes, nodes).
            evaluate: Function that evaluates the remaining points and marks missing tiles; returns True if none is.
        """
        side = CELLS * cell
        begin = math.floor(low[0] / side) - 2, math.floor(low[1] / side) - 2
        end = math.floor(high[0] / side) + 3, math.floor(high[1] / side) + 3
        with self._lock:
            if self._used >= self._workspace:
                self._previous_half = self._begin, self._row_of, self._heights
                self._start_new_half()
            previous = self._previous_half
        new_tiles: dict[TileNumber, NDArray[np.floating]] = {}
        while True:
            with self._lock:
                self._extend_table(begin, end)
                if new_tiles:  # another thread may have begun a new half since
                    rows, columns = zip(*new_tiles, strict=True)
                    self._extend_table((min(rows) - 1, min(columns) - 1), (max(rows) + 2, max(columns) + 2))
                    self._add_tiles(new_tiles)
                corner, shape = self._begin, self._row_of.shape
                tiles = HeightmapTiles(*corner, cell, self._row_of.ravel(), self._heights.ravel())
            missing = np.zeros(shape, bool)
            if evaluate(tiles, missing):
                return
            if missing[0, 0]:  # beyond the border
                begin = begin[0] - shape[0], begin[1] - shape[1]
                end = end[0] + shape[0], end[1] + shape[1]
                missing[0, 0] = False
            new_tiles = {}
            for a, b in (np.array(corner) + np.argwhere(missing)).tolist():
                cached = _find(previous, a, b)
                new_tiles[a, b] = tile(a, b) if cached is None else cached

    def _extend_table(self, begin: TileNumber, end: TileNumber) -> None:
        """Extend the table of rows to a range of tile numbers; arrays that other threads read are not changed."""
        first, last = self._begin, self._end
        if not self._row_of.size:
            first, last = begin, end
        elif begin[0] >= first[0] and begin[1] >= first[1] and end[0] <= last[0] and end[1] <= last[1]:
            return
        begin = min(begin[0], first[0]), min(begin[1], first[1])
        end = max(end[0], last[0]), max(end[1], last[1])
        row_of = np.full((end[0] - begin[0], end[1] - begin[1]), -1, np.int32)
        a, b = first[0] - begin[0], first[1] - begin[1]
        row_of[a : a + self._row_of.shape[0], b : b + self._row_of.shape[1]] = self._row_of
        self._begin, self._end, self._row_of = begin, end, row_of

    def _add_tiles(self, new_tiles: dict[tuple[int, int], NDArray[np.floating]]) -> None:
        """Add tiles; arrays that other threads read are not changed."""
        row_of, heights = self._row_of.copy(), self._heights
        by_entry = {(a - self._begin[0], b - self._begin[1]): tile for (a, b), tile in new_tiles.items()}
        new = {entry: tile for entry, tile in by_entry.items() if row_of[entry] < 0}
        if not new:
            return
        if self._used + len(new) > len(heights):  # one call reads more tiles than fit
            heights = np.empty((2 * (self._used + len(new)), NODES, NODES), np.float32)
            heights[: self._used] = self._heights[: self._used]
        for entry, tile in new.items():
            heights[self._used], row_of[entry] = tile, self._used
            self._used += 1
        self._row_of, self._heights = row_of, heights


def _find(half: tuple[TileNumber, NDArray[np.int32], Singles], along: int, across: int) -> NDArray[np.floating] | None:
    """One tile of a half of the cache (first tile number, row of each tile, heights); None if it is not cached."""
    begin, row_of, heights = half
    i, j = along - begin[0], across - begin[1]
    if not (0 <= i < row_of.shape[0] and 0 <= j < row_of.shape[1]) or row_of[i, j] < 0:
        return None
    return heights[row_of[i, j]]
