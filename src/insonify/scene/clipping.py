"""Triangles clipped where a function of position changes sign, and triangles that overlap a box."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

TOUCHING = 1e-6
"""Largest value of the function on a face that is left out [m]."""


def clip_triangles(corners: Floats, value: Floats) -> Floats:
    """Parts of triangles where a function, linear on each, is positive.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        value: The function at the corners [m], shape (t, 3).

    Returns:
        Triangles with the same normals, shape (..., 3, 3); those that nothing cuts come first and unchanged.
    """
    is_kept = ~(value.max(axis=1) <= TOUCHING)
    cut = is_kept & (value.min(axis=1) < -TOUCHING)
    parts = [corners[is_kept & ~cut]]
    for count in (1, 2):
        # corners in cyclic order with the positive ones first
        rows = np.flatnonzero(cut & ((value > 0).sum(axis=1) == count))
        first = (value[rows] > 0).argmax(axis=1) if count == 1 else ((value[rows] <= 0).argmax(axis=1) + 1) % 3
        order = (first[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners[rows], order[:, :, None], axis=1), 1, 0)
        value_a, value_b, value_c = np.take_along_axis(value[rows], order, axis=1).T[:, :, None]
        if count == 1:
            parts.append(np.stack([a, _crossing(a, b, value_a, value_b), _crossing(a, c, value_a, value_c)], axis=1))
        else:
            crossing_b, crossing_a = _crossing(b, c, value_b, value_c), _crossing(a, c, value_a, value_c)
            parts += [np.stack([a, b, crossing_b], axis=1), np.stack([a, crossing_b, crossing_a], axis=1)]
    return np.concatenate(parts)


def overlap_box(corners: Floats, half_size: Floats) -> NDArray[np.bool_]:
    """Mask of triangles that have points inside a box about the origin, shape (n,).

    Two convex bodies are apart where their projections on one of these axes are: a face's normal, or the cross product
    of an edge of each.

    Args:
        corners: Corners of the triangles along the box's sides [m], shape (n, 3, 3).
        half_size: Half of the box's sides [m], shape (n, 3).
    """
    overlap = ~((corners.min(axis=1) > half_size) | (corners.max(axis=1) < -half_size)).any(axis=1)
    rows = np.flatnonzero(overlap)  # by the box's faces; most triangles need no more
    edges = np.roll(corners[rows], -1, axis=1) - corners[rows]
    crossed = np.cross(edges[:, :, None], np.eye(3)).reshape(-1, 9, 3)
    axes = np.concatenate([crossed, np.cross(edges[:, :1], edges[:, 1:2])], axis=1)
    projection = corners[rows] @ np.swapaxes(axes, 1, 2)
    reach = np.einsum("nai,ni->na", np.abs(axes), half_size[rows])
    overlap[rows] = ~((projection.min(axis=1) > reach) | (projection.max(axis=1) < -reach)).any(axis=1)
    return overlap


def _crossing(a: Floats, b: Floats, value_a: Floats, value_b: Floats) -> Floats:
    """Zeros of the function on sides between positions of opposite sign [m], shape (n, 3)."""
    return np.asarray(a + (b - a) * value_a / (value_a - value_b))
