"""Smooth faces as triangles: what is above the ground, and how round a round body is."""

import numpy as np
import pytest

from insonify.engines.faces import split
from insonify.scene.seabed import Seabed
from insonify.scene.smooth_faces import MOST_AROUND, above_ground, phase_of_steps, smooth_triangles, steps_around
from insonify.scene.target import Box, Cylinder, Sphere

BED = Seabed(depth=20.0)


def area(corners):
    """Area of each triangle [m^2]."""
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


@pytest.mark.parametrize("sunk", [0.0, 0.25, 0.9])
def test_what_has_sunk_in_is_cut_off_along_the_ground(sunk):
    """A box of 2 x 1 x 1 m: its top, and of its sides what stands above; the base is never there."""
    box = Box(position=(3.0, 50.0), size=(2.0, 1.0, 1.0), heading=0.4, burial_depth=sunk)
    left = above_ground(smooth_triangles(box, BED, 0.015), BED)
    assert area(left).sum() == pytest.approx(2 + 6 * (1 - sunk))
    assert left[:, :, 2].max() <= 20 + 1e-6


def test_a_leaning_body_keeps_its_normals_where_it_is_cut():
    """Normals of a sunk, leaning cylinder's pieces are those of its whole faces, and look outwards."""
    log = Cylinder(position=(0.0, 50.0), length=2.0, diameter=0.6, pitch=0.3, roll=0.2, burial=0.4)
    whole = smooth_triangles(log, BED, 0.015)
    left = above_ground(whole, BED)

    def normals(corners):
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return across[area(corners) > 1e-9] / (2 * area(corners)[area(corners) > 1e-9])[:, None]

    assert 0.3 < area(left).sum() / area(whole).sum() < 0.9
    nearest = (normals(left) @ normals(whole).T).max(axis=1)
    np.testing.assert_allclose(nearest, 1, atol=1e-6)


def test_splitting_keeps_the_surface_and_keeps_to_its_limits():
    """A face of 2 x 1 m from 5 m and from 150 m: the same area; near the sonar, far smaller facets."""
    face = np.array([[[-1.0, 0, 0], [1, 0, 0], [1, 0, 1]], [[-1, 0, 0], [1, 0, 1], [-1, 0, 1]]])
    counts = []
    for far in (150.0, 5.0):
        places = np.array([[0.0, -far, 0.5], [0.0, -far, 8.0]])
        found, whole = split(face, [places, places], 0.015, 0.01, 0.04)
        assert whole and area(found).sum() == pytest.approx(2.0)
        ray = (found.mean(axis=1)[:, None] - places) / np.linalg.norm(found.mean(axis=1)[:, None] - places, axis=2)[
            ..., None
        ]
        sides = np.roll(found, -1, axis=1) - found
        assert np.abs(np.einsum("tsk,tfk->tsf", sides, ray)).max() <= 0.04
        assert np.linalg.norm(sides, axis=2).max() <= 0.01 * (far + 1)
        counts.append(len(found))
    assert counts[1] > 20 * counts[0]


def test_round_bodies_are_rounder_for_shorter_waves():
    """Steps about the axis leave a quarter of a radian of an echo's phase, until there are 384 of them."""
    ball = Sphere(position=(0.0, 50.0), diameter=0.5)
    steps = [steps_around(ball, wavelength) for wavelength in (0.05, 0.015, 0.00375, 0.0001)]
    assert steps == sorted(steps) and steps[0] == 96 and steps[-1] == MOST_AROUND
    assert phase_of_steps(ball, steps[2], 0.00375) <= 0.25 < phase_of_steps(ball, steps[2] - 96, 0.00375)
    assert phase_of_steps(Box(position=(0, 50), size=(1, 1, 1)), 96, 0.001) == 0
    corners = smooth_triangles(ball, BED, 0.00375)
    assert np.linalg.norm(corners - np.array([0, 50, 19.75]), axis=2) == pytest.approx(0.25)
