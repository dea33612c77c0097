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
    """Amplitude weights of sampled pairs: one over the root of the keep probability, 0 where a pair is not kept.

    Args:
        priority: Priority of each scatterer, 0 to 1, (n,).
        range_bin: Range bin of each scatterer, (n,).
        keep_probability: Probability with which each pair is kept in each range bin, (p, bins).
        weight: Result, one over the root of the keep probability where the priority lies below it, else 0, (p, n).
    """
    for p in range(keep_probability.shape[0]):
        threshold, root = keep_probability[p], (1 / np.sqrt(keep_probability[p])).astype(np.float32)
        for n in range(priority.size):
            weight[p, n] = root[range_bin[n]] if priority[n] < threshold[range_bin[n]] else np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def separable_strengths(
    transmit_factor: Floats, receive_factor: Floats, pair: NDArray[np.int64], weight: Singles, strengths: Floats
) -> None:
    """Strengths that are products of one factor for each leg.

    Args:
        transmit_factor: Factor of each transmit leg, (f, n).
        receive_factor: Factor of each receive leg, (g, n).
        pair: Rows of the transmit and the receive leg of each ordered pair, (p, 2).
        weight: Amplitude weight of each pair, (p, n); or (0, n) for 1.
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
