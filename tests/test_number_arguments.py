"""Numbers as arguments: accepted in any type that means a number, refused by name in any other."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import insonify
from insonify.scenario.scenario import Scenario
from insonify.thread_count import thread_count
from insonify.validity import as_floats, require_grazing_angle, require_number, require_numbers, require_sound_speed


@pytest.mark.parametrize(
    "value", [3, 3.0, np.float32(3), np.int8(3), [3], (3.0,), np.array([[3]]), Fraction(3), [Fraction(3), 3]]
)
def test_whatever_is_a_number_is_one(value):
    """Integers, floats of any width, fractions, lists of them."""
    found = as_floats(value)
    assert found is not None and found.dtype == np.float64 and np.all(found == 3)
    assert found.shape == np.shape(value)


@pytest.mark.parametrize(
    "value", ["3", None, True, [True], {"a": 3}, [1, [2, 3]], b"3", 3j, Decimal(3), 10**400, object()]
)
def test_whatever_is_none_is_not_taken_for_one(value):
    """Words, truth values, nothing, ragged rows, complex numbers."""
    assert as_floats(value) is None
    with pytest.raises(ValueError, match=r"depth is .*; give a finite number"):
        require_numbers("depth", value, "m")


def test_a_masked_value_is_a_gap():
    """What a measurement has masked is NaN, and stays so."""
    held = np.ma.masked_array([1.0, 2.0, 3.0], mask=[False, True, False])
    np.testing.assert_array_equal(as_floats(held), [1, np.nan, 3])
    np.testing.assert_array_equal(require_numbers("depth", held, "m", 0.0), [1, np.nan, 3])


@given(st.floats(-10, 10))
def test_limits_belong_to_the_range_unless_they_are_distinguished(value):
    """0 or more; and above 0, where 0 itself means nothing."""
    for above in (False, True):
        if value > 0 or (value == 0 and not above):
            assert require_number("depth", value, "m", 0.0, exclude_low=above) == value
        else:
            with pytest.raises(ValueError, match="depth is"):
                require_number("depth", value, "m", 0.0, exclude_low=above)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"low": 0.0, "high": 40.0}, "give a finite number (g/kg), 0 to 40"),
        ({"low": 0.0, "high": 40.0, "exclude_low": True}, "give a finite number (g/kg), above 0, to 40"),
        ({"low": 0.0}, "give a finite number (g/kg), 0 or more"),
        ({"low": 0.0, "exclude_low": True}, "give a finite number (g/kg), above 0"),
        ({"example": "35"}, "give a finite number (g/kg), such as 35"),
    ],
)
def test_a_refusal_states_what_would_do(limits, message):
    """The limits, the unit, an example."""
    with pytest.raises(ValueError, match="salinity is -inf") as caught:
        require_numbers("salinity", -np.inf, "g/kg", **limits)
    assert message in str(caught.value)


def test_the_first_of_many_wrong_values_is_shown_and_long_ones_are_cut():
    """One value, not a page of them."""
    with pytest.raises(ValueError, match="depth is -2 m"):
        require_numbers("depth", [1, -2, -3], "m", 0.0)
    with pytest.raises(ValueError, match=r"depth is .{50,60}\.\.\.;"):
        require_numbers("depth", "many words " * 20, "m")


@pytest.mark.parametrize("gap", [np.nan, [1.0, np.nan]])
def test_gaps_pass_where_they_may_and_not_where_they_may_not(gap):
    """A measurement has gaps; a setting has none."""
    assert np.isnan(require_numbers("depth", gap, "m", 0.0)).any()
    with pytest.raises(ValueError, match="depth is nan"):
        require_numbers("depth", gap, "m", 0.0, allow_nan=False)


@pytest.mark.parametrize("value", [[1.0], [[1.0]], [], np.nan, np.inf])
def test_one_number_is_one(value):
    """A list of one is a list, and a gap is no setting."""
    with pytest.raises(ValueError, match="depth is"):
        require_number("depth", value, "m")


@given(st.floats(0, np.pi / 2))
def test_grazing_angles_pass_unchanged(angle):
    """From the plane of the interface to a right angle."""
    assert require_grazing_angle("grazing", angle) == angle


def test_grazing_angles_are_forgiven_their_rounding_and_nothing_more():
    """What an arcsine leaves over is clipped; a degree too much is refused."""
    assert require_grazing_angle("grazing", -1e-12) == 0.0
    assert require_grazing_angle("grazing", np.pi / 2 + 1e-12) == np.pi / 2
    for wrong in (-0.02, 1.6, 20.0):
        with pytest.raises(ValueError, match=r"np\.radians"):
            require_grazing_angle("grazing", wrong)


@pytest.mark.parametrize(("speed", "fine"), [(1500, True), (1200, True), (343, True), (299, False), (5001, False)])
def test_a_sound_speed_of_a_liquid(speed, fine):
    """Water, other liquids, even air pass; a value in km/s does not."""
    if fine:
        assert require_sound_speed("sound_speed", speed) == speed
    else:
        with pytest.raises(ValueError, match="sound_speed is"):
            require_sound_speed("sound_speed", speed)
    with pytest.raises(ValueError, match=r"sound_speed is 1\.5 m/s"):
        require_sound_speed("sound_speed", 1.5)


@pytest.mark.parametrize("threads", [-1, 0, 1.5, "2", True])
def test_threads_are_a_whole_number_of_one_or_more(threads):
    """Others are refused by name, before anything is simulated; none given is one on each core."""
    with pytest.raises(ValueError, match=r"^threads is .*; give a whole number"):
        insonify.levels(Scenario.model_validate(SMALL), threads=threads)
    assert thread_count(None) >= 1 and thread_count(np.int64(3)) == 3


SMALL = {
    "seabed": {"depth": 5},
    "sonar": {"source_level_db": 200, "pulse": {"kind": "cw", "frequency": 1e5, "duration": 2e-4},
              "transmit": {"kind": "point"}, "receive": {"kind": "point"}},
    "track": {"kind": "static", "position": [0, 0, 1], "window": [0.0, 0.004]},
}  # fmt: skip
