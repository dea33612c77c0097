"""What every scattering law has in common: one question."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_numbers

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


def checked_angles(grazing_in: ArrayLike, grazing_out: ArrayLike, azimuth: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """The three angles that a law is asked with, as numbers.

    Args:
        grazing_in: From -pi/2 (behind the interface) to pi/2 [rad], any shape; NaN is a gap and stays one.
        grazing_out: Likewise [rad], any shape.
        azimuth: Any [rad], any shape.

    Returns:
        The three, each in its own shape.

    Raises:
        ValueError: Something is no number or no angle; 20 degrees are np.radians(20).
    """
    right = np.pi / 2 + 1e-9  # angles come out of arcsines, rounded
    into, out = (
        require_numbers(name, value, "rad", -right, right, example="np.radians(20)")
        for name, value in (("grazing_in", grazing_in), ("grazing_out", grazing_out))
    )
    return into, out, require_numbers("azimuth", azimuth, "rad")
