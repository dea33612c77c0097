"""Parts that a ping's work is shared into: fixed, so that sums do not depend on the number of threads."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Protocol

import numpy as np

from insonify.engines.terrain_occlusion import TerrainOcclusion
from insonify.recent_results import RecentResults

MAX_PARTS = 16
"""Parts that a ping's blocks are shared into: fixed, so that sums do not depend on the number of threads."""
MAX_ACCUMULATOR_BYTES = 64 << 20
"""Memory beyond which there are fewer parts, down to `MIN_PARTS`: to add them up costs time too [bytes]."""
MIN_PARTS = 2


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
    return int(np.clip(MAX_ACCUMULATOR_BYTES // max(size, 1), MIN_PARTS, MAX_PARTS))
