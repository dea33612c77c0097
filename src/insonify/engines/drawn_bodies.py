"""Random points of bodies, cached from ping to ping in bounded memory."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock

from insonify.scene.scatterers import Scatterers

MAX_CONCURRENT_PING_BYTES = 256 << 20
"""Largest memory of the cached points, in addition to those of the last body [bytes]."""


class DrawnBodies:
    """Cache of the points of bodies, by all that they depend on; the least recently used are dropped first."""

    def __init__(self, max_bytes: int = MAX_CONCURRENT_PING_BYTES) -> None:
        """Create an empty cache.

        Args:
            max_bytes: Largest memory of the points, in addition to those of the last body [bytes].
        """
        self._max_bytes = max_bytes
        self._total_bytes = 0
        self._points: OrderedDict[Hashable, Scatterers] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, draw: Callable[[], Scatterers]) -> Scatterers:
        """The points of one body, drawn if they are not in the cache.

        Args:
            key: Parameters that determine the points.
            draw: Function that draws them.
        """
        with self._lock:
            if key in self._points:
                self._points.move_to_end(key)
                return self._points[key]
        points = draw()
        with self._lock:
            if key not in self._points:
                self._points[key] = points
                self._total_bytes += size(points)
            while self._total_bytes > self._max_bytes and len(self._points) > 1:
                self._total_bytes -= size(self._points.popitem(last=False)[1])
        return points


def size(points: Scatterers) -> int:
    """Memory of the columns of some points [bytes]."""
    columns = points.position, points.normal, points.area, points.phase, points.scatterer_id
    return sum(column.nbytes for column in columns)
