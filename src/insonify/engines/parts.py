"""Blocks and parts that a ping's work is shared into: fixed, so that sums do not depend on the number of threads."""

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.recent_results import RecentResults

MAX_PARTS = 16
"""Largest number of parts into which a ping's blocks are divided; it does not depend on the number of threads."""
MAX_ACCUMULATOR_BYTES = 64 << 20
"""Memory of all parts beyond which there are fewer, down to `MIN_PARTS`: to add them takes time too [bytes]."""
MIN_PARTS = 2
"""Least number of parts."""
SCATTERERS_PER_BLOCK = 98304
"""Number of scatterers that fill a block: so many that the cost of Python is small."""
MIN_TILE_COST = 4
"""Number of scatterers as which a tile counts in a block, in addition to its own."""


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
    """Number of parts into which a ping's blocks are divided: fewer where each part has a large accumulator.

    Args:
        size: Memory of the accumulator of one part [bytes].
    """
    return min(max(MAX_ACCUMULATOR_BYTES // max(size, 1), MIN_PARTS), MAX_PARTS)


def cut_into_blocks(count: NDArray[np.float64]) -> list[slice]:
    """Rows of tiles, cut where a block is full; at least one block.

    Args:
        count: Expected number of scatterers of each tile [1], shape (n,).
    """
    full = np.cumsum(count + MIN_TILE_COST) // SCATTERERS_PER_BLOCK
    edges = [0, *(np.flatnonzero(np.diff(full)) + 1).tolist(), len(count)]
    return [slice(first, last) for first, last in pairwise(edges)]
