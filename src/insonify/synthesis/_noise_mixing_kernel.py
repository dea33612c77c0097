"""Kernel that mixes independent noises into correlated ones: a lower triangular matrix times rows of samples.

The order of summation is the same for any number of threads, which a library's matrix product does not guarantee.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Reals = NDArray[np.float32]

BLOCK = 1024
"""Samples that are processed together: a row of them stays in the first-level cache."""


@njit(cache=True, nogil=True)
def mix_noise(
    lower_real: Reals, lower_imag: Reals, white_real: Reals, white_imag: Reals, out_real: Reals, out_imag: Reals
) -> None:
    """Add the product of a complex lower triangular matrix and complex rows, given as real and imaginary parts.

    Args:
        lower_real: Real part of the matrix [1], shape (n, n).
        lower_imag: Imaginary part of the matrix [1], shape (n, n).
        white_real: Real part of the independent noises [uPa], shape (n, count).
        white_imag: Imaginary part of the independent noises [uPa], shape (n, count).
        out_real: Real part of the correlated noises [uPa], added to, shape (n, count).
        out_imag: Imaginary part of the correlated noises [uPa], added to, shape (n, count).
    """
    channels, count = white_real.shape
    for begin in range(0, count, BLOCK):
        stop = min(begin + BLOCK, count)
        for m in range(channels):
            for n in range(m + 1):
                a, b = lower_real[m, n], lower_imag[m, n]
                if a == 0 and b == 0:
                    continue
                if b == 0:
                    for t in range(begin, stop):
                        out_real[m, t] += a * white_real[n, t]
                        out_imag[m, t] += a * white_imag[n, t]
                else:
                    for t in range(begin, stop):
                        out_real[m, t] += a * white_real[n, t] - b * white_imag[n, t]
                        out_imag[m, t] += a * white_imag[n, t] + b * white_real[n, t]
