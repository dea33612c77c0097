"""Lommel-Seeliger's law of scattering inside a medium that absorbs: no product of two factors."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from insonify.scattering.law import Floats


@dataclass(frozen=True, slots=True)
class LommelSeeliger:
    """Cross section mu sin(in) sin(out) / (sin(in) + sin(out))."""

    strength_db: float = -20.0
    law: Literal["lommel-seeliger"] = "lommel-seeliger"

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1]."""
        a, b = (np.maximum(np.sin(grazing), 0) for grazing in (grazing_in, grazing_out))
        return 10 ** (self.strength_db / 10) * a * b / np.maximum(a + b, 1e-12) * np.ones_like(azimuth)
