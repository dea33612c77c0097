"""Building of an eigenray table: grid, nodes for one source depth, and checked cells."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_table_kernel import (
    EXACT,
    CellGrid,
    NodeTable,
    TablePoints,
    find_cells,
    read_table,
)
from insonify.propagation._eigenray_table_nodes import (
    BRANCHES,
    CellPaths,
    NodeRays,
    compare_corners,
    compare_points,
    interpolate_planes,
    mark_neighbours_of_exact,
    solve_nodes,
)
from insonify.propagation.families import Bounces
from insonify.propagation.propagation_model import RANGE_MARGIN
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

MAX_CELL_DELAY_ERROR = 4e-10
"""Error of the delay above which a cell is left to the exact solver [s]: less than half of the guaranteed error."""
MAX_CELL_AMPLITUDE_ERROR = 1.2e-3
"""Relative error of amplitude or length above which a cell is left to it [1]: 0.01 dB, about half the guaranteed."""
_MERGED = 2e-3  # largest distance of knots of the profile that share a line of nodes [m]
_DOUBTFUL_FRACTION = 0.25  # error of a cell, as a fraction of the errors above, beyond which it is doubtful
_PLANE_FRACTIONS = (0.15, 0.85)  # source depths between two planes at which doubtful cells are compared
_NEAR_CORNERS = ((0.06, 0.06), (0.94, 0.06), (0.06, 0.94), (0.94, 0.94))  # positions in a cell: range, depth


@dataclass(frozen=True, slots=True, eq=False)
class TableGrid:
    """Grid of the nodes of a table."""

    node_depths: Floats
    """Depths [m], increasing, (l,)."""
    node_ranges: Floats
    """Ranges [m], evenly spaced from 0, (s,)."""
    rows: CellGrid
    """Rows of cells."""

    @property
    def step(self) -> float:
        """Spacing of the ranges [m]."""
        return float(self.node_ranges[1])

    @property
    def cells(self) -> int:
        """Number of cells in a row."""
        return self.node_ranges.size - 1

    def find(self, cell_state: Bytes, depth: Floats, ranges: Floats) -> TablePoints:
        """Points with row and column of their cell, and its number of paths; `EXACT` outside of the grid."""
        points = table_points(depth, ranges)
        find_cells(cell_state, self.rows, points)
        return points


def table_points(depth: Floats, ranges: Floats) -> TablePoints:
    """Points at depths [m], (n,), and ranges [m], (n,), with arrays for their cells, which `find_cells` fills."""
    return TablePoints(
        np.ascontiguousarray(depth),
        np.ascontiguousarray(ranges),
        np.empty((2, depth.size), np.int32),
        np.empty(depth.size, np.uint8),
    )


def table_grid(
    water: SoundSpeedLayers, point_depths: tuple[float, float], max_range: float, step: float, height: float
) -> TableGrid:
    """Lines of constant depth through every knot of the profile, and even ranges to `RANGE_MARGIN` times the greatest.

    Args:
        water: The water column.
        point_depths: Least and greatest depth of the points [m].
        max_range: Greatest range [m].
        step: Largest spacing of the ranges [m].
        height: Largest spacing of the lines [m].
    """
    lines = subdivide(point_depths, water.depth, height)
    tops = lines[:-1] if lines.size > 1 else lines
    heights = np.diff(lines) if lines.size > 1 else np.zeros(1)
    speed = np.interp(lines, water.depth, water.speed)
    gradient = np.diff(speed) / heights if lines.size > 1 else np.zeros(1)
    per_height = 1 / heights if lines.size > 1 else np.zeros(1)
    slices = max(1, int(np.ceil((lines[-1] - lines[0]) / heights.min()))) if lines.size > 1 else 1
    per_metre = slices / (lines[-1] - lines[0]) if lines.size > 1 else 0.0
    depths = lines[0] + np.arange(slices) / per_metre if slices > 1 else lines[:1]
    buckets = np.clip(np.searchsorted(tops, depths + 1e-12, side="right") - 1, 0, tops.size - 1).astype(np.int32)
    intervals = max(1, int(np.ceil(max_range / step - 1e-9)))
    node_ranges: Floats = max_range / intervals * np.arange(np.ceil(RANGE_MARGIN * intervals) + 1, dtype=float)
    rows = CellGrid(
        tops.copy(), heights, speed[: tops.size].copy(), gradient, per_height, buckets, float(per_metre),
        1 / float(node_ranges[1]),
    )  # fmt: skip
    return TableGrid(lines, node_ranges, rows)


def subdivide(span: tuple[float, float], knots: Floats, max_spacing: float) -> Floats:
    """Depths from the least to the greatest of a span, with the knots between them, at most `max_spacing` apart [m].

    Knots within millimetres of each other count as one: the difference is below the resolution of a table, and the
    comparison with the exact solver is decisive.
    """
    low, high = span
    if high - low < 1e-9:
        return np.array([low])
    ends = [low]
    for knot in knots[knots < high - _MERGED]:
        if knot > ends[-1] + _MERGED:
            ends.append(float(knot))
    ends.append(high)
    intervals = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / max_spacing - 1e-9))), endpoint=False) for a, b in pairwise(ends)
    ]
    return np.concatenate([*intervals, [high]])


@dataclass(frozen=True, slots=True, eq=False)
class TableSpecification:
    """Specification of a table: a path family in a water column, on a grid."""

    layers: SoundSpeedLayers
    bounces: Bounces
    grid: TableGrid


@dataclass(frozen=True, slots=True, eq=False)
class TablePlane:
    """Table for one source depth; b branches, l lines, s ranges."""

    specification: TableSpecification
    source_depth: float
    nodes: Floats
    """Eight values of every node, see `_eigenray_table_kernel`, shape (b, l, s, 8)."""
    mean_speed: NDArray[np.float32]
    """Length over delay [m/s], shape (b, l, s)."""
    path_count: Bytes
    """Number of paths in each cell, `EXACT` where the exact solver is used, (rows, cells)."""
    missing_status: Bytes
    """`LegStatus` of cells without paths, (rows, cells)."""
    history: Bytes
    """Caustics of each path in a cell, and the fewest turns at its corners, (b, rows, cells, 2)."""

    def read(self, depth: Floats, ranges: Floats) -> tuple[Floats, TablePoints]:
        """Interpolate the table at points.

        Args:
            depth: Depths of the points [m], (n,).
            ranges: Ranges of the points [m], (n,).

        Returns:
            Rays, as from the exact solver, (n, paths, COLUMNS), 0 where there is none or the exact solver is
            needed; the points with their cells.
        """
        specification, grid = self.specification, self.specification.grid
        source_speed = float(np.interp(self.source_depth, specification.layers.depth, specification.layers.speed))
        table = NodeTable(
            self.nodes.reshape(-1), self.mean_speed.reshape(-1), self.history, grid.node_depths.size,
            grid.node_ranges.size,
        )  # fmt: skip
        points = table_points(depth, ranges)
        rays = read_table(self.path_count, table, grid.rows, source_speed, specification.bounces.number, points)
        return rays, points


def build_plane(specification: TableSpecification, source_depth: float) -> TablePlane:
    """Build the table for one source depth, with its cells checked.

    Args:
        specification: Family, column and grid.
        source_depth: Depth of the source [m].
    """
    water, grid = specification.layers, specification.grid
    shape, cells = (grid.node_depths.size, grid.node_ranges.size), (grid.rows.top.size, grid.cells)
    nodes, mean_speed = np.zeros((BRANCHES, *shape, 8)), np.zeros((BRANCHES, *shape), np.float32)
    sheet, count, status = np.zeros((BRANCHES, *shape), np.int64), np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    node_rays = NodeRays(nodes, mean_speed, sheet, count, status)
    solve_nodes(water, source_depth, specification.bounces, grid.node_depths, grid.node_ranges, node_rays)
    state, missing = np.empty(cells, np.uint8), np.empty(cells, np.uint8)
    history = np.zeros((BRANCHES, *cells, 2), np.uint8)
    source_layer = int(_layers(water, np.array([source_depth]))[0])
    layers = _layers(water, grid.rows.top + grid.rows.height / 2)
    compare_corners(node_rays, specification.bounces, source_layer, layers, CellPaths(state, missing, history))
    branches = max(1, int(np.where(state == EXACT, 0, state).max()))
    plane = TablePlane(
        specification, source_depth, nodes[:branches].copy(), mean_speed[:branches].copy(), state, missing,
        history[:branches].copy(),
    )  # fmt: skip
    check_cells(plane)
    return plane


def interpolated_plane(above: TablePlane, below: TablePlane, source_depth: float, cell_state: Bytes) -> TablePlane:
    """Interpolate the table for a source between two planes: nodes by values and derivatives, cubic.

    Args:
        above: Table for the next source depth above.
        below: Table for the next source depth below.
        source_depth: Depth of the source [m].
        cell_state: Number of paths in each cell for sources between the two, or `EXACT`; kept, not copied:
            checks of the result write to it.
    """
    gap = below.source_depth - above.source_depth
    t = (source_depth - above.source_depth) / gap
    paths = min(above.nodes.shape[0], below.nodes.shape[0])
    nodes = np.empty((paths, *above.nodes.shape[1:]))
    interpolate_planes(above.nodes[:paths].reshape(-1), below.nodes[:paths].reshape(-1), t, gap, nodes.reshape(-1))
    mean_speed = above.mean_speed[:paths] + np.float32(t) * (below.mean_speed[:paths] - above.mean_speed[:paths])
    return TablePlane(
        above.specification, source_depth, nodes, mean_speed, cell_state, above.missing_status, above.history[:paths]
    )


def state_between_planes(above: TablePlane, below: TablePlane) -> Bytes:
    """Number of paths in each cell for sources between two planes, or `EXACT`.

    A cell has a number where both planes have it, with the same caustics or status of missing rays, and where their
    interpolation agrees with the exact solver: halfway, and in doubtful cells also near either plane.
    """
    is_equal = (above.path_count == below.path_count) & (
        (above.path_count > 0) | (above.missing_status == below.missing_status)
    )
    paths = min(above.nodes.shape[0], below.nodes.shape[0])
    is_equal &= (above.history[:paths] == below.history[:paths]).all(axis=(0, 3)) & (above.path_count <= paths)
    state = np.where(is_equal, above.path_count, np.uint8(EXACT))
    gap = below.source_depth - above.source_depth
    doubtful = check_cells(interpolated_plane(above, below, above.source_depth + 0.5 * gap, state))
    for t in _PLANE_FRACTIONS:
        plane = interpolated_plane(above, below, above.source_depth + t * gap, state)
        if plane.nodes.shape[1] == 1:  # one line: cheap enough to check all cells
            rows, cells = np.nonzero(state != EXACT)
            compare_and_exclude(plane, *_inside(plane, rows, cells, 0.5, 0.5))
        check_near_corners(plane, doubtful)
    return state


def check_cells(plane: TablePlane) -> NDArray[np.bool_]:
    """Compare every cell with the exact solver: in its middle, and doubtful ones near their corners too; exclude some.

    Doubtful cells are those with a noticeable error, and those next to a cell of the exact solver. Cells that fail
    are left to the exact solver.

    Returns:
        Mask of doubtful cells, (rows, cells).
    """
    rows, cells = np.nonzero(plane.path_count != EXACT)
    delay_error, amplitude_error = compare_and_exclude(plane, *_inside(plane, rows, cells, 0.5, 0.5))
    doubtful = np.zeros(plane.path_count.shape, bool)
    mark_neighbours_of_exact(plane.path_count, doubtful)
    inaccurate = (delay_error > _DOUBTFUL_FRACTION * MAX_CELL_DELAY_ERROR) | (
        amplitude_error > _DOUBTFUL_FRACTION * MAX_CELL_AMPLITUDE_ERROR
    )
    doubtful[rows[inaccurate], cells[inaccurate]] = True
    check_near_corners(plane, doubtful)
    return doubtful


def check_near_corners(plane: TablePlane, doubtful: NDArray[np.bool_]) -> None:
    """Compare some cells with the exact solver near their corners; those that fail are left to it."""
    rows, cells = np.nonzero(doubtful & (plane.path_count != EXACT))
    for u, v in _NEAR_CORNERS:
        compare_and_exclude(plane, *_inside(plane, rows, cells, u, v))


def _inside(
    plane: TablePlane, rows: NDArray[np.intp], cells: NDArray[np.intp], u: float, v: float
) -> tuple[Floats, Floats]:
    """Depths and ranges [m], (c,), of positions at fractions u of the width and v of the height of c cells."""
    grid = plane.specification.grid
    return grid.rows.top[rows] + v * grid.rows.height[rows], np.asarray((cells + u) * grid.step, float)


def compare_and_exclude(plane: TablePlane, depth: Floats, ranges: Floats) -> Floats:
    """Errors of delay [s] and of amplitude or length, the larger [1], at points, (2, n); exclude cells that fail."""
    specification, errors = plane.specification, np.empty((2, depth.size))
    rays, points = plane.read(depth, ranges)
    compare_points(
        specification.layers,
        plane.source_depth,
        specification.bounces,
        points,
        rays,
        (MAX_CELL_DELAY_ERROR, MAX_CELL_AMPLITUDE_ERROR),
        plane.path_count,
        errors,
    )
    return errors


def _layers(water: SoundSpeedLayers, depth: Floats) -> NDArray[np.int64]:
    """Layer of the profile of each depth [m], -1 on a knot, (n,)."""
    layer = np.searchsorted(water.depth, depth, side="right") - 1
    knot_distance = np.abs(depth[:, None] - water.depth).min(axis=1)
    return np.where(knot_distance > 1e-6, np.clip(layer, 0, water.depth.size - 2), -1)
