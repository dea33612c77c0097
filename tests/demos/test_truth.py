"""Claims about the truth beside a product: the first surface from above, against spheres, boxes and planes."""

import numpy as np
import pytest

from insonify.demos.products.true_depths import depth_from_above, is_clear_of_targets
from insonify.plotting.target_view import half_extent, middle
from insonify.scene.solid import seabed_depth_at
from insonify.scene.triangle_surfaces import CIRCLE_STEPS
from oracles.scenes import nominal, point

BED = 20.0
SPHERE = {"shape": "sphere", "label": "ball", "position": (3.0, 40.0), "diameter": 2.0}
BOX = {"shape": "box", "label": "box", "position": (-4.0, 30.0), "size": (3.0, 1.0, 0.8), "heading": np.radians(30)}
RIPPLES = {"relief": [{"kind": "ripples", "wavelength": 3.0, "height": 0.2, "direction": 0.6}]}
SCENE = nominal(targets=[SPHERE, BOX, point(0.0, 35.0, 15.0)])
BOXED = nominal(targets=[BOX])
RANDOM = np.random.default_rng(8)


def test_a_sphere_is_as_high_as_pythagoras_predicts():
    """Top at r + sqrt(r^2 - d^2) over the bed it lies on, to what its facets leave, at 200 places.

    A chord of a step of 2 pi / 96 stays within r (pi / 96)^2 / 2 of the sphere along the normal, which leans.
    """
    away, bearing = np.sqrt(RANDOM.uniform(0, 0.96, 200)), RANDOM.uniform(0, 2 * np.pi, 200)
    lean = np.sqrt(1 - away**2)
    found = depth_from_above(SCENE, 3 + away * np.cos(bearing), 40 + away * np.sin(bearing))
    assert (np.abs(found - (BED - 1 - lean)) < 2 * (np.pi / CIRCLE_STEPS) ** 2 / lean).all()


def test_a_box_is_high_inside_its_outline_and_nowhere_else():
    """In its own axes: 0.8 m over the bed where it stands, the bed beside it, at 400 places about it."""
    along, across, turn = RANDOM.uniform(-2, 2, 400), RANDOM.uniform(-1, 1, 400), np.radians(30)
    north = -4 + along * np.cos(turn) - across * np.sin(turn)
    east = 30 + along * np.sin(turn) + across * np.cos(turn)
    inside = (np.abs(along) < 1.5) & (np.abs(across) < 0.5)
    np.testing.assert_allclose(depth_from_above(SCENE, north, east), np.where(inside, BED - 0.8, BED), atol=1e-9)


def test_points_have_no_height():
    """Over a point target there is water: the bed is reached first that echoes from above see as ground."""
    assert float(depth_from_above(SCENE, 0.0, 35.0)) == BED


def test_targets_stand_on_the_relief_and_the_rest_is_relief():
    """Beside targets the ripples themselves; nowhere is anything deeper than the bed."""
    scenario = nominal(targets=[SPHERE, BOX], seabed=RIPPLES)
    north, east = np.meshgrid(np.linspace(-8, 8, 41), np.linspace(25, 45, 51), indexing="ij")
    bed = seabed_depth_at(scenario.scene.seabed, np.stack([north, east], axis=-1))
    top = depth_from_above(scenario, north, east)
    assert np.ptp(bed) > 0.15 and (top <= bed + 1e-9).all()
    clear = (np.hypot(north - 3, east - 40) > 1.01) & (np.hypot(north + 4, east - 30) > 1.6)
    np.testing.assert_array_equal(top[clear], bed[clear])
    assert (top < bed - 0.1).sum() > 20


@pytest.mark.parametrize("margin", [0.5, 2.0])
def test_ground_is_beside_a_box_from_its_margin_on(margin):
    """No ground within the margin of a box counts, and all ground further away does, but for what 12 directions miss.

    They miss a flat side by 1 - cos 15 deg of the margin, and a corner by its sine.
    """
    away = RANDOM.uniform(0.05, 4, 300)
    side, place = RANDOM.choice([-1, 1], 300), RANDOM.uniform(-1.2, 1.2, 300)
    across = side * (0.5 + away)  # abeam of the long sides, away from their ends
    turn = np.radians(30)
    north = -4 + place * np.cos(turn) - across * np.sin(turn)
    east = 30 + place * np.sin(turn) + across * np.cos(turn)
    found = is_clear_of_targets(BOXED, north, east, margin)
    assert found[away > margin].all()
    inside = (away < 0.96 * margin) & (away > margin - 0.9) & (np.abs(place) < 1.5 - 0.3 * margin)
    assert inside.sum() > 10 and not found[inside].any()


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_the_middle_of_a_body_is_above_the_bed_by_half_its_height(turn):
    """And half of its horizontal diagonal is how far it reaches: the box by its corners, whatever its heading."""
    scene = nominal(targets=[{**BOX, "heading": turn}]).scene
    (box,) = scene.targets
    assert middle(box, scene)[2] == pytest.approx(BED - 0.4, abs=1e-6)
    assert half_extent(box, scene) == pytest.approx(np.hypot(3.0, 1.0) / 2, rel=1e-6)
