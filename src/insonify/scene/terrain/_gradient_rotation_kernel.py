"""Rotation of gradients from the lattice's axes to north and east. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True)
def rotate(height: Floats, slope: Floats, c: float, s: float, rows: Floats) -> None:
    """Fill rows of height and gradient to the north and the east.

    Args:
        height: Height [m], shape (n,).
        slope: Gradient along the lattice's axes [1], shape (n, 2).
        c: Cosine of the lattice's heading.
        s: Sine of the lattice's heading.
        rows: Result: height [m], gradient to the north and the east [1], shape (n, 3).
    """
    for n in range(height.size):
        along, across = slope[n, 0], slope[n, 1]
        rows[n, 0], rows[n, 1], rows[n, 2] = height[n], c * along - s * across, s * along + c * across
