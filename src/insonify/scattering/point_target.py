"""The echo of a point: the same in all directions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PointTargetLaw:
    """A point target of given target strength, as a law whose area is one."""

    target_strength_db: float = 0.0
    """Target strength [dB re 1 m^2]."""

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Backscattering cross section [m^2], whatever the angles [rad]; shape of their broadcast."""
        shape = np.broadcast_shapes(np.shape(grazing_in), np.shape(grazing_out), np.shape(azimuth))
        return np.full(shape, 10 ** (self.target_strength_db / 10))
