"""Scatterers drawn in the tiles of one boundary, which are needed again at the next ping, in memory of bounded size.

A tile's scatterers are in order of priority: a ping that may keep some of them needs the first so many. Memory has two
halves. When the current half is full it becomes the previous one, and the memory of that before is used again; rows of
the previous half that are read again are copied, the others are deleted with that half. Fresh memory costs more time
than the rows themselves, above all on a virtual machine, so halves are as small as pings allow, and memory that no
thread reads is used again.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.scene import _drawn_tiles_kernel as kernel
from insonify.scene.scatterer_grid import DrawnScatterers, Tiles, draw_cells
from insonify.scene.scatterers import Boundary, grid_scatterer_id
from insonify.scene.seabed_terrain import SeabedTerrain

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MIN_ROWS = 1 << 19
"""Initial number of rows of a half: twice those of a sidescan ping. They stay in the processor's cache."""
MAX_BYTES = 192 << 20
"""Size of all rows of a boundary, beyond which the least recently used are deleted [bytes]."""
ENOUGH = 0.5
"""Fraction of the requested rows that are in memory, below which the next half is twice as large [1]."""
_MIN_SLOTS = 4096
"""Initial number of slots of the table of a half, a power of two."""


class _DrawnHalf:
    """Rows of tiles, and the hash table of their positions."""

    def __init__(self, capacity: int, *, has_terrain: bool) -> None:
        # memory is not allocated until it is written to
        self.rows = DrawnScatterers(np.empty(capacity, np.uint16), np.empty((capacity if has_terrain else 0, 3)))
        self.capacity, self.readers = capacity, 0
        self.clear()

    def clear(self) -> None:
        """Delete all rows; their memory is used again."""
        self.used = self.tiles = self.requested = self.found = 0
        self.table = np.zeros((_MIN_SLOTS, 3), np.int64)

    def reserve(self, tiles: int) -> None:
        """Enlarge the table for a number of further tiles, so that at least half of it is empty."""
        slots = len(self.table)
        while slots < 2 * (self.tiles + tiles) + 2:
            slots *= 2
        if slots > len(self.table):
            entries = self.table[self.table[:, 2] > 0]
            self.table = np.zeros((slots, 3), np.int64)
            kernel.put(*(np.ascontiguousarray(column) for column in entries.T), self.table)


class DrawnTiles:
    """Scatterers of the tiles of one boundary, by the tile's key. Threads may share it."""

    def __init__(
        self, boundary: Boundary, seed: int, terrain: SeabedTerrain | None = None, min_rows: int = MIN_ROWS,
        max_bytes: int = MAX_BYTES,
    ) -> None:  # fmt: skip
        """Create an empty cache.

        Args:
            boundary: Seabed or surface.
            seed: Seed of the scatterers.
            terrain: Terrain on which they lie; None: a plane.
            min_rows: Initial number of rows of a half.
            max_bytes: Size of all rows beyond which the least recently used are deleted [bytes].
        """
        self.boundary, self.seed, self.terrain = boundary, seed, terrain
        self.min_rows, self.max_bytes, self._lock = min_rows, max_bytes, Lock()
        self._current = self._previous = _DrawnHalf(min_rows, has_terrain=terrain is not None)

    def __reduce__(self) -> tuple[type["DrawnTiles"], tuple[Boundary, int, SeabedTerrain | None, int, int]]:
        """Reduce to an empty cache: another process starts without rows."""
        return DrawnTiles, (self.boundary, self.seed, self.terrain, self.min_rows, self.max_bytes)

    @property
    def stream(self) -> int:
        """Stream of the random numbers."""
        return random_keys.SEABED if self.boundary == "seabed" else random_keys.SURFACE

    @contextmanager
    def reading(self, tiles: Tiles, size: Integers) -> Iterator[tuple[DrawnScatterers, Integers]]:
        """The first scatterers of some tiles, from the cache or else drawn, as long as the context is open.

        Args:
            tiles: The tiles, each once.
            size: Number of scatterers of each tile, 0 or more, shape (tiles,).

        Returns:
            Scatterers, and the first row of each tile among them, shape (tiles,).
        """
        key = grid_scatterer_id(self.stream, tiles.scale, tiles.along, tiles.across).view(np.int64)
        start, known = np.empty(len(key), np.int64), np.empty(len(key), np.int64)
        with self._lock:
            half, old = self._halves(int(size.sum()))
            half.reserve(len(key))
            half.used, new = kernel.find(key, size, half.table, half.rows, old.table, old.rows, half.used, start, known)
            half.tiles += new
            half.requested, half.found = half.requested + int(size.sum()), half.found + int(known.sum())
            half.readers += 1
        try:
            missing = np.flatnonzero(known < size)
            if len(missing):
                self._draw(tiles.take(missing), key[missing], start[missing], known[missing], size[missing], half)
            yield half.rows, start
        finally:
            with self._lock:
                half.readers -= 1

    def _halves(self, requested: int) -> tuple[_DrawnHalf, _DrawnHalf]:
        """Current and previous half, with unused rows in the current one."""
        if self._current.used + requested > self._current.capacity:
            full, retired = self._current, self._previous
            growth = 1 if full.found >= ENOUGH * full.requested else 2
            most = max(self.max_bytes // 2 // (26 if self.terrain is not None else 2), self.min_rows)
            capacity = max(min(growth * full.capacity, most), requested)
            if retired is full or retired.readers or retired.capacity < capacity:
                retired = _DrawnHalf(capacity, has_terrain=self.terrain is not None)
            retired.clear()
            self._current, self._previous = retired, full
        return self._current, self._previous

    def _draw(
        self, tiles: Tiles, key: Integers, start: Integers, known: Integers, size: Integers, half: _DrawnHalf
    ) -> None:  # fmt: skip
        """Draw the missing scatterers of some tiles into their rows of a half."""
        cells = draw_cells(tiles, self.seed, self.stream, known, size)
        rows = DrawnScatterers(cells.cell, np.empty((0, 3)))
        if self.terrain is not None:
            relief = self.terrain.relief.resolved
            rows = rows._replace(
                terrain=relief.gradient_rows_in_world(relief.sample_in_grid_axes(cells.along, cells.across))
            )
        kernel.fill(rows, start, known, size, half.rows)
        with self._lock:
            half.reserve(len(key))
            half.tiles += kernel.put(key, start, size, half.table)
