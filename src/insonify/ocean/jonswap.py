"""Wave spectrum of a fetch-limited sea: JONSWAP (1973).

Near an upwind shore the waves are young: shorter than those of a developed sea, with a sharper peak of the spectrum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from insonify.ocean.wave_spectrum import GRAVITY, Floats
from insonify.ocean.wind import checked_wind
from insonify.validity import require_number, require_numbers, warn_outside

LAW = "JONSWAP (1973) wave spectrum"
SHORTEST_FETCH, LONGEST_FETCH = 0.1, 2.2e4
"""Fetches in units of U^2 / g: the shortest measured (not verified), and that of a fully developed sea [1]."""


@dataclass(frozen=True, slots=True)
class Jonswap:
    """Wind sea of a given distance from the upwind shore.

    Source: Hasselmann et al. (1973), Dtsch. Hydrogr. Z. Suppl. A 8(12); constants checked
    against three public implementations, not verified against the paper. The relative
    width of the peak is 0.07 below and 0.09 above its frequency.
    Valid: fetch-limited wind seas in deep water, 0.1 to 2.2e4 U^2/g from the shore (beyond, the sea is developed:
    `PiersonMoskowitz`); gravity waves, longer than some decimetres.

    Example:
        >>> sea = Jonswap(wind_speed=10.0, fetch=50e3)
        >>> f"period {2 * np.pi / sea.peak_frequency:.1f} s, dominant waves {2 * np.pi / sea.peak:.0f} m long"
        'period 4.9 s, dominant waves 38 m long'
    """

    wind_speed: float
    """Wind 10 m above the sea [m/s]."""
    fetch: float
    """Distance to the upwind shore [m]."""
    enhancement: float = 3.3
    """Height of the peak over that of a developed sea, JONSWAP's gamma [1]."""

    def __post_init__(self) -> None:
        """Refuse an impossible wind speed, fetch or peak enhancement."""
        wind, shore = checked_wind("Jonswap", self.wind_speed), "50e3 to the upwind shore"
        fetch = require_number("Jonswap.fetch", self.fetch, "m", 0.0, exclude_low=True, example=shore)
        enhancement = require_number("Jonswap.enhancement", self.enhancement, "", 1.0, 10.0, example="3.3")
        for name, value in (("wind_speed", wind), ("fetch", fetch), ("enhancement", enhancement)):
            object.__setattr__(self, name, value)
        relative_fetch = GRAVITY * self.fetch / self.wind_speed**2
        warn_outside(LAW, "fetch in units of U^2/g", relative_fetch, SHORTEST_FETCH, LONGEST_FETCH, "")

    @property
    def peak_frequency(self) -> float:
        """Angular frequency of the dominant waves, 22 (g^2 / U X)^(1/3) [rad/s]."""
        return 22 * (GRAVITY**2 / (self.wind_speed * self.fetch)) ** (1 / 3)

    @property
    def peak(self) -> float:
        """Wavenumber of the dominant waves [rad/m]."""
        return self.peak_frequency**2 / GRAVITY

    def frequency_density(self, angular_frequency: ArrayLike) -> Floats:
        """Variance of the height per angular frequency [m^2 s], at frequencies above 0 [rad/s], any shape."""
        omega = require_numbers("angular_frequency", angular_frequency, "rad/s", 0.0, exclude_low=True)
        peak = self.peak_frequency
        strength = 0.076 * (self.wind_speed**2 / (self.fetch * GRAVITY)) ** 0.22
        width = np.where(omega <= peak, 0.07, 0.09)
        enhanced = self.enhancement ** np.exp(-((omega / peak - 1) ** 2) / (2 * width**2))
        return np.asarray(strength * GRAVITY**2 / omega**5 * np.exp(-1.25 * (peak / omega) ** 4) * enhanced)

    def density(self, wavenumber: ArrayLike) -> Floats:
        """Variance of the height per wavenumber [m^3], at wavenumbers above 0 [rad/m], any shape.

        The frequency spectrum carried over by omega^2 = g k.
        """
        omega = np.sqrt(GRAVITY * require_numbers("wavenumber", wavenumber, "rad/m", 0.0, exclude_low=True))
        return np.asarray(self.frequency_density(omega) * GRAVITY / (2 * omega))
