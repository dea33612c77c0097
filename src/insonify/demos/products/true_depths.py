"""True depths of a scene at positions, of the seabed or of a target."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scenario.scenario import Scenario
from insonify.scene.solid import complete_triangles, seabed_depth_at
from insonify.scene.target import PointTarget
from insonify.scene.triangle_surfaces import Triangles

Floats = NDArray[np.float64]

AROUND = np.radians(np.arange(0, 360, 30))
"""Directions in which the distance to targets is checked [rad]."""


def depth_from_above(scenario: Scenario, north: ArrayLike, east: ArrayLike) -> Floats:
    """Depth of the highest surface at positions, of a target or of the seabed [m].

    Args:
        scenario: Scenario of the recording.
        north: North of the positions [m].
        east: East of the positions [m].
    """
    x, y = np.broadcast_arrays(np.asarray(north, float), np.asarray(east, float))
    depth = seabed_depth_at(scenario.completed_seabed, np.stack([x, y], axis=-1))
    for target in scenario.targets:
        if not isinstance(target, PointTarget):
            top = _top(complete_triangles(target, scenario.scene.seabed), x, y)
            depth = np.fmin(depth, np.maximum(top, 0.0))
    return depth


def is_clear_of_targets(scenario: Scenario, north: ArrayLike, east: ArrayLike, margin: float) -> NDArray[np.bool_]:
    """True for positions with no target within a distance.

    Args:
        scenario: Scenario of the recording.
        north: North of the positions [m].
        east: East of the positions [m].
        margin: Distance to targets [m].
    """
    x, y = np.broadcast_arrays(np.asarray(north, float), np.asarray(east, float))
    is_clear = np.ones(x.shape, bool)
    for target in scenario.targets:
        if not isinstance(target, PointTarget):
            surface = complete_triangles(target, scenario.scene.seabed)
            for step in (np.zeros(2), *margin * np.stack([np.cos(AROUND), np.sin(AROUND)], axis=1)):
                is_clear &= np.isnan(_top(surface, x + step[0], y + step[1]))
    return is_clear


def _top(surface: Triangles, north: Floats, east: Floats) -> Floats:
    """Depth of the highest face at positions [m]; NaN beside the body."""
    corners = np.asarray(surface.vertices, float)[np.asarray(surface.faces)]
    top = np.full(north.shape, np.nan)
    low, high = corners[..., :2].min(axis=(0, 1)), corners[..., :2].max(axis=(0, 1))
    near = (north >= low[0]) & (north <= high[0]) & (east >= low[1]) & (east <= high[1])
    position = np.stack([north[near], east[near]], axis=-1)
    highest = np.full(len(position), np.nan)
    for a, b, c in corners:
        sides = np.array([b[:2] - a[:2], c[:2] - a[:2]])
        area = float(np.linalg.det(sides))
        if abs(area) < 1e-12:
            continue  # vertical: its edge belongs to its neighbours
        share = (position - a[:2]) @ np.linalg.inv(sides)
        inside = (share >= 0).all(axis=1) & (share.sum(axis=1) <= 1)
        depth = a[2] + share @ np.array([b[2] - a[2], c[2] - a[2]])
        highest = np.where(inside, np.fmin(highest, depth), highest)
    top[near] = highest
    return top
