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
    """Corners of the submerged faces of a target in the world, counter-clockwise from outside [m], (t, 3, 3)."""
    return world_triangles(solid, seabed).corners


def water_clearance(seabed: Seabed) -> Callable[[Floats], Floats]:
    """Function that returns the vertical distance of positions (n, 3) from the nearer boundary [m], shape (n,).

    The distance from seabed or mean surface is positive in the water.

    Args:
        seabed: The seabed; positions over unknown terrain are treated as far above it.
    """

    def clearance(position: Floats) -> Floats:
        height = np.nan_to_num(seabed_depth_at(seabed, position[:, :2]) - position[:, 2], nan=np.inf)
        return np.asarray(np.minimum(height, position[:, 2]))

    return clearance


def clip_at_seabed(corners: Floats, seabed: Seabed) -> Floats:
    """Parts of triangles above the seabed, which is approximated as horizontal under each triangle.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        seabed: The seabed.

    Returns:
        Triangles with the same normals, shape (..., 3, 3).
    """
    seabed_depth = seabed_depth_at(seabed, corners[:, :, :2].mean(axis=1))
    return clip_triangles(corners, seabed_depth[:, None] - corners[:, :, 2])
