"""Scattering by smooth flat facets of a body: Kirchhoff's integral in closed form.

On a smooth face the field is that of specular reflection, as if the face had no edges: Kirchhoff's approximation. Over
a facet so small that wavefronts are flat on it, the phase is linear and the integral has a closed form. It
includes the specular reflection, its side lobes, and the interference of the facets of a curved body.

Valid: near the specular direction, for bodies of many wavelengths. Creeping waves, diffraction at edges beyond
Kirchhoff's approximation, and sound inside the body are left out.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
NEAR = 0.5  # largest difference of the corners' phases for the series [rad]
TERMS = 12  # of the series: the first omitted term is below 1e-15


@dataclass(frozen=True, slots=True)
class KirchhoffFacet:
    """Flat facet with specular reflection: the coherent part of its echo."""

    reflection: float = 1.0
    """Pressure reflection coefficient [1]: 1 for a rigid body, -1 for an air-filled one."""

    def echoes(
        self, corners: Floats, normal: Floats, arriving: Floats, leaving: Floats, wavenumber: Floats
    ) -> Complexes:
        """Scattered pressure at 1 m of facets under incident waves of unit pressure [m].

        The phase refers to the centre of the facet: multiply by the phases of both legs to it.

        Args:
            corners: Corners of each triangle relative to its centroid [m], shape (n, 3, 3).
            normal: Unit normals into the water, shape (n, 3).
            arriving: Directions of travel towards the facets from the transmitter, shape (p, n, 3).
            leaving: Directions of travel towards the facets from the receiver, shape (p, n, 3).
            wavenumber: Wavenumber at each facet [rad/m], shape (n,).

        Returns:
            (j / wavelength) R (sine_in + sine_out) / 2 times the integral of exp(-j k (arriving + leaving) . x) over
            the facet, shape (p, n); sines are of grazing angles. 0 where either direction is behind the facet.

        Source: Kirchhoff's integral for a plane wave, as in Pierce (1989), Acoustics, ch. 5 (not verified); the mean of
            both ends' cosines keeps it reciprocal. An infinite plate gives R / (2 distance), the image source.
        """
        side = corners[:, 1:] - corners[:, :1]
        area = np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1) / 2
        echo = np.empty(arriving.shape[:2], complex)
        _echoes(self.reflection, corners, area, normal, arriving, leaving, wavenumber, echo)
        return echo


@njit(cache=True, nogil=True, error_model="numpy")
def mean_phasor(a: float, b: float, c: float) -> complex:
    """Mean of exp(j phase) over a triangle, from the phases at its corners [rad]."""
    low, high = min(a, b, c), max(a, b, c)
    middle = a + b + c - low - high
    if high - low < NEAR:
        return _series(a, b, c)
    lower, upper = _difference(low, middle), _difference(middle, high)
    return -2.0 * (upper - lower) / (high - low)


@njit(cache=True, nogil=True, error_model="numpy")
def _difference(a: float, b: float) -> complex:
    """First divided difference of exp(j x)."""
    half = (b - a) / 2
    sinc = math.sin(half) / half if abs(half) > 1e-8 else 1.0
    turn = (a + b) / 2
    return sinc * complex(-math.sin(turn), math.cos(turn))


@njit(cache=True, nogil=True, error_model="numpy")
def _series(a: float, b: float, c: float) -> complex:
    """Mean as a series about the central phase: 2 j^n h_n / (n + 2)!, h_n the complete symmetric polynomials."""
    middle = (a + b + c) / 3
    x, y, z = a - middle, b - middle, c - middle
    square, cube = (x * x + y * y + z * z) / 2, (x * x * x + y * y * y + z * z * z) / 3
    before, last, now = 0.0, 1.0, 0.0  # h_-1, h_0, h_1: the sum of x, y, z is 0
    total, power, factorial = 1.0 + 0j, 1j, 6.0
    for n in range(2, TERMS + 1):
        before, last, now = last, now, square * last + cube * before
        power *= 1j
        factorial *= n + 2
        total += 2.0 * power * now / factorial
    return total * complex(math.cos(middle), math.sin(middle))


@njit(cache=True, nogil=True, error_model="numpy")
def _echoes(
    reflection: float, corners: Floats, area: Floats, normal: Floats, arriving: Floats, leaving: Floats,
    wavenumber: Floats, echo: Complexes,
) -> None:  # fmt: skip
    """Fill `echo`, see `KirchhoffFacet.echoes`."""
    for p in range(echo.shape[0]):
        for n in range(echo.shape[1]):
            sine_in, sine_out = 0.0, 0.0
            a, b, c = 0.0, 0.0, 0.0
            for axis in range(3):
                into, back = arriving[p, n, axis], leaving[p, n, axis]
                sine_in -= into * normal[n, axis]
                sine_out -= back * normal[n, axis]
                a -= (into + back) * corners[n, 0, axis]
                b -= (into + back) * corners[n, 1, axis]
                c -= (into + back) * corners[n, 2, axis]
            if sine_in <= 0 or sine_out <= 0:
                echo[p, n] = 0.0
                continue
            k = wavenumber[n]
            strength = reflection * k / (2 * math.pi) * (sine_in + sine_out) / 2 * area[n]
            echo[p, n] = 1j * strength * mean_phasor(k * a, k * b, k * c)
