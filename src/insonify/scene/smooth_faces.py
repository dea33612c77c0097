"""The smooth faces of meshes as triangles in the world, and how far a place is from what hides it: bed and surface."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insonify.scene.seabed import Seabed
from insonify.scene.solid import ground_depth, world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

_TOUCHING = 1e-6  # a face this close to the bed lies on it [m]


def smooth_triangles(solid: Solid, seabed: Seabed) -> Floats:
    """Corners of the faces of a target where it lies, counter-clockwise from outside [m], shape (t, 3, 3).

    Args:
        solid: The target.
        seabed: What it lies on.
    """
    return world_triangles(solid, seabed).corners


def in_the_water(seabed: Seabed) -> Callable[[Floats], Floats]:
    """Distance from the nearer of bed and mean surface, positive in the water [m], of places (n, 3).

    Args:
        seabed: The bed; places over unknown ground count as far above it.
    """

    def clear(place: Floats) -> Floats:
        above = np.nan_to_num(ground_depth(seabed, place[:, :2]) - place[:, 2], nan=np.inf)
        return np.asarray(np.minimum(above, place[:, 2]))

    return clear


def above_ground(corners: Floats, seabed: Seabed) -> Floats:
    """The parts of triangles that water can reach: cut along the ground, which is taken as level under each.

    Args:
        corners: Of the triangles [m], shape (t, 3, 3).
        seabed: What may hide them.

    Returns:
        Triangles with the same normals, shape (..., 3, 3).
    """
    bed = ground_depth(seabed, corners[:, :, :2].mean(axis=1))
    height = bed[:, None] - corners[:, :, 2]
    reached = ~(height.max(axis=1) <= _TOUCHING)
    cut = reached & (height.min(axis=1) < -_TOUCHING)
    parts = [corners[reached & ~cut]]
    for count in (1, 2):
        # corners turned so that those above come first, or the one below last
        rows = np.flatnonzero(cut & ((height > 0).sum(axis=1) == count))
        first = (height[rows] > 0).argmax(axis=1) if count == 1 else ((height[rows] <= 0).argmax(axis=1) + 1) % 3
        order = (first[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners[rows], order[:, :, None], axis=1), 1, 0)
        at_a, at_b, at_c = np.take_along_axis(height[rows], order, axis=1).T[:, :, None]
        if count == 1:
            parts.append(np.stack([a, _level(a, b, at_a, at_b), _level(a, c, at_a, at_c)], axis=1))
        else:
            one, other = _level(b, c, at_b, at_c), _level(a, c, at_a, at_c)
            parts += [np.stack([a, b, one], axis=1), np.stack([a, one, other], axis=1)]
    return np.concatenate(parts)


def _level(a: Floats, b: Floats, at_a: Floats, at_b: Floats) -> Floats:
    """Where the sides from places above ground to places below it meet the ground [m], shape (n, 3)."""
    return np.asarray(a + (b - a) * at_a / (at_a - at_b))
