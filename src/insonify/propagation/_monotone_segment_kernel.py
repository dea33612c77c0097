"""Rays of one ray branch with turns, to many points of one depth. Plain numbers and arrays only.

A ray branch is cut into segments of monotone distance; on each, a point has one ray or none.
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

MAX_RAYS = 8  # rays of one family to one point; those with the fewest turns are kept
GUESSES = 17  # rays of a segment from which those to many points are interpolated
ROUNDING = 2e-13  # of a distance, at the end of a branch


@njit(cache=True, nogil=True, error_model="numpy")
def branch_rays(
    ray_branch: Floats, max_turning_speed: float, launch_sign: float, arrival_sign: float, low: float, high: float,
    workspace: Any, result: Any,
) -> tuple[float, float]:  # fmt: skip
    """Rays of a ray branch with turns, to points of one depth.

    Args:
        ray_branch: The ray branch.
        max_turning_speed: Highest turning speed [m/s].
        launch_sign: Sign of the launch angle, + down.
        arrival_sign: Sign of the angle of arrival.
        low: Distance of the nearest point [m].
        high: Distance of the farthest point [m].
        workspace: See `direct_rays`.
        result: See `direct_rays`.

    Returns:
        Bounds of the ray branch's distances [m].
    """
    edges, slow = workspace[3], ray_branch[LAYER_SEQUENCE, TOP]
    end = math.sqrt((max_turning_speed - slow) / slow * ((max_turning_speed + slow) / slow))
    segment_count = monotone_segments(end, high, ray_branch, edges)
    x_left = ray_distance(HORIZONTAL, ray_branch)[0]
    x_end = ray_distance(end, ray_branch)[0]
    shortest, longest = min(x_left, x_end), max(x_left, x_end)
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
    """Rays of one monotone segment of a ray branch.

    Args:
        ray_branch: The ray branch.
        segment: Index of the segment.
        x_left: Distance at its lower end [m].
        x_right: Distance at its upper end [m].
        launch_sign: See `branch_rays`.
        arrival_sign: See `branch_rays`.
        workspace: See `direct_rays`.
        result: See `direct_rays`.
    """
    point_span, ranges, rays, count = result
    block, point_index, guesses, edges = workspace
    a, b, falls = edges[EDGE, segment], edges[EDGE, segment + 1], x_right < x_left
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
        block.v[ray_count] = b if is_nearest == falls else a
        point_index[ray_count] = i
        ray_count += 1
    if ray_count == 0:
        return
    if ray_count >= GUESSES:
        initial_guesses(ray_branch, block, ray_count, a, b, falls, guesses)
        newton_steps(ray_branch, block, ray_count, a, b, False)
    for i in range(ray_count):
        if block.state[i] == GUESS:
            block.v[i] = ray_to_distance(block.distance[i], a, b, falls, ray_branch)
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
    ray_branch: Floats, block: RayBlock, point_count: int, a: float, b: float, falls: bool, guesses: Floats
) -> None:
    """Guesses v for many points from a few rays of a segment, by Hermite cubics of v over distance.

    Args:
        ray_branch: The ray branch.
        block: The rays; `v` changes where it is a guess.
        point_count: Number of points.
        a: Least v.
        b: Greatest v.
        falls: True if distance falls with v.
        guesses: Work array, (3, GUESSES).
    """
    for k in range(GUESSES):
        part = k / (GUESSES - 1.0)
        part = part * part * (3 - 2 * part)  # closer at both ends, where a fold may be
        v = max(a, b + (a - b) * part if falls else a + (b - a) * part)
        x, slope = ray_distance(v, ray_branch)
        guesses[0, k], guesses[1, k], guesses[2, k] = x, v, 1 / slope
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
        inside = min(v0, v1) <= v <= max(v0, v1)
        block.v[i] = v if inside else v0 + (v1 - v0) * t


@njit(cache=True, nogil=True, error_model="numpy")
def record_fold(row: Floats, distance: float, v: float, ray_tube: float, ray_branch: Floats) -> None:
    """Record a fold that bounds the ray's branch, if it is nearer than the one recorded before.

    Distance in the scale of diffraction: FOLD / FOLD_CURVATURE^(1/3).

    Args:
        row: The ray, changed.
        distance: Distance of its point [m].
        v: Parameter of the fold.
        ray_tube: dX/dp of the ray [m^2/s].
        ray_branch: The ray branch.
    """
    offset = distance - ray_distance(v, ray_branch)[0]
    bend = abs(curvature_at_fold(v, ray_branch))
    if abs(offset) ** 3 * row[FOLD_CURVATURE] < abs(row[FOLD]) ** 3 * bend:
        row[FOLD], row[FOLD_CURVATURE] = offset, bend
        row[FOLD_SIDE] = 1.0 if ray_tube > 0 else -1.0


@njit(cache=True, nogil=True, error_model="numpy")
def is_duplicate_ray(rows: Floats, count: int) -> bool:
    """Return True if the ray in row `count` joins two branches and is already listed by the other one."""
    for k in range(count):
        if (
            rows[k, AT_END] == 1
            and abs(rows[k, SIN_LAUNCH] - rows[count, SIN_LAUNCH]) < 1e-5
            and abs(rows[k, SLOWNESS] - rows[count, SLOWNESS]) < 1e-10 * rows[count, SLOWNESS]
            and abs(rows[k, DELAY] - rows[count, DELAY]) < 1e-12 * (1 + rows[count, DELAY])
        ):
            return True
    return False
