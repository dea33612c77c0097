"""Distances of positions from a polyline of many segments."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_segment_distance(position: Floats, runs: Floats, distance: Floats) -> None:
    """Distance of each position from the nearest run.

    Args:
        position: Coordinates in a plane [m], shape (n, 2).
        runs: Both ends of each run [m], shape (runs, 2, 2).
        distance: Filled with the distances [m], shape (n,).
    """
    for n in range(position.shape[0]):
        least = np.inf
        for k in range(runs.shape[0]):
            along0, along1 = runs[k, 1, 0] - runs[k, 0, 0], runs[k, 1, 1] - runs[k, 0, 1]
            off0, off1 = position[n, 0] - runs[k, 0, 0], position[n, 1] - runs[k, 0, 1]
            square = along0 * along0 + along1 * along1
            part = 0.0
            if square > 0:
                part = min(max((off0 * along0 + off1 * along1) / square, 0.0), 1.0)
            x, y = off0 - part * along0, off1 - part * along1
            least = min(least, x * x + y * y)
        distance[n] = math.sqrt(least)
