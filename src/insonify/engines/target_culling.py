"""Culling of target points: those outside the window or the beams, or on faces turned away, are dropped.

A long target has far more points than one ping reaches. Consecutive points lie together, so runs of them are evaluated
as spheres; of the remaining runs, points on faces turned away from all images of an end are dropped too.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from insonify.engines.patch_subdivision import TargetInsonification
from insonify.scene.scatterers import Scatterers
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

MAX_UNCULLED = 20_000
"""Number of points of a target up to which all are kept [1]."""
GRAZING = 1e-6
"""Distance of an end behind the plane of a point's face up to which the point counts as facing it: rounding [m]."""
POINTS_PER_SPHERE = 128
"""Number of points in a run, which is tested as one sphere [1]."""


def cull_points(points: Scatterers, insonification: TargetInsonification) -> Scatterers:
    """The points of a target that one ping can receive; all of them where they are few.

    Args:
        points: Points on the faces of one target, neighbours one after another.
        insonification: Images of the sonar, window and beams with respect to the target.
    """
    if len(points) <= MAX_UNCULLED:
        return points
    return points.take(rows_in_reach(points.position, points.normal, insonification, POINTS_PER_SPHERE))


def rows_in_reach(
    position: Floats, normal: Floats, insonification: TargetInsonification, run: int
) -> NDArray[np.int64]:
    """Rows of the points of a target that one ping can receive, shape (m,).

    Args:
        position: Positions of the points, neighbours one after another [m], shape (n, 3).
        normal: Unit normals of their faces, shape (n, 3).
        insonification: Images of the sonar, window and beams with respect to the target.
        run: Number of points that are tested as one sphere [1].
    """
    starts = np.arange(0, len(position), run)
    count = np.diff(np.append(starts, len(position)))
    middle = np.add.reduceat(position, starts, axis=0) / count[:, None]
    away = np.linalg.norm(position - np.repeat(middle, count, axis=0), axis=1)
    radius = np.maximum.reduceat(away, starts)
    rows = np.flatnonzero(np.repeat(insonification.reaches(middle, radius), count))
    return rows[
        facing(position[rows], normal[rows], insonification.point_images, max_deviation=insonification.max_deviation)
    ]


def facing_both_ends(points: Scatterers, ping_geometry: PingGeometry) -> Scatterers:
    """The points of a target that face both ends of the sonar, where direct paths alone are followed.

    Args:
        points: Points on the faces of one target.
        ping_geometry: The sonar at this ping.
    """
    ends = ping_geometry.transmit_position[None], ping_geometry.receive_position[None]
    images = ends[:1] if ping_geometry.is_monostatic else ends
    return points.take(np.flatnonzero(facing(points.position, points.normal, images, margin=GRAZING)))


def facing(
    position: Floats, normal: Floats, images: Sequence[Floats], *, max_deviation: float = 0.0, margin: float = 0.0
) -> NDArray[np.bool_]:
    """True for points on faces that face some image of each end, shape (n,).

    Args:
        position: Positions of points on the faces of one target [m], shape (n, 3).
        normal: Unit normals of the faces there, shape (n, 3).
        images: Positions of the images of each end [m], shapes (f, 3).
        max_deviation: Sine of the largest angle between rays and the straight lines from the images [1].
        margin: Distance of an image behind the plane of a face up to which the face counts as facing it [m].
    """
    faces_all = np.ones(len(position), bool)
    for images_of_end in images:
        faces_any = np.zeros(len(position), bool)
        for image in images_of_end:
            ray = image - position
            depth_below = margin + (max_deviation * np.linalg.norm(ray, axis=1) if max_deviation > 0 else 0.0)
            faces_any |= np.einsum("nk,nk->n", ray, normal) > -depth_below
        faces_all &= faces_any
    return faces_all
