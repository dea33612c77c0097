"""Layer sequences: the layers that a ray crosses, how often, and where it may turn. Plain numbers and arrays only.

The knots of the water column, the source and the point together are the nodes, in order of depth; between two of
them lies a slab of one gradient. A ray of given slowness that reaches the point crosses every slab between its highest
and its lowest visited node a whole number of times, and turns inside at most one slab above and one below these.

Nodes and layer sequence are stored together in one array, the ray branch.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]

# Rows of a ray branch: a value for every node, or for the slab below the node.
DEPTH = 0  # of the node [m]
SPEED = 1  # sound speed of the node [m/s]
GRADIENT = 2  # of the slab [1/s]
KAPPA = 3  # 1 - (c / c_m)^2 of the node, c_m the speed at the fastest node visited [1]
STRETCH = 4  # passages (c_j + c_j+1) dz / c_m of the slab [m]
PASSAGES = 5  # number of crossings of the slab
LAYER_SEQUENCE = 6  # not one per node: the values below
RAY_BRANCH_ROWS = 7

# Columns of the row LAYER_SEQUENCE.
NODES = 0  # number of nodes
SOURCE = 1  # node of the source
POINT = 2  # node of the point
FIRST = 3  # highest node visited
LAST = 4  # lowest node visited
TOP = 5  # speed at the fastest node visited [m/s]
BOTTOM = 6  # node of the plane that reflects sound at the bottom
HALF_TURNS = 7  # half turns above (7) and below (8)
ENTRY = 9  # node at which the ray enters and leaves the slab where it turns, above (9) and below (10)
RADII = 11  # half turns x radius c_m / |g| of arcs in that slab [m], 0 without a turn, above (11) and below (12)
LAYER_SEQUENCE_COLUMNS = 13

# Rows of the array of slabs in which a ray may turn.
TURN_NODE = 0  # node at which the ray enters the slab
TURN_SLOW = 1  # least turning speed of rays that turn there [m/s]
TURN_FAST = 2  # turning speed at which a ray would reach the far side of the slab [m/s]


@njit(cache=True, nogil=True, error_model="numpy")
def build_nodes(depth: Floats, speed: Floats, plane: float, source: float, point: float, ray_branch: Floats) -> None:
    """Write the nodes and slabs of a water column with a source and a point in it.

    Args:
        depth: Depths of the knots [m], (m,).
        speed: Sound speed at the knots [m/s], (m,).
        plane: Depth of the knot that reflects sound at the bottom [m]; where no knot lies there, the last one does.
        source: Depth of the source [m], in the water.
        point: Depth of the point [m], in the water.
        ray_branch: Result: (RAY_BRANCH_ROWS, at least m + 2).
    """
    nodes = 0
    upper, lower = min(source, point), max(source, point)
    for j in range(depth.size):
        ray_branch[DEPTH, nodes], ray_branch[SPEED, nodes] = depth[j], speed[j]
        nodes += 1
        if j + 1 == depth.size:
            break
        thickness, speed_change = depth[j + 1] - depth[j], speed[j + 1] - speed[j]
        ray_branch[GRADIENT, nodes - 1] = speed_change / thickness
        for k in range(2):
            z = upper if k == 0 else lower
            if depth[j] < z < depth[j + 1] and z > ray_branch[DEPTH, nodes - 1]:
                c = speed[j] + (z - depth[j]) / thickness * speed_change
                ray_branch[DEPTH, nodes] = z
                ray_branch[SPEED, nodes] = min(max(speed[j], speed[j + 1]), max(min(speed[j], speed[j + 1]), c))
                ray_branch[GRADIENT, nodes] = speed_change / thickness
                nodes += 1
    ray_branch[LAYER_SEQUENCE, NODES], ray_branch[LAYER_SEQUENCE, BOTTOM] = nodes, nodes - 1
    for i in range(nodes):
        if ray_branch[DEPTH, i] == plane:
            ray_branch[LAYER_SEQUENCE, BOTTOM] = i
        if ray_branch[DEPTH, i] == source:
            ray_branch[LAYER_SEQUENCE, SOURCE] = i
        if ray_branch[DEPTH, i] == point:
            ray_branch[LAYER_SEQUENCE, POINT] = i


@njit(cache=True, nogil=True, error_model="numpy")
def start_layer_sequence(ray_branch: Floats) -> None:
    """Reset the passages and turns of a layer sequence."""
    ray_branch[PASSAGES, :] = 0.0
    for k in range(HALF_TURNS, LAYER_SEQUENCE_COLUMNS):
        ray_branch[LAYER_SEQUENCE, k] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def count_passages(ray_branch: Floats, start: int, stop: int) -> int:
    """Add one passage of each slab from a start to a stop node; return the stop node."""
    for j in range(min(start, stop), max(start, stop)):
        ray_branch[PASSAGES, j] += 1.0
    return stop


@njit(cache=True, nogil=True, error_model="numpy")
def finish_layer_sequence(ray_branch: Floats, first: int, last: int) -> None:
    """Set the quantities common to all rays of a layer sequence with known passages, half turns and turning slabs.

    Args:
        ray_branch: The ray branch, changed.
        first: Highest node visited.
        last: Lowest node visited.
    """
    top = highest_speed(ray_branch, first, last)
    ray_branch[LAYER_SEQUENCE, FIRST], ray_branch[LAYER_SEQUENCE, LAST], ray_branch[LAYER_SEQUENCE, TOP] = (
        first,
        last,
        top,
    )
    for i in range(first, last + 1):
        ray_branch[KAPPA, i] = (top - ray_branch[SPEED, i]) / top * ((top + ray_branch[SPEED, i]) / top)
    for j in range(first, last):
        both = (ray_branch[SPEED, j] + ray_branch[SPEED, j + 1]) / top
        ray_branch[STRETCH, j] = ray_branch[PASSAGES, j] * both * (ray_branch[DEPTH, j + 1] - ray_branch[DEPTH, j])
    for side in range(2):
        if ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] > 0:
            slab = int(ray_branch[LAYER_SEQUENCE, ENTRY + side]) - 1 + side
            ray_branch[LAYER_SEQUENCE, RADII + side] = (
                ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] * top / abs(ray_branch[GRADIENT, slab])
            )


@njit(cache=True, nogil=True, error_model="numpy")
def highest_speed(ray_branch: Floats, first: int, last: int) -> float:
    """Highest sound speed among the nodes first..last, both included [m/s]."""
    top_speed = ray_branch[SPEED, first]
    for i in range(first + 1, last + 1):
        top_speed = max(top_speed, ray_branch[SPEED, i])
    return top_speed


@njit(cache=True, nogil=True, error_model="numpy")
def turning_slabs(ray_branch: Floats, start: int, stop: int, highest_so_far: float, slabs: Floats) -> int:
    """Slabs in which a ray may turn as it goes on from a node, nearest first.

    Args:
        ray_branch: The ray branch.
        start: Node from which it goes on.
        stop: Node of the boundary ahead.
        highest_so_far: Highest sound speed on the path so far [m/s].
        slabs: Result: see `TURN_NODE`, (3, nodes).

    Returns:
        Number of slabs.
    """
    count, step = 0, (1 if stop > start else -1)
    i = start
    while i != stop:
        next_speed = ray_branch[SPEED, i + step]
        if next_speed > highest_so_far:
            slabs[TURN_NODE, count], slabs[TURN_SLOW, count], slabs[TURN_FAST, count] = i, highest_so_far, next_speed
            highest_so_far = next_speed
            count += 1
        i += step
    return count
