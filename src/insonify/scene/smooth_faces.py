"""Smooth faces of meshes as triangles in the world, and distances of positions from the seabed and the surface."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insonify.scene.clipping import clip_triangles
from insonify.scene.seabed import Seabed
from insonify.scene.solid import seabed_depth_at, world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]


def smooth_triangles(solid: Solid, seabed: Seabed) -> Floats:
    """Corners of the faces of a target under water where it lies, counter-clockwise from outside [m], (t, 3, 3)."""
    return world_triangles(solid, seabed).corners


def water_clearance(seabed: Seabed) -> Callable[[Floats], Floats]:
    """Distance from the nearer of bed and mean surface, positive in the water [m], of positions (n, 3).

    Args:
        seabed: The seabed; positions over unknown terrain are treated as far above it.
    """

    def clear(position: Floats) -> Floats:
        above = np.nan_to_num(seabed_depth_at(seabed, position[:, :2]) - position[:, 2], nan=np.inf)
        return np.asarray(np.minimum(above, position[:, 2]))

    return clear


def clip_at_seabed(corners: Floats, seabed: Seabed) -> Floats:
    """The parts of triangles that water can reach: cut along the terrain, which is taken as level under each.

    Args:
        corners: Of the triangles [m], shape (t, 3, 3).
        seabed: Seabed that may occlude them.

    Returns:
        Triangles with the same normals, shape (..., 3, 3).
    """
    bed = seabed_depth_at(seabed, corners[:, :, :2].mean(axis=1))
    return clip_triangles(corners, bed[:, None] - corners[:, :, 2])
