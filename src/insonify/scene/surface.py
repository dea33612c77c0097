"""The sea surface: a mirror for bounces, and a scatterer of its own."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from insonify.noun import MetresPerSecond, Noun
from insonify.scattering.apl_surface import AplSurface
from insonify.scattering.lambert import Lambert
from insonify.scene.bottom_law import law_by_its_numbers


class WindLaw(Noun):
    """What the surface echoes under a wind: facets, ripples and bubbles of APL-UW TR 9407."""

    law: Literal["apl-surface"] = "apl-surface"
    """Name of the law."""
    wind_speed: Annotated[MetresPerSecond, Field(ge=0, le=30)]
    """Wind at a height of 10 m [m/s]."""

    def at(self, frequency: float) -> AplSurface:
        """The law at one frequency [Hz]."""
        return AplSurface(self.wind_speed, frequency)


class Surface(Noun):
    """A flat sea surface at depth zero."""

    bounce: Literal["mirror"] = "mirror"
    """How a path bounces: a mirror returns all the sound, with its sign turned."""
    scattering: Annotated[
        Annotated[Lambert | WindLaw, Field(discriminator="law")] | None, BeforeValidator(law_by_its_numbers)
    ] = None
    """Law of the surface's own reverberation; None for a surface that only mirrors."""

    def law(self, frequency: float) -> Lambert | AplSurface | None:
        """The law of the surface's own reverberation at one frequency [Hz]."""
        return self.scattering.at(frequency) if isinstance(self.scattering, WindLaw) else self.scattering

    def mirror(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one surface bounce: -1 at any grazing angle [rad]."""
        return np.full(np.shape(grazing), -1.0 + 0j)
