"""Wavelength between resolved terrain and roughness, one for a scene.

Longer waves are terrain, which has slopes and casts shadows. Shorter waves are roughness, whose effect is in the
scattering law and in the loss of a coherent reflection. The cutoff does not depend on sampling density, range or beam,
so that no slope and no shadow counts twice.
"""

import math
from typing import Annotated, Self

import numpy as np
from pydantic import Field

from insonify.model import Metres, Model
from insonify.scattering.sediments import Sediment

FINEST, COARSEST = 0.005, 1000.0
"""Limits of the cutoff wavelength [m]."""


class RoughnessCutoff(Model):
    """Wavelength between resolved terrain and roughness left to the scattering law.

    Example:
        >>> from insonify.scattering import Sediment
        >>> cutoff = RoughnessCutoff.of_sediment(Sediment.named("medium sand"), frequency=30e3)
        >>> f"{cutoff.wavelength:.2f} m"
        '0.52 m'
    """

    wavelength: Annotated[Metres, Field(ge=FINEST, le=COARSEST)] = 0.5
    """Longest wavelength that is left to the scattering law [m]; the default is medium sand's at 30 kHz."""

    @classmethod
    def of_sediment(cls, sediment: Sediment, frequency: float, *, sound_speed: float = 1500.0) -> Self:
        """Cutoff at which the handbook's composite-roughness model divides large from small scales.

        The roughness below it has an rms height h with k h = 1 / sqrt(2), the limit of small-slope scattering; the
        slopes above it are those that the handbook averages over. Finer terrain gives up to 4 dB more at low grazing
        angles, coarser terrain as much less. The cutoff is some tens of acoustic wavelengths in mud, ten in medium sand
        at 30 kHz, two to five in gravel.

        Args:
            sediment: Sediment, whose spectral exponent and strength are used.
            frequency: Highest frequency of the scene [Hz].
            sound_speed: Sound speed in the water [m/s].

        Returns:
            Cutoff wavelength 2 pi / K, K = (2 pi w2 k^2 / alpha)^(1 / (2 alpha)), limited to 5 mm to 1 km.

        Source: APL-UW TR 9407 (1994), rms slope of the large scales, within eqs. 41-52; K is where the slope of
        the spectrum below it is that rms slope.
        Valid: rms slopes below some 20 degrees. With it facets give the composite level within 2 dB from 5 to 40
        degrees for every sediment with a grain size at 30 and 100 kHz, and for rock and stones at 30 kHz.
        """
        for quantity, value in (("frequency", frequency), ("sound_speed", sound_speed)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"RoughnessCutoff.of_sediment: {quantity} is {value}; give a finite number above 0")
        alpha, k = sediment.spectral_exponent / 2 - 1, 2 * math.pi * frequency / sound_speed
        wavenumber = (2 * math.pi * sediment.spectral_strength * k**2 / alpha) ** (1 / (2 * alpha))
        return cls(wavelength=min(max(2 * math.pi / wavenumber, FINEST), COARSEST))

    @property
    def wavenumber(self) -> float:
        """Wavenumber of the cutoff wavelength [rad/m]."""
        return 2 * np.pi / self.wavelength
