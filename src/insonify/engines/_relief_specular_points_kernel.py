"""Kernels of the specular points of terrain: length of the path between two ends by a point of it, and derivatives.

Lengths in layered water are travel times times the sound speed at the mean sea surface. The terrain is a uniform cubic
B-spline. In the names of second derivatives n, e and d stand for north, east and depth, so that ne is a mixed one.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._slowness_table_kernel import (
    SlownessTable,
    interpolate_slowness,
    interpolate_speed,
    no_table,
    slowness_table,
)
from insonify.jit import njit
from insonify.propagation.layered_surface_path_kernel import (
    CLOSE,
    SurfaceWater,
    refracted_path,
    speed_at,
    time_and_length,
)

Floats = NDArray[np.float64]

COLUMNS = 12
"""Number of columns of a path by one point [1]."""
LENGTH, BY_NORTH, BY_EAST = 0, 1, 2
"""Columns of the path length [m], and of its derivatives along the terrain by north and by east [1]."""
HESSIAN, PLANE_HESSIAN = 3, 6
"""First of three columns of second derivatives of the path length, by north twice, by both, and by east twice [1/m]:
along the terrain, and along its tangent plane at the point."""
GRAZING_SINE, DEPTH, SECANT = 9, 10, 11
"""Columns of the sine of the grazing angle [1], the depth [m] and the secant of the terrain's slope [1]."""
BLOCK_NODES = 4
"""Side of the blocks of nodes that are searched for changes of sign together [1]."""
ROOT_NEIGHBOURHOOD = 0.01
"""Distance from an earlier stationary point below which Newton's method stops, since it converges to that point
[node spacings]."""
NEWTON_STEPS = 8
"""Largest number of Newton steps to a stationary point [1]."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class TerrainSpline(NamedTuple):
    """Depth of a square of the terrain as a uniform cubic B-spline over a lattice."""

    coefficients: Floats
    """B-spline coefficients of the nodes, and of further nodes around them [m], (a, b)."""
    north: float
    """North of the first node [m]."""
    east: float
    """East of the first node [m]."""
    step: float
    """Node spacing [m]."""
    row: int = 0
    """Row of the first node in `coefficients` [1]."""
    column: int = 0
    """Column of the first node in `coefficients` [1]."""


class PathEnds(NamedTuple):
    """Both ends of the paths, or their images in the sea surface, and the water between.

    The path length is symmetric in the ends; both lie above the terrain.
    """

    begin: Floats
    """North, east, depth of the first end [m], (3,)."""
    stop: Floats
    """North, east, depth of the other end [m], (3,)."""
    water: SurfaceWater
    """The water; without knots, of one sound speed."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def same_position(ends: PathEnds) -> bool:
    """Return True if both ends have one position: the two parts of a path are equal then."""
    return ends.begin[0] == ends.stop[0] and ends.begin[1] == ends.stop[1] and ends.begin[2] == ends.stop[2]


@njit(cache=True, nogil=True, error_model="numpy")
def _b_spline_weights(t: float) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Cubic B-spline weights of four nodes, t from the second to the third; their first and second derivatives by t."""
    s = 1 - t
    value = (s * s * s / 6, (3 * t - 6) * t * t / 6 + 2 / 3, (3 * s - 6) * s * s / 6 + 2 / 3, t * t * t / 6)
    first = (-s * s / 2, (1.5 * t - 2) * t, (2 - 1.5 * s) * s, t * t / 2)
    return value, first, (s, 3 * t - 2, 3 * s - 2, t)


@njit(cache=True, nogil=True, error_model="numpy")
def depth_derivatives(
    north: float, east: float, terrain: TerrainSpline
) -> tuple[float, float, float, float, float, float]:
    """Depth [m]; its derivatives by north, by east [1]; second ones by north twice, both, and east twice [1/m]."""
    coefficients, per_step = terrain.coefficients, 1 / terrain.step
    x, y = (north - terrain.north) * per_step, (east - terrain.east) * per_step
    a = min(max(math.floor(x) + terrain.row, 1), coefficients.shape[0] - 3)
    b = min(max(math.floor(y) + terrain.column, 1), coefficients.shape[1] - 3)
    along, along1, along2 = _b_spline_weights(x - (a - terrain.row))
    across, across1, across2 = _b_spline_weights(y - (b - terrain.column))
    depth = north1 = east1 = north2 = both = east2 = 0.0
    for i in range(4):
        row = row1 = row2 = 0.0
        for j in range(4):
            c = coefficients[a - 1 + i, b - 1 + j]
            row += across[j] * c
            row1 += across1[j] * c
            row2 += across2[j] * c
        depth += along[i] * row
        north1 += along1[i] * row
        east1 += along[i] * row1
        north2 += along2[i] * row
        both += along1[i] * row1
        east2 += along[i] * row2
    square = per_step * per_step
    return depth, north1 * per_step, east1 * per_step, north2 * square, both * square, east2 * square


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _path_gradient(
    north: float, east: float, depth: float, end: Floats, water: SurfaceWater
) -> tuple[float, float, float, float, float, float]:
    """Gradient of the path length from an end to a point below it, change of its horizontal part, and the length.

    Returns:
        Derivatives of the length by north, east and depth of the point [1]; change of the horizontal part of that
        gradient per metre perpendicular to the vertical plane of the path, and in that plane [1/m]; the length [m]. In
        water of one speed both changes are given as 1 / length, to which `_second_derivatives` applies the direction.
        NaN where no ray reaches the point.
    """
    x, y, z = north - end[0], east - end[1], depth - end[2]
    if water.depth.size == 0:
        length = math.sqrt(x * x + y * y + z * z)
        return x / length, y / length, z / length, 1 / length, 1 / length, length
    distance = math.sqrt(x * x + y * y)
    ray = refracted_path(distance, -end[2], depth, False, water, 0.0, CLOSE)
    if not ray.exists:
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    reference = water.speed[0]
    p, index = reference * ray.slowness, reference / speed_at(depth, water)
    time, _ = time_and_length(ray, distance, False, water)
    ray_north, ray_east = (x / distance, y / distance) if distance > 1e-9 else (1.0, 0.0)
    q = math.sqrt(max(index * index - p * p, 1e-12))
    return (p * ray_north, p * ray_east, q, reference / ray.r_per_p, reference / ray.dr_dp, reference * time)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _second_derivatives(
    gradient: tuple[float, float, float, float, float, float], depth: float, water: SurfaceWater
) -> tuple[float, float, float, float, float, float]:
    """Second derivatives of the path length by north, east and depth: nn, ne, ee, nd, ed, dd [1/m].

    Args:
        gradient: From `_path_gradient`.
        depth: Depth of the point [m].
        water: The water.
    """
    n, e, d, per, bend, _ = gradient
    if water.depth.size == 0:
        return (1 - n * n) * per, -n * e * per, (1 - e * e) * per, -n * d * per, -e * d * per, (1 - d * d) * per
    p = math.sqrt(n * n + e * e)
    ray_north, ray_east = (n / p, e / p) if p > 1e-12 else (1.0, 0.0)
    index, below = water.speed[0] / speed_at(depth, water), water.speed[0] / speed_at(depth + 1e-3, water)
    cross = -p / d * bend
    return (
        per + (bend - per) * ray_north * ray_north, (bend - per) * ray_north * ray_east,
        per + (bend - per) * ray_east * ray_east,
        cross * ray_north, cross * ray_east, (p / d) ** 2 * bend + index * (below - index) / 1e-3 / d,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _path(north: float, east: float, terrain: TerrainSpline, ends: PathEnds) -> tuple[float, ...]:
    """Path between both ends by the point of the terrain at a position [m]: the columns `LENGTH` to `SECANT`."""
    depth, north1, east1, north2, both, east2 = depth_derivatives(north, east, terrain)
    length = total_north = total_east = down = plane_nn = plane_ne = plane_ee = 0.0
    for number in range(2):
        if number == 0 or not same_position(ends):
            gradient = _path_gradient(north, east, depth, ends.begin if number == 0 else ends.stop, ends.water)
            nn, ne, ee, nd, ed, dd = _second_derivatives(gradient, depth, ends.water)
        length += gradient[5]
        total_north += gradient[0]
        total_east += gradient[1]
        down += gradient[2]
        plane_nn += nn + 2 * nd * north1 + dd * north1 * north1
        plane_ne += ne + nd * east1 + ed * north1 + dd * north1 * east1
        plane_ee += ee + 2 * ed * east1 + dd * east1 * east1
    secant = math.sqrt(1 + north1 * north1 + east1 * east1)
    grazing_sine = abs(down - total_north * north1 - total_east * east1) / (2 * secant)
    return (
        length, total_north + down * north1, total_east + down * east1,
        plane_nn + down * north2, plane_ne + down * both, plane_ee + down * east2,
        plane_nn, plane_ne, plane_ee, grazing_sine, depth, secant,
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _principal_curvatures(nn: float, ne: float, ee: float) -> tuple[float, float, float, float]:
    """Smaller and larger eigenvalue of a symmetric matrix ((nn, ne), (ne, ee)); unit eigenvector of the larger.

    Source: the plane rotation of LAPACK's dlaev2, exact to rounding.
    """
    total, difference, twice = nn + ee, nn - ee, 2 * ne
    large, small = (nn, ee) if abs(nn) > abs(ee) else (ee, nn)
    if abs(difference) > abs(twice):
        root = abs(difference) * math.sqrt(1 + (twice / difference) ** 2)
    elif abs(difference) < abs(twice):
        root = abs(twice) * math.sqrt(1 + (difference / twice) ** 2)
    else:
        root = abs(twice) * math.sqrt(2.0)
    if total == 0:
        first, second = root / 2, -root / 2
    else:
        first = (total - root) / 2 if total < 0 else (total + root) / 2
        second = (large / first) * small - (ne / first) * ne
    leaning = difference + root if difference >= 0 else difference - root
    if abs(leaning) > abs(twice):
        tangent = -twice / leaning
        sine = 1 / math.sqrt(1 + tangent * tangent)
        cosine = tangent * sine
    elif twice == 0:
        cosine, sine = 1.0, 0.0
    else:
        tangent = -leaning / twice
        cosine = 1 / math.sqrt(1 + tangent * tangent)
        sine = tangent * cosine
    if (total >= 0) == (difference >= 0):
        cosine, sine = -sine, cosine
    return (second, first, cosine, sine) if second <= first else (first, second, -sine, cosine)


@njit(cache=True, nogil=True, error_model="numpy")
def paths_with_curvature(
    positions: Floats, terrain: TerrainSpline, ends: PathEnds, reach: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Paths by n points, and the principal curvatures of the path length about each, with their change.

    Args:
        positions: North, east of the points [m], (n, 2).
        terrain: Depth of the terrain.
        ends: Ends of the paths.
        reach: Step to either side of a point by which the second derivative is differenced [m].

    Returns:
        North, east, depth [m], (n, 3); columns from `LENGTH` to `SECANT`, (n, COLUMNS); smaller and larger principal
        curvature [1/m], (n, 2); second derivative along each principal axis, a step ahead less a step behind, 2 `reach`
        times the third derivative [1/m], (n, 2).
    """
    rows, curvature = np.empty((len(positions), COLUMNS)), np.empty((len(positions), 2))
    points, change = np.empty((len(positions), 3)), np.zeros((len(positions), 2))
    for n in range(len(positions)):
        north, east = positions[n, 0], positions[n, 1]
        path = _path(north, east, terrain, ends)
        for column in range(COLUMNS):
            rows[n, column] = path[column]
        points[n, 0], points[n, 1], points[n, 2] = north, east, path[DEPTH]
        low, high, cosine, sine = _principal_curvatures(path[HESSIAN], path[HESSIAN + 1], path[HESSIAN + 2])
        curvature[n, 0], curvature[n, 1] = low, high
        for axis in range(2):
            a, b = (-sine, cosine) if axis == 0 else (cosine, sine)
            for side in (-1.0, 1.0):
                moved = _path(north + side * reach * a, east + side * reach * b, terrain, ends)
                nn, ne, ee = moved[HESSIAN], moved[HESSIAN + 1], moved[HESSIAN + 2]
                change[n, axis] += side * (a * nn * a + a * ne * b + b * ne * a + b * ee * b)
    return points, rows, curvature, change


@njit(cache=True, nogil=True, error_model="numpy")
def nodes_of_sign_changes(
    depth: Floats, shape: tuple[int, int], margin: int, terrain: TerrainSpline, ends: PathEnds, reach: int
) -> Floats:
    """Nodes about which both components of the gradient of the path length change sign, see `mark_sign_changes`.

    Args:
        depth: See `gradients_at_nodes`.
        shape: Number of nodes along north and along east, those of the margin included.
        margin: Number of nodes along each edge that are left out.
        terrain: Depth of the terrain.
        ends: Ends of the paths.
        reach: Largest distance from a node of those searched for a change of sign [nodes].

    Returns:
        North, east [m], (n, 2).
    """
    rows, columns = shape[0] - 2 * margin, shape[1] - 2 * margin
    gradient, is_marked = np.empty((2, rows, columns)), np.empty((rows, columns), np.bool_)
    gradients_at_nodes(depth, margin, terrain, ends, gradient)
    mark_sign_changes(gradient, reach, is_marked)
    positions, n = np.empty((is_marked.sum(), 2)), 0
    for i in range(rows):
        for j in range(columns):
            if is_marked[i, j]:
                positions[n, 0] = terrain.north + (i + margin) * terrain.step
                positions[n, 1] = terrain.east + (j + margin) * terrain.step
                n += 1
    return positions


@njit(cache=True, nogil=True, error_model="numpy")
def gradients_at_nodes(depth: Floats, margin: int, terrain: TerrainSpline, ends: PathEnds, gradient: Floats) -> None:
    """Fill the gradient of the length of the path between two ends by each node of the terrain's lattice.

    Args:
        depth: Depth at the nodes of `terrain.coefficients` [m], (a, b).
        margin: Number of nodes left out along the low edges, at least 1: the spline's slopes use neighbours.
        terrain: Depth of the terrain.
        ends: Ends of the paths.
        gradient: Result: derivatives along the terrain by north and by east [1], (2, rows, columns); its shape sets
            the number of nodes.
    """
    is_homogeneous, shape, once = ends.water.depth.size == 0, gradient.shape[1:], same_position(ends)
    path_gradient, tables = np.zeros((5, shape[1])), (no_table(ends.water), no_table(ends.water))
    first, first_east = terrain.column + margin, terrain.east + margin * terrain.step
    if not is_homogeneous:
        north, last_east = terrain.north + margin * terrain.step, first_east + (shape[1] - 1) * terrain.step
        square = north, north + (shape[0] - 1) * terrain.step, first_east, last_east
        searched = depth[terrain.row + margin : terrain.row + margin + shape[0], first : first + shape[1]]
        span = searched.min(), searched.max()
        table = slowness_table(ends.begin, square, span, searched.size, ends.water)
        tables = (table, table if once else slowness_table(ends.stop, square, span, searched.size, ends.water))
    for i in range(shape[0]):
        a, path_gradient[:] = i + margin, 0
        row, north = depth[terrain.row + a, first : first + shape[1]], terrain.north + a * terrain.step
        for number in range(2):
            end, table = (ends.begin, tables[0]) if number == 0 else (ends.stop, tables[1])
            if once and number == 1:
                path_gradient *= 2
            elif is_homogeneous:
                _add_straight_gradients(row, north, first_east, terrain.step, end, path_gradient)
            else:
                _add_refracted_gradients(row, north, first_east, terrain.step, end, ends.water, table, path_gradient)
        _write_terrain_gradient(terrain, a, margin, path_gradient, gradient[0, i], gradient[1, i])


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def _add_refracted_gradients(
    depth: Floats, north: float, first_east: float, step: float, end: Floats, water: SurfaceWater,
    table: SlownessTable, path_gradient: Floats,
) -> None:  # fmt: skip
    """Add the gradients of refracted paths from an end to a row of nodes to the first three rows of `path_gradient`.

    Args:
        depth: Depths of the nodes [m], (n,).
        north: North of the row [m].
        first_east: East of its first node [m].
        step: Node spacing [m].
        end: North, east, depth of the end [m], (3,).
        water: The water.
        table: Rays from the end.
        path_gradient: Changed: derivatives by north, east and depth [1], and two rows of working memory, (5, n).
    """
    by_north, by_east, by_depth, per_distance, speed = path_gradient
    x, first, reference = north - end[0], first_east - end[1], water.speed[0]
    interpolate_slowness(depth, x, first, step, table, per_distance)
    interpolate_speed(depth, table.water, speed)
    for j in range(depth.size):
        y, per, index = first + j * step, per_distance[j], reference / speed[j]
        down = math.sqrt(max(index * index - per * per * (x * x + y * y), 1e-12))
        by_north[j] += 0.0 if math.isnan(per) else per * x
        by_east[j] += 0.0 if math.isnan(per) else per * y
        by_depth[j] += 0.0 if math.isnan(per) else down
    for j in range(depth.size):
        if math.isnan(per_distance[j]):
            one = _path_gradient(north, first_east + j * step, depth[j], end, water)
            by_north[j], by_east[j], by_depth[j] = by_north[j] + one[0], by_east[j] + one[1], by_depth[j] + one[2]


@njit(cache=True, nogil=True, error_model="numpy")
def _add_straight_gradients(
    depth: Floats, north: float, first_east: float, step: float, end: Floats, path_gradient: Floats
) -> None:
    """Add the gradients of straight paths from an end to a row of nodes to `path_gradient`.

    Args:
        depth: Depths of the nodes [m], (n,).
        north: North of the row [m].
        first_east: East of its first node [m].
        step: Node spacing [m].
        end: North, east, depth of the end [m], (3,).
        path_gradient: Changed: derivatives by north, east and depth [1], (3, n).
    """
    by_north, by_east, by_depth = path_gradient[0], path_gradient[1], path_gradient[2]
    x, first, down = north - end[0], first_east - end[1], end[2]
    for j in range(depth.size):
        y, z = first + j * step, depth[j] - down
        per_length = 1 / math.sqrt(x * x + y * y + z * z)
        by_north[j] += x * per_length
        by_east[j] += y * per_length
        by_depth[j] += z * per_length


@njit(cache=True, nogil=True, error_model="numpy")
def _write_terrain_gradient(
    terrain: TerrainSpline, row: int, margin: int, path_gradient: Floats, by_north: Floats, by_east: Floats
) -> None:
    """Write the derivatives of the path length along the terrain at a row of nodes.

    Chain rule: horizontal derivative plus derivative by depth times the slope of the B-spline at the node.

    Args:
        terrain: Depth of the terrain.
        row: Row of the nodes, in steps from the first node.
        margin: Column of the first of them, in steps from the first node.
        path_gradient: Derivatives by north, east and depth [1], (3, n).
        by_north: Result [1], (n,).
        by_east: Result [1], (n,).
    """
    half, before, middle = 1 / (12 * terrain.step), terrain.column + margin - 1, terrain.row + row
    low, same, high = terrain.coefficients[middle - 1], terrain.coefficients[middle], terrain.coefficients[middle + 1]
    low, same, high = low[before:], same[before:], high[before:]
    for j in range(by_north.size):
        north1 = (high[j] - low[j] + high[j + 2] - low[j + 2] + 4 * (high[j + 1] - low[j + 1])) * half
        east1 = (low[j + 2] - low[j] + high[j + 2] - high[j] + 4 * (same[j + 2] - same[j])) * half
        by_north[j] = path_gradient[0, j] + path_gradient[2, j] * north1
        by_east[j] = path_gradient[1, j] + path_gradient[2, j] * east1


@njit(cache=True, nogil=True, error_model="numpy")
def mark_sign_changes(gradient: Floats, reach: int, result: NDArray[np.bool_]) -> None:
    """Mark nodes about which both components of a gradient pass through zero.

    A component passes through zero where its range over the nodes at most `reach` away includes zero. The range is
    widened by a quarter of itself on both sides, for a zero between nodes of one sign. NaN components are left out.

    Args:
        gradient: Both components [1], (2, a, b).
        reach: Distance, in nodes, within which the range is taken.
        result: Filled with True for marked nodes, (a, b).
    """
    _, rows, columns = gradient.shape
    low, high = np.empty((2, columns)), np.empty((2, columns))
    result[:] = False
    for i in range(0, rows, BLOCK_NODES):
        low[:], high[:] = math.inf, -math.inf
        for axis in range(2):
            for a in range(max(i - reach, 0), min(i + BLOCK_NODES + reach, rows)):
                _widen_range(gradient[axis, a], low[axis], high[axis])
        for j in range(0, columns, BLOCK_NODES):
            around = slice(max(j - reach, 0), j + BLOCK_NODES + reach)
            if not (_passes_zero(low[0, around], high[0, around]) and _passes_zero(low[1, around], high[1, around])):
                continue  # nor does any part of these ranges
            for a in range(i, min(i + BLOCK_NODES, rows)):
                for b in range(j, min(j + BLOCK_NODES, columns)):
                    result[a, b] = _both_pass_zero(gradient, a, b, reach)


@njit(cache=True, nogil=True, error_model="numpy")
def _both_pass_zero(gradient: Floats, row: int, column: int, reach: int) -> bool:
    """Return True if the widened ranges of both components about one node include zero."""
    for axis in range(2):
        low, high = math.inf, -math.inf
        for a in range(max(row - reach, 0), min(row + reach + 1, gradient.shape[1])):
            for b in range(max(column - reach, 0), min(column + reach + 1, gradient.shape[2])):
                value = gradient[axis, a, b]
                low, high = value if value < low else low, value if value > high else high
        if not (1.25 * low <= 0.25 * high and 0.25 * low <= 1.25 * high):
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _passes_zero(lowest: Floats, highest: Floats) -> bool:
    """Return True if the range from the least of `lowest` to the greatest of `highest`, widened, includes zero."""
    low, high = math.inf, -math.inf
    for j in range(lowest.size):
        low, high = min(low, lowest[j]), max(high, highest[j])
    return 1.25 * low <= 0.25 * high and 0.25 * low <= 1.25 * high


@njit(cache=True, nogil=True, error_model="numpy")
def _widen_range(values: Floats, low: Floats, high: Floats) -> None:
    """Widen each range from `low` to `high` to include one value; a NaN changes nothing. All arrays (n,)."""
    for j in range(low.size):
        low[j] = values[j] if values[j] < low[j] else low[j]
        high[j] = values[j] if values[j] > high[j] else high[j]


@njit(cache=True, nogil=True, error_model="numpy")
def stationary_points(starts: Floats, terrain: TerrainSpline, ends: PathEnds) -> Floats:
    """Stationary points of the path length by Newton's method, each once: north, east [m], (m, 2).

    Args:
        starts: North, east at which the search starts, one node spacing apart [m], overwritten, (n, 2).
        terrain: Depth of the terrain.
        ends: Ends of the paths.
    """
    converged, found, count = np.zeros(len(starts), np.bool_), np.empty((len(starts), 2)), 0
    step = terrain.step
    for n in range(starts.shape[0]):
        north, east = starts[n, 0], starts[n, 1]
        for number in range(NEWTON_STEPS + 1):
            path = _path(north, east, terrain, ends)
            g, h, nn, ne, ee = path[BY_NORTH], path[BY_EAST], path[HESSIAN], path[HESSIAN + 1], path[HESSIAN + 2]
            determinant = nn * ee - ne * ne
            is_last = number == NEWTON_STEPS
            if not (is_last or abs(determinant) > 1e-12):
                break
            step_north, step_east = (ne * h - ee * g) / determinant, (ne * g - nn * h) / determinant
            is_far = math.hypot(north + step_north - starts[n, 0], east + step_east - starts[n, 1]) > 2 * step
            is_early = number < NEWTON_STEPS // 2
            is_close = math.hypot(g, h) < 4 * step * max(abs(nn), abs(ne), abs(ee))
            if is_far and not (is_last or (is_early and is_close)):
                break
            size = math.hypot(step_north, step_east)
            scale = step / size if is_early and size > step else 1.0  # starts near a caustic need more than one step
            next_north, next_east = north + scale * step_north, east + scale * step_east
            # at a fixed point, further steps would not move it either
            if is_last or (not is_far and next_north == north and next_east == east):
                converged[n] = math.hypot(g, h) < 1e-7
                break
            north, east = next_north, next_east
            if is_near_any(north, east, found[:count], ROOT_NEIGHBOURHOOD * step):
                break
        if converged[n]:
            found[count, 0], found[count, 1], count = north, east, count + 1
        starts[n, 0], starts[n, 1] = north, east
    return starts[: keep_distinct(starts, converged, step / 20)]


@njit(cache=True, nogil=True, error_model="numpy")
def is_near_any(north: float, east: float, positions: Floats, distance: float) -> bool:
    """Return True if any of some positions (n, 2) [m] lies no farther than a distance [m] from a point."""
    near = False
    for k in range(positions.shape[0]):
        near |= math.hypot(north - positions[k, 0], east - positions[k, 1]) <= distance
    return near


@njit(cache=True, nogil=True, error_model="numpy")
def keep_distinct(positions: Floats, converged: NDArray[np.bool_], min_separation: float) -> int:
    """Move the converged positions to the front, without those that repeat an earlier one, and return their number.

    Args:
        positions: North, east [m], overwritten, (n, 2).
        converged: True for converged positions, (n,).
        min_separation: Distance below which two are the same [m].
    """
    count = 0
    for n in range(positions.shape[0]):
        if converged[n] and not is_near_any(positions[n, 0], positions[n, 1], positions[:count], min_separation):
            positions[count, 0], positions[count, 1], count = positions[n, 0], positions[n, 1], count + 1
    return count
