"""All rays of one path family from a source to points. Plain numbers and arrays only.

For each layer sequence of the family (`_layer_sequence_kernel`) its rays form ray branches (`_ray_branch_kernel`),
which are cut into segments of monotone distance: each segment holds one ray to a point or none, and none is missed.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._layer_sequence_kernel import (
    GRADIENT,
    HALF_TURNS,
    KAPPA,
    LAYER_SEQUENCE,
    LAYER_SEQUENCE_COLUMNS,
    NEAR,
    NODES,
    POINT,
    RAY_BRANCH_ROWS,
    SOURCE,
    SPEED,
    STRETCH,
    TURN_FAST,
    TURN_NODE,
    TURN_SLOW,
    WALL,
    build_nodes,
    count_passages,
    finish_layer_sequence,
    highest_speed,
    start_layer_sequence,
    turning_slabs,
)
from insonify.propagation._monotone_segment_kernel import GUESSES, MAX_RAYS, ROUNDING, branch_rays
from insonify.propagation._ray_branch_kernel import HORIZONTAL, ray_distance, ray_to_distance
from insonify.propagation._ray_properties_kernel import (
    AMPLITUDE,
    AT_BRANCH_END,
    AT_END,
    BLOCK,
    CAUSTICS,
    COLUMNS,
    DELAY,
    FOLD,
    FOLD_CURVATURE,
    FOLD_SIDE,
    GUESS,
    LENGTH,
    MAX_AMPLITUDE,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    SLOWNESS,
    SOLVED,
    TURNS,
    RaySolutions,
    complete_rays,
    empty_ray_block,
    newton_steps,
    write_ray_properties,
)
from insonify.propagation.families import Bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]
Integers = NDArray[Any]

__all__ = [
    "AMPLITUDE", "AT_END", "CAUSTICS", "COLUMNS", "DELAY", "FOLD", "FOLD_CURVATURE", "FOLD_SIDE", "LENGTH", "MAX_RAYS",
    "SIN_ARRIVAL", "SIN_LAUNCH", "SLOWNESS", "TURNS", "RaySolutions", "solve_eigenrays",
]  # fmt: skip

MOST_TURNS = 64
CLEAR, SHADOW, TURNED, BEYOND_CRITICAL = 0, 3, 4, 5  # the values of records.legs.LegStatus
MAX_PIECES = 62


@njit(cache=True, nogil=True, error_model="numpy")
def solve_eigenrays(
    water: SoundSpeedLayers, source_depth: float, bounces: Bounces, point_depth: Floats, ranges: Floats,
    solutions: RaySolutions,
) -> None:  # fmt: skip
    """All rays of one family to each point. Consecutive points of equal depth share work.

    Args:
        water: The water column.
        source_depth: Depth of the source [m], in the water.
        bounces: Bounces of the family.
        point_depth: Depths of the points [m], in the water, (n,).
        ranges: Horizontal distances of the points [m], 0 or more, (n,).
        solutions: Result: the rays to the n points.
    """
    depth, speed, plane = water
    rays, count, status = solutions
    ray_branch = np.zeros((RAY_BRANCH_ROWS, max(depth.size + 2, LAYER_SEQUENCE_COLUMNS)))
    slabs, edges = np.empty((2, 3, depth.size + 2)), np.empty((2, MAX_PIECES + 2))
    block, pick = empty_ray_block(), np.empty(BLOCK, np.int64)
    guesses = np.empty((3, GUESSES))
    workspace = (block, pick, guesses, edges)
    point_span = np.zeros(2, np.int64)
    out = (point_span, ranges, rays, count)
    count[:] = 0
    begin = 0
    while begin < ranges.size:
        end = begin + 1
        low = high = ranges[begin]
        while end < ranges.size and end - begin < BLOCK and point_depth[end] == point_depth[begin]:
            low, high = min(low, ranges[end]), max(high, ranges[end])
            end += 1
        build_nodes(depth, speed, plane, source_depth, point_depth[begin], ray_branch)
        point_span[0], point_span[1] = begin, end
        limit = direct_rays(ray_branch, bounces.number, bounces.first_up, workspace, out)
        farthest = limit
        if bounces.number == 0:
            farthest = ducted_rays(ray_branch, slabs, low, high, limit, workspace, out)
        elif bounces.number == 1:
            farthest = bounced_rays(ray_branch, bounces.first_up, slabs, low, high, limit, workspace, out)
        for i in range(begin, end):
            if count[i] > 0:
                status[i] = CLEAR
                if count[i] > 1:
                    sort_by_launch_angle(rays[i], count[i])
            elif ranges[i] <= farthest:
                status[i] = BEYOND_CRITICAL
            else:
                status[i] = TURNED if farthest == limit else SHADOW
        begin = end


@njit(cache=True, nogil=True, error_model="numpy")
def direct_rays(ray_branch: Floats, bounces: int, first_up: bool, workspace: Any, out: Any) -> float:
    """Rays that never turn: at most one to each point.

    Args:
        ray_branch: Nodes, see `_layer_sequence_kernel`; its layer sequence changes.
        bounces: Number of bounces.
        first_up: True if the first is off the surface.
        workspace: Work arrays for a block of rays, their points, guesses, and ends of segments.
        out: First and last + 1 of points at one depth; ranges, rays and their count of all, see `solve_eigenrays`.

    Returns:
        Greatest distance of such rays [m].
    """
    point_span, ranges, rays, count = out
    block, pick = workspace[0], workspace[1]
    s, r = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    wall = int(ray_branch[LAYER_SEQUENCE, WALL])
    if bounces and first_up == (bounces % 2 == 0) and r > wall:
        return 0.0  # rays that rise from the plane never get below it
    start_layer_sequence(ray_branch)
    at, up, first, last = s, first_up, min(s, r), max(s, r)
    for _ in range(bounces):
        at = count_passages(ray_branch, at, 0 if up else wall)
        first, last, up = min(first, at), max(last, at), not up
    count_passages(ray_branch, at, r)
    launch = -1.0 if (first_up if bounces else r < s) else 1.0
    arrival = launch if bounces % 2 == 0 else -launch
    if first == last:
        return horizontal_rays(ray_branch, s, out)
    finish_layer_sequence(ray_branch, first, last)
    limit = ray_distance(HORIZONTAL, ray_branch)[0]
    vertical_distance, slower = 0.0, 0.0
    for j in range(first, last):
        vertical_distance += 0.5 * ray_branch[STRETCH, j]
        slower += 0.25 * ray_branch[STRETCH, j] * (ray_branch[KAPPA, j] + ray_branch[KAPPA, j + 1])
    slower /= vertical_distance
    ray_count = 0
    for i in range(point_span[0], point_span[1]):
        if ranges[i] > limit * (1 + ROUNDING):
            continue
        ratio = vertical_distance / ranges[i]  # v in water of one speed
        block.distance[ray_count], block.state[ray_count] = ranges[i], GUESS
        block.v[ray_count] = math.sqrt(max(ratio * ratio - slower, 0.05 * ratio * ratio))
        if ranges[i] >= limit * (1 - ROUNDING):
            block.v[ray_count], block.state[ray_count] = HORIZONTAL, AT_BRANCH_END
        elif ratio > 1e9:
            block.v[ray_count], block.state[ray_count] = min(ratio, 1e300), SOLVED
        pick[ray_count] = i
        ray_count += 1
    newton_steps(ray_branch, block, ray_count, HORIZONTAL, math.inf, True)
    for i in range(ray_count):
        if block.state[i] == GUESS:
            block.v[i] = ray_to_distance(
                block.distance[i], HORIZONTAL, 2 * vertical_distance / block.distance[i], True, ray_branch
            )
    complete_rays(ray_branch, block, ray_count)
    for i in range(ray_count):
        k = pick[i]
        write_ray_properties(ray_branch, block, i, launch, arrival, 0, rays, k, count[k])
        count[k] += 1
    return limit


@njit(cache=True, nogil=True, error_model="numpy")
def horizontal_rays(ray_branch: Floats, s: int, out: Any) -> float:
    """Straight rays along the source's own depth, in a layer of constant sound speed.

    Args:
        ray_branch: Nodes.
        s: Node of the source, and of the points.
        out: See `direct_rays`.

    Returns:
        Greatest distance of such rays [m].
    """
    point_span, ranges, rays, count = out
    nodes, c = int(ray_branch[LAYER_SEQUENCE, NODES]), ray_branch[SPEED, s]
    above = s > 0 and ray_branch[GRADIENT, s - 1] == 0
    below = s + 1 < nodes and ray_branch[GRADIENT, s] == 0
    inside = (above or s == 0) and (below or s + 1 == nodes)
    for i in range(point_span[0], point_span[1]):
        if not (above or below) and ranges[i] > 0:
            continue
        row = rays[i, count[i]]
        row[:] = 0.0
        row[DELAY], row[SLOWNESS], row[LENGTH] = ranges[i] / c, 1 / c, ranges[i]
        row[AMPLITUDE] = min(MAX_AMPLITUDE, 1 / ranges[i]) if ranges[i] > 0 else MAX_AMPLITUDE
        row[AT_END] = 0.0 if inside else 1.0
        row[FOLD], row[FOLD_CURVATURE] = math.inf, 1.0
        count[i] += 1
    return math.inf if above or below else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def ducted_rays(
    ray_branch: Floats, slabs: Floats, low: float, high: float, limit: float, workspace: Any, out: Any
) -> float:  # fmt: skip
    """Rays that turn without reaching a boundary, those with the fewest turns first.

    Args:
        ray_branch: Nodes; its layer sequence changes.
        slabs: Work array for turning slabs, above and below, (2, 3, nodes).
        low: Distance of the nearest point [m].
        high: Distance of the farthest point [m].
        limit: Greatest distance of rays without turns [m].
        workspace: See `direct_rays`.
        out: See `direct_rays`.

    Returns:
        Greatest distance of rays of the family [m], unless more turns than needed here occur.
    """
    s, r = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    nodes = int(ray_branch[LAYER_SEQUENCE, NODES])
    so_far = highest_speed(ray_branch, min(s, r), max(s, r))
    above = turning_slabs(ray_branch, min(s, r), 0, so_far, slabs[0])
    below = turning_slabs(ray_branch, max(s, r), nodes - 1, so_far, slabs[1])
    farthest = limit
    for turns in range(1, MOST_TURNS + 1):
        nearest = math.inf
        for first in range(2):  # the side of the first turn: 0 above, 1 below
            turns_above = (turns + 1 - first) // 2
            for i in range(above if turns_above > 0 else 1):
                for k in range(below if turns > turns_above else 1):
                    fast = ducted_layer_sequence(ray_branch, s, r, turns, first, i, k, so_far, slabs)
                    if fast > 0:
                        launch = -1.0 if first == 0 else 1.0
                        arrival = launch if turns % 2 == 0 else -launch
                        shortest, longest = branch_rays(ray_branch, fast, launch, arrival, low, high, workspace, out)
                        nearest, farthest = min(nearest, shortest), max(farthest, longest)
        if nearest > high or is_full(out):
            break
    return farthest


@njit(cache=True, nogil=True, error_model="numpy")
def is_full(out: Any) -> bool:
    """Return True if no point can take another ray; `out` as in `direct_rays`."""
    point_span, _, _, count = out
    fewest = MAX_RAYS
    for i in range(point_span[0], point_span[1]):
        fewest = min(fewest, count[i])
    return fewest >= MAX_RAYS


@njit(cache=True, nogil=True, error_model="numpy")
def ducted_layer_sequence(
    ray_branch: Floats, s: int, r: int, turns: int, first: int, i: int, k: int, so_far: float, slabs: Floats
) -> float:
    """Set the layer sequence of rays with a given number of turns.

    Args:
        ray_branch: Nodes; its layer sequence changes.
        s: Node of the source.
        r: Node of the point.
        turns: Number of turns.
        first: Side of the first turn: 0 above, 1 below.
        i: Index of the turning slab above.
        k: Index of the turning slab below.
        so_far: Highest speed between source and point [m/s].
        slabs: Turning slabs, above and below.

    Returns:
        Highest turning speed of the ray branch [m/s]; 0 if there is none, with the layer sequence unchanged.
    """
    half_turns = (2 * ((turns + 1 - first) // 2), 2 * ((turns + first) // 2))
    slow, fast = so_far, math.inf
    upper, lower = min(s, r), max(s, r)
    if half_turns[0] > 0:
        upper = int(slabs[0, TURN_NODE, i])
        slow, fast = max(slow, slabs[0, TURN_SLOW, i]), slabs[0, TURN_FAST, i]
    if half_turns[1] > 0:
        lower = int(slabs[1, TURN_NODE, k])
        slow, fast = max(slow, slabs[1, TURN_SLOW, k]), min(fast, slabs[1, TURN_FAST, k])
    if slow >= fast:
        return 0.0
    start_layer_sequence(ray_branch)
    ray_branch[LAYER_SEQUENCE, HALF_TURNS], ray_branch[LAYER_SEQUENCE, HALF_TURNS + 1] = half_turns[0], half_turns[1]
    ray_branch[LAYER_SEQUENCE, NEAR], ray_branch[LAYER_SEQUENCE, NEAR + 1] = upper, lower
    at, side = s, first
    for _ in range(turns):
        at = count_passages(ray_branch, at, upper if side == 0 else lower)
        side = 1 - side
    count_passages(ray_branch, at, r)
    finish_layer_sequence(ray_branch, upper, lower)
    return fast


@njit(cache=True, nogil=True, error_model="numpy")
def bounced_rays(
    ray_branch: Floats, first_up: bool, slabs: Floats, low: float, high: float, limit: float, workspace: Any, out: Any
) -> float:
    """Rays with one bounce that turn before it, after it, or both: away from the boundary and back.

    Args:
        ray_branch: Nodes; its layer sequence changes.
        first_up: True if the bounce is off the surface.
        slabs: See `ducted_rays`.
        low: See `ducted_rays`.
        high: See `ducted_rays`.
        limit: See `ducted_rays`.
        workspace: See `direct_rays`.
        out: See `direct_rays`.

    Returns:
        Greatest distance of rays of the family [m].
    """
    s, r = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    nodes = int(ray_branch[LAYER_SEQUENCE, NODES])
    floor = int(ray_branch[LAYER_SEQUENCE, WALL])
    if not first_up and r > floor:
        return limit
    side, wall, stop = (1, 0, nodes - 1) if first_up else (0, floor, 0)  # side of the turns
    start = max(s, r) if first_up else min(s, r)
    so_far = highest_speed(ray_branch, min(wall, start), max(wall, start))
    slab_count = turning_slabs(ray_branch, start, stop, so_far, slabs[side])
    away = 1.0 if first_up else -1.0  # from the wall
    farthest = limit
    for turn_sides in range(1, 4):
        before, after = turn_sides != 2, turn_sides != 1
        for k in range(slab_count):
            near_node = int(slabs[side, TURN_NODE, k])
            start_layer_sequence(ray_branch)
            at = s
            if before:
                at = count_passages(ray_branch, at, near_node)
            at = count_passages(ray_branch, at, wall)
            if after:
                at = count_passages(ray_branch, at, near_node)
            count_passages(ray_branch, at, r)
            ray_branch[LAYER_SEQUENCE, NEAR + side], ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] = (
                near_node, (4 if turn_sides == 3 else 2),
            )  # fmt: skip
            finish_layer_sequence(ray_branch, min(wall, near_node), max(wall, near_node))
            launch, arrival = (away if before else -away), (-away if after else away)
            fast = slabs[side, TURN_FAST, k]
            farthest = max(farthest, branch_rays(ray_branch, fast, launch, arrival, low, high, workspace, out)[1])
    return farthest


@njit(cache=True, nogil=True, error_model="numpy")
def sort_by_launch_angle(rows: Floats, count: int) -> None:
    """Sort the first rows by launch angle, upward first."""
    for k in range(1, count):
        j = k
        while j > 0 and rows[j, SIN_LAUNCH] < rows[j - 1, SIN_LAUNCH]:
            for column in range(COLUMNS):
                rows[j, column], rows[j - 1, column] = rows[j - 1, column], rows[j, column]
            j -= 1
