"""Kernel of absorption along paths. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.fast_exponential import exp_nonpositive
from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def absorb(length: Floats, attenuation: float, factor: Floats) -> None:
    """Write the pressure after absorption along paths, re that without it.

    Args:
        length: Length of each path [m], (f, n).
        attenuation: Absorption [Np/m].
        factor: Result: exp(-attenuation length) [1], (f, n).
    """
    for f in range(length.shape[0]):
        path, row = length[f], factor[f]
        for n in range(np.uint64(path.size)):
            row[n] = exp_nonpositive(-attenuation * path[n])
