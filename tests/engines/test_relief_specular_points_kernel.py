"""Gradients of the path length at the nodes of the ground: those of single paths by the same points."""

import numpy as np
import pytest
from scipy.ndimage import spline_filter

from insonify.engines._relief_specular_points_kernel import (
    HESSIAN,
    PathEnds,
    TerrainSpline,
    _path_gradient,
    gradients_at_nodes,
    keep_distinct,
    mark_sign_changes,
    paths_with_curvature,
)
from insonify.propagation.surface_water import surface_water
from insonify.scene.scene import Scene

LAYERED = {"profile": {"depth": [0, 15, 40], "speed": [1520, 1500, 1490]}}


@pytest.mark.parametrize("water", [{}, LAYERED])
@pytest.mark.parametrize("stop", [(0.0, 0.0, 10.0), (3.0, -2.0, 12.0)])
@pytest.mark.parametrize(("step", "shape", "tolerance"), [(0.25, (18, 26), 1e-9), (0.1, (106, 126), 3e-9)])
def test_gradients_at_nodes_are_those_of_the_paths(water, stop, step, shape, tolerance):
    """At nodes of waves 40 cm high, in water of one speed and in layers, from one place and from two, to 1e-9.

    At 240 nodes, where each ray is solved in layers, and at 12 000, where rays are tabulated: to 3e-9, since two rays
    that are solved alone differ by so much from their neighbours.
    """
    margin = 3
    north, east = -2.0 + step * np.arange(shape[0]), -3.0 + step * np.arange(shape[1])
    depth = 30 + 0.2 * np.sin(1.7 * north[:, None] + 0.4) * np.cos(1.3 * east[None, :])
    terrain = TerrainSpline(spline_filter(depth, mode="mirror"), north[0], east[0], step)
    scene = Scene(seabed={"depth": 31.0}, water=water)  # layers reach below the waves
    layers = surface_water(scene, float(scene.water.sound_speed_at(10.0)), False, False)
    assert (layers.depth.size > 0) == bool(water)
    ends = PathEnds(np.array([0.0, 0.0, 10.0]), np.array(stop), layers)
    size = shape[0] - 2 * margin, shape[1] - 2 * margin
    gradient = np.empty((2, *size))
    gradients_at_nodes(depth, margin, terrain, ends, gradient)
    inner = slice(margin, -margin)
    places = np.stack(np.meshgrid(north[inner], east[inner], indexing="ij"), axis=-1).reshape(-1, 2)
    paths = paths_with_curvature(places, terrain, ends, step)[1]
    assert np.abs(paths[:, 1:3]).max() > 0.1
    np.testing.assert_allclose(gradient.reshape(2, -1).T, paths[:, 1:3], rtol=0, atol=tolerance)


@pytest.mark.parametrize("reach", [1, 2, 9])
def test_signs_change_where_both_ranges_pass_zero(reach):
    """Random gradients, some unknown: the ranges of each component over the nodes around, by plain loops."""
    rng = np.random.default_rng(reach)
    gradient = rng.normal(1.5, 1, (2, 14, 11)) * np.linspace(0, 3, 11)
    gradient[:, rng.random((14, 11)) < 0.1] = np.nan
    gradient[:, :4, :4] = np.nan
    found, expected = np.empty((14, 11), bool), np.empty((14, 11), bool)
    mark_sign_changes(gradient, reach, found)
    for i, j in np.ndindex(expected.shape):
        around = gradient[:, max(i - reach, 0) : i + reach + 1, max(j - reach, 0) : j + reach + 1].reshape(2, -1)
        known = np.isfinite(around)
        low = np.where(known, around, np.inf).min(axis=1)
        high = np.where(known, around, -np.inf).max(axis=1)
        expected[i, j] = bool(np.all((1.25 * low <= 0.25 * high) & (0.25 * low <= 1.25 * high)))
    np.testing.assert_array_equal(found, expected)
    assert reach == 9 or 0.05 < found.mean() < 0.95


def test_points_that_repeat_an_earlier_one_or_have_not_converged_are_left_out():
    """The first of each, in their order; none of none."""
    positions = np.array([[0.0, 0.0], [1.0, 1.0], [0.01, 0.0], [5.0, 5.0], [1.0, 1.2], [1.0, 1.04]])
    count = keep_distinct(positions, np.array([True, True, True, False, True, True]), 0.05)
    np.testing.assert_array_equal(positions[:count], [[0.0, 0.0], [1.0, 1.0], [1.0, 1.2]])
    assert keep_distinct(np.empty((0, 2)), np.empty(0, bool), 0.05) == 0


def test_curvatures_are_the_eigenvalues_and_change_along_their_eigenvectors():
    """At 200 points of waves in both directions: eigenvalues of LAPACK, second derivatives of paths to either side."""
    step, reach = 0.25, 0.1
    north = np.arange(-5.0, 5.0, step)
    depth = 30 + 0.3 * np.sin(1.7 * north[:, None] + 0.4) * np.cos(1.3 * north[None, :]) + 0.1 * np.sin(north[None, :])
    terrain = TerrainSpline(spline_filter(depth, mode="mirror"), north[0], north[0], step)
    layers = surface_water(Scene(seabed={"depth": 30.0}), 1500.0, False, False)
    ends = PathEnds(np.array([0.0, 0.0, 10.0]), np.array([3.0, -2.0, 12.0]), layers)
    places = np.random.default_rng(2).uniform(-3, 3, (200, 2))

    def matrices(positions):
        rows = paths_with_curvature(positions, terrain, ends, reach)[1]
        return rows[:, [HESSIAN, HESSIAN + 1, HESSIAN + 1, HESSIAN + 2]].reshape(-1, 2, 2)

    points, _, curvature, change = paths_with_curvature(places, terrain, ends, reach)
    np.testing.assert_array_equal(points[:, :2], places)
    value, vector = np.linalg.eigh(matrices(places))
    np.testing.assert_allclose(curvature, value, rtol=1e-12, atol=1e-14)
    assert (value[:, 0] < 0).any() and (value[:, 1] > 0).any()
    for axis in range(2):
        along = vector[:, :, axis]
        behind, ahead = (
            np.einsum("na,nab,nb->n", along, matrices(places + side * reach * along), along) for side in (-1, 1)
        )
        np.testing.assert_allclose(np.abs(change[:, axis]), np.abs(ahead - behind), rtol=1e-9, atol=1e-12)


def test_the_horizontal_derivative_of_a_refracted_path_changes_by_the_given_rates():
    """Central differences over 2 mm: of the component across the vertical plane of the path, and of that in it."""
    scene = Scene(seabed={"depth": 30.0}, water=LAYERED)
    layers, end, step = surface_water(scene, 1500.0, False, False), np.array([0.0, 0.0, 5.0]), 1e-3

    def horizontal_gradient(north, east):
        return np.array(_path_gradient(north, east, 28.0, end, layers)[:2])

    across, in_plane = _path_gradient(25.0, 0.0, 28.0, end, layers)[3:5]
    ahead = horizontal_gradient(25.0 + step, 0.0) - horizontal_gradient(25.0 - step, 0.0)
    aside = horizontal_gradient(25.0, step) - horizontal_gradient(25.0, -step)
    assert in_plane == pytest.approx(ahead[0] / (2 * step), rel=1e-4)
    assert across == pytest.approx(aside[1] / (2 * step), rel=1e-4)
    assert across > 1.2 * in_plane
