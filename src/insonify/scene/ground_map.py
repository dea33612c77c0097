"""The ground as a map that is drawn once and read by many pings: heights and slopes on square pieces, side by side.

Octaves of relief that are long against a cell are drawn on every second, fourth ... node and filled in between with
cubics, which changes slopes by half a percent; only the finest are drawn on every node. Pieces are made where a line
first crosses them, and forgotten when room is wanted, the oldest first.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from threading import Condition, Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify import streams
from insonify.scene._map_kernel import draw_octaves
from insonify.scene.bed import MAP_CELLS, Bed
from insonify.scene.terrain.octaves import Octaves, quantiles

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Mapped = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]

AROUND = 512
"""Pieces along each side of the stretch of ground within which all pieces have places of their own."""
NODES_PER_PITCH = 4
"""Nodes to the spacing of an octave's lattice, at least, on which it is drawn."""
MOST_PIECES = 3072
"""Pieces that are kept: some 150 MB."""
FRESH = 512
"""Pieces that have new memory in any case; beyond them, what nobody asked for lately goes first."""
LATELY = 64
"""Readings within which a piece is likely to be asked for again."""
PARTS = 2
"""Parts into which pieces that must be drawn are shared."""
_EMPTY = np.iinfo(np.int64).min
_BLANK, _BEGUN, _DRAWN = range(3)


@dataclass
class GroundMap:
    """Pieces of one bed's map, shared by threads: what is read under `reading` stays where it is meanwhile."""

    bed: Bed

    def __post_init__(self) -> None:
        """Nothing drawn yet."""
        self.cell = self.bed.map_cell
        """Side of a cell [m]."""
        self._change = Condition()
        self.pieces: Singles = np.empty((MOST_PIECES, MAP_CELLS + 1, MAP_CELLS + 1, 3), np.float32)
        """Height [m] and slopes along the lattice's axes [1] on the nodes of each piece."""
        self.slot = np.full((AROUND, AROUND), -1, np.int64)
        """Which of `pieces` each stretch of ground has, by its numbers modulo `AROUND`."""
        self.number = np.full((AROUND, AROUND, 2), _EMPTY, np.int64)
        """Numbers of the piece that is there."""
        self._held = np.full((MOST_PIECES, 2), _EMPTY, np.int64)
        self._asked = np.zeros(MOST_PIECES, np.int64)
        self._readers = np.zeros(MOST_PIECES, np.int64)
        self._state = np.full(MOST_PIECES, _BLANK, np.int8)
        self._ticket, self._next = 0, 0
        self._octaves = _octaves(self.bed)
        self._others = [part for part in self.bed.ground.terrain.parts if not isinstance(part, Octaves)]

    @contextmanager
    def reading(self, wanted: NDArray[np.int64], share: Mapped = map) -> Iterator[None]:
        """While pieces are read: they are drawn, and none of them goes.

        Any number of threads may read at a time. Where there is no room for what one of them wants, it waits until
        others have done.

        Args:
            wanted: Numbers of the pieces, each once, shape (n, 2), n up to `MOST_PIECES`.
            share: Calls a function with each of some things, as `map` does, perhaps on several threads.
        """
        with self._change:
            self._change.wait_for(lambda: self._fits(wanted))
            self.claim(wanted)
            rows = self.slot[tuple(wanted.T % AROUND)]
            self._readers[rows] += 1
        try:
            while not (self._state[rows] == _DRAWN).all():
                self._draw_some(rows, share)
            yield
        finally:
            with self._change:
                self._readers[rows] -= 1
                self._change.notify_all()

    def _draw_some(self, rows: NDArray[np.int64], share: Mapped) -> None:
        """Draw what nobody draws yet, and wait for the others."""
        with self._change:
            mine = rows[self._state[rows] == _BLANK]
            self._state[mine] = _BEGUN

        def drawn(part: NDArray[np.int64]) -> None:
            for row in part.tolist():
                self.draw(row, *self._held[row].tolist())
                self._state[row] = _DRAWN

        try:
            list(share(drawn, [mine[k::PARTS] for k in range(PARTS)]))
        finally:
            with self._change:
                self._state[mine[self._state[mine] == _BEGUN]] = _BLANK  # where drawing failed, another may try
                self._change.notify_all()
        with self._change:
            self._change.wait_for(lambda: not (self._state[rows] == _BEGUN).any())

    def _fits(self, wanted: NDArray[np.int64]) -> bool:
        """Whether there is room without what others read."""
        a, b = wanted.T % AROUND
        there = (self.number[a, b] == wanted).all(axis=1)
        if there.all() or not self._readers.any():
            return True
        taken = self.slot[a[~there], b[~there]]
        if self._readers[taken[taken >= 0]].any():
            return False
        held = self._readers > 0
        held[self.slot[a[there], b[there]]] = True
        return int(held.sum()) + int((~there).sum()) <= len(self.pieces)

    def claim(self, wanted: NDArray[np.int64]) -> list[tuple[int, int, int]]:
        """Give pieces their places.

        Args:
            wanted: Numbers of the pieces that will be read together, each once, shape (n, 2), n up to `MOST_PIECES`.

        Returns:
            Row in `pieces` and numbers of those that must be drawn first.
        """
        self._ticket += 1
        a, b = wanted.T % AROUND
        there = (self.number[a, b] == wanted).all(axis=1)
        self._asked[self.slot[a[there], b[there]]] = self._ticket
        return [(self._room(int(along), int(across)), int(along), int(across)) for along, across in wanted[~there]]

    def _room(self, along: int, across: int) -> int:
        """A row for one piece, that of another that nobody asks for now if there are too many."""
        row = self._next
        if row >= min(FRESH, len(self.pieces)):  # new memory costs more than what is drawn there
            oldest = int(np.argmin(np.where(self._readers[:row] > 0, self._ticket, self._asked[:row])))
            if row == len(self.pieces) or self._asked[oldest] < self._ticket - LATELY:
                row = oldest
        self._next = max(self._next, row + 1)
        i, j = along % AROUND, across % AROUND
        old_a, old_b = self._held[row].tolist()
        if old_a != _EMPTY:
            self.slot[old_a % AROUND, old_b % AROUND], self.number[old_a % AROUND, old_b % AROUND] = -1, _EMPTY
        if self.slot[i, j] >= 0:
            self._held[self.slot[i, j]] = _EMPTY
        self.slot[i, j], self.number[i, j] = row, (along, across)
        self._held[row], self._asked[row], self._state[row] = (along, across), self._ticket, _BLANK
        return row

    def draw(self, row: int, along: int, across: int) -> None:
        """Draw one piece into its row, from the coarsest nodes to the finest."""
        draw_octaves(along, across, self.cell, *self._octaves, quantiles(), self.pieces[row])
        if self._others:
            node = np.arange(MAP_CELLS + 1)
            a, b = ((number * MAP_CELLS + node) * self.cell for number in (along, across))
            for relief in self._others:
                height, slope = relief.survey(np.repeat(a, len(b)), np.tile(b, len(a)))
                self.pieces[row] += np.column_stack([height, slope]).reshape(self.pieces[row].shape)


def _octaves(bed: Bed) -> tuple[Floats, NDArray[np.int64]]:
    """All octaves of the relief, coarsest nodes first, as `draw_octaves` wants them."""
    numbers, names = [], []
    for part in bed.ground.terrain.parts:
        if isinstance(part, Octaves):
            steps = np.clip(np.floor(np.log2(part.pitch / NODES_PER_PITCH / bed.map_cell + 1e-9)), 0, 4)
            k0, k1 = streams.key(part.seed, streams.TERRAIN)
            for o, (turn, shift_a, shift_b, _) in enumerate(part.placed()):
                numbers.append((part.pitch[o], 2 * np.pi * turn, shift_a, shift_b, part.amplitude[o]))
                names.append((2 ** int(steps[o]), part.level[o], 2 * part.layer, k0, k1))
    order = sorted(range(len(names)), key=lambda o: -names[o][0])
    return (
        np.array([numbers[o] for o in order]).reshape(-1, 5),
        np.array([names[o] for o in order], np.int64).reshape(-1, 5),
    )


def ground_map(bed: Bed) -> GroundMap:
    """The one map of a bed."""
    with _MAKING:
        return _made(bed)


@lru_cache(maxsize=4)
def _made(bed: Bed) -> GroundMap:
    return GroundMap(bed)


_MAKING = Lock()


def unmapped() -> tuple[Any, ...]:
    """What stands for a map where the bed is flat: nothing to look up."""
    return np.zeros((1, 2, 2, 3), np.float32), np.zeros((1, 1), np.int64)
