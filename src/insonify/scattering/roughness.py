"""Roughness of a seabed: power-law spectrum, structure constant, rms slope and the Kirchhoff integral.

Heights follow a power law: W(K) = w K^-gamma for every wavenumber K. Such a surface has no rms height of its own,
but the difference of two heights has: its mean square grows as the distance to the power 2 alpha, with
alpha = gamma/2 - 1. In the Kirchhoff and the small-slope approximation the scattering of such a surface is one
integral over that growth, a function of one number q, which is tabulated once per alpha.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scattering.sediments import Sediment, checked_sediment
from insonify.scattering.tr9407 import warn_of_frequency
from insonify.validity import require_number, require_numbers, warn_outside

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Floats = NDArray[np.float64]

LOWEST_LOG_Q, HIGHEST_LOG_Q, LOG_Q_STEP = -16.0, 28.0, 0.05  # natural log of q: ends and step of the table of I(q)
STEEPEST_SLOPE_DEG = 30.0
"""Rms slope above which small-slope scattering is far below the handbook's empirical form for rock [deg]."""


def hurst_exponent(sediment: Sediment) -> float:
    """Hurst exponent alpha of the relief, gamma/2 - 1: 0 (rough) to 1 (smooth) [1]."""
    return sediment.spectral_exponent / 2 - 1


def roughness_spectrum(sediment: Sediment, wavenumber: ArrayLike) -> Floats:
    """Roughness spectrum of a sediment's surface.

    Args:
        sediment: Sediment below the water.
        wavenumber: Horizontal wavenumber of the relief, above 0 [rad/m], any shape.

    Returns:
        Two-sided, two-dimensional spectrum whose integral over both wavenumbers is the mean-square height [m^4].

    Source: APL-UW TR 9407 (1994), section IV.A. Valid: measured for relief of about 1 cm to 1 m.

    Example:
        >>> f"{roughness_spectrum(Sediment.named('medium sand'), 2 * np.pi / 0.1):.1e} m^4"
        '2.0e-10 m^4'
    """
    bed, k = checked_sediment(sediment), require_numbers("wavenumber", wavenumber, "rad/m", 0.0, exclude_low=True)
    return np.asarray(bed.spectral_strength * k**-bed.spectral_exponent)


def band_variance(sediment: Sediment, low: ArrayLike, high: ArrayLike) -> Floats:
    """Mean-square height of the relief between two wavenumbers: the spectrum's integral over that ring [m^2].

    Args:
        sediment: Sediment below the water.
        low: Least wavenumber [rad/m], any shape.
        high: Greatest wavenumber, not below `low` [rad/m], broadcast.
    """
    power = sediment.spectral_exponent - 2
    ring = np.asarray(low, float) ** -power - np.asarray(high, float) ** -power
    return np.asarray(2 * math.pi * sediment.spectral_strength / power * ring)


def structure_constant(sediment: Sediment) -> float:
    """Mean-square difference of two heights 1 m apart, C^2 of <(h(x + r) - h(x))^2> = C^2 r^(2 alpha).

    Args:
        sediment: Sediment below the water.

    Returns:
        C^2 [m^(2 - 2 alpha)].

    Source: Jackson, Winebrenner & Ishimaru (1986), J. Acoust. Soc. Am. 79, 1410; as in APL-UW TR 9407 (1994), eq. 36
    (equation number from a public transcription).

    Example:
        >>> height = np.sqrt(structure_constant(Sediment.named("medium sand")))
        >>> f"rms difference of two heights 1 m apart: {100 * height:.1f} cm"
        'rms difference of two heights 1 m apart: 4.0 cm'
    """
    from scipy.special import gamma

    a = hurst_exponent(checked_sediment(sediment))
    return 2 * math.pi * sediment.spectral_strength * gamma(2 - a) * 4**-a / (a * (1 - a) * gamma(1 + a))


def rms_slope(sediment: Sediment, wavenumber: float) -> float:
    """Rms slope of the relief that is large against the acoustic wavelength, both components together [1].

    Args:
        sediment: Sediment below the water.
        wavenumber: Acoustic wavenumber in the water [rad/m].

    Source: APL-UW TR 9407 (1994), composite roughness model, within eqs. 41-52.
    """
    a = hurst_exponent(sediment)
    slope2_scale = (2 * math.pi * sediment.spectral_strength) ** (1 / a) / (2 * (1 - a))
    return math.sqrt(slope2_scale * (wavenumber**2 / a) ** ((1 - a) / a))


@dataclass(frozen=True, slots=True)
class KirchhoffIntegral:
    """Tabulated Kirchhoff integral I(q) of one Hurst exponent."""

    alpha: float
    """Hurst exponent of the relief [1]."""
    spline: CubicSpline
    """Natural logarithm of I as a function of that of q."""

    def __call__(self, q: ArrayLike) -> Floats:
        """I(q) [1] for q above 0, any shape; beyond the table its two asymptotic power laws."""
        log_q = np.log(q)
        inside = np.clip(log_q, LOWEST_LOG_Q, HIGHEST_LOG_Q)
        extrapolation = np.where(log_q > 0, -1 / self.alpha, 1.0) * (log_q - inside)
        return np.asarray(np.exp(self.spline(inside) + extrapolation))


@lru_cache(maxsize=64)
def kirchhoff_integral(alpha: float) -> KirchhoffIntegral:
    """Tabulate the integral of J0(u) exp(-q u^(2 alpha)) u du from 0 to infinity, as a function of q.

    Args:
        alpha: Hurst exponent of the relief, 0 to 1 exclusive [1].

    Returns:
        Function of q [1], any shape, relative error below 1e-6. It tends to q 2^(1 + 2 alpha) alpha
        Gamma(1 + alpha) / Gamma(1 - alpha) for small q and to Gamma(1/alpha) / (2 alpha) q^(-1/alpha) for large q.

    Source: Jackson, Winebrenner & Ishimaru (1986), J. Acoust. Soc. Am. 79, 1410 (the Kirchhoff integral).
    """
    from scipy.interpolate import CubicSpline

    log_q = np.arange(LOWEST_LOG_Q, HIGHEST_LOG_Q + LOG_Q_STEP / 2, LOG_Q_STEP)
    end_slopes = ((1, 1.0), (1, -1 / alpha))  # first derivatives: those of the asymptotic power laws
    return KirchhoffIntegral(alpha, CubicSpline(log_q, np.log(_integrals(alpha, np.exp(log_q))), bc_type=end_slopes))


def _integrals(alpha: float, q: Floats) -> Floats:
    """I(q) along a path rotated into the complex plane, where the integrand does not oscillate [1]."""
    from scipy.special import expm1, hankel1

    # J0 = Re H0, and H0 decays above the real axis; the rotation is small enough for exp(-q u^(2 alpha)) to decay too.
    rotation = min(math.pi / 2, math.pi / (6 * alpha))
    lowest_log_u = -16.0 - 0.5 / alpha * max(HIGHEST_LOG_Q, 0.0)
    u = np.exp(np.arange(lowest_log_u, math.log(100.0), 0.05) + 1j * rotation)
    weight = 0.05 * hankel1(0, u) * u * u  # equal steps in log u: the trapezoid converges exponentially
    power = u ** (2 * alpha)
    # H0 alone integrates to 0 but dominates a small I numerically: it is subtracted exactly where q is small.
    return np.array([(weight * (expm1(-x * power) if x < 1 else np.exp(-x * power))).sum().real for x in q])


class SedimentScatteringLaw(Protocol):
    """Scattering law of a sediment at one frequency."""

    @property
    def sediment(self) -> Sediment:
        """Sediment below the water."""
        ...

    @property
    def frequency(self) -> float:
        """Frequency [Hz]."""
        ...

    @property
    def sound_speed(self) -> float:
        """Sound speed in the water [m/s]."""
        ...


def check_sediment_law(law: SedimentScatteringLaw) -> float:
    """Check a law's sediment, frequency and sound speed, and warn outside the measured frequencies.

    Args:
        law: Frozen law under construction; its frequency and sound speed become plain floats.

    Returns:
        Acoustic wavenumber in the water, 2 pi f / c [rad/m].

    Raises:
        ValueError: The sediment, the frequency or the sound speed is invalid.
    """
    kind = type(law).__name__
    checked_sediment(law.sediment, f"{kind}.sediment")
    frequency = require_number(f"{kind}.frequency", law.frequency, "Hz", 0.0, exclude_low=True, example="100e3")
    sound_speed = require_number(f"{kind}.sound_speed", law.sound_speed, "m/s", 300.0, 5000.0, example="1500")
    object.__setattr__(law, "frequency", frequency)
    object.__setattr__(law, "sound_speed", sound_speed)
    warn_of_frequency(frequency)
    return 2 * math.pi * frequency / sound_speed


def warn_of_steep_slopes(sediment: Sediment, wavenumber: float) -> None:
    """Warn where a seabed is too steep for a small-slope law.

    Args:
        sediment: Sediment below the water.
        wavenumber: Acoustic wavenumber in the water [rad/m].
    """
    slope = math.degrees(math.atan(rms_slope(sediment, wavenumber)))
    law = "First-order small-slope scattering (Gragg, Wurmser & Gauss 2001)"
    warn_outside(law, "an rms slope of", slope, 0.0, STEEPEST_SLOPE_DEG, "deg")
