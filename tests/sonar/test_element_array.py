"""Claims about arrays given element by element."""

from contextlib import nullcontext

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.sonar.element_array import ArcArray, ElementArray
from oracles.arrays import elements_scenario


def test_elements_of_an_arc_stand_on_it_and_face_outwards():
    """All at the radius, evenly from one end to the other, each facing along its own radius."""
    arc = ArcArray(radius=0.2, arc_angle=np.radians(120), elements=7)
    place, facing = np.array(arc.positions), np.array(arc.orientations)
    np.testing.assert_allclose(np.linalg.norm(place, axis=1), 0.2)
    np.testing.assert_allclose(np.arctan2(place[:, 1], place[:, 0]), facing)
    np.testing.assert_allclose(np.degrees(np.diff(facing)), 20.0)
    assert facing[3] == pytest.approx(0.0)


def test_two_elements_at_one_place_are_refused():
    """By name of the second, with that of the first."""
    with pytest.raises(ValidationError, match="is that of element 0 as well"):
        ElementArray(positions=((0, 0, 0), (0, 0.1, 0), (0, 0, 0)))


def test_elements_hardly_apart_are_found_whatever_lies_between_their_depths():
    """First and last 2 um apart in depth, with another one between them that lies far aside."""
    with pytest.raises(ValidationError, match=r"positions\.2.*is that of element 0 as well"):
        ElementArray(positions=((0, 0, 0), (0, 0.1, 1e-6), (0, 0, 2e-6)))
    assert len(ElementArray(positions=((0, 0, 0), (0, 0.1, 1e-6), (0, 0, 2e-5))).positions) == 3


def test_every_element_has_one_facing():
    """Two places and three angles do not go together."""
    with pytest.raises(ValidationError, match="3 angles for 2 positions"):
        ElementArray(positions=((0, 0, 0), (0, 0.1, 0)), orientations=(0.0, 0.1, 0.2))


def test_an_arc_does_not_bite_its_tail():
    """A full turn puts the last element on the first."""
    with pytest.raises(ValidationError, match="the last on the first"):
        ArcArray(radius=0.2, arc_angle=2 * np.pi, elements=8)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"receive": {"kind": "arc", "radius": 0.2, "arc_angle": 1.0, "elements": 4}, "receiver": {"record": "beams"}},
         "has elements but no beams"),
        ({"transmit": {"kind": "arc", "radius": 0.2, "arc_angle": 1.0, "elements": 4}}, "is for receiving"),
        ({"receiver": {"record": "beams", "errors": {"gain_db": 1}}}, "are those of single elements"),
        ({"transmit": {"kind": "line", "length": 0.1, "steer": [0.0, 0.1]}}, "elements receive one transmission"),
    ],
)  # fmt: skip
def test_what_elements_cannot_do_is_reported(settings, message):
    """Each with the key to change."""
    with pytest.raises(ValidationError, match=message):
        elements_scenario([(0, 20, 5)], **settings)


def test_an_element_is_ten_metres_at_most():
    """Larger ones, whose noise would take minutes to correlate, are refused with the range."""
    for size, fits in ((10.0, True), (10.1, False)):
        with (
            nullcontext()
            if fits
            else pytest.raises(ValueError, match=r"size\.1: 10\.1 m is out of range \(0 to 10 m\)")
        ):
            ElementArray(positions=((0, 0, 0), (0, 0.2, 0)), size=(0.5, size))
