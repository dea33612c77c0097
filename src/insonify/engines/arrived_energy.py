"""Energy received over time from all pairs of legs, by the sonar equation, against which a weak pair is negligible."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]

NEGLIGIBLE = 3e-5
"""Largest fraction of the energy received at any time that a pair may have to be left out [1]."""
TIME_SAMPLES = 1024
"""Number of times at which the energy of all pairs together is computed."""


def arrived_energy(arrival_time: Floats, energy: Floats) -> Floats:
    """Energy of all pairs together that has arrived up to given delays.

    Args:
        arrival_time: Delays of each pair from the edges of the range bins [s], (p, b + 1).
        energy: Energy of each pair from each range bin, in any unit, (p, b).

    Returns:
        Energy up to each of these delays, in the same unit, (p, b + 1).
    """
    result = np.empty(arrival_time.shape)
    _add_arrived(np.ascontiguousarray(arrival_time), np.ascontiguousarray(energy), result)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _add_arrived(arrival_time: Floats, energy: Floats, result: Floats) -> None:
    """Fill the result of `arrived_energy`, whose arguments are contiguous: to the bit that of `numpy.interp`."""
    first, last = arrival_time.min(), arrival_time.max()
    step, arrived, sums = (last - first) / (TIME_SAMPLES - 1), np.zeros(TIME_SAMPLES), np.zeros(arrival_time.shape[1])
    time = np.empty(TIME_SAMPLES)
    for k in range(TIME_SAMPLES):
        time[k] = k * step + first if k < TIME_SAMPLES - 1 else last
    for p in range(energy.shape[0]):
        for b in range(energy.shape[1]):
            sums[b + 1] = sums[b] + energy[p, b]
        j = 0
        for k in range(TIME_SAMPLES):
            value, j = _interpolated(time[k], arrival_time[p], sums, j)
            arrived[k] += value
    for p in range(energy.shape[0]):
        j = 0
        for b in range(arrival_time.shape[1]):
            result[p, b], j = _interpolated(arrival_time[p, b], time, arrived, j)


@njit(inline="always")
def _interpolated(x: float, nodes: Floats, values: Floats, j: int) -> tuple[float, int]:
    """Value between nodes in ascending order, constant beyond them, and the last node not above x, from node j on."""
    while j < nodes.size - 1 and nodes[j + 1] <= x:
        j += 1
    if x <= nodes[j] or j == nodes.size - 1:
        return values[j], j
    return (values[j + 1] - values[j]) / (nodes[j + 1] - nodes[j]) * (x - nodes[j]) + values[j], j
