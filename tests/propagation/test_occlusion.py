"""Shadows of boxes, against walks along the path and against the geometry of similar triangles."""

import numpy as np
import pytest

from insonify.propagation.families import families_up_to
from insonify.propagation.image_sources import image_legs
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.box import box_scatterers
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from oracles.few_of import few_of
from oracles.water import Block, cut, deepest, fold

SONAR = np.array([0.0, 0.0, 11.0])


def points(position, boundary="target"):
    """Points that scatter in all directions."""
    n = len(position)
    return Scatterers(boundary, boundary, PointTargetLaw(), np.asarray(position, float), np.zeros((n, 3)), np.ones(n),
                      np.ones(n, complex), np.arange(n, dtype=np.uint64))  # fmt: skip


def world(box, depth=20.0):
    """A flat world with one box."""
    return Scene(seabed={"depth": depth}, targets=[{"shape": "box", **box}])


@few_of((0, 1, 2), "seed", range(8))
def test_a_leg_is_cut_where_a_walk_along_it_enters_the_box(seed):
    """Random sonars, points, boxes with headings (standing and floating), orders to 4.

    Walking the folded path in steps. Walks that come closer to a face than one step decide nothing, and are fewer
    than one in ten.
    """
    random = np.random.default_rng(seed)
    depth, size = random.uniform(5, 12), random.uniform(1.5, 4, 3)
    base = depth if seed % 2 else random.uniform(size[2] + 0.2, depth)
    centre, heading = random.uniform(-3, 3, 2), random.uniform(0, 2 * np.pi)
    scene = world({"position": tuple(centre), "size": tuple(size), "heading": heading, "base_depth": base}, depth)
    block = Block(tuple(centre), heading, tuple(size[:2] / 2), base - size[2], base)
    away = random.uniform(0, 2 * np.pi)
    sonar = np.array([12 * np.cos(away), 12 * np.sin(away), random.uniform(0.2, 0.95) * depth])
    behind = centre - np.outer(random.uniform(0.1, 0.8, 40), sonar[:2]) + random.uniform(-3, 3, (40, 2))
    places = np.column_stack([behind, random.uniform(0, depth, 40)])
    places[:15, 2] = depth
    places = places[np.abs(block.within(places)).max(axis=1) > 1.0001]
    legs = image_legs(scene, sonar, points(places), families_up_to(4), 100e3)
    hidden, undecided = 0, 0
    for row, family in enumerate(legs.families):
        for n, place in enumerate(places):
            path = fold(sonar, place, family, depth)
            reached = deepest(path, block, 800)
            step = path.length / 800 / (min(*size) / 2)
            occluded = legs.status[row, n] == LegStatus.OCCLUDED
            if 1 <= reached < 1 + step:
                undecided += 1
                assert occluded == cut(path, block)
            else:
                assert occluded == (reached < 1), (family, place, reached)
            hidden += occluded
            assert (legs.occluder[row, n] == 0) == occluded
    assert hidden > 10
    assert undecided < 0.1 * legs.status.size


@pytest.mark.parametrize(("family", "end"), [("D", 169.88), ("S", 156.03), ("BS", 154.15)])
def test_shadows_on_the_bed_end_where_the_ray_over_the_far_edge_lands(family, end):
    """Similar triangles from an image 9, 31 or 49 m above the bed over an edge 1 m high at 151 m: paper's a, b, e."""
    scene = world({"position": (0, 150.5), "size": (6, 1, 1)})
    along = np.arange(149, 175, 0.01)
    place = np.column_stack([np.zeros_like(along), along, np.full_like(along, 20.0)])
    legs = image_legs(scene, SONAR, points(place, "seabed"), families_up_to(2), 100e3)
    hidden = along[legs.status[legs.families.index(family)] == LegStatus.OCCLUDED]
    assert hidden.min() == pytest.approx(150, abs=0.011)
    assert hidden.max() == pytest.approx(end, abs=0.016)
    assert len(hidden) == pytest.approx((hidden.max() - hidden.min()) / 0.01 + 1, abs=1)


@pytest.mark.parametrize("height", [0.25, 0.5, 1.0, 2.0])
def test_the_shadow_grows_with_the_target(height):
    """Length behind the far edge = 151 h / (9 - h), within 1 cm."""
    scene = world({"position": (0, 150.5), "size": (6, 1, height)})
    expected = 151 * height / (9 - height)
    along = 151 + expected + np.array([-0.01, 0.01])
    place = np.column_stack([np.zeros(2), along, np.full(2, 20.0)])
    legs = image_legs(scene, SONAR, points(place, "seabed"), ("D",), 100e3)
    assert list(legs.status[0]) == [LegStatus.OCCLUDED, LegStatus.CLEAR]


def test_the_ground_under_a_box_is_hidden_from_every_family():
    """The bed inside the footprint of a standing box receives nothing, to order 4."""
    scene = world({"position": (0, 150.5), "size": (2, 1, 1), "heading": 0.4})
    along, across = np.meshgrid(np.linspace(-0.95, 0.95, 9), np.linspace(-0.45, 0.45, 9))
    c, s = np.cos(0.4), np.sin(0.4)
    north, east = c * along - s * across, 150.5 + s * along + c * across
    place = np.column_stack([north.ravel(), east.ravel(), np.full(81, 20)])
    legs = image_legs(scene, SONAR, points(place, "seabed"), families_up_to(4), 100e3)
    assert np.all(legs.status == LegStatus.OCCLUDED)
    assert np.all(legs.visibility == 0)


def test_a_box_shows_the_faces_that_look_at_the_sonar_and_hides_none_of_them():
    """Nominal box, direct: the near face whole and nothing of the far face; the top is seen, being below the sonar.

    By surface-bottom bounces of a floating box, the top is seen from above only by paths that come from above.
    """
    scene = world({"position": (0, 150.5), "size": (2, 1, 1)})
    whole = box_scatterers(scene.boxes[0], 20.0, 1, 0.1, 0)
    legs = image_legs(scene, SONAR, whole, families_up_to(4), 100e3)
    east, down = whole.normal[:, 1], whole.normal[:, 2]
    direct = legs.status[0]
    assert np.all(direct[east < -0.5] == LegStatus.CLEAR)
    assert np.all(direct[east > 0.5] == LegStatus.FACING_AWAY)
    assert np.all(direct[down < -0.5] == LegStatus.CLEAR)
    for row, family in enumerate(legs.families):
        from_below = family.endswith("B")
        top = legs.status[row][down < -0.5]
        assert np.all(top == (LegStatus.FACING_AWAY if from_below else LegStatus.CLEAR))
        # On its way to the near face a path by the bottom passes in front of the box, never through it.
        assert np.all(legs.status[row][east < -0.5] == LegStatus.CLEAR)
    side = np.abs(whole.normal[:, 0]) > 0.5
    towards = -np.sign(whole.position[:, 0]) * np.sign(whole.normal[:, 0]) > 0
    assert np.all(direct[side & towards] != LegStatus.OCCLUDED)


def test_another_box_stands_in_the_way():
    """A box in front hides the near face of the one behind, and the record states which it was."""
    scene = Scene(
        targets=[
            {"shape": "box", "label": "behind", "position": (0, 152), "size": (1, 1, 0.5)},
            {"shape": "box", "label": "front", "position": (0, 150), "size": (4, 1, 1.5)},
        ]
    )
    behind = box_scatterers(scene.boxes[0], 20.0, 1, 0.1, 0)
    legs = image_legs(scene, SONAR, behind, ("D",), 100e3)
    near = behind.normal[:, 1] < -0.5
    assert np.all(legs.status[0][near] == LegStatus.OCCLUDED)
    assert np.all(legs.occluder[0][near] == 1)


@few_of((0, 1), "seed", range(4))
def test_a_box_hides_its_own_faces_from_paths_that_went_through_it_before(seed):
    """A floating box seen from close by: a path may pierce it on the way up and come down on its top.

    Every point of every face that looks at its path, to order 4, against clipping each segment of the walk.
    """
    random = np.random.default_rng(seed)
    size, base = random.uniform(1, 3, 3), random.uniform(5, 7)
    heading = random.uniform(0, 2 * np.pi)
    scene = world({"position": (0, 5), "size": tuple(size), "heading": heading, "base_depth": base}, 10.0)
    block = Block((0, 5), heading, tuple(size[:2] / 2), base - size[2], base)
    sonar = np.array([random.uniform(-1, 1), 0.0, random.uniform(1, 9)])
    whole = box_scatterers(scene.boxes[0], 10.0, seed, 0.5, 0)
    legs = image_legs(scene, sonar, whole, families_up_to(4), 100e3)
    hidden = 0
    for row, family in enumerate(legs.families):
        for n, place in enumerate(whole.position):
            path = fold(sonar, place, family, 10.0)
            if path.arrival @ whole.normal[n] >= 0:
                assert legs.status[row, n] == LegStatus.FACING_AWAY
            else:
                assert (legs.status[row, n] == LegStatus.OCCLUDED) == cut(path, block)
                hidden += legs.status[row, n] == LegStatus.OCCLUDED
    assert hidden > 0
