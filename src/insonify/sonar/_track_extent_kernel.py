"""Distances of positions in a plane from the nearest of many straight segments."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_segment_distance(position: Floats, segments: Floats, distance: Floats) -> None:
    """Fill the distance of each position from the nearest of some segments, such as those of a track's polyline.

    Args:
        position: Coordinates of the positions in a plane [m], shape (n, 2).
        segments: Coordinates of both ends of each segment [m], shape (segments, 2 ends, 2).
        distance: Result [m], shape (n,).
    """
    for n in range(position.shape[0]):
        least = np.inf
        for k in range(segments.shape[0]):
            along0, along1 = segments[k, 1, 0] - segments[k, 0, 0], segments[k, 1, 1] - segments[k, 0, 1]
            off0, off1 = position[n, 0] - segments[k, 0, 0], position[n, 1] - segments[k, 0, 1]
            length_squared = along0 * along0 + along1 * along1
            fraction = 0.0
            if length_squared > 0:
                fraction = min(max((off0 * along0 + off1 * along1) / length_squared, 0.0), 1.0)
            x, y = off0 - fraction * along0, off1 - fraction * along1
            least = min(least, x * x + y * y)
        distance[n] = math.sqrt(least)
