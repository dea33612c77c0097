"""Launches read from a grid of places. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.floating[Any]]


@njit(cache=True, nogil=True, error_model="numpy")
def read_climb(climb: Floats, top: float, height: float, width: float, distance: Floats, depth: Floats,
               steepness: Floats) -> None:  # fmt: skip
    """Steepness of rays to places, linear between the nodes of a grid.

    Args:
        climb: Distance times steepness at the nodes [m], NaN where there is no ray, (lines, stations).
        top: Depth of the first line [m].
        height: Distance of the lines [m].
        width: Distance of the stations, the first of which is at 0 [m].
        distance: Horizontal distance of the places [m], (n,), or that of their columns.
        depth: Depths of the places [m], (m, n).
        steepness: Result, NaN outside the grid, (m, n).
    """
    lines, stations = climb.shape
    for m in range(depth.shape[0]):
        for n in range(depth.shape[1]):
            far = distance[n]
            u, v = far / width, (depth[m, n] - top) / height
            if not (0 < u <= stations - 1 and -1e-6 <= v <= lines - 1 + 1e-6):
                steepness[m, n] = np.nan
                continue
            i, k = max(min(math.floor(v), lines - 2), 0), min(int(u), stations - 2)
            v, u = v - i, u - k
            near = climb[i, k] + v * (climb[i + 1, k] - climb[i, k])
            beyond = climb[i, k + 1] + v * (climb[i + 1, k + 1] - climb[i, k + 1])
            steepness[m, n] = (near + u * (beyond - near)) / far


@njit(cache=True, nogil=True, error_model="numpy")
def spans(depth: Floats, ratio: Floats, here: int, steepness: Floats, up: Floats, down: Floats) -> None:
    """Horizontal ways of rays that do not turn, from the sonar up to the surface and down to the plane.

    Args:
        depth: Depths of the layers' ends between surface and plane, the sonar's among them [m], (m,).
        ratio: Sound speed there over that at the sonar [1], (m,).
        here: Which of them is the sonar's.
        steepness: Of the rays [1], (n,).
        up: Result [m], infinite for a ray that turns before, (n,).
        down: Likewise, (n,).

    Source: Snell's law over layers of one gradient, as in `_lane_kernel`.
    """
    for n in range(steepness.size):
        square = steepness[n] * steepness[n]
        up[n] = down[n] = 0.0
        for side in range(2):
            way, root = 0.0, abs(steepness[n])
            j = here
            while j != (0 if side == 0 else depth.size - 1):
                k = j - 1 if side == 0 else j + 1
                left = square + (1 - ratio[k]) * (1 + ratio[k])
                after = math.sqrt(max(left, 0.0))
                if left < 0 or root + after == 0:
                    way = np.inf
                    break
                way += abs(depth[k] - depth[j]) * (ratio[j] + ratio[k]) / (root + after)
                root, j = after, k
            if side == 0:
                up[n] = way
            else:
                down[n] = way
