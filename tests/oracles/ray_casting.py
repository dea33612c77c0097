"""First triangles that straight segments hit, by the bounding-volume hierarchy of the solids."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._triangle_tree_kernel import inverse_step, misses_box, triangle_hit
from insonify.propagation.solid_shadows import TriangleTree

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def nearest_hits(bounds, next_on_miss, first, count, corner, start, step, part, triangle):
    """First triangle that each segment hits, into part and triangle."""
    for n in range(start.shape[0]):
        x, y, z = start[n, 0], start[n, 1], start[n, 2]
        dx, dy, dz = step[n, 0], step[n, 1], step[n, 2]
        ix, iy, iz = inverse_step(dx), inverse_step(dy), inverse_step(dz)
        part[n], triangle[n] = np.inf, -1
        node = 0
        while node < next_on_miss.size:
            if misses_box(bounds[node], x, y, z, ix, iy, iz, min(part[n], 1.0)):
                node = next_on_miss[node]
                continue
            if first[node] >= 0:
                for t in range(first[node], first[node] + count[node]):
                    there = triangle_hit(corner[t], x, y, z, dx, dy, dz)
                    if 0 <= there <= 1 and there < part[n]:
                        part[n], triangle[n] = there, t
            node += 1


def cast_rays(tree: TriangleTree, start: Floats, stop: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """First triangles that straight segments hit.

    Args:
        tree: The triangles.
        start: Starts of the segments [m], shape (n, 3).
        stop: Ends of the segments [m], shape (n, 3).

    Returns:
        Fraction of the segment at the hit, infinite for no hit, shape (n,), and the row of the triangle before
        sorting, -1 for none, shape (n,).
    """
    part, triangle = np.empty(len(start)), np.empty(len(start), np.int64)
    nearest_hits(
        tree.bounds,
        tree.next_on_miss,
        tree.first_triangle,
        tree.triangle_count,
        tree.corner_and_sides,
        start,
        stop - start,
        part,
        triangle,
    )
    return part, np.where(triangle >= 0, tree.original_row[triangle], -1)
