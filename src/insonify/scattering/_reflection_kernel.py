"""Kernel of the reflection coefficient of a fluid sediment: numbers in, numbers out."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

LEAST_SINE = 1e-12
"""Smallest sine of a grazing angle, which keeps the limit at 0 finite [1]."""
LEAST_ROOT = 1e-150
"""Smallest larger part of the vertical wavenumber, by which the smaller one is divided [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def reflect_off_fluid(
    sine: NDArray[np.float64], density_ratio: float, offset: complex, coefficient: NDArray[Any]
) -> None:
    """Pressure reflection coefficients, see `insonify.scattering.reflection`.

    Args:
        sine: Sines of the grazing angle [1], (n,).
        density_ratio: Density over that of the water above [1].
        offset: Square of the wavenumber in the sediment over that in the water, less 1 [1].
        coefficient: Result [1], (n,).
    """
    for n in range(sine.size):
        s = LEAST_SINE if sine[n] < LEAST_SINE else sine[n]  # a gap stays a gap
        square = offset.real + s * s
        root = math.sqrt((math.sqrt(square * square + offset.imag * offset.imag) + abs(square)) / 2)
        larger = LEAST_ROOT if root < LEAST_ROOT else root
        smaller = offset.imag / (2 * larger)
        real, imaginary = (larger, smaller) if square >= 0 else (smaller, larger)
        above, below = density_ratio * s - real, density_ratio * s + real
        # quotient of (above, -imaginary) and (below, imaginary), by the larger part of the latter
        if abs(below) >= abs(imaginary):
            ratio = imaginary / below
            scale = 1 / (below + imaginary * ratio)
            quotient = complex((above - imaginary * ratio) * scale, (-imaginary - above * ratio) * scale)
        else:
            ratio = below / imaginary
            scale = 1 / (imaginary + below * ratio)
            quotient = complex((above * ratio - imaginary) * scale, (-imaginary * ratio - above) * scale)
        coefficient[n] = quotient.conjugate()
