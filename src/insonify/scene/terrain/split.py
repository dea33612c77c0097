"""The wavelength that divides relief from roughness, set once for a scene.

What is longer is ground: it has slopes, it casts shadows. What is shorter is roughness: it belongs
to the scattering law and to the loss of a coherent reflection. The division does not follow sampling
density, range or beam, so no slope and no shadow is ever counted twice.
"""

from typing import Annotated

import numpy as np
from pydantic import Field

from insonify.noun import Metres, Noun


class Split(Noun):
    """Where a scene stops drawing the ground and starts describing it."""

    wavelength: Annotated[Metres, Field(ge=0.005, le=1000)] = 0.5
    """Longest wavelength that is left to the scattering law [m]; of the order of ten acoustic wavelengths."""

    @property
    def wavenumber(self) -> float:
        """Its wavenumber [rad/m]."""
        return 2 * np.pi / self.wavelength
