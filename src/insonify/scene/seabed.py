"""The seabed: where it lies, how it scatters and how it mirrors sound."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from insonify.noun import Metres, Noun
from insonify.scattering.lambert import Lambert
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.sediments import Sediment
from insonify.scene.lattice import Lattice

SEDIMENTS = Literal["medium sand"]


class Seabed(Noun):
    """A flat seabed at one depth."""

    depth: Annotated[Metres, Field(ge=0.1, le=12_000)] = 20.0
    """Depth of the flat bed below the mean surface, positive down [m]."""
    scattering: Lambert | None = Lambert(strength_db=-27.0)
    """Law of diffuse scattering; None for a bed that only mirrors."""
    reflection: Annotated[float, Field(ge=-1, le=1)] | SEDIMENTS = 0.35
    """Pressure reflection coefficient [1], or the sediment whose Rayleigh coefficient is used."""

    lattice: Lattice = Lattice()
    """Frame of the drawn scatterers, of the seabed and of the surface alike."""

    def mirror(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one bottom bounce [1].

        Args:
            grazing: Grazing angle at the bed [rad], any shape.

        Returns:
            Complex coefficient for exp(+j omega t), shape of `grazing`.
        """
        if isinstance(self.reflection, str):
            return reflection_coefficient(Sediment.named(self.reflection), grazing)
        return np.full(np.shape(grazing), complex(self.reflection))
