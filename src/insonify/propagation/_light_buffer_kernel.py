"""Light buffer: the triangles of one solid by their direction from the sonar, for many direct legs past it.

Directions are positions in a central projection, in which straight lines stay straight. Each cell lists the triangles
that any of its directions may hit, so that a leg is tested against few triangles, and most legs against none.

Source: Haines & Greenberg (1986), "The light buffer: a shadow-testing accelerator", IEEE Computer Graphics and
Applications 6(9), 6-16, the idea.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.triangle_tree import EDGE_MARGIN, triangle_hit
from insonify.records.legs import LegStatus

Floats = NDArray[np.float64]
Integers = NDArray[Any]

LEG_END_OFFSET = 1e-6
"""Distance before a face at which legs to it end [m]: less than any wavelength, more than any rounding."""
SIDE = 32
"""Cells along each side of a light buffer."""
_MARGIN = 8 * EDGE_MARGIN  # about triangles, as a fraction of the solid's size: more than `triangle_hit` adds
_CLEAR, _OCCLUDED = int(LegStatus.CLEAR), int(LegStatus.OCCLUDED)


class LightBuffer(NamedTuple):
    """Triangles of one solid by their direction from a sonar."""

    corners: Floats
    """One corner and the two sides from it of each triangle [m], (t, 9)."""
    axes: Floats
    """Unit vectors towards the middle of the solid and of the two axes of the projection, one a row, (3, 3)."""
    lower_bound: Floats
    """Lower bound of the distance along the first axis [m], and of both coordinates [1], (3,)."""
    cells_per_unit: Floats
    """Cells per unit of both coordinates, (2,)."""
    nearest: Floats
    """Least distance along the first axis of the triangles of each cell [m], (SIDE^2,)."""
    triangle_nearest: Floats
    """Least distance along the first axis of each triangle [m], (t,)."""
    cell_offsets: Integers
    """Index of each cell's first entry of `cell_triangles`, and their number, (SIDE^2 + 1,)."""
    cell_triangles: Integers
    """Rows of the triangles, those of one cell after another, (sum over the cells,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def light_buffer(source: Floats, middle: Floats, corners: Floats) -> LightBuffer:
    """Sort the triangles of one solid by direction.

    Args:
        source: Position of the sonar, from which all corners lie in one half space about the middle [m], (3,).
        middle: Middle of the solid [m], (3,).
        corners: One corner and the two sides from it of each triangle [m], (t, 9).
    """
    axes, count = _projection_axes(source, middle), corners.shape[0]
    projected, lower_bound, upper_bound = np.empty((count, 3, 3)), np.full(3, np.inf), np.full(3, -np.inf)
    for t in range(count):
        for k in range(3):
            for a in range(3):
                offset = 0.0
                for c in range(3):
                    side = corners[t, 3 * k + c] if k > 0 else 0.0
                    offset += axes[a, c] * (corners[t, c] + side - source[c])
                projected[t, k, a] = offset if a == 0 else offset / projected[t, k, 0]
                lower_bound[a], upper_bound[a] = (
                    min(lower_bound[a], projected[t, k, a]),
                    max(upper_bound[a], projected[t, k, a]),
                )
    size = upper_bound - lower_bound
    margin = _MARGIN * (size[0] + upper_bound[0] * max(size[1], size[2])) / lower_bound[0]
    lower_bound[0] -= margin * lower_bound[0]
    per_unit = np.empty(2)
    for a in range(2):
        lower_bound[1 + a] -= 2 * margin
        per_unit[a] = SIDE / (upper_bound[1 + a] + 2 * margin - lower_bound[1 + a])
    cell_offsets, nearest = np.zeros(SIDE * SIDE + 1, np.int64), np.full(SIDE * SIDE, np.inf)
    spans, rows = np.empty((count, SIDE, 2), np.int16), np.empty((count, 2), np.int16)
    triangle_nearest = np.empty(count)
    for t in range(count):
        _cells_of_triangle(projected[t], lower_bound, per_unit, margin, spans[t], rows[t])
        distance = min(projected[t, 0, 0], projected[t, 1, 0], projected[t, 2, 0]) * (1 - margin)
        triangle_nearest[t] = distance
        for row in range(rows[t, 0], rows[t, 1]):
            for cell in range(row * SIDE + spans[t, row, 0], row * SIDE + spans[t, row, 1]):
                cell_offsets[cell + 1] += 1
                nearest[cell] = min(nearest[cell], distance)
    for cell in range(SIDE * SIDE):
        cell_offsets[cell + 1] += cell_offsets[cell]
    cell_triangles, following = np.empty(cell_offsets[-1], np.int32), cell_offsets[:-1].copy()
    for t in range(count):
        for row in range(rows[t, 0], rows[t, 1]):
            for cell in range(row * SIDE + spans[t, row, 0], row * SIDE + spans[t, row, 1]):
                cell_triangles[following[cell]] = t
                following[cell] += 1
    return LightBuffer(corners, axes, lower_bound, per_unit, nearest, triangle_nearest, cell_offsets, cell_triangles)


@njit(cache=True, nogil=True, error_model="numpy")
def _projection_axes(source: Floats, middle: Floats) -> Floats:
    """Unit vectors towards the middle of a solid and of two axes perpendicular to it, one a row, (3, 3)."""
    axes = np.empty((3, 3))
    axes[0] = (middle - source) / math.sqrt(((middle - source) ** 2).sum())
    across = math.hypot(axes[0, 0], axes[0, 1])
    axes[1, 0], axes[1, 1], axes[1, 2] = 1.0, 0.0, 0.0
    if across > 0:
        axes[1, 0], axes[1, 1] = -axes[0, 1] / across, axes[0, 0] / across
    for c in range(3):
        b, d = (c + 1) % 3, (c + 2) % 3
        axes[2, c] = axes[0, b] * axes[1, d] - axes[0, d] * axes[1, b]
    return axes


@njit(cache=True, nogil=True, error_model="numpy")
def _cells_of_triangle(
    projected: Floats, lower_bound: Floats, per_unit: Floats, margin: float, spans: Integers, rows: Integers
) -> None:
    """Cells that one triangle may cover, row by row.

    Args:
        projected: Corners of the triangle: distance along the first axis [m], both coordinates [1], (3, 3).
        lower_bound: See `LightBuffer`.
        per_unit: See `LightBuffer`.
        margin: Margin about the triangle [1].
        spans: Result: first cell and last + 1 in each of its rows, (SIDE, 2).
        rows: Result: first row and last row + 1, (2,).
    """
    bottom, top = (
        min(projected[0, 2], projected[1, 2], projected[2, 2]),
        max(projected[0, 2], projected[1, 2], projected[2, 2]),
    )
    rows[0] = int((bottom - margin - lower_bound[2]) * per_unit[1])
    rows[1] = min(int((top + margin - lower_bound[2]) * per_unit[1]) + 1, SIDE)
    for row in range(rows[0], rows[1]):
        start, stop = lower_bound[2] + row / per_unit[1] - margin, lower_bound[2] + (row + 1) / per_unit[1] + margin
        left, right = np.inf, -np.inf
        for k in range(3):
            x, y = projected[k, 1], projected[k, 2]
            dx, dy = projected[(k + 1) % 3, 1] - x, projected[(k + 1) % 3, 2] - y
            enter, leave = 0.0, 1.0
            if abs(dy) > margin:
                a, b = (start - y) / dy, (stop - y) / dy
                enter, leave = max(0.0, min(a, b)), min(1.0, max(a, b))
            if enter <= leave:
                left = min(left, x + enter * dx, x + leave * dx)
                right = max(right, x + enter * dx, x + leave * dx)
        spans[row, 0] = max(int((left - margin - lower_bound[1]) * per_unit[0]), 0) if left <= right else 0
        spans[row, 1] = min(int((right + margin - lower_bound[1]) * per_unit[0]) + 1, SIDE) if left <= right else 0


@njit(cache=True, nogil=True, error_model="numpy")
def occlude_direct_legs(
    buffer: LightBuffer, source: Floats, solid_row: int, rows: Integers, points: Floats, normals: Floats,
    status: Integers, occluder: Integers,
) -> None:  # fmt: skip
    """Mark the clear direct legs that one solid cuts.

    Args:
        buffer: Light buffer of the solid.
        source: Position of the sonar [m], (3,).
        solid_row: Row of the solid among the occluders.
        rows: Indices of the points to process, (r,).
        points: North, east, depth of the scatterers [m], (n, 3).
        normals: Unit normals, (n, 3); legs end `LEG_END_OFFSET` before a point, on the side that its normal faces.
        status: `LegStatus`, changed for occluded legs, (n,).
        occluder: Set to the solid for occluded legs, (n,).
    """
    corners, axes, lower_bound, per_unit = buffer.corners, buffer.axes, buffer.lower_bound, buffer.cells_per_unit
    start, likely = (source[0], source[1], source[2]), 0  # neighbouring legs mostly hit the same triangle
    for n in rows:
        if status[n] != _CLEAR:
            continue
        north = points[n, 0] + LEG_END_OFFSET * normals[n, 0] - source[0]
        east = points[n, 1] + LEG_END_OFFSET * normals[n, 1] - source[1]
        down = points[n, 2] + LEG_END_OFFSET * normals[n, 2] - source[2]
        distance = axes[0, 0] * north + axes[0, 1] * east + axes[0, 2] * down
        if distance < lower_bound[0]:
            continue
        x = ((axes[1, 0] * north + axes[1, 1] * east + axes[1, 2] * down) / distance - lower_bound[1]) * per_unit[0]
        y = ((axes[2, 0] * north + axes[2, 1] * east + axes[2, 2] * down) / distance - lower_bound[2]) * per_unit[1]
        if not (0 <= x < SIDE and 0 <= y < SIDE):
            continue
        cell, step = int(y) * SIDE + int(x), (north, east, down)
        if distance < buffer.nearest[cell]:
            continue
        is_hit = 0 <= triangle_hit(corners[likely], start, step) <= 1
        for k in range(buffer.cell_offsets[cell], buffer.cell_offsets[cell + 1] if not is_hit else 0):
            triangle = buffer.cell_triangles[k]
            if buffer.triangle_nearest[triangle] <= distance and 0 <= triangle_hit(corners[triangle], start, step) <= 1:
                is_hit, likely = True, triangle
                break
        if is_hit:
            status[n], occluder[n] = _OCCLUDED, solid_row
