"""Solids as triangles: closed forms of their surface and volume, how they lie, and the points drawn on them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scene import triangle_surfaces
from insonify.scene.mesh_file import edge_defects
from insonify.scene.seabed import Seabed
from insonify.scene.solid import body_triangles, height, inside_solid, solid_scatterers, world_triangles
from insonify.scene.surface_cells import surface_cells
from insonify.scene.target import Box, Cone, Cylinder, Plate, Sphere, TruncatedCone

BED = Seabed(depth=20.0)
lengths = st.floats(0.1, 30)
PI = np.pi
# A circle of 96 steps has a perimeter 1.8e-4 and an area 7.1e-4 below the true one's, a sphere a volume 1.8e-3.
ROUND = 2e-3


def slant(tall, low, high):
    """Length of the side of a truncated cone."""
    return np.hypot(tall, (low - high) / 2)


CLOSED_FORMS = {
    "sphere": (triangle_surfaces.sphere(3.0), PI * 9, PI / 6 * 27),
    "cylinder": (triangle_surfaces.cylinder(4.0, 2.0), 2 * PI * 4 + 2 * PI, 4 * PI),
    "cone": (triangle_surfaces.frustum(4.0, 2.0, 0.0), PI * slant(4, 2, 0) + PI, 4 / 3 * PI),
    "truncated cone": (
        triangle_surfaces.frustum(3.0, 2.0, 1.0), PI * 1.5 * slant(3, 2, 1) + PI * 1.25, PI * 3 / 12 * (4 + 2 + 1),
    ),
    "block": (triangle_surfaces.block(1.0, 2.0, 3.0), 22.0, 6.0),
    "wedge": (triangle_surfaces.wedge(1.0, 0.5, 2.0, 1.0), 2 * 0.75 + 2 * (1 + 0.5 + 1 + np.hypot(1, 0.5)), 1.5),
    "pipe": (triangle_surfaces.tube(5.0, 1.0, 0.1), 5 * PI * 1.8 + 2 * PI * (0.25 - 0.16), 5 * PI * (0.25 - 0.16)),
}  # fmt: skip


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_a_shape_has_the_surface_and_the_volume_of_the_textbook(name):
    """Closed forms of surface and volume, to the steps of a round shape; flat shapes to rounding."""
    made, area, volume = CLOSED_FORMS[name]
    tolerance = 1e-12 if name in ("block", "wedge") else ROUND
    assert made.area.sum() == pytest.approx(area, rel=tolerance)
    assert made.volume == pytest.approx(volume, rel=tolerance)
    assert edge_defects(made.faces) == (0, 0)


def test_a_ring_satisfies_pappus():
    """Surface 4 pi^2 R r and volume 2 pi^2 R r^2 of a torus; 24 steps about its tube take 1.1 % of the volume."""
    ring = triangle_surfaces.torus(2.0, 0.5)
    assert ring.area.sum() == pytest.approx(4 * PI**2 * 0.75 * 0.25, rel=4e-3)
    assert ring.volume == pytest.approx(2 * PI**2 * 0.75 * 0.25**2, rel=1.3e-2)
    assert edge_defects(ring.faces) == (0, 0)


@pytest.mark.parametrize(
    ("solid", "tall"),
    [
        (Sphere(position=(1, 2), diameter=2), 2.0),
        (Cylinder(position=(1, 2), length=3, diameter=1), 1.0),
        (Cylinder(position=(1, 2), length=3, diameter=1, pitch=PI / 2), 3.0),
        (Cylinder(position=(1, 2), length=3, diameter=1, heading=1.0, roll=2.0), 1.0),
        (Cone(position=(1, 2), height=0.7, diameter=1), 0.7),
        (TruncatedCone(position=(1, 2), height=0.4, diameter=1, top_diameter=0.5), 0.4),
        (Plate(position=(1, 2), length=2, width=1, thickness=0.1), 0.1),
        (Plate(position=(1, 2), length=2, width=1, thickness=0.1, roll=PI / 2), 1.0),
        (Box(position=(1, 2), size=(2, 1, 1), roll=PI / 4), np.sqrt(2)),
    ],
)
def test_a_solid_lies_as_its_attitude_states(solid, tall):
    """A cylinder lies until it is pitched, a cone stands, a plate is level: heights, and a base on the bed."""
    lies = world_triangles(solid, BED)
    assert height(solid) == pytest.approx(tall, rel=ROUND)
    assert lies.high[2] == pytest.approx(20.0)
    assert lies.low[2] == pytest.approx(20.0 - tall, rel=1e-4)


def test_a_cone_points_up_and_a_heading_points_from_north_to_east():
    """The cone's one corner on its axis is its shallowest; a cylinder heading 30 degrees runs north by east."""
    cone = world_triangles(Cone(position=(1, 2), height=1, diameter=2), BED)
    np.testing.assert_allclose(cone.vertices[np.argmin(cone.vertices[:, 2])], [1, 2, 19], atol=1e-12)
    rod = Cylinder(position=(0, 0), length=10, diameter=0.01, heading=np.radians(30), pitch=np.radians(10))
    ends = world_triangles(rod, BED).vertices
    way = ends[np.argmax(ends[:, 0])] - ends[np.argmin(ends[:, 0])]
    expected = [np.cos(np.radians(30)) * np.cos(np.radians(10)), np.sin(np.radians(30)) * np.cos(np.radians(10)),
            -np.sin(np.radians(10))]  # fmt: skip
    np.testing.assert_allclose(way / np.linalg.norm(way), expected, atol=2e-3)


@pytest.mark.parametrize("sunk", [{"burial": 0.25}, {"burial_depth": 0.5}])
def test_a_target_sinks_by_a_part_of_its_height_or_by_metres(sunk):
    """A quarter of a 2 m sphere, or half a metre of it, is below the bed, and nothing of that part echoes."""
    ball = Sphere(position=(0, 0), diameter=2, **sunk)
    assert world_triangles(ball, BED).high[2] == pytest.approx(20.5)
    points = solid_scatterers(ball, BED, 1, 0.03, 0)
    assert points.position[:, 2].max() < 20
    # Archimedes: the part of a sphere's surface above a plane is the part of its height.
    assert points.area.sum() == pytest.approx(0.75 * 4 * PI, rel=0.01)


def test_a_solid_may_float():
    """Its lowest point is at its base depth."""
    assert world_triangles(Sphere(position=(0, 0), diameter=2, base_depth=9), BED).high[2] == pytest.approx(9)


@given(lengths, lengths, lengths, st.floats(0.02, 0.5), st.booleans())
def test_points_stand_for_equal_shares_of_the_whole_surface(length, width, tall, part, even):
    """Divergence theorem by the drawn points of a block: sum of area times normal is 0, of area x.n / 3 the volume.

    Every point lies on a face. A face's share may be wrong by a cell at each end of its row: six of them.
    """
    block = triangle_surfaces.block(length, width, tall)
    side = part * max(length, width, tall)
    cells = surface_cells(block, max(side, np.sqrt(block.area.sum() / 20_000)))
    place, normal = cells.points(np.random.default_rng(1).uniform(size=(len(cells), 3)), quadrature=even)
    inside = np.abs(place) / (np.array([length, width, tall]) / 2)
    np.testing.assert_allclose(inside.max(axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(np.sum(place * normal, axis=1), np.abs(place * normal).sum(axis=1))
    share = block.area.sum() / len(cells)
    assert share <= max(side, np.sqrt(block.area.sum() / 20_000)) ** 2 * (1 + 1e-9)
    pull = share * normal.sum(axis=0) / block.area.sum()
    assert np.all(np.abs(pull) < 3 / len(cells) * (1 + 1e-9))
    moment = share * np.sum(place * normal) / 3
    assert moment == pytest.approx(block.volume, abs=6 * share * max(length, width, tall))


def test_even_points_of_a_sphere_are_even():
    """Mean of the squares of the normal's components is 1/3 each, and the mean of cos^4 is 1/5, within 0.2 %."""
    cells = surface_cells(triangle_surfaces.sphere(2.0), 0.04)
    _, normal = cells.points(np.zeros((len(cells), 3)), quadrature=True)
    np.testing.assert_allclose(np.mean(normal**2, axis=0), 1 / 3, rtol=2e-3)
    np.testing.assert_allclose(np.mean(normal**4, axis=0), 1 / 5, rtol=4e-3)


def test_the_points_of_a_solid_belong_to_the_body():
    """Wherever it lies and however it turns, the same places of the body have the same phases and keys."""
    here = solid_scatterers(Cylinder(position=(0, 50), length=2, diameter=0.5), BED, 1, 0.1, 0)
    there = solid_scatterers(Cylinder(position=(7, 90), length=2, diameter=0.5, heading=PI / 2), BED, 1, 0.1, 0)
    np.testing.assert_array_equal(here.phase, there.phase)
    np.testing.assert_array_equal(here.scatterer_id, there.scatterer_id)
    away = there.position - [7, 90, 0]
    np.testing.assert_allclose(np.stack([away[:, 1], -away[:, 0] + 50, away[:, 2]], axis=-1), here.position, atol=1e-9)
    other = solid_scatterers(Cylinder(position=(0, 50), length=2, diameter=0.5, label="b"), BED, 1, 0.1, 0)
    assert not np.intersect1d(other.scatterer_id, here.scatterer_id).size
    assert len(np.unique(here.scatterer_id)) == len(here)
    assert not np.any(other.phase == here.phase)


def test_inside_is_where_the_surface_is_all_around():
    """Random places about a ring and a leaning box, against their own inequalities."""
    place = np.random.default_rng(3).uniform(-1.2, 1.2, (2000, 3))
    ring = triangle_surfaces.torus(2.0, 0.6)
    expected = np.hypot(np.hypot(place[:, 1], place[:, 2]) - 0.7, place[:, 0])
    clear = np.abs(expected - 0.3) > 0.01
    np.testing.assert_array_equal(inside_solid(ring, place)[clear], (expected < 0.3)[clear])
    box = Box(position=(0, 0), size=(1.0, 0.8, 0.6), heading=0.3, pitch=0.4, roll=0.5)
    lies = world_triangles(box, BED)
    middle = (lies.low + lies.high) / 2
    body = body_triangles(box)
    turn = np.linalg.lstsq(body.vertices, lies.vertices - middle, rcond=None)[0]
    own = place @ turn.T
    np.testing.assert_array_equal(inside_solid(lies, place + middle), np.all(np.abs(own) < [0.5, 0.4, 0.3], axis=1))
