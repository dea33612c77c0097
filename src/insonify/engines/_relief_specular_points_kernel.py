"""Kernels of the path from one position to another by a point of the terrain: its length and derivatives.

Lengths in layered water are travel times times the speed at the surface. The terrain is a uniform cubic spline.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
"""Columns of `bottom_paths` [1]."""
LENGTH, NORTH, EAST = 0, 1, 2
"""Columns of the path length [m] and of its derivatives by north and by east [1]."""
CURVATURE, PLANE_CURVATURE = 3, 6
"""First columns of the second derivatives by north twice, both, and east twice [1/m]: of the path by the terrain, and
of that by its tangent plane."""
GRAZING_SINE, DEPTH, SECANT = 9, 10, 11
"""Columns of the sine of the grazing angle [1], the depth [m] and the secant of the terrain's slope [1]."""
NEWTON_STEPS = 8
"""Steps towards a stationary point [1]."""


class TerrainSpline(NamedTuple):
    """Depth of a square of the terrain as a cubic spline over a lattice."""

    coefficients: Floats
    """Coefficients of the nodes [m], (a, b)."""
    north: float
    """North of the first node [m]."""
    east: float
    """East of the first node [m]."""
    step: float
    """Distance of the nodes [m]."""


class PathEnds(NamedTuple):
    """Ends of paths by the terrain, or their images, and the water between."""

    begin: Floats
    """North, east, depth [m], (3,)."""
    stop: Floats
    """North, east, depth [m], (3,)."""
    water: SurfaceWater
    """The water; without knots, of one sound speed."""


@njit(cache=True, nogil=True, error_model="numpy")
def _weights(t: float) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Weights of four nodes at a fraction t from the second to the third; their first and second derivatives [1]."""
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
    a = min(max(math.floor(x), 1), coefficients.shape[0] - 3)
    b = min(max(math.floor(y), 1), coefficients.shape[1] - 3)
    along, along1, along2 = _weights(x - a)
    across, across1, across2 = _weights(y - b)
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


@njit(cache=True, nogil=True, error_model="numpy")
def _path_gradient(
    north: float, east: float, depth: float, end: Floats, water: SurfaceWater
) -> tuple[float, float, float, float, float, float]:
    """Gradient of the length from an end to a point below it [1], slopes of the distance [1/m], and the length [m].

    The slopes are those of the horizontal part of the gradient across and along the path.
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
    return (p * ray_north, p * ray_east, q, reference / ray.distance, reference / ray.growth, reference * time)


@njit(cache=True, nogil=True, error_model="numpy")
def _second_derivatives(
    gradient: tuple[float, float, float, float, float, float], depth: float, water: SurfaceWater
) -> tuple[float, float, float, float, float, float]:
    """Second derivatives of the length of `_path_gradient` by north, east and depth: nn, ne, ee, nd, ed, dd [1/m]."""
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


@njit(cache=True, nogil=True, error_model="numpy")
def _path(north: float, east: float, terrain: TerrainSpline, ends: PathEnds, row: Floats) -> None:
    """Write the columns of the path by one point, (COLUMNS,)."""
    depth, north1, east1, north2, both, east2 = depth_derivatives(north, east, terrain)
    row[:] = 0.0
    total_north = total_east = down = 0.0
    for end in (ends.begin, ends.stop):
        gradient = _path_gradient(north, east, depth, end, ends.water)
        nn, ne, ee, nd, ed, dd = _second_derivatives(gradient, depth, ends.water)
        row[LENGTH] += gradient[5]
        total_north += gradient[0]
        total_east += gradient[1]
        down += gradient[2]
        row[PLANE_CURVATURE] += nn + 2 * nd * north1 + dd * north1 * north1
        row[PLANE_CURVATURE + 1] += ne + nd * east1 + ed * north1 + dd * north1 * east1
        row[PLANE_CURVATURE + 2] += ee + 2 * ed * east1 + dd * east1 * east1
    row[NORTH], row[EAST] = total_north + down * north1, total_east + down * east1
    row[CURVATURE] = row[PLANE_CURVATURE] + down * north2
    row[CURVATURE + 1] = row[PLANE_CURVATURE + 1] + down * both
    row[CURVATURE + 2] = row[PLANE_CURVATURE + 2] + down * east2
    secant = math.sqrt(1 + north1 * north1 + east1 * east1)
    row[GRAZING_SINE] = abs(down - total_north * north1 - total_east * east1) / (2 * secant)
    row[DEPTH], row[SECANT] = depth, secant


@njit(cache=True, nogil=True, error_model="numpy")
def bottom_paths(positions: Floats, terrain: TerrainSpline, ends: PathEnds, rows: Floats) -> None:
    """Paths between two ends by n points of the terrain.

    Args:
        positions: North, east [m], (n, 2).
        terrain: Depth of the terrain.
        ends: Ends of the paths.
        rows: Result: the columns from `LENGTH` to `SECANT`, (n, COLUMNS).
    """
    for n in range(positions.shape[0]):
        _path(positions[n, 0], positions[n, 1], terrain, ends, rows[n])


@njit(cache=True, nogil=True, error_model="numpy")
def gradients_at_nodes(depth: Floats, margin: int, terrain: TerrainSpline, ends: PathEnds, gradient: Floats) -> None:
    """Gradient of the length of the path between two ends by each node of the terrain's lattice.

    Args:
        depth: Depth of the nodes [m], (a, b).
        margin: Nodes left out along each edge, at least 1.
        terrain: Depth of the terrain.
        ends: Ends of the paths.
        gradient: Result: derivative by north and by east [1], (2, a - 2 margin, b - 2 margin).
    """
    is_homogeneous = ends.water.depth.size == 0
    path_gradient = np.zeros((3, gradient.shape[2]))
    for i in range(gradient.shape[1]):
        a, path_gradient[:] = i + margin, 0
        row, north = depth[a, margin : margin + gradient.shape[2]], terrain.north + a * terrain.step
        first_east = terrain.east + margin * terrain.step
        for end in (ends.begin, ends.stop):
            if is_homogeneous:
                _add_straight_gradients(row, north, first_east, terrain.step, end, path_gradient)
                continue
            for j in range(row.size):
                one = _path_gradient(north, first_east + j * terrain.step, row[j], end, ends.water)
                for k in range(3):
                    path_gradient[k, j] += one[k]
        _add_slopes(terrain, a, margin, path_gradient, gradient[0, i], gradient[1, i])


@njit(cache=True, nogil=True, error_model="numpy")
def _add_straight_gradients(
    depth: Floats, north: float, first_east: float, step: float, end: Floats, path_gradient: Floats
) -> None:
    """Add the gradients of straight paths from an end to a row of nodes, by north, east and depth [1], (3, n)."""
    by_north, by_east, by_depth = path_gradient[0], path_gradient[1], path_gradient[2]
    x, first, down = north - end[0], first_east - end[1], end[2]
    for j in range(depth.size):
        y, z = first + j * step, depth[j] - down
        per_length = 1 / math.sqrt(x * x + y * y + z * z)
        by_north[j] += x * per_length
        by_east[j] += y * per_length
        by_depth[j] += z * per_length


@njit(cache=True, nogil=True, error_model="numpy")
def _add_slopes(
    terrain: TerrainSpline, row: int, margin: int, path_gradient: Floats, by_north: Floats, by_east: Floats
) -> None:
    """Write the gradient over the ground at a row of its nodes: horizontal, and vertical times the slopes [1], (n,)."""
    half, before = 1 / (12 * terrain.step), margin - 1
    low, same, high = terrain.coefficients[row - 1], terrain.coefficients[row], terrain.coefficients[row + 1]
    low, same, high = low[before:], same[before:], high[before:]
    for j in range(by_north.size):
        north1 = (high[j] - low[j] + high[j + 2] - low[j + 2] + 4 * (high[j + 1] - low[j + 1])) * half
        east1 = (low[j + 2] - low[j] + high[j + 2] - high[j] + 4 * (same[j + 2] - same[j])) * half
        by_north[j] = path_gradient[0, j] + path_gradient[2, j] * north1
        by_east[j] = path_gradient[1, j] + path_gradient[2, j] * east1


@njit(cache=True, nogil=True, error_model="numpy")
def changes_sign(gradient: Floats, reach: int, result: NDArray[np.bool_]) -> None:
    """Mark nodes about which both components of a gradient pass through zero.

    The range of either component over the nodes at most `reach` away is widened by a quarter on both sides, for a root
    between nodes of one sign. Unknown components are left out.

    Args:
        gradient: Both components [1], (2, a, b).
        reach: Nodes to either side.
        result: Filled, (a, b).
    """
    _, rows, columns = gradient.shape
    low_columns, high_columns = np.empty((rows, columns)), np.empty((rows, columns))
    low, high = np.empty(columns), np.empty(columns)
    result[:] = True
    for axis in range(2):
        for i in range(rows):
            _range_along_row(gradient[axis, i], reach, low_columns[i], high_columns[i])
        for i in range(rows):
            low[:], high[:] = math.inf, -math.inf
            for a in range(max(i - reach, 0), min(i + reach + 1, rows)):
                _widen_range(low_columns[a], high_columns[a], low, high)
            is_marked = result[i]
            for j in range(columns):
                is_marked[j] &= (1.25 * low[j] <= 0.25 * high[j]) & (0.25 * low[j] <= 1.25 * high[j])


@njit(cache=True, nogil=True, error_model="numpy")
def _range_along_row(values: Floats, reach: int, low: Floats, high: Floats) -> None:
    """Least and greatest of the known values at most `reach` away along a row, shape (n,)."""
    low[:], high[:] = math.inf, -math.inf
    for shift in range(min(reach + 1, values.size)):
        count = values.size - shift
        _widen_range(values[shift:], values[shift:], low[:count], high[:count])
        _widen_range(values[:count], values[:count], low[shift:], high[shift:])


@njit(cache=True, nogil=True, error_model="numpy")
def _widen_range(new_low: Floats, new_high: Floats, low: Floats, high: Floats) -> None:
    """Widen ranges by others; bounds that are not numbers change nothing."""
    for j in range(low.size):
        low[j] = new_low[j] if new_low[j] < low[j] else low[j]
        high[j] = new_high[j] if new_high[j] > high[j] else high[j]


@njit(cache=True, nogil=True, error_model="numpy")
def stationary_points(starts: Floats, terrain: TerrainSpline, ends: PathEnds, converged: NDArray[np.bool_]) -> None:
    """Move starts to stationary points of the path length by Newton's method.

    Args:
        starts: North, east [m], replaced, (n, 2).
        terrain: Depth of the terrain; the starts are a step apart.
        ends: Ends of the paths.
        converged: Filled: True where a stationary point is found, (n,).
    """
    row, step = np.empty(COLUMNS), terrain.step
    for n in range(starts.shape[0]):
        north, east = starts[n, 0], starts[n, 1]
        converged[n] = True
        for number in range(NEWTON_STEPS):
            _path(north, east, terrain, ends, row)
            g, h = row[NORTH], row[EAST]
            nn, ne, ee = row[CURVATURE], row[CURVATURE + 1], row[CURVATURE + 2]
            determinant = nn * ee - ne * ne
            if not abs(determinant) > 1e-12:
                converged[n] = False
                break
            move, aside = (ne * h - ee * g) / determinant, (ne * g - nn * h) / determinant
            strayed = math.hypot(north + move - starts[n, 0], east + aside - starts[n, 1]) > 2 * step
            early = number < NEWTON_STEPS // 2
            is_close = math.hypot(g, h) < 4 * step * max(abs(nn), abs(ne), abs(ee))
            if strayed and not (early and is_close):
                converged[n] = False
                break
            size = math.hypot(move, aside)
            part = step / size if early and size > step else 1.0  # starts beside a caustic need more than one step
            north, east = north + part * move, east + part * aside
        if converged[n]:
            _path(north, east, terrain, ends, row)
            converged[n] = math.hypot(row[NORTH], row[EAST]) < 1e-7
        starts[n, 0], starts[n, 1] = north, east


@njit(cache=True, nogil=True, error_model="numpy")
def keep_distinct(positions: Floats, converged: NDArray[np.bool_], min_separation: float) -> int:
    """Move the positions that have converged to the front, without those that repeat an earlier one; their number.

    Args:
        positions: North, east [m], replaced, (n, 2).
        converged: True for those that are kept, (n,).
        min_separation: Distance below which two are the same [m].
    """
    count = 0
    for n in range(positions.shape[0]):
        is_new = converged[n]
        for k in range(count):
            is_new &= math.hypot(positions[n, 0] - positions[k, 0], positions[n, 1] - positions[k, 1]) > min_separation
        if is_new:
            positions[count, 0], positions[count, 1], count = positions[n, 0], positions[n, 1], count + 1
    return count
