"""Claims about elements: where they are, what they have wrong, and which pattern is theirs alone."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import beams
from insonify.sonar.element_array import ArcArray, ElementArray
from insonify.sonar.hydrophones import ElementErrors, element_layout, filled_aperture, hydrophones, single_element
from insonify.sonar.sonar import channel_positions
from oracles.arrays import elements_scenario, line_of

PERFECT = ElementErrors()


def test_elements_of_a_line_go_from_left_to_right_about_its_middle():
    """Four in 0.4 m: centres at -0.15 to 0.15 m, evenly."""
    place, facing = element_layout(LineArray(length=0.4, elements=4))
    np.testing.assert_allclose(place, [[0, y, 0] for y in (-0.15, -0.05, 0.05, 0.15)], atol=1e-12)
    assert not facing.any()


def test_elements_of_a_panel_go_row_by_row_from_the_top():
    """Two rows of three: the first three are the upper ones."""
    place, _ = element_layout(PlanarArray(width=0.3, height=0.2, columns=3, rows=2))
    np.testing.assert_allclose(place[:3], [[0, y, -0.05] for y in (-0.1, 0, 0.1)], atol=1e-12)
    np.testing.assert_allclose(place[3:, 2], 0.05)


@pytest.mark.parametrize("array", [PointTransducer(), LineArray(length=1.0), PlanarArray(width=1.0, height=0.1)])
def test_what_has_no_elements_is_one(array):
    """A continuous aperture receives as one element at its centre, with its whole pattern."""
    place, _ = element_layout(array)
    np.testing.assert_array_equal(place, np.zeros((1, 3)))
    assert type(single_element(array)) is type(array)


def test_the_product_theorem_joins_an_element_and_its_places():
    """The beam of a line of pistons is one element's pattern times the mean of the phases at their places: 1e-6."""
    frequency, c = 100e3, 1500.0
    line = LineArray(length=0.12, elements=6, element="piston")
    angle = np.radians(np.linspace(-70, 70, 57))
    way = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    place, _ = element_layout(line)
    phases = np.exp(2j * np.pi * frequency / c * way @ place.T).mean(axis=1)
    one = beams(single_element(line), frequency, c).gain(way)[0]
    np.testing.assert_allclose(beams(line, frequency, c).gain(way)[0], (one * phases).real, atol=1e-6)


def test_errors_are_drawn_as_reported_and_once():
    """10,000 elements: rms gain 1 dB, phase 0.2 rad, place 1 mm on each axis, to 3 % (4 standard errors)."""
    array = LineArray(length=100.0, elements=10_000)
    worn = hydrophones(array, ElementErrors(gain_db=1.0, phase=0.2, position=1e-3), seed=4)
    place, _ = element_layout(array)
    assert np.std(20 * np.log10(np.abs(worn.response))) == pytest.approx(1.0, rel=0.03)
    assert np.std(np.angle(worn.response)) == pytest.approx(0.2, rel=0.03)
    np.testing.assert_allclose(np.std(worn.positions - place, axis=0), 1e-3, rtol=0.03)
    again = hydrophones(array, ElementErrors(gain_db=1.0, phase=0.2, position=1e-3), seed=4)
    np.testing.assert_array_equal(worn.response, again.response)
    other = hydrophones(array, ElementErrors(gain_db=1.0), seed=4, side=1)
    assert not np.allclose(np.abs(worn.response), np.abs(other.response))  # each side has errors of its own


def test_perfect_elements_respond_with_one_and_dead_ones_nothing():
    """No errors: exactly 1; the dead are zero whatever else is wrong."""
    array = LineArray(length=0.4, elements=4)
    np.testing.assert_array_equal(hydrophones(array, PERFECT, seed=1).response, np.ones(4))
    response = hydrophones(array, ElementErrors(gain_db=2.0, dead=(0, 3)), seed=1).response
    assert response[0] == response[3] == 0 and np.all(response[1:3] != 0)


def test_a_dead_element_that_is_not_there_is_refused():
    """Four elements: 0 to 3."""
    with pytest.raises(ValidationError, match="is no element; there are 0 to 3"):
        elements_scenario([(0, 20, 5)], receiver={"errors": {"dead": [4]}})


def test_an_array_resolves_what_its_aperture_does():
    """The aperture that decides on sampling: of places, their extent and an element's size."""
    pair = ElementArray(positions=((0, -0.5, 0), (0, 0.5, 0.2)), size=(0.1, 0.0))
    whole = filled_aperture(pair)
    assert isinstance(whole, PlanarArray) and (whole.width, whole.height) == pytest.approx((1.1, 0.2))
    line = LineArray(length=0.4, elements=4, steer=(0.3,))
    assert filled_aperture(line).steer == (0.0,)


def test_channels_state_their_positions_on_the_platform():
    """Facing starboard, an array's right is astern; each channel stands at its element, lever arm included."""
    scenario = elements_scenario([(0, 20, 5)], receive={**line_of(3, 0.3), "offset": (1.0, 2.0, 0.5)})
    np.testing.assert_allclose(channel_positions(scenario.sonar), [[1 + x, 2, 0.5] for x in (0.1, 0, -0.1)], atol=1e-12)


def test_both_sides_are_mirror_images():
    """Port elements stand where the mirror in the keel puts the starboard ones, for arrays of any places."""
    array = {"kind": "elements", "positions": [(0.1, 0.2, 0.0), (0.0, -0.1, 0.05)], "orientations": ["10 deg", "0 deg"]}
    scenario = elements_scenario([(0, 20, 5)], receive={**array, "element": "omni", "offset": (0, 1, 0)})
    both = scenario.sonar.model_copy(update={"sides": ("port", "starboard")})
    port, starboard = np.split(channel_positions(both), 2)
    np.testing.assert_allclose(port, starboard * [1, -1, 1], atol=1e-12)
    assert ArcArray(radius=0.2, arc_angle=1.0, elements=3).mirror_image_fields() == {}
