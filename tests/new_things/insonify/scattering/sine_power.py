"""Scattering law with a power of the sines of both grazing angles: a product of one factor for each direction."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from insonify.scattering.law import Floats


@dataclass(frozen=True, slots=True)
class SinePower:
    """Cross section mu sin(in)^n sin(out)^n; with n of 1 that of Lambert's law."""

    citation: ClassVar[str] = "none: a law of a test"
    strength_db: float = -27.0
    exponent: float = 1.0
    law: Literal["sine-power"] = "sine-power"

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1]."""
        return self.direction_factor(grazing_in) * self.direction_factor(grazing_out) * np.ones_like(azimuth)

    def direction_factor(self, grazing: Floats) -> Floats:
        """Factor of one direction [1]."""
        return 10 ** (self.strength_db / 20) * np.maximum(np.sin(grazing), 0) ** self.exponent
