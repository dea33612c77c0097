"""Rays of one ray branch with turns, to many points of one depth. Plain numbers and arrays only.

Rays of a branch have the parameter v, the tangent of the grazing angle at the fastest node that they visit, see
`_ray_branch_kernel`. A branch is cut into segments in which distance is a monotone function of v; in each, a point has
one ray or none. Distance is horizontal.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._layer_sequence_kernel import HALF_TURNS, LAYER_SEQUENCE, TOP
from insonify.propagation._ray_branch_kernel import (
    EDGE,
    HORIZONTAL,
    IS_FOLD,
    curvature_at_fold,
    monotone_segments,
    ray_distance,
    ray_to_distance,
)
from insonify.propagation._ray_properties_kernel import (
    AT_BRANCH_END,
    AT_END,
    DELAY,
    FOLD,
    FOLD_CURVATURE,
    FOLD_SIDE,
    GUESS,
    SIN_LAUNCH,
    SLOWNESS,
    RayBlock,
    complete_rays,
    newton_steps,
    write_ray_properties,
)

Floats = NDArray[np.float64]

MAX_RAYS = 8  # largest number of rays of one family to one point; those with the fewest turns are kept
GUESSES = 17  # rays of a segment between which v is interpolated; fewer points are solved one by one
ROUNDING = 2e-13  # relative tolerance of a distance at the ends of a segment


@njit(cache=True, nogil=True, error_model="numpy")
def branch_rays(
    ray_branch: Floats, max_turning_speed: float, launch_sign: float, arrival_sign: float, low: float, high: float,
    workspace: Any, result: Any,
) -> tuple[float, float]:  # fmt: skip
    """Write the rays of a ray branch with turns to points of one depth.

    Args:
        ray_branch: The ray branch, see `_layer_sequence_kernel`.
        max_turning_speed: Highest turning speed of the branch [m/s]; the lowest is the speed at its fastest node.
        launch_sign: Sign of the launch angle, +1 down.
        arrival_sign: Sign of the angle of travel at the point, +1 down.
        low: Distance of the nearest point [m].
        high: Distance of the farthest point [m].
        workspace: Block of rays, index of the point of each, guesses (3, GUESSES), and edges of segments (2, m).
        result: First and last + 1 of the points of that depth (2,); distance [m] (n,), rays (n, MAX_RAYS, COLUMNS) and
            number of rays (n,) of all points, the last two changed.

    Returns:
        Least and greatest distance that a ray of the branch reaches [m].
    """
    edges, min_turning_speed = workspace[3], ray_branch[LAYER_SEQUENCE, TOP]
    excess, total = max_turning_speed - min_turning_speed, max_turning_speed + min_turning_speed
    max_v = math.sqrt(excess / min_turning_speed * (total / min_turning_speed))
    segment_count = monotone_segments(max_v, high, ray_branch, edges)
    x_left = ray_distance(HORIZONTAL, ray_branch)[0]
    x_max_v = ray_distance(max_v, ray_branch)[0]
    shortest, longest = min(x_left, x_max_v), max(x_left, x_max_v)
    for segment in range(segment_count):
        x_right = ray_distance(edges[EDGE, segment + 1], ray_branch)[0]
        if min(x_left, x_right) <= high * (1 + ROUNDING) and max(x_left, x_right) >= low * (1 - ROUNDING):
            segment_rays(ray_branch, segment, x_left, x_right, launch_sign, arrival_sign, workspace, result)
        shortest, longest = min(shortest, x_right), max(longest, x_right)
        x_left = x_right
    return shortest, longest


@njit(cache=True, nogil=True, error_model="numpy")
def segment_rays(
    ray_branch: Floats, segment: int, x_left: float, x_right: float, launch_sign: float, arrival_sign: float,
    workspace: Any, result: Any,
) -> None:  # fmt: skip
    """Write the rays of one monotone segment of a ray branch to points of one depth.

    Args:
        ray_branch: The ray branch.
        segment: Index of the segment.
        x_left: Distance at its least v [m].
        x_right: Distance at its greatest v [m].
        launch_sign: See `branch_rays`.
        arrival_sign: See `branch_rays`.
        workspace: See `branch_rays`.
        result: See `branch_rays`.
    """
    point_span, ranges, rays, count = result
    block, point_index, guesses, edges = workspace
    a, b, is_falling = edges[EDGE, segment], edges[EDGE, segment + 1], x_right < x_left
    nearest, farthest = min(x_left, x_right), max(x_left, x_right)
    ray_count = 0
    for i in range(point_span[0], point_span[1]):
        distance, tolerance = ranges[i], ROUNDING * (ranges[i] + 1)
        if distance < nearest - tolerance or distance > farthest + tolerance or count[i] >= MAX_RAYS:
            continue
        is_nearest, is_farthest = distance <= nearest + tolerance, distance >= farthest - tolerance
        block.distance[ray_count], block.state[ray_count] = (
            distance,
            (AT_BRANCH_END if is_nearest or is_farthest else GUESS),
        )
        block.v[ray_count] = b if is_nearest == is_falling else a
        point_index[ray_count] = i
        ray_count += 1
    if ray_count == 0:
        return
    if ray_count >= GUESSES:
        initial_guesses(ray_branch, block, ray_count, a, b, is_falling, guesses)
        newton_steps(ray_branch, block, ray_count, a, b, False)
    for i in range(ray_count):
        if block.state[i] == GUESS:
            block.v[i] = ray_to_distance(block.distance[i], a, b, is_falling, ray_branch)
    complete_rays(ray_branch, block, ray_count)
    turns = int(ray_branch[LAYER_SEQUENCE, HALF_TURNS] + ray_branch[LAYER_SEQUENCE, HALF_TURNS + 1]) // 2
    for i in range(ray_count):
        k = point_index[i]
        write_ray_properties(ray_branch, block, i, launch_sign, arrival_sign, turns, rays, k, count[k])
        for edge in range(segment, segment + 2):
            if edges[IS_FOLD, edge] > 0:
                record_fold(rays[k, count[k]], block.distance[i], edges[EDGE, edge], block.derivative[i], ray_branch)
        if not (rays[k, count[k], AT_END] == 1 and is_duplicate_ray(rays[k], count[k])):
            count[k] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def initial_guesses(
    ray_branch: Floats, block: RayBlock, point_count: int, a: float, b: float, is_falling: bool, guesses: Floats
) -> None:
    """Initial guesses of v for many points from a few rays of a segment, by Hermite cubics of v over distance.

    Args:
        ray_branch: The ray branch.
        block: The rays to the points; `v` changes where `state` is `GUESS`.
        point_count: Number of points.
        a: Least v of the segment.
        b: Greatest v of the segment.
        is_falling: True if distance falls with v.
        guesses: Work array: distance X [m], v [1] and dv/dX [1/m] of each ray, (3, GUESSES).
    """
    for k in range(GUESSES):
        fraction = k / (GUESSES - 1.0)
        fraction = fraction * fraction * (3 - 2 * fraction)  # closer at both ends, where a fold may be
        v = max(a, b + (a - b) * fraction if is_falling else a + (b - a) * fraction)
        x, dx_dv = ray_distance(v, ray_branch)
        guesses[0, k], guesses[1, k], guesses[2, k] = x, v, 1 / dx_dv
    for i in range(point_count):
        if block.state[i] != GUESS:
            continue
        distance = block.distance[i]
        lower, upper = 0, GUESSES - 1
        while upper - lower > 1:
            middle = (lower + upper) // 2
            if guesses[0, middle] <= distance:
                lower = middle
            else:
                upper = middle
        width, v0, v1 = guesses[0, upper] - guesses[0, lower], guesses[1, lower], guesses[1, upper]
        t = (distance - guesses[0, lower]) / width
        u = 1 - t
        v = v0 * u * u * (1 + 2 * t) + v1 * t * t * (1 + 2 * u)
        v += width * t * u * (guesses[2, lower] * u - guesses[2, upper] * t)
        is_inside = min(v0, v1) <= v <= max(v0, v1)
        block.v[i] = v if is_inside else v0 + (v1 - v0) * t


@njit(cache=True, nogil=True, error_model="numpy")
def record_fold(row: Floats, distance: float, v: float, dx_dp: float, ray_branch: Floats) -> None:
    """Record a fold at an end of a ray's segment, if its caustic is nearer than that of the one recorded before.

    Distances from caustics are compared as arguments of the Airy function, proportional to FOLD / FOLD_CURVATURE^(1/3).

    Args:
        row: Columns of the ray, see `_ray_properties_kernel`; changed.
        distance: Horizontal distance of its point [m].
        v: Parameter v of the fold.
        dx_dp: Derivative of the ray's horizontal distance by its horizontal slowness [m^2/s].
        ray_branch: The ray branch.
    """
    offset = distance - ray_distance(v, ray_branch)[0]
    curvature = abs(curvature_at_fold(v, ray_branch))
    if abs(offset) ** 3 * row[FOLD_CURVATURE] < abs(row[FOLD]) ** 3 * curvature:
        row[FOLD], row[FOLD_CURVATURE] = offset, curvature
        row[FOLD_SIDE] = 1.0 if dx_dp > 0 else -1.0


@njit(cache=True, nogil=True, error_model="numpy")
def is_duplicate_ray(rows: Floats, count: int) -> bool:
    """Return True if the ray in row `count`, at the join of two branches, is already among the rows before it."""
    for k in range(count):
        if (
            rows[k, AT_END] == 1
            and abs(rows[k, SIN_LAUNCH] - rows[count, SIN_LAUNCH]) < 1e-5
            and abs(rows[k, SLOWNESS] - rows[count, SLOWNESS]) < 1e-10 * rows[count, SLOWNESS]
            and abs(rows[k, DELAY] - rows[count, DELAY]) < 1e-12 * (1 + rows[count, DELAY])
        ):
            return True
    return False
