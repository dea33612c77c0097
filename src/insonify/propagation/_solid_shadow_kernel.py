"""Kernels that mark legs that solids cut, segment by segment."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._image_source_kernel import FoldedLegs
from insonify.propagation._light_buffer_kernel import LEG_END_OFFSET
from insonify.propagation.triangle_tree import TriangleTree, Vector, inverse_step, lowest_solid
from insonify.records.legs import LegStatus

Floats = NDArray[np.float64]
Integers = NDArray[Any]

NONE = np.iinfo(np.int64).max  # row of a solid that stands for none: above all rows
_CLEAR, _OCCLUDED = int(LegStatus.CLEAR), int(LegStatus.OCCLUDED)


@njit(cache=True, nogil=True, error_model="numpy")
def _misses_all_leaves(tree: TriangleTree, source: Floats, x: float, y: float) -> bool:
    """Return True if a segment from the sonar, seen from above, misses all leaves of a tree."""
    ix, iy = inverse_step(x - source[0]), inverse_step(y - source[1])
    node = 0
    while node < tree.next_on_miss.size:
        a, b = (tree.bounds[node, 0] - source[0]) * ix, (tree.bounds[node, 3] - source[0]) * ix
        enter, leave = max(0.0, min(a, b)), min(1.0, max(a, b))
        a, b = (tree.bounds[node, 1] - source[1]) * iy, (tree.bounds[node, 4] - source[1]) * iy
        if max(enter, min(a, b)) > min(leave, max(a, b)):
            node = tree.next_on_miss[node]
        elif tree.first_triangle[node] >= 0:
            return False
        else:
            node += 1
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def occlude_legs(
    legs: FoldedLegs, tree: TriangleTree, rows: Integers, points: Floats, normals: Floats, status: Integers,
    occluder: Integers,
) -> None:  # fmt: skip
    """Mark the clear legs that solids cut; each segment between two bounces is tested on its own.

    Args:
        legs: The legs.
        tree: Triangles of the solids.
        rows: Indices of the points to process, (r,).
        points: North, east, depth of the scatterers [m], (n, 3).
        normals: Unit normals, (n, 3); segments end `LEG_END_OFFSET` before a point, on the side that its normal faces.
        status: `LegStatus`, changed for occluded legs, (f, n).
        occluder: Set to the lowest row of a solid hit for occluded legs, (f, n).
    """
    likely = -1  # neighbouring legs mostly hit the same triangle
    for n in rows:
        x = points[n, 0] + LEG_END_OFFSET * normals[n, 0]
        y = points[n, 1] + LEG_END_OFFSET * normals[n, 1]
        z = points[n, 2] + LEG_END_OFFSET * normals[n, 2]
        # Seen from above legs of all families follow one line: most points end here; a single leg is tested once.
        if legs.image_depths.size > 1 and _misses_all_leaves(tree, legs.source, x, y):
            continue
        for f in range(legs.image_depths.size):
            if status[f, n] != _CLEAR:
                continue
            solid, likely = _lowest_solid_of_leg(legs, tree, f, (x, y, z), likely)
            if solid != NONE:
                status[f, n], occluder[f, n] = _OCCLUDED, solid


@njit(cache=True, nogil=True, error_model="numpy")
def _lowest_solid_of_leg(
    legs: FoldedLegs, tree: TriangleTree, f: int, end: Vector, likely: int
) -> tuple[int, int]:  # fmt: skip
    """Lowest row of a solid that a leg of one family hits, or `NONE`, and a triangle, see `lowest_solid`.

    Args:
        legs: The legs.
        tree: Triangles of the solids.
        f: The family.
        end: End of the leg [m].
        likely: Triangle that is tested first, -1 for none.
    """
    x, y, z = end
    # begin, stop: ends of a segment, as fractions of the horizontal distance
    source, bounces = legs.source, legs.bounces[f]
    dx, dy, vertical_travel = x - source[0], y - source[1], abs(z - legs.image_depths[f])
    begin, depth, goes_down, solid = 0.0, source[2], not legs.first_up[f], NONE
    for segment in range(bounces + 1):
        if segment == bounces:
            stop, end_depth = 1.0, z
        else:
            end_depth = legs.water_depth if goes_down else 0.0
            stop = begin + abs(end_depth - depth) / max(vertical_travel, 1e-12)
        start = source[0] + begin * dx, source[1] + begin * dy, depth
        step = (stop - begin) * dx, (stop - begin) * dy, end_depth - depth
        solid, likely = lowest_solid(tree, start, step, solid, likely)
        begin, depth, goes_down = stop, end_depth, not goes_down
    return solid, likely


@njit(cache=True, nogil=True, error_model="numpy")
def solids_along(polylines: Floats, tree: TriangleTree, solids_hit: Integers) -> None:
    """Write the lowest row of a solid that each polyline (n, k, 3) [m] hits, -1 for none, into solids_hit (n,)."""
    for n in range(polylines.shape[0]):
        lowest, likely = NONE, -1
        for k in range(polylines.shape[1] - 1):
            a, b = polylines[n, k], polylines[n, k + 1]
            step = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            lowest, likely = lowest_solid(tree, (a[0], a[1], a[2]), step, lowest, likely)
        solids_hit[n] = -1 if lowest == NONE else lowest
