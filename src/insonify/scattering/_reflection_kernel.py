"""Kernel of the reflection coefficient of a fluid sediment."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

LEAST_SINE = 1e-12
"""Smallest sine of a grazing angle, which keeps the limit at 0 finite [1]."""
LEAST_ROOT = 1e-150
"""Floor of the larger of real and imaginary part of the vertical wavenumber, by which the other is computed [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def reflect_off_fluid(
    sine: NDArray[np.float64], density_ratio: float, kappa2_minus_1: complex, coefficient: NDArray[Any]
) -> None:
    """Pressure reflection coefficients, as `insonify.scattering.reflection.reflection_coefficient`.

    Args:
        sine: Sines of the grazing angle [1], (n,).
        density_ratio: Density over that of the water above [1].
        kappa2_minus_1: Square of the wavenumber in the sediment over that in the water, less 1 [1].
        coefficient: Result [1], (n,).
    """
    for n in range(sine.size):
        s = LEAST_SINE if sine[n] < LEAST_SINE else sine[n]  # a gap stays a gap
        square = kappa2_minus_1.real + s * s
        root = math.sqrt((math.sqrt(square * square + kappa2_minus_1.imag * kappa2_minus_1.imag) + abs(square)) / 2)
        larger = LEAST_ROOT if root < LEAST_ROOT else root
        smaller = kappa2_minus_1.imag / (2 * larger)
        real, imaginary = (larger, smaller) if square >= 0 else (smaller, larger)
        numerator, denominator = density_ratio * s - real, density_ratio * s + real
        # quotient of (numerator, -imaginary) and (denominator, imaginary), divided by the larger part of the latter
        if abs(denominator) >= abs(imaginary):
            ratio = imaginary / denominator
            scale = 1 / (denominator + imaginary * ratio)
            quotient = complex((numerator - imaginary * ratio) * scale, (-imaginary - numerator * ratio) * scale)
        else:
            ratio = denominator / imaginary
            scale = 1 / (imaginary + denominator * ratio)
            quotient = complex((numerator * ratio - imaginary) * scale, (-imaginary * ratio - numerator) * scale)
        coefficient[n] = quotient.conjugate()
