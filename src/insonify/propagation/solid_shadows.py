"""Shadows of solids: occlusion of legs between a sonar and some points by triangles.

Upright boxes have closed-form tests in `_image_source_kernel`; all other bodies of a scene share one triangle
tree, built once. Both fill the same columns.
"""

from functools import lru_cache
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._image_source_kernel import FoldedLegs
from insonify.propagation._solid_shadow_kernel import occlude_legs, solids_along
from insonify.propagation.bounding_cylinders import points_near_cylinders, union
from insonify.propagation.triangle_tree import TriangleTree, triangle_tree
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

_TREE_LOCK = Lock()


@lru_cache(maxsize=8)
def _built_tree(solids: tuple[Solid, ...], seabed: Seabed, before: int) -> TriangleTree:
    """Tree of all solids of a scene, whose rows among the occluders follow those of the boxes."""
    corners = [world_triangles(solid, seabed).corners for solid in solids]
    solid_row = np.repeat(np.arange(before, before + len(solids)), [len(part) for part in corners])
    return triangle_tree(np.concatenate(corners), solid_row)


def _scene_tree(solids: tuple[Solid, ...], seabed: Seabed, before: int) -> TriangleTree:
    """Tree of all solids of a scene, see `_built_tree`; threads that need it at once share one."""
    with _TREE_LOCK:
        return _built_tree(solids, seabed, before)


def occlude_by_solids(
    scene: Scene, legs: FoldedLegs, scatterers: Scatterers, status: NDArray[np.uint8], occluder: NDArray[np.int16]
) -> None:  # fmt: skip
    """Mark the straight legs, folded at flat boundaries, that the scene's solids cut.

    Args:
        scene: The scene; without solids nothing changes.
        legs: Image sources of f families.
        scatterers: Ends of the legs, n of them.
        status: `LegStatus` of the legs; clear ones may become occluded, shape (f, n).
        occluder: Row of the occluder of each leg, set for occluded ones, shape (f, n).
    """
    solids = scene.solids
    if not solids:
        return
    # seen from above, legs of all families follow one line: most points have no solid on it, or below a direct leg
    direct, own = not legs.bounces.any(), slice(len(scene.boxes), None)
    behind = points_near_cylinders(scene, legs.source, scatterers.position, direct=direct, targets=own)
    rows = union(behind, len(scatterers))
    if not len(rows):
        return
    tree = _scene_tree(solids, scene.seabed, len(scene.boxes))
    occlude_legs(legs, tree, rows, scatterers.position, scatterers.normal, status, occluder)


def occluders_of_paths(scene: Scene, polylines: Floats, *, with_boxes: bool = False) -> NDArray[np.int16]:
    """Occluders of curved paths, given by points along them.

    Args:
        scene: The scene.
        polylines: Points along each path, from the sonar to just before its end [m], shape (n, k, 3).
        with_boxes: True: upright boxes occlude them too.

    Returns:
        Lowest row among the scene's occluders of the solids that a path hits, -1 for none, shape (n,).
    """
    occluders = np.full(len(polylines), -1, np.int16)
    bodies, before = (scene.occluders, 0) if with_boxes else (scene.solids, len(scene.boxes))
    if bodies:
        tree = _scene_tree(bodies, scene.seabed, before)
        solids_along(polylines, tree, occluders)
    return occluders
