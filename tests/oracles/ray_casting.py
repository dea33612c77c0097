"""First triangles that straight segments hit, by the triangle tree of the solids."""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.triangle_tree import TriangleTree, nearest_hit

Floats = NDArray[np.float64]


def cast_rays(tree: TriangleTree, start: Floats, stop: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """First triangles that straight segments (n, 3) [m] hit.

    Returns:
        Fraction of the segment at the hit, infinite for no hit, shape (n,), and the row of the triangle before
        sorting, -1 for none, shape (n,).
    """
    limits = -1e-300, np.nextafter(1.0, 2.0)
    hits = [nearest_hit(tree, tuple(a), tuple(b), *limits) for a, b in zip(start, stop - start, strict=True)]
    part, row = (np.array(column) for column in zip(*hits, strict=True))
    return np.where(row >= 0, part, np.inf), np.where(row >= 0, tree.original_row[row], -1)
