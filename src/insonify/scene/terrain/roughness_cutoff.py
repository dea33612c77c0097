"""The wavelength that divides relief from roughness, set once for a scene.

What is longer is ground: it has slopes, it casts shadows. What is shorter is roughness: it belongs
to the scattering law and to the loss of a coherent reflection. The division does not follow sampling
density, range or beam, so no slope and no shadow is ever counted twice.
"""

import math
from typing import Annotated, Self

import numpy as np
from pydantic import Field

from insonify.model import Metres, Model
from insonify.scattering.sediments import Sediment

FINEST, COARSEST = 0.005, 1000.0
"""Wavelengths between which a scene may be split [m]."""


class RoughnessCutoff(Model):
    """Wavelength between resolved terrain and roughness left to the scattering law."""

    wavelength: Annotated[Metres, Field(ge=FINEST, le=COARSEST)] = 0.5
    """Longest wavelength that is left to the scattering law [m]; the default is medium sand's at 30 kHz."""

    @classmethod
    def of_sediment(cls, sediment: Sediment, frequency: float, *, sound_speed: float = 1500.0) -> Self:
        """The split at which the handbook's composite seabed divides slopes from gratings.

        What is left below it has an rms height h with k h = 1 / sqrt(2), just low enough for small-slope scattering;
        the slopes above it are those that the handbook averages over. Finer ground brings up to 4 dB more at low
        grazing angles, coarser ground as much less. The split lies at some tens of wavelengths in mud, ten in medium
        sand at 30 kHz, two to five in gravel.

        Args:
            sediment: Its spectral exponent and strength are used.
            frequency: Highest frequency of the scene that matters [Hz].
            sound_speed: In the water [m/s].

        Returns:
            RoughnessCutoff at 2 pi / K, K = (2 pi w2 k^2 / alpha)^(1 / (2 alpha)), held between 5 mm and 1 km.

        Source: APL-UW TR 9407 (1994), rms slope of the large scales, within eqs. 41-52; K is where the slope of
        the spectrum below it is that rms slope.
        Valid: rms slopes below some 20 degrees. With it facets give the composite level within 2 dB from 5 to 40
        degrees for every sediment with a grain size at 30 and 100 kHz, and for rock and stones at 30 kHz.
        """
        for quantity, value in (("frequency", frequency), ("sound_speed", sound_speed)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"RoughnessCutoff.of_sediment: {quantity} is {value}; give a finite number above 0")
        alpha, k = sediment.spectral_exponent / 2 - 1, 2 * math.pi * frequency / sound_speed
        cut = (2 * math.pi * sediment.spectral_strength * k**2 / alpha) ** (1 / (2 * alpha))
        return cls(wavelength=min(max(2 * math.pi / cut, FINEST), COARSEST))

    @property
    def wavenumber(self) -> float:
        """Its wavenumber [rad/m]."""
        return 2 * np.pi / self.wavelength
