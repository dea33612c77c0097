"""A sea that is still growing: the JONSWAP spectrum of 1973.

Near an upwind shore the waves are young: shorter than the wind could make them, and
bunched around one length more sharply than in an old sea.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from insonify.ocean.wave_spectrum import GRAVITY, Floats
from insonify.ocean.wind import checked_wind


@dataclass(frozen=True, slots=True)
class Jonswap:
    """A wind sea that grew over a given distance from the shore.

    Source: Hasselmann et al. (1973), Dtsch. Hydrogr. Z. Suppl. A 8(12); constants checked
    against three public implementations, the paper itself was not at hand. The width on
    either side of the peak is 0.07 and 0.09.
    Valid: fetch-limited wind seas in deep water; gravity waves, longer than some decimetres.
    """

    wind_speed: float
    """Wind 10 m above the sea [m/s]."""
    fetch: float
    """Distance to the upwind shore [m]."""
    enhancement: float = 3.3
    """Height of the peak over that of a developed sea, JONSWAP's gamma [1]."""

    def __post_init__(self) -> None:
        """Refuse a wind, a shore or a peak that could not be."""
        checked_wind("Jonswap", self.wind_speed)
        if not (math.isfinite(self.fetch) and self.fetch > 0):
            raise ValueError(f"Jonswap.fetch is {self.fetch} m; give a finite distance to the upwind shore, above 0")
        if not 1 <= self.enhancement <= 10:
            raise ValueError(f"Jonswap.enhancement is {self.enhancement}; give 1 (no peak) to 10, 3.3 on average")

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
        omega = np.asarray(angular_frequency, dtype=float)
        peak = self.peak_frequency
        strength = 0.076 * (self.wind_speed**2 / (self.fetch * GRAVITY)) ** 0.22
        width = np.where(omega <= peak, 0.07, 0.09)
        bunched = self.enhancement ** np.exp(-((omega / peak - 1) ** 2) / (2 * width**2))
        return np.asarray(strength * GRAVITY**2 / omega**5 * np.exp(-1.25 * (peak / omega) ** 4) * bunched)

    def density(self, wavenumber: ArrayLike) -> Floats:
        """Variance of the height per wavenumber [m^3], at wavenumbers above 0 [rad/m], any shape.

        The frequency spectrum carried over by omega^2 = g k.
        """
        omega = np.sqrt(GRAVITY * np.asarray(wavenumber, dtype=float))
        return np.asarray(self.frequency_density(omega) * GRAVITY / (2 * omega))
