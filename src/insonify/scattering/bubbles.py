"""Attenuation and scattering by the layer of bubbles that breaking waves leave under the surface.

Bubbles attenuate both legs of sound reflected or scattered by the surface, and scatter part of it. At low
grazing angles bubbles dominate the backscatter of the sea surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from insonify.scattering.facet_geometry import SHALLOWEST, half_direction_change, illumination
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.tr9407 import warn_of_frequency
from insonify.validity import require_grazing_angle, require_number, require_numbers, warn_outside

LAW = "APL-UW TR 9407 (1994) surface bubbles"
DAMPING_BY_RADIATION = 0.0136
"""Damping of a resonant bubble by radiation of sound, delta_r [1]."""
POWER_LAW_WIND = 11.0
"""Wind above which the extinction follows a power law instead of an exponential one [m/s]."""
MAX_LOSS_DB = 15.0
"""Largest loss per reflection: beyond it the formula is far from any measurement [dB]."""


def bubble_loss_db(wind_speed: ArrayLike, frequency: ArrayLike, grazing: ArrayLike) -> Floats:
    """Loss by bubbles per reflection by the surface, incident and reflected path together [dB].

    Args:
        wind_speed: Wind 10 m above the sea [m/s], any shape.
        frequency: Frequency [Hz], broadcast.
        grazing: Grazing angle, 0 to pi/2 [rad], broadcast.

    Returns:
        Loss, 0 or more [dB], broadcast shape; at most 15 dB, a cap of this project.

    Source: APL-UW TR 9407 (1994), section II, eqs. 28a and b, read in secondary sources that
    reproduce its figure. Valid: 10 to 100 kHz; wind to 20 m/s (the figure's range is smaller).

    Example:
        >>> bubble_loss_db(wind_speed=[5.0, 10.0], frequency=30e3, grazing=np.radians(10)).round(1).tolist()
        [0.7, 4.9]
    """
    u, f, angle = _checked(wind_speed, frequency, grazing)
    return np.asarray(np.minimum(_loss_db(u, f, angle), MAX_LOSS_DB))


def _loss_db(u: ArrayLike, f: ArrayLike, angle: ArrayLike) -> Floats:
    """Loss per reflection by the report's formula as printed, without cap [dB]."""
    u, f = np.asarray(u, dtype=float), np.asarray(f, dtype=float)
    wind = np.maximum(u, 6.0)
    # exp(1.2 (U - 6)): a version with exp(U - 6) is in print elsewhere and disagrees with the report's own figure.
    light_wind = np.exp(1.2 * np.minimum(u - 6.0, 0.0))
    return np.asarray(1.26e-3 * wind**1.57 * (f / 1e3) ** 0.85 * light_wind / np.maximum(np.sin(angle), SHALLOWEST))


def bubble_extinction(wind_speed: ArrayLike, frequency: ArrayLike) -> Floats:
    """Vertical extinction (optical depth) of the layer of bubbles, beta_v [1].

    Args:
        wind_speed: Wind 10 m above the sea [m/s], any shape.
        frequency: Frequency [Hz], broadcast.

    Returns:
        Extinction [1], broadcast shape: one vertical crossing transmits exp(-beta_v) of the energy.

    Source: APL-UW TR 9407 (1994), section II, eqs. 1-16, read in a secondary source.
    """
    u, f = np.asarray(wind_speed, dtype=float), np.asarray(frequency, dtype=float) / 1e3
    power_law = np.maximum(u / POWER_LAW_WIND, 1.0) ** 3.5
    return np.asarray(10 ** (-5.2577 + 0.4701 * np.minimum(u, POWER_LAW_WIND)) * (f / 25) ** 0.85 * power_law)


@dataclass(frozen=True, slots=True)
class Bubbles:
    """Bistatic scattering by the layer of bubbles under a specular surface.

    Sound reaches a bubble directly or reflected by the surface, and leaves it by either path. In backscatter the two
    mixed paths are one path in two senses, and their pressures add coherently: twice the energy, in a narrow cone.

    Source: APL-UW TR 9407 (1994), section II, in backscatter; the bistatic form and the cone are
    derived here from the same four paths through a uniform layer. Valid: 10 to 100 kHz.

    Example:
        >>> bubbles = Bubbles(wind_speed=10.0, frequency=30e3)
        >>> grazing = np.radians(10)
        >>> f"{10 * np.log10(bubbles.cross_section(grazing, grazing, np.pi)):.0f} dB"
        '-28 dB'
    """

    wind_speed: float
    """Wind 10 m above the sea [m/s]."""
    frequency: float
    """Frequency [Hz]."""
    cone: float = 0.02
    """Half width (1/e) of the cone of enhanced backscatter, about wavelength / (4 pi times the layer's depth) [rad]."""

    def __post_init__(self) -> None:
        """Refuse invalid values; warn outside the measured range."""
        wind = require_number("Bubbles.wind_speed", self.wind_speed, "m/s", 0.0, example="7")
        tone = require_number("Bubbles.frequency", self.frequency, "Hz", 0.0, exclude_low=True, example="100e3")
        cone = require_number("Bubbles.cone", self.cone, "rad", 0.0, exclude_low=True, example="0.02")
        for name, value in (("wind_speed", wind), ("frequency", tone), ("cone", cone)):
            object.__setattr__(self, name, value)
        _checked(self.wind_speed, self.frequency, 0.0)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the mean surface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the surface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        beta_v = bubble_extinction(self.wind_speed, self.frequency)  # optical depths: vertical, then along both legs
        beta_in, beta_out = (beta_v / np.maximum(np.sin(g), SHALLOWEST) for g in (grazing_in, grazing_out))
        total, difference = beta_in + beta_out, np.abs(beta_in - beta_out)
        direct = -np.expm1(-2 * total) / total
        # The difference of two exponentials over that of their exponents, without cancellation where they are equal.
        ratio = np.where(difference > 1e-8, -np.expm1(-2 * difference) / np.maximum(difference, 1e-8), 2.0)
        enhancement = self._enhancement(grazing_in, grazing_out, azimuth)
        mixed = enhancement * np.exp(-2 * np.minimum(beta_in, beta_out)) * ratio
        damping = 0.0255 * (self.frequency / 1e3) ** (1 / 3)
        strength = beta_v * DAMPING_BY_RADIATION / (4 * math.pi * damping)
        return np.asarray(strength * (direct + mixed) * illumination(grazing_in, grazing_out))

    def transmission(self, grazing: Floats) -> Floats:
        """Fraction of the energy that passes the bubbles on one leg [1]: half of `bubble_loss_db`, without its cap.

        Args:
            grazing: Grazing angle [rad], any shape.
        """
        return np.asarray(10 ** (-np.minimum(_loss_db(self.wind_speed, self.frequency, grazing) / 20, 150.0)))

    def _enhancement(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Enhancement of backscatter: 2 in backscatter, 1 in other directions [1]."""
        # Half the sum of the directions in and out is zero in backscatter: rotate the azimuth, invert the normal part.
        in_plane, _ = half_direction_change(grazing_in, grazing_out, np.asarray(azimuth) - math.pi)
        normal = (np.sin(grazing_in) - np.sin(grazing_out)) / 2
        off_axis = 2 * np.hypot(in_plane, normal)
        return np.asarray(1 + np.exp(-np.minimum((off_axis / self.cone) ** 2, 700.0)))


def _checked(wind_speed: ArrayLike, frequency: ArrayLike, grazing: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Check the arguments of the formulas, and warn outside their measured range."""
    u = require_numbers("wind_speed", wind_speed, "m/s", 0.0, allow_nan=False, example="7")
    f = require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True, allow_nan=False, example="100e3")
    angle = require_grazing_angle("grazing", grazing, gaps=False)
    warn_of_frequency(f)
    warn_outside(LAW, "wind speed", u, 0.0, 20.0, "m/s")
    return u, f, angle
