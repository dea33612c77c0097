"""Cache of heightmap tiles in contiguous memory, which kernels read.

A kernel that finds a tile missing marks it and continues with the next point; marked tiles are then synthesised and the
remaining points evaluated again. The positions of bounces are therefore not needed beforehand.

Memory has two halves. When the current half is full a new one is begun; tiles of the previous half that are read again
are copied into it, the others are deleted with that half. A half holds a few times what pings read again, so that the
memory of a long straight survey does not grow: it is enlarged where much is copied, or synthesised a second time. The
memory of a deleted half is used again unless a kernel still reads it.
"""

import math
from collections.abc import Callable
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]
TileNumber = tuple[int, int]
HalfView = tuple[TileNumber, NDArray[np.int32], Singles]
"""First tile number of a half, row of each tile, and heights, as they are at one moment."""
SHIFT = 6
"""Binary logarithm of `CELLS`."""
CELLS = 1 << SHIFT
"""Cells along the side of one tile of the map."""
NODES = CELLS + 1
"""Number of nodes along the side of one tile; adjacent tiles share those on their border."""
HALF_BYTES = 224 << 20
"""Memory of a half at most, 13 thousand tiles [bytes]; if a ping needs more, all are synthesised in every ping."""
MIN_TILES = 512
"""Initial number of tiles of a half [1]."""
COPIED = 0.6
"""Fraction of a half that is copied from the previous one, above which the next is larger [1]: copies cost a sidescan
survey 0.1 % of its time, and at half this fraction its terrain took twice the memory."""


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


class _Half:
    """Tiles, and the table of their rows."""

    def __init__(self, capacity: int) -> None:
        # a quarter more for the tiles of one more call; pages of memory that are not written to are not allocated
        self.heights = np.empty((capacity + capacity // 4 + 2, NODES, NODES), np.float32)
        self.capacity, self.readers = capacity, 0
        self.clear()

    def clear(self) -> None:
        """Delete all tiles; their memory is used again."""
        self.begin: TileNumber = (0, 0)
        self.end: TileNumber = (0, 0)
        self.row_of = np.full((0, 0), -1, np.int32)
        self.heights[0], self.used = 0, 1  # read in place of missing tiles
        self.copied = self.made = self.made_again = 0  # tiles: from the previous half, added, synthesised again

    def extend_table(self, begin: TileNumber, end: TileNumber) -> None:
        """Extend the table of rows to a range of tile numbers; arrays that other threads read are not changed."""
        first, last = self.begin, self.end
        if not self.row_of.size:
            first, last = begin, end
        elif begin[0] >= first[0] and begin[1] >= first[1] and end[0] <= last[0] and end[1] <= last[1]:
            return
        begin = min(begin[0], first[0]), min(begin[1], first[1])
        end = max(end[0], last[0]), max(end[1], last[1])
        row_of = np.full((end[0] - begin[0], end[1] - begin[1]), -1, np.int32)
        a, b = first[0] - begin[0], first[1] - begin[1]
        row_of[a : a + self.row_of.shape[0], b : b + self.row_of.shape[1]] = self.row_of
        self.begin, self.end, self.row_of = begin, end, row_of

    def add(self, new_tiles: dict[TileNumber, NDArray[np.floating]]) -> None:
        """Add tiles; arrays that other threads read are not changed."""
        row_of, heights = self.row_of.copy(), self.heights
        by_entry = {(a - self.begin[0], b - self.begin[1]): tile for (a, b), tile in new_tiles.items()}
        new = {entry: tile for entry, tile in by_entry.items() if row_of[entry] < 0}
        if not new:
            return
        if self.used + len(new) > len(heights):  # one call reads more tiles than fit
            heights = np.empty((2 * (self.used + len(new)), NODES, NODES), np.float32)
            heights[: self.used] = self.heights[: self.used]
        for entry, tile in new.items():
            heights[self.used], row_of[entry] = tile, self.used
            self.used += 1
        self.row_of, self.heights = row_of, heights


def _find(half: HalfView, along: int, across: int) -> NDArray[np.floating] | None:
    """One tile of a half; None if it is not there."""
    begin, row_of, heights = half
    i, j = along - begin[0], across - begin[1]
    if not (0 <= i < row_of.shape[0] and 0 <= j < row_of.shape[1]) or row_of[i, j] < 0:
        return None
    return heights[row_of[i, j]]


class HeightmapCache:
    """The tiles of one map, which grow as they are read. Threads may share it."""

    def __init__(self, max_bytes: int = 2 * HALF_BYTES, min_tiles: int = MIN_TILES) -> None:
        """Create an empty cache.

        Args:
            max_bytes: Size of all tiles beyond which the least recently used are deleted [bytes].
            min_tiles: Initial number of tiles of a half.
        """
        self.max_bytes, self.min_tiles, self._lock = max_bytes, min_tiles, Lock()
        self._most = max(max_bytes // 2 // (NODES**2 * 4), 2)
        self._current = self._previous = _Half(min(min_tiles, self._most))
        self._deleted: dict[TileNumber, None] = {}

    def __reduce__(self) -> tuple[type["HeightmapCache"], tuple[int, int]]:
        """Reduce to an empty cache: another process starts without tiles."""
        return HeightmapCache, (self.max_bytes, self.min_tiles)

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
            half, previous = self._halves()
            half.readers, previous.readers = half.readers + 1, previous.readers + 1
            # another thread that began when this half was the current one may go on to add tiles to it
            known = previous.begin, previous.row_of, previous.heights
        try:
            self._serve(half, known, cell, (begin, end), tile, evaluate)
        finally:
            with self._lock:
                half.readers, previous.readers = half.readers - 1, previous.readers - 1

    def _serve(
        self, half: _Half, previous: HalfView, cell: float, extent: tuple[TileNumber, TileNumber],
        tile: Callable[[int, int], NDArray[np.floating]],
        evaluate: Callable[[HeightmapTiles, NDArray[np.bool_]], bool],
    ) -> None:  # fmt: skip
        """Evaluate a kernel on the tiles of a half; other arguments are those of `serve_kernel`.

        Args:
            half: The current half.
            previous: The previous half.
            cell: Side of a cell [m].
            extent: Numbers of the first tile, and one past those of the last, that are likely to be read.
            tile: Function that synthesises a tile.
            evaluate: Function that evaluates the remaining points.
        """
        begin, end = extent
        new_tiles: dict[TileNumber, NDArray[np.floating]] = {}
        while True:
            with self._lock:
                half.extend_table(begin, end)
                if new_tiles:
                    half.add(new_tiles)
                corner, shape = half.begin, half.row_of.shape
                tiles = HeightmapTiles(*corner, cell, half.row_of.ravel(), half.heights.ravel())
            missing = np.zeros(shape, bool)
            if evaluate(tiles, missing):
                return
            if missing[0, 0]:  # beyond the border
                begin = begin[0] - shape[0], begin[1] - shape[1]
                end = end[0] + shape[0], end[1] + shape[1]
                missing[0, 0] = False
            new_tiles, again = {}, 0
            for number in map(tuple, (np.array(corner) + np.argwhere(missing)).tolist()):
                cached = _find(previous, *number)
                again += cached is None and number in self._deleted
                new_tiles[number] = tile(*number) if cached is None else cached
                half.copied += cached is not None
            half.made, half.made_again = half.made + len(new_tiles), half.made_again + again

    def _halves(self) -> tuple[_Half, _Half]:
        """Current and previous half, with unused rows in the current one."""
        full, retired = self._current, self._previous
        if full.used < full.capacity:
            return full, retired
        is_crowded = full.copied > COPIED * full.capacity or 2 * full.made_again > full.made
        capacity = min(full.capacity * 2 if is_crowded else full.capacity, self._most)
        if retired is not full:
            for number in (np.array(retired.begin) + np.argwhere(retired.row_of >= 0)).tolist():
                self._deleted[tuple(number)] = None
            self._deleted = dict.fromkeys(list(self._deleted)[-2 * self._most :])
        if retired is full or retired.readers or retired.capacity < capacity:
            retired = _Half(capacity)
        retired.clear()
        self._current, self._previous = retired, full
        return retired, full
