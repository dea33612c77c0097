"""The side view of targets: the outline of their section by the drawn plane."""

import numpy as np
import pytest

from insonify.plotting.scene_view import _cut_along
from insonify.scene.triangle_surfaces import block, sphere, tube


def test_a_quay_wall_across_the_beam_is_as_thick_as_it_is():
    """200 m long, 2 m thick, 50 m ahead, its middle 60 m aside: 49 to 51 m, top to base; beside it: none."""
    wall = block(200.0, 2.0, 10.0).transformed(np.eye(3), np.array([60.0, 50.0, 5.0]))
    outline = _cut_along(wall, np.zeros(2), np.pi / 2)
    np.testing.assert_allclose((outline.min(axis=(0, 1)), outline.max(axis=(0, 1))), [(49, 0), (51, 10)], atol=1e-9)
    assert not len(_cut_along(wall, np.array([-200.0, 0.0]), np.pi / 2))
    slanted = _cut_along(wall, np.zeros(2), np.pi / 4)
    assert slanted[..., 0].min() == pytest.approx(49 * np.sqrt(2))


def area_inside(outline):
    """Area inside an outline, holes left out [m^2]."""
    (x, z), (next_x, next_z) = outline[:, 0].T, outline[:, 1].T
    return np.sum((next_x - x) * (next_z + z)) / 2


def test_a_sphere_is_a_circle_and_a_tube_a_ring():
    """Corners at the radius from the centre, areas of polygons of CIRCLE_STEPS corners, half of it from the middle."""
    centre = np.array([0.0, 50.0, 5.0])
    outline = _cut_along(sphere(3.0).transformed(np.eye(3), centre), np.zeros(2), np.pi / 2)
    radius = np.hypot(*(outline - centre[1:]).reshape(-1, 2).T)
    np.testing.assert_allclose(radius, 1.5, rtol=0.01)
    assert abs(area_inside(outline)) == pytest.approx(np.pi * 1.5**2, rel=0.02)
    half = _cut_along(sphere(3.0).transformed(np.eye(3), centre), centre[:2], np.pi / 2)
    assert half[..., 0].min() == 0 and area_inside(half) == pytest.approx(area_inside(outline) / 2)
    ring = _cut_along(tube(4.0, 2.0, 0.2).transformed(np.eye(3), centre), np.zeros(2), np.pi / 2)
    assert area_inside(ring) == pytest.approx(area_inside(outline) * (1 - 0.8**2) / 1.5**2, rel=0.01)
