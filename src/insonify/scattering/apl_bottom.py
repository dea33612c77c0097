"""Backscatter of a flat seabed: the full model of the APL-UW handbook of 1994.

Five formulas, each in its range of validity: Kirchhoff near vertical incidence, composite roughness at lower
grazing angles, an empirical form where the seabed is too rough for both, scattering by the sediment volume
at all angles; with smooth steps between them. The model gives backscatter only. On relief that the geometry resolves
use Jackson instead: the average over slopes and shadows is part of this model.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from insonify.scattering.law import Floats
from insonify.scattering.reflection import reflection_coefficient, vertical_wavenumber
from insonify.scattering.roughness import hurst_exponent, rms_slope, roughness_spectrum, structure_constant
from insonify.scattering.sediments import Sediment, checked_sediment, si_spectral_strength
from insonify.scattering.tr9407 import warn_of_frequency
from insonify.units import level_db
from insonify.validity import require_grazing_angle, require_numbers, require_sound_speed, warn_outside

LAW = "APL-UW TR 9407 (1994) bottom backscatter"
LEAST_GRAZING = math.radians(1e-3)  # lower grazing angles are raised to this one [rad]
LEAST_KIRCHHOFF = math.radians(40)
"""Grazing angle below which the Kirchhoff term is 0 [rad]."""
# Gauss-Hermite rule of three points for an average over slopes; nodes in units of the rms slope.
SLOPE_NODES, SLOPE_WEIGHTS = (1.224745, 0.0, -1.224745), (0.295410, 1.181636, 0.295410)


def apl_bottom_strength_db(
    sediment: Sediment, frequency: ArrayLike, grazing: ArrayLike, *, sound_speed: ArrayLike = 1500.0
) -> Floats:
    """Backscattering strength of a flat seabed, the full model of the APL-UW handbook [dB re 1 m^2 per m^2].

    Args:
        sediment: Sediment below the water.
        frequency: Frequency [Hz], any shape.
        grazing: Grazing angle, 0 to pi/2 [rad], broadcast.
        sound_speed: Sound speed in the water [m/s], broadcast.

    Returns:
        10 log10 of the backscattering cross section per unit area per unit solid angle [dB], broadcast shape.

    Raises:
        ValueError: An angle is not a grazing angle, or the frequency or the sound speed is invalid.

    Source: APL-UW TR 9407 (1994), section IV, eqs. 35-66 (equation numbers from a public transcription), checked
    against its printed Table 3 to 0.15 dB. Built on Jackson, Winebrenner & Ishimaru (1986), J. Acoust. Soc. Am. 79,
    1410 and Mourad & Jackson (1989), Proc. Oceans '89, 1168.
    Valid: 10 to 100 kHz; about 3 dB for sand and silt whose properties are known above 5 degrees, 5 to 10 dB else.

    Example:
        >>> sand = Sediment.named("medium sand")
        >>> apl_bottom_strength_db(sand, 30e3, np.radians([10, 20, 40])).round().tolist()
        [-35.0, -28.0, -23.0]
    """
    checked_sediment(sediment)
    tone = require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True, allow_nan=False, example="100e3")
    speed = require_sound_speed("sound_speed", sound_speed, gaps=False)
    angle = np.maximum(require_grazing_angle("grazing", grazing, gaps=False), LEAST_GRAZING)
    _warn(sediment, tone)
    wavenumber, angle = np.broadcast_arrays(2 * math.pi * tone / speed, angle)
    section = np.empty(angle.shape)
    for k in np.unique(wavenumber):
        seabed, same = _AplBottom(sediment, float(k)), wavenumber == k
        section[same] = seabed.rough(angle[same]) + seabed.average(seabed.volume, angle[same])
    return level_db(section)


@dataclass(frozen=True, slots=True)
class _AplBottom:
    """Model at one wavenumber; every method takes grazing angles [rad] and returns cross sections [1]."""

    sediment: Sediment
    wavenumber: float  # in the water [rad/m]

    @property
    def slope(self) -> float:
        """Rms slope of the relief that is large against the wavelength, both components together [1]."""
        return rms_slope(self.sediment, self.wavenumber)

    @property
    def normal_reflection(self) -> float:
        """Energy reflection coefficient at vertical incidence [1]."""
        return float(np.abs(reflection_coefficient(self.sediment, math.pi / 2)) ** 2)

    def rough(self, grazing: Floats) -> Floats:
        """Surface scattering with its transitions, eqs. 57-64."""
        alpha, (a, _, qc) = hurst_exponent(self.sediment), self.kirchhoff_constants()
        rough = 1000 ** (1 / (1 + alpha)) * (a * qc**2) ** (1 / alpha)
        transition = (1 / rough + 4) ** -0.25
        x = (np.cos(grazing) - transition) / 0.0125
        moderate = _step(x) * self.kirchhoff(grazing) + _step(-x) * self.average(self.perturbation, grazing)
        y = (math.degrees(math.atan(self.slope)) - 7) / 0.5
        return np.asarray(_step(y) * moderate + _step(-y) * self.very_rough(grazing))

    def kirchhoff_constants(self) -> tuple[float, float, float]:
        """Constants a, b and q_c of the closed form of the Kirchhoff integral, eqs. 36-40."""
        from scipy.special import gamma

        alpha = hurst_exponent(self.sediment)
        half = 1 / (2 * alpha)
        a = (8 * alpha**2 * gamma(half + 0.5) / (gamma(0.5) * gamma(2 * half) * gamma(half))) ** (2 * alpha)
        # The plus sign makes the closed form exact at vertical incidence.
        b = a ** (0.5 + half) * gamma(2 * half) * half
        return a, b, structure_constant(self.sediment) * 2 ** (1 - 2 * alpha) * self.wavenumber ** (2 * (1 - alpha))

    def kirchhoff(self, grazing: Floats) -> Floats:
        """Specular facets in Kirchhoff's approximation, eq. 35."""
        alpha, (a, b, qc) = hurst_exponent(self.sediment), self.kirchhoff_constants()
        denominator = np.cos(grazing) ** (4 * alpha) + a * qc**2 * np.sin(grazing) ** 4
        facing = b * qc * self.normal_reflection / (8 * math.pi * denominator ** ((1 + alpha) / (2 * alpha)))
        return np.where(grazing >= LEAST_KIRCHHOFF - 1e-9, facing, 0.0)

    def perturbation(self, grazing: Floats) -> Floats:
        """First-order perturbation theory in backscatter, eqs. 41-45."""
        bed, sine, cosine2 = self.sediment, np.sin(grazing), np.cos(grazing) ** 2
        kappa2, rho = ((1 + 1j * bed.loss) / bed.speed_ratio) ** 2, bed.density_ratio
        contrast = (rho - 1) ** 2 * cosine2 + rho**2 - kappa2
        coupling = np.abs(contrast / (rho * sine + vertical_wavenumber(bed, sine)) ** 2) ** 2
        # A tenth of k, squared, keeps the Bragg wavenumber above 0 at vertical incidence.
        bragg_wavenumber = self.wavenumber * np.sqrt(4 * cosine2 + 0.01)
        return np.asarray(4 * self.wavenumber**4 * sine**4 * coupling * roughness_spectrum(bed, bragg_wavenumber))

    def volume(self, grazing: Floats) -> Floats:
        """Volume scattering of a flat sediment, eq. 65."""
        bed, sine = self.sediment, np.sin(grazing)
        transmitted = np.abs(1 - reflection_coefficient(bed, grazing) ** 2) ** 2
        p = vertical_wavenumber(bed, sine)
        strength = 5 * bed.loss * bed.volume_parameter / (bed.speed_ratio * math.log(10))
        return np.asarray(strength * transmitted * sine**2 / (np.abs(p) ** 2 * p.imag))

    def average(self, law: Callable[[Floats], Floats], grazing: Floats) -> Floats:
        """Average of a law over the large-scale slopes of the seabed, with shadowing, eqs. 46-52."""
        total = np.zeros_like(grazing)
        for node, weight in zip(SLOPE_NODES, SLOPE_WEIGHTS, strict=True):
            tilted = np.minimum(grazing - self.slope * node, math.pi / 2)
            total += weight * np.where(tilted > 0, law(np.maximum(tilted, LEAST_GRAZING)), 0.0)
        return self.illuminated_fraction(grazing) * total / math.sqrt(math.pi)

    def illuminated_fraction(self, grazing: Floats) -> Floats:
        """Illuminated fraction of the seabed [1], eqs. 50-52."""
        from scipy.special import erfc

        t = np.tan(grazing) / self.slope
        limited_t = np.minimum(t, 2.0)
        q = (np.exp(-(limited_t**2)) / math.sqrt(math.pi) - limited_t * erfc(limited_t)) / (4 * limited_t)
        return np.where(t > 2, 1.0, -np.expm1(-2 * q) / (2 * q))

    def very_rough(self, grazing: Floats) -> Floats:
        """Empirical form of the handbook for rock and stones, eqs. 53-56; its angles are in degrees."""
        bed, s, degrees = self.sediment, self.slope, np.degrees(grazing)
        critical = math.degrees(math.acos(1 / bed.speed_ratio)) if bed.speed_ratio >= 1.001 else 2.5613
        power, slope_degrees = 0.7263 * s ** (-1 / 3), math.degrees(s)
        impedance = (1 - 2 / bed.density_ratio) / bed.speed_ratio**2 + 1
        low = 0.04682 * s**1.25 * bed.speed_ratio**3.25 * impedance**2 / (1 + 3.54 * slope_degrees / critical)
        C = 1 + 0.81 * critical**2 / degrees**2  # the handbook's C
        steep = s**2 * (1 + (degrees - 90) ** 2 / (2.6 * slope_degrees**2)) ** 1.9 * C
        return np.asarray(low * np.sin(np.radians(180 / C)) ** power + 0.0260 * self.normal_reflection / steep)


def _step(x: ArrayLike) -> Floats:
    """Smooth step from 1 (x well below 0) to 0 [1], eq. 58."""
    return np.asarray(1 / (1 + np.exp(np.clip(x, -40, 40))))


def _warn(sediment: Sediment, frequency: Floats) -> None:
    warn_of_frequency(frequency)
    warn_outside(LAW, "density ratio", sediment.density_ratio, 1.0, 3.0, "")
    warn_outside(LAW, "speed ratio", sediment.speed_ratio, 0.8, 3.0, "")
    warn_outside(LAW, "loss", sediment.loss, 1e-9, 0.1, "")
    warn_outside(LAW, "spectral exponent", sediment.spectral_exponent, 2.4, 3.9, "")
    strength_cm4 = sediment.spectral_strength / si_spectral_strength(1.0, sediment.spectral_exponent)
    warn_outside(LAW, "spectral strength", strength_cm4, 0.0, 1.0, "cm^4")
