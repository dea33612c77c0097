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

LEAST_LOG2_Q, LOG2_Q_STEP = -24.0, 0.125
"""log2 q of the first entry, and step in log2 q, of a table of log2 of Kirchhoff's integral I(q) [octaves]."""


class SedimentParameters(NamedTuple):
    """Parameters of a sediment at one frequency; kappa is the wavenumber in the sediment over that in the water."""

    density: np.float32
    """Density over that of the water [1]."""
    kappa2_minus_1_real: np.float32
    """Real part of kappa^2 - 1 [1]."""
    kappa2_minus_1_imag: np.float32
    """Imaginary part of kappa^2 - 1 [1]."""
    log2_unit_q: np.float32
    """log2 of the argument q of Kirchhoff's integral for half changes of direction of 1, in the plane and normal."""
    alpha: np.float32
    """Hurst exponent of the relief [1]."""
    surface_weight: np.float32
    """Weight of scattering by the rough surface: 1/(8 pi), or 0 for a law without it [1]."""
    isotropic_volume_weight: np.float32
    """Weight of isotropic volume scattering: 8 rho^2 times `isotropic_strength`, or 0 for a law without it [1]."""
    power_law_volume_weight: np.float32
    """Weight of power-law volume scattering: 16 rho^2 nu times `isotropic_strength`, nu the speed ratio; or 0 [1]."""


def _single(x: float) -> Any:
    # Any: type checkers do not accept np.float32 as float; compiled code uses nothing else here.
    return np.float32(x)


def _fit(function: Any, degree: int, start: float) -> list[Any]:
    """Polynomial coefficients, lowest first, of a Chebyshev fit from `start` to `start + 1`."""
    fit = Chebyshev.interpolate(function, degree, domain=[start, start + 1])
    return [_single(float(np.real(c))) for c in fit.convert(kind=Polynomial).coef]


_ZERO, _QUARTER, _HALF, _ONE, _TWO, _FOUR = (_single(x) for x in (0, 0.25, 0.5, 1, 2, 4))
_OUTER2, _OVER_STRONGEST = _single(OUTER_WAVENUMBER**2), _single(1 / STRONGEST)
_BLUR2, _LEAST_SINE = _single(SPECULAR_BLUR2), _single(1e-6)
_LEAST_LOG2_Q, _ENTRIES_PER_OCTAVE = _single(LEAST_LOG2_Q), _single(1 / LOG2_Q_STEP)
_LOWEST, _HIGHEST, _BIAS = _single(-126), _single(126), _single(127)
_L0, _L1, _L2, _L3, _L4, _L5 = _fit(np.log2, 5, 1.0)  # to 2e-5 octaves
_E0, _E1, _E2, _E3, _E4 = _fit(np.exp2, 4, 0.0)  # to 1e-5
_MANTISSA, _EXPONENT_OF_ONE = np.int32(0x7FFFFF), np.int32(0x3F800000)


@njit(inline="always")
def _log2(x: float) -> float:
    """Logarithm to base 2 of a positive number [octaves], within 2e-5."""
    bits = np.float32(x).view(np.int32)
    exponent: Any = np.float32(np.int32(np.int32(bits >> 23) - np.int32(127)))
    m = np.int32(np.int32(bits & _MANTISSA) | _EXPONENT_OF_ONE).view(np.float32)  # mantissa, 1 to 2
    return exponent + (_L0 + m * (_L1 + m * (_L2 + m * (_L3 + m * (_L4 + m * _L5)))))


@njit(inline="always")
def _exp2(x: float) -> float:
    """2 to the power x [1], within 1e-5 of the result; x is limited to -126..126."""
    # Shifted to be positive, the number is rounded down by conversion to an integer, which is also its exponent.
    shifted: Any = min(max(x, _LOWEST), _HIGHEST) + _BIAS
    exponent = np.int32(shifted)
    fraction = shifted - np.float32(exponent)
    scale: Any = np.int32(exponent << 23).view(np.float32)
    return scale * (_E0 + fraction * (_E1 + fraction * (_E2 + fraction * (_E3 + fraction * _E4))))


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
    modulus = math.sqrt(real * real + imag * imag)
    larger = math.sqrt(_HALF * (modulus + abs(real)))
    smaller = _HALF * imag / larger
    is_real_larger = real > _ZERO
    return (larger if is_real_larger else smaller), (smaller if is_real_larger else larger)


@njit(inline="always")
def half_direction_change_terms(
    ix: float, iy: float, iz: float, ox: float, oy: float, oz: float, nx: float, ny: float, nz: float
) -> tuple[float, float, float]:
    """Sines of both grazing angles, and the square of half the change of direction in the plane of the interface [1].

    Args are components of unit vectors: i travel towards the interface, o travel away, n normal into the water.
    """
    dx, dy, dz = ox - ix, oy - iy, oz - iz
    sine_in = -(ix * nx + iy * ny + iz * nz)
    sine_out = ox * nx + oy * ny + oz * nz
    along_normal = sine_in + sine_out
    # The component in the plane is computed as a vector: a difference of squares would cancel near the specular one.
    tx, ty, tz = dx - along_normal * nx, dy - along_normal * ny, dz - along_normal * nz
    return sine_in, sine_out, _QUARTER * (tx * tx + ty * ty + tz * tz)


@njit(inline="always")
def integral_index(
    sediment: SedimentParameters, ix: float, iy: float, iz: float, ox: float, oy: float, oz: float, nx: float,
    ny: float, nz: float,
) -> float:  # fmt: skip
    """Fractional index of Kirchhoff's integral in its table [1], from unit vectors as `half_direction_change_terms`."""
    sine_in, sine_out, transverse2 = half_direction_change_terms(ix, iy, iz, ox, oy, oz, nx, ny, nz)
    vertical = _HALF * (max(sine_in, _LEAST_SINE) + max(sine_out, _LEAST_SINE))
    log2_q = sediment.log2_unit_q + _log2(vertical * vertical) - sediment.alpha * _log2(transverse2 + _BLUR2)
    return (log2_q - _LEAST_LOG2_Q) * _ENTRIES_PER_OCTAVE


@njit(inline="always")
def surface_cross_section(
    sediment: SedimentParameters, log2_integral: float, ix: float, iy: float, iz: float, ox: float, oy: float,
    oz: float, nx: float, ny: float, nz: float,
) -> float:  # fmt: skip
    """Cross section of a sediment's surface and volume [1], from unit vectors as `half_direction_change_terms`.

    As in `UncappedSmallSlope` and `UncappedSedimentVolume`: a, b are the sines of the grazing angles, ar + j ai and
    br + j bi the vertical wavenumbers in the sediment over the wavenumber in the water.
    """
    a, b, transverse2 = half_direction_change_terms(ix, iy, iz, ox, oy, oz, nx, ny, nz)
    is_illuminated = (a > _ZERO) & (b > _ZERO)
    a, b = max(a, _LEAST_SINE), max(b, _LEAST_SINE)
    vertical = _HALF * (a + b)
    ar, ai = _root(sediment.kappa2_minus_1_real + a * a, sediment.kappa2_minus_1_imag)
    br, bi = _root(sediment.kappa2_minus_1_real + b * b, sediment.kappa2_minus_1_imag)
    da, db = sediment.density * a, sediment.density * b
    transmission = a * b
    transmission = transmission * transmission / (((da + ar) * (da + ar) + ai * ai) * ((db + br) * (db + br) + bi * bi))
    # cos a cos b cos(azimuth) = 1 - rest: small at low grazing angles, where adding the rest to 1 would round it.
    rest = _HALF * (a * a + b * b) + _TWO * transverse2
    excess = sediment.density - _ONE
    real = sediment.density * (sediment.kappa2_minus_1_real - excess * rest) - excess * (ar * br - ai * bi)
    imag = sediment.density * sediment.kappa2_minus_1_imag - excess * (ar * bi + ai * br)
    roughness = sediment.surface_weight * _exp2(log2_integral) / ((transverse2 + _BLUR2) * vertical * vertical)
    surface = transmission * (real * real + imag * imag) * roughness
    real = sediment.kappa2_minus_1_real + rest + (ar * br - ai * bi)
    imag = sediment.kappa2_minus_1_imag + ar * bi + ai * br
    change2 = _FOUR * (transverse2 + _BLUR2) + (ar + br) * (ar + br) + _OUTER2
    power_law = transmission * sediment.power_law_volume_weight * (real * real + imag * imag)
    power_law = power_law / ((ai + bi) * change2 * math.sqrt(change2))
    isotropic = transmission * sediment.isotropic_volume_weight / (ai + bi)
    volume = isotropic + power_law / (_ONE + power_law * _OVER_STRONGEST)
    return surface + volume if is_illuminated else _ZERO


@njit(inline="always")
def kirchhoff_cross_section(
    sediment: SedimentParameters, log2_integral: float, ix: float, iy: float, iz: float, ox: float, oy: float,
    oz: float, nx: float, ny: float, nz: float,
) -> float:  # fmt: skip
    """Cross section in Kirchhoff's approximation [1], from unit vectors as `half_direction_change_terms`."""
    a, b, transverse2 = half_direction_change_terms(ix, iy, iz, ox, oy, oz, nx, ny, nz)
    is_illuminated = (a > _ZERO) & (b > _ZERO)
    vertical = _HALF * (max(a, _LEAST_SINE) + max(b, _LEAST_SINE))
    sine2 = min(transverse2 + _BLUR2 + vertical * vertical, _ONE)  # of the grazing angle at the reflecting facet
    pr, pi = _root(sediment.kappa2_minus_1_real + sine2, sediment.kappa2_minus_1_imag)
    ds = sediment.density * math.sqrt(sine2)
    reflection2 = ((ds - pr) * (ds - pr) + pi * pi) / ((ds + pr) * (ds + pr) + pi * pi)
    section = sediment.surface_weight * reflection2 * sine2 * sine2 * _exp2(log2_integral)
    section = section / ((transverse2 + _BLUR2) * vertical * vertical)
    return section if is_illuminated else _ZERO


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _integral_indices(sediment: SedimentParameters, into: Singles, out: Singles, up: Singles, section: Singles) -> None:
    """Fill section with fractional indices into the table of log2 of Kirchhoff's integral."""
    for i in range(section.size):
        section[i] = integral_index(
            sediment, into[0, i], into[1, i], into[2, i], out[0, i], out[1, i], out[2, i], up[0, i], up[1, i], up[2, i]
        )


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _interpolate_all(table: Singles, section: Singles) -> None:
    """Replace the fractional indices in section by the interpolated entries of a table."""
    for i in range(section.size):
        section[i] = _interpolate(table, section[i])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _finish_surface(sediment: SedimentParameters, into: Singles, out: Singles, up: Singles, section: Singles) -> None:
    """Replace log2 of the integral in section by the cross section of a sediment's surface and volume [1]."""
    for i in range(section.size):
        section[i] = surface_cross_section(
            sediment, section[i],
            into[0, i], into[1, i], into[2, i], out[0, i], out[1, i], out[2, i], up[0, i], up[1, i], up[2, i],
        )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _finish_kirchhoff(sediment: SedimentParameters, into: Singles, out: Singles, up: Singles, section: Singles) -> None:
    """Replace log2 of the integral in section by the cross section in Kirchhoff's approximation [1]."""
    for i in range(section.size):
        section[i] = kirchhoff_cross_section(
            sediment, section[i],
            into[0, i], into[1, i], into[2, i], out[0, i], out[1, i], out[2, i], up[0, i], up[1, i], up[2, i],
        )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def surface_cross_sections(
    sediment: SedimentParameters, log2_integrals: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section with cross sections of a sediment's surface and volume [1].

    Args are float32: travel towards (into) and away from the interface (out) and normals into the water (up) as unit
    vectors, shape (3, count); section, shape (count,); log2_integrals from `LEAST_LOG2_Q` by `LOG2_Q_STEP`.
    """
    _integral_indices(sediment, into, out, up, section)
    _interpolate_all(log2_integrals, section)
    _finish_surface(sediment, into, out, up, section)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def kirchhoff_cross_sections(
    sediment: SedimentParameters, log2_integrals: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section with cross sections in Kirchhoff's approximation [1]; arrays as `surface_cross_sections`."""
    _integral_indices(sediment, into, out, up, section)
    _interpolate_all(log2_integrals, section)
    _finish_kirchhoff(sediment, into, out, up, section)


@njit(inline="always")
def _sines(into: Singles, out: Singles, up: Singles, i: int) -> tuple[float, float]:
    """Sines of both grazing angles of column i [1]."""
    sine_in = -(into[0, i] * up[0, i] + into[1, i] * up[1, i] + into[2, i] * up[2, i])
    return sine_in, out[0, i] * up[0, i] + out[1, i] * up[1, i] + out[2, i] * up[2, i]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def product_cross_sections(
    unused: SedimentParameters, direction_factor: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section [1] for a law that is the product of one factor for each direction; arrays as above.

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
    """Multiply section by the smaller of both directions' factors, tabulated at sines evenly spaced from 0 to 1."""
    rate = np.float32(cap.size - 1)
    for i in range(section.size):
        a, b = _sines(into, out, up, i)
        section[i] = section[i] * min(_interpolate(cap, max(a, _ZERO) * rate), _interpolate(cap, max(b, _ZERO) * rate))
