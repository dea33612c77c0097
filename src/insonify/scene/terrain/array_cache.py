"""Cache of bounded size for terrain samples, which are needed again at the next ping; it changes no bit of a result."""

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from threading import Lock

import numpy as np
from numpy.typing import NDArray


class ArrayCache:
    """Arrays by key; the least recently used are deleted first. Threads may share it."""

    def __init__(self, max_bytes: int) -> None:
        """Create an empty cache.

        Args:
            max_bytes: Size of all arrays together beyond which the least recently used are deleted [bytes].
        """
        self.max_bytes, self.bytes = max_bytes, 0
        self._arrays: OrderedDict[Hashable, NDArray[np.floating]] = OrderedDict()
        self._lock = Lock()

    def __reduce__(self) -> tuple[type["ArrayCache"], tuple[int]]:
        """Reduce to an empty cache: another process starts without arrays."""
        return ArrayCache, (self.max_bytes,)

    def __len__(self) -> int:
        """Number of cached arrays."""
        return len(self._arrays)

    def find(self, keys: Sequence[Hashable]) -> list[NDArray[np.floating] | None]:
        """Cached arrays of some keys, None for those that are not cached.

        Args:
            keys: Keys of the arrays.
        """
        with self._lock:
            arrays = [self._arrays.get(key) for key in keys]
            for key, array in zip(keys, arrays, strict=True):
                if array is not None:
                    self._arrays.move_to_end(key)
        return arrays

    def get(self, key: Hashable, make: Callable[[], NDArray[np.floating]]) -> NDArray[np.floating]:
        """Array of a key, from the cache or else evaluated; two threads may both evaluate it, with equal results.

        Args:
            key: Key of the array.
            make: Function that returns the array.
        """
        with self._lock:
            if key in self._arrays:
                self._arrays.move_to_end(key)
                return self._arrays[key]
        array = make()
        array.setflags(write=False)
        with self._lock:
            if key not in self._arrays:
                self._arrays[key] = array
                self.bytes += array.nbytes
            while self.bytes > self.max_bytes and len(self._arrays) > 1:
                _, oldest = self._arrays.popitem(last=False)
                self.bytes -= oldest.nbytes
        return array
