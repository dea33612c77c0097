"""Claims about units: what a scenario may write, and what it means."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.model import Decibels, Hertz, Metres, Model, Radians
from insonify.units import UNITS, amplitude_ratio, decibels, intensity_ratio, level_db, si


class Buoy(Model):
    """A thing with one value of each kind."""

    depth: Metres = 3.0
    frequency: Hertz = 1e5
    tilt: Radians = 0.0
    level_db: Decibels = 0.0


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("100 kHz", "frequency", 1e5),
        ("0.2 ms", "time", 2e-4),
        ("35 deg", "angle", np.radians(35)),
        ("1.5e3 m/s", "speed", 1500.0),
        ("2 kn", "speed", 2 * 1852 / 3600),
        ("-1.8 degC", "temperature", -1.8),
        ("20cm", "length", 0.2),
        ("12", "length", 12.0),
    ],
)
def test_words_become_si(text, dimension, value):
    """A number with a unit is that number in SI."""
    assert si(text, dimension) == pytest.approx(value)


@pytest.mark.parametrize("dimension", UNITS)
@given(value=st.floats(-1e6, 1e6))
def test_every_unit_is_a_multiple_of_si(dimension, value):
    """Writing a value in any unit of its dimension scales it by that unit's size."""
    for unit, size in UNITS[dimension].items():
        assert si(f"{value!r} {unit}", dimension) == pytest.approx(value * size, rel=1e-12, abs=1e-12)


def test_a_unit_of_something_else_is_refused():
    """Seconds are not a frequency; the message lists what is."""
    with pytest.raises(ValueError, match="not a unit of frequency; use one of Hz, kHz, MHz"):
        si("3 ms", "frequency")


def test_a_misspelt_unit_is_reported_with_the_right_one():
    """Units are case-sensitive, and the advice reports it by example."""
    with pytest.raises(ValueError, match="did you mean kHz"):
        si("100 khz", "frequency")


@pytest.mark.parametrize("text", ["", "kHz", "ten m", "1,5 m", "nan m", "inf"])
def test_what_is_not_a_number_is_refused(text):
    """Neither words nor NaN pass as a quantity."""
    with pytest.raises(ValueError, match=r"write a number with a unit|is not a unit"):
        si(text, "length")


def test_a_level_may_name_its_reference():
    """The reference after dB is for the reader."""
    assert decibels("220 dB re 1 uPa at 1 m") == 220
    assert decibels("-27 dB") == -27
    with pytest.raises(ValueError, match="use dB"):
        decibels("3 Np")


@given(st.floats(-200, 200))
def test_levels_and_ratios_are_inverse(level):
    """10 log10 of the intensity ratio, and 20 log10 of the pressure ratio, give the level back."""
    assert level_db(intensity_ratio(level)) == pytest.approx(level, abs=1e-9)
    assert level_db(amplitude_ratio(level) ** 2) == pytest.approx(level, abs=1e-9)


def test_silence_has_no_finite_level():
    """Zero intensity is minus infinity decibels, without complaint."""
    assert level_db(0.0) == -np.inf


def test_a_model_takes_words_and_keeps_si():
    """A buoy described in words is the same buoy in SI."""
    spoken = Buoy(depth="300 cm", frequency="0.1 MHz", tilt="90 deg", level_db="3 dB")
    assert spoken == Buoy(depth=3.0, frequency=1e5, tilt=np.pi / 2, level_db=3.0)


@pytest.mark.parametrize("wrong", [{"depht": 3}, {"depth": float("nan")}, {"depth": "3 s"}, {"depth": None}])
def test_a_model_refuses_what_it_does_not_understand(wrong):
    """A misspelt field, NaN, a wrong unit and nothing at all are errors."""
    with pytest.raises(ValueError, match=r"depth|depht"):
        Buoy(**wrong)


def test_a_model_does_not_change():
    """Once described, a thing stays as it is."""
    with pytest.raises(ValueError, match="frozen"):
        Buoy().depth = 4.0


def test_the_article_of_a_dimension_is_right():
    """An angle, a length: one that is no number is named in English."""
    with pytest.raises(ValueError, match=r"'ninety' is not an angle; write a number with a unit"):
        si("ninety", "angle")
    with pytest.raises(ValueError, match=r"'far' is not a length"):
        si("far", "length")
