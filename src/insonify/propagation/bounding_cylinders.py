"""Bounding cylinders: an upright cylinder about each target, for a fast test of which points its shadow may reach."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._bounding_cylinder_kernel import points_behind_cylinder
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles

Floats = NDArray[np.float64]

MARGIN = 1e-3
"""Margin on the distance between path and target, for rounding of the ends of legs [m]."""


@lru_cache(maxsize=8)
def bounding_cylinders(scene: Scene) -> Floats:
    """Cylinders about the targets that cast shadows, in the order of `Scene.occluders`.

    Returns:
        North and east of each axis, radius, depth of top and of base [m], shape (t, 5).
    """
    cylinders = [(box[0], box[1], np.hypot(box[4], box[5]), box[6], box[7]) for box in scene.bodies]
    for solid in scene.solids:
        surface = world_triangles(solid, scene.seabed)
        low, high = np.asarray(surface.low), np.asarray(surface.high)
        middle, radius = (low + high)[:2] / 2, np.linalg.norm(high[:2] - low[:2]) / 2
        cylinders.append((middle[0], middle[1], radius, low[2], high[2]))
    rows = np.array(cylinders, float).reshape(-1, 5)
    rows.flags.writeable = False  # shared by all pings
    return rows


def points_near_cylinders(
    scene: Scene, position: Floats, points: Floats, clearance: float = 0.0, directions: Floats | None = None, *,
    direct: bool = False, targets: slice = slice(None),
) -> list[NDArray[np.int64]]:  # fmt: skip
    """Points whose straight path passes a target within a clearance, in plan view or in space.

    Args:
        scene: The scene with its targets.
        position: North, east, depth of the start of the paths [m], shape (3,).
        points: Ends of the paths [m], shape (n, 3).
        clearance: Largest distance between path and target [m].
        directions: Directions of arrival at each point, shape (f, n, 3); None: straight from `position`.
        direct: True: paths are straight in depth too, given without directions, and those that pass above a target are
            left out. False: depths do not count.
        targets: Targets to test, as a slice of `Scene.occluders`.

    Returns:
        Increasing rows of such points, for each of those targets in their order.
    """
    selected, margin = bounding_cylinders(scene)[targets], clearance + MARGIN
    row = np.empty(len(points), np.int64)
    arrival_directions = np.empty((0, len(points), 3)) if directions is None else directions
    return [  # copies: most targets are near few points
        row[: points_behind_cylinder(position, points, arrival_directions, cylinder, margin, direct, row)].copy()
        for cylinder in selected
    ]


def edge_clearance(longest: float, wavelength: float, fresnel_number: float) -> float:
    """Distance from the straight path at which an edge has at least a given Fresnel number, at any position [m].

    The path around an edge is longer than the straight one by number^2 wavelength / 4, see
    `knife_edge_kernel.edge_fresnel_number`. At this distance d one of its two parts alone is longer by that:
    sqrt(d^2 + r^2) - r decreases with the length r of the part, which is at most that of the whole leg.

    Args:
        longest: Length of the longest leg [m].
        wavelength: Wavelength of the sound [m].
        fresnel_number: Fresnel number [1].
    """
    excess_length = 1.0001 * fresnel_number**2 * wavelength / 4
    return float(np.sqrt(2 * max(longest, wavelength) * excess_length + excess_length**2))


def union(row_sets: list[NDArray[np.int64]], count: int) -> NDArray[np.int64]:
    """Sorted union of sets of row numbers, all less than `count`."""
    if len(row_sets) == 1:
        return row_sets[0]
    is_member = np.zeros(count, bool)
    for rows in row_sets:
        is_member[rows] = True
    return np.flatnonzero(is_member)
