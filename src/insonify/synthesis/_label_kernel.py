"""Where energy comes from: paths laid into bins of delay, each with the place that it went to."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
MOMENTS = 6
"""Columns of the bins: energy, then energy times north, east, depth, distance and grazing angle."""


@njit(cache=True, nogil=True, error_model="numpy")
def add_places(
    bins: Floats, start: float, rate: float, delay_out: Floats, delay_back: Floats, power_out: Floats,
    power_back: Floats, pair: NDArray[np.int64], strength: Floats, place: Floats, receiver: Floats,
    grazing_out: Floats, grazing_back: Floats,
) -> None:  # fmt: skip
    """Add energy, and energy times place, of every path to the two bins beside its delay.

    Args:
        bins: Added to in place, (bins, MOMENTS).
        start: Delay of the first bin [s].
        rate: Bins per second [Hz].
        delay_out: One-way delays [s], (f, n).
        delay_back: Likewise of the other end, (g, n).
        power_out: Power of each leg, its beam included, (f, n).
        power_back: Likewise, (g, n).
        pair: Rows of the legs out and back, (p, 2).
        strength: Pressure scattered re incident [m], (p, n).
        place: North, east, depth of each point [m], (n, 3).
        receiver: North, east, depth of the receiver [m], (3,).
        grazing_out: Grazing angle at the point [rad], (f, n).
        grazing_back: Likewise, (g, n).
    """
    last = bins.shape[0] - 1
    told = np.empty(MOMENTS)
    for n in range(place.shape[0]):
        told[0], told[1], told[2], told[3] = 1.0, place[n, 0], place[n, 1], place[n, 2]
        north, east, down = place[n, 0] - receiver[0], place[n, 1] - receiver[1], place[n, 2] - receiver[2]
        told[4] = math.sqrt(north * north + east * east + down * down)
        for p in range(pair.shape[0]):
            i, j = pair[p, 0], pair[p, 1]
            energy = power_out[i, n] * power_back[j, n] * strength[p, n] ** 2
            position = (delay_out[i, n] + delay_back[j, n] - start) * rate
            if not (energy > 0 and 0 <= position < last):
                continue
            k = math.floor(position)
            part = position - k
            told[5] = (abs(grazing_out[i, n]) + abs(grazing_back[j, n])) / 2
            for m in range(MOMENTS):
                bins[k, m] += (1 - part) * energy * told[m]
                bins[k + 1, m] += part * energy * told[m]
