"""Scatterers: points of the scene that scatter sound, each with a phase that is fixed to its position."""

import zlib
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.kirchhoff_facet import KirchhoffFacet
from insonify.scattering.kirchhoff_patch import KirchhoffPatch
from insonify.scattering.law import ScatteringLaw

Law = ScatteringLaw | CompiledLaw
Boundary = Literal["seabed", "surface", "target", "water", "boundary echo"]
BOUNDARY_ECHO: Final = "boundary echo"
"""Contribution and object of the sound that reaches the receiver by reflections alone."""
ROW_KEY_STEP = 1 << 27
"""Difference between the keys of a cell of the scatterer grid and of the cell one row before; one column before: 1."""


@dataclass(frozen=True, slots=True)
class Scatterers:
    """Points of one object under one law, as columns of equal length n."""

    object: str
    """Name of their object: "seabed", "surface", "water" or the label of a target or a patch."""
    boundary: Boundary
    """Boundary that they lie on; no leg has its last reflection off it. "boundary echo": the transmitter itself, see
    `insonify.engines.boundary_echoes`."""
    law: Law | KirchhoffFacet | KirchhoffPatch
    """Scattering law."""
    position: NDArray[np.float64]
    """North, east, depth [m], shape (n, 3)."""
    normal: NDArray[np.float64]
    """Unit normal into the water, shape (n, 3)."""
    area: NDArray[np.float64]
    """Area of the interface that each represents [m^2], shape (n,); length along the terrain in a slice [m]; 1 for a
    point target. On a seabed with a texture, times its factor; in the water the volume [m^3] times s_v [1/m]."""
    phase: NDArray[np.complex128]
    """Unit phasor of the position [1], shape (n,); 1 without random phases."""
    scatterer_id: NDArray[np.uint64]
    """Key of the position, the same in every ping, shape (n,)."""
    has_random_phase: bool = True
    """True: random phases, so that only paths of one scatterer interfere in the mean; False: all paths of the target
    do."""
    occluder: int = -1
    """Row of their target among the scene's occluders, -1 for none."""
    corners: NDArray[np.float64] | None = None
    """Corners of a smooth facet relative to its middle, which is the point [m], shape (n, 3, 3); terms of a curved
    patch, see `insonify.scattering.kirchhoff_patch`, shape (n, 8, 3)."""

    relative_reflection: NDArray[np.float64] | None = None
    """Reflection coefficient of each smooth facet re that of the law [1], shape (n,); None: 1."""
    centre: NDArray[np.float64] | None = None
    """Middle of the whole target, for smooth faces and parts of a mesh [m], shape (3,)."""

    def __post_init__(self) -> None:
        """Refuse columns of unequal length."""
        for name in ("normal", "area", "phase", "scatterer_id"):
            rows = len(getattr(self, name))
            if rows != len(self.position):
                raise ValueError(f"Scatterers.{name} has {rows} rows; position has {len(self.position)}")

    def __len__(self) -> int:
        """Number of scatterers."""
        return len(self.position)

    def take(self, rows: slice | NDArray[np.bool_] | NDArray[np.int64]) -> "Scatterers":
        """The scatterers of some rows."""
        return replace(
            self, position=self.position[rows], normal=self.normal[rows], area=self.area[rows], phase=self.phase[rows],
            scatterer_id=self.scatterer_id[rows], corners=None if self.corners is None else self.corners[rows],
            relative_reflection=None if self.relative_reflection is None else self.relative_reflection[rows],
        )  # fmt: skip


def grid_scatterer_id(
    stream: int, scale: NDArray[np.int64] | int, along: NDArray[np.int64], across: NDArray[np.int64]
) -> NDArray[np.uint64]:
    """Keys of cells of the scatterer grid: stream, scale (-16 to 15) and cell numbers (+-2**26) packed in 64 bits."""
    half = 1 << 26
    cell = ((along + half) * ROW_KEY_STEP | (across + half)).astype(np.uint64)
    return cell | np.asarray((stream << 59) | ((np.asarray(scale, np.int64) & 31) << 54)).astype(np.uint64)


def whole_target_id(label: str, count: int) -> NDArray[np.uint64]:
    """Key of a whole target, repeated for points that form one object, shape (count,)."""
    return np.full(count, _first_key(label, 7), np.uint64)


def target_scatterer_id(label: str, face: int, row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.uint64]:
    """Keys of points on a target: label, face (6 is a solid, 7 the whole), cell numbers (below 4096) in 64 bits."""
    return ((row << 12) | column).astype(np.uint64) | np.uint64(_first_key(label, face))


def _first_key(label: str, face: int) -> int:
    """Key of the first cell of a face of a target."""
    return (random_keys.TARGET << 59) | (zlib.crc32(label.encode()) << 27) | (face << 24)
