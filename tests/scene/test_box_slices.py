"""An upright box: its points as a surface, its body, and its section by a vertical plane."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scene.box import FACES, box_axes, box_body, box_scatterers, box_section, inside_box
from insonify.scene.scene import Scene, inside_body
from insonify.scene.seabed import Seabed
from insonify.scene.solid import inside_solid, world_triangles
from insonify.scene.target import Box

DEPTH = 20.0
SONAR = np.array([0.0, 0.0, 11.0])


def points(box, pitch=0.2, **how):
    """The points of a box on a flat bed."""
    return box_scatterers(box, DEPTH, 1, pitch, 0, **how)


def section(box, bearing, covered=lambda width: width, pitch=0.1):
    """Section of a box by a plane through the sonar."""
    return box_section(points(box, pitch), box, SONAR, bearing, covered)


@given(st.floats(-6.28, 6.28))
def test_a_box_is_right_handed_and_its_top_is_up(heading):
    """Along, across and up: a rotation once up is turned down, with the heading clockwise from north."""
    axes = box_axes(Box(position=(0, 50), size=(1, 1, 1), heading=heading))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(-1)
    np.testing.assert_allclose(axes[0], [np.cos(heading), np.sin(heading), 0])


@given(st.tuples(*[st.floats(0.3, 4)] * 3), st.floats(-6, 6), st.floats(4.1, 19))
@settings(max_examples=25, deadline=None)
def test_a_floating_box_satisfies_the_divergence_theorem(size, heading, base):
    """Six wet faces, off surface and seabed: the areas sum to zero, and a third of the sum of x.n dA is the volume."""
    box = Box(position=(5, 50), size=size, heading=heading, base_depth=base)
    found = points(box, 0.3)
    np.testing.assert_allclose(found.area @ found.normal, 0, atol=1e-9 * found.area.sum())
    centre = np.array([5, 50, base - size[2] / 2])
    moment = np.sum(found.area * np.sum((found.position - centre) * found.normal, axis=1)) / 3
    assert moment == pytest.approx(np.prod(size), rel=1e-9)


def test_a_standing_box_is_open_towards_the_bed():
    """Without its base the areas add up to that of the top, upwards; a micron above the bed it is shut again."""
    standing = points(Box(position=(0, 50), size=(2, 1, 1)))
    np.testing.assert_allclose(standing.area @ standing.normal, [0, 0, -2], atol=1e-9)
    floating = points(Box(position=(0, 50), size=(2, 1, 1), base_depth=DEPTH - 1e-5))
    np.testing.assert_allclose(floating.area @ floating.normal, 0, atol=1e-9)
    on_bed = points(Box(position=(0, 50), size=(2, 1, 1), base_depth=DEPTH))
    np.testing.assert_array_equal(on_bed.position, standing.position)


def test_each_face_looks_where_its_name_states():
    """Heading east, fore is east, starboard is south, top is shallow: by the face in each point's key."""
    found = points(Box(position=(0, 50), size=(2, 1, 1), heading=np.pi / 2, base_depth=15.0))
    face = (found.scatterer_id >> np.uint64(24)) & np.uint64(7)
    looks = {"fore": (0, 1, 0), "aft": (0, -1, 0), "starboard": (-1, 0, 0), "port": (1, 0, 0), "top": (0, 0, -1),
             "bottom": (0, 0, 1)}  # fmt: skip
    for number, name in enumerate(FACES):
        assert (face == number).any()
        np.testing.assert_allclose(found.normal[face == number], [looks[name]] * int((face == number).sum()), atol=1e-9)


@pytest.mark.parametrize("rise", [0.2, 0.05, 0.013])
def test_only_upright_faces_are_cut_into_lower_cells(rise):
    """Cells of the top keep their number; those of a 1 m high side become as many as the rise requests."""
    box = Box(position=(0, 50), size=(2, 1, 1))
    found = points(box, 0.25, rise=rise)
    level = found.normal[:, 2] < -0.5
    assert level.sum() == 8 * 4
    assert (~level).sum() == 2 * (8 + 4) * int(np.ceil(1 / rise))
    assert found.area.sum() == pytest.approx(2 + 2 * 3)


def test_even_points_do_not_follow_the_seed_and_drawn_ones_do():
    """Placed evenly the places are the same for all seeds; their phases are still drawn."""
    box = Box(position=(0, 50), size=(2, 1, 1))
    one, other = (box_scatterers(box, DEPTH, seed, 0.2, 0, quadrature=True) for seed in (1, 2))
    np.testing.assert_array_equal(one.position, other.position)
    assert not np.any(one.phase == other.phase)
    one, other = (box_scatterers(box, DEPTH, seed, 0.2, 0) for seed in (1, 2))
    assert not np.any(np.all(one.position == other.position, axis=1))


def test_even_points_find_the_moment_of_a_face_better_than_drawn_ones():
    """The mean of a plane wave's square over the top of a box, sin^2(7 x), against its integral."""
    box = Box(position=(0, 50), size=(2, 1, 1))
    expected = 0.5 - np.sin(14) / 28
    off = []
    for even in (True, False):
        found = [box_scatterers(box, DEPTH, seed, 0.1, 0, quadrature=even) for seed in range(6)]
        tops = [np.sin(7 * p.position[p.normal[:, 2] < -0.5, 0]) ** 2 for p in found]
        off.append(np.sqrt(np.mean([(top.mean() - expected) ** 2 for top in tops])))
    assert off[0] < 2e-3 and off[0] < off[1]


@given(st.floats(-6, 6), st.tuples(*[st.floats(0.3, 3)] * 3), st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_inside_a_box_is_inside_its_triangles(heading, size, seed):
    """Arithmetic of an upright prism, and the solid angle of twelve triangles: the same places are inside."""
    box, bed = Box(position=(4, 50), size=size, heading=heading, base_depth=15.0), Seabed(depth=DEPTH)
    place = np.array([4, 50, 15 - size[2] / 2]) + np.random.default_rng(seed).uniform(-2, 2, (100, 3))
    prism = [inside_box(box_body(box, DEPTH), row) for row in place]
    np.testing.assert_array_equal(prism, inside_solid(world_triangles(box, bed), place))
    np.testing.assert_array_equal(prism, inside_body(box, bed, place))


def test_a_hair_of_roll_makes_a_box_of_triangles_and_changes_no_body():
    """Upright boxes and leaning ones go different ways: their corners and depths meet in the limit."""
    upright = {"shape": "box", "position": (3, 50), "size": (2, 1, 1.5), "heading": 0.7}
    one, other = Scene(targets=[upright]), Scene(targets=[{**upright, "roll": 1e-9}])
    assert len(one.boxes) == len(other.solids) == 1 and not one.solids and not other.boxes
    np.testing.assert_allclose(other.body_depths, one.body_depths, atol=1e-8)
    north, east, c, s, length, width, top, base = one.bodies[0]
    expected = np.array([(north + c * a - s * b, east + s * a + c * b, z) for a in (-length, length)
                     for b in (-width, width) for z in (top, base)])  # fmt: skip
    found = world_triangles(other.solids[0], other.seabed).vertices
    away = np.linalg.norm(found[:, None] - expected[None], axis=2)
    assert away.min(axis=0).max() < 1e-8 and away.min(axis=1).max() < 1e-8


@given(st.floats(-0.7, 0.7), st.floats(0, 6.28))
@settings(max_examples=25, deadline=None)
def test_a_section_lies_in_its_plane_and_on_the_box(turn, bearing):
    """Points are squeezed into the plane along an edge, so they stay on the faces that the plane cuts."""
    ahead = np.array([np.cos(bearing), np.sin(bearing)])
    box = Box(position=tuple(50 * ahead), size=(2, 2, 1), heading=bearing + turn)
    found = section(box, bearing)
    assert len(found)
    aside = np.array([-ahead[1], ahead[0]])
    np.testing.assert_allclose(found.position[:, :2] @ aside, 0, atol=1e-9)
    own = (found.position - [*box.position, DEPTH - 0.5]) @ box_axes(box).T / [1, 1, 0.5]
    facing = np.abs(np.sum(own * np.abs(found.normal @ box_axes(box).T), axis=1))
    np.testing.assert_allclose(facing, 1, atol=1e-9)


@given(st.floats(-0.7, 0.7))
@settings(max_examples=20, deadline=None)
def test_a_section_that_is_covered_whole_keeps_the_areas_of_its_faces(turn):
    """Front, back and top of the box, each with its whole area, when the beam covers all of its width."""
    box = Box(position=(50, 0), size=(3, 2, 1), heading=turn)
    found = section(box, 0.0)
    assert found.area.sum() == pytest.approx(2 * 2 * 1 + 3 * 2)
    widths = []
    section(box, 0.0, lambda width: widths.append(width) or width)
    np.testing.assert_allclose(widths, 2 * np.cos(turn))
    half = section(box, 0.0, lambda width: width / 2)
    np.testing.assert_allclose(half.area, found.area / 2)


def test_a_plane_that_misses_the_box_cuts_nothing():
    """At 50 m a box 2 m wide is cut up to 1 m beside its middle, and no farther."""
    for aside, is_cut in ((0.0, True), (0.99, True), (-0.99, True), (1.01, False), (-1.01, False)):
        assert bool(len(section(Box(position=(50, aside), size=(1, 2, 1)), 0.0))) is is_cut


def test_a_box_seen_from_the_other_side_has_the_same_section():
    """The plane has no sense: looking back along it the same faces are cut."""
    box = Box(position=(50, 0.4), size=(3, 2, 1), heading=0.3)
    ahead, back = section(box, 0.0), section(box, np.pi)
    np.testing.assert_allclose(ahead.position, back.position, atol=1e-9)
    np.testing.assert_array_equal(ahead.scatterer_id, back.scatterer_id)


@pytest.mark.parametrize("turn", [0.6, 2.1, -1.2])
def test_a_section_turns_with_the_scene(turn):
    """Box and plane turned together by any angle: the same points, turned."""
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, -s], [s, c]])
    here = Box(position=(50, 0.4), size=(3, 2, 1), heading=0.3)
    there = Box(position=tuple(matrix @ here.position), size=(3, 2, 1), heading=0.3 + turn)
    one, other = section(here, 0.0), section(there, turn)
    np.testing.assert_allclose(other.position[:, :2], one.position[:, :2] @ matrix.T, atol=1e-9)
    np.testing.assert_allclose(other.area, one.area)
