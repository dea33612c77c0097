"""What ground lies behind what ground, from launch angles alone. Plain numbers and arrays only."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[Any]


@njit(cache=True, nogil=True, error_model="numpy")
def sweep(
    ranges: Floats, ground: Floats, points: Floats, begin: Floats, visible: NDArray[np.bool_], cutter: Integers
) -> None:
    """One pass outward along each azimuth; a ray passes over what has a larger key.

    The ground met so far is kept as a stack of keys that grow outward: what has a smaller key further out hides
    all before it. Its lowest entry is the horizon; each cell comes and goes once, so the pass is O(n).

    Args:
        ranges: Ranges of the cells, increasing [m], (n,).
        ground: Key of the ray to the ground of each cell, NaN where none gets there, (azimuths, n).
        points: Key of the ray to the point looked at in each cell, NaN where none gets there, (azimuths, n).
        begin: Range from which ground can cut that ray [m], (azimuths, n).
        visible: Result, (azimuths, n).
        cutter: Result, cell of the horizon that hides the point, -1 for none, (azimuths, n).
    """
    count = ranges.size
    stack = np.empty(count, np.int64)
    for line in range(ground.shape[0]):
        size = 0
        for cell in range(count):
            cutter[line, cell] = -1
            visible[line, cell] = not np.isnan(points[line, cell])
            lowest = _first_beyond(ranges, stack, size, begin[line, cell])
            if visible[line, cell] and lowest < size and ground[line, stack[lowest]] < points[line, cell]:
                visible[line, cell] = False
                cutter[line, cell] = stack[lowest]
            if np.isnan(ground[line, cell]):
                continue
            while size > 0 and ground[line, stack[size - 1]] >= ground[line, cell]:
                size -= 1
            stack[size] = cell
            size += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _first_beyond(ranges: Floats, stack: Integers, size: int, begin: float) -> int:
    """Place in the stack of the first cell beyond a range; the stack's size where none is."""
    if size == 0 or ranges[stack[0]] > begin:
        return 0
    low, high = 0, size
    while low < high:
        middle = (low + high) // 2
        if ranges[stack[middle]] > begin:
            high = middle
        else:
            low = middle + 1
    return low
