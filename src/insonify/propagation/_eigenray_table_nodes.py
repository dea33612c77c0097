"""Exact values at the nodes of an eigenray table, and the validity of its cells. Plain numbers and arrays only.

Every derivative of the delay T that a node needs follows from the ray that the exact solver finds there. With A the
pressure by ray-tube spreading re that at 1 m, p the horizontal slowness, R the range, c and c_s the speeds at the point
and at the source, and sigma the product of a factor -1 for every bounce and every caustic along the ray,

    T_R = p,   T_z = sin(arrival) / c,   T_zs = -sin(launch) / c_s,
    T_Rz = -sigma sin(launch) R A^2 / c_s,   T_Rzs = sigma sin(arrival) R A^2 / c,   T_zzs = -sigma p R A^2:

the first line is Fermat's principle, the second its derivative, dp/dz = -(dX/dz) / (dX/dp) and so on, with dX/dp
written by A. Nothing is divided by a sine, so rays that leave or arrive horizontally are no exception.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    CAUSTICS,
    COLUMNS,
    DELAY,
    FOLD,
    FOLD_CURVATURE,
    FOLD_SIDE,
    LENGTH,
    MAX_RAYS,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    SLOWNESS,
    TURNS,
    RaySolutions,
    solve_eigenrays,
)  # fmt: skip
from insonify.propagation._eigenray_table_kernel import EXACT, NODE_VALUES, TablePoints, U, V, W, Y
from insonify.propagation.families import Bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Integers = NDArray[Any]

BRANCHES = 4
"""Largest number of rays of one family to one point in a table; where there are more, the exact solver is used."""
LOWEST_FREQUENCY = 10e3
"""Frequency at which folds must be negligible [Hz]: near others the exact solver is used."""
FOLD_MATTERS = 4.0
"""Argument of Airy's function beyond which a fold changes a ray by less than 0.01 dB and 0.75 degrees [1]."""
NO_RAY, NEAR_FOLD = -1, -2  # sheet codes
TURN, LAYER, UPWARD = 100, 10_000, 10**13  # units of a sheet code; its last two digits are the caustics


class NodeRays(NamedTuple):
    """Rays at the nodes of a table for one source depth: l lines, s ranges."""

    nodes: Floats
    """Eight values of every node, see `_eigenray_table_kernel`, (BRANCHES, l, s, 8)."""
    mean_speed: NDArray[np.float32]
    """Length over delay [m/s], (BRANCHES, l, s)."""
    sheet: Integers
    """Code of the smooth sheet of rays, see `sheet_code`, `NO_RAY` or `NEAR_FOLD`, (BRANCHES, l, s)."""
    path_count: Bytes
    """Number of paths at the node, (l, s)."""
    status: Bytes
    """Reason for no path, as `LegStatus`, (l, s)."""


class CellPaths(NamedTuple):
    """Paths in the cells of a table for one source depth."""

    path_count: Bytes
    """Number of paths in each cell, `EXACT` where the exact solver is used, (rows, s - 1)."""
    missing_status: Bytes
    """`LegStatus` of cells without paths, (rows, s - 1)."""
    history: Bytes
    """Caustics of each path in a cell, and the fewest turns at its corners, (BRANCHES, rows, s - 1, 2)."""


@njit(cache=True, nogil=True, error_model="numpy")
def solve_nodes(
    water: SoundSpeedLayers, source_depth: float, bounces: Bounces, node_depths: Floats, node_ranges: Floats,
    node_rays: NodeRays,
) -> None:  # fmt: skip
    """Write the exact values at all nodes, for one source depth.

    Args:
        water: The water column.
        source_depth: Depth of the source [m].
        bounces: Bounces of the family.
        node_depths: Depths of the lines of nodes [m], (l,).
        node_ranges: Ranges of the nodes, evenly spaced from 0 [m], (s,).
        node_rays: Result.
    """
    depth, speed, n = water.depth, water.speed, node_ranges.size
    nodes, mean_speed, sheet, count, status = node_rays
    rays, ray_count, missing_status = np.zeros((n, MAX_RAYS, COLUMNS)), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    solutions = RaySolutions(rays, ray_count, missing_status)
    point_depth = np.empty(n)
    step = node_ranges[1] - node_ranges[0]
    source_speed = np.interp(source_depth, depth, speed)
    for i in range(node_depths.size):
        point_depth[:] = node_depths[i]
        solve_eigenrays(water, source_depth, bounces, point_depth, node_ranges, solutions)
        node_speed = np.interp(node_depths[i], depth, speed)
        for k in range(n):
            count[i, k], status[i, k] = ray_count[k], missing_status[k]
            for b in range(BRANCHES):
                if b >= ray_count[k]:
                    sheet[b, i, k] = NO_RAY
                    continue
                ray = rays[k, b]
                sheet[b, i, k] = sheet_code(ray, water, source_depth, bounces)
                mean_speed[b, i, k] = ray[LENGTH] / ray[DELAY] if ray[DELAY] > 0 else source_speed
                node_values(ray, node_ranges[k], step, node_speed, source_speed, bounces.number, nodes[b, i, k])
        for b in range(BRANCHES):
            y_slopes(nodes[b, i], sheet[b, i])


@njit(cache=True, nogil=True, error_model="numpy")
def node_values(
    ray: Floats, ranges: float, step: float, speed: float, source_speed: float, bounces: int, node: Floats
) -> None:
    """Write the values of one ray at one node, all but the last, which becomes 0; see the module docstring.

    ranges: range [m]; step: that of the nodes [m]; speed, source_speed: at the node and the source [m/s]; node: (8,).
    """
    t, p = ray[DELAY], ray[SLOWNESS]
    t_z, t_s = ray[SIN_ARRIVAL] / speed, -ray[SIN_LAUNCH] / source_speed
    sigma = -1.0 if (bounces + int(ray[CAUSTICS])) % 2 else 1.0
    tube = sigma * ranges * ray[AMPLITUDE] ** 2 if ranges > 0 else 0.0
    t_rz = -tube * ray[SIN_LAUNCH] / source_speed
    t_rs = tube * ray[SIN_ARRIVAL] / speed
    t_zs = -tube * p
    node[U], node[W], node[V], node[Y] = t * t, 2 * t * t_s, 2 * t * t_z, 2 * (t_z * t_s + t * t_zs)
    node[4 + U] = 2 * t * p * step
    node[4 + W] = 2 * (p * t_s + t * t_rs) * step
    node[4 + V] = 2 * (p * t_z + t * t_rz) * step
    node[4 + Y] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def y_slopes(nodes: Floats, sheet: Integers) -> None:
    """Write the derivative of Y by range times the step, from neighbours on the same sheet: no single ray gives it.

    At range 0 it stays 0, because U depends on the square of the range. nodes: (s, 8); sheet: (s,), of one line.
    """
    n = sheet.size
    for k in range(1, n):
        has_previous = sheet[k - 1] == sheet[k]
        has_next = k + 1 < n and sheet[k + 1] == sheet[k]
        if has_previous and has_next:
            nodes[k, 4 + Y] = 0.5 * (nodes[k + 1, Y] - nodes[k - 1, Y])
        elif has_previous:
            nodes[k, 4 + Y] = nodes[k, Y] - nodes[k - 1, Y]
        elif has_next:
            nodes[k, 4 + Y] = nodes[k + 1, Y] - nodes[k, Y]


@njit(cache=True, nogil=True, error_model="numpy")
def sheet_code(ray: Floats, water: SoundSpeedLayers, source_depth: float, bounces: Bounces) -> int:
    """Code that rays of one smooth sheet share: their turns and caustics, and the layers in which they turn."""
    if ray[FOLD_SIDE] != 0:
        scale = (2 * (2 * math.pi * LOWEST_FREQUENCY) ** 2 / ray[FOLD_CURVATURE]) ** (1 / 3)
        if not abs(ray[FOLD]) * scale > FOLD_MATTERS:
            return NEAR_FOLD
    if not ray[AMPLITUDE] < 1e3:
        return NEAR_FOLD
    turns = int(ray[TURNS])
    if turns == 0:
        return int(ray[CAUSTICS])
    depth, speed, turning_speed = water.depth, water.speed, 1 / ray[SLOWNESS]
    above = np.searchsorted(depth, source_depth, side="right") - 1
    while above > 0 and speed[above] < turning_speed:
        above -= 1
    below = np.searchsorted(depth, source_depth, side="left")
    while below < depth.size - 1 and speed[below] < turning_speed:
        below += 1
    upward = ray[SIN_LAUNCH] < 0
    turns_above = upward if bounces.number == 0 else not bounces.first_up
    layers = above + 1000 * below if turns > 1 else (above if turns_above else below - 1)
    return int(ray[CAUSTICS]) + TURN * turns + LAYER * int(layers) + (UPWARD if upward else 0)


@njit(cache=True, nogil=True, error_model="numpy")
def on_same_sheet(sheet: int, other_sheet: int, bounces: Bounces, source_layer: int, point_layer: int) -> bool:
    """Return True if two rays lie on the same smooth sheet.

    Rays that leave horizontally join those that turn first in the source's own layer to those that do not turn,
    smoothly: they are arcs of the same circles; so do rays that arrive horizontally, in the point's own layer. Turns in
    other layers are on other sheets.
    """
    if sheet < 0 or other_sheet < 0:
        return False
    return joined_sheet(sheet, bounces, source_layer, point_layer) == joined_sheet(
        other_sheet, bounces, source_layer, point_layer
    )


@njit(cache=True, nogil=True, error_model="numpy")
def joined_sheet(sheet: int, bounces: Bounces, source_layer: int, point_layer: int) -> int:
    """Code of a ray's smooth sheet: without its one turn, where that turn joins it to rays without turns."""
    if sheet % LAYER // TURN != 1:
        return sheet
    layer, upward = sheet % UPWARD // LAYER, sheet >= UPWARD
    turns_first = bounces.number == 0 or upward != bounces.first_up  # before any bounce, away from the boundary
    turns_last = bounces.number == 0 or upward == bounces.first_up
    joins = (turns_first and layer == source_layer) or (turns_last and layer == point_layer)
    return sheet % TURN if joins else sheet


@njit(cache=True, nogil=True, error_model="numpy")
def compare_corners(
    node_rays: NodeRays, bounces: Bounces, source_layer: int, layers: Integers, cells: CellPaths
) -> None:  # fmt: skip
    """Write the number of paths of every cell whose corners all lie on the same sheets; `EXACT` elsewhere.

    Args:
        node_rays: From `solve_nodes`.
        bounces: Bounces of the family.
        source_layer: Layer of the source, -1 on a knot.
        layers: Layer of the profile of each row of cells, -1 for none, (rows,).
        cells: Result.
    """
    sheet, count, status = node_rays.sheet, node_rays.path_count, node_rays.status
    cell_state, missing_status, history = cells
    below = 1 if count.shape[0] > 1 else 0
    for i in range(cell_state.shape[0]):
        for k in range(cell_state.shape[1]):
            paths = count[i, k]
            is_equal = paths <= BRANCHES
            for corner in range(1, 4):
                row, column = i + below * (corner // 2), k + corner % 2
                is_equal = is_equal and count[row, column] == paths and status[row, column] == status[i, k]
                for b in range(min(paths, BRANCHES)):
                    is_equal = is_equal and on_same_sheet(
                        sheet[b, i, k], sheet[b, row, column], bounces, source_layer, layers[i]
                    )
            cell_state[i, k] = paths if is_equal else EXACT
            missing_status[i, k] = status[i, k]
            for b in range(paths if is_equal else 0):
                history[b, i, k, 0] = sheet[b, i, k] % TURN
                turns = sheet[b, i, k] % LAYER // TURN
                for corner in range(1, 4):
                    turns = min(turns, sheet[b, i + below * (corner // 2), k + corner % 2] % LAYER // TURN)
                history[b, i, k, 1] = turns


@njit(cache=True, nogil=True, error_model="numpy")
def mark_neighbours_of_exact(cell_state: Bytes, chosen: NDArray[np.bool_]) -> None:
    """Mark the valid cells next to a cell of the exact solver, diagonal neighbours included; both (rows, cells)."""
    rows, cells = cell_state.shape
    for i in range(rows):
        for k in range(cells):
            chosen[i, k] = False
            for j in range(max(0, i - 1), min(rows, i + 2)):
                for m in range(max(0, k - 1), min(cells, k + 2)):
                    if cell_state[j, m] == EXACT and cell_state[i, k] != EXACT:
                        chosen[i, k] = True


@njit(cache=True, nogil=True, error_model="numpy")
def compare_points(
    water: SoundSpeedLayers, source_depth: float, bounces: Bounces, points: TablePoints, interpolated: Floats,
    tolerances: tuple[float, float], cell_state: Bytes, errors: Floats,
) -> None:  # fmt: skip
    """Compare interpolated rays with the exact solver, and mark the cells that fail.

    Args:
        water: The water column.
        source_depth: Depth of the source [m].
        bounces: Bounces of the family.
        points: The points, in runs of equal depths, and their cells.
        interpolated: Interpolated rays, (n, branches, COLUMNS).
        tolerances: Largest error of the delay [s], and largest relative error of amplitude and length [1].
        cell_state: Changed: `EXACT` where a point fails.
        errors: Result: error of the delay [s], larger relative error of amplitude and length [1], of the worst path;
            infinite where the number of paths differs, 0 at points outside valid cells, (2, n).
    """
    n, cell, paths = points.ranges.size, points.cell, points.paths
    solutions = RaySolutions(np.zeros((n, MAX_RAYS, COLUMNS)), np.zeros(n, np.int64), np.zeros(n, np.uint8))
    solve_eigenrays(water, source_depth, bounces, points.depth, points.ranges, solutions)
    rays, path_count = solutions.rays, solutions.ray_count
    for i in range(n):
        errors[0, i] = errors[1, i] = 0.0
        if paths[i] == EXACT:
            continue
        if paths[i] != path_count[i]:
            errors[0, i] = errors[1, i] = math.inf
        else:
            for b in range(path_count[i]):
                ray = rays[i, b]
                delay_error = abs(interpolated[i, b, DELAY] - ray[DELAY])
                amplitude_error = abs(interpolated[i, b, AMPLITUDE] / ray[AMPLITUDE] - 1)
                length_error = abs(interpolated[i, b, LENGTH] / ray[LENGTH] - 1)
                # NaN counts as a failure
                errors[0, i] = max(errors[0, i], delay_error) if delay_error >= 0 else math.inf
                errors[1, i] = (
                    max(errors[1, i], amplitude_error, length_error)
                    if amplitude_error >= 0 and length_error >= 0
                    else math.inf
                )
        if not (errors[0, i] <= tolerances[0] and errors[1, i] <= tolerances[1]):
            cell_state[cell[0, i], cell[1, i]] = EXACT


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate_planes(upper_nodes: Floats, lower_nodes: Floats, t: float, plane_spacing: float, nodes: Floats) -> None:
    """Nodes for a source between two planes, by Hermite's cubic: W and Y are the derivatives of U and V with its depth.

    Args:
        upper_nodes: Values of the nodes of the plane above, flat.
        lower_nodes: Values of the nodes of the plane below, flat.
        t: Position of the source from the plane above, as a fraction of the spacing, 0 to 1.
        plane_spacing: Distance of the planes [m].
        nodes: Result: values of the nodes, flat.
    """
    w = 1 - t
    a, b, c, d = w * w * (1 + 2 * t), t * t * (3 - 2 * t), t * w * w * plane_spacing, -t * t * w * plane_spacing
    e, f, g = 6 * t * w / plane_spacing, w * (1 - 3 * t), t * (3 * t - 2)
    for start in range(0, nodes.size, NODE_VALUES):
        for half in range(0, NODE_VALUES, 4):
            for value in (U, V):
                i = start + half + value
                j = i + 1  # U is followed by its derivative W, V by Y
                nodes[i] = a * upper_nodes[i] + b * lower_nodes[i] + c * upper_nodes[j] + d * lower_nodes[j]
                nodes[j] = e * (lower_nodes[i] - upper_nodes[i]) + f * upper_nodes[j] + g * lower_nodes[j]
