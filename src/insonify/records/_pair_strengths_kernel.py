"""Strengths of all pairs at all scatterers, written out. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def amplitude_weights(
    priority: Singles, range_bin: NDArray[np.uint8], keep_probability: Singles, weight: Singles
) -> None:
    """By what the answer of each scatterer to each pair is louder for standing for others.

    Args:
        priority: Of each scatterer's place, 0 to 1, (n,).
        range_bin: Of distance that each lies in, (n,).
        keep_probability: Part of the scatterers at which each pair is met, (p, stretches).
        weight: Result, one over the root of the share where the number lies below it, else 0, (p, n).
    """
    for p in range(keep_probability.shape[0]):
        least, root = keep_probability[p], (1 / np.sqrt(keep_probability[p])).astype(np.float32)
        for n in range(priority.size):
            weight[p, n] = root[range_bin[n]] if priority[n] < least[range_bin[n]] else np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def separable_strengths(
    transmit_factor: Floats, receive_factor: Floats, pair: NDArray[np.int64], weight: Singles, strengths: Floats
) -> None:
    """Strengths that are products of what each leg contributes.

    Args:
        transmit_factor: Of legs out, (f, n).
        receive_factor: Of legs back, (g, n).
        pair: Rows of each ordered pair, (p, 2).
        weight: What strengths are multiplied by, (p, n); or (0, n) for one.
        strengths: Result, (p, n).
    """
    for p in range(pair.shape[0]):
        i, j = pair[p]
        if weight.shape[0] == 0:
            for n in range(strengths.shape[1]):
                strengths[p, n] = transmit_factor[i, n] * receive_factor[j, n]
        else:
            for n in range(strengths.shape[1]):
                strengths[p, n] = transmit_factor[i, n] * receive_factor[j, n] * weight[p, n]
