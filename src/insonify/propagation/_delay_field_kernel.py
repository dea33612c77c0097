"""Kernel of a random delay field: sum of its waves along the paths of one family. Plain numbers and arrays."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def add_delay_waves(
    position: Floats, north: Floats, east: Floats, down: Floats, water_depth: float, part: Floats, wave: Floats,
    wave_phase: Floats, total: Floats,
) -> None:  # fmt: skip
    """Add the waves of a field, each taken at its own fraction of the path.

    A ray is unfolded straight through surface and bottom; the depth in the water is its distance from the nearest image
    the surface.

    Args:
        position: Start of the rays: north, east, depth [m], (3,).
        north: North coordinate of each end [m], (n,).
        east: East coordinate of each end [m], (n,).
        down: Unfolded depth of each end [m], (n,).
        water_depth: Distance between surface and bottom [m].
        part: Fraction of the path of each wave [1], (m,).
        wave: Cycles per metre to the north, to the east and down of each wave [1/m], (m, 3).
        wave_phase: Phase of each wave [cycles], (m,).
        total: Result: the sum of all cosines [1], (n,); filled with zeros at first.
    """
    period = 2 * water_depth
    for m in range(part.size):
        s = part[m]
        x, y, z = s * wave[m, 0], s * wave[m, 1], wave[m, 2]
        start = (1 - s) * (position[0] * wave[m, 0] + position[1] * wave[m, 1]) + wave_phase[m]
        below = (1 - s) * position[2]
        for i in range(total.size):
            depth = below + s * down[i]
            depth = abs(depth - period * np.rint(depth / period))
            cycles = start + x * north[i] + y * east[i] + z * depth
            # cos 2a = 1 - 2 sin^2 a, and Taylor's series of the sine to 6e-8
            a = np.pi * (cycles - np.rint(cycles))
            b = a * a
            sine = 1 / 362880 + b * (-1 / 39916800)
            sine = 1 + b * (-1 / 6 + b * (1 / 120 + b * (-1 / 5040 + b * sine)))
            total[i] += 1 - 2 * b * sine * sine
