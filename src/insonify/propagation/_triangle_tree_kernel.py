"""Triangle tree: bounding boxes around triangles, and the segments that hit them. Plain arrays only.

The tree is in depth-first order; each node stores the next node after a miss, so a traversal needs no stack.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]

BINS = 16
LEAF = 4
EDGE = 1e-9
"""Margin outside its edges at which a triangle still stops a ray, as a fraction of its sides [1]: no gaps."""

OFF = 1e-6
"""Distance before a face at which segments to it end [m]: less than any wavelength, more than any rounding."""


@njit(cache=True, nogil=True, error_model="numpy")
def build_tree(
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
        middle = start if stop - start <= LEAF else split_node(low, high, order, start, stop)
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
    """Least and greatest coordinates of some triangles, slightly enlarged, into bounds (6,)."""
    for axis in range(3):
        least, most = np.inf, -np.inf
        for n in range(start, stop):
            least = min(least, low[order[n], axis])
            most = max(most, high[order[n], axis])
        margin = 1e-6 * (most - least) + 1e-12 * max(abs(least), abs(most)) + 1e-9
        bounds[axis], bounds[3 + axis] = least - margin, most + margin


@njit(cache=True, nogil=True, error_model="numpy")
def split_node(low: Floats, high: Floats, order: Integers, start: int, stop: int) -> int:
    """Split the triangles of a node in two groups; return the first row of the second, or `start` for a leaf."""
    axis, least, extent = 0, 0.0, 0.0
    for a in range(3):
        near, far = np.inf, -np.inf
        for n in range(start, stop):
            middle = low[order[n], a] + high[order[n], a]
            near, far = min(near, middle), max(far, middle)
        if far - near > extent:
            axis, least, extent = a, near, far - near
    if extent <= 0:
        return start
    scale = BINS * (1 - 1e-9) / extent
    border = cheapest_split(low, high, order, start, stop, axis, least, scale)
    i, j = start, stop - 1
    while i <= j:
        row = order[i]
        if int((low[row, axis] + high[row, axis] - least) * scale) < border:
            i += 1
        else:
            order[i], order[j] = order[j], row
            j -= 1
    return i


@njit(cache=True, nogil=True, error_model="numpy")
def cheapest_split(
    low: Floats, high: Floats, order: Integers, start: int, stop: int, axis: int, least: float, scale: float
) -> int:
    """Bin of the best split: least sum of surface times triangles. First and last bin are filled."""
    box = np.empty((BINS, 6))
    box[:, :3], box[:, 3:] = np.inf, -np.inf
    number = np.zeros(BINS, np.int64)
    for n in range(start, stop):
        row = order[n]
        b = int((low[row, axis] + high[row, axis] - least) * scale)
        number[b] += 1
        for a in range(3):
            box[b, a] = min(box[b, a], low[row, a])
            box[b, 3 + a] = max(box[b, 3 + a], high[row, a])
    after = np.zeros(BINS)
    grown = np.array([np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf])
    total = 0
    for b in range(BINS - 1, 0, -1):
        total += number[b]
        after[b] = total * merged_half_area(grown, box[b])
    best, border, total = np.inf, 1, 0
    grown[:3], grown[3:] = np.inf, -np.inf
    for b in range(BINS - 1):
        total += number[b]
        cost = total * merged_half_area(grown, box[b]) + after[b + 1]
        if cost < best:
            best, border = cost, b + 1
    return border


@njit(cache=True, nogil=True, error_model="numpy")
def merged_half_area(grown: Floats, box: Floats) -> float:
    """Half the surface of a box (6,) merged with another."""
    for a in range(3):
        grown[a] = min(grown[a], box[a])
        grown[3 + a] = max(grown[3 + a], box[3 + a])
    x, y, z = grown[3] - grown[0], grown[4] - grown[1], grown[5] - grown[2]
    return x * y + y * z + z * x


@njit(cache=True, nogil=True, error_model="numpy")
def inverse_step(step: float) -> float:
    """One over a step; a huge number for zero, which never makes a NaN."""
    return 1 / step if abs(step) > 1e-200 else 1e200


@njit(cache=True, nogil=True, error_model="numpy")
def misses_box(box: Floats, x: float, y: float, z: float, ix: float, iy: float, iz: float, max_fraction: float) -> bool:
    """Return True if a segment from (x, y, z), up to a fraction, misses a box; given by the inverse of its steps."""
    a, b = (box[0] - x) * ix, (box[3] - x) * ix
    enter, leave = max(0.0, min(a, b)), min(max_fraction, max(a, b))
    a, b = (box[1] - y) * iy, (box[4] - y) * iy
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    a, b = (box[2] - z) * iz, (box[5] - z) * iz
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter > leave


@njit(cache=True, nogil=True, error_model="numpy")
def triangle_hit(corner: Floats, x: float, y: float, z: float, dx: float, dy: float, dz: float) -> float:
    """Fraction of a segment from (x, y, z) at which it hits a triangle, corner and two sides (9,); infinite for a miss.

    Source: Moller & Trumbore (1997), J. Graphics Tools 2(1), 21.
    """
    ax, ay, az, bx, by, bz = corner[3], corner[4], corner[5], corner[6], corner[7], corner[8]
    px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
    det = ax * px + ay * py + az * pz
    if det == 0:
        return np.inf
    sx, sy, sz = x - corner[0], y - corner[1], z - corner[2]
    u = (sx * px + sy * py + sz * pz) / det
    if u < -EDGE or u > 1 + EDGE:
        return np.inf
    qx, qy, qz = sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax
    v = (dx * qx + dy * qy + dz * qz) / det
    if v < -EDGE or u + v > 1 + EDGE:
        return np.inf
    return (bx * qx + by * qy + bz * qz) / det


@njit(cache=True, nogil=True, error_model="numpy")
def lowest_solid_below(
    next_on_miss: Integers, first: Integers, count: Integers, solid: Integers, node_solid: Integers
) -> None:
    """Lowest solid of the triangles below each node, into `node_solid`; the other arguments as in `lowest_solid`."""
    for node in range(next_on_miss.size - 1, -1, -1):
        if first[node] >= 0:
            node_solid[node] = solid[first[node] : first[node] + count[node]].min()
        else:  # its children follow, and after the first of them
            node_solid[node] = min(node_solid[node + 1], node_solid[next_on_miss[node + 1]])


@njit(cache=True, nogil=True, error_model="numpy")
def misses_all_leaves(
    bounds: Floats, next_on_miss: Integers, first: Integers, x: float, y: float, dx: float, dy: float
) -> bool:
    """Return True if a segment, seen from above, misses all leaves of a tree; arguments as in `lowest_solid`."""
    ix, iy = inverse_step(dx), inverse_step(dy)
    node = 0
    while node < next_on_miss.size:
        a, b = (bounds[node, 0] - x) * ix, (bounds[node, 3] - x) * ix
        enter, leave = max(0.0, min(a, b)), min(1.0, max(a, b))
        a, b = (bounds[node, 1] - y) * iy, (bounds[node, 4] - y) * iy
        if max(enter, min(a, b)) > min(leave, max(a, b)):
            node = next_on_miss[node]
        elif first[node] >= 0:
            return False
        else:
            node += 1
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def lowest_solid(
    bounds: Floats, next_on_miss: Integers, first: Integers, count: Integers, node_solid: Integers, corner: Floats,
    solid: Integers,
    x: float, y: float, z: float, dx: float, dy: float, dz: float, lowest_so_far: int,
) -> int:  # fmt: skip
    """Lowest solid of the triangles that a segment hits, or `lowest_so_far` where none is lower.

    Args:
        bounds: Nodes of the tree, (m, 6), as by `build_tree`.
        next_on_miss: Node to go on with after a miss, (m,).
        first: First triangle of a leaf, -1 for other nodes, (m,).
        count: Number of triangles of a leaf, (m,).
        node_solid: Lowest solid below each node, (m,).
        corner: Triangles, (t, 9).
        solid: Solid of each triangle, (t,).
        x: Start of the segment, north [m].
        y: Start of the segment, east [m].
        z: Start of the segment, depth [m].
        dx: Vector of the segment, north [m].
        dy: Vector of the segment, east [m].
        dz: Vector of the segment, depth [m].
        lowest_so_far: Lowest solid so far.
    """
    ix, iy, iz = inverse_step(dx), inverse_step(dy), inverse_step(dz)
    node = 0
    while node < next_on_miss.size:
        if node_solid[node] >= lowest_so_far or misses_box(bounds[node], x, y, z, ix, iy, iz, 1.0):
            node = next_on_miss[node]
            continue
        if first[node] >= 0:
            for t in range(first[node], first[node] + count[node]):
                if solid[t] < lowest_so_far and 0 <= triangle_hit(corner[t], x, y, z, dx, dy, dz) <= 1:
                    lowest_so_far = solid[t]
        node += 1
    return lowest_so_far


@njit(cache=True, nogil=True, error_model="numpy")
def occlude_legs(
    source: Floats, image_depths: Floats, bounces: Integers, first_up: NDArray[np.bool_], water_depth: float,
    rows: Integers, points: Floats, normals: Floats, bounds: Floats, next_on_miss: Integers, first: Integers,
    count: Integers, node_solid: Integers, corner: Floats, solid: Integers, clear_status: int, occluded_status: int,
    status: Integers,
    occluder: Integers,
) -> None:  # fmt: skip
    """Mark the legs that solids cut; each segment between two bounces is tested on its own.

    Args:
        source: North, east, depth of the sonar [m], (3,).
        image_depths: Depth of the image source of each family [m], (f,).
        bounces: Number of bounces of each family, (f,).
        first_up: True where the first bounce is off the surface, (f,).
        water_depth: Depth of the bottom [m].
        rows: Indices of the points to process, (r,).
        points: Scatterers [m], (n, 3).
        normals: Unit normals, (n, 3); segments end `OFF` before a point, on the side that its normal faces.
        bounds: Nodes of the tree, (m, 6), as by `build_tree`.
        next_on_miss: Node to go on with after a miss, (m,).
        first: First triangle of a leaf, -1 for other nodes, (m,).
        count: Number of triangles of a leaf, (m,).
        node_solid: Lowest solid below each node, (m,).
        corner: Triangles, (t, 9).
        solid: Solid of each triangle among the occluders, (t,).
        clear_status: `LegStatus` of a clear leg; only such legs are processed.
        occluded_status: `LegStatus` of an occluded leg.
        status: Changed for occluded legs, (f, n).
        occluder: Set to the lowest solid for occluded legs, (f, n).
    """
    none = np.iinfo(np.int64).max
    for n in rows:
        x = points[n, 0] + OFF * normals[n, 0]
        y = points[n, 1] + OFF * normals[n, 1]
        z = points[n, 2] + OFF * normals[n, 2]
        # Seen from above legs of all families follow one line: most points end here.
        if misses_all_leaves(bounds, next_on_miss, first, source[0], source[1], x - source[0], y - source[1]):
            continue
        for f in range(image_depths.size):
            if status[f, n] != clear_status:
                continue
            found = lowest_solid_of_leg(source, x, y, z, image_depths[f], bounces[f], first_up[f], water_depth,
                                        bounds, next_on_miss, first,
                           count, node_solid, corner, solid, none)  # fmt: skip
            if found != none:
                status[f, n], occluder[f, n] = occluded_status, found


@njit(cache=True, nogil=True, error_model="numpy")
def lowest_solid_of_leg(
    source: Floats, x: float, y: float, z: float, image_depth: float, bounces: int, first_up: bool, water_depth: float,
    bounds: Floats, next_on_miss: Integers, first: Integers, count: Integers, node_solid: Integers, corner: Floats,
    solid: Integers,
    no_solid: int,
) -> int:  # fmt: skip
    """Lowest solid that a leg hits on any of its segments, or `no_solid`; arguments as in `occlude_legs`."""
    dx, dy, climb = x - source[0], y - source[1], abs(z - image_depth)
    part, depth, down, found = 0.0, source[2], not first_up, no_solid
    for segment in range(bounces + 1):
        if segment == bounces:
            stop, end = 1.0, z
        else:
            end = water_depth if down else 0.0
            stop = part + abs(end - depth) / max(climb, 1e-12)
        found = lowest_solid(
            bounds, next_on_miss, first, count, node_solid, corner, solid, source[0] + part * dx,
            source[1] + part * dy, depth,
            (stop - part) * dx, (stop - part) * dy, end - depth, found,
        )  # fmt: skip
        part, depth, down = stop, end, not down
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def solids_along(
    polylines: Floats, bounds: Floats, next_on_miss: Integers, first: Integers, count: Integers, node_solid: Integers,
    corner: Floats,
    solid: Integers, solids_hit: Integers,
) -> None:  # fmt: skip
    """Lowest solid that each polyline hits, -1 for none.

    Args:
        polylines: Corners of the polylines [m], (n, k, 3).
        bounds: Nodes of the tree, (m, 6), as by `build_tree`.
        next_on_miss: Node to go on with after a miss, (m,).
        first: First triangle of a leaf, -1 for other nodes, (m,).
        count: Number of triangles of a leaf, (m,).
        node_solid: Lowest solid below each node, (m,).
        corner: Triangles, (t, 9).
        solid: Solid of each triangle, (t,).
        solids_hit: Result: lowest solids_hit, (n,).
    """
    none = np.iinfo(np.int64).max
    for n in range(polylines.shape[0]):
        known = none
        for k in range(polylines.shape[1] - 1):
            a, b = polylines[n, k], polylines[n, k + 1]
            known = lowest_solid(bounds, next_on_miss, first, count, node_solid, corner, solid, a[0], a[1], a[2],
                                 b[0] - a[0],
                                 b[1] - a[1], b[2] - a[2], known)  # fmt: skip
        solids_hit[n] = -1 if known == none else known
