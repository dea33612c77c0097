"""First intersection of a straight ray with triangles. Plain numbers and arrays only.

Triangles lie in a hierarchy of boxes, halved at the median of their longest side, in depth-first order; a box that a
ray misses is skipped with all its content.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]

LEAF = 4
"""Most triangles of a box that is not divided."""
CLEARANCE = 1e-6
"""Distance below which an intersection is that with the face just left [m]."""


class TriangleBvh(NamedTuple):
    """Triangles sorted for rays: m boxes, t triangles."""

    low: Floats
    """Least corner of each box [m], (m, 3)."""
    high: Floats
    """Greatest corner [m], (m, 3)."""
    skip_to: NDArray[np.int64]
    """Box to go on with where one is missed, (m,)."""
    first: NDArray[np.int64]
    """First triangle of a box that is not divided, (m,)."""
    triangle_count: NDArray[np.int64]
    """Number of triangles in each leaf; 0 for inner nodes, (m,)."""
    corner: Floats
    """One corner of each triangle [m], (t, 3)."""
    edge1: Floats
    """The side from it to the second corner [m], (t, 3)."""
    edge2: Floats
    """The side from it to the third [m], (t, 3)."""
    normal: Floats
    """Unit normal outwards [1], (t, 3)."""
    body_row: NDArray[np.int64]
    """Whom each belongs to, (t,)."""


def build_bvh(corners: Floats, body_row: NDArray[np.int64]) -> TriangleBvh:
    """Triangles sorted into boxes.

    Args:
        corners: Corners of each triangle, counter-clockwise from outside [m], shape (t, 3, 3).
        body_row: Row of the body of each triangle, shape (t,).
    """
    middle, lows, highs = corners.mean(axis=1), corners.min(axis=1), corners.max(axis=1)
    boxes: list[tuple[Floats, Floats, int, int, int]] = []  # low, high, beyond, first, count
    order: list[NDArray[np.int64]] = []
    triangle_count = 0

    def divide(rows: NDArray[np.int64]) -> None:
        nonlocal triangle_count
        low, high = lows[rows].min(axis=0), highs[rows].max(axis=0)
        here = len(boxes)
        boxes.append((low, high, 0, triangle_count, 0))
        if len(rows) <= LEAF:
            order.append(rows)
            boxes[here] = (low, high, len(boxes), triangle_count, len(rows))
            triangle_count += len(rows)
            return
        axis = int(np.argmax(np.ptp(middle[rows], axis=0)))
        ranked = rows[np.argsort(middle[rows, axis], kind="stable")]
        divide(ranked[: len(rows) // 2])
        divide(ranked[len(rows) // 2 :])
        boxes[here] = (low, high, len(boxes), 0, 0)

    if len(corners):
        divide(np.arange(len(corners)))
    ranked = np.concatenate(order) if order else np.zeros(0, np.int64)
    a, b, c = np.moveaxis(corners[ranked].reshape(-1, 3, 3), 1, 0)
    across = np.cross(b - a, c - a)
    low, high = (np.array([box[k] for box in boxes], float).reshape(-1, 3) for k in (0, 1))
    skip_to, first, count = (np.array([box[k] for box in boxes], np.int64) for k in (2, 3, 4))
    length = np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    corner, edge1, edge2, normal = (np.ascontiguousarray(part) for part in (a, b - a, c - a, across / length))
    return TriangleBvh(
        low, high, skip_to, first, count, corner, edge1, edge2, normal, body_row[ranked].astype(np.int64)
    )


@njit(cache=True, nogil=True, error_model="numpy")
def bvh_hit(
    x: float, y: float, z: float, u: float, v: float, w: float, farthest: float, bodies: TriangleBvh
) -> tuple[float, int]:
    """Distance to the first triangle along a ray [m] and its row; the farthest distance and -1 for none.

    Source: Moeller & Trumbore (1997), J. Graphics Tools 2(1), 21: a ray in the coordinates of a triangle.
    """
    found = -1
    box = 0
    while box < bodies.skip_to.size:
        if not _box_hit(x, y, z, u, v, w, farthest, bodies.low[box], bodies.high[box]):
            box = bodies.skip_to[box]
            continue
        for row in range(bodies.first[box], bodies.first[box] + bodies.triangle_count[box]):
            way = _triangle_hit(x, y, z, u, v, w, bodies.corner[row], bodies.edge1[row], bodies.edge2[row])
            if CLEARANCE < way < farthest:
                farthest, found = way, row
        box += 1
    return farthest, found


@njit(cache=True, nogil=True, error_model="numpy")
def _box_hit(  # type: ignore[no-untyped-def]
    x, y, z, u, v, w, farthest, low, high
):
    """Return True if a ray goes through a box within a distance."""
    near, far = 0.0, farthest
    for at, way, least, most in ((x, u, low[0], high[0]), (y, v, low[1], high[1]), (z, w, low[2], high[2])):
        if way == 0.0:
            if at < least or at > most:
                return False
        else:
            edge1, edge2 = (least - at) / way, (most - at) / way
            near, far = max(near, min(edge1, edge2)), min(far, max(edge1, edge2))
    return near <= far + CLEARANCE


@njit(cache=True, nogil=True, error_model="numpy")
def _triangle_hit(  # type: ignore[no-untyped-def]
    x, y, z, u, v, w, corner, edge1, edge2
):
    """Distance along a ray to a triangle [m], infinite where it is missed."""
    px, py, pz = v * edge2[2] - w * edge2[1], w * edge2[0] - u * edge2[2], u * edge2[1] - v * edge2[0]
    volume = edge1[0] * px + edge1[1] * py + edge1[2] * pz
    if volume == 0.0:
        return math.inf
    tx, ty, tz = x - corner[0], y - corner[1], z - corner[2]
    a = (tx * px + ty * py + tz * pz) / volume
    if a < -1e-12 or a > 1.0 + 1e-12:
        return math.inf
    qx, qy, qz = ty * edge1[2] - tz * edge1[1], tz * edge1[0] - tx * edge1[2], tx * edge1[1] - ty * edge1[0]
    b = (u * qx + v * qy + w * qz) / volume
    if b < -1e-12 or a + b > 1.0 + 1e-12:
        return math.inf
    return (edge2[0] * qx + edge2[1] * qy + edge2[2] * qz) / volume
