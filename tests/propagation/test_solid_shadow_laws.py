"""Shadows of solids keep the laws of straight sight: reciprocity, scale, superposition, similar triangles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.frames import pose_rotation
from insonify.propagation.families import families_up_to
from insonify.propagation.image_sources import image_legs
from insonify.propagation.solid_shadows import occluders_of_paths
from insonify.propagation.triangle_tree import triangle_tree
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.shape_library import preset_triangles
from insonify.scene.triangle_surfaces import block, merged_surfaces, torus
from oracles.ray_casting import cast_rays

SONAR = np.array([0.0, 0.0, 8.0])
ROCK, RING = preset_triangles("rock", 2), torus(1.0, 0.3)


def tree(surface):
    """A surface sorted for rays."""
    return triangle_tree(surface.corners, np.zeros(len(surface.faces), np.int32))


ROCKS = tree(merged_surfaces([ROCK, RING.transformed(np.eye(3), np.array([0.3, 0.2, 0.9]))]))
WHOLE = merged_surfaces([ROCK, RING.transformed(np.eye(3), np.array([0.3, 0.2, 0.9]))])


def ways(seed, count=400):
    """Straight ways from far to far, past the origin and beyond."""
    rng = np.random.default_rng(seed)
    start = rng.normal(size=(count, 3))
    start *= 3 / np.linalg.norm(start, axis=1, keepdims=True)
    return start, -start + rng.normal(scale=0.8, size=(count, 3))


def points(position):
    """Points that scatter in all directions."""
    n = len(position)
    return Scatterers("target", "target", PointTargetLaw(), np.asarray(position, float), np.zeros((n, 3)), np.ones(n),
                      np.ones(n, complex), np.arange(n, dtype=np.uint64))  # fmt: skip


def status(targets, place, position=SONAR, order=3):
    """Statuses of the legs to some places, and what cuts them, by family."""
    scene = Scene(seabed={"depth": 20.0}, targets=targets)
    legs = image_legs(scene, position, points(place), families_up_to(order), 100e3)
    return legs.status, legs.occluder


def swarm(seed, count=500):
    """Places in the water around the targets below."""
    return np.random.default_rng(seed).uniform([-10, 30, 0.5], [10, 70, 19.9], (count, 3))


DRUM = {"shape": "drum", "label": "drum", "position": (0, 45), "size": (6, 4, 4), "heading": 0.3}
CONE = {"shape": "cone", "label": "cone", "position": (2, 50), "height": 6, "diameter": 5}
BOX = {"shape": "box", "label": "box", "position": (-3, 48), "size": (3, 3, 5), "heading": 0.5}


@given(st.integers(0, 2**31))
@settings(max_examples=15, deadline=None)
def test_sight_is_mutual(seed):
    """A path is free in one sense if and only if it is in the other; a single face is hit at the same point."""
    start, stop = ways(seed)
    there, first = cast_rays(ROCKS, start, stop)
    back, last = cast_rays(ROCKS, stop, start)
    np.testing.assert_array_equal(first >= 0, last >= 0)
    hit = first >= 0
    assert hit.sum() > 50
    assert np.all(there[hit] + back[hit] <= 1 + 1e-9)
    once = hit & (first == last)
    np.testing.assert_allclose(there[once], 1 - back[once], atol=1e-9)


@given(st.tuples(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3)), st.floats(-500, 500), st.floats(0.01, 100))
@settings(max_examples=15, deadline=None)
def test_rays_and_bodies_moved_and_scaled_together_intersect_alike(turn, shift, scale):
    """The part of the way at the hit is a pure number: it knows no axes and no metres."""
    start, stop = ways(3)
    rotation, away = pose_rotation(*turn), np.array([shift, -shift, shift / 2])
    moved = tree(WHOLE.scaled(scale).transformed(rotation, away))
    part, row = cast_rays(ROCKS, start, stop)
    other, again = cast_rays(moved, scale * start @ rotation.T + away, scale * stop @ rotation.T + away)
    same = np.isfinite(part) == np.isfinite(other)
    assert same.mean() > 0.995  # a ray along an outline may pass on either side of it
    both = same & np.isfinite(part)
    np.testing.assert_allclose(other[both], part[both], atol=1e-4)
    assert np.mean(row[both] == again[both]) > 0.97


@given(st.integers(0, 2**31), st.floats(0.05, 0.95))
@settings(max_examples=15, deadline=None)
def test_a_path_cut_in_two_hits_what_the_whole_hits(seed, where):
    """First hit on the first half if any, else on the second."""
    start, stop = ways(seed)
    middle = start + where * (stop - start)
    part, _ = cast_rays(ROCKS, start, stop)
    one, two = cast_rays(ROCKS, start, middle)[0], cast_rays(ROCKS, middle, stop)[0]
    expected = np.where(np.isfinite(one), one * where, where + two * (1 - where))
    np.testing.assert_allclose(expected, part, atol=1e-9)


def test_the_order_of_the_triangles_does_not_matter():
    """Shuffled, the same triangles are hit, under the rows that they then have."""
    shuffled = np.random.default_rng(4).permutation(len(WHOLE.faces))
    other = triangle_tree(WHOLE.corners[shuffled], np.zeros(len(shuffled), np.int32))
    start, stop = ways(5)
    part, row = cast_rays(ROCKS, start, stop)
    again, moved = cast_rays(other, start, stop)
    np.testing.assert_allclose(again, part, rtol=1e-12)
    hit = row >= 0
    # Where two triangles share the edge that is hit either may be named.
    assert np.mean(shuffled[moved[hit]] == row[hit]) > 0.99


def test_the_nodes_of_a_tree_hold_their_triangles():
    """Every triangle is in one leaf, within the bounds of each node above it, and a node's skip lies after it."""
    nodes = np.arange(len(ROCKS.next_on_miss))
    assert np.all(ROCKS.next_on_miss > nodes) and ROCKS.next_on_miss[0] == len(nodes)
    leaf = ROCKS.first_triangle >= 0
    held = np.concatenate(
        [np.arange(f, f + n) for f, n in zip(ROCKS.first_triangle[leaf], ROCKS.triangle_count[leaf], strict=True)]
    )
    np.testing.assert_array_equal(np.sort(held), np.arange(len(WHOLE.faces)))
    np.testing.assert_array_equal(np.sort(ROCKS.original_row), np.arange(len(WHOLE.faces)))
    a, b, c = np.moveaxis(ROCKS.corner_and_sides.reshape(-1, 3, 3), 1, 0)
    corners = np.stack([a, a + b, a + c], axis=1)
    for node in nodes[:: max(1, len(nodes) // 200)]:
        below = np.arange(node, ROCKS.next_on_miss[node])
        below = below[leaf[below]]
        rows = np.concatenate(
            [np.arange(ROCKS.first_triangle[k], ROCKS.first_triangle[k] + ROCKS.triangle_count[k]) for k in below]
        )
        assert np.all(corners[rows].min(axis=(0, 1)) >= ROCKS.bounds[node, :3] - 1e-9)
        assert np.all(corners[rows].max(axis=(0, 1)) <= ROCKS.bounds[node, 3:] + 1e-9)


@pytest.mark.parametrize("order", [0, 3])
def test_shadows_of_two_bodies_are_the_union_of_each_ones(order):
    """A leg is free past both if and only if it is past either alone: superposition, for solids and a box."""
    place = swarm(1)
    together, _ = status([BOX, DRUM, CONE], place, order=order)
    alone = [status([target], place, order=order)[0] == LegStatus.OCCLUDED for target in (BOX, DRUM, CONE)]
    np.testing.assert_array_equal(together == LegStatus.OCCLUDED, np.any(alone, axis=0))
    assert all(0.01 < shade.mean() < 0.9 for shade in alone)


def test_the_order_of_the_targets_changes_only_their_rows():
    """Whatever comes first in the scene, the same legs are cut."""
    place = swarm(2)
    one, _ = status([DRUM, CONE], place)
    other, by = status([CONE, DRUM], place)
    np.testing.assert_array_equal(one, other)
    cut = one == LegStatus.OCCLUDED
    assert set(np.unique(by[cut])) == {0, 1} and np.all(by[~cut] == -1)


@pytest.mark.parametrize("family", ["D", "S", "B", "SB"])
def test_sonar_and_point_may_change_places(family):
    """A folded path is cut whichever end it is walked from; its letters are read backwards."""
    place = swarm(3, 40)
    scene = Scene(seabed={"depth": 20.0}, targets=[DRUM, CONE])
    there = image_legs(scene, SONAR, points(place), (family,), 100e3).status[0]
    back = [image_legs(scene, row, points(SONAR[None]), (family[::-1],), 100e3).status[0, 0] for row in place]
    np.testing.assert_array_equal(there, back)
    assert 0 < np.mean(there == LegStatus.OCCLUDED) < 1


@pytest.mark.parametrize("tall", [0.5, 2.0, 5.0])
def test_the_shadow_of_a_plate_is_as_long_as_similar_triangles_require(tall):
    """A wall of height t at 50 m from a sonar h above the bed: dark up to 50 h / (h - t), and from there lit."""
    wall = {"shape": "plate", "position": (0, 50), "length": 40.0, "width": tall, "thickness": 1e-3, "roll": np.pi / 2}
    end = 50 * 12 / (12 - tall)
    far = np.array([51.0, end - 0.02, end + 0.02, end + 5])
    found, _ = status([wall], np.column_stack([0 * far, far, 0 * far + 20 - 1e-9]), order=0)
    np.testing.assert_array_equal(found[0] == LegStatus.OCCLUDED, [True, True, False, False])


def test_the_shadow_of_a_pole_is_narrow_towards_the_sonar_and_wide_beyond():
    """A post 1 m wide at 50 m shades 2 m at 100 m: its width grows with the distance."""
    post = {"shape": "plate", "position": (0, 50), "length": 1.0, "width": 1e-3, "thickness": 18.0}
    for far in (60.0, 75.0, 100.0):
        north = np.linspace(-2, 2, 401)
        place = np.column_stack([north, 0 * north + far, 0 * north + 12])
        dark = status([post], place, order=0)[0][0] == LegStatus.OCCLUDED
        np.testing.assert_array_equal(dark, np.abs(north) <= far / 50 * 0.5 + 1e-12)


def test_a_path_in_one_piece_or_in_many_is_cut_alike():
    """Points added along a straight path do not move its shadow: the same object, or none."""
    scene = Scene(seabed={"depth": 20.0}, targets=[BOX, DRUM, CONE])
    place = swarm(6, 900)
    fine = np.linspace(0, 1, 9)[None, :, None]
    one = occluders_of_paths(scene, SONAR + np.array([0.0, 1.0])[None, :, None] * (place - SONAR)[:, None])
    many = occluders_of_paths(scene, SONAR + fine * (place - SONAR)[:, None])
    np.testing.assert_array_equal(one, many)
    assert set(np.unique(one)) <= {-1, 1, 2} and (one > 0).sum() > 20  # boxes are not its business


def test_a_scene_without_solids_cuts_nothing():
    """Boxes alone: no way is cut by triangles that are not there."""
    line = np.array([[[0, 0, 18.0], [0, 90, 18.0]]])
    np.testing.assert_array_equal(occluders_of_paths(Scene(targets=[BOX]), line), [-1])
    np.testing.assert_array_equal(occluders_of_paths(Scene(), line), [-1])


def test_a_path_that_stops_short_of_a_body_is_free():
    """A block from -1 to 1: ways that end before it, in it and beyond it."""
    cube = tree(block(2, 2, 2))
    stop = np.array([[-1.001, 0.1, 0.2], [-0.999, 0.1, 0.2], [5, 0.1, 0.2]])
    part, _ = cast_rays(cube, np.tile([-5.0, 0.1, 0.2], (3, 1)), stop)
    np.testing.assert_allclose(part, [np.inf, 4 / 4.001, 0.4])
