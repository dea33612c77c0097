"""Cache of the last few results of some computation, shared by threads."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, Generic, TypeVar

Result = TypeVar("Result")


class Identity:
    """An object in a key: equal to itself alone, and kept with the key, so that no other object takes its identity."""

    __slots__ = ("_value",)

    def __init__(self, value: Any) -> None:
        """Wrap an object.

        Args:
            value: Any object; it need not be hashable.
        """
        self._value = value

    def __hash__(self) -> int:
        """Hash of the identity."""
        return id(self._value)

    def __eq__(self, other: object) -> bool:
        """Return True for the same object."""
        return isinstance(other, Identity) and other._value is self._value


class RecentResults(Generic[Result]):
    """The last few results, by key; the least recently requested are deleted first."""

    def __init__(self, most: int) -> None:
        """Create an empty cache.

        Args:
            most: Number of results that are kept.
        """
        self._most, self._lock = most, Lock()
        self._results: OrderedDict[Hashable, Result] = OrderedDict()

    def __reduce__(self) -> tuple[type["RecentResults[Result]"], tuple[int]]:
        """Reduce to an empty cache: another process starts without results."""
        return RecentResults, (self._most,)

    def get(self, key: Hashable, make: Callable[[], Result]) -> Result:
        """The result of a key, made where it is not kept; two threads may both make it, and get the same object."""
        with self._lock:
            if key in self._results:
                self._results.move_to_end(key)
                return self._results[key]
        result = make()
        with self._lock:
            result = self._results.setdefault(key, result)
            while len(self._results) > self._most:
                self._results.popitem(last=False)
        return result
