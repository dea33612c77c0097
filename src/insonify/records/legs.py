"""Legs: the one-way paths between one end of the sonar and the scatterers of the scene."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Status(IntEnum):
    """Why a leg is there, or is not."""

    CLEAR = 0
    FACING_AWAY = 1
    OCCLUDED = 2


@dataclass(frozen=True, slots=True)
class Legs:
    """Paths between one end (transmitter or receiver) and n points, by f families; columns of shape (f, n).

    Every column is as seen when going away from the sonar; by reciprocity the leg back is the same path.
    """

    families: tuple[str, ...]
    """Name of each family: D direct, S surface, B bottom, SB surface then bottom, ..."""
    delay: Floats
    """One-way travel time [s]."""
    spreading: Floats
    """Pressure ratio by spreading, re 1 m [1]."""
    absorption: Floats
    """Pressure ratio by absorption [1]."""
    boundary: NDArray[np.complex128]
    """Product of the reflection coefficients of all bounces [1]."""
    visibility: Floats
    """Pressure ratio by occlusion: 1 clear, 0 shadow [1]."""
    departure: Floats
    """Unit vector of travel at the sonar, away from it, in the world, shape (f, n, 3)."""
    arrival: Floats
    """Unit vector of travel at the point, towards it, in the world, shape (f, n, 3)."""
    grazing: Floats
    """Angle between the arriving ray and the point's interface [rad]; negative from behind."""
    status: NDArray[np.uint8]
    """One of `Status`."""
    occluder: NDArray[np.int16]
    """Row of the box that cuts the leg, -1 for none."""

    def __post_init__(self) -> None:
        """Refuse columns whose shape is not (families, points)."""
        shape = (len(self.families), self.delay.shape[-1])
        for name in ("delay", "spreading", "absorption", "boundary", "visibility", "grazing", "status", "occluder"):
            if getattr(self, name).shape != shape:
                raise ValueError(f"Legs.{name} has shape {getattr(self, name).shape}; families and points are {shape}")

    @property
    def amplitude(self) -> NDArray[np.complex128]:
        """Pressure at the point re 1 m from the source, phase of reflections only [1], shape (f, n)."""
        return np.asarray(self.spreading * self.absorption * self.visibility * self.boundary)
