"""The scene as it is, for what was measured of it: how deep it lies under each place, bed or target."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scenario.scenario import Scenario
from insonify.scene.solid import complete_triangles
from insonify.scene.target import PointTarget
from insonify.scene.triangle_surfaces import Triangles

Floats = NDArray[np.float64]

AROUND = np.radians(np.arange(0, 360, 30))
"""Directions in which a target may be near [rad]."""


def bed_depth(scenario: Scenario, north: ArrayLike, east: ArrayLike) -> Floats:
    """Depth of the bed [m] at places [m], broadcast shape.

    Args:
        scenario: What was simulated.
        north: Of the places.
        east: Of the places.
    """
    x, y = np.broadcast_arrays(np.asarray(north, float), np.asarray(east, float))
    bed = scenario.scene.seabed.terrain
    return np.full(x.shape, scenario.seabed.depth) if bed is None else bed.depth_at(x, y)


def depth_from_above(scenario: Scenario, north: ArrayLike, east: ArrayLike) -> Floats:
    """Depth of the first object straight down, a target or the seabed [m].

    Args:
        scenario: What was simulated.
        north: Of the places [m].
        east: Of the places [m].
    """
    depth = bed_depth(scenario, north, east)
    x, y = np.broadcast_arrays(np.asarray(north, float), np.asarray(east, float))
    for target in scenario.targets:
        if not isinstance(target, PointTarget):
            top = _top(complete_triangles(target, scenario.scene.seabed), x, y)
            depth = np.fmin(depth, np.maximum(top, 0.0))
    return depth


def is_clear_of_targets(scenario: Scenario, north: ArrayLike, east: ArrayLike, margin: float) -> NDArray[np.bool_]:
    """Mask of positions with only seabed within some distance.

    Args:
        scenario: What was simulated.
        north: Of the places [m].
        east: Of the places [m].
        margin: The distance [m].
    """
    x, y = np.broadcast_arrays(np.asarray(north, float), np.asarray(east, float))
    alone = np.ones(x.shape, bool)
    for target in scenario.targets:
        if not isinstance(target, PointTarget):
            surface = complete_triangles(target, scenario.scene.seabed)
            for step in (np.zeros(2), *margin * np.stack([np.cos(AROUND), np.sin(AROUND)], axis=1)):
                alone &= np.isnan(_top(surface, x + step[0], y + step[1]))
    return alone


def _top(surface: Triangles, north: Floats, east: Floats) -> Floats:
    """Depth of the highest face over or under places [m]; NaN beside the body."""
    corners = np.asarray(surface.vertices, float)[np.asarray(surface.faces)]
    top = np.full(north.shape, np.nan)
    low, high = corners[..., :2].min(axis=(0, 1)), corners[..., :2].max(axis=(0, 1))
    near = (north >= low[0]) & (north <= high[0]) & (east >= low[1]) & (east <= high[1])
    position = np.stack([north[near], east[near]], axis=-1)
    found = np.full(len(position), np.nan)
    for a, b, c in corners:
        turn = np.array([b[:2] - a[:2], c[:2] - a[:2]])
        area = float(np.linalg.det(turn))
        if abs(area) < 1e-12:
            continue  # stands upright: its edge belongs to its neighbours
        share = (position - a[:2]) @ np.linalg.inv(turn)
        inside = (share >= 0).all(axis=1) & (share.sum(axis=1) <= 1)
        depth = a[2] + share @ np.array([b[2] - a[2], c[2] - a[2]])
        found = np.where(inside, np.fmin(found, depth), found)
    top[near] = found
    return top
