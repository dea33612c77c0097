"""Silhouettes of solids from the sonar: top and base as functions of bearing.

A screen of any outline is a row of narrow columns, each with a top, a base and two sides; the field that it blocks is
the sum over its columns, each a product of two differences of Fresnel integrals (Kirchhoff's approximation, as
in `knife_edge`). The contributions of a side that two columns share cancel.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._silhouette_kernel import Silhouette, silhouette_columns
from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

COLUMNS = 64
"""Largest number of columns: Arago's spot behind a ball of seven Fresnel zones is then right within 4 % [1]."""
CACHED_SILHOUETTES = 2048
"""Number of cached silhouettes: 100 solids for all families of both ends, and sonars side by side [1]."""
CACHED_POSITIONS = 4
"""Number of solids and positions whose `TriangleBearings` are cached: all families of one end need the same [1]."""
MIN_COLUMNS = 8
"""Least number of columns of a silhouette [1]."""


@lru_cache(maxsize=CACHED_SILHOUETTES)
def silhouette(
    solid: Solid, seabed: Seabed, source: tuple[float, float, float], max_column_width: float = 0.0
) -> Silhouette | None:  # fmt: skip
    """Silhouette of a solid from a position, or from its image in a boundary.

    Args:
        solid: The solid.
        seabed: Seabed on which it rests.
        source: North, east, depth of the position or of its image [m].
        max_column_width: Largest width of columns [m]; 0: the largest number of columns.

    Returns:
        Its silhouette; None where the solid surrounds the position.
    """
    triangles = _solid_bearings(solid, seabed, source[:2])
    return None if triangles is None else _silhouette_from(triangles, source[2], max_column_width)


class TriangleBearings(NamedTuple):
    """Positions of t triangles re the sonar, in the frame of the bearing of their middle: equal for all its images."""

    middle_bearing: float
    """Bearing of their middle from the sonar [rad]."""
    distance: float
    """Horizontal distance of their middle [m]."""
    corners: Floats
    """Distances of the corners along that bearing and to the right of it, and depth [m], shape (t, 3, 3)."""
    bearing: Floats
    """Bearing of the corners re that of the middle [rad], shape (t, 3)."""
    extent: tuple[float, float]
    """Least and greatest bearing of the corners re that of the middle [rad]."""


@lru_cache(maxsize=CACHED_POSITIONS)
def _solid_bearings(solid: Solid, seabed: Seabed, source: tuple[float, float]) -> TriangleBearings | None:
    """Triangles of a solid re a position, cached."""
    return _triangle_bearings(np.asarray(world_triangles(solid, seabed).corners, float), source)


def _triangle_bearings(corners: Floats, source: tuple[float, float]) -> TriangleBearings | None:
    """Triangles re a position; None where they surround it, or reach to its side.

    Args:
        corners: North, east, depth of their corners [m], shape (t, 3, 3).
        source: North and east of the position [m].
    """
    north, east = corners[..., 0] - source[0], corners[..., 1] - source[1]
    middle = float(north.mean()), float(east.mean())
    middle_bearing = math.atan2(middle[1], middle[0])
    c, s = math.cos(middle_bearing), math.sin(middle_bearing)
    along, across = c * north + s * east, c * east - s * north
    if along.min() <= 0:
        return None
    bearing = np.arctan2(across, along)
    extent = float(bearing.min()), float(bearing.max())
    return TriangleBearings(
        middle_bearing, math.hypot(*middle), np.stack([along, across, corners[..., 2]], axis=-1), bearing, extent
    )


def outline(corners: Floats, source: tuple[float, float, float], max_column_width: float = 0.0) -> Silhouette | None:
    """Silhouette of some triangles, see `silhouette`.

    Args:
        corners: North, east, depth of their corners [m], shape (t, 3, 3).
        source: North, east, depth of the position [m].
        max_column_width: Largest width of columns [m]; 0: the largest number of columns.
    """
    triangles = _triangle_bearings(corners, source[:2])
    return None if triangles is None else _silhouette_from(triangles, source[2], max_column_width)


def _silhouette_from(triangles: TriangleBearings, depth: float, max_column_width: float) -> Silhouette:
    """Silhouette of triangles from one depth, see `outline`."""
    (first, last), count = triangles.extent, COLUMNS
    if max_column_width > 0:
        count = min(max(math.ceil((last - first) * triangles.distance / max_column_width), MIN_COLUMNS), COLUMNS)
    borders = np.linspace(first, last, count + 1)
    columns = np.empty((count, 6))
    silhouette_columns(triangles.corners, triangles.bearing, depth, borders, columns)
    columns[:, [1, 3]] += depth
    border_ranges = np.concatenate([columns[:1, 0], (columns[1:, 0] + columns[:-1, 0]) / 2, columns[-1:, 0]])
    return Silhouette(triangles.middle_bearing, borders, border_ranges, columns)
