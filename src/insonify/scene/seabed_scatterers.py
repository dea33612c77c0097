"""Scatterers on relief: each lies on the terrain at its position and faces where the terrain faces there.

A point represents the cell of the mean plane in which it was drawn, and its facet the terrain over that cell. Its
slope is the terrain's at the one point, whatever the size of the cell: the mean over many points is right for any
density, but terrain that is finer than the cells is sampled at few points, and ripples the level more.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.scene._terrain_draping_kernel import drape_points, drape_tiles
from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.terrain.relief import TerrainSample

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def seabed_scatterers(
    depth: float, terrain_sample: TerrainSample, law: Law, horizontal_position: Floats, area: Floats,
    phase: NDArray[np.complex128], scatterer_id: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """The scatterers of some positions of the seabed; none where the terrain is not known, or stands out of the water.

    Args:
        depth: Of the mean plane [m].
        terrain_sample: The terrain at the scatterers: height [m] (n,), gradient to the north and the east [1] (n, 2).
        law: Scattering law.
        horizontal_position: North and east [m], shape (n, 2).
        area: Area of the mean plane that each stands for [m^2], shape (n,).
        phase: Unit phasors [1], shape (n,).
        scatterer_id: Keys of the scatterers, shape (n,).
    """
    known = terrain_sample.height < depth  # neither a hole nor land
    if not known.all():
        terrain_sample = TerrainSample(terrain_sample.height[known], terrain_sample.slope[known])
        horizontal_position, area, phase, scatterer_id = (
            horizontal_position[known],
            area[known],
            phase[known],
            scatterer_id[known],
        )
    position, normal, wide = (
        np.empty((len(horizontal_position), 3)),
        np.empty((len(horizontal_position), 3)),
        np.empty(len(horizontal_position)),
    )
    drape_points(depth, terrain_sample.height, terrain_sample.slope, horizontal_position, area, position, normal, wide)
    return Scatterers("seabed", "seabed", law, position, normal, wide, phase, scatterer_id)


def tile_scatterers(
    depth: float, terrain_rows: tuple[Floats, Integers], law: Law, tile: NDArray[np.int32], rank: NDArray[np.int32],
    position: Floats, area: Floats, phase: NDArray[np.complex128], scatterer_id: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Scatterers at points of tiles whose terrain is cached. Their columns are reused for the result.

    Args:
        depth: Of the mean plane [m].
        terrain_rows: Height and gradient at the points of tiles, and first row of each tile; see
            `SeabedTerrain.sample_tiles`.
        law: Scattering law.
        tile: Row of the tile of each point, shape (n,).
        rank: Which of its tile's points it is, likewise.
        position: North, east and any depth [m], shape (n, 3).
        area: Area of the mean plane that each stands for [m^2], shape (n,).
        phase: Unit phasors [1], shape (n,).
        scatterer_id: Keys of the scatterers, shape (n,).
    """
    normal = np.empty(position.shape)
    n = drape_tiles(depth, *terrain_rows, tile, rank, position, normal, area, phase, scatterer_id)
    return Scatterers("seabed", "seabed", law, position[:n], normal[:n], area[:n], phase[:n], scatterer_id[:n])
