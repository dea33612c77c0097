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
    BOTTOM,
    ENTRY,
    GRADIENT,
    HALF_TURNS,
    KAPPA,
    LAYER_SEQUENCE,
    LAYER_SEQUENCE_COLUMNS,
    NODES,
    POINT,
    RAY_BRANCH_ROWS,
    SOURCE,
    SPEED,
    STRETCH,
    TURN_FAST,
    TURN_NODE,
    TURN_SLOW,
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

MAX_TURNS = 64  # largest number of turns of a ducted ray
CLEAR, SHADOW, TURNED, BEYOND_CRITICAL = 0, 3, 4, 5  # the values of records.legs.LegStatus
MAX_SEGMENTS = 62  # largest number of monotone segments of a ray branch


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
        solutions: Result: the rays to the n points, those with the fewest turns.
    """
    depth, speed, plane = water
    rays, count, status = solutions
    ray_branch = np.zeros((RAY_BRANCH_ROWS, max(depth.size + 2, LAYER_SEQUENCE_COLUMNS)))
    slabs, edges = np.empty((2, 3, depth.size + 2)), np.empty((2, MAX_SEGMENTS + 2))
    block, point_index = empty_ray_block(), np.empty(BLOCK, np.int64)
    guesses = np.empty((3, GUESSES))
    workspace = (block, point_index, guesses, edges)
    point_span = np.zeros(2, np.int64)
    result = (point_span, ranges, rays, count)
    count[:] = 0
    start = 0
    while start < ranges.size:
        stop = start + 1
        low = high = ranges[start]
        while stop < ranges.size and stop - start < BLOCK and point_depth[stop] == point_depth[start]:
            low, high = min(low, ranges[stop]), max(high, ranges[stop])
            stop += 1
        build_nodes(depth, speed, plane, source_depth, point_depth[start], ray_branch)
        point_span[0], point_span[1] = start, stop
        limit = direct_rays(ray_branch, bounces.number, bounces.first_up, workspace, result)
        farthest = limit
        if bounces.number == 0:
            farthest = ducted_rays(ray_branch, slabs, low, high, limit, workspace, result)
        elif bounces.number == 1:
            farthest = bounced_rays(ray_branch, bounces.first_up, slabs, low, high, limit, workspace, result)
        for i in range(start, stop):
            if count[i] > 0:
                status[i] = CLEAR
                if count[i] > 1:
                    sort_by_launch_angle(rays[i], count[i])
            elif ranges[i] <= farthest:
                status[i] = BEYOND_CRITICAL
            else:
                status[i] = TURNED if farthest == limit else SHADOW
        start = stop


@njit(cache=True, nogil=True, error_model="numpy")
def direct_rays(ray_branch: Floats, bounces: int, first_up: bool, workspace: Any, result: Any) -> float:
    """Write the rays that never turn: at most one to each point.

    Args:
        ray_branch: Nodes, see `_layer_sequence_kernel`; its layer sequence changes.
        bounces: Number of bounces.
        first_up: True if the first bounce is at the surface, False if it is at the bottom.
        workspace: See `_monotone_segment_kernel.branch_rays`.
        result: See `_monotone_segment_kernel.branch_rays`.

    Returns:
        Greatest distance of such rays [m]; 0 if there are none.
    """
    point_span, ranges, rays, count = result
    block, point_index = workspace[0], workspace[1]
    s, r = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    bottom = int(ray_branch[LAYER_SEQUENCE, BOTTOM])
    if bounces and first_up == (bounces % 2 == 0) and r > bottom:
        return 0.0  # rays that rise from the reflecting plane never get below it
    start_layer_sequence(ray_branch)
    node, goes_up, first, last = s, first_up, min(s, r), max(s, r)
    for _ in range(bounces):
        node = count_passages(ray_branch, node, 0 if goes_up else bottom)
        first, last, goes_up = min(first, node), max(last, node), not goes_up
    count_passages(ray_branch, node, r)
    launch = -1.0 if (first_up if bounces else r < s) else 1.0
    arrival = launch if bounces % 2 == 0 else -launch
    if first == last:
        return horizontal_rays(ray_branch, s, result)
    finish_layer_sequence(ray_branch, first, last)
    limit = ray_distance(HORIZONTAL, ray_branch)[0]
    vertical_distance, mean_kappa = 0.0, 0.0  # along the path, stretched by the speed re the highest; weighted mean
    for j in range(first, last):
        vertical_distance += 0.5 * ray_branch[STRETCH, j]
        mean_kappa += 0.25 * ray_branch[STRETCH, j] * (ray_branch[KAPPA, j] + ray_branch[KAPPA, j + 1])
    mean_kappa /= vertical_distance
    ray_count = 0
    for i in range(point_span[0], point_span[1]):
        if ranges[i] > limit * (1 + ROUNDING):
            continue
        ratio = vertical_distance / ranges[i]  # tangent of the grazing angle, v in water of one speed
        block.distance[ray_count], block.state[ray_count] = ranges[i], GUESS
        block.v[ray_count] = math.sqrt(max(ratio * ratio - mean_kappa, 0.05 * ratio * ratio))
        if ranges[i] >= limit * (1 - ROUNDING):
            block.v[ray_count], block.state[ray_count] = HORIZONTAL, AT_BRANCH_END
        elif ratio > 1e9:
            block.v[ray_count], block.state[ray_count] = min(ratio, 1e300), SOLVED
        point_index[ray_count] = i
        ray_count += 1
    newton_steps(ray_branch, block, ray_count, HORIZONTAL, math.inf, True)
    for i in range(ray_count):
        if block.state[i] == GUESS:
            block.v[i] = ray_to_distance(
                block.distance[i], HORIZONTAL, 2 * vertical_distance / block.distance[i], True, ray_branch
            )
    complete_rays(ray_branch, block, ray_count)
    for i in range(ray_count):
        k = point_index[i]
        write_ray_properties(ray_branch, block, i, launch, arrival, 0, rays, k, count[k])
        count[k] += 1
    return limit


@njit(cache=True, nogil=True, error_model="numpy")
def horizontal_rays(ray_branch: Floats, s: int, result: Any) -> float:
    """Write the straight rays along the source's own depth, in a layer of constant sound speed.

    Args:
        ray_branch: Nodes.
        s: Node of the source, and of the points.
        result: See `direct_rays`.

    Returns:
        Greatest distance of such rays [m]: infinite, or 0 where no such layer touches that depth.
    """
    point_span, ranges, rays, count = result
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
    ray_branch: Floats, slabs: Floats, low: float, high: float, limit: float, workspace: Any, result: Any
) -> float:  # fmt: skip
    """Write the rays that turn without reaching a boundary, those with the fewest turns first.

    Args:
        ray_branch: Nodes; its layer sequence changes.
        slabs: Work array for turning slabs, above and below, (2, 3, nodes).
        low: Distance of the nearest point [m].
        high: Distance of the farthest point [m].
        limit: Greatest distance of rays without turns [m].
        workspace: See `direct_rays`.
        result: See `direct_rays`.

    Returns:
        Greatest distance of the rays of the family [m], of those with as few turns as were evaluated.
    """
    s, r = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    nodes = int(ray_branch[LAYER_SEQUENCE, NODES])
    max_speed = highest_speed(ray_branch, min(s, r), max(s, r))
    above = turning_slabs(ray_branch, min(s, r), 0, max_speed, slabs[0])
    below = turning_slabs(ray_branch, max(s, r), nodes - 1, max_speed, slabs[1])
    farthest = limit
    for turns in range(1, MAX_TURNS + 1):
        nearest = math.inf
        for first in range(2):  # the side of the first turn: 0 above, 1 below
            turns_above = (turns + 1 - first) // 2
            for i in range(above if turns_above > 0 else 1):
                for k in range(below if turns > turns_above else 1):
                    fast = ducted_layer_sequence(ray_branch, s, r, turns, first, i, k, max_speed, slabs)
                    if fast > 0:
                        launch = -1.0 if first == 0 else 1.0
                        arrival = launch if turns % 2 == 0 else -launch
                        shortest, longest = branch_rays(ray_branch, fast, launch, arrival, low, high, workspace, result)
                        nearest, farthest = min(nearest, shortest), max(farthest, longest)
        if nearest > high or is_full(result):
            break
    return farthest


@njit(cache=True, nogil=True, error_model="numpy")
def is_full(result: Any) -> bool:
    """Return True if no point can take another ray; `result` as in `direct_rays`."""
    point_span, _, _, count = result
    fewest = MAX_RAYS
    for i in range(point_span[0], point_span[1]):
        fewest = min(fewest, count[i])
    return fewest >= MAX_RAYS


@njit(cache=True, nogil=True, error_model="numpy")
def ducted_layer_sequence(
    ray_branch: Floats, s: int, r: int, turns: int, first: int, i: int, k: int, max_speed: float, slabs: Floats
) -> float:
    """Set the layer sequence of rays with a given number of turns.

    Args:
        ray_branch: Nodes; its layer sequence changes.
        s: Node of the source.
        r: Node of the point.
        turns: Number of turns.
        first: Side of the first turn: 0 above, 1 below.
        i: Index among the turning slabs above; read if a ray turns there.
        k: Index among the turning slabs below; read if a ray turns there.
        max_speed: Highest speed between source and point [m/s].
        slabs: Turning slabs, above and below, see `ducted_rays`.

    Returns:
        Highest turning speed of the ray branch [m/s]; 0 if there is none, with the layer sequence unchanged.
    """
    half_turns = (2 * ((turns + 1 - first) // 2), 2 * ((turns + first) // 2))
    slow, fast = max_speed, math.inf
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
    ray_branch[LAYER_SEQUENCE, ENTRY], ray_branch[LAYER_SEQUENCE, ENTRY + 1] = upper, lower
    node, side = s, first
    for _ in range(turns):
        node = count_passages(ray_branch, node, upper if side == 0 else lower)
        side = 1 - side
    count_passages(ray_branch, node, r)
    finish_layer_sequence(ray_branch, upper, lower)
    return fast


@njit(cache=True, nogil=True, error_model="numpy")
def bounced_rays(
    ray_branch: Floats, first_up: bool, slabs: Floats, low: float, high: float, limit: float, workspace: Any,
    result: Any,
) -> float:  # fmt: skip
    """Write the rays with one bounce that turn before it, after it, or both: away from the boundary and back.

    Args:
        ray_branch: Nodes; its layer sequence changes.
        first_up: True if the bounce is at the surface, False if it is at the bottom.
        slabs: See `ducted_rays`.
        low: See `ducted_rays`.
        high: See `ducted_rays`.
        limit: See `ducted_rays`.
        workspace: See `direct_rays`.
        result: See `direct_rays`.

    Returns:
        Greatest distance of rays of the family [m].
    """
    s, r = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    nodes = int(ray_branch[LAYER_SEQUENCE, NODES])
    bottom = int(ray_branch[LAYER_SEQUENCE, BOTTOM])
    if not first_up and r > bottom:
        return limit
    side, boundary, stop = (1, 0, nodes - 1) if first_up else (0, bottom, 0)  # side of the turns: 0 above, 1 below
    start = max(s, r) if first_up else min(s, r)
    max_speed = highest_speed(ray_branch, min(boundary, start), max(boundary, start))
    slab_count = turning_slabs(ray_branch, start, stop, max_speed, slabs[side])
    away = 1.0 if first_up else -1.0  # sign of the angle of a ray from the boundary, +1 down
    farthest = limit
    for turn_sides in range(1, 4):  # before the bounce; after it; both
        turns_before, turns_after = turn_sides != 2, turn_sides != 1
        for k in range(slab_count):
            entry_node = int(slabs[side, TURN_NODE, k])
            start_layer_sequence(ray_branch)
            node = s
            if turns_before:
                node = count_passages(ray_branch, node, entry_node)
            node = count_passages(ray_branch, node, boundary)
            if turns_after:
                node = count_passages(ray_branch, node, entry_node)
            count_passages(ray_branch, node, r)
            ray_branch[LAYER_SEQUENCE, ENTRY + side], ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] = (
                entry_node, (4 if turn_sides == 3 else 2),
            )  # fmt: skip
            finish_layer_sequence(ray_branch, min(boundary, entry_node), max(boundary, entry_node))
            launch, arrival = (away if turns_before else -away), (-away if turns_after else away)
            fast = slabs[side, TURN_FAST, k]
            farthest = max(farthest, branch_rays(ray_branch, fast, launch, arrival, low, high, workspace, result)[1])
    return farthest


@njit(cache=True, nogil=True, error_model="numpy")
def sort_by_launch_angle(rows: Floats, count: int) -> None:
    """Sort the first count rows, columns of rays, by launch angle, upward first."""
    for k in range(1, count):
        j = k
        while j > 0 and rows[j, SIN_LAUNCH] < rows[j - 1, SIN_LAUNCH]:
            for column in range(COLUMNS):
                rows[j, column], rows[j - 1, column] = rows[j - 1, column], rows[j, column]
            j -= 1
