"""Heightmap tiles as kernels read them: the recently used ones, side by side in memory.

A kernel looks up the pieces that it comes to. Where one is missing it says so and goes on with the next question; what
missing is then synthesised, and the rest is evaluated again. So the positions of bounces need not be known beforehand.

Memory is given out from one end to the other. When half of all is full a new half is begun; tiles of the older one
that are read again are copied, the rest is deleted with it.
"""

import math
from collections.abc import Callable
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]
Place = tuple[int, int]
SHIFT = 6
CELLS = 1 << SHIFT
"""Cells along the side of one piece of the map."""
NODES = CELLS + 1
_MOST_BYTES = 448 << 20  # half of it, 13 thousand pieces, must hold what a ping reads, or all is drawn anew each time


class HeightmapTiles(NamedTuple):
    """Some pieces of a map, and where each is kept; never changed once it is made."""

    corner_a: int
    """Number of the first row of pieces."""
    corner_b: int
    """Number of the first column."""
    cell: float
    """Side of a cell [m]."""
    row_of: NDArray[np.int32]
    """Row of each piece in `heights`, -1 for one that is missing, (rows x columns,); the border always is."""
    heights: Singles
    """On the nodes [m], (pieces x nodes x nodes,)."""


class HeightmapCache:
    """The tiles of one map, which grow as they are read. Threads may share it."""

    def __init__(self, max_bytes: int = _MOST_BYTES) -> None:
        """No page yet.

        Args:
            max_bytes: Size of all tiles beyond which the least recently used are deleted [bytes].
        """
        self.max_bytes, self._lock = max_bytes, Lock()
        self._start_new_half()
        self._before = self._begin, self._row_of, self._heights

    def __reduce__(self) -> tuple[type["HeightmapCache"], tuple[int]]:
        """Another process begins without pages."""
        return HeightmapCache, (self.max_bytes,)

    def _start_new_half(self) -> None:
        self._begin: Place = (0, 0)
        self._end: Place = (0, 0)
        self._row_of = np.full((0, 0), -1, np.int32)
        self._workspace = max(self.max_bytes // 2 // (NODES**2 * 4), 2)
        room = (
            self._workspace + self._workspace // 4 + 1
        )  # for what one more question reads; costs nothing until it is written to
        self._heights, self._used = np.empty((room, NODES, NODES), np.float32), 1
        self._heights[0] = 0  # one to look at where another is missing

    def serve_kernel(
        self, cell: float, low: NDArray[np.float64], high: NDArray[np.float64],
        piece: Callable[[int, int], NDArray[np.floating]],
        evaluate: Callable[[HeightmapTiles, NDArray[np.bool_]], bool],
    ) -> None:  # fmt: skip
        """RaySource a kernel until nothing is missing.

        Args:
            cell: Side of a cell [m].
            low: Least coordinates on the map that are likely to be read [m], shape (2,).
            high: Greatest coordinates, shape (2,).
            piece: Draws the piece of a row and a column, shape (nodes, nodes).
            evaluate: Evaluates what is still missing: marks the tiles that it lacks, True when none is.
        """
        side = CELLS * cell
        begin = math.floor(low[0] / side) - 2, math.floor(low[1] / side) - 2
        end = math.floor(high[0] / side) + 3, math.floor(high[1] / side) + 3
        with self._lock:
            if self._used >= self._workspace:
                self._before = self._begin, self._row_of, self._heights
                self._start_new_half()
            before = self._before
        drawn: dict[Place, NDArray[np.floating]] = {}
        while True:
            with self._lock:
                self._reach(begin, end)
                if drawn:  # another thread may have forgotten what was there when these were drawn
                    rows, columns = zip(*drawn, strict=True)
                    self._reach((min(rows) - 1, min(columns) - 1), (max(rows) + 2, max(columns) + 2))
                    self._keep(drawn)
                corner, shape = self._begin, self._row_of.shape
                pages = HeightmapTiles(*corner, cell, self._row_of.ravel(), self._heights.ravel())
            wanted = np.zeros(shape, bool)
            if evaluate(pages, wanted):
                return
            if wanted[0, 0]:  # beyond the border
                begin = begin[0] - shape[0], begin[1] - shape[1]
                end = end[0] + shape[0], end[1] + shape[1]
                wanted[0, 0] = False
            drawn = {}
            for a, b in (np.array(corner) + np.argwhere(wanted)).tolist():
                held = _held(before, a, b)
                drawn[a, b] = piece(a, b) if held is None else held

    def _reach(self, begin: Place, end: Place) -> None:
        """Make room for pieces up to there; what others read is not touched."""
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

    def _keep(self, drawn: dict[tuple[int, int], NDArray[np.floating]]) -> None:
        """Take in further pieces; what others read is not touched."""
        row_of, heights = self._row_of.copy(), self._heights
        places = {(a - self._begin[0], b - self._begin[1]): made for (a, b), made in drawn.items()}
        new = {place: made for place, made in places.items() if row_of[place] < 0}
        if not new:
            return
        if self._used + len(new) > len(heights):  # one question that reads much of what is kept
            heights = np.empty((2 * (self._used + len(new)), NODES, NODES), np.float32)
            heights[: self._used] = self._heights[: self._used]
        for place, made in new.items():
            heights[self._used], row_of[place] = made, self._used
            self._used += 1
        self._row_of, self._heights = row_of, heights


def _held(pages: tuple[Place, NDArray[np.int32], Singles], along: int, across: int) -> NDArray[np.floating] | None:
    """One piece, from the first row and column of pieces, where each is kept, and their heights; None if it is not."""
    begin, row_of, heights = pages
    i, j = along - begin[0], across - begin[1]
    if not (0 <= i < row_of.shape[0] and 0 <= j < row_of.shape[1]) or row_of[i, j] < 0:
        return None
    return heights[row_of[i, j]]
