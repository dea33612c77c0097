"""Gradients along the lattice's axes, turned to the north and the east. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def turned(height: Floats, slope: Floats, c: float, s: float, rows: Floats) -> None:
    """Rows of height and gradient to the north and the east.

    Args:
        height: Shape (n,).
        slope: Gradient along the lattice's axes, shape (n, 2).
        c: Cosine of its heading.
        s: Sine.
        rows: Result, shape (n, 3).
    """
    for n in range(height.size):
        along, across = slope[n, 0], slope[n, 1]
        rows[n, 0], rows[n, 1], rows[n, 2] = height[n], c * along - s * across, s * along + c * across
