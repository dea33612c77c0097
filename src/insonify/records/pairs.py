"""Pairs: what a block of scatterers makes of every leg out and every leg back, before it is heard.

The fast path goes from here straight to the recording; `records.arrivals` writes the same
content out row by row, for people and for tests.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers


@dataclass(frozen=True, slots=True)
class Pairs:
    """Legs out and legs back of n scatterers, and how strongly each ordered pair of them scatters."""

    scatterers: Scatterers
    out: Legs
    """From the transmitter to the scatterers."""
    back: Legs
    """From the receiver to the scatterers, travelled the other way."""
    pair: NDArray[np.int64]
    """Row of the leg out and of the leg back of each ordered pair, shape (p, 2)."""
    strength: NDArray[np.float64] | NDArray[np.complex128]
    """Pressure scattered to 1 m re incident pressure [m]: the root of cross section times area, or what a smooth facet
    sends back, which turns the phase, shape (p, n)."""

    @property
    def together(self) -> bool:
        """Whether all arrivals of the block interfere, those of different points too: facets of one target do."""
        return not self.scatterers.drawn and len(self.scatterers) > 1

    def names(self) -> list[tuple[str, str]]:
        """Families out and back of each ordered pair."""
        return [(self.out.families[i], self.back.families[j]) for i, j in self.pair]

    def rays(self) -> list[tuple[str, str]]:
        """Rays out and back of each ordered pair: their families, and numbers where a family has several."""
        out, back = self.out.rays, self.back.rays
        return [(out[i], back[j]) for i, j in self.pair]

    def only(self, pairs: NDArray[np.int64]) -> "Pairs":
        """The same block with some of its ordered pairs, given by their rows."""
        return Pairs(self.scatterers, self.out, self.back, self.pair[pairs], self.strength[pairs])
