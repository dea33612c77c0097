"""What every scattering law has in common: one question."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class ScatteringLaw(Protocol):
    """Answers one question about a patch of interface."""

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic scattering cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Of the sound that arrives, from the plane of the interface [rad], any shape.
            grazing_out: Of the sound that leaves, likewise [rad], broadcast.
            azimuth: Between the two: 0 forward, pi back [rad], broadcast.

        Returns:
            Scattered intensity at 1 m per unit incident intensity and unit area [1], broadcast shape.
        """
        ...
