"""Shadows of solids: rays against closed forms and against every triangle, legs against walks along their paths."""

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from threading import Barrier
from time import sleep

import numpy as np
import pytest

from insonify.frames import pose_rotation
from insonify.propagation import solid_shadows
from insonify.propagation.families import families_up_to
from insonify.propagation.image_sources import image_legs
from insonify.propagation.solid_shadows import occluders_of_paths
from insonify.propagation.triangle_tree import triangle_tree
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.solid import solid_scatterers, world_triangles
from insonify.scene.triangle_surfaces import cylinder, merged_surfaces, sphere, torus
from oracles.few_of import few_of
from oracles.ray_casting import cast_rays
from oracles.water import fold

SONAR = np.array([0.0, 0.0, 11.0])


def points(position, boundary="target"):
    """Points that scatter in all directions."""
    n = len(position)
    return Scatterers(boundary, boundary, PointTargetLaw(), np.asarray(position, float), np.zeros((n, 3)), np.ones(n),
                      np.ones(n, complex), np.arange(n, dtype=np.uint64))  # fmt: skip


def world(*targets, depth=20.0):
    """A flat world with some targets."""
    return Scene(seabed={"depth": depth}, targets=targets)


def ways(seed, count=3000):
    """Straight ways between random places on a sphere of radius 3 about the origin, half of them aimed near it."""
    random = np.random.default_rng(seed)
    start, stop = (3 * x / np.linalg.norm(x, axis=1, keepdims=True) for x in random.normal(size=(2, count, 3)))
    stop[::2] = -start[::2] + random.normal(scale=0.7, size=(len(stop[::2]), 3))
    return start, stop


def tree(surface):
    """A surface sorted for rays."""
    return triangle_tree(surface.corners, np.zeros(len(surface.faces), np.int32))


def test_rays_hit_a_sphere_where_the_quadratic_requires():
    """|a + t b| = 1 solved for t; 96 steps leave the faces within 1.1e-3 of it, more along a grazing ray.

    The true hit lies between those of spheres through the faces' corners and touching their middles.
    """
    start, stop = ways(1)
    step = stop - start
    part, _ = cast_rays(tree(sphere(2.0)), start, stop)
    a, b, c = np.sum(step**2, axis=1), np.sum(start * step, axis=1), np.sum(start**2, axis=1)
    outer, inner = (np.sqrt(np.maximum(b**2 - a * (c - r**2), 0)) for r in (1, 1 - 1.2e-3))
    hit, missed = inner > 0, outer == 0
    early, late = (-b - outer) / a, (-b - inner) / a
    assert hit.sum() > 1000 and missed.sum() > 500
    assert np.all(np.isinf(part[missed | (early > 1)]))
    inside = hit & (late < 1)
    assert np.all((part[inside] >= early[inside] - 1e-9) & (part[inside] <= late[inside] + 1e-9))


def test_rays_hit_a_cylinder_where_its_own_inequalities_require():
    """Slab along the axis and quadratic across it, between the cylinders through corners and middles of the steps."""
    start, stop = ways(2)
    step = stop - start
    part, _ = cast_rays(tree(cylinder(2.0, 1.6)), start, stop)

    def entry(radius):
        """Part of the way at which a cylinder of that radius is entered; infinite where it is missed."""
        a, b = np.sum(step[:, 1:] ** 2, axis=1), np.sum(step[:, 1:] * start[:, 1:], axis=1)
        root = b**2 - a * (np.sum(start[:, 1:] ** 2, axis=1) - radius**2)
        with np.errstate(invalid="ignore"):
            low, high = (-b - np.sqrt(root)) / a, (-b + np.sqrt(root)) / a
        near, far = np.sort([(-1 - start[:, 0]) / step[:, 0], (1 - start[:, 0]) / step[:, 0]], axis=0)
        enter, leave = np.maximum(low, near), np.minimum(high, far)
        return np.where((root > 0) & (enter <= leave) & (enter <= 1), enter, np.inf)

    outer, inner = entry(0.8), entry(0.8 * np.cos(np.pi / 96))
    assert np.isfinite(inner).sum() > 800
    assert np.all(np.isinf(part[np.isinf(outer)]))
    expected = np.isfinite(inner)
    assert np.all((part[expected] >= outer[expected] - 1e-9) & (part[expected] <= inner[expected] + 1e-9))


@few_of((0,), "seed", range(3))
def test_the_tree_finds_what_every_triangle_one_by_one_finds(seed):
    """Triangle soup of all sizes and two rings: the same triangle at the same part of the way, or none."""
    random = np.random.default_rng(seed)
    soup = random.normal(size=(400, 1, 3)) + random.normal(size=(400, 3, 3)) * 10 ** random.uniform(-3, 0, (400, 1, 1))
    rings = merged_surfaces(
        [torus(2.0, 0.5), torus(1.5, 0.2).transformed(pose_rotation(1.0, 0.5, 0.3), np.array([0.3, 0, 0]))]
    )
    corners = np.concatenate([soup, rings.corners[::5]])
    start, stop = ways(seed, 600)
    part, triangle = cast_rays(triangle_tree(corners, np.zeros(len(corners), np.int32)), start, stop)
    expected, row = np.full(len(start), np.inf), np.full(len(start), -1)
    for n, (a, b, c) in enumerate(corners):
        with np.errstate(all="ignore"):
            solution = np.linalg.solve(
                np.stack([np.broadcast_to(b - a, start.shape), np.broadcast_to(c - a, start.shape), start - stop], -1),
                (start - a)[:, :, None],
            )[:, :, 0]
        hit = (
            (solution[:, :2].min(axis=1) >= 0)
            & (solution[:, :2].sum(axis=1) <= 1)
            & (solution[:, 2] >= 0)
            & (solution[:, 2] <= 1)
        )
        nearer = hit & (solution[:, 2] < expected)
        expected[nearer], row[nearer] = solution[nearer, 2], n
    np.testing.assert_array_equal(triangle, row)
    np.testing.assert_allclose(part, expected, rtol=1e-9)
    assert np.isfinite(expected).sum() > 200


def test_no_ray_slips_through_between_two_triangles():
    """From inside a closed surface every way out is stopped, also those aimed at its corners and edges."""
    ball = sphere(2.0, steps=24)
    edges = (ball.corners + np.roll(ball.corners, 1, axis=1)).reshape(-1, 3) / 2
    aimed = 2 * np.concatenate([ball.vertices, edges])
    part, _ = cast_rays(tree(ball), np.full_like(aimed, 1e-3), aimed)
    assert np.all(np.isfinite(part))


@pytest.mark.parametrize("place", [(0.0, 150.5), (3.0, -40.0)])
@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_a_block_of_triangles_hides_what_a_box_hides(place, heading):
    """The nominal box as a plate of its thickness, standing on the bed: every leg to order 4, none of 9000 differs."""
    size = {"position": place, "heading": heading}
    boxes = world({"shape": "box", "size": (2, 1, 1), **size})
    plates = world({"shape": "plate", "length": 2, "width": 1, "thickness": 1, **size})
    random = np.random.default_rng(5)
    away = np.array([*place, 0]) + random.uniform([-4, -4, 0], [4, 4, 20], (1000, 3))
    away[:, :2] += random.uniform(0, 0.15, (1000, 1)) * np.array(place)
    away[:500, 2] = 20
    legs = [image_legs(scene, SONAR, points(away), families_up_to(4), 100e3) for scene in (boxes, plates)]
    np.testing.assert_array_equal(legs[0].status, legs[1].status)
    np.testing.assert_array_equal(legs[0].occluder, legs[1].occluder)
    assert (legs[0].status == LegStatus.OCCLUDED).sum() > 300


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "standing"])
def test_the_shadow_of_a_round_body_ends_where_its_tangent_lands(kind):
    """Sonar a height h above the bed, x away from where a body of radius a touches it.

    Tangents of a circle on the bed: (h - 2a) d^2 - 2 a x d - h a^2 = 0 for the shadow's end d behind; a standing
    cylinder of height t ends it at (x + a) t / (h - t) behind its far edge. Within the 1.1 mm of the steps.
    """
    h, x, a = 9.0, 100.0, 0.5
    target = {
        "sphere": {"shape": "sphere", "diameter": 1.0},
        "cylinder": {"shape": "cylinder", "diameter": 1.0, "length": 4.0},
        "standing": {"shape": "cylinder", "diameter": 1.0, "length": 1.5, "pitch": np.pi / 2},
    }[kind]
    scene = world({"position": (0.0, x), **target})
    end = x + (a * x + np.sqrt(a**2 * x**2 + (h - 2 * a) * h * a**2)) / (h - 2 * a)
    if kind == "standing":
        end = x + a + (x + a) * 1.5 / (h - 1.5)
    along = np.arange(x - 2, end + 1, 0.005)
    place = np.column_stack([np.zeros_like(along), along, np.full_like(along, 20.0)])
    legs = image_legs(scene, SONAR, points(place, "seabed"), ("D",), 100e3)
    hidden = along[legs.status[0] == LegStatus.OCCLUDED]
    assert hidden.max() == pytest.approx(end, abs=0.025)
    begin = x - a if kind == "standing" else x - np.tan(np.arctan(h / x) / 2) * a
    assert hidden.min() == pytest.approx(begin, abs=0.02)
    assert len(hidden) == pytest.approx((hidden.max() - hidden.min()) / 0.005 + 1, abs=1)


@few_of((0, 1), "seed", range(4))
def test_a_folded_leg_is_cut_where_a_walk_along_it_enters_the_body(seed):
    """A leaning ring in 8 m of water, random sonars and points, orders to 3, against walks along the folded paths.

    Inside is where ((rho - R) / r)^2 + (z / w)^2 < 1 in the ring's axes; its 24 steps about the tube cut 1 % off. Walks
    that come between 0.9 and 1.02 decide nothing, and are fewer than one in ten.
    """
    random = np.random.default_rng(seed)
    lie = dict(zip(("heading", "pitch", "roll"), random.uniform(-1.2, 1.2, 3), strict=True))
    scene = world({"shape": "tyre", "size": (3.5, 3.5, 1.2), "position": (0, 0), "base_depth": 5.5, **lie}, depth=8.0)
    surface = world_triangles(scene.solids[0], scene.seabed)
    turn, middle = pose_rotation(**lie), (surface.low + surface.high) / 2
    thick = 0.113 / 0.632 * 1.75
    sonar = np.array([-7.0, random.uniform(-1, 1), random.uniform(1, 7)])
    place = np.column_stack([random.uniform(2.5, 8, 40), random.uniform(-2, 2, 40), random.uniform(0.2, 7.8, 40)])
    legs = image_legs(scene, sonar, points(place), families_up_to(3), 100e3)
    cut, undecided = 0, 0
    for row, family in enumerate(legs.families):
        for n, end in enumerate(place):
            corners = fold(sonar, end, family, 8.0).corners
            part = np.linspace(0, 1, 3000)[:, None]
            walk = np.concatenate([a + part * (b - a) for a, b in pairwise(corners)])
            x, y, z = ((walk - middle) @ turn).T
            deepest = np.min(((np.hypot(x, y) - 1.75 + thick) / thick) ** 2 + (z / 0.6) ** 2)
            occluded = legs.status[row, n] == LegStatus.OCCLUDED
            if 0.9 < deepest < 1.02:
                undecided += 1
            else:
                assert occluded == (deepest < 1), (family, end, deepest)
            cut += occluded
    assert 30 < cut < legs.status.size - 30
    assert undecided < 0.1 * legs.status.size


def test_a_body_shadows_itself():
    """A ring on edge: of the inner side of its far half only what is seen past the near half; a sphere hides nothing.

    Points of a convex body that look at the sonar are all seen.
    """
    ball = world({"shape": "sphere", "position": (0, 60), "diameter": 2})
    whole = solid_scatterers(ball.solids[0], ball.seabed, 1, 0.05, 0)
    direct = image_legs(ball, SONAR, whole, ("D", "S"), 100e3)
    assert not np.any(direct.status == LegStatus.OCCLUDED)
    assert np.all((direct.status == LegStatus.FACING_AWAY) == (direct.grazing_sine <= 0))
    ring = world(
        {"shape": "tyre", "size": (4, 4, 1), "position": (0, 60), "base_depth": 13, "pitch": np.pi / 2, "heading": 0.2}
    )
    points_on = solid_scatterers(ring.solids[0], ring.seabed, 1, 0.05, 0)
    legs = image_legs(ring, SONAR, points_on, ("D",), 100e3)
    inwards = (points_on.normal[:, 1] < -0.3) & (points_on.position[:, 1] > 60)
    assert inwards.sum() > 100
    assert 0.1 < (legs.status[0][inwards] == LegStatus.OCCLUDED).mean() < 0.9
    assert np.all(legs.occluder[0][legs.status[0] == LegStatus.OCCLUDED] == 0)


def test_the_record_names_the_first_of_those_that_cut_a_leg():
    """Boxes come first among the occluders, then solids in the order of the scene, however their tree is built."""
    wall = {"shape": "plate", "length": 4, "width": 0.1, "thickness": 2}
    scene = world(
        {**wall, "label": "far", "position": (0, 60)},
        {**wall, "label": "near", "position": (0, 50)},
        {"shape": "box", "label": "aside", "position": (10, 50), "size": (1, 1, 1)},
    )
    assert [target.label for target in scene.occluders] == ["aside", "far", "near"]
    place = np.array([[0, 61, 19.9], [0, 55, 19.9], [30, 60, 19.9], [10, 52, 20]])
    legs = image_legs(scene, SONAR, points(place), ("D",), 100e3)
    np.testing.assert_array_equal(legs.occluder[0], [1, 2, -1, 0])
    np.testing.assert_array_equal(legs.status[0] == LegStatus.OCCLUDED, [True, True, False, True])


def test_a_scene_moved_as_a_whole_hides_the_same():
    """Turned by any angle and shifted by 100 km: the same legs are cut."""
    targets = [
        {"shape": "anchor", "position": (3, 40), "heading": 0.4, "pitch": 0.2},
        {"shape": "rock", "position": (-2, 44), "size": (3, 2, 2)},
    ]
    random = np.random.default_rng(2)
    place = random.uniform([-6, 38, 17], [8, 60, 20], (3000, 3))
    turn, shift = 1.1, np.array([1e5, -1e5])
    rotation = pose_rotation(turn)
    moved = [
        {
            **t,
            "position": tuple(rotation[:2, :2] @ np.array(t["position"]) + shift),
            "heading": t.get("heading", 0) + turn,
        }
        for t in targets
    ]
    away = np.array([*shift, 0])
    here = image_legs(world(*targets), SONAR, points(place), families_up_to(2), 1e5)
    there = image_legs(
        world(*moved), rotation @ SONAR + away, points(place @ rotation.T + away), families_up_to(2), 1e5
    )
    assert (here.status == LegStatus.OCCLUDED).sum() > 200
    assert (here.status != there.status).mean() < 1e-4
    np.testing.assert_allclose(there.delay, here.delay, rtol=1e-9)


def test_a_refracted_path_is_cut_like_its_chords():
    """Paths in seven straight pieces meet what legs without a bounce meet; a detour over the body hits nothing."""
    scene = world({"shape": "rock", "position": (0, 50), "size": (3, 3, 3)})
    random = np.random.default_rng(4)
    place = random.uniform([-4, 48, 15], [4, 60, 20], (500, 3))
    legs = image_legs(scene, SONAR, points(place), ("D",), 100e3)
    part = np.linspace(0, 1, 8)[:, None]
    straight = SONAR + part * (place[:, None] - SONAR)
    np.testing.assert_array_equal(occluders_of_paths(scene, straight), legs.occluder[0])
    over = np.stack([np.tile(SONAR, (500, 1)), place - [0, 0, 12], place - [0, 0, 9]], axis=1)
    assert (legs.occluder[0] == 0).sum() > 50
    assert np.all(occluders_of_paths(scene, over) == -1)
    assert np.all(occluders_of_paths(world(), straight) == -1)


def test_threads_that_need_a_tree_at_once_build_it_once(monkeypatch):
    """Of two threads that occlude paths of one scene, the second waits for the tree: half the work and memory."""
    rock = {"shape": "library", "name": "rock", "position": (3.0, 25.0)}
    scene, built, both = world(rock), [], Barrier(2)

    def slow_tree(*arguments):
        built.append(1)
        sleep(0.2)
        return triangle_tree(*arguments)

    def occluders(_):
        both.wait()
        return occluders_of_paths(scene, np.zeros((1, 2, 3)))

    monkeypatch.setattr(solid_shadows, "triangle_tree", slow_tree)
    with ThreadPoolExecutor(2) as pool:
        assert [found.tolist() for found in pool.map(occluders, range(2))] == [[-1], [-1]]
    assert len(built) == 1
