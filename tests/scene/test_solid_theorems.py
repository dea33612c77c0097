"""Bodies satisfy the theorems of solid geometry, whatever their kind and however they lie."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.frames import pose_rotation
from insonify.scene import triangle_surfaces
from insonify.scene.seabed import Seabed
from insonify.scene.shape_library import PRESETS, preset_triangles
from insonify.scene.solid import body_triangles, height, inside_solid, resting_pose, solid_scatterers, world_triangles
from insonify.scene.surface_cells import surface_cells
from insonify.scene.target import Box, Cone, Cylinder, LibraryTarget, Plate, Sphere, TruncatedCone

BED = Seabed(depth=20.0)
PI = np.pi
COUNT = 600
CONVEX = {
    "ball": triangle_surfaces.sphere(2.0),
    "block": triangle_surfaces.block(2.0, 1.0, 0.5),
    "wedge": triangle_surfaces.wedge(2.0, 0.7, 1.1, 0.4),
    "drum": triangle_surfaces.cylinder(1.0, 0.6),
    "cone": triangle_surfaces.frustum(1.0, 0.8, 0.0),
}
ATTITUDES = st.tuples(st.floats(-PI, PI), st.floats(-PI / 2, PI / 2), st.floats(-PI, PI))


def normals(surface):
    """Normal of every triangle, as long as its area [m^2]."""
    a, b, c = np.moveaxis(surface.corners, 1, 0)
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("name", PRESETS)
def test_every_part_of_the_library_satisfies_eulers_formula(name):
    """Corners - edges + faces is 2 for each body that hangs together, and 0 for a ring or an open pipe."""
    faces = preset_triangles(name).faces
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    expected = len(np.unique(faces)) - len(edges) + len(faces)
    assert expected == {"tyre": 0, "pipe": 0, "bomb": 6, "anchor": 8, "wreck": 6}.get(name, 2)


@pytest.mark.parametrize("name", CONVEX)
def test_the_mean_shadow_of_a_convex_body_is_a_quarter_of_its_surface(name):
    """Cauchy (1841): the area that it shows, averaged over all directions; 4000 directions of a Fibonacci spiral."""
    n = np.arange(4000) + 0.5
    up, turn = 1 - 2 * n / 4000, PI * (1 + np.sqrt(5)) * n
    ways = np.stack([np.sqrt(1 - up**2) * np.cos(turn), np.sqrt(1 - up**2) * np.sin(turn), up], axis=-1)
    shown = np.maximum(normals(CONVEX[name]) @ ways.T, 0).sum(axis=0)
    assert shown.mean() == pytest.approx(CONVEX[name].area.sum() / 4, rel=1e-3)


@pytest.mark.parametrize("name", CONVEX)
def test_a_convex_body_lies_behind_each_of_its_faces(name):
    """No corner stands out over the plane of any face: every face looks outwards."""
    surface = CONVEX[name]
    normal = normals(surface) / surface.area[:, None]
    support = surface.vertices @ normal.T - np.sum(surface.corners[:, 0] * normal, axis=1)
    assert support.max() < 1e-9


@given(ATTITUDES, st.floats(-1e3, 1e3))
@settings(max_examples=20, deadline=None)
def test_a_body_moved_is_the_same_body(turn, away):
    """Surface and volume of a ring and of a wedge outlive every rotation and shift."""
    for surface in (triangle_surfaces.torus(1.0, 0.2), CONVEX["wedge"]):
        moved = surface.transformed(pose_rotation(*turn), np.array([away, -away, 5.0]))
        np.testing.assert_allclose(moved.area, surface.area, rtol=1e-7)
        assert moved.volume == pytest.approx(surface.volume, rel=1e-8)


@given(st.tuples(*[st.floats(0.1, 10)] * 3))
@settings(max_examples=20, deadline=None)
def test_stretching_multiplies_the_volume_by_all_three_factors(factors):
    """Volume goes by the determinant; a like stretch of all three axes takes the surface to its square."""
    rock = preset_triangles("rock", 3)
    assert rock.scaled(np.array(factors)).volume == pytest.approx(rock.volume * np.prod(factors), rel=1e-9)
    assert rock.scaled(factors[0]).area.sum() == pytest.approx(rock.area.sum() * factors[0] ** 2, rel=1e-9)


@given(st.lists(st.tuples(st.floats(0.05, 1), st.floats(0.1, 2)), min_size=2, max_size=6), st.sampled_from([5, 24, 96]))
@settings(max_examples=30, deadline=None)
def test_a_line_turned_about_the_axis_encloses_frusta(steps, around):
    """Each stretch adds h/3 (A + sqrt(A B) + B) of pyramid frusta over regular polygons, whatever the profile."""
    along = np.cumsum([step for step, _ in steps])
    radius = np.array([r for _, r in steps])
    polygon = around / 2 * np.sin(2 * PI / around) * radius**2
    expected = np.sum(np.diff(along) / 3 * (polygon[1:] + np.sqrt(polygon[1:] * polygon[:-1]) + polygon[:-1]))
    profile = [(along[0], 0.0), *zip(along, radius, strict=True), (along[-1], 0.0)]
    assert triangle_surfaces.surface_of_revolution(profile, steps=around).volume == pytest.approx(expected, rel=1e-9)


def test_finer_steps_come_to_the_sphere_as_their_square():
    """Twice as many steps leave a quarter of the missing volume and surface."""
    missing = [4 / 3 * PI - triangle_surfaces.sphere(2.0, steps=n).volume for n in (24, 48, 96)]
    bare = [4 * PI - triangle_surfaces.sphere(2.0, steps=n).area.sum() for n in (24, 48, 96)]
    for lost in (missing, bare):
        assert min(lost) > 0
        np.testing.assert_allclose(np.divide(lost[:-1], lost[1:]), 4, rtol=0.02)


def test_several_bodies_as_one_have_the_sum_of_their_volumes():
    """Joined surfaces keep their order, area and volume, however far apart."""
    parts = [CONVEX[name].transformed(np.eye(3), np.full(3, 50.0 * n)) for n, name in enumerate(CONVEX)]
    whole = triangle_surfaces.merged_surfaces(parts)
    assert whole.volume == pytest.approx(sum(part.volume for part in parts), rel=1e-9)
    np.testing.assert_array_equal(whole.corners, np.concatenate([part.corners for part in parts]))


@given(ATTITUDES, st.tuples(*[st.floats(0.1, 4)] * 3))
@settings(max_examples=40, deadline=None)
def test_the_height_of_a_leaning_block_is_the_sum_of_its_projected_edges(turn, size):
    """L |sin p| + w |sin r cos p| + h |cos r cos p|: the support of a box upwards; the heading has no effect."""
    heading, pitch, roll = turn
    box = Box(position=(3, -5), size=size, heading=heading, pitch=pitch, roll=roll)
    rise = np.abs([np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])
    assert height(box) == pytest.approx(rise @ size, rel=1e-9)


@given(st.floats(-PI / 2, PI / 2), st.floats(-PI, PI))
@settings(max_examples=25, deadline=None)
def test_a_cylinder_leans_on_the_rim_of_its_base(pitch, roll):
    """Its height is L |sin p| + D cos p, to the steps of its rim; rolling about its axis changes nothing more."""
    rod = Cylinder(position=(0, 0), length=3.0, diameter=0.8, pitch=pitch, roll=roll)
    expected = 3 * abs(np.sin(pitch)) + 0.8 * np.cos(pitch)
    assert expected - 0.8 * (1 - np.cos(PI / 96)) - 1e-9 <= height(rod) <= expected + 1e-9


@given(ATTITUDES, st.floats(0, 0.9), st.sampled_from(["box", "drum", "cone", "rock"]))
@settings(max_examples=25, deadline=None)
def test_a_body_sunk_by_a_part_stands_out_by_the_rest(turn, burial, kind):
    """Of its height as it lies a part lies in the bed, its middle over its position: top and lowest point."""
    lies = dict(zip(("heading", "pitch", "roll"), turn, strict=True), position=(7.0, -2.0), burial=burial)
    solid = {
        "box": Box(size=(2, 1, 0.5), **lies), "drum": LibraryTarget(name="drum", **lies),
        "cone": Cone(height=1, diameter=0.6, **lies), "rock": LibraryTarget(name="rock", variant=4, **lies),
    }[kind]  # fmt: skip
    placed, tall = world_triangles(solid, BED), height(solid)
    assert placed.low[2] == pytest.approx(20 - tall * (1 - burial), abs=1e-9)
    assert placed.high[2] == pytest.approx(20 + tall * burial, abs=1e-9)
    rotation, middle = resting_pose(solid, BED)
    np.testing.assert_allclose(middle[:2], [7, -2])
    np.testing.assert_allclose(placed.vertices, body_triangles(solid).vertices @ rotation.T + middle)


@pytest.mark.parametrize("burial", [0.1, 0.5, 0.8])
def test_the_zone_of_a_sphere_above_the_bed_is_its_share_of_the_diameter(burial):
    """Archimedes' hat-box theorem: a part of the height has that part of the surface, whichever part it is."""
    ball = Sphere(position=(0, 0), diameter=2.0, burial=burial)
    points = solid_scatterers(ball, BED, 1, 0.02, 0)
    assert points.area.sum() == pytest.approx(4 * PI * (1 - burial), rel=0.01)
    up = -points.normal[:, 2]
    assert up.min() == pytest.approx(2 * burial - 1, abs=PI / 96)  # faces are level to half a step
    # Heights are even between the bed and the top: the mean of a uniform number.
    assert (20 - points.position[:, 2]).mean() == pytest.approx(1 - burial, rel=0.02)


@pytest.mark.parametrize("name", [*CONVEX, "ring", "pipe"])
def test_the_share_of_random_places_inside_is_the_volume(name):
    """Two methods: the divergence theorem, and 600 places in the bounding box within four standard errors."""
    others = {
        "ball": triangle_surfaces.sphere(2.0, steps=24),
        "ring": triangle_surfaces.torus(1.0, 0.3),
        "pipe": triangle_surfaces.tube(1.0, 0.6, 0.1),
    }
    surface = {**CONVEX, **others}[name]
    place = np.random.default_rng(8).uniform(surface.low, surface.high, (COUNT, 3))
    share = inside_solid(surface, place).mean()
    expected = surface.volume / np.prod(surface.high - surface.low)
    assert share == pytest.approx(expected, abs=4 * np.sqrt(expected * (1 - expected) / COUNT) + 1e-12)


@pytest.mark.parametrize("name", [*CONVEX, "ring"])
def test_a_point_of_a_face_has_the_body_behind_it_and_water_before_it(name):
    """A step against the normal is inside, a step along it is outside: points and insides agree."""
    surface = {**CONVEX, "ring": triangle_surfaces.torus(1.0, 0.3)}[name]
    cells = surface_cells(surface, np.sqrt(surface.area.sum() / 150))
    place, normal = cells.points(np.random.default_rng(9).random((len(cells), 3)))
    assert not inside_solid(surface, place + 1e-5 * normal).any()
    # Close to an edge a step inwards may come out by another face.
    assert inside_solid(surface, place - 1e-5 * normal).mean() > 0.99


def test_turning_a_body_inside_out_moves_nothing_in_or_out():
    """The solid angle changes its sign, not its size."""
    ring = triangle_surfaces.torus(1.0, 0.3)
    place = np.random.default_rng(10).uniform(ring.low, ring.high, (100, 3))
    inverse = triangle_surfaces.Triangles(ring.vertices, ring.faces[:, ::-1])
    np.testing.assert_array_equal(inside_solid(inverse, place), inside_solid(ring, place))
    assert inverse.volume == pytest.approx(-ring.volume)


def test_the_same_body_by_two_names():
    """Block and plate, cone and truncated cone towards a point, cylinder and the library's drum: the same surfaces."""
    box = Box(position=(0, 0), size=(2, 1, 0.3), roll=0.2)
    plate = Plate(position=(0, 0), length=2, width=1, thickness=0.3, roll=0.2)
    np.testing.assert_array_equal(world_triangles(box, BED).corners, world_triangles(plate, BED).corners)
    drum, lying = LibraryTarget(name="drum", position=(0, 0)), Cylinder(position=(0, 0), length=0.851, diameter=0.572)
    np.testing.assert_allclose(world_triangles(drum, BED).corners, world_triangles(lying, BED).corners, atol=1e-12)
    cone = body_triangles(Cone(position=(0, 0), height=1, diameter=2))
    blunt = body_triangles(TruncatedCone(position=(0, 0), height=1, diameter=2, top_diameter=1e-6))
    assert blunt.volume == pytest.approx(cone.volume, rel=1e-5)
    assert blunt.area.sum() == pytest.approx(cone.area.sum(), rel=1e-5)
