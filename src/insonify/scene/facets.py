"""Scatterers on relief: each lies on the ground at its place and faces where the ground faces there.

A point stands for the cell of the mean plane that it was drawn in, and its facet for the ground over that cell. Its
slope is the ground's at the one point, whatever the size of the cell: the mean over many points is right for any
density, but ground that is finer than the cells is met at fewer places than it has, and ripples the level more.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.scene._facet_kernel import lay, lay_held
from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.terrain.relief import Survey

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def facets(
    depth: float, survey: Survey, law: Law, place: Floats, area: Floats, phase: NDArray[np.complex128],
    key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """The scatterers of some places of the seabed; none where the ground is not known, or stands out of the water.

    Args:
        depth: Of the mean plane [m].
        survey: The ground at the places: height [m] (n,), gradient to the north and the east [1] (n, 2).
        law: How they answer.
        place: North and east [m], shape (n, 2).
        area: Area of the mean plane that each stands for [m^2], shape (n,).
        phase: Unit phasors [1], shape (n,).
        key: Keys of the places, shape (n,).
    """
    known = survey.height < depth  # neither a hole nor land
    if not known.all():
        survey = Survey(survey.height[known], survey.slope[known])
        place, area, phase, key = place[known], area[known], phase[known], key[known]
    position, normal, wide = np.empty((len(place), 3)), np.empty((len(place), 3)), np.empty(len(place))
    lay(depth, survey.height, survey.slope, place, area, position, normal, wide)
    return Scatterers("seabed", "seabed", law, position, normal, wide, phase, key)


def laid(
    depth: float, ground: tuple[Floats, Integers], law: Law, tile: NDArray[np.int32], rank: NDArray[np.int32],
    position: Floats, area: Floats, phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """The same for points of tiles whose ground is held. Their columns are used for the answer.

    Args:
        depth: Of the mean plane [m].
        ground: Height and gradient at the points of tiles, and where each tile begins; see `Bed.survey_points`.
        law: How they answer.
        tile: Row of the tile of each point, shape (n,).
        rank: Which of its tile's points it is, likewise.
        position: North, east and any depth [m], shape (n, 3).
        area: Area of the mean plane that each stands for [m^2], shape (n,).
        phase: Unit phasors [1], shape (n,).
        key: Keys of the places, shape (n,).
    """
    normal = np.empty(position.shape)
    n = lay_held(depth, *ground, tile, rank, position, normal, area, phase, key)
    return Scatterers("seabed", "seabed", law, position[:n], normal[:n], area[:n], phase[:n], key[:n])
