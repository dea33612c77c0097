"""Interpolation of an eigenray table: Hermite polynomials over range and depth. Plain numbers and arrays only.

Every node of the grid has eight exact numbers of U = T^2, the square of the delay, and of its derivatives: with
V = dU/dz, W = dU/dz_s and Y = d2U/(dz dz_s),

    U, W, V, Y and their derivatives with range, times the step in range.

U, unlike T, is smooth down to the sonar itself; in water of one speed it is a quadratic, which the polynomials
represent exactly. Slowness, both angles and ray-tube spreading are derivatives of the one function, with no formula
that fails at horizontal launch or at a turning ray:

    p = dT/dR,  sin(arrival) = c dT/dz,  sin(launch) = -c_s dT/dz_s,  A^2 = c^2 |U_z W_R - U_R W_z| / (4 U R),

the last from the mixed derivatives of the delay (Van Vleck's determinant in the vertical plane).
"""

import math

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
NUMBERS = 8
"""Numbers of one node: one cache line."""
EXACT = 255
"""State of a cell that is left to the exact solver; other states are its number of paths."""
TOP, HEIGHT, SPEED, GRADIENT, PER_HEIGHT = range(5)  # of a row of cells: depth and speed are those of its upper line
NEAREST = 1e-4
"""Range below which a ray counts as vertical [m]."""
LEVEL_WITHIN = 1e-9
"""Largest distance of a point beyond the table's first or last line [m]."""
OUTSIDE = -1


@njit(cache=True, nogil=True, error_model="numpy")
def find_cells(
    cell_state: Bytes, rows: Floats, buckets: NDArray[np.int32], per_metre: float, per_step: float, depth: Floats,
    ranges: Floats, cell: NDArray[np.int32], paths: Bytes,
) -> int:  # fmt: skip
    """Cells of many points, and the number of paths in each.

    Args:
        cell_state: Number of paths in every cell, or `EXACT`, (rows, cells).
        rows: Rows of cells, (rows, 5): top, height [m], speed there [m/s], its gradient [1/s], 1 / height [1/m].
        buckets: Row at the top of each of many equal depth intervals, none thicker than any row, (m,).
        per_metre: Depth intervals per metre [1/m].
        per_step: Columns of nodes per metre of range [1/m].
        depth: Depths of the points [m], (n,).
        ranges: Their horizontal distances [m], (n,).
        cell: Result: row and cell along it, OUTSIDE outside the table, (2, n).
        paths: Result: number of paths, or `EXACT`, (n,).

    Returns:
        Number of points that need the exact solver.
    """
    last, slices, cells, top = rows.shape[0] - 1, buckets.size - 1, cell_state.shape[1], rows[0, TOP]
    bottom = rows[last, TOP] + rows[last, HEIGHT] + LEVEL_WITHIN
    left = 0
    for n in range(depth.size):
        away = max(ranges[n], NEAREST) * per_step
        z = depth[n]
        if not (top - LEVEL_WITHIN <= z <= bottom and away <= cells * (1 + 1e-12)):
            cell[0, n] = cell[1, n] = OUTSIDE
            paths[n] = EXACT
            left += 1
            continue
        row = buckets[np.uintp(min(int(max(z - top, 0.0) * per_metre), slices))]
        following = min(row + 1, last)
        row = following if z >= rows[np.uintp(following), TOP] else row
        k = min(int(away), cells - 1)
        cell[0, n], cell[1, n] = row, k
        found = cell_state[np.uintp(row), np.uintp(k)]
        paths[n] = found
        left += found == EXACT
    return left


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def interpolate_cells(
    nodes: Floats, mean_speed: NDArray[np.float32], node_depths: int, node_ranges: int, rows: Floats, per_step: float,
    source_speed: float, history: Bytes, bounces: int, branch: int, depth: Floats, ranges: Floats,
    cell: NDArray[np.int32], paths: Bytes, rays: Floats,
) -> None:  # fmt: skip
    """Interpolate one branch at many points in given cells.

    Args:
        nodes: Eight numbers of every node, by branch, line and range, flat.
        mean_speed: Path length over delay at the nodes [m/s], flat in the same order.
        node_depths: Number of lines: one more than rows of cells, or one for a table of one depth.
        node_ranges: Number of nodes of a line.
        rows: As in `find_cells`.
        per_step: Columns of nodes per metre of range [1/m].
        source_speed: Sound speed at the source [m/s].
        history: Caustics and turns of every cell, the fewest of its corners, (branches, rows, cells, 2).
        bounces: Bounces of the family.
        branch: Index of the path, in the order of launch angles.
        depth: Depths of the points [m], (n,).
        ranges: Their horizontal distances [m], (n,).
        cell: From `find_cells`, (2, n).
        paths: From `find_cells`, (n,).
        rays: Result: (n, branches, COLUMNS), as from the exact solver; 0 where there is no such branch or the exact
            solver is needed.
    """
    first = branch * node_depths
    for n in range(depth.size):
        if branch >= paths[n] or paths[n] == EXACT:
            for column in range(COLUMNS):
                rays[n, branch, column] = 0.0
            continue
        row, k = int(cell[0, n]), int(cell[1, n])
        away = max(ranges[n], NEAREST)
        u = away * per_step - k
        below = depth[n] - rows[np.uintp(row), TOP]
        speed = rows[np.uintp(row), SPEED] + below * rows[np.uintp(row), GRADIENT]
        here = (first + row) * node_ranges + k
        typical = mean_speed[np.uintp(here)] + u * (mean_speed[np.uintp(here + 1)] - mean_speed[np.uintp(here)])
        if node_depths == 1:
            square, along, down, w, w_along, w_down = interpolate_on_line(nodes, here * NUMBERS, u)
        else:
            under, height, per_height = here + node_ranges, rows[np.uintp(row), HEIGHT], rows[np.uintp(row), PER_HEIGHT]
            v = below * per_height
            square, along, down, w, w_along, w_down = interpolate_in_cell(
                nodes, here * NUMBERS, under * NUMBERS, u, v, height
            )
            down, w_down = down * per_height, w_down * per_height
            lower = mean_speed[np.uintp(under)] + u * (mean_speed[np.uintp(under + 1)] - mean_speed[np.uintp(under)])
            typical += v * (lower - typical)
        rate = 0.5 / math.sqrt(square)
        along, w_along = along * per_step, w_along * per_step
        tube = abs(down * w_along - along * w_down)
        delay = 2.0 * square * rate
        launch = min(1.0, max(-1.0, -source_speed * w * rate))
        arrival, turns = min(1.0, max(-1.0, speed * down * rate)), int(history[branch, row, k, 1])
        # A ray that has turned once more than its neighbours has the other sense: level rays join the two.
        sense = 1.0 if (bounces + turns) % 2 == 0 else -1.0
        rays[n, branch, DELAY] = delay
        rays[n, branch, SIN_LAUNCH], rays[n, branch, SIN_ARRIVAL] = launch, arrival
        rays[n, branch, SLOWNESS] = along * rate
        rays[n, branch, AMPLITUDE] = speed * rate * math.sqrt(tube / away)
        rays[n, branch, LENGTH] = delay * typical
        rays[n, branch, CAUSTICS] = history[branch, row, k, 0]
        rays[n, branch, TURNS] = turns + (1 if sense * launch * arrival < 0 else 0)
        rays[n, branch, AT_END] = 0.0
        rays[n, branch, FOLD], rays[n, branch, FOLD_CURVATURE], rays[n, branch, FOLD_SIDE] = math.inf, 1.0, 0.0
