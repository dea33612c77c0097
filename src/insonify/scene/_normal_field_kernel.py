"""A smooth normal field without end and without memory: numbers on a lattice, spread by cubic splines.

At every position, the weights of its sixteen nodes are scaled to a mean square of one, so that the field is exactly
normal everywhere, not only on average.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.jit import njit

Floats = NDArray[np.float64]

HELD = 1024
"""Nodes that are cached along a row of positions, a power of two: neighbours need the same ones."""


@njit(cache=True, nogil=True)
def normal_field(x: Floats, y: Floats, k0: int, k1: int, out: Floats) -> None:
    """Values of the field.

    Args:
        x: First coordinate in units of the lattice [1], (n,).
        y: Second coordinate [1], (n,).
        k0: First word of the key.
        k1: Second word.
        out: Result, standard normal [1], (n,).
    """
    held, number = np.zeros(HELD), np.full((HELD, 2), np.iinfo(np.int64).min)
    across, along, near = np.empty(4), np.empty(4), np.empty((4, 4))
    last_a, last_b = 0, 0
    for n in range(x.size):
        a, b = math.floor(x[n]), math.floor(y[n])
        if n == 0 or a != last_a or b != last_b:
            last_a, last_b = a, b
            for i in range(4):
                for j in range(4):
                    near[i, j] = node(a + i - 1, b + j - 1, k0, k1, held, number)
        spline(x[n] - a, along)
        spline(y[n] - b, across)
        total, one, other = 0.0, 0.0, 0.0
        for i in range(4):
            row = 0.0
            for j in range(4):
                row += across[j] * near[i, j]
            total += along[i] * row
            one += along[i] * along[i]
            other += across[i] * across[i]
        out[n] = total / math.sqrt(one * other)


@njit(cache=True, nogil=True)
def spline(t: float, weight: Floats) -> None:
    """Weights of four consecutive nodes for the position at a fraction t from the second to the third [1], (4,)."""
    s = 1 - t
    weight[0] = s * s * s / 6
    weight[1] = (3 * t - 6) * t * t / 6 + 2 / 3
    weight[2] = (3 * s - 6) * s * s / 6 + 2 / 3
    weight[3] = t * t * t / 6


@njit(cache=True, nogil=True)
def node(a: int, b: int, k0: int, k1: int, held: Floats, number: NDArray[np.int64]) -> float:
    """Standard normal number of a node [1], drawn unless it is held."""
    slot = (a * 73856093 ^ b * 19349663) & (HELD - 1)
    if number[slot, 0] != a or number[slot, 1] != b:
        w0, w1, w2, w3 = random_keys.philox(a, b, 0, 0, k0, k1)
        number[slot, 0], number[slot, 1] = a, b
        held[slot] = random_keys.complex_normal_pair(w0, w1, w2, w3)[0].real * math.sqrt(2.0)
    return held[slot]


@njit(cache=True, nogil=True)
def interpolate_exp_table(x: Floats, low: float, per_unit: float, logarithm: Floats) -> None:
    """Replace numbers by the exponential of a table, straight between its entries and held beyond its ends.

    Args:
        x: Numbers, replaced [1], (n,).
        low: Number of the first entry [1].
        per_unit: Entries per unit [1].
        logarithm: The table [1], (entries,).
    """
    last = logarithm.size - 1.000001
    for n in range(x.size):
        at = min(max((x[n] - low) * per_unit, 0.0), last)
        row = int(at)
        part = at - row
        x[n] = math.exp(logarithm[row] * (1 - part) + logarithm[row + 1] * part)
