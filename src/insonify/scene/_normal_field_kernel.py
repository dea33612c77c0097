"""A smooth, unbounded field of standard normal numbers: keyed numbers on a lattice, interpolated by cubic splines.

At every position, the squares of the weights of its sixteen nodes are scaled to a sum of one, so that the field has
unit variance everywhere.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.jit import njit

Floats = NDArray[np.float64]

CACHE_SIZE = 1024
"""Number of cached nodes, a power of two: neighbouring positions use the same nodes."""


@njit(cache=True, nogil=True)
def normal_field(x: Floats, y: Floats, k0: int, k1: int, out: Floats) -> None:
    """Fill values of the field.

    Args:
        x: First coordinate in units of the lattice [1], (n,).
        y: Second coordinate [1], (n,).
        k0: First word of the key.
        k1: Second word of the key.
        out: Result, standard normal [1], (n,).
    """
    cached, number = np.zeros(CACHE_SIZE), np.full((CACHE_SIZE, 2), np.iinfo(np.int64).min)
    across, along, node_values = np.empty(4), np.empty(4), np.empty((4, 4))
    last_a, last_b = 0, 0
    for n in range(x.size):
        a, b = math.floor(x[n]), math.floor(y[n])
        if n == 0 or a != last_a or b != last_b:
            last_a, last_b = a, b
            for i in range(4):
                for j in range(4):
                    node_values[i, j] = cached_node(a + i - 1, b + j - 1, k0, k1, cached, number)
        spline_weights(x[n] - a, along)
        spline_weights(y[n] - b, across)
        total, squares_along, squares_across = 0.0, 0.0, 0.0
        for i in range(4):
            row = 0.0
            for j in range(4):
                row += across[j] * node_values[i, j]
            total += along[i] * row
            squares_along += along[i] * along[i]
            squares_across += across[i] * across[i]
        out[n] = total / math.sqrt(squares_along * squares_across)


@njit(cache=True, nogil=True)
def spline_weights(t: float, weight: Floats) -> None:
    """Weights of four consecutive nodes for the position at a fraction t from the second to the third [1], (4,)."""
    s = 1 - t
    weight[0] = s * s * s / 6
    weight[1] = (3 * t - 6) * t * t / 6 + 2 / 3
    weight[2] = (3 * s - 6) * s * s / 6 + 2 / 3
    weight[3] = t * t * t / 6


@njit(cache=True, nogil=True)
def cached_node(a: int, b: int, k0: int, k1: int, cached: Floats, number: NDArray[np.int64]) -> float:
    """Standard normal number of a node [1], from the cache or generated."""
    slot = (a * 73856093 ^ b * 19349663) & (CACHE_SIZE - 1)
    if number[slot, 0] != a or number[slot, 1] != b:
        w0, w1, w2, w3 = random_keys.philox(a, b, 0, 0, k0, k1)
        number[slot, 0], number[slot, 1] = a, b
        cached[slot] = random_keys.complex_normal_pair(w0, w1, w2, w3)[0].real * math.sqrt(2.0)
    return cached[slot]


@njit(cache=True, nogil=True)
def interpolate_exp_table(x: Floats, low: float, per_unit: float, logarithm: Floats) -> None:
    """Replace numbers by the exponential of a table, linear between its entries and constant beyond its ends.

    Args:
        x: Numbers, replaced [1], (n,).
        low: Argument of the first entry [1].
        per_unit: Entries per unit [1].
        logarithm: The table [1], (entries,).
    """
    last = logarithm.size - 1.000001
    for n in range(x.size):
        index = min(max((x[n] - low) * per_unit, 0.0), last)
        row = int(index)
        fraction = index - row
        x[n] = math.exp(logarithm[row] * (1 - fraction) + logarithm[row + 1] * fraction)
