"""Points of tiles that come again in the next ping: what was worked out for them is held, up to a bound.

Memory is given out from one end to the other. When half of all is full it becomes the older half, and a new one is
begun; rows of the older half that are read again move over, and the rest is deleted with it. Rows that others still
read stay in place.
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
    """Rows of tiles, and the table that finds them."""

    def __init__(self, capacity: int) -> None:
        self.rows = np.empty((capacity, COLUMNS))  # costs nothing until it is written to
        self.used = 0
        self.table = np.zeros((_MIN_SLOTS, 3), np.int64)
        self.tiles = 0

    def room_for(self, tiles: int) -> None:
        """Make the table wide enough for so many more tiles, half of it empty."""
        slots = len(self.table)
        while slots < 2 * (self.tiles + tiles) + 2:
            slots *= 2
        if slots > len(self.table):
            there = self.table[self.table[:, 2] > 0]
            self.table = np.zeros((slots, 3), np.int64)
            kernel.put(*(np.ascontiguousarray(column) for column in there.T), self.table)


class ScattererTerrainCache:
    """Rows of three numbers for the points of tiles, by the tile's key. Threads may share it."""

    def __init__(self, max_bytes: int) -> None:
        """Nothing yet.

        Args:
            max_bytes: Size of all rows beyond which the least recently used are deleted [bytes].
        """
        self.max_bytes, self._lock = max_bytes, Lock()
        self._now = self._old = _Half(self._capacity(0))

    def __reduce__(self) -> tuple[type["ScattererTerrainCache"], tuple[int]]:
        """Another process begins with nothing."""
        return ScattererTerrainCache, (self.max_bytes,)

    def _capacity(self, wanted: int) -> int:
        return max(self.max_bytes // (2 * COLUMNS * 8), wanted)

    def rows_of(
        self, key: Integers, size: Integers, make: Callable[[Integers, Integers], Floats]
    ) -> tuple[Floats, Integers]:
        """The first rows of some tiles: what was worked out of them before is not worked out again.

        Args:
            key: Keys of the tiles, each once, shape (tiles,).
            size: Rows wanted of each, likewise, 1 or more.
            make: Works out the rows of some of these tiles from one on, one tile after the other, shape (rows, 3):
                given which tiles, and how many of their first rows are known.

        Returns:
            Rows, and where among them each tile begins, shape (tiles,).
        """
        start, known = np.empty(len(key), np.int64), np.empty(len(key), np.int64)
        with self._lock:
            if self._now.used + size.sum() > len(self._now.rows):
                self._old, self._now = self._now, _Half(self._capacity(int(size.sum())))
            half, old = self._now, self._old
            half.room_for(len(key))
            half.used, new = kernel.find(key, size, half.table, half.rows, old.table, old.rows, half.used, start, known)
            half.tiles += new
        rows = np.flatnonzero(known < size)
        if len(rows):
            kernel.fill(make(rows, known[rows]), start[rows], known[rows], size[rows], half.rows)
            with self._lock:
                half.room_for(len(rows))
                half.tiles += kernel.put(key[rows], start[rows], size[rows], half.table)
        return half.rows, start
