"""The terrain as a map that is drawn once and read by many pings: heights and slopes on square pieces, side by side.

Pieces are made where a line first crosses them (`insonify.scene.heightmap_synthesis`), and forgotten when room is
wanted, the oldest first.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from threading import Condition, Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.scene._tile_cache_kernel import EMPTY, claim, fits
from insonify.scene.seabed_terrain import TILE_CELLS, SeabedTerrain

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Mapped = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]

AROUND = 512
"""Pieces along each side of the stretch of ground within which all pieces have places of their own."""
MAX_PIECES = 3072
"""Pieces that are kept: some 150 MB."""
FRESH = 512
"""Tiles that have new memory in any case; beyond them, the least recently used are replaced first."""
RECENT_READS = 64
"""Readings within which a tile is likely to be read again."""
PARTS = 2
"""Parts into which pieces that must be drawn are shared."""
_BLANK, _BEGUN, _DRAWN = range(3)


@dataclass
class TerrainMap:
    """Pieces of one bed's map, shared by threads: what is read under `reading` stays where it is meanwhile."""

    terrain: SeabedTerrain

    def __post_init__(self) -> None:
        """Nothing drawn yet."""
        self.cell = self.terrain.heightmap_cell_size
        """Side of a cell [m]."""
        self._change = Condition()
        self.pieces: Singles = np.empty((MAX_PIECES, TILE_CELLS + 1, TILE_CELLS + 1, 3), np.float32)
        """Height [m] and slopes along the lattice's axes [1] on the nodes of each piece."""
        self.slot = np.full((AROUND, AROUND), -1, np.int64)
        """Row in `pieces` of each stretch of terrain, by its numbers modulo `AROUND`."""
        self.number = np.full((AROUND, AROUND, 2), EMPTY, np.int64)
        """Numbers of the piece that is there."""
        self._held = np.full((MAX_PIECES, 2), EMPTY, np.int64)
        self._last_read = np.zeros(MAX_PIECES, np.int64)
        self._readers = np.zeros(MAX_PIECES, np.int64)
        self._state = np.full(MAX_PIECES, _BLANK, np.int8)
        self._ticket, self._next = 0, 0
        self._pen = self.terrain.heightmap_synthesizer

    @contextmanager
    def reading(self, wanted: NDArray[np.int64], share: Mapped = map) -> Iterator[NDArray[np.int64]]:
        """While pieces are read: they are drawn, and none of them goes.

        Any number of threads may read at a time. Where there is no room for what one of them wants, it waits until
        others have done.

        Args:
            wanted: Numbers of the pieces, each once, shape (n, 2), n up to `MAX_PIECES`.
            share: Calls a function with each of some things, as `map` does, perhaps on several threads.

        Returns:
            Row in `pieces` of each, shape (n,).
        """
        with self._change:
            self._change.wait_for(lambda: self._fits(wanted))
            self.claim(wanted)
            rows = self.slot[tuple(wanted.T % AROUND)]
            self._readers[rows] += 1
        try:
            while not (self._state[rows] == _DRAWN).all():
                self._synthesize_missing(rows, share)
            yield rows
        finally:
            with self._change:
                self._readers[rows] -= 1
                self._change.notify_all()

    def _synthesize_missing(self, rows: NDArray[np.int64], share: Mapped) -> None:
        """Synthesise the tiles that no other thread has begun, and wait for the others."""
        with self._change:
            mine = rows[self._state[rows] == _BLANK]
            self._state[mine] = _BEGUN

        def drawn(part: NDArray[np.int64]) -> None:
            self.draw(part)
            self._state[part] = _DRAWN

        try:
            list(share(drawn, [mine[k::PARTS] for k in range(PARTS)]))
        finally:
            with self._change:
                self._state[mine[self._state[mine] == _BEGUN]] = _BLANK  # where drawing failed, another may try
                self._change.notify_all()
        with self._change:
            self._change.wait_for(lambda: not (self._state[rows] == _BEGUN).any())

    def _fits(self, wanted: NDArray[np.int64]) -> bool:
        """Return True if there are rows without those that others read."""
        return bool(fits(wanted, self.slot, self.number, self._readers))

    def claim(self, wanted: NDArray[np.int64]) -> NDArray[np.int64]:
        """Assign rows to pieces.

        Args:
            wanted: Numbers of the pieces that will be read together, each once, shape (n, 2), n up to `MAX_PIECES`.

        Returns:
            Rows in `pieces` of those that must be drawn first.
        """
        self._ticket += 1
        fresh = np.empty(len(wanted), np.int64)
        count, self._next = claim(
            wanted, self.slot, self.number, self._held, self._last_read, self._readers, self._ticket, self._next, FRESH,
            RECENT_READS, fresh,
        )  # fmt: skip
        self._state[fresh[:count]] = _BLANK
        return fresh[:count]

    def draw(self, rows: NDArray[np.int64]) -> None:
        """Draw pieces into their rows, from the coarsest nodes to the finest.

        Args:
            rows: Which, claimed before.
        """
        self._pen.draw(rows, self._held, self.pieces)


def terrain_map(bed: SeabedTerrain) -> TerrainMap:
    """The one map of a seabed."""
    with _MAKING:
        return _made(bed)


@lru_cache(maxsize=4)
def _made(bed: SeabedTerrain) -> TerrainMap:
    return TerrainMap(bed)


_MAKING = Lock()


def empty_terrain_map() -> tuple[Any, ...]:
    """Placeholder of a map where the seabed is flat: nothing to look up."""
    return np.zeros((1, 2, 2, 3), np.float32), np.zeros((1, 1), np.uint32)
