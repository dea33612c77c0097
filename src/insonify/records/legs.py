"""Legs: the one-way paths between one end of the sonar and the scatterers of the scene."""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_COLUMNS = (
    "delay", "length", "spreading", "absorption", "reflection_coefficient", "caustics", "visibility", "grazing", "status", "occluder",
)  # fmt: skip


class LegStatus(IntEnum):
    """Why a leg is there, or is not."""

    CLEAR = 0
    FACING_AWAY = 1
    OCCLUDED = 2
    SHADOW = 3
    """No ray of the family gets there: refraction bends them all away."""
    TURNED = 4
    """The rays of the family turn before they have met all their boundaries, or that depth."""
    BEYOND_CRITICAL = 5
    """Between rays that pass a layer and rays that turn in it, none arrives."""


SEABED_OCCLUDER = -2
"""Occluder of a leg that the ground itself cuts."""


@dataclass(frozen=True, slots=True)
class GlintPhasors:
    """What is random about legs off a moving surface: rows as in `Legs`, n points."""

    bounce_id: tuple[int, ...]
    """Which random bounce each row has met: rows out and back of one label meet the same; -1 for none."""
    phasor: NDArray[np.complex128]
    """Phasor of the bounce at its own time, of unit modulus; 1 where nothing is random [1], shape (f, n)."""


@dataclass(frozen=True, slots=True)
class Legs:
    """Paths between one end (transmitter or receiver) and n points, by f families; columns of shape (f, n).

    A family of which several rays reach some point has a row for each: the rays to a point are numbered by launch
    angle, from the steepest up to the steepest down, and a point with fewer of them has no path in the last rows.
    What is not there has visibility 0 and its reason in `status`; its other numbers mean nothing. Only behind soft
    edges a leg that is cut is not quite silent.
    Every column is as seen when going away from the sonar; by reciprocity the leg back is the same path.
    """

    families: tuple[str, ...]
    """Name of each row's family: D direct, S surface, B bottom, SB surface then bottom, ..."""
    branch: tuple[int, ...]
    """Which of the family's rays each row holds, from 0."""
    delay: Floats
    """One-way travel time [s]."""
    length: Floats
    """Length of the path [m]."""
    spreading: Floats
    """Pressure ratio by spreading, re 1 m [1]; where rays cross it is limited by diffraction."""
    absorption: Floats
    """Pressure ratio by absorption [1]."""
    reflection_coefficient: NDArray[np.complex128]
    """Product of the reflection coefficients of all bounces [1]."""
    caustics: NDArray[np.uint8]
    """Caustics touched on the way."""
    visibility: Floats | NDArray[np.complex128]
    """Pressure ratio by occlusion: 1 clear, 0 shadow; complex where edges are soft [1]."""
    departure: Floats
    """Unit vector of travel at the sonar, away from it, in the world, shape (f, n, 3)."""
    arrival: Floats
    """Unit vector of travel at the point, towards it, in the world, shape (f, n, 3)."""
    grazing: Floats
    """Angle between the arriving ray and the point's interface [rad]; negative from behind."""
    status: NDArray[np.uint8]
    """One of `LegStatus`."""
    occluder: NDArray[np.int16]
    """Row of the target that cuts the leg among the scene's occluders, -1 for none, -2 (`SEABED_OCCLUDER`) for the ground."""
    caustic: NDArray[np.complex128] | None = None
    """Phasor of unit modulus: +90 degrees for each caustic, and how rays merge near one; None for ones throughout."""
    glints: GlintPhasors | None = None
    """What a moving surface makes of some rows; None where nothing is random."""
    aperture_expansion: Floats | None = None
    """What elements about the centre hear beyond a sphere, see `insonify.propagation.aperture_expansion`, (f, terms, n); None: that
    is all they hear."""

    def __post_init__(self) -> None:
        """Refuse columns whose shape is not (families, points)."""
        if len(self.branch) != len(self.families):
            raise ValueError(f"Legs.branch has {len(self.branch)} rows; there are {len(self.families)} families")
        shape = (len(self.families), self.delay.shape[-1])
        for name in _COLUMNS:
            if getattr(self, name).shape != shape:
                raise ValueError(f"Legs.{name} has shape {getattr(self, name).shape}; families and points are {shape}")
        if self.caustic is not None and self.caustic.shape != shape:
            raise ValueError(f"Legs.caustic has shape {self.caustic.shape}; families and points are {shape}")

    @property
    def ray_names(self) -> tuple[str, ...]:
        """Name of each row: its family, and for further rays of it their number, as in D, D2, D3."""
        return tuple(ray_name(family, branch) for family, branch in zip(self.families, self.branch, strict=True))

    def first_rows(self, rows: int) -> "Legs":
        """The first few rows, in columns that are shared."""
        columns = {name: getattr(self, name)[:rows] for name in (*_COLUMNS, "departure", "arrival")}
        caustic = None if self.caustic is None else self.caustic[:rows]
        beside = None if self.aperture_expansion is None else self.aperture_expansion[:rows]
        return replace(
            self,
            families=self.families[:rows],
            branch=self.branch[:rows],
            caustic=caustic,
            aperture_expansion=beside,
            **columns,
        )

    @property
    def amplitude(self) -> NDArray[np.complex128]:
        """Pressure at the point re 1 m from the source, phase of reflections only [1], shape (f, n)."""
        product = np.asarray(self.spreading * self.absorption * self.visibility * self.reflection_coefficient)
        product = product if self.caustic is None else product * self.caustic
        return product if self.glints is None else product * self.glints.phasor


def ray_name(family: str, branch: int) -> str:
    """Name of one ray of a family: D for the first, D2 for the second, by launch angle."""
    return f"{family}{branch + 1}" if branch else family
