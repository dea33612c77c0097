"""Strengths of all pairs at all scatterers, written out. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def written_out(number: Singles, stretch: NDArray[np.uint8], share: Singles, louder: Singles) -> None:
    """By what the answer of each scatterer to each pair is louder for standing for others.

    Args:
        number: Of each scatterer's place, 0 to 1, (n,).
        stretch: Of distance that each lies in, (n,).
        share: Part of the scatterers at which each pair is met, (p, stretches).
        louder: Result, one over the root of the share where the number lies below it, else 0, (p, n).
    """
    for p in range(share.shape[0]):
        least, root = share[p], (1 / np.sqrt(share[p])).astype(np.float32)
        for n in range(number.size):
            louder[p, n] = root[stretch[n]] if number[n] < least[stretch[n]] else np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def products(one: Floats, other: Floats, pair: NDArray[np.int64], louder: Singles, made: Floats) -> None:
    """Strengths that are products of what each leg contributes.

    Args:
        one: Of legs out, (f, n).
        other: Of legs back, (g, n).
        pair: Rows of each ordered pair, (p, 2).
        louder: What strengths are multiplied by, (p, n); or (0, n) for one.
        made: Result, (p, n).
    """
    for p in range(pair.shape[0]):
        i, j = pair[p]
        if louder.shape[0] == 0:
            for n in range(made.shape[1]):
                made[p, n] = one[i, n] * other[j, n]
        else:
            for n in range(made.shape[1]):
                made[p, n] = one[i, n] * other[j, n] * louder[p, n]
