"""Triangle tree: triangles in nested bounding boxes, and the first one, or the lowest solid, that a segment hits.

The tree is in depth-first order; each node stores the next node after a miss, so a traversal needs no stack. The
lowest solid is the one with the lowest row.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Vector = tuple[float, float, float]

BINS = 16  # intervals between which a node may be split
MAX_LEAF_TRIANGLES = 4  # nodes with more are split
EDGE_MARGIN = 1e-9
"""Margin outside its edges in which a triangle still stops a ray, re its sides: neighbours leave no gap [1]."""


class TriangleTree(NamedTuple):
    """Triangles in nested bounding boxes, in depth-first order: m nodes, t triangles."""

    bounds: Floats
    """Least and greatest coordinates of each node [m], shape (m, 6)."""
    next_on_miss: NDArray[np.int32]
    """Node with which a traversal goes on after a miss of this one, shape (m,)."""
    first_triangle: NDArray[np.int32]
    """First triangle of a leaf, -1 for other nodes, shape (m,)."""
    triangle_count: NDArray[np.int32]
    """Number of triangles of a leaf, shape (m,)."""
    lowest_solid: NDArray[np.int32]
    """Lowest row of a solid among the triangles of each node and its descendants, shape (m,)."""
    corner_and_sides: Floats
    """One corner and the two sides from it of each triangle, in the order of the leaves [m], shape (t, 9)."""
    normal: Floats
    """Unit normal of each triangle, outwards where corners are counter-clockwise from outside [1], shape (t, 3)."""
    solid_row: NDArray[np.int32]
    """Row of the solid of each triangle, shape (t,)."""
    original_row: NDArray[np.int64]
    """Row of each triangle before sorting, shape (t,)."""


def triangle_tree(corners: Floats, solid_row: Integers) -> TriangleTree:
    """Build a triangle tree.

    Args:
        corners: Corners of each triangle [m], shape (t, 3, 3).
        solid_row: Row of the solid of each triangle, shape (t,).
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    order, max_nodes = np.arange(len(corners)), 2 * len(corners)
    bounds = np.empty((max_nodes, 6))
    skip, first, count = np.empty((3, max_nodes), np.int32)
    nodes = _build_nodes(low, high, order, bounds, skip, first, count) if max_nodes else 0
    bounds, skip, first, count = bounds[:nodes].copy(), skip[:nodes].copy(), first[:nodes].copy(), count[:nodes].copy()
    sorted_solid_row, lowest_below = solid_row[order].astype(np.int32), np.empty(nodes, np.int32)
    _lowest_solid_below(skip, first, count, sorted_solid_row, lowest_below)
    a, b, c = np.moveaxis(corners[order], 1, 0)
    cross_product = np.cross(b - a, c - a)
    normal = cross_product / np.maximum(np.linalg.norm(cross_product, axis=1, keepdims=True), 1e-300)
    corner = np.concatenate([a, b - a, c - a], axis=1)
    return TriangleTree(bounds, skip, first, count, lowest_below, corner, normal, sorted_solid_row, order)


@njit(cache=True, nogil=True, error_model="numpy")
def _build_nodes(
    low: Floats, high: Floats, order: Integers, bounds: Floats, next_on_miss: Integers, first: Integers, count: Integers
) -> int:
    """Build a triangle tree by the surface-area heuristic, in bins.

    Args:
        low: Least coordinates of each triangle [m], (t, 3).
        high: Greatest coordinates of each triangle [m], (t, 3).
        order: Rows of the triangles, in any order; on return in the order of the leaves, (t,).
        bounds: Result: least and greatest coordinates of each node, (2 t, 6).
        next_on_miss: Result: node to go on with after a miss, (2 t,).
        first: Result: first triangle of a leaf in `order`, -1 for other nodes, (2 t,).
        count: Result: number of triangles of a leaf, (2 t,).

    Returns:
        Number of nodes.

    Source: Wald (2007), "On fast construction of SAH-based bounding volume hierarchies", IEEE Symp. on Interactive
    Ray Tracing, sections 3.1-3.2.
    """
    starts, stops, parents = np.empty((3, order.size + 1), np.int64)
    parent = np.full(bounds.shape[0], -1, np.int64)
    starts[0], stops[0], parents[0] = 0, order.size, -1
    waiting, nodes = 1, 0
    while waiting > 0:
        waiting -= 1
        start, stop, node = starts[waiting], stops[waiting], nodes
        nodes += 1
        parent[node] = parents[waiting]
        bounding_box(low, high, order, start, stop, bounds[node])
        middle = start if stop - start <= MAX_LEAF_TRIANGLES else split_node(low, high, order, start, stop)
        first[node], count[node] = (-1, 0) if middle > start else (start, stop - start)
        if middle > start:
            # the first half is popped next, so that it follows its parent
            starts[waiting], stops[waiting], parents[waiting] = middle, stop, node
            starts[waiting + 1], stops[waiting + 1], parents[waiting + 1] = start, middle, node
            waiting += 2
    for node in range(nodes):
        next_on_miss[node] = 1
    for node in range(nodes - 1, 0, -1):  # children come after their parents
        next_on_miss[parent[node]] += next_on_miss[node]
    for node in range(nodes):
        next_on_miss[node] += node
    return nodes


@njit(cache=True, nogil=True, error_model="numpy")
def bounding_box(low: Floats, high: Floats, order: Integers, start: int, stop: int, bounds: Floats) -> None:
    """Write the least and greatest coordinates of triangles `order[start:stop]`, slightly enlarged, to bounds (6,)."""
    for axis in range(3):
        low_corner, high_corner = np.inf, -np.inf
        for n in range(start, stop):
            low_corner = min(low_corner, low[order[n], axis])
            high_corner = max(high_corner, high[order[n], axis])
        margin = 1e-6 * (high_corner - low_corner) + 1e-12 * max(abs(low_corner), abs(high_corner)) + 1e-9
        bounds[axis], bounds[3 + axis] = low_corner - margin, high_corner + margin


@njit(cache=True, nogil=True, error_model="numpy")
def split_node(low: Floats, high: Floats, order: Integers, start: int, stop: int) -> int:
    """Split the triangles of a node in two groups; return the first row of the second, or `start` for a leaf."""
    axis, low_edge, extent = 0, 0.0, 0.0
    for a in range(3):
        min_middle, max_middle = np.inf, -np.inf
        for n in range(start, stop):
            middle = low[order[n], a] + high[order[n], a]
            min_middle, max_middle = min(min_middle, middle), max(max_middle, middle)
        if max_middle - min_middle > extent:
            axis, low_edge, extent = a, min_middle, max_middle - min_middle
    if extent <= 0:
        return start
    scale = BINS * (1 - 1e-9) / extent
    border = cheapest_split(low, high, order, start, stop, axis, low_edge, scale)
    i, j = start, stop - 1
    while i <= j:
        row = order[i]
        if int((low[row, axis] + high[row, axis] - low_edge) * scale) < border:
            i += 1
        else:
            order[i], order[j] = order[j], row
            j -= 1
    return i


@njit(cache=True, nogil=True, error_model="numpy")
def cheapest_split(
    low: Floats, high: Floats, order: Integers, start: int, stop: int, axis: int, low_edge: float, scale: float
) -> int:
    """First bin after the best split: least sum of surface times number of triangles. First and last bin are filled."""
    box = np.empty((BINS, 6))
    box[:, :3], box[:, 3:] = np.inf, -np.inf
    bin_count = np.zeros(BINS, np.int64)
    for n in range(start, stop):
        row = order[n]
        b = int((low[row, axis] + high[row, axis] - low_edge) * scale)
        bin_count[b] += 1
        for a in range(3):
            box[b, a] = min(box[b, a], low[row, a])
            box[b, 3 + a] = max(box[b, 3 + a], high[row, a])
    cost_after = np.zeros(BINS)
    merged_box = np.array([np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf])
    total = 0
    for b in range(BINS - 1, 0, -1):
        total += bin_count[b]
        cost_after[b] = total * merged_half_area(merged_box, box[b])
    best, border, total = np.inf, 1, 0
    merged_box[:3], merged_box[3:] = np.inf, -np.inf
    for b in range(BINS - 1):
        total += bin_count[b]
        cost = total * merged_half_area(merged_box, box[b]) + cost_after[b + 1]
        if cost < best:
            best, border = cost, b + 1
    return border


@njit(cache=True, nogil=True, error_model="numpy")
def merged_half_area(merged_box: Floats, box: Floats) -> float:
    """Merge a box (6,) into another, in place, and return half the surface of that [m^2]."""
    for a in range(3):
        merged_box[a] = min(merged_box[a], box[a])
        merged_box[3 + a] = max(merged_box[3 + a], box[3 + a])
    x, y, z = merged_box[3] - merged_box[0], merged_box[4] - merged_box[1], merged_box[5] - merged_box[2]
    return x * y + y * z + z * x


@njit(cache=True, nogil=True, error_model="numpy")
def _lowest_solid_below(
    next_on_miss: Integers, first: Integers, count: Integers, solid: Integers, node_solid: Integers
) -> None:
    """Write the lowest solid of the triangles below each node to `node_solid`."""
    for node in range(next_on_miss.size - 1, -1, -1):
        if first[node] >= 0:
            node_solid[node] = solid[first[node] : first[node] + count[node]].min()
        else:  # one child follows, the other comes after the descendants of the first
            node_solid[node] = min(node_solid[node + 1], node_solid[next_on_miss[node + 1]])


@njit(cache=True, nogil=True, error_model="numpy")
def inverse_step(step: float) -> float:
    """One over a step; a huge number for zero, which never makes a NaN."""
    return 1 / step if abs(step) > 1e-200 else 1e200


@njit(cache=True, nogil=True, error_model="numpy")
def _misses_box(box: Floats, start: Vector, inverse: Vector, max_multiple: float) -> bool:
    """Return True if a segment from start to a multiple of its step misses a box (6,); inverse: of that step [1/m]."""
    a, b = (box[0] - start[0]) * inverse[0], (box[3] - start[0]) * inverse[0]
    enter, leave = max(0.0, min(a, b)), min(max_multiple, max(a, b))
    a, b = (box[1] - start[1]) * inverse[1], (box[4] - start[1]) * inverse[1]
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    a, b = (box[2] - start[2]) * inverse[2], (box[5] - start[2]) * inverse[2]
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter > leave


@njit(cache=True, nogil=True, error_model="numpy")
def triangle_hit(corner: Floats, start: Vector, step: Vector) -> float:
    """Multiple of a step at which it hits a triangle, corner and two sides (9,); infinite for a miss.

    Source: Moller & Trumbore (1997), J. Graphics Tools 2(1), 21.
    """
    dx, dy, dz = step
    ax, ay, az, bx, by, bz = corner[3], corner[4], corner[5], corner[6], corner[7], corner[8]
    px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
    det = ax * px + ay * py + az * pz
    if det == 0:
        return np.inf
    sx, sy, sz = start[0] - corner[0], start[1] - corner[1], start[2] - corner[2]
    u = (sx * px + sy * py + sz * pz) / det
    if u < -EDGE_MARGIN or u > 1 + EDGE_MARGIN:
        return np.inf
    qx, qy, qz = sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax
    v = (dx * qx + dy * qy + dz * qz) / det
    if v < -EDGE_MARGIN or u + v > 1 + EDGE_MARGIN:
        return np.inf
    return (bx * qx + by * qy + bz * qz) / det


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_hit(tree: TriangleTree, start: Vector, step: Vector, low: float, high: float) -> tuple[float, int]:
    """First triangle that a ray hits between two multiples of its step: multiple and row; `high` and -1 for none."""
    inverse = inverse_step(step[0]), inverse_step(step[1]), inverse_step(step[2])
    triangle, node = -1, 0
    while node < tree.next_on_miss.size:
        if _misses_box(tree.bounds[node], start, inverse, high):
            node = tree.next_on_miss[node]
            continue
        if tree.first_triangle[node] >= 0:
            for t in range(tree.first_triangle[node], tree.first_triangle[node] + tree.triangle_count[node]):
                multiple = triangle_hit(tree.corner_and_sides[t], start, step)
                if low < multiple < high:
                    high, triangle = multiple, t
        node += 1
    return high, triangle


@njit(cache=True, nogil=True, error_model="numpy")
def lowest_solid(
    tree: TriangleTree, start: Vector, step: Vector, lowest_so_far: int, likely: int
) -> tuple[int, int]:  # fmt: skip
    """Row of the lowest solid that a segment hits, or `lowest_so_far` where none is lower, and the triangle hit.

    Args:
        tree: The triangles.
        start: Start of the segment [m].
        step: The segment [m].
        lowest_so_far: Row of a solid; those of higher rows are not tested.
        likely: Triangle that is tested first, such as that of a neighbouring segment; -1 for none. It is returned where
            none is hit.
    """
    inverse = inverse_step(step[0]), inverse_step(step[1]), inverse_step(step[2])
    node = 0
    is_lower = likely >= 0 and tree.solid_row[likely] < lowest_so_far
    if is_lower and 0 <= triangle_hit(tree.corner_and_sides[likely], start, step) <= 1:
        lowest_so_far = tree.solid_row[likely]
    while node < tree.next_on_miss.size:
        if tree.lowest_solid[node] >= lowest_so_far or _misses_box(tree.bounds[node], start, inverse, 1.0):
            node = tree.next_on_miss[node]
            continue
        if tree.first_triangle[node] >= 0:
            for t in range(tree.first_triangle[node], tree.first_triangle[node] + tree.triangle_count[node]):
                if tree.solid_row[t] < lowest_so_far and 0 <= triangle_hit(tree.corner_and_sides[t], start, step) <= 1:
                    lowest_so_far, likely = tree.solid_row[t], t
        node += 1
    return lowest_so_far, likely
