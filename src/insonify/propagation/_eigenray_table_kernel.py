"""Interpolation of an eigenray table: Hermite polynomials over range and depth. Plain numbers and arrays only.

Every node of the grid has eight values of U = T^2, the square of the delay, and of its derivatives by the depth z of
the point and z_s of the source, with V = dU/dz, W = dU/dz_s and Y = d2U/(dz dz_s):

    U, W, V, Y and their derivatives by range R, times the step in range.

U, unlike T, is smooth down to the sonar itself; in water of one speed it is a quadratic, which the polynomials
represent exactly. Slowness, both angles and ray-tube spreading are derivatives of the one function, with no formula
that fails at horizontal launch or at a turning ray. With c and c_s the speeds at point and source:

    p = dT/dR,  sin(arrival) = c dT/dz,  sin(launch) = -c_s dT/dz_s,  A^2 = c^2 |U_z W_R - U_R W_z| / (4 U R),

A the pressure re that at 1 m, from the mixed derivatives of the delay (Van Vleck's determinant in the vertical plane).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._eigenray_table_simd import interpolate_in_cell, interpolate_on_line
from insonify.propagation._ray_properties_kernel import (
    AMPLITUDE,
    AT_END,
    CAUSTICS,
    COLUMNS,
    DELAY,
    FOLD,
    FOLD_CURVATURE,
    FOLD_SIDE,
    LENGTH,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    SLOWNESS,
    TURNS,
)  # fmt: skip

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

U, W, V, Y = range(4)
NODE_VALUES = 8
"""Number of values of one node: one cache line."""
EXACT = 255
"""State of a cell that is left to the exact solver; other states are its number of paths."""
NEAREST = 1e-4
"""Range below which a ray counts as vertical [m]."""
LINE_TOLERANCE = 1e-9
"""Largest distance of a point beyond the table's first or last line [m]."""
OUTSIDE = -1
"""Row and cell of a point outside the table."""


class CellGrid(NamedTuple):
    """Rows of cells between the lines of nodes of a table, and how to find them."""

    top: Floats
    """Depth of the upper line of each row [m], (rows,)."""
    height: Floats
    """Height of each row, 0 for a table of one line [m], (rows,)."""
    speed: Floats
    """Sound speed at the upper line [m/s], (rows,)."""
    gradient: Floats
    """Gradient of the sound speed in each row [1/s], (rows,)."""
    per_height: Floats
    """1 / height, 0 for a table of one line [1/m], (rows,)."""
    buckets: NDArray[np.int32]
    """Row at the top of each of many equal depth intervals, none thicker than any row, (m,)."""
    per_metre: float
    """Depth intervals per metre [1/m]."""
    per_step: float
    """Columns of nodes per metre of range [1/m]."""


class NodeTable(NamedTuple):
    """Values at the nodes of a table for one source depth: b branches, l lines, s ranges."""

    nodes: Floats
    """Eight values of every node, by branch, line and range, flat, (b l s 8,)."""
    mean_speed: NDArray[np.float32]
    """Path length over delay at the nodes [m/s], flat in the same order, (b l s,)."""
    history: Bytes
    """Caustics of the path in every cell, and the fewest turns at its corners, (b, rows, s - 1, 2)."""
    line_count: int
    """Number of lines l: one more than rows of cells, or one for a table of one depth."""
    range_count: int
    """Number of nodes s of a line."""


class TablePoints(NamedTuple):
    """Points at which a table is read, and their cells."""

    depth: Floats
    """Depths of the points [m], (n,)."""
    ranges: Floats
    """Horizontal distances of the points [m], (n,)."""
    cell: NDArray[np.int32]
    """Row, and cell along the row; `OUTSIDE` outside the table, (2, n)."""
    paths: Bytes
    """Number of paths in the cell of each point, or `EXACT`, (n,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def find_cells(cell_state: Bytes, grid: CellGrid, points: TablePoints) -> int:
    """Find the cells of many points, and the number of paths in each.

    Args:
        cell_state: Number of paths in every cell, or `EXACT`, (rows, cells).
        grid: Rows of cells.
        points: The points; result: `cell` and `paths`.

    Returns:
        Number of points that need the exact solver.
    """
    tops, buckets, per_metre, per_step = grid.top, grid.buckets, grid.per_metre, grid.per_step
    depth, ranges, cell, paths = points
    last, slices, cells, top = tops.size - 1, buckets.size - 1, cell_state.shape[1], tops[0]
    bottom = tops[last] + grid.height[last] + LINE_TOLERANCE
    exact_count = 0
    for n in range(depth.size):
        column = max(ranges[n], NEAREST) * per_step
        z = depth[n]
        if not (top - LINE_TOLERANCE <= z <= bottom and column <= cells * (1 + 1e-12)):
            cell[0, n] = cell[1, n] = OUTSIDE
            paths[n] = EXACT
            exact_count += 1
            continue
        row = buckets[np.uintp(min(int(max(z - top, 0.0) * per_metre), slices))]
        following = min(row + 1, last)
        row = following if z >= tops[np.uintp(following)] else row
        k = min(int(column), cells - 1)
        cell[0, n], cell[1, n] = row, k
        state = cell_state[np.uintp(row), np.uintp(k)]
        paths[n] = state
        exact_count += state == EXACT
    return exact_count


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def interpolate_cells(
    table: NodeTable, grid: CellGrid, source_speed: float, bounces: int, branch: int, points: TablePoints, rays: Floats
) -> None:
    """Interpolate one branch at many points in given cells.

    Args:
        table: Values at the nodes.
        grid: Rows of cells.
        source_speed: Sound speed at the source [m/s].
        bounces: Number of bounces of the family.
        branch: Index of the path, in the order of launch angles.
        points: The points, from `find_cells`.
        rays: Result: (n, branches, COLUMNS), as from the exact solver; 0 where there is no such branch or the exact
            solver is needed.
    """
    nodes, mean_speed, history, line_count, range_count = table
    tops, heights, speeds, gradients, per_heights, _, _, per_step = grid
    depth, ranges, cell, paths = points
    first = branch * line_count
    for n in range(depth.size):
        if branch >= paths[n] or paths[n] == EXACT:
            for column in range(COLUMNS):
                rays[n, branch, column] = 0.0
            continue
        row, k = int(cell[0, n]), int(cell[1, n])
        distance = max(ranges[n], NEAREST)
        u = distance * per_step - k
        below = depth[n] - tops[np.uintp(row)]
        speed = speeds[np.uintp(row)] + below * gradients[np.uintp(row)]
        node = (first + row) * range_count + k
        mean = mean_speed[np.uintp(node)] + u * (mean_speed[np.uintp(node + 1)] - mean_speed[np.uintp(node)])
        if line_count == 1:
            square, along, down, w, w_along, w_down = interpolate_on_line(nodes, node * NODE_VALUES, u)
        else:
            under, height, per_height = (node + range_count, heights[np.uintp(row)], per_heights[np.uintp(row)])
            v = below * per_height
            square, along, down, w, w_along, w_down = interpolate_in_cell(
                nodes, node * NODE_VALUES, under * NODE_VALUES, u, v, height
            )
            down, w_down = down * per_height, w_down * per_height
            lower = mean_speed[np.uintp(under)] + u * (mean_speed[np.uintp(under + 1)] - mean_speed[np.uintp(under)])
            mean += v * (lower - mean)
        rate = 0.5 / math.sqrt(square)  # dT/dU
        along, w_along = along * per_step, w_along * per_step
        tube = abs(down * w_along - along * w_down)
        delay = 2.0 * square * rate
        launch = min(1.0, max(-1.0, -source_speed * w * rate))
        arrival, turns = min(1.0, max(-1.0, speed * down * rate)), int(history[branch, row, k, 1])
        # A ray that has turned once more than its neighbours has the other sense; horizontal rays join the two sheets.
        sense = 1.0 if (bounces + turns) % 2 == 0 else -1.0
        rays[n, branch, DELAY] = delay
        rays[n, branch, SIN_LAUNCH], rays[n, branch, SIN_ARRIVAL] = launch, arrival
        rays[n, branch, SLOWNESS] = along * rate
        rays[n, branch, AMPLITUDE] = speed * rate * math.sqrt(tube / distance)
        rays[n, branch, LENGTH] = delay * mean
        rays[n, branch, CAUSTICS] = history[branch, row, k, 0]
        rays[n, branch, TURNS] = turns + (1 if sense * launch * arrival < 0 else 0)
        rays[n, branch, AT_END] = 0.0
        rays[n, branch, FOLD], rays[n, branch, FOLD_CURVATURE], rays[n, branch, FOLD_SIDE] = math.inf, 1.0, 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def read_table(
    cell_state: Bytes, table: NodeTable, grid: CellGrid, source_speed: float, bounces: int, points: TablePoints
) -> Floats:
    """Interpolate all branches at many points.

    Args:
        cell_state: Number of paths in every cell, or `EXACT`, (rows, cells).
        table: Values at the nodes.
        grid: Rows of cells.
        source_speed: Sound speed at the source [m/s].
        bounces: Number of bounces of the family.
        points: The points; result: `cell` and `paths`.

    Returns:
        Rays, see `interpolate_cells`, (n, largest number of paths in a cell, at least 1, COLUMNS).
    """
    find_cells(cell_state, grid, points)
    paths, branches = points.paths, 1
    for n in range(paths.size):
        if paths[n] != EXACT:
            branches = max(branches, paths[n])
    rays = np.empty((paths.size, branches, COLUMNS))
    for branch in range(branches):
        interpolate_cells(table, grid, source_speed, bounces, branch, points, rays)
    return rays
