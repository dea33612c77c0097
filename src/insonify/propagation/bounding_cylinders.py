"""Rims of targets: an upright cylinder about each, that tells at a glance which points lie nowhere near its shadow."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._bounding_cylinder_kernel import points_behind_cylinder
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles

Floats = NDArray[np.float64]

TOUCH = 1e-3
"""Width that every rim is given more: where a leg ends a hair before its point it is not quite where that is [m]."""


@lru_cache(maxsize=8)
def bounding_cylinders(scene: Scene) -> Floats:
    """Cylinders about the targets that cast shadows, in the order of `Scene.occluders`.

    Args:
        scene: The scene.

    Returns:
        North and east of each middle, its radius, depth of its top and of its base [m], shape (t, 5).
    """
    found = [(box[0], box[1], np.hypot(box[4], box[5]), box[6], box[7]) for box in scene.bodies]
    for solid in scene.solids:
        surface = world_triangles(solid, scene.seabed)
        low, high = np.asarray(surface.low), np.asarray(surface.high)
        middle, radius = (low + high)[:2] / 2, np.linalg.norm(high[:2] - low[:2]) / 2
        found.append((middle[0], middle[1], radius, low[2], high[2]))
    held = np.array(found, float).reshape(-1, 5)
    held.flags.writeable = False  # shared by all pings
    return held


def points_near_cylinders(
    scene: Scene, position: Floats, points: Floats, clearance: float = 0.0, directions: Floats | None = None
) -> list[NDArray[np.int64]]:
    """Which points straight ways lead to that pass a target, seen from above.

    Args:
        scene: Whose targets.
        position: North, east, depth of where the ways begin [m], shape (3,).
        points: Where they end [m], shape (n, 3).
        clearance: How far beside a target a way may pass [m].
        directions: Directions in which they reach each point, shape (f, n, 3); None: straight on.

    Returns:
        Rows of such points, increasing, of each target in the order of `Scene.occluders`.
    """
    held = bounding_cylinders(scene)
    rows = np.empty((len(held), len(points)), np.int64)
    told = np.empty((0, len(points), 3)) if directions is None else directions
    return [
        row[: points_behind_cylinder(position, points, told, rim, clearance + TOUCH, row)]
        for rim, row in zip(held, rows, strict=True)
    ]


def edge_clearance(longest: float, wavelength: float, number: float) -> float:
    """How far off the straight way an edge has at least the Fresnel number that it has, whatever its place [m].

    The way around an edge is longer than the straight one by number^2 wavelength / 4, see
    `_knife_edge_kernel.edge_fresnel_number`. So far off, one of the two parts of the way is longer by that alone:
    sqrt(off^2 + part^2) - part does not grow with the part, which is at most the whole leg.

    Args:
        longest: Length of the longest leg [m].
        wavelength: Of the sound [m].
        number: The Fresnel number.
    """
    longer = 1.0001 * number**2 * wavelength / 4
    return float(np.sqrt(2 * max(longest, wavelength) * longer + longer**2))
