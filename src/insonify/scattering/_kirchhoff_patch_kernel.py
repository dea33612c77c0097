"""Kirchhoff's integral over curved patches: phases of second order in u and v, each -1 to 1, by Fresnel integrals."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

PER_UNIT = 50
"""Entries of the table of Fresnel integrals per unit of their argument [1]."""
TABLE_END = 30.0
"""Argument of the Fresnel integral beyond which the asymptotic series is used [1]."""
QUADRATURE_GRADIENT = 7.0
"""Largest phase gradient over u that the Gauss-Legendre rule integrates [rad]."""
SERIES_QUADRATIC = 0.01
"""Quadratic phase below which its first-order series is used beyond `QUADRATURE_GRADIENT` [rad]."""
# Positive half of a rule of 16 points: even and odd parts of the integrand are summed apart.
_NODE, _WEIGHT = (values[8:].copy() for values in np.polynomial.legendre.leggauss(16))


@lru_cache(maxsize=1)
def fresnel_tail() -> Complexes:
    """Table of the integral of exp(j pi (t^2 - x^2) / 2) over t from x to infinity [1], from x = 0 on.

    Source: Abramowitz & Stegun (1964) 7.3.22 with 7.1.3: it is (1 + j) / 2 times erfc of a complex argument.
    """
    from scipy.special import wofz  # loads in a sixth of a second, only where needed

    x = np.arange(int(TABLE_END * PER_UNIT) + 4) / PER_UNIT
    return np.asarray((1 + 1j) / 2 * wofz(1j * np.sqrt(np.pi) / 2 * (1 - 1j) * x))


@njit(cache=True, nogil=True, error_model="numpy")
def _tail(x: float, table: Complexes) -> complex:
    """Integral of `fresnel_tail` at x, 0 or more [1]: cubic interpolation in its table, beyond it the series."""
    if x >= TABLE_END:
        square = 1 / (math.pi * x * x)
        return complex(square / (math.pi * x) * (1 - 15 * square**2), (1 - 3 * square**2) / (math.pi * x))
    index = x * PER_UNIT
    row = max(int(index), 1)
    t = index - row
    a, b = -t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2
    c, d = -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6
    return a * table[row - 1] + b * table[row] + c * table[row + 1] + d * table[row + 2]


@njit(cache=True, nogil=True, error_model="numpy")
def moments(linear: float, quadratic: float, table: Complexes) -> tuple[complex, complex, complex, complex]:
    """Means of exp(j (linear u + quadratic u^2)), and of u, u^2 and u^3 times that, over u from -1 to 1 [1].

    Args:
        linear: Linear phase, at u = 1 [rad].
        quadratic: Quadratic phase, at u = 1 [rad].
        table: Table of `fresnel_tail`.
    """
    if quadratic < 0:
        mean, first, second, third = moments(-linear, -quadratic, table)
        return mean.conjugate(), first.conjugate(), second.conjugate(), third.conjugate()
    if abs(linear) + 2 * quadratic <= QUADRATURE_GRADIENT:
        mean, first, second, third = 0j, 0j, 0j, 0j
        for node, weight in zip(_NODE, _WEIGHT):  # noqa: B905 - numba's zip has no strict
            phase = quadratic * node * node
            phasor = complex(math.cos(phase), math.sin(phase))
            even = weight * math.cos(linear * node) * phasor
            mean += even
            second += node * node * even
            odd = weight * node * math.sin(linear * node) * phasor
            first += odd
            third += node * node * odd
        return mean, 1j * first, second, 1j * third
    s, c = math.sin(linear), math.cos(linear)
    if quadratic < SERIES_QUADRATIC:
        x = linear
        second = complex(s / x + 2 * c / x**2 - 2 * s / x**3)
        third = -c / x + 3 * s / x**2 + 6 * c / x**3 - 6 * s / x**4
        fourth = s / x + 4 * c / x**2 - 12 * s / x**3 - 24 * c / x**4 + 24 * s / x**5
        fifth = (5 * fourth - c) / x
        return (
            s / x + 1j * quadratic * second, 1j * (s - x * c) / x**2 - quadratic * third,
            second + 1j * quadratic * fourth, 1j * third - quadratic * fifth,
        )  # fmt: skip
    quadratic_phasor = complex(math.cos(quadratic), math.sin(quadratic))
    high, low = quadratic_phasor * complex(c, s), quadratic_phasor * complex(c, -s)  # at u = 1 and u = -1
    # The phase is quadratic (u + shift)^2 - linear shift / 2; `above`, `below`: Fresnel's arguments at u = 1 and -1.
    scale, shift = math.sqrt(2 * quadratic / math.pi), linear / (2 * quadratic)
    above, below = scale * (shift + 1), scale * (shift - 1)
    total = -math.copysign(1.0, above) * _tail(abs(above), table) * high
    total += math.copysign(1.0, below) * _tail(abs(below), table) * low
    if above > 0 > below:
        phase = linear * shift / 2
        total += (1 + 1j) * complex(math.cos(phase), -math.sin(phase))
    mean = total / (2 * scale)
    first = ((high - low) / 2j - linear * mean) / (2 * quadratic)
    second = ((high + low) / 2 - mean - 1j * linear * first) / (2j * quadratic)
    return mean, first, second, ((high - low) / 2 - 2 * first - 1j * linear * second) / (2j * quadratic)


@njit(cache=True, nogil=True, error_model="numpy")
def side_moments(linear: float, quadratic: float, side: float, table: Complexes) -> tuple[complex, complex, complex]:
    """Means over u of exp(j phase), and of u and u^2 times that, weighted by the part of a patch that one side has [1].

    The part is (1 + side u) / 2, or 1 for the whole patch; the phase is that of `moments`.

    Args:
        linear: Linear phase, at u = 1 [rad].
        quadratic: Quadratic phase, at u = 1 [rad].
        side: u of the side, -1 or 1; 0 for the whole patch.
        table: Table of `fresnel_tail`.
    """
    mean, first, second, third = moments(linear, quadratic, table)
    if side == 0:
        return mean, first, second
    return (mean + side * first) / 2, (first + side * second) / 2, (second + side * third) / 2


@njit(cache=True, nogil=True, error_model="numpy")
def patch_pressures(
    reflection: float, terms: Floats, area: Floats, normal: Floats, from_transmitter: Floats, from_receiver: Floats,
    radius_in: Floats, radius_out: Floats, wavenumber: Floats, table: Complexes, echo: Complexes,
) -> None:  # fmt: skip
    """Fill `echo`, see `insonify.scattering.kirchhoff_patch.KirchhoffPatch.echoes`."""
    d = np.empty((8, 3))
    for n in range(echo.shape[1]):
        d[:] = terms[n]
        k = wavenumber[n]
        for p in range(echo.shape[0]):
            sine_in, sine_out = 0.0, 0.0
            path = np.zeros(7)  # u, v, u^2, v^2, u v [m]; minus the growth of the sum of sines along u, v [1]
            in_u, in_v, out_u, out_v, uu, vv, uv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for axis in range(3):
                direction_in, direction_out = from_transmitter[p, n, axis], from_receiver[p, n, axis]
                sine_in -= direction_in * normal[n, axis]
                sine_out -= direction_out * normal[n, axis]
                for term in range(7):
                    path[term] += (direction_in + direction_out) * d[term, axis]
                in_u += direction_in * d[0, axis]
                in_v += direction_in * d[1, axis]
                out_u += direction_out * d[0, axis]
                out_v += direction_out * d[1, axis]
                uu += d[0, axis] * d[0, axis]
                vv += d[1, axis] * d[1, axis]
                uv += d[0, axis] * d[1, axis]
            if not (sine_in > 0 and sine_out > 0):
                echo[p, n] = 0.0
                continue
            curvature_in, curvature_out = 1 / radius_in[p, n], 1 / radius_out[p, n]
            path_uu = path[2] + ((uu - in_u**2) * curvature_in + (uu - out_u**2) * curvature_out) / 2
            path_vv = path[3] + ((vv - in_v**2) * curvature_in + (vv - out_v**2) * curvature_out) / 2
            mixed = path[4] + (uv - in_u * in_v) * curvature_in + (uv - out_u * out_v) * curvature_out
            mean_u, first_u, second_u = side_moments(-k * path[0], -k * path_uu, d[7, 0], table)
            mean_v, first_v, second_v = side_moments(-k * path[1], -k * path_vv, d[7, 1], table)
            mixed *= k  # path [m] to phase [rad]
            total = mean_u * mean_v - 1j * mixed * first_u * first_v - mixed**2 / 2 * second_u * second_v
            # the projected area is that of the centre, and grows along u and v
            total *= (sine_in + sine_out) / 2
            total -= (path[5] * first_u * mean_v + path[6] * mean_u * first_v) / 2
            phase = k * (path[0] * d[7, 0] + path[1] * d[7, 1])  # the delay is that of the side
            total *= complex(math.cos(phase), math.sin(phase))
            echo[p, n] = 1j * reflection * k / (2 * math.pi) * area[n] * total
