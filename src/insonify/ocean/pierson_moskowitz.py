"""Wave spectrum of a fully developed sea: Pierson and Moskowitz (1964).

The sea is fully developed where the wind has blown so long and over such a distance that the phase speed of the
dominant waves has reached the wind speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from insonify.ocean.wave_spectrum import GRAVITY, Floats
from insonify.ocean.wind import checked_wind
from insonify.validity import require_numbers, warn_outside

LAW = "Pierson & Moskowitz (1964) wave spectrum"
PHILLIPS = 8.1e-3
"""Strength of the saturated range, Phillips' alpha [1]."""
SHAPE = 0.74
"""Pierson and Moskowitz's beta [1]."""
WIND_RANGE = (3.0, 20.0)
"""Wind speeds for which the spectrum is in use [m/s]; its data have 10 to 20."""
MAST_WIND_RATIO = 1.026
"""Wind at the weather ships' 19.5 m over wind at 10 m, for a drag coefficient of 1.3e-3 [1]."""


@dataclass(frozen=True, slots=True)
class PiersonMoskowitz:
    """A fully developed wind sea in deep water.

    Source: Pierson & Moskowitz (1964), J. Geophys. Res. 69, 5181; constants as given, with the
    step from 10 m to 19.5 m, by Stewart (2008), Introduction to Physical Oceanography, eqs. 16.28-16.33.
    Valid: wind 10 to 20 m/s in its data, in use down to 3 m/s; gravity waves, longer than some decimetres.

    Example:
        >>> sea = PiersonMoskowitz(wind_speed=10.0)
        >>> f"period {2 * np.pi / angular_frequency(sea.peak):.1f} s, height {significant_height(sea):.1f} m"
        'period 7.5 s, height 2.2 m'
    """

    wind_speed: float
    """Wind 10 m above the sea [m/s]."""

    def __post_init__(self) -> None:
        """Refuse an impossible wind speed."""
        object.__setattr__(self, "wind_speed", checked_wind("PiersonMoskowitz", self.wind_speed))
        warn_outside(LAW, "wind speed", self.wind_speed, *WIND_RANGE, "m/s")

    @property
    def peak(self) -> float:
        """Wavenumber of the peak in frequency, omega_p = (4 beta / 5)^(1/4) g / U19.5 [rad/m]."""
        return GRAVITY * (0.8 * SHAPE) ** 0.5 / (MAST_WIND_RATIO * self.wind_speed) ** 2

    def frequency_density(self, angular_frequency: ArrayLike) -> Floats:
        """Variance of the height per angular frequency [m^2 s], at frequencies above 0 [rad/s], any shape."""
        omega = require_numbers("angular_frequency", angular_frequency, "rad/s", 0.0, exclude_low=True)
        wave_age = GRAVITY / (MAST_WIND_RATIO * self.wind_speed * omega)
        return np.asarray(PHILLIPS * GRAVITY**2 / omega**5 * np.exp(-SHAPE * wave_age**4))

    def density(self, wavenumber: ArrayLike) -> Floats:
        """Variance of the height per wavenumber [m^3], at wavenumbers above 0 [rad/m], any shape.

        The frequency spectrum carried over by omega^2 = g k.
        """
        omega = np.sqrt(GRAVITY * require_numbers("wavenumber", wavenumber, "rad/m", 0.0, exclude_low=True))
        return np.asarray(self.frequency_density(omega) * GRAVITY / (2 * omega))
