"""First triangles that straight segments hit, by the bounding-volume hierarchy of the solids."""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._triangle_tree_kernel import nearest_hits
from insonify.propagation.solid_shadows import TriangleTree

Floats = NDArray[np.float64]


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
