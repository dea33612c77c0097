"""Shadows of solids under bent rays: only rays that pass over a body are walked, and only while they do.

Seen from above a ray of any family is a straight line, so the first question is which bodies it crosses there. Over a
body an arc is a chord, but for fractions of a millimetre.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._curved_box import depths_along
from insonify.propagation._curved_kernel import RANGE, crossed_bodies
from insonify.propagation._solid_kernel import OFF
from insonify.propagation.families import bounces
from insonify.propagation.layers import Column
from insonify.propagation.solids import who_cuts
from insonify.records.legs import Status
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles

Floats = NDArray[np.float64]

CHORD = 1.5
"""Longest chord that stands for an arc [m]: it is off by less than half a millimetre."""
STEEP = 10.0
"""Tangent of the launch angle above which a ray is as good as straight [1]."""


def solid_bounds(scene: Scene) -> Floats:
    """Least and greatest coordinates of the scene's solids [m], shape (solids, 6)."""
    surfaces = [world_triangles(solid, scene.seabed) for solid in scene.solids]
    return np.array([np.concatenate([one.low, one.high]) for one in surfaces]).reshape(-1, 6)


def shade_bent_row(
    scene: Scene, water: Column, bounds: Floats, place: Floats, scatterers: Scatterers, shared: Floats, family: str,
    slowness: Floats, departure: Floats, status: NDArray[np.uint8], occluder: NDArray[np.int16],
) -> None:  # fmt: skip
    """Mark the clear legs of one row that solids cut.

    Args:
        scene: The scene.
        water: Its layers.
        bounds: Of `solid_bounds`.
        place: North, east, depth of the sonar [m], shape (3,).
        scatterers: The points that the legs end at, n of them.
        shared: See `insonify.propagation._curved_kernel.bearings`, shape (5, n).
        family: Family of the row.
        slowness: Horizontal slowness of the rays [s/m], shape (n,).
        departure: Their directions at the sonar, shape (n, 3).
        status: Statuses of the legs; those that are clear may become occluded, shape (n,).
        occluder: Row of who cuts the leg, set where that happens, shape (n,).
    """
    ends = scatterers.position + OFF * scatterers.normal
    points, bodies, enter, leave = crossed_bodies(place, ends, bounds, status)
    for body in np.unique(bodies):
        mine = bodies == body
        rows, begin, end = points[mine], enter[mine], leave[mine]
        longest = float(((end - begin) * shared[RANGE, rows]).max())
        count = max(3, int(np.ceil(longest / CHORD)) + 1) * (3 if "B" in family else 1)
        along = begin[:, None] + (end - begin)[:, None] * np.linspace(0, 1, count)
        depths = _depths(water, place, ends[rows], shared[RANGE, rows], family, slowness[rows], departure[rows], along)
        low, high = np.fmin.reduce(depths, axis=1), np.fmax.reduce(depths, axis=1)
        near = (high >= bounds[body, 2]) & (low <= bounds[body, 5])
        rows, along, depths = rows[near], along[near], depths[near]
        ways = np.empty((len(rows), count, 3))
        ways[..., :2] = place[:2] + along[..., None] * (ends[rows, None, :2] - place[:2])
        ways[..., 2] = depths
        found = who_cuts(scene, ways)
        cut = found >= 0
        first = np.where(status[rows] == Status.OCCLUDED, np.minimum(occluder[rows], found), found)
        status[rows[cut]], occluder[rows[cut]] = Status.OCCLUDED, first[cut]


def _depths(
    water: Column, place: Floats, ends: Floats, ranges: Floats, family: str, slowness: Floats, departure: Floats,
    along: Floats,
) -> Floats:  # fmt: skip
    """Depths of rays at parts of their horizontal way [m], shape of `along`; 1 is exactly their end."""
    string = bounces(family)
    found = np.empty(along.shape)
    depths_along(
        water.depth, water.speed, water.plane, float(place[2]), slowness, np.ascontiguousarray(departure[:, 2]),
        len(string), string.startswith("S"), along[:, 0] * ranges, along[:, -1] * ranges, found,
    )  # fmt: skip
    level = np.hypot(departure[:, 0], departure[:, 1])
    steep = (np.abs(departure[:, 2]) > STEEP * level) | (ranges < 1e-3)
    if steep.any():
        found[steep] = _straight(water.mirror_depth, float(place[2]), ends[steep, 2], string, along[steep])
    found = np.where(np.isnan(found), ends[:, 2:], found)
    return np.where(along == 1, ends[:, 2:], found)


def _straight(plane: float, source: float, ends: Floats, string: str, along: Floats) -> Floats:
    """Depths of rays that do not bend, folded at the mirrors [m]."""
    if not string:
        return source + along * (ends[:, None] - source)
    start, turns = (-source if string.startswith("S") else source), len(string)
    arrives_down = string.endswith("S")
    # how far down it has come when it ends, with every bounce unfolded
    crossings = turns - (1 if string.startswith("S") else 0)
    target = crossings * plane + (ends if arrives_down else plane - ends)
    run = start + along * (target - start)[:, None]
    return np.asarray(plane - np.abs(np.mod(run, 2 * plane) - plane))
