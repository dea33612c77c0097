"""Scattering by a point target, the same in all directions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PointTargetLaw:
    """Point target of given target strength, as a law of unit area."""

    target_strength_db: float = 0.0
    """Target strength [dB re 1 m^2]."""

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Scattering cross section [m^2], independent of the angles [rad]; broadcast shape."""
        shape = np.broadcast_shapes(np.shape(grazing_in), np.shape(grazing_out), np.shape(azimuth))
        return np.full(shape, 10 ** (self.target_strength_db / 10))
