"""Shadows of solids: occlusion of legs between a sonar and some points by triangles.

Upright boxes have closed-form tests in `_image_source_kernel`; all other bodies of a scene share one triangle
tree, built once. Both fill the same columns.
"""

from functools import lru_cache
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._image_source_kernel import FoldedLegs
from insonify.propagation._light_buffer_kernel import LightBuffer, light_buffer, occlude_direct_legs
from insonify.propagation._solid_shadow_kernel import occlude_legs, solids_along
from insonify.propagation.bounding_cylinders import points_near_cylinders, union
from insonify.propagation.triangle_tree import TriangleTree, triangle_tree
from insonify.recent_results import Identity, RecentResults
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

MIN_LEGS_PER_TRIANGLE = 1.0
"""Number of direct legs past a solid, for each of its triangles, from which a light buffer is worth making [1]."""
MIN_DISTANCE = 0.75
"""Least distance of a sonar from the middle of a solid with a light buffer, over the solid's diagonal [1]."""
_TREE_LOCK = Lock()
_BUFFERS: RecentResults[LightBuffer] = RecentResults(64)
"""Light buffers of recent solids and sonar positions: legs to all scatterers use the same."""


class SceneTriangles(NamedTuple):
    """Triangles of all solids of a scene, together and solid by solid."""

    tree: TriangleTree
    """Tree of the triangles of all solids."""
    first_row: int
    """Row of the first solid among the occluders: that after the boxes."""
    of_solid: list[Floats]
    """One corner and the two sides from it of the triangles of each solid [m], (t, 9) each."""
    extent: Floats
    """North, east, depth of the middle of each solid's extent, and its diagonal [m], shape (solids, 4)."""


@lru_cache(maxsize=8)
def _built_triangles(solids: tuple[Solid, ...], seabed: Seabed, first_row: int) -> SceneTriangles:
    """Triangles of all solids of a scene; the first solid has a given row among the occluders."""
    surfaces = [world_triangles(solid, seabed) for solid in solids]
    solid_row = np.repeat(np.arange(first_row, first_row + len(solids)), [len(surface.faces) for surface in surfaces])
    tree = triangle_tree(np.concatenate([surface.corners for surface in surfaces]), solid_row)
    of_solid = [tree.corner_and_sides[tree.solid_row == first_row + k] for k in range(len(solids))]
    extent = np.zeros((len(solids), 4))
    for row, surface in zip(extent, surfaces, strict=True):
        if len(surface.faces):
            row[:3], row[3] = (surface.low + surface.high) / 2, np.linalg.norm(surface.high - surface.low)
    return SceneTriangles(tree, first_row, of_solid, extent)


def _scene_triangles(solids: tuple[Solid, ...], seabed: Seabed, first_row: int) -> SceneTriangles:
    """Triangles of all solids of a scene, see `_built_triangles`; threads that need them at once share them."""
    with _TREE_LOCK:
        return _built_triangles(solids, seabed, first_row)


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
    # seen from above, legs of all families follow one line: for most points no solid lies on it, or only below the leg
    direct, solid_targets = not legs.bounces.any(), slice(len(scene.boxes), None)
    behind = points_near_cylinders(scene, legs.source, scatterers.position, direct=direct, targets=solid_targets)
    rows = union(behind, len(scatterers))
    if not len(rows):
        return
    triangles, end = _scene_triangles(solids, scene.seabed, len(scene.boxes)), (scatterers.position, scatterers.normal)
    buffers = _light_buffers(triangles, legs.source, behind) if direct and legs.bounces.size == 1 else None
    if buffers is None:
        occlude_legs(legs, triangles.tree, rows, *end, status, occluder)
    for solid_row, points, buffer in buffers or ():  # in increasing row
        occlude_direct_legs(buffer, legs.source, solid_row, points, *end, status[0], occluder[0])


def _light_buffers(
    triangles: SceneTriangles, source: Floats, behind: list[NDArray[np.int64]]
) -> list[tuple[int, NDArray[np.int64], LightBuffer]] | None:
    """Light buffers of the solids on direct legs; None where legs are too few, or the sonar is too near.

    Args:
        triangles: Triangles of all solids.
        source: Position of the sonar [m], (3,).
        behind: Rows of the points that each solid may hide, solid by solid.

    Returns:
        For each solid that may hide any point: its row among the occluders, the rows of these points, its light buffer.
    """
    hiding = [k for k, rows in enumerate(behind) if len(rows) and len(triangles.of_solid[k])]
    triangle_count = sum(len(triangles.of_solid[k]) for k in hiding)
    if sum(len(behind[k]) for k in hiding) < MIN_LEGS_PER_TRIANGLE * triangle_count:
        return None
    middle, diagonal = triangles.extent[:, :3], triangles.extent[:, 3]
    if (np.linalg.norm(middle[hiding] - source, axis=1) < MIN_DISTANCE * diagonal[hiding]).any():
        return None

    def buffer_of(k: int) -> LightBuffer:
        key = Identity(triangles.of_solid[k]), tuple(source.tolist())
        return _BUFFERS.get(key, lambda: light_buffer(source, middle[k], triangles.of_solid[k]))

    return [(triangles.first_row + k, behind[k], buffer_of(k)) for k in hiding]


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
    bodies, first_row = (scene.occluders, 0) if with_boxes else (scene.solids, len(scene.boxes))
    if bodies:
        solids_along(polylines, _scene_triangles(bodies, scene.seabed, first_row).tree, occluders)
    return occluders
