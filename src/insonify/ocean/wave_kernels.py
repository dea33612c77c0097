"""Sum of many waves at many positions: arithmetic only.

The inner loop runs over positions, so that it is vectorised, and every position adds its waves in the
same order with plain rounding: the results are bit-identical however the positions are grouped or split.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]

BLOCK = 256
"""Number of positions whose sums stay in the first-level cache during the loop over waves."""

# Taylor's series of sin(2 pi y) for |y| <= 1/4: the first term left out is 7e-10.
_S = tuple((-1) ** n * (2 * math.pi) ** (2 * n + 1) / math.factorial(2 * n + 1) for n in range(7))
_S0, _S1, _S2, _S3, _S4, _S5, _S6 = _S


@njit(cache=True, nogil=True, error_model="numpy")
def cosine_of_cycles(cycles: float) -> float:
    """Cosine of a phase in cycles [1], accurate to 1e-9 for any number of cycles."""
    # One minus the distance from a quarter of the nearest whole number is always within a quarter cycle of zero.
    y = 0.25 - abs(cycles - np.floor(cycles + 0.5))
    z = y * y
    return y * (_S0 + z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6))))))


@njit(cache=True, nogil=True, error_model="numpy")
def fill_heights(positions: Floats, waves: Floats, amplitude: Floats, height: Floats) -> None:
    """Compute the height of the surface, the sum of its waves.

    Args:
        positions: North [m], east [m] and time [s] of each position, shape (3, n).
        waves: Cycles per metre north and east, per second (negative), and at the origin, shape (4, m).
        amplitude: Amplitude of each wave [m], shape (m,).
        height: Filled with the height, up positive [m], shape (n,).
    """
    for start in range(0, height.size, BLOCK):
        stop = min(start + BLOCK, height.size)
        n, e, t, h = positions[0, start:stop], positions[1, start:stop], positions[2, start:stop], height[start:stop]
        h[:] = 0.0
        for m in range(amplitude.size):
            a, kn, ke, f, phase = amplitude[m], waves[0, m], waves[1, m], waves[2, m], waves[3, m]
            for p in range(h.size):
                h[p] += a * cosine_of_cycles(kn * n[p] + ke * e[p] + f * t[p] + phase)


@njit(cache=True, nogil=True, error_model="numpy")
def fill_motion(positions: Floats, waves: Floats, amplitude: Floats, motion: Floats) -> None:
    """Compute height, slopes and vertical speed of the surface, sums over its waves.

    Args:
        positions: North [m], east [m] and time [s] of each position, shape (3, n).
        waves: Cycles per metre north and east, per second (negative), and at the origin, shape (4, m).
        amplitude: Amplitude of each wave [m], shape (m,).
        motion: Filled with height [m], slope north [1], slope east [1] and upward speed [m/s], shape (4, n).
    """
    two_pi = 2 * math.pi
    for start in range(0, motion.shape[1], BLOCK):
        stop = min(start + BLOCK, motion.shape[1])
        n, e, t = positions[0, start:stop], positions[1, start:stop], positions[2, start:stop]
        height, slope_n, slope_e, speed = (
            motion[0, start:stop],
            motion[1, start:stop],
            motion[2, start:stop],
            motion[3, start:stop],
        )
        motion[:, start:stop] = 0.0
        for m in range(amplitude.size):
            a, kn, ke, f, phase = amplitude[m], waves[0, m], waves[1, m], waves[2, m], waves[3, m]
            north, east, up = -a * two_pi * kn, -a * two_pi * ke, -a * two_pi * f
            for p in range(height.size):
                cycles = kn * n[p] + ke * e[p] + f * t[p] + phase
                sine = cosine_of_cycles(cycles - 0.25)
                height[p] += a * cosine_of_cycles(cycles)
                slope_n[p] += north * sine
                slope_e[p] += east * sine
                speed[p] += up * sine
