"""Positions of targets in the water that are allowed."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ({"shape": "point", "position": (0, 50, 21)}, "below the seabed"),
        ({"shape": "point", "position": (0, 50, 0)}, "at or above the sea surface"),
        (
            {"shape": "box", "position": (0, 50), "size": (1, 1, 1), "base_depth": -5},
            "base_depth: -5 m is at or above the sea surface",
        ),
        ({"shape": "box", "position": (0, 50), "size": (1, 1, 1), "base_depth": 25}, "below the seabed"),
        ({"shape": "box", "position": (0, 50), "size": (1, 1, 1), "label": "seabed"}, "label of its own"),
    ],
)
def test_a_target_stands_in_the_water_with_a_name_of_its_own(target, message):
    """Anything else is refused in words."""
    with pytest.raises(ValidationError, match=message):
        Scene(targets=[target])


def test_two_targets_do_not_share_a_label():
    """Labels name the object of an echo."""
    box = {"shape": "box", "position": (0, 50), "size": (1, 1, 1)}
    with pytest.raises(ValidationError, match="label of its own"):
        Scene(targets=[box, box])


@pytest.mark.parametrize(
    ("place", "received"),
    [((0, 50, 19.5), False), ((0.9, 50.4, 19.1), False), ((0, 50, 20), False), ((0, 50, 18.9), True),
     ((1.1, 50, 19.5), True), ((0, 50.6, 19.5), True), ((0, 50, 19), True), ((1, 50, 19.5), True)],
)  # fmt: skip
def test_a_point_inside_a_box_is_never_received_and_is_refused(place, received):
    """Outside it is received, and on its faces, but not under its foot."""
    box = {"shape": "box", "position": (0, 50), "size": (2, 1, 1)}
    point = {"shape": "point", "position": place}
    if received:
        Scene(targets=[point, box])
    else:
        with pytest.raises(ValidationError, match=r"targets\.0\.position: the point is inside box"):
            Scene(targets=[point, box])


def test_only_boxes_cast_shadows():
    """A point has no body."""
    scene = Scene(targets=[
        {"shape": "point", "position": (0, 40, 10)}, {"shape": "box", "position": (0, 50), "size": (2, 1, 1)},
    ])  # fmt: skip
    assert scene.bodies.shape == (1, 8)
    assert Scene().bodies.shape == (0, 8)


def test_the_surface_turns_the_sign_and_the_bed_has_its_coefficient():
    """-1 at any angle above; the given number, or the sediment's, below."""
    angle = np.radians([1, 20, 90])
    np.testing.assert_array_equal(Scene().surface.reflection_coefficient(angle), -np.ones(3))
    np.testing.assert_array_equal(
        Scene(seabed={"reflection": 0.35}).seabed.reflection_coefficient(angle), np.full(3, 0.35)
    )
    sand = Scene(seabed={"reflection": "medium sand"}).seabed.reflection_coefficient(angle)
    assert abs(sand[0]) > 0.95 and sand[0].real < 0 < sand[2].real


def test_a_point_target_is_one_scatterer_that_keeps_its_phase():
    """No draw, no normal, the target strength as its cross section."""
    one = point_scatterer(PointTarget(position=(1, 2, 3), target_strength_db=-10))
    assert len(one) == 1 and not one.has_random_phase
    angles = np.zeros(1)
    np.testing.assert_allclose(one.law.cross_section(angles, angles, angles), 0.1)


def test_columns_of_unequal_length_are_refused():
    """At the door, with the wrong column's name."""
    with pytest.raises(ValueError, match="area"):
        Scatterers("seabed", "seabed", PointTargetLaw(), np.zeros((2, 3)), np.zeros((2, 3)), np.ones(3),
                   np.ones(2, complex), np.zeros(2, np.uint64))  # fmt: skip
