"""Blocks and parts that a ping's work is shared into: fixed, so that sums do not depend on the number of threads."""

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.recent_results import RecentResults

MAX_PARTS = 16
"""Parts that a ping's blocks are shared into: fixed, so that sums do not depend on the number of threads."""
MAX_ACCUMULATOR_BYTES = 64 << 20
"""Memory beyond which there are fewer parts, down to `MIN_PARTS`: to add them up costs time too [bytes]."""
MIN_PARTS = 2
SCATTERERS_PER_BLOCK = 98304
"""Scatterers in a block, about twice as many as are kept: enough to make the cost of Python small."""
MIN_TILE_COST = 4
"""Scatterers of a block that one more tile counts for at least."""


class WorkerPool(Protocol):
    """Workers for the parts of a ping: a `ThreadPoolExecutor`, or `SerialPool`."""

    def map(self, fn: Callable[[Any], Any], items: Iterable[Any], /) -> Iterator[Any]:
        """Results of a function for each item, in their order."""


class SerialPool:
    """One thread, which does the parts of a ping one after the other."""

    def __init__(self) -> None:
        """Ready for one ping."""
        self.terrain_occlusion = RecentResults[TerrainOcclusion](4)
        """Terrain occlusion at that ping, shared by its sound and its labels."""

    def map(self, fn: Callable[[Any], Any], items: Iterable[Any], /) -> Iterator[Any]:
        """Results of a function for each item, each computed when requested."""
        return map(fn, items)


def parts_of(size: int) -> int:
    """Parts that a ping's blocks are shared into: fewer where each holds a large array's sound.

    Args:
        size: Size of one part [bytes].
    """
    return min(max(MAX_ACCUMULATOR_BYTES // max(size, 1), MIN_PARTS), MAX_PARTS)


def cut_into_blocks(count: NDArray[np.float64]) -> list[slice]:
    """Rows of tiles, cut where a block is full; at least one block.

    Args:
        count: Scatterers of each tile that are likely to be drawn, shape (n,).
    """
    full = np.cumsum(count + MIN_TILE_COST) // SCATTERERS_PER_BLOCK
    edges = [0, *(np.flatnonzero(np.diff(full)) + 1).tolist(), len(count)]
    return [slice(first, last) for first, last in pairwise(edges)]
