"""Unified wave spectrum from the longest waves to ripples: Elfouhaily et al. (1997).

The spectrum is a sum of two parts: long waves, which depend on fetch, and short waves, which depend on
the friction velocity and are the steeper.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from insonify.ocean.wave_spectrum import GRAVITY, Floats
from insonify.ocean.wind import checked_wind
from insonify.validity import require_number, require_numbers, warn_outside

LAW = "Elfouhaily et al. (1997) wave spectrum"
DEVELOPED_INVERSE_AGE = 0.84
"""Inverse wave age of a fully developed sea [1]."""
DEVELOPED_FETCH = 2.2e4
"""Fetch in units of U^2/g over which a sea becomes fully developed [1]."""
RIPPLE_WAVENUMBER = 370.0
"""Wavenumber of the slowest waves, at the transition from gravity to capillary waves [rad/m]."""
RIPPLE_SPEED = 0.23
"""Phase speed of those waves [m/s]."""


@dataclass(frozen=True, slots=True)
class Elfouhaily:
    """A wind sea of any age, with its short waves.

    Source: Elfouhaily, Chapron, Katsaros & Vandemark (1997), J. Geophys. Res. 102, 15781, with
    the short waves cut off below the peak like the long ones (later erratum) and the drag
    (0.8 + 0.065 U) 1e-3. From secondary sources and compared with public codes, which
    differ in alpha_p = 0.006 Omega^0.5 (here) or Omega^0.55; not verified against the paper.
    Valid: wind 3 to 21 m/s (the range the paper plots), inverse wave age 0.84 to 5.

    Example:
        >>> sea = Elfouhaily(wind_speed=10.0)
        >>> f"dominant waves {2 * np.pi / sea.peak:.0f} m long, friction velocity {sea.friction_velocity:.2f} m/s"
        'dominant waves 91 m long, friction velocity 0.38 m/s'
    """

    wind_speed: float
    """Wind 10 m above the sea [m/s]."""
    inverse_age: float = DEVELOPED_INVERSE_AGE
    """Wind over phase speed of the dominant waves, Omega: 0.84 developed, 5 very young [1]."""

    def __post_init__(self) -> None:
        """Refuse impossible values, and warn outside the range of the fit."""
        object.__setattr__(self, "wind_speed", checked_wind("Elfouhaily", self.wind_speed))
        ages = "0.84 (developed) or 5 (very young)"
        age = require_number("Elfouhaily.inverse_age", self.inverse_age, "", 0.0, exclude_low=True, example=ages)
        object.__setattr__(self, "inverse_age", age)
        warn_outside(LAW, "wind speed", self.wind_speed, 3.0, 21.0, "m/s")
        warn_outside(LAW, "inverse wave age", self.inverse_age, 0.83, 5.0, "")

    @classmethod
    def from_fetch(cls, wind_speed: float, fetch: float) -> Elfouhaily:
        """Sea at a given distance [m] from the upwind shore, for a wind speed [m/s].

        Source: Elfouhaily et al. (1997): Omega = 0.84 tanh((g X / (2.2e4 U^2))^0.4)^-0.75.
        """
        wind_speed = checked_wind("Elfouhaily", wind_speed)
        if not (isinstance(fetch, float) and math.isinf(fetch) and fetch > 0):  # an open ocean has no shore
            fetch = require_number("fetch", fetch, "m", 0.0, exclude_low=True, example="50e3 to the upwind shore")
        relative_fetch = GRAVITY * fetch / wind_speed**2 / DEVELOPED_FETCH
        return cls(wind_speed, DEVELOPED_INVERSE_AGE * math.tanh(relative_fetch**0.4) ** -0.75)

    @property
    def peak(self) -> float:
        """Wavenumber of the dominant waves, g Omega^2 / U^2 [rad/m]."""
        return GRAVITY * self.inverse_age**2 / self.wind_speed**2

    @property
    def friction_velocity(self) -> float:
        """Friction velocity of the wind at the surface, u* [m/s]."""
        return math.sqrt((0.8 + 0.065 * self.wind_speed) * 1e-3) * self.wind_speed

    def density(self, wavenumber: ArrayLike) -> Floats:
        """Variance of the height per wavenumber [m^3], at wavenumbers above 0 [rad/m], any shape."""
        k = require_numbers("wavenumber", wavenumber, "rad/m", 0.0, exclude_low=True)
        return np.asarray((self._long_waves(k) + self._short_waves(k)) * self._peak_shape(k) / k**3)

    def _long_waves(self, k: Floats) -> Floats:
        """Curvature spectrum of the long waves, which depend on fetch [1]."""
        equilibrium = 0.006 * math.sqrt(self.inverse_age)
        decay = np.exp(-self.inverse_age / math.sqrt(10) * (np.sqrt(k / self.peak) - 1))
        return np.asarray(0.5 * equilibrium * self._peak_speed / phase_speed(k) * decay)

    def _short_waves(self, k: Floats) -> Floats:
        """Curvature spectrum of the short waves, which depend on the friction velocity [1]."""
        log_ratio = math.log(self.friction_velocity / RIPPLE_SPEED)
        # Below a wind of about 3 m/s the fit turns negative: there are no ripples then.
        equilibrium = max(0.01 * (1 + (log_ratio if log_ratio < 0 else 3 * log_ratio)), 0.0)
        return np.asarray(
            0.5 * equilibrium * RIPPLE_SPEED / phase_speed(k) * np.exp(-0.25 * (k / RIPPLE_WAVENUMBER - 1) ** 2)
        )

    def _peak_shape(self, k: Floats) -> Floats:
        """Low-frequency cut-off and enhancement of the peak [1]."""
        width = 0.08 * (1 + 4 * self.inverse_age**-3)
        enhancement = 1.7 + 6 * max(math.log10(self.inverse_age), 0.0)
        enhanced = enhancement ** np.exp(-((np.sqrt(k / self.peak) - 1) ** 2) / (2 * width**2))
        return np.asarray(np.exp(-1.25 * (self.peak / k) ** 2) * enhanced)

    @property
    def _peak_speed(self) -> float:
        """Phase speed of the dominant waves [m/s]."""
        return self.wind_speed / self.inverse_age


def phase_speed(wavenumber: ArrayLike) -> Floats:
    """Phase speed of waves in deep water, as Elfouhaily writes it [m/s], at wavenumbers above 0 [rad/m]."""
    k = require_numbers("wavenumber", wavenumber, "rad/m", 0.0, exclude_low=True)
    return np.asarray(np.sqrt(GRAVITY / k * (1 + (k / RIPPLE_WAVENUMBER) ** 2)))
