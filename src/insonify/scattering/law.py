"""Interface of all scattering laws: the bistatic cross section of a patch of interface."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_numbers

Floats = NDArray[np.float64]


@runtime_checkable
class ScatteringLaw(Protocol):
    """Bistatic scattering cross section of a patch of interface.

    Example:
        >>> sand = Sediment.named("medium sand")
        >>> laws: list[ScatteringLaw] = [Lambert(), Jackson(sand, 100e3), SedimentVolume(sand, 100e3)]
        >>> grazing = np.radians(20)
        >>> [f"{10 * np.log10(law.cross_section(grazing, grazing, np.pi)):.0f} dB" for law in laws]
        ['-36 dB', '-25 dB', '-36 dB']
    """

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic scattering cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

        Returns:
            Scattered intensity at 1 m per unit incident intensity and unit area [1], broadcast shape.
        """
        ...


@runtime_checkable
class ProductLaw(ScatteringLaw, Protocol):
    """Law that is the product of one factor for each direction, for any azimuth."""

    def direction_factor(self, grazing: Floats) -> Floats:
        """Factor of one direction, square root of its backscattering cross section [1]; grazing [rad], any shape."""
        ...


def checked_angles(grazing_in: ArrayLike, grazing_out: ArrayLike, azimuth: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Angles of a scattering law as checked numbers.

    Args:
        grazing_in: Grazing angle of the incident sound, -pi/2 (behind the interface) to pi/2 [rad], any shape;
            NaN is a gap and stays one.
        grazing_out: Grazing angle of the scattered sound, -pi/2 to pi/2 [rad], any shape.
        azimuth: Azimuth between the two directions, unlimited [rad], any shape.

    Returns:
        The three angles, each in its own shape.

    Raises:
        ValueError: A value is not a number, or a grazing angle is out of range; 20 degrees are np.radians(20).
    """
    right = np.pi / 2 + 1e-9  # rounding of arcsines
    into, out = (
        require_numbers(name, value, "rad", -right, right, example="np.radians(20)")
        for name, value in (("grazing_in", grazing_in), ("grazing_out", grazing_out))
    )
    return into, out, require_numbers("azimuth", azimuth, "rad")
