"""Scatterers in the water: one jittered point per cell of a three-dimensional lattice, the same in every ping.

Each represents the water of its cell: its backscattering cross section is the cell's volume times s_v at its position,
equal in all directions. Phases are random, so that the mean intensities of echoes add, as in the sonar equation.
"""

import zlib
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify import random_keys
from insonify.model import field_error
from insonify.ocean.scattering_layers import ScatteringPatch
from insonify.ocean.water import Water
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene._volume_scatterers_kernel import draw_water_blocks
from insonify.scene.scatterer_grid import BASE_PITCH, ScattererGrid
from insonify.scene.scatterers import Scatterers
from insonify.scene.seabed import Seabed
from insonify.scene.solid import seabed_depth_at
from insonify.scene.target import Target
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

CELLS = 4
"""Number of cells along each side of a block."""
WATER = "water"
"""Object of scatterers outside patches."""
LAYERS, PATCHES = (np.uint64(random_keys.VOLUME << 59 | kind << 58) for kind in (0, 1))
"""First bits of keys of positions in the water."""
MAX_POINTS_IN_PATCH = 200_000
"""Largest number of points of one patch."""
# Roberts (2018), "The unreasonable effectiveness of quasirandom sequences": powers of 1 / 1.2207..., not verified.
QUASIRANDOM_STEPS = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])


class WaterBlocks(NamedTuple):
    """Blocks of cells of water, nearly cubes, columns of shape (n,)."""

    scale: Integers
    """Scale of the cells: cubes of BASE_PITCH at 0; each scale doubles one side, along, across, down in turn."""
    along: Integers
    """Number of the block along the lattice's first axis."""
    across: Integers
    """Number of the block along its second axis."""
    down: Integers
    """Number of the block in depth, 0 at the surface."""

    @property
    def pitch(self) -> Floats:
        """Sides of a cell, along, across and down [m], shape (3, n)."""
        return np.asarray(BASE_PITCH * 2.0 ** ((self.scale + np.array([[2], [1], [0]])) // 3))

    @property
    def cell(self) -> Floats:
        """Volume of a cell [m^3], shape (n,)."""
        return np.asarray(BASE_PITCH**3 * 2.0**self.scale)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64] | slice) -> "WaterBlocks":
        """The blocks of some rows."""
        return WaterBlocks(*(column[rows] for column in self))

    def split(self) -> "WaterBlocks":
        """Two blocks of the next finer scale for each."""
        numbers = []
        for axis, column in enumerate(self[1:]):
            halved = (self.scale + 2 - axis) % 3 == 0
            numbers.append(np.stack([np.where(halved, 2 * column + half, column) for half in (0, 1)], -1).ravel())
        return WaterBlocks(np.repeat(self.scale - 1, 2), *numbers)


def water_scatterers(water: Water, seabed: Seabed, blocks: WaterBlocks, seed: int) -> Scatterers:
    """Scatterers of some blocks of water, one for each cell; none below the terrain or where s_v is 0.

    Args:
        water: Water with its scattering layers.
        seabed: Lower end of the water; its scatterer grid is that of the blocks.
        blocks: Numbers of the blocks.
        seed: Seed of the scenario.
    """
    n = len(blocks.scale) * CELLS**3
    position, phase, key = np.empty((n, 3)), np.empty(n, complex), np.empty(n, np.uint64)
    draw_water_blocks(
        *blocks, CELLS, BASE_PITCH, *random_keys.stream_key(seed, random_keys.VOLUME), position, phase, key
    )
    position[:, :2] = seabed.scatterer_grid.to_world(position[:, 0], position[:, 1])
    return layer_scatterers(water, seabed, position, blocks.cell.repeat(CELLS**3), phase, key | LAYERS)


def layer_scatterers(
    water: Water, seabed: Seabed, position: Floats, volume: Floats, phase: NDArray[np.complex128],
    key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Scatterers of the layers of the water, without those below the terrain or where s_v is 0.

    Args:
        water: Water with its scattering layers.
        seabed: Lower end of the water.
        position: North, east, depth [m], shape (n, 3).
        volume: Volume of water that each represents [m^3], shape (n,).
        phase: Unit phasors [1], shape (n,).
        key: Keys of the scatterers, shape (n,).
    """
    coefficient = np.zeros(len(position))  # s_v [1/m]
    for top, bottom, s_v in water.layers(max_water_depth(seabed)):
        coefficient[(position[:, 2] > top) & (position[:, 2] <= bottom)] = s_v
    in_water = coefficient > 0
    if seabed.terrain is not None:
        # a survey may have gaps, over which there is no water
        uppermost = seabed.terrain.span[0] if seabed.terrain.relief.is_waves else -np.inf
        near_seabed = in_water & (position[:, 2] >= uppermost)
        in_water[near_seabed] = position[near_seabed, 2] < seabed_depth_at(seabed, position[near_seabed, :2])
    return _points(WATER, position[in_water], (volume * coefficient)[in_water], phase[in_water], key[in_water])


@lru_cache(maxsize=16)
def patch_scatterers(
    patch: ScatteringPatch, seabed: Seabed, seed: int, pitch: float, *, quadrature: bool
) -> Scatterers:
    """Scatterers of a patch between seabed and sea surface, one for each cell of the patch.

    Args:
        patch: The patch.
        seabed: The seabed.
        seed: Seed of the scenario.
        pitch: Approximate side of a cell [m].
        quadrature: True: evenly spaced points, for an expectation; False: random points.
    """
    size = np.array(patch.size)
    pitch = max(pitch, float(np.cbrt(size.prod() / MAX_POINTS_IN_PATCH)))
    count = np.maximum(np.round(size / pitch), 1).astype(int)
    cell = np.indices(tuple(count.tolist())).reshape(3, -1).T
    a, b, c = cell.T
    u = random_keys.uniforms(seed, random_keys.VOLUME, a, b, c, zlib.crc32(patch.label.encode()))
    shift = u[:, :3]
    if quadrature:
        shift = np.mod(0.5 + np.arange(1, len(cell) + 1)[:, None] * QUASIRANDOM_STEPS, 1)
    unit = (cell + shift) / count - 0.5
    inside = np.sum((2 * unit) ** 2, axis=1) < 1 if patch.form == "ellipsoid" else np.ones(len(unit), bool)
    offset = unit * size
    frame = ScattererGrid(origin=patch.position[:2], heading=patch.heading)
    depth = patch.position[2] + offset[:, 2]
    position = np.column_stack([frame.to_world(offset[:, 0], offset[:, 1]), depth])
    inside &= (depth > 0) & (depth < seabed_depth_at(seabed, position[:, :2]))
    area = np.full(len(position), size.prod() / count.prod() * float(intensity_ratio(patch.volume_strength_db)))
    number = np.uint64((zlib.crc32(patch.label.encode()) & 0xFFFFFFF) << 24) + np.arange(len(cell), dtype=np.uint64)
    phase = np.exp(2j * np.pi * u[:, 3])
    return _points(patch.label, position[inside], area[inside], phase[inside], (PATCHES | number)[inside])


def _points(
    label: str, position: Floats, area: Floats, phase: NDArray[np.complex128], key: NDArray[np.uint64]
) -> Scatterers:
    """Isotropic scatterers in the water, each of a backscattering cross section `area` [m^2]."""
    return Scatterers(label, "water", PointTargetLaw(0.0), position, np.zeros((len(position), 3)), area, phase, key)


def max_water_depth(seabed: Seabed) -> float:
    """Greatest depth of the seabed [m]."""
    return seabed.depth if seabed.terrain is None else seabed.terrain.span[1]


def patch_errors(
    patches: tuple[ScatteringPatch, ...], seabed: Seabed, targets: tuple[Target, ...]
) -> Iterator[PydanticCustomError]:
    """Errors in the positions and labels of scattering patches: each must be in the water and have a unique label.

    Args:
        patches: The patches; paths of the faults begin with `water.patches`.
        seabed: The seabed below them.
        targets: Targets, whose labels are not available to patches.

    Yields:
        Errors of `field_error`.
    """
    labels = {"seabed", "surface", "target", "noise", "total", WATER, *(target.label for target in targets)}
    for row, patch in enumerate(patches):
        if patch.label in labels:
            yield field_error(
                f"water.patches.{row}.label", repr(patch.label), "is taken. Give each patch a label of its own."
            )
        labels.add(patch.label)
        bottom = float(seabed_depth_at(seabed, np.array(patch.position[:2])))
        if not patch.position[2] < bottom:
            yield field_error(
                f"water.patches.{row}.position.2", f"{patch.position[2]:g} m", f"is below the seabed ({bottom:g} m). "
                f"Write the depth of its middle, above 0 m and less than {bottom:g} m.",
            )  # fmt: skip
