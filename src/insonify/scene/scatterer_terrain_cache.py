"""Cache of bounded size for terrain samples at the points of tiles, which are needed again at the next ping.

Memory has two halves. When the current half is full it becomes the previous one, and a new half is begun; rows of the
previous half that are read again are copied, the others are deleted with that half. Rows that other threads still read
are not moved.
"""

from collections.abc import Callable
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from insonify.scene import _scatterer_terrain_cache_kernel as kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

COLUMNS = 3
_MIN_SLOTS = 4096


class _Half:
    """Rows of tiles, and the hash table of their positions."""

    def __init__(self, capacity: int) -> None:
        self.rows = np.empty((capacity, COLUMNS))  # memory is not allocated until it is written to
        self.used = 0
        self.table = np.zeros((_MIN_SLOTS, 3), np.int64)
        self.tiles = 0

    def reserve(self, tiles: int) -> None:
        """Enlarge the table for a number of further tiles, so that at least half of it is empty."""
        slots = len(self.table)
        while slots < 2 * (self.tiles + tiles) + 2:
            slots *= 2
        if slots > len(self.table):
            entries = self.table[self.table[:, 2] > 0]
            self.table = np.zeros((slots, 3), np.int64)
            kernel.put(*(np.ascontiguousarray(column) for column in entries.T), self.table)


class ScattererTerrainCache:
    """Rows of three numbers for the points of tiles, by the tile's key. Threads may share it."""

    def __init__(self, max_bytes: int) -> None:
        """Create an empty cache.

        Args:
            max_bytes: Size of all rows beyond which the least recently used are deleted [bytes].
        """
        self.max_bytes, self._lock = max_bytes, Lock()
        self._current = self._previous = _Half(self._capacity(0))

    def __reduce__(self) -> tuple[type["ScattererTerrainCache"], tuple[int]]:
        """Reduce to an empty cache: another process starts without rows."""
        return ScattererTerrainCache, (self.max_bytes,)

    def _capacity(self, least: int) -> int:
        return max(self.max_bytes // (2 * COLUMNS * 8), least)

    def rows_of(
        self, key: Integers, size: Integers, evaluate: Callable[[Integers, Integers], Floats]
    ) -> tuple[Floats, Integers]:
        """Rows of some tiles, from the cache or else evaluated.

        Args:
            key: Keys of the tiles, each once, shape (tiles,).
            size: Number of rows of each tile, 1 or more, shape (tiles,).
            evaluate: Function of the indices of tiles and the number of cached rows of each, which returns the missing
                rows, tile by tile, shape (rows, 3).

        Returns:
            Rows, shape (any, 3), and the first row of each tile among them, shape (tiles,).
        """
        start, known = np.empty(len(key), np.int64), np.empty(len(key), np.int64)
        with self._lock:
            if self._current.used + size.sum() > len(self._current.rows):
                self._previous, self._current = self._current, _Half(self._capacity(int(size.sum())))
            half, old = self._current, self._previous
            half.reserve(len(key))
            half.used, new = kernel.find(key, size, half.table, half.rows, old.table, old.rows, half.used, start, known)
            half.tiles += new
        rows = np.flatnonzero(known < size)
        if len(rows):
            kernel.fill(evaluate(rows, known[rows]), start[rows], known[rows], size[rows], half.rows)
            with self._lock:
                half.reserve(len(rows))
                half.tiles += kernel.put(key[rows], start[rows], size[rows], half.table)
        return half.rows, start
