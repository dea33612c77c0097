"""Legs: the one-way paths between one end of the sonar and the scatterers of the scene."""

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_COLUMNS = (
    "delay", "length", "spreading", "absorption", "reflection_coefficient", "caustics", "visibility", "grazing_sine",
    "status", "occluder",
)  # fmt: skip


class LegStatus(IntEnum):
    """Reason for the presence or absence of a leg."""

    CLEAR = 0
    FACING_AWAY = 1
    OCCLUDED = 2
    SHADOW = 3
    """No ray of the family reaches the point: it lies in a refractive shadow zone."""
    TURNED = 4
    """The rays of the family turn before they have reached all their boundaries, or the point's depth."""
    BEYOND_CRITICAL = 5
    """The point lies between the rays that cross a layer and those that turn in it; no ray arrives."""


SEABED_OCCLUDER = -2
"""Occluder of a leg that the seabed itself occludes."""


@dataclass(frozen=True, slots=True)
class GlintPhasors:
    """Random phasors of legs reflected by a moving surface: rows as in `Legs`, n points."""

    bounce_id: tuple[int, ...]
    """Label of each row's random bounce; transmit and receive rows with one label share it; -1 for none."""
    phasor: NDArray[np.complex128]
    """Phasor of the bounce at its own time, of unit modulus; 1 where the bounce is not random [1], shape (f, n)."""
    bed_quanta: Floats | None = None
    """Mean number of quanta of one bottom bounce, and of all bounces, for rows that are random [1], shape (2, f, n).

    None: the seabed is smooth.
    """


@dataclass(frozen=True, slots=True)
class Legs:
    """One-way paths between one end (transmitter or receiver) and n points, by f families; columns of shape (f, n).

    A family with several rays to some point has a row for each ray. Rays to a point are numbered by launch angle, from
    the steepest up to the steepest down; a point with fewer rays has no path in the last rows.
    A missing path has visibility 0 and its reason in `status`; its other columns are undefined. With edge diffraction
    an occluded leg keeps a small visibility.
    Every column refers to travel away from the sonar; by reciprocity the receive leg is the same path.

    Example:
        >>> from insonify.propagation.image_sources import image_legs
        >>> from insonify.scene.scene import Scene, point_scatterer
        >>> from insonify.scene.target import PointTarget
        >>> scene, sonar = Scene(seabed={"depth": 35}), np.array([0.0, 0.0, 10.0])
        >>> legs = image_legs(scene, sonar, point_scatterer(PointTarget(position=(40, 0, 20))), ("D", "S", "B"), 100e3)
        >>> legs.families, legs.length.round(1).ravel().tolist()  # by the images at depths of 10, -10 and 60 m
        (('D', 'S', 'B'), [41.2, 50.0, 56.6])
    """

    families: tuple[str, ...]
    """Name of each row's family: D direct, S surface, B bottom, SB surface then bottom, ..."""
    branch: tuple[int, ...]
    """Number of each row's ray within its family, from 0."""
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
    """Number of caustics touched along the path."""
    visibility: Floats | NDArray[np.complex128]
    """Pressure ratio by occlusion: 1 clear, 0 shadow; complex with edge diffraction [1]."""
    departure: Floats
    """Unit vector of travel at the sonar, away from it, in the world, shape (f, n, 3)."""
    arrival: Floats
    """Unit vector of travel at the point, towards it, in the world, shape (f, n, 3)."""
    grazing_sine: Floats
    """Sine of the angle between the arriving ray and the point's interface [1]; negative from behind."""
    status: NDArray[np.uint8]
    """Value of `LegStatus`."""
    occluder: NDArray[np.int16]
    """Row of the occluding target among the scene's occluders; -1 for none, -2 (`SEABED_OCCLUDER`) for the seabed."""
    caustic: NDArray[np.complex128] | None = None
    """Phasor of unit modulus: +90 degrees for each caustic, with the transition near one; None: 1 throughout."""
    glints: GlintPhasors | None = None
    """Random phasors of some rows, by a moving surface; None where nothing is random."""
    aperture_expansion: Floats | None = None
    """Delay and log-pressure about the array's centre beyond the spherical wavefront, see
    `insonify.propagation.aperture_expansion`, shape (f, terms, n); None: spherical wavefronts."""

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
        """Name of each row: its family, with a number for the second and later rays, as in D, D2, D3."""
        return tuple(ray_name(family, branch) for family, branch in zip(self.families, self.branch, strict=True))

    def first_rows(self, rows: int) -> "Legs":
        """The first few rows, as views of the columns."""
        columns = {name: getattr(self, name)[:rows] for name in (*_COLUMNS, "departure", "arrival")}
        caustic = None if self.caustic is None else self.caustic[:rows]
        expansion = None if self.aperture_expansion is None else self.aperture_expansion[:rows]
        return replace(
            self, families=self.families[:rows], branch=self.branch[:rows], caustic=caustic,
            aperture_expansion=expansion, **columns,
        )  # fmt: skip

    @property
    def amplitude(self) -> NDArray[np.complex128]:
        """Pressure at the point re 1 m from the source, phase of reflections only [1], shape (f, n)."""
        product = np.asarray(self.spreading * self.absorption * self.visibility * self.reflection_coefficient)
        product = product if self.caustic is None else product * self.caustic
        return product if self.glints is None else product * self.glints.phasor

    def times(self, factor: Floats | NDArray[np.complex128]) -> "Legs":
        """The legs with a factor on their reflection coefficients [1], shape (f, n)."""
        return replace(self, reflection_coefficient=self.reflection_coefficient * factor)


def joined_legs(first: Legs, second: Legs) -> Legs:
    """Rows of two sets of legs between the same end and the same points."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(first, name), getattr(second, name)])
        for name in (*_COLUMNS, "departure", "arrival")
    }
    for name in ("families", "branch"):
        columns[name] = (*getattr(first, name), *getattr(second, name))
    if first.caustic is not None or second.caustic is not None:
        ones = (
            np.ones(legs.delay.shape, complex) if legs.caustic is None else legs.caustic for legs in (first, second)
        )
        columns["caustic"] = np.concatenate(list(ones))
    expansion = first.aperture_expansion
    if expansion is not None:  # the rows of the second have spherical wavefronts
        none = np.zeros((len(second.families), *expansion.shape[1:]))
        columns["aperture_expansion"] = np.concatenate([expansion, none])
    if first.glints is not None or second.glints is not None:
        both = [
            GlintPhasors((-1,) * len(legs.families), np.ones(legs.delay.shape, complex))
            if legs.glints is None
            else legs.glints
            for legs in (first, second)
        ]
        quanta = [np.zeros((2, *one.phasor.shape)) if one.bed_quanta is None else one.bed_quanta for one in both]
        columns["glints"] = GlintPhasors(
            both[0].bounce_id + both[1].bounce_id, np.concatenate([one.phasor for one in both]),
            None if all(one.bed_quanta is None for one in both) else np.concatenate(quanta, axis=1),
        )  # fmt: skip
    return replace(first, **columns)


def have_same_geometry(first: Legs, second: Legs) -> bool:
    """Return True if both sets share the columns on which occlusion depends, as legs of one end off a rough surface."""
    columns = ("length", "visibility", "arrival", "status", "occluder")
    return first.families == second.families and all(getattr(first, c) is getattr(second, c) for c in columns)


def legs_to_points(sets: tuple[Legs, Legs], points: slice | NDArray[np.intp]) -> tuple[Legs, Legs]:
    """Transmit and receive legs to some of their points; columns that both share stay shared.

    Args:
        sets: Transmit and receive legs to n points.
        points: Points of the result: by a slice, which makes views of the columns, or by their rows.
    """
    views: dict[int, Any] = {}

    def view(column: Any, axis: int = 1) -> Any:
        if column is None:
            return None
        return views.setdefault(id(column), column[(slice(None),) * axis + (points,)])

    def part(legs: Legs) -> Legs:
        columns = {name: view(getattr(legs, name)) for name in (*_COLUMNS, "departure", "arrival", "caustic")}
        glints = legs.glints
        if glints is not None:
            glints = replace(glints, phasor=view(glints.phasor), bed_quanta=view(glints.bed_quanta, 2))
        return replace(legs, aperture_expansion=view(legs.aperture_expansion, 2), glints=glints, **columns)

    first = part(sets[0])
    return first, first if sets[1] is sets[0] else part(sets[1])


def ray_name(family: str, branch: int) -> str:
    """Name of one ray of a family: D for the first, D2 for the second, by launch angle."""
    return f"{family}{branch + 1}" if branch else family
