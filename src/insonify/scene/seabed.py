"""The seabed: where it lies, how it scatters and how it mirrors sound."""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field

from insonify.noun import Metres, Noun
from insonify.scattering.fast import FastLaw
from insonify.scattering.lambert import Lambert
from insonify.scattering.reflection import reflection_coefficient
from insonify.scene.bottom_law import SedimentLaw, known_sediment, law_by_its_numbers, sediment
from insonify.scene.lattice import Lattice

Reflection = Annotated[float, Field(ge=-1, le=1)] | Annotated[str, AfterValidator(known_sediment)]


class Seabed(Noun):
    """A flat seabed at one depth."""

    depth: Annotated[Metres, Field(ge=0.1, le=12_000)] = 20.0
    """Depth of the flat bed below the mean surface, positive down [m]."""
    scattering: Annotated[
        Annotated[Lambert | SedimentLaw, Field(discriminator="law")] | None, BeforeValidator(law_by_its_numbers)
    ] = SedimentLaw()
    """Law of diffuse scattering; None for a bed that only mirrors."""
    reflection: Reflection = "medium sand"
    """Pressure reflection coefficient [1], or the sediment whose Rayleigh coefficient is used."""

    lattice: Lattice = Lattice()
    """Frame of the drawn scatterers, of the seabed and of the surface alike."""

    def law(self, frequency: float, sound_speed: float) -> Lambert | FastLaw | None:
        """The law of diffuse scattering at one frequency [Hz], under water of one sound speed [m/s]."""
        if isinstance(self.scattering, SedimentLaw):
            return self.scattering.at(frequency, sound_speed)
        return self.scattering

    def mirror(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one bottom bounce [1].

        Args:
            grazing: Grazing angle at the bed [rad], any shape.

        Returns:
            Complex coefficient for exp(+j omega t), shape of `grazing`.
        """
        if isinstance(self.reflection, str):
            return reflection_coefficient(sediment(self.reflection), grazing)
        return np.full(np.shape(grazing), complex(self.reflection))
