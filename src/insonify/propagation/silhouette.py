"""Silhouettes of solids as a sonar sees them: how high and how low each stands, bearing by bearing.

A screen of any outline is a row of narrow columns, each with a top, a base and two sides; what it keeps from a point is
the sum of what the columns keep, each a product of two differences of Fresnel integrals (Kirchhoff's approximation, as
in `knife_edge`). The sides that two columns share cancel.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._silhouette_kernel import silhouette_columns
from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

COLUMNS = 64
"""Columns of a silhouette: Arago's spot behind a ball of seven Fresnel zones comes out within 4 % [1]."""
REMEMBERED = 2048
"""Silhouettes kept: those of 100 solids for all families of both ends, with room for sonars side by side [1]."""
FEWEST = 8
"""Columns of a silhouette at least [1]."""


class Silhouette(NamedTuple):
    """Outline of a solid, c columns."""

    centre_bearing: float
    """Bearing of its middle from the sonar [rad]."""
    border_bearings: Floats
    """Bearings between columns re that, increasing [rad], shape (c + 1,)."""
    border_ranges: Floats
    """Horizontal distance of each border [m], shape (c + 1,)."""
    columns: Floats
    """Distance and depth of each top, of each base, nearest and farthest distance [m], shape (c, 6)."""


@lru_cache(maxsize=REMEMBERED)
def silhouette(
    solid: Solid, seabed: Seabed, source: tuple[float, float, float], max_column_width: float = 0.0
) -> Silhouette | None:  # fmt: skip
    """How a solid looks from a place, or from its image in a boundary.

    Args:
        solid: The solid.
        seabed: What it rests on.
        source: North, east, depth of the place [m].
        max_column_width: Width that columns may have [m]; 0: as many columns as ever.

    Returns:
        Its outline; None where it stands around the place, which then has no one side to look at.
    """
    return outline(np.asarray(world_triangles(solid, seabed).corners, float), source, max_column_width)


def outline(corners: Floats, source: tuple[float, float, float], max_column_width: float = 0.0) -> Silhouette | None:
    """Outline of some triangles, see `silhouette`.

    Args:
        corners: North, east, depth of their corners [m], shape (t, 3, 3).
        source: North, east, depth of the place [m].
        max_column_width: Width that columns may have [m]; 0: as many columns as ever.
    """
    start = corners - np.array(source)
    middle = start.reshape(-1, 3).mean(axis=0)
    facing = float(np.arctan2(middle[1], middle[0]))
    c, s = np.cos(facing), np.sin(facing)
    start = np.stack([c * start[..., 0] + s * start[..., 1], c * start[..., 1] - s * start[..., 0], start[..., 2]], -1)
    if start[..., 0].min() <= 0:
        return None
    bearing = np.arctan2(start[..., 1], start[..., 0])
    count = COLUMNS
    if max_column_width > 0:
        width = float(np.ptp(bearing)) * float(np.hypot(middle[0], middle[1]))
        count = int(np.clip(np.ceil(width / max_column_width), FEWEST, COLUMNS))
    borders = np.linspace(bearing.min(), bearing.max(), count + 1)
    columns = np.empty((count, 6))
    silhouette_columns(start, bearing, borders, columns)
    columns[:, [1, 3]] += source[2]
    away = np.concatenate([columns[:1, 0], (columns[1:, 0] + columns[:-1, 0]) / 2, columns[-1:, 0]])
    return Silhouette(facing, borders, away, columns)
