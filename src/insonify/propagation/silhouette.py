"""Silhouettes of solids from the sonar: top and base by bearing.

A screen of any outline is a row of narrow columns, each with a top, a base and two sides; the field that it blocks is
the sum over its columns, each a product of two differences of Fresnel integrals (Kirchhoff's approximation, as
in `knife_edge`). The sides that two columns share cancel.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._silhouette_kernel import Silhouette, silhouette_columns
from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

COLUMNS = 64
"""Columns of a silhouette: Arago's spot behind a ball of seven Fresnel zones is right within 4 % [1]."""
REMEMBERED = 2048
"""Number of cached silhouettes: 100 solids for all families of both ends, and sonars side by side [1]."""
FEWEST = 8
"""Least number of columns of a silhouette [1]."""


@lru_cache(maxsize=REMEMBERED)
def silhouette(
    solid: Solid, seabed: Seabed, source: tuple[float, float, float], max_column_width: float = 0.0
) -> Silhouette | None:  # fmt: skip
    """Silhouette of a solid from a position, or from its image in a boundary.

    Args:
        solid: The solid.
        seabed: Seabed on which it rests.
        source: North, east, depth of the position [m].
        max_column_width: Largest width of columns [m]; 0: the largest number of columns.

    Returns:
        Its silhouette; None where the solid surrounds the position.
    """
    return outline(np.asarray(world_triangles(solid, seabed).corners, float), source, max_column_width)


def outline(corners: Floats, source: tuple[float, float, float], max_column_width: float = 0.0) -> Silhouette | None:
    """Silhouette of some triangles, see `silhouette`.

    Args:
        corners: North, east, depth of their corners [m], shape (t, 3, 3).
        source: North, east, depth of the position [m].
        max_column_width: Largest width of columns [m]; 0: the largest number of columns.
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
