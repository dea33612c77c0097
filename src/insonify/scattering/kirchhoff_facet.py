"""Scattering by smooth flat facets of a body: Kirchhoff's integral in closed form.

On a smooth face the field is that of specular reflection, as if the face had no edges: Kirchhoff's approximation. Over
a facet so small that wavefronts are flat on it, the phase is linear and the integral has a closed form. It
includes the specular reflection, its side lobes, and the interference of the facets of a curved body.

A short pulse changes within the delays of a facet. The facet is then given six times, once for each corner and once for
each middle of a side, with the delay of that node and the part of the integral that its quadratic shape function takes:
the envelope of the echo is interpolated over the facet, and neighbours cancel away from the specular direction.

Valid: near the specular direction, for bodies of many wavelengths. Creeping waves, diffraction at edges beyond
Kirchhoff's approximation, and sound inside the body are left out.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
SERIES_RANGE = 0.5  # range of phases below which their divided difference is a series [rad]
TERMS = 12  # of the series: the first omitted term is below 1e-15


class FacetWaves(NamedTuple):
    """Waves from both ends at n facets, p pairs of them."""

    from_transmitter: Floats
    """Unit directions of travel from the transmitter [1], (p, n, 3)."""
    from_receiver: Floats
    """Unit directions of travel from the receiver [1], (p, n, 3)."""
    curvature_in: Floats
    """Curvature of the wavefronts from the transmitter [1/m], (p, n)."""
    curvature_out: Floats
    """Curvature of the wavefronts from the receiver [1/m], (p, n)."""
    wavenumber: Floats
    """Wavenumber [rad/m], (n,)."""


@dataclass(frozen=True, slots=True)
class KirchhoffFacet:
    """Flat facet with specular reflection: the coherent part of its echo."""

    reflection: float = 1.0
    """Pressure reflection coefficient [1]: 1 for a rigid body, -1 for an air-filled one."""

    def echoes(
        self, corners: Floats, normal: Floats, from_transmitter: Floats, from_receiver: Floats, radius_in: Floats,
        radius_out: Floats, wavenumber: Floats,
    ) -> Complexes:  # fmt: skip
        """Scattered pressure at 1 m of facets under incident waves of unit pressure [m].

        The phase refers to the centre of the facet, or to its node: multiply by the phases of both legs to it.

        Args:
            corners: Corners of each triangle relative to its centroid [m], and the node whose delay and part of the
                integral the row has: the first corner, the middle of the first side, or 0 for the whole triangle.
                Shape (n, 4, 3); (n, 3, 3): all whole.
            normal: Unit normals into the water, shape (n, 3).
            from_transmitter: Unit directions of travel towards the facets from the transmitter, shape (p, n, 3).
            from_receiver: Unit directions of travel towards the facets from the receiver, shape (p, n, 3).
            radius_in: Radii of curvature of the wavefronts from the transmitter [m], shape (p, n).
            radius_out: Radii of curvature of the wavefronts from the receiver [m], shape (p, n).
            wavenumber: Wavenumber at each facet [rad/m], shape (n,).

        Returns:
            (j / wavelength) R (sine_in + sine_out) / 2 times the integral of exp(-j k path) over the facet [m], shape
            (p, n); sines are of grazing angles. 0 where either direction is behind the facet. The path is linear
            between the corners, and of second order there: facets have the same phases along a common side.

        Source: Kirchhoff's integral for a plane wave, as in Pierce (1989), Acoustics, ch. 5 (not verified); the mean of
            both sines keeps it reciprocal. An infinite plate gives R / (2 distance), the image source.
        """
        side = corners[:, 1:3] - corners[:, :1]
        area = np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1) / 2
        echo = np.empty(from_transmitter.shape[:2], complex)
        waves = FacetWaves(from_transmitter, from_receiver, 1 / radius_in, 1 / radius_out, wavenumber)
        _echoes(self.reflection, corners, area, normal, waves, echo)
        return echo


@njit(cache=True, nogil=True, error_model="numpy")
def mean_phasor(a: float, b: float, c: float) -> complex:
    """Mean of exp(j phase) over a triangle, from the phases at its corners [rad]."""
    return -2.0 * divided_difference(np.sort(np.array([a, b, c])))


@njit(cache=True, nogil=True, error_model="numpy")
def corner_phasor(a: float, b: float, c: float) -> complex:
    """Mean of exp(j phase) over a triangle times the quadratic shape function of the first corner.

    With barycentric coordinates u, v, w, the shape function is u (2 u - 1). The integral of u^k exp(j phase) is
    k! j^-(k + 2) times the divided difference of exp(j x) at the phases a (k + 1 times), b, c (Hermite and Genocchi).

    Args:
        a: Phase at the first corner [rad].
        b: Phase at the second corner [rad].
        c: Phase at the third corner [rad].
    """
    square = divided_difference(np.sort(np.array([a, a, a, b, c])))
    return 8.0 * square - 2j * divided_difference(np.sort(np.array([a, a, b, c])))


@njit(cache=True, nogil=True, error_model="numpy")
def side_phasor(a: float, b: float, c: float) -> complex:
    """Mean of exp(j phase) over a triangle times the quadratic shape function of the middle of its first side, 4 u v.

    Arguments and method as for `corner_phasor`.
    """
    return 8.0 * divided_difference(np.sort(np.array([a, a, b, b, c])))


@njit(cache=True, nogil=True, error_model="numpy")
def divided_difference(x: Floats) -> complex:
    """Divided difference of exp(j x) at increasing phases, some of which may be equal, of three or more [rad].

    Newton's table, in which divided differences of phases within less than `SERIES_RANGE` are series.
    """
    count = x.size
    if x[count - 1] - x[0] < SERIES_RANGE:
        return _difference_series(x)
    table = np.empty(count - 1, np.complex128)
    for k in range(count - 1):
        table[k] = _difference(x[k], x[k + 1])
    for order in range(2, count):
        for k in range(count - order):
            phase_range = x[k + order] - x[k]
            if phase_range < SERIES_RANGE:
                table[k] = _difference_series(x[k : k + order + 1])
            else:
                table[k] = (table[k + 1] - table[k]) / phase_range
    return table[0]


@njit(cache=True, nogil=True, error_model="numpy")
def _difference_series(x: Floats) -> complex:
    """Divided difference as a series about the mean phase: j^(m + n) h_n / (m + n)!, of m + 1 phases.

    h_n is the complete symmetric polynomial of degree n of the phases re their mean.
    """
    order, middle = x.size - 1, x.mean()
    symmetric = np.zeros(TERMS + 1)
    symmetric[0] = 1.0
    for k in range(x.size):
        for n in range(1, TERMS + 1):
            symmetric[n] += (x[k] - middle) * symmetric[n - 1]
    factor = 1.0 + 0j
    for n in range(1, order + 1):
        factor *= 1j / n
    total = factor
    for n in range(1, TERMS + 1):
        factor *= 1j / (order + n)
        total += factor * symmetric[n]
    return total * complex(math.cos(middle), math.sin(middle))


@njit(cache=True, nogil=True, error_model="numpy")
def _difference(a: float, b: float) -> complex:
    """First divided difference of exp(j x) at the phases a and b [rad]."""
    half = (b - a) / 2
    sinc = math.sin(half) / half if abs(half) > 1e-8 else 1.0
    middle = (a + b) / 2
    return sinc * complex(-math.sin(middle), math.cos(middle))


@njit(cache=True, nogil=True, error_model="numpy")
def _echoes(
    reflection: float, corners: Floats, area: Floats, normal: Floats, waves: FacetWaves, echo: Complexes
) -> None:  # fmt: skip
    """Fill `echo` [m], shape (p, n), as `KirchhoffFacet.echoes`; area of each facet [m^2], shape (n,)."""
    from_transmitter, from_receiver, curvature_in, curvature_out, wavenumber = waves
    plane_path, path = np.empty(3), np.empty(3)  # of each corner re the centroid, for plane and curved wavefronts [m]
    for p in range(echo.shape[0]):
        for n in range(echo.shape[1]):
            sine_in, sine_out = 0.0, 0.0
            for axis in range(3):
                sine_in -= from_transmitter[p, n, axis] * normal[n, axis]
                sine_out -= from_receiver[p, n, axis] * normal[n, axis]
            if sine_in <= 0 or sine_out <= 0:
                echo[p, n] = 0.0
                continue
            k = wavenumber[n]
            for corner in range(3):
                square, path_in, path_out = 0.0, 0.0, 0.0
                for axis in range(3):
                    x = corners[n, corner, axis]
                    square += x * x
                    path_in += from_transmitter[p, n, axis] * x
                    path_out += from_receiver[p, n, axis] * x
                plane_path[corner] = path_in + path_out
                twice_sagitta = (square - path_in**2) * curvature_in[p, n] + (square - path_out**2) * curvature_out[
                    p, n
                ]
                path[corner] = path_in + path_out + twice_sagitta / 2
            a, b, c = -k * path[0], -k * path[1], -k * path[2]
            scale = reflection * k / (2 * math.pi) * (sine_in + sine_out) / 2 * area[n]
            if corners.shape[1] == 3 or (corners[n, 3] == 0).all():
                echo[p, n] = 1j * scale * mean_phasor(a, b, c)
                continue
            is_corner = (corners[n, 3] == corners[n, 0]).all()
            node_path = plane_path[0] if is_corner else (plane_path[0] + plane_path[1]) / 2
            weighted_mean = corner_phasor(a, b, c) if is_corner else side_phasor(a, b, c)
            echo[p, n] = 1j * scale * complex(math.cos(k * node_path), math.sin(k * node_path)) * weighted_mean
