"""Kernel of a random delay field: sum of its waves along the paths of one family. Plain numbers and arrays."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def add_delay_waves(
    position: Floats, along: Floats, across: Floats, down: Floats, water_depth: float, fraction: Floats, wave: Floats,
    wave_phase: Floats, total: Floats,
) -> None:  # fmt: skip
    """Add the m waves of a field along n rays, each wave taken at one point of the ray, at its own fraction of it.

    A ray is unfolded straight through surface and bottom; the depth in the water is its distance from the nearest image
    of the surface. Horizontal coordinates are those of the scatterer grid, along its first and second axis.

    Args:
        position: Start of the rays: both horizontal coordinates, depth [m], (3,).
        along: First coordinate of the end of each ray [m], (n,).
        across: Second coordinate of the end of each ray [m], (n,).
        down: Unfolded depth of the end of each ray [m], (n,).
        water_depth: Distance between surface and bottom [m].
        fraction: Fraction of the ray at which each wave is taken [1], (m,).
        wave: Cycles per metre of each wave along both axes and down [1/m], (m, 3).
        wave_phase: Phase of each wave at the origin [cycles], (m,).
        total: Result, zero at first: the sum of all cosines [1], (n,).
    """
    period = 2 * water_depth
    for m in range(fraction.size):
        s = fraction[m]
        x, y, z = s * wave[m, 0], s * wave[m, 1], wave[m, 2]
        start = (1 - s) * (position[0] * wave[m, 0] + position[1] * wave[m, 1]) + wave_phase[m]
        start_depth = (1 - s) * position[2]
        for i in range(total.size):
            depth = start_depth + s * down[i]
            depth = abs(depth - period * np.rint(depth / period))
            cycles = start + x * along[i] + y * across[i] + z * depth
            # cos 2a = 1 - 2 sin^2 a, and Taylor's series of the sine to 6e-8
            a = np.pi * (cycles - np.rint(cycles))
            b = a * a
            sine = 1 / 362880 + b * (-1 / 39916800)
            sine = 1 + b * (-1 / 6 + b * (1 / 120 + b * (-1 / 5040 + b * sine)))
            total[i] += 1 - 2 * b * sine * sine
