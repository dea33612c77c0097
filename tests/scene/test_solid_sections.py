"""A slice through a solid: the outline is the one that geometry knows, and strips of it add up to the surface."""

import numpy as np
import pytest

from insonify.scene.seabed import Seabed
from insonify.scene.solid import world_triangles
from insonify.scene.solid_section import solid_section
from insonify.scene.target import Box, Cylinder, Sphere
from insonify.simulator import arrivals, levels
from oracles.scenes import nominal

SONAR, BED = np.array([0.0, 0.0, 11.0]), Seabed(depth=20.0)
EAST = np.pi / 2


def cut(solid, bearing=EAST, covered=lambda width: width, place=SONAR, pitch=0.02, **how):
    """Section of a solid by the plane through the sonar."""
    return solid_section(solid, BED, 1, pitch, 0, place, bearing, covered, **how)


def test_a_sphere_is_cut_in_a_circle_and_keeps_its_area():
    """All points one radius from the centre and in the plane, normals radial: 0.3 %; areas together pi d^2: 2 %."""
    ball = Sphere(position=(0.0, 50.0), diameter=2.0, base_depth=19.0)
    points = cut(ball)
    centre = np.array([0.0, 50.0, 18.0])
    away = points.position - centre
    np.testing.assert_allclose(points.position[:, 0], 0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 1, rtol=3e-3)
    np.testing.assert_allclose(np.sum(away * points.normal, axis=1), 1, rtol=3e-3)
    assert points.area.sum() == pytest.approx(4 * np.pi, rel=0.02)


def test_a_chord_is_cut_off_its_centre_and_a_miss_gives_nothing():
    """A plane 0.6 m from the centre of a ball of 1 m radius cuts a circle of 0.8 m; one 1.2 m away cuts nothing."""
    for aside, radius in ((0.6, 0.8), (1.2, None)):
        points = cut(Sphere(position=(aside, 50.0), diameter=2.0, base_depth=19.0))
        if radius is None:
            assert len(points) == 0
        else:
            away = points.position[:, 1:] - np.array([50.0, 18.0])
            np.testing.assert_allclose(np.linalg.norm(away, axis=1), radius, rtol=5e-3)


@pytest.mark.parametrize("bearing", [EAST, 1.2, 2.0])
def test_a_long_cylinder_across_the_beam_stands_for_what_the_beam_covers(bearing):
    """20 m long, of which 3 m are covered: pi d times 3 m, over the cosine by which it lies askew, to 3 %."""
    where = 50.0 * np.array([np.cos(bearing), np.sin(bearing)])
    log = Cylinder(position=tuple(where), length=20.0, diameter=0.5, heading=0.0, base_depth=19.5)
    points = cut(log, bearing, lambda width: min(width, 3.0))
    assert points.area.sum() == pytest.approx(np.pi * 0.5 * 3.0 / abs(np.sin(bearing)), rel=0.03)
    middle = (points.position[:, 2].max() + points.position[:, 2].min()) / 2
    assert middle == pytest.approx(19.25, abs=0.01)


def test_the_part_in_the_bed_is_left_out():
    """Half buried, a ball shows the upper half of its circle, above the bed."""
    points = cut(Sphere(position=(0.0, 50.0), diameter=2.0, burial=0.5))
    assert points.position[:, 2].max() < 20
    assert points.position[:, 2].min() == pytest.approx(19, abs=1e-3)


def test_draws_and_even_points_lie_on_the_same_outline():
    """As many of both, at most a cell apart; drawn phases of unit modulus."""
    ball = Sphere(position=(0.0, 50.0), diameter=2.0, base_depth=19.0)
    drawn, even = cut(ball, pitch=0.05), cut(ball, pitch=0.05, quadrature=True)
    assert np.linalg.norm(drawn.position - even.position, axis=1).max() <= 0.07
    np.testing.assert_allclose(np.abs(drawn.phase), 1)


def test_a_leaning_block_is_received_in_a_slice_as_the_upright_one():
    """Expected level of a 2 x 1 x 1 m block, turned by a millionth so that it is a solid: the box's, to 0.3 dB."""
    received = []
    for roll in (0.0, 1e-6):
        scene = nominal(box={"label": "box", "roll": roll, "size": (2.0, 1.0, 1.0)}, field="incoherent",
                        paths={"geometry": "slice", "max_reflections": 0}, surface={"scattering": None},
                        track={"window": (0.199, 0.204)})  # fmt: skip
        level = levels(scene).level_db.sel(contribution="target").values
        received.append(np.sum(10 ** (np.nan_to_num(level, nan=-500.0, neginf=-500.0) / 10)))
    assert 10 * np.log10(received[1] / received[0]) == pytest.approx(0, abs=0.3)


@pytest.mark.parametrize("edges", ["none", "knife-edge"])
def test_a_solid_in_a_slice_throws_a_shadow(edges):
    """Behind a cylinder across the beam: no arrival in mid-shadow with hard edges, weak ones with soft ones."""
    log = {"shape": "cylinder", "label": "log", "position": (0.0, 150.0), "length": 8.0, "diameter": 1.0}
    scene = nominal(targets=[log], paths={"geometry": "slice", "max_reflections": 0, "edge_diffraction": edges},
                    surface={"scattering": None})  # fmt: skip
    bare = nominal(paths={"geometry": "slice", "max_reflections": 0}, surface={"scattering": None})
    window = 2 * np.hypot(np.array([155.0, 160.0]), 9) / 1500
    found, free = (arrivals(s, window=tuple(window)) for s in (scene, bare))
    power = np.sum(np.abs(found.amplitude) ** 2) / np.sum(np.abs(free.amplitude) ** 2)
    assert power == 0 if edges == "none" else 0 < power < 0.01


def test_the_cut_of_a_box_is_a_rectangle():
    """A block that is a solid by its lean: outline of 2 (1 + 1) m less its base, which stands on the bed."""
    block = Box(position=(0.0, 50.0), size=(2.0, 1.0, 1.0), roll=1e-6)
    points = cut(block)
    assert world_triangles(block, BED).area.sum() == pytest.approx(10, rel=1e-3)
    assert np.ptp(points.position[:, 1]) == pytest.approx(1, abs=0.03)
