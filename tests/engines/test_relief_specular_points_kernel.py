"""Gradients of the path length at the nodes of the ground: those of single paths by the same points."""

import numpy as np
import pytest
from scipy.ndimage import spline_filter

from insonify.engines._relief_specular_points_kernel import (
    COLUMNS,
    PathEnds,
    TerrainSpline,
    bottom_paths,
    gradients_at_nodes,
)
from insonify.propagation.surface_water import surface_water
from insonify.scene.scene import Scene

LAYERED = {"profile": {"depth": [0, 15, 40], "speed": [1520, 1500, 1490]}}


@pytest.mark.parametrize("water", [{}, LAYERED])
@pytest.mark.parametrize("stop", [(0.0, 0.0, 10.0), (3.0, -2.0, 12.0)])
def test_gradients_at_nodes_are_those_of_the_paths(water, stop):
    """At 240 nodes of waves 40 cm high, in water of one speed and in layers, from one place and from two."""
    step, margin, shape = 0.25, 3, (18, 26)
    north, east = -2.0 + step * np.arange(shape[0]), -3.0 + step * np.arange(shape[1])
    depth = 30 + 0.2 * np.sin(1.7 * north[:, None] + 0.4) * np.cos(1.3 * east[None, :])
    terrain = TerrainSpline(spline_filter(depth, mode="mirror"), north[0], east[0], step)
    scene = Scene(seabed={"depth": 30.0}, water=water)
    layers = surface_water(scene, float(scene.water.sound_speed_at(10.0)), False, False)
    assert (layers.depth.size > 0) == bool(water)
    ends = PathEnds(np.array([0.0, 0.0, 10.0]), np.array(stop), layers)
    size = shape[0] - 2 * margin, shape[1] - 2 * margin
    gradient = np.empty((2, *size))
    gradients_at_nodes(depth, margin, terrain, ends, gradient)
    inner = slice(margin, -margin)
    places = np.stack(np.meshgrid(north[inner], east[inner], indexing="ij"), axis=-1).reshape(-1, 2)
    paths = np.empty((len(places), COLUMNS))
    bottom_paths(places, terrain, ends, paths)
    assert np.abs(paths[:, 1:3]).max() > 0.1
    np.testing.assert_allclose(gradient.reshape(2, -1).T, paths[:, 1:3], rtol=0, atol=1e-9)
