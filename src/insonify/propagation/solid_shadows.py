"""Shadows of solids: occlusion of legs between a sonar and some points by triangles.

Upright boxes have closed-form tests in `_image_source_kernel`; all other bodies of a scene share one triangle
tree, built once. Both fill the same columns.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._triangle_tree_kernel import (
    build_tree,
    lowest_solid_below,
    occlude_legs,
    solids_along,
)
from insonify.propagation.bounding_cylinders import points_near_cylinders
from insonify.records.legs import LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]


class TriangleTree(NamedTuple):
    """Triangle tree: triangles in nested bounding boxes, in depth-first order: m nodes, t triangles."""

    bounds: Floats
    """Least and greatest coordinates of each node [m], shape (m, 6)."""
    next_on_miss: NDArray[np.int32]
    """Next node where one is missed, shape (m,)."""
    first_triangle: NDArray[np.int32]
    """First triangle of a leaf, -1 for other nodes, shape (m,)."""
    triangle_count: NDArray[np.int32]
    """Number of triangles of a leaf, shape (m,)."""
    lowest_solid: NDArray[np.int32]
    """Row of the lowest solid below each node, shape (m,)."""
    corner_and_sides: Floats
    """One corner and the two sides from it of each triangle, in the order of the leaves [m], shape (t, 9)."""
    solid_row: NDArray[np.int32]
    """Row of the solid of each triangle, shape (t,)."""
    original_row: NDArray[np.int64]
    """Row of each triangle before sorting, shape (t,)."""


def triangle_tree(corners: Floats, solid_row: NDArray[np.int32]) -> TriangleTree:
    """Build a triangle tree.

    Args:
        corners: Corners of each triangle [m], shape (t, 3, 3).
        solid_row: Row of the solid of each triangle, shape (t,).
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    order, most = np.arange(len(corners)), 2 * len(corners)
    bounds = np.empty((most, 6))
    skip, first, count = np.empty((3, most), np.int32)
    nodes = build_tree(low, high, order, bounds, skip, first, count)
    bounds, skip, first, count = bounds[:nodes].copy(), skip[:nodes].copy(), first[:nodes].copy(), count[:nodes].copy()
    sorted_solid_row, least = solid_row[order].astype(np.int32), np.empty(nodes, np.int32)
    lowest_solid_below(skip, first, count, sorted_solid_row, least)
    a, b, c = np.moveaxis(corners[order], 1, 0)
    corner = np.concatenate([a, b - a, c - a], axis=1)
    return TriangleTree(bounds, skip, first, count, least, corner, sorted_solid_row, order)


@lru_cache(maxsize=8)
def _scene_tree(solids: tuple[Solid, ...], seabed: Seabed, before: int) -> TriangleTree:
    """Tree of all solids of a scene, whose rows among the occluders follow those of the boxes."""
    corners = [world_triangles(solid, seabed).corners for solid in solids]
    solid_row = np.repeat(np.arange(before, before + len(solids)), [len(part) for part in corners])
    return triangle_tree(np.concatenate(corners), solid_row.astype(np.int32))


def occlude_by_solids(
    scene: Scene, position: Floats, scatterers: Scatterers, images: Floats, bounces: NDArray[np.int64],
    first_up: NDArray[np.bool_], status: NDArray[np.uint8], occluder: NDArray[np.int16],
) -> None:  # fmt: skip
    """Mark the straight legs, folded at flat boundaries, that the scene's solids cut.

    Args:
        scene: The scene; without solids nothing changes.
        position: North, east, depth of the sonar [m], shape (3,).
        scatterers: Ends of the legs, n of them.
        images: Depth of the image source of each family [m], shape (f,).
        bounces: Number of bounces of each family, shape (f,).
        first_up: True where the first bounce is off the surface, shape (f,).
        status: `LegStatus` of the legs; clear ones may become occluded, shape (f, n).
        occluder: Row of the occluder of each leg, set for occluded ones, shape (f, n).
    """
    solids = scene.solids
    if not solids:
        return
    # seen from above, legs of all families follow one line: most points have no solid on it
    behind = points_near_cylinders(scene, position, scatterers.position)[len(scene.boxes) :]
    rows = behind[0] if len(behind) == 1 else np.unique(np.concatenate(behind))
    if not len(rows):
        return
    tree = _scene_tree(solids, scene.seabed, len(scene.boxes))
    occlude_legs(
        position, images, bounces, first_up, scene.seabed.depth, rows, scatterers.position, scatterers.normal,
        *tree[:7],
        int(LegStatus.CLEAR), int(LegStatus.OCCLUDED), status, occluder,
    )  # fmt: skip


def occluders_of_paths(scene: Scene, polylines: Floats) -> NDArray[np.int16]:
    """Occluders of curved paths, given by points along them.

    Args:
        scene: The scene.
        polylines: Points along each path, from the sonar to just before its end [m], shape (n, k, 3).

    Returns:
        Lowest row among the scene's occluders of the solids that a path hits, -1 for none, shape (n,).
    """
    found = np.full(len(polylines), -1, np.int16)
    if scene.solids:
        tree = _scene_tree(scene.solids, scene.seabed, len(scene.boxes))
        solids_along(polylines, *tree[:7], found)
    return found
