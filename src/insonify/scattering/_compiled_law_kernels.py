"""Cross sections from unit vectors, as arithmetic that compilers vectorise.

Everything is float32 and without branches or calls: powers use polynomials of the logarithm, the Kirchhoff integral
a table of its logarithm. The scalar functions are the physics; the loops below them are only loops.

Compilers do not vectorise a loop that reads a table at an index computed in the same iteration. So a group
of evaluations passes three loops: indices into the table, table reads, cross sections. The parameters of a sediment
contain no arrays (reference counting inside a loop would cost more than the physics), and all loops start
at 0 (an index that might be negative is checked).
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scattering.scattering_geometry import SPECULAR_BLUR2
from insonify.scattering.sediment_volume import OUTER_WAVENUMBER, STRONGEST

Singles = NDArray[np.float32]

LEAST_LOG2, LOG2_STEP = -24.0, 0.125
"""First entry and step of a table of log2 I over log2 q [octaves]."""


class SedimentParameters(NamedTuple):
    """Parameters of a sediment at one frequency."""

    density: np.float32
    """Density ratio [1]."""
    kappa2_minus_1_real: np.float32
    """Real part of kappa^2 - 1, square of the sediment's wavenumber over the water's, less one [1]."""
    kappa2_minus_1_imag: np.float32
    """Imaginary part of kappa^2 - 1 [1]."""
    log2_q: np.float32
    """log2 of q at unit vertical and transverse change [1]."""
    alpha: np.float32
    """Hurst exponent [1]."""
    rough: np.float32
    """Weight of the surface: 1/(8 pi), or 0 without surface [1]."""
    isotropic: np.float32
    """Weight of isotropic volume scattering: 8 rho^2 times its strength, or 0 without [1]."""
    spectral: np.float32
    """Weight of volume scattering with a power-law spectrum: 16 rho^2 nu times its strength, or 0 without [1]."""


def _single(x: float) -> Any:
    # Any: type checkers do not accept np.float32 as float; compiled code uses nothing else here.
    return np.float32(x)


def _fit(function: Any, degree: int, start: float) -> list[Any]:
    """Polynomial coefficients, lowest first, of a Chebyshev fit over one octave or one unit."""
    fit = Chebyshev.interpolate(function, degree, domain=[start, start + 1])
    return [_single(float(np.real(c))) for c in fit.convert(kind=Polynomial).coef]


_ZERO, _QUARTER, _HALF, _ONE, _TWO, _FOUR = (_single(x) for x in (0, 0.25, 0.5, 1, 2, 4))
_OUTER2, _OVER_STRONGEST = _single(OUTER_WAVENUMBER**2), _single(1 / STRONGEST)
_BLUR2, _LEAST_SINE = _single(SPECULAR_BLUR2), _single(1e-6)
_TABLE_START, _TABLE_RATE = _single(LEAST_LOG2), _single(1 / LOG2_STEP)
_LOWEST, _HIGHEST, _BIAS = _single(-126), _single(126), _single(127)
_L0, _L1, _L2, _L3, _L4, _L5 = _fit(np.log2, 5, 1.0)  # to 2e-5 octaves
_E0, _E1, _E2, _E3, _E4 = _fit(np.exp2, 4, 0.0)  # to 1e-5
_MANTISSA, _EXPONENT_OF_ONE = np.int32(0x7FFFFF), np.int32(0x3F800000)


@njit(inline="always")
def _log2(x: float) -> float:
    """Logarithm to base 2 of a positive number [octaves], within 2e-5."""
    bits = np.float32(x).view(np.int32)
    exponent: Any = np.float32(np.int32(np.int32(bits >> 23) - np.int32(127)))
    m = np.int32(np.int32(bits & _MANTISSA) | _EXPONENT_OF_ONE).view(np.float32)
    return exponent + (_L0 + m * (_L1 + m * (_L2 + m * (_L3 + m * (_L4 + m * _L5)))))


@njit(inline="always")
def _exp2(x: float) -> float:
    """Power of 2 [1], within 1e-5."""
    # Shifted to be positive, the number is rounded down by conversion to an integer, which is also its exponent.
    shifted: Any = min(max(x, _LOWEST), _HIGHEST) + _BIAS
    exponent = np.int32(shifted)
    y = shifted - np.float32(exponent)
    scale: Any = np.int32(exponent << 23).view(np.float32)
    return scale * (_E0 + y * (_E1 + y * (_E2 + y * (_E3 + y * _E4))))


@njit(inline="always")
def _interpolate(table: Singles, index: float) -> float:
    """Interpolate a table linearly at a fractional index; beyond its ends, extrapolate its last step."""
    # Clipped as an integer: an index that is NaN must not read outside the table.
    cell = min(max(np.int32(index), np.int32(0)), np.int32(table.size - 2))
    low: Any = table[cell]
    return low + (index - np.float32(cell)) * (table[cell + 1] - low)


@njit(inline="always")
def _root(real: float, imag: float) -> tuple[float, float]:
    """Square root with positive real and imaginary part, of a number with positive imaginary part."""
    size = math.sqrt(real * real + imag * imag)
    large = math.sqrt(_HALF * (size + abs(real)))
    small = _HALF * imag / large
    fast = real > _ZERO
    return (large if fast else small), (small if fast else large)


@njit(inline="always")
def half_direction_change_terms(
    ix: float, iy: float, iz: float, ox: float, oy: float, oz: float, nx: float, ny: float, nz: float
) -> tuple[float, float, float]:
    """Sines of both grazing angles and the transverse change squared, of unit vectors in, out and normal [1]."""
    dx, dy, dz = ox - ix, oy - iy, oz - iz
    sine_in = -(ix * nx + iy * ny + iz * nz)
    sine_out = ox * nx + oy * ny + oz * nz
    across = sine_in + sine_out
    # The component in the plane is computed as a vector: its length would cancel near the specular direction.
    tx, ty, tz = dx - across * nx, dy - across * ny, dz - across * nz
    return sine_in, sine_out, _QUARTER * (tx * tx + ty * ty + tz * tz)


@njit(inline="always")
def integral_index(
    n: SedimentParameters, ix: float, iy: float, iz: float, ox: float, oy: float, oz: float, nx: float, ny: float,
    nz: float,
) -> float:  # fmt: skip
    """Fractional index of Kirchhoff's integral in its table, from sediment parameters n and unit vectors [1]."""
    a, b, flat2 = half_direction_change_terms(ix, iy, iz, ox, oy, oz, nx, ny, nz)
    vertical = _HALF * (max(a, _LEAST_SINE) + max(b, _LEAST_SINE))
    log2_q = n.log2_q + _log2(vertical * vertical) - n.alpha * _log2(flat2 + _BLUR2)
    return (log2_q - _TABLE_START) * _TABLE_RATE


@njit(inline="always")
def surface_cross_section(
    n: SedimentParameters, log2_integral: float, ix: float, iy: float, iz: float, ox: float, oy: float, oz: float,
    nx: float, ny: float, nz: float,
) -> float:  # fmt: skip
    """Cross section of a sediment's surface and volume, from sediment parameters n and unit vectors [1]."""
    a, b, flat2 = half_direction_change_terms(ix, iy, iz, ox, oy, oz, nx, ny, nz)
    is_illuminated = (a > _ZERO) & (b > _ZERO)
    a, b = max(a, _LEAST_SINE), max(b, _LEAST_SINE)
    vertical = _HALF * (a + b)
    ar, ai = _root(n.kappa2_minus_1_real + a * a, n.kappa2_minus_1_imag)
    br, bi = _root(n.kappa2_minus_1_real + b * b, n.kappa2_minus_1_imag)
    da, db = n.density * a, n.density * b
    transmitted = a * b
    transmitted = transmitted * transmitted / (((da + ar) * (da + ar) + ai * ai) * ((db + br) * (db + br) + bi * bi))
    # cos cos cos(azimuth) = 1 - slack: the slack is small at low grazing angles, where adding it to 1 would round it.
    slack = _HALF * (a * a + b * b) + _TWO * flat2
    rest = n.density - _ONE
    real = n.density * (n.kappa2_minus_1_real - rest * slack) - rest * (ar * br - ai * bi)
    imag = n.density * n.kappa2_minus_1_imag - rest * (ar * bi + ai * br)
    shape = n.rough * _exp2(log2_integral) / ((flat2 + _BLUR2) * vertical * vertical)
    surface = transmitted * (real * real + imag * imag) * shape
    real = n.kappa2_minus_1_real + slack + (ar * br - ai * bi)
    imag = n.kappa2_minus_1_imag + ar * bi + ai * br
    change2 = _FOUR * (flat2 + _BLUR2) + (ar + br) * (ar + br) + _OUTER2
    spectral = transmitted * n.spectral * (real * real + imag * imag) / ((ai + bi) * change2 * math.sqrt(change2))
    volume = transmitted * n.isotropic / (ai + bi) + spectral / (_ONE + spectral * _OVER_STRONGEST)
    return surface + volume if is_illuminated else _ZERO


@njit(inline="always")
def kirchhoff_cross_section(
    n: SedimentParameters, log2_integral: float, ix: float, iy: float, iz: float, ox: float, oy: float, oz: float,
    nx: float, ny: float, nz: float,
) -> float:  # fmt: skip
    """Cross section in Kirchhoff's approximation, from sediment parameters n and unit vectors [1]."""
    a, b, flat2 = half_direction_change_terms(ix, iy, iz, ox, oy, oz, nx, ny, nz)
    is_illuminated = (a > _ZERO) & (b > _ZERO)
    vertical = _HALF * (max(a, _LEAST_SINE) + max(b, _LEAST_SINE))
    half2 = min(flat2 + _BLUR2 + vertical * vertical, _ONE)
    pr, pi = _root(n.kappa2_minus_1_real + half2, n.kappa2_minus_1_imag)
    load = n.density * math.sqrt(half2)
    facet = ((load - pr) * (load - pr) + pi * pi) / ((load + pr) * (load + pr) + pi * pi)
    section = n.rough * facet * half2 * half2 * _exp2(log2_integral) / ((flat2 + _BLUR2) * vertical * vertical)
    return section if is_illuminated else _ZERO


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _integral_indices(n: SedimentParameters, into: Singles, out: Singles, up: Singles, section: Singles) -> None:
    """Fill section with indices into the table of the integral."""
    for i in range(section.size):
        section[i] = integral_index(
            n, into[0, i], into[1, i], into[2, i], out[0, i], out[1, i], out[2, i], up[0, i], up[1, i], up[2, i]
        )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _interpolate_all(table: Singles, section: Singles) -> None:
    """Replace indices by the interpolated entries of a table."""
    for i in range(section.size):
        section[i] = _interpolate(table, section[i])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _finish_surface(n: SedimentParameters, into: Singles, out: Singles, up: Singles, section: Singles) -> None:
    """Replace log2 of the integral by the cross section of a rough sediment."""
    for i in range(section.size):
        section[i] = surface_cross_section(
            n, section[i],
            into[0, i], into[1, i], into[2, i], out[0, i], out[1, i], out[2, i], up[0, i], up[1, i], up[2, i],
        )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _finish_kirchhoff(n: SedimentParameters, into: Singles, out: Singles, up: Singles, section: Singles) -> None:
    """Replace log2 of the integral by the cross section in Kirchhoff's approximation."""
    for i in range(section.size):
        section[i] = kirchhoff_cross_section(
            n, section[i],
            into[0, i], into[1, i], into[2, i], out[0, i], out[1, i], out[2, i], up[0, i], up[1, i], up[2, i],
        )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def surface_cross_sections(
    n: SedimentParameters, integral: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section, shape (count,), for unit vectors of shape (3, count), all float32."""
    _integral_indices(n, into, out, up, section)
    _interpolate_all(integral, section)
    _finish_surface(n, into, out, up, section)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def kirchhoff_cross_sections(
    n: SedimentParameters, integral: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section, shape (count,), for unit vectors of shape (3, count), all float32."""
    _integral_indices(n, into, out, up, section)
    _interpolate_all(integral, section)
    _finish_kirchhoff(n, into, out, up, section)


@njit(inline="always")
def _sines(into: Singles, out: Singles, up: Singles, i: int) -> tuple[float, float]:
    """Sines of both grazing angles of column i [1]."""
    sine_in = -(into[0, i] * up[0, i] + into[1, i] * up[1, i] + into[2, i] * up[2, i])
    return sine_in, out[0, i] * up[0, i] + out[1, i] * up[1, i] + out[2, i] * up[2, i]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def product_cross_sections(
    n: SedimentParameters, direction_factor: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section for a law that is the product of one factor for each direction; n is unused.

    direction_factor is evenly spaced over sqrt(1 - sine of grazing), 0 to 1, in which a law is smooth at both ends.
    """
    rate = np.float32(direction_factor.size - 1)
    for i in range(section.size):
        a, b = _sines(into, out, up, i)
        root_in, root_out = math.sqrt(max(_ONE - a, _ZERO)), math.sqrt(max(_ONE - b, _ZERO))
        product = _interpolate(direction_factor, root_in * rate) * _interpolate(direction_factor, root_out * rate)
        section[i] = product if (a > _ZERO) & (b > _ZERO) else _ZERO


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def apply_cap(cap: Singles, into: Singles, out: Singles, up: Singles, section: Singles) -> None:
    """Reduce section by the smaller of two factors of the cap, tabulated at evenly spaced sines of grazing angle."""
    rate = np.float32(cap.size - 1)
    for i in range(section.size):
        a, b = _sines(into, out, up, i)
        section[i] = section[i] * min(_interpolate(cap, max(a, _ZERO) * rate), _interpolate(cap, max(b, _ZERO) * rate))
