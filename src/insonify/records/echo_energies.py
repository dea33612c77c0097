"""Echoes: energies that come back to the sonar one ray at a time, with no phase to speak of."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class EchoEnergies:
    """Expected energies of n ways out and back, of one contribution and one pair of families."""

    contribution: str
    """What echoed: "seabed", "surface" or "target"."""
    object: str
    """Who: "seabed", "surface" or a target's label."""
    transmit_chain: str
    """Mirrors of the way out, from the sonar outwards: letters S, B and T (a target's face); D for none."""
    receive_chain: str
    """Mirrors of the way back, likewise from the sonar outwards."""
    delay: Floats
    """Two-way travel time [s], shape (n,)."""
    energy: Floats
    """Mean-square pressure that the way brings by itself [uPa^2], shape (channels, n)."""
    reciprocal: Floats
    """Mean-square pressure added by interference with the same way travelled backwards, as a part of it [1], (n,)."""

    def __post_init__(self) -> None:
        """Refuse columns of unequal length."""
        for name in ("energy", "reciprocal"):
            rows = getattr(self, name).shape[-1]
            if rows != len(self.delay):
                raise ValueError(f"Echoes.{name} has {rows} rows; delay has {len(self.delay)}")

    def __len__(self) -> int:
        """Number of ways."""
        return len(self.delay)
