"""Echo energies: expected energies of two-way paths, without phases."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class EchoEnergies:
    """Expected energies of n two-way paths, of one contribution and one pair of families."""

    contribution: str
    """Kind of scatterer: "seabed", "surface" or "target"; "boundary echo" for none."""
    object: str
    """Object that returns the echo: "seabed", "surface" or a target's label."""
    transmit_chain: str
    """Specular bounces of the transmit leg, from the sonar outwards: letters S, B and T (a target's face); D for
    none."""
    receive_chain: str
    """Specular bounces of the receive leg, from the sonar outwards; letters as in `transmit_chain`; empty for
    a boundary echo."""
    delay: Floats
    """Two-way travel time [s], shape (n,)."""
    energy: Floats
    """Mean-square pressure of each path alone [uPa^2], shape (channels, n)."""
    reciprocal: Floats
    """Mean-square pressure added by interference with the path travelled backwards, as a fraction of `energy` [1],
    shape (n,)."""

    def __post_init__(self) -> None:
        """Refuse columns of unequal length."""
        for name in ("energy", "reciprocal"):
            rows = getattr(self, name).shape[-1]
            if rows != len(self.delay):
                raise ValueError(f"EchoEnergies.{name} has {rows} rows; delay has {len(self.delay)}")

    def __len__(self) -> int:
        """Number of paths."""
        return len(self.delay)
