"""The sea surface: a mirror for bounces, and a scatterer of its own."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from insonify.noun import Noun
from insonify.scattering.lambert import Lambert


class Surface(Noun):
    """A flat sea surface at depth zero."""

    bounce: Literal["mirror"] = "mirror"
    """How a path bounces: a mirror returns all the sound, with its sign turned."""
    scattering: Lambert | None = None
    """Law of the surface's own reverberation; None for a surface that only mirrors."""

    def mirror(self, grazing: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Pressure reflection coefficient of one surface bounce: -1 at any grazing angle [rad]."""
        return np.full(np.shape(grazing), -1.0 + 0j)
