"""Independent noises made into noises that belong together: a lower triangle times rows of samples.

Sums run in the same order whatever the threads: a product of matrices by a library may not.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Reals = NDArray[np.float32]

BLOCK = 1024
"""Samples that are worked on together: a row of them stays in the first cache."""


@njit(cache=True, nogil=True)
def mix(lower: Reals, turn: Reals, white: Reals, white_q: Reals, out: Reals, out_q: Reals) -> None:
    """Product of a complex lower triangle and complex rows, given as real and imaginary parts.

    Args:
        lower: Real part of the triangle, shape (n, n).
        turn: Its imaginary part, shape (n, n).
        white: Real part of the rows, shape (n, count).
        white_q: Their imaginary part, shape (n, count).
        out: Result, real part, zeros before, shape (n, count).
        out_q: Result, imaginary part, zeros before, shape (n, count).
    """
    channels, count = white.shape
    for begin in range(0, count, BLOCK):
        stop = min(begin + BLOCK, count)
        for m in range(channels):
            for n in range(m + 1):
                a, b = lower[m, n], turn[m, n]
                if a == 0 and b == 0:
                    continue
                if b == 0:
                    for t in range(begin, stop):
                        out[m, t] += a * white[n, t]
                        out_q[m, t] += a * white_q[n, t]
                else:
                    for t in range(begin, stop):
                        out[m, t] += a * white[n, t] - b * white_q[n, t]
                        out_q[m, t] += a * white_q[n, t] + b * white[n, t]
