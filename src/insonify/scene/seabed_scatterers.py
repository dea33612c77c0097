"""Scatterers on relief: each lies on the terrain at its position, with the terrain's normal there.

A point represents the cell of the mean plane in which it lies, and its facet the terrain over that cell. The slope is
that of the terrain at the point, whatever the size of the cell. The mean over many points is right for any density;
terrain finer than the cells is sampled at few points, which increases the variance.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.terrain.relief import TerrainSample
from insonify.scene.terrain_draping_kernel import drape_points

Floats = NDArray[np.float64]


def seabed_scatterers(
    depth: float, sample: TerrainSample, law: Law, horizontal_position: Floats, area: Floats,
    phase: NDArray[np.complex128], scatterer_id: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Scatterers at positions of the seabed; none where the terrain is unknown or above the water.

    Args:
        depth: Depth of the mean plane [m].
        sample: The terrain at the scatterers: height [m] (n,), gradient to the north and the east [1] (n, 2).
        law: Scattering law.
        horizontal_position: North and east [m], shape (n, 2).
        area: Area of the mean plane that each represents [m^2], shape (n,).
        phase: Unit phasors [1], shape (n,).
        scatterer_id: Keys of the scatterers, shape (n,).
    """
    is_known = sample.height < depth  # neither a hole nor land
    if not is_known.all():
        sample = TerrainSample(sample.height[is_known], sample.slope[is_known])
        horizontal_position, area, phase, scatterer_id = (
            horizontal_position[is_known],
            area[is_known],
            phase[is_known],
            scatterer_id[is_known],
        )
    position, normal, facet_area = (
        np.empty((len(horizontal_position), 3)),
        np.empty((len(horizontal_position), 3)),
        np.empty(len(horizontal_position)),
    )
    drape_points(depth, sample.height, sample.slope, horizontal_position, area, position, normal, facet_area)
    return Scatterers("seabed", "seabed", law, position, normal, facet_area, phase, scatterer_id)
