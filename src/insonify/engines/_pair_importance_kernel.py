"""Priorities of scatterers, and the families sampled at each. Plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.random_keys import splitmix64

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def assign_priorities(
    position: Floats, north: float, east: float, edges: Floats, first: NDArray[np.uint8],
    scatterer_id: NDArray[np.uint64], key: np.uint64, range_bin: NDArray[np.uint8], priority: NDArray[np.float32],
) -> tuple[int, int]:  # fmt: skip
    """Fill the priority of each position, and the range bin in which it lies, the last for those beyond.

    Args:
        position: North, east and any further coordinates of the positions [m], (n, 2 or more).
        north: North of the position from which distances are counted [m].
        east: East of that position [m].
        edges: Edges of the range bins, increasing from 0 [m], (range bins + 1,).
        first: Range bin in which each of many even parts of the distance up to the last edge begins, (parts,); no part
            is longer than a range bin.
        scatterer_id: Scatterer ids, (n,).
        key: Key of the draw, any word.
        range_bin: Result, (n,).
        priority: Result, from 0 to below 1 [1], (n,).

    Returns:
        The least and the greatest range bin.
    """
    last, low, high = edges.size - 2, edges.size - 2, 0
    cells, once = first.size, first.size / edges[-1]
    for n in range(scatterer_id.size):
        # 24 bits: a number below one in single precision
        priority[n] = np.float32(splitmix64(scatterer_id[n] ^ key) >> np.uint64(40)) * np.float32(2.0**-24)
    for n in range(scatterer_id.size):
        x, y = position[n, 0] - north, position[n, 1] - east
        distance = math.sqrt(x * x + y * y)
        row = int(first[int(min(distance * once, cells - 1.0))])
        row = min(row + int(distance >= edges[row + 1]), last)
        low, high = min(low, row), max(high, row)
        range_bin[n] = row
    return low, high


@njit(cache=True, nogil=True, error_model="numpy")
def mark_sampled_families(
    priority: NDArray[np.float32], range_bin: NDArray[np.uint8], keep_probability: NDArray[np.float32],
    needed: NDArray[np.bool_]
) -> None:  # fmt: skip
    """Mark the scatterers at which any pair of each family is evaluated.

    Args:
        priority: Priorities of the positions, (n,).
        range_bin: Range bin of each position, (n,).
        keep_probability: Largest keep probability of the pairs of each family [1], (f, range bins).
        needed: Result, True for such scatterers, (f, n).
    """
    for i in range(keep_probability.shape[0]):
        for n in range(priority.size):
            needed[i, n] = priority[n] < keep_probability[i, range_bin[n]]
