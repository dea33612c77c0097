"""Glints drawn from the waves that make them. Plain numbers and arrays only.

The phase that the surface's height gives to mirrored sound is a Gaussian process. Its exponential splits exactly into
quanta: n of them with Poisson's probability for the mean nu = (2 k sigma sin(grazing))^2, each taking one wave of the
sea, drawn in proportion to its share of the variance, with either sign; their wavenumbers and frequencies add. No
quantum is the coherent bounce. Where nu is large, the many quanta of long waves are one Gaussian draw.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.streams import philox, unit

Floats = NDArray[np.float64]

MOST = 4.0  # mean number of quanta that are drawn one by one; those of the longer waves, beyond it, as one Gaussian


@njit(cache=True, nogil=True, error_model="numpy")
def row_below(column: Floats, value: float) -> int:
    """Row of the last entry of an increasing column that is not above a value; never the last row."""
    low, high = 0, column.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if column[middle] <= value:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, nogil=True, error_model="numpy")
def draw_glints(
    place: NDArray[np.uint64], code: int, k0: int, k1: int, phase: Floats, some: bool, wavenumber: Floats,
    variance: Floats, frequency: Floats, turn: Floats, moment: Floats, drawn: Floats,
) -> None:  # fmt: skip
    """One glint for each place.

    Args:
        place: Keys of the places, (n,).
        code: Which glint of a place, in the third counter of the draw.
        k0: First word of the key.
        k1: Second word of the key.
        phase: Phase per height, 2 k sin(grazing) [rad/m], (n,).
        some: Whether there is at least one quantum, or also none with its own probability.
        wavenumber: Table of `insonify.propagation.waves.Waves`.
        variance: Likewise.
        frequency: Likewise.
        turn: Likewise.
        moment: Likewise.
        drawn: Result: wavenumber along and across the wind [rad/m], angular frequency [rad/s], phase [rad], (4, n).
    """
    whole = variance[-1]
    for n in range(place.size):
        low, high = place[n] & np.uint64(0xFFFFFFFF), place[n] >> np.uint64(32)
        w0, w1, w2, w3 = philox(low, high, code, 0, k0, k1)
        along, across, turning = 0.0, 0.0, 0.0
        q2 = phase[n] * phase[n]
        mean, from_variance = q2 * whole, 0.0
        if mean > MOST:
            from_variance = whole - MOST / q2
            mean = MOST
            along, across, turning = _gaussian(
                w2, w3, low, high, code, k0, k1, phase[n], from_variance, variance, moment
            )
        count = _poisson(unit(w0), mean, some and from_variance == 0.0)
        for quantum in range(count):
            u0, u1, u2, _ = philox(low, high, code, quantum + 2, k0, k1)
            share = from_variance + unit(u0) * (whole - from_variance)
            row = row_below(variance, share)
            step = max(variance[row + 1] - variance[row], 1e-300)
            part = min(1.0, max(0.0, (share - variance[row]) / step))
            k = wavenumber[row] + part * (wavenumber[row + 1] - wavenumber[row])
            omega = frequency[row] + part * (frequency[row + 1] - frequency[row])
            angle = _turned(turn, (row + part) / (wavenumber.size - 1), unit(u1))
            sign = 1.0 if u2 & np.uint32(1) else -1.0
            along += sign * k * math.cos(angle)
            across += sign * k * math.sin(angle)
            turning += sign * omega
        drawn[0, n], drawn[1, n], drawn[2, n] = along, across, turning
        drawn[3, n] = 2 * math.pi * unit(w1)


@njit(cache=True, nogil=True, error_model="numpy")
def _gaussian(
    w2: np.uint32, w3: np.uint32, low: np.uint64, high: np.uint64, code: int, k0: int, k1: int, phase: float,
    upto: float, variance: Floats, moment: Floats,
) -> tuple[float, float, float]:  # fmt: skip
    """Wavenumbers and frequency that all quanta of the longer waves add up to."""
    row = row_below(variance, upto)
    part = min(1.0, (upto - variance[row]) / max(variance[row + 1] - variance[row], 1e-300))
    ahead = moment[0, row] + part * (moment[0, row + 1] - moment[0, row])
    aside = moment[1, row] + part * (moment[1, row + 1] - moment[1, row])
    speed = moment[2, row] + part * (moment[2, row + 1] - moment[2, row])
    both = moment[3, row] + part * (moment[3, row + 1] - moment[3, row])
    v0, v1, _, _ = philox(low, high, code, 1, k0, k1)
    r, s = math.sqrt(-2 * math.log(unit(w2))), math.sqrt(-2 * math.log(unit(v0)))
    a, b = 2 * math.pi * unit(w3), 2 * math.pi * unit(v1)
    first, second, third = r * math.cos(a), r * math.sin(a), s * math.cos(b)
    root = math.sqrt(max(ahead, 1e-300))
    shared = both / root
    own = math.sqrt(max(speed - shared * shared, 0.0))
    return phase * root * first, phase * math.sqrt(aside) * second, phase * (shared * first + own * third)


@njit(cache=True, nogil=True, error_model="numpy")
def _poisson(u: float, mean: float, some: bool) -> int:
    """A Poisson number from a uniform one, at least one if asked for."""
    chance = math.exp(-mean)
    if some:
        u = chance + u * -math.expm1(-mean)
    count, total = 0, chance
    while u > total and count < 64:
        count += 1
        chance *= mean / count
        total += chance
    return max(count, 1) if some else count


@njit(cache=True, nogil=True, error_model="numpy")
def _turned(turn: Floats, length: float, chance: float) -> float:
    """Direction of a wave re the wind's [rad], between the entries of the table."""
    x, y = length * (turn.shape[0] - 1), chance * (turn.shape[1] - 1)
    i, j = min(int(x), turn.shape[0] - 2), min(int(y), turn.shape[1] - 2)
    p, q = x - i, y - j
    here = turn[i, j] + q * (turn[i, j + 1] - turn[i, j])
    there = turn[i + 1, j] + q * (turn[i + 1, j + 1] - turn[i + 1, j])
    return here + p * (there - here)
