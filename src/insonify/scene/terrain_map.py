"""The terrain as a map of heights and slopes on square tiles, synthesised once and read by many pings.

Tiles are synthesised when a radial first crosses them (`insonify.scene.heightmap_synthesis`); when memory is full, the
least recently used are replaced first.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from threading import Condition, Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.scene._tile_cache_kernel import EMPTY, begin_reading, claim, fits
from insonify.scene.seabed_terrain import TILE_CELLS, SeabedTerrain

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Mapper = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]

CACHE_SIDE = 512
"""Tiles along each side of a square area of terrain within which no two tiles have the same entry of the table."""
MAX_TILES = 3072
"""Number of cached tiles: about 150 MB."""
MIN_NEW_ROWS = 512
"""Number of tiles for which new memory is always used; beyond it, the least recently used are replaced first."""
RECENT_READS = 64
"""Number of latest readings whose tiles are likely to be read again."""
PARTS = 2
"""Number of parts into which the synthesis of missing tiles is divided."""
_UNFILLED, _IN_PROGRESS, _FILLED = range(3)


@dataclass
class TerrainMap:
    """Tiles of the map of one seabed, shared by threads: tiles read within `reading` are not replaced meanwhile."""

    terrain: SeabedTerrain

    def __post_init__(self) -> None:
        """Create an empty map."""
        self.cell = self.terrain.heightmap_cell_size
        """Side of a cell [m]."""
        self._change = Condition()
        self.nodes: Singles = np.empty((MAX_TILES, TILE_CELLS + 1, TILE_CELLS + 1, 3), np.float32)
        """Height [m] and slopes along the lattice's axes [1] on the nodes of each tile."""
        self.slot = np.full((CACHE_SIDE, CACHE_SIDE), -1, np.int64)
        """Row in `nodes` of each tile, -1 for none, by the tile's numbers modulo `CACHE_SIDE`."""
        self.number = np.full((CACHE_SIDE, CACHE_SIDE, 2), EMPTY, np.int64)
        """Numbers of the tile in each slot."""
        self._tiles = np.full((MAX_TILES, 2), EMPTY, np.int64)
        self._last_read = np.zeros(MAX_TILES, np.int64)
        self._readers = np.zeros(MAX_TILES, np.int64)
        self._state = np.full(MAX_TILES, _UNFILLED, np.int8)
        self._reading_count, self._used = 0, 0
        self._synthesizer = self.terrain.heightmap_synthesizer

    @contextmanager
    def reading(self, tiles: NDArray[np.int64], map_function: Mapper = map) -> Iterator[NDArray[np.int64]]:
        """Context within which tiles are synthesised and not replaced.

        Any number of threads may read at a time. A thread whose tiles do not fit beside those being read waits until
        other readers have finished.

        Args:
            tiles: Numbers of the tiles, each once, shape (n, 2), n up to `MAX_TILES`.
            map_function: A function like `map`, which may use several threads.

        Returns:
            Row in `nodes` of each, shape (n,).
        """
        tiles = np.ascontiguousarray(tiles)
        with self._change:
            self._change.wait_for(lambda: self._fits(tiles))
            self.claim(tiles)
            rows = np.empty(len(tiles), np.int64)
            begin_reading(tiles, self.slot, self._readers, rows)
        try:
            while not (self._state[rows] == _FILLED).all():
                self._synthesize_missing(rows, map_function)
            yield rows
        finally:
            with self._change:
                self._readers[rows] -= 1
                self._change.notify_all()

    def _synthesize_missing(self, rows: NDArray[np.int64], map_function: Mapper) -> None:
        """Synthesise the tiles that no other thread synthesises, and wait for the others."""
        with self._change:
            claimed = rows[self._state[rows] == _UNFILLED]
            self._state[claimed] = _IN_PROGRESS

        def synthesize(part: NDArray[np.int64]) -> None:
            self.synthesize(part)
            self._state[part] = _FILLED

        try:
            list(map_function(synthesize, [claimed[k::PARTS] for k in range(PARTS)]))
        except BaseException:
            with self._change:  # after an error another thread may synthesise them
                self._state[claimed[self._state[claimed] == _IN_PROGRESS]] = _UNFILLED
                self._change.notify_all()
            raise
        with self._change:
            self._change.notify_all()
            self._change.wait_for(lambda: not (self._state[rows] == _IN_PROGRESS).any())

    def _fits(self, tiles: NDArray[np.int64]) -> bool:
        """Return True if there are enough rows besides those that other threads read."""
        return bool(fits(tiles, self.slot, self.number, self._readers))

    def claim(self, tiles: NDArray[np.int64]) -> NDArray[np.int64]:
        """Assign rows to tiles.

        Args:
            tiles: Numbers of the tiles that will be read together, each once, shape (n, 2), n up to `MAX_TILES`.

        Returns:
            Rows in `nodes` of those that must be synthesised first.
        """
        self._reading_count += 1
        new_rows = np.empty(len(tiles), np.int64)
        count, self._used = claim(
            tiles, self.slot, self.number, self._tiles, self._last_read, self._readers, self._reading_count, self._used,
            MIN_NEW_ROWS, RECENT_READS, new_rows,
        )  # fmt: skip
        self._state[new_rows[:count]] = _UNFILLED
        return new_rows[:count]

    def synthesize(self, rows: NDArray[np.int64]) -> None:
        """Synthesise tiles into their rows, from the coarsest octave to the finest.

        Args:
            rows: Rows of the tiles, from `claim`.
        """
        self._synthesizer.synthesize(rows, self._tiles, self.nodes)


def terrain_map(terrain: SeabedTerrain) -> TerrainMap:
    """The map of a seabed, the same object for equal seabeds."""
    with _LOCK:
        return _terrain_map(terrain)


@lru_cache(maxsize=4)
def _terrain_map(terrain: SeabedTerrain) -> TerrainMap:
    return TerrainMap(terrain)


_LOCK = Lock()


def empty_terrain_map() -> tuple[Any, ...]:
    """Placeholders of the nodes and slots of a map, for a flat seabed."""
    return np.zeros((1, 2, 2, 3), np.float32), np.zeros((1, 1), np.uint32)
