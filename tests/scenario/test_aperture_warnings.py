"""Arrays out of focus and elements at one position get a warning with numbers; usual ones get none."""

import warnings

import pytest

from insonify.validity import PhysicsWarning
from oracles.scenes import nominal

SHORT = {"window": (0.01, 0.03)}


def words(**settings):
    """Warnings of a scenario."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", PhysicsWarning)
        nominal(**settings)
    return " ".join(str(one.message) for one in caught)


@pytest.mark.parametrize(("length", "message"), [(0.8, False), (1.15, False), (1.17, True), (5.0, True)])
def test_an_array_in_whose_near_field_everything_lies_is_reported(length, message):
    """22.5 m at 15 mm: a quarter of L^2 / wavelength is passed at 1.16 m."""
    found = words(line={"length": length}, track=SHORT)
    assert ("beams are far-field patterns" in found) == message
    if length == 5.0:
        assert "hold from about 1.67e+03 m on, and the recording ends at 22.5 m" in found


def test_elements_that_are_recorded_may_be_focused():
    """A receiving array of any length, if each of its elements is a channel and the transmitter is small."""
    settings = {"line": {"length": 0.1}, "receive": {"length": 5.0, "elements": 8}, "track": SHORT}
    assert "far-field" not in words(**settings, sonar={"receiver": {"record": "elements"}})
    assert "far-field" in words(**settings)


@pytest.mark.parametrize(("elements", "message"), [(100, False), (4000, True)])
def test_elements_at_one_place_are_reported(elements, message):
    """Over 6 cm: 0.6 mm apart is a twenty-fifth of a wavelength, 15 um a thousandth."""
    settings = {"receive": {"length": 0.06, "elements": elements}, "sonar": {"receiver": {"record": "elements"}}}
    assert (
        "wavelengths: they receive the same sound" in words(line={"length": 0.1}, **settings, track=SHORT)
    ) == message
