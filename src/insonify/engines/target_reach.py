"""Drawn points of targets that one ping can receive: those in its window, its beams, and on faces towards it.

A long target has far more points than one ping reaches. Points that follow one another lie together, so runs of them
are judged as spheres; of the runs that remain, points on faces turned away from all images of an end are dropped too.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.patches import Sight
from insonify.scene.scatterers import Scatterers

Floats = NDArray[np.float64]

FEW = 20_000
"""Points of a target up to which all are kept [1]."""
RUN = 128
"""Points in a run [1]."""


def in_reach(points: Scatterers, sight: Sight, run: int = RUN) -> Scatterers:
    """The points of a target that one ping can receive; all of them where they are few.

    Args:
        points: Points on the faces of one target, neighbours one after another.
        sight: The sonar as the target sees it.
        run: Points that are judged together [1].
    """
    if len(points) <= FEW:
        return points
    starts = np.arange(0, len(points), run)
    count = np.diff(np.append(starts, len(points)))
    middle = np.add.reduceat(points.position, starts, axis=0) / count[:, None]
    away = np.linalg.norm(points.position - np.repeat(middle, count, axis=0), axis=1)
    radius = np.maximum.reduceat(away, starts)
    kept = np.flatnonzero(np.repeat(sight.reaches(middle, radius), count))
    return points.take(kept[_facing(points, kept, sight)])


def _facing(points: Scatterers, rows: NDArray[np.int64], sight: Sight) -> NDArray[np.bool_]:
    """True for points whose face looks at some image of both ends, shape of the rows."""
    place, normal = points.position[rows], points.normal[rows]
    both = np.ones(len(rows), bool)
    for places in sight.images:
        seen = np.zeros(len(rows), bool)
        for image in places:
            ray = image - place
            seen |= np.einsum("nk,nk->n", ray, normal) > -sight.aside * np.linalg.norm(ray, axis=1)
        both &= seen
    return both
