"""Kirchhoff's integral over curved patches: phases of second order in two parameters, by Fresnel integrals."""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

PER_UNIT = 50
"""Entries of the table of Fresnel integrals per unit of their argument [1]."""
LARGEST = 30.0
"""Argument beyond which the asymptotic series is used [1]."""
SLOW = 7.0
"""Largest phase gradient that the Gauss-Legendre rule integrates [rad]."""
FLAT = 0.01
"""Second-order phase below which its series is used, where the slope is large [rad]."""
_NODE, _WEIGHT = (half[8:].copy() for half in np.polynomial.legendre.leggauss(16))


@lru_cache(maxsize=1)
def fresnel_tail() -> Complexes:
    """Table of the integral of exp(j pi (t^2 - x^2) / 2) over t from x to infinity [1], from x = 0 on.

    Source: Abramowitz & Stegun (1964) 7.3.22 with 7.1.3: it is (1 + j) / 2 times erfc of a complex argument.
    """
    from scipy.special import wofz  # loads in a sixth of a second, only where needed

    x = np.arange(int(LARGEST * PER_UNIT) + 4) / PER_UNIT
    return np.asarray((1 + 1j) / 2 * wofz(1j * np.sqrt(np.pi) / 2 * (1 - 1j) * x))


@njit(cache=True, nogil=True, error_model="numpy")
def _tail(x: float, table: Complexes) -> complex:
    """Integral of `fresnel_tail` at a positive x."""
    if x >= LARGEST:
        square = 1 / (math.pi * x * x)
        return complex(square / (math.pi * x) * (1 - 15 * square**2), (1 - 3 * square**2) / (math.pi * x))
    index = x * PER_UNIT
    row = max(int(index), 1)
    t = index - row
    a, b = -t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2
    c, d = -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6
    return a * table[row - 1] + b * table[row] + c * table[row + 1] + d * table[row + 2]


@njit(cache=True, nogil=True, error_model="numpy")
def moments(slope: float, bend: float, table: Complexes) -> tuple[complex, complex, complex, complex]:
    """Means of exp(j (slope u + bend u^2)), and of u, u^2 and u^3 times that, over u from -1 to 1 [1].

    Args:
        slope: First-order phase [rad].
        bend: Second-order phase [rad].
        table: Table of `fresnel_tail`.
    """
    if bend < 0:
        mean, first, second, third = moments(-slope, -bend, table)
        return mean.conjugate(), first.conjugate(), second.conjugate(), third.conjugate()
    if abs(slope) + 2 * bend <= SLOW:
        mean, first, second, third = 0j, 0j, 0j, 0j
        for node, weight in zip(_NODE, _WEIGHT):  # noqa: B905 - numba's zip has no strict
            turn = bend * node * node
            phasor = complex(math.cos(turn), math.sin(turn))
            even = weight * math.cos(slope * node) * phasor
            mean += even
            second += node * node * even
            odd = weight * node * math.sin(slope * node) * phasor
            first += odd
            third += node * node * odd
        return mean, 1j * first, second, 1j * third
    s, c = math.sin(slope), math.cos(slope)
    if bend < FLAT:
        x = slope
        second = complex(s / x + 2 * c / x**2 - 2 * s / x**3)
        third = -c / x + 3 * s / x**2 + 6 * c / x**3 - 6 * s / x**4
        fourth = s / x + 4 * c / x**2 - 12 * s / x**3 - 24 * c / x**4 + 24 * s / x**5
        fifth = (5 * fourth - c) / x
        return (
            s / x + 1j * bend * second, 1j * (s - x * c) / x**2 - bend * third, second + 1j * bend * fourth,
            1j * third - bend * fifth,
        )  # fmt: skip
    end = complex(math.cos(bend), math.sin(bend))
    high, low = end * complex(c, s), end * complex(c, -s)
    scale, middle = math.sqrt(2 * bend / math.pi), slope / (2 * bend)
    above, below = scale * (middle + 1), scale * (middle - 1)
    total = -math.copysign(1.0, above) * _tail(abs(above), table) * high
    total += math.copysign(1.0, below) * _tail(abs(below), table) * low
    if above > 0 > below:
        turn = slope * middle / 2
        total += (1 + 1j) * complex(math.cos(turn), -math.sin(turn))
    mean = total / (2 * scale)
    first = ((high - low) / 2j - slope * mean) / (2 * bend)
    second = ((high + low) / 2 - mean - 1j * slope * first) / (2j * bend)
    return mean, first, second, ((high - low) / 2 - 2 * first - 1j * slope * second) / (2j * bend)


@njit(cache=True, nogil=True, error_model="numpy")
def side_moments(slope: float, bend: float, side: float, table: Complexes) -> tuple[complex, complex, complex]:
    """The first three `moments` of the part of a patch that has the delay of one side: (1 + side u) / 2 of it.

    Args:
        slope: First-order phase [rad].
        bend: Second-order phase [rad].
        side: The side, -1 or 1; 0 for the whole patch.
        table: Table of `fresnel_tail`.
    """
    mean, first, second, third = moments(slope, bend, table)
    if side == 0:
        return mean, first, second
    return (mean + side * first) / 2, (first + side * second) / 2, (second + side * third) / 2


@njit(cache=True, nogil=True, error_model="numpy")
def patch_pressures(
    reflection: float, terms: Floats, area: Floats, normal: Floats, arriving: Floats, leaving: Floats,
    length_in: Floats, length_out: Floats, wavenumber: Floats, table: Complexes, echo: Complexes,
) -> None:  # fmt: skip
    """Fill `echo`, see `insonify.scattering.kirchhoff_patch.KirchhoffPatch.echoes`."""
    d = np.empty((8, 3))
    for n in range(echo.shape[1]):
        d[:] = terms[n]
        k = wavenumber[n]
        for p in range(echo.shape[0]):
            sine_in, sine_out = 0.0, 0.0
            turn = np.zeros(7)  # along u, along v, u^2, v^2, u v; growth along u, along v
            in_u, in_v, out_u, out_v, uu, vv, uv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for axis in range(3):
                into, back = arriving[p, n, axis], leaving[p, n, axis]
                sine_in -= into * normal[n, axis]
                sine_out -= back * normal[n, axis]
                for term in range(7):
                    turn[term] += (into + back) * d[term, axis]
                in_u += into * d[0, axis]
                in_v += into * d[1, axis]
                out_u += back * d[0, axis]
                out_v += back * d[1, axis]
                uu += d[0, axis] * d[0, axis]
                vv += d[1, axis] * d[1, axis]
                uv += d[0, axis] * d[1, axis]
            if not (sine_in > 0 and sine_out > 0):
                echo[p, n] = 0.0
                continue
            near_in, near_out = 1 / length_in[p, n], 1 / length_out[p, n]
            bend_u = turn[2] + ((uu - in_u**2) * near_in + (uu - out_u**2) * near_out) / 2
            bend_v = turn[3] + ((vv - in_v**2) * near_in + (vv - out_v**2) * near_out) / 2
            twist = turn[4] + (uv - in_u * in_v) * near_in + (uv - out_u * out_v) * near_out
            mean_u, first_u, second_u = side_moments(-k * turn[0], -k * bend_u, d[7, 0], table)
            mean_v, first_v, second_v = side_moments(-k * turn[1], -k * bend_v, d[7, 1], table)
            twist *= k
            total = mean_u * mean_v - 1j * twist * first_u * first_v - twist**2 / 2 * second_u * second_v
            # the projected area is that of the centre, and grows along u and v
            total *= (sine_in + sine_out) / 2
            total -= (turn[5] * first_u * mean_v + turn[6] * mean_u * first_v) / 2
            shift = k * (turn[0] * d[7, 0] + turn[1] * d[7, 1])  # the delay is that of the side
            total *= complex(math.cos(shift), math.sin(shift))
            echo[p, n] = 1j * reflection * k / (2 * math.pi) * area[n] * total
