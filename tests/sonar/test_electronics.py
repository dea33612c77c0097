"""Claims about gain that follows the range: it undoes spreading and absorption, within its limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.processing import along_track_gain_db
from insonify.processing import tvg_db as offered
from insonify.sonar.electronics import AnalogToDigitalConverter, Crosstalk, ReceiverGain, SelfNoise
from insonify.sonar.time_varied_gain import MIN_RANGE, tvg_db

LOSS, LAW = st.floats(0, 0.2), st.sampled_from([20.0, 30.0, 40.0])


@given(LAW, LOSS, st.floats(1, 1000), st.floats(1.01, 10))
def test_gain_undoes_the_sonar_equation(law, loss, slant, factor):
    """An echo that spreads by that law and is absorbed out and back has one level at all ranges from 1 m on."""
    ranges = np.array([slant, slant * factor])
    echo = 100 - law * np.log10(ranges) - 2 * loss * ranges
    levels = echo + tvg_db(ranges, law, absorption_db_per_m=loss)
    assert levels[1] - levels[0] == pytest.approx(0, abs=1e-9)


@given(LAW, LOSS, st.floats(0, 1), st.floats(0, 1))
def test_nearer_than_a_metre_gain_stays_as_it_is_there(law, loss, one, other):
    """The law has no end at 0 m: it is followed no further than 1 m."""
    here, there = tvg_db(np.array([one, other]) * MIN_RANGE, law, absorption_db_per_m=loss)
    assert here == there == pytest.approx(2 * loss)


def test_the_law_is_written_once():
    """What a receiver applies is what processing offers for undoing it."""
    assert offered is tvg_db and callable(along_track_gain_db)


@given(st.floats(-50, 50), LAW, LOSS, st.floats(0.001, 0.1), st.floats(0.001, 0.2), st.floats(0, 1))
def test_gain_stands_still_outside_its_window(fixed, law, loss, start, length, beyond):
    """Before its start as at its start, after its stop as at its stop, and between them never falling."""
    gain = ReceiverGain(
        fixed_db=fixed, tvg_db_per_decade=law, absorption_db_per_m=loss, start=start, stop=start + length
    )
    before, first, last, after = gain.db(np.array([start * beyond, start, start + length, 2 + beyond]), 1500.0, 0.01)
    assert before == first and last == after
    inside = gain.db(np.linspace(start, start + length, 50), 1500.0, 0.01)
    assert (np.diff(inside) >= -1e-9).all()


@given(st.floats(0, 60), st.floats(-20, 100))
def test_no_gain_exceeds_the_amplifiers_and_the_least_of_both_is_taken(law, most):
    """Where it may it follows the law; elsewhere it is the limit."""
    time = np.linspace(1e-3, 0.3, 200)
    limited = ReceiverGain(tvg_db_per_decade=law, max_db=most).db(time, 1500.0, 0.03)
    free = ReceiverGain(tvg_db_per_decade=law).db(time, 1500.0, 0.03)
    np.testing.assert_array_equal(limited, np.minimum(free, most))


@given(LOSS, LOSS)
def test_the_waters_absorption_is_taken_where_gain_has_none_of_its_own(own, water):
    """And not at all where no gain follows the range: a fixed gain is fixed."""
    time = np.array([0.01, 0.2])
    gain = ReceiverGain(tvg_db_per_decade=20, absorption_db_per_m=own).db(time, 1500.0, water)
    np.testing.assert_array_equal(
        gain, ReceiverGain(tvg_db_per_decade=20, absorption_db_per_m=own).db(time, 1500.0, 0.0)
    )
    np.testing.assert_array_equal(ReceiverGain(tvg_db_per_decade=20).db(time, 1500.0, own), gain)
    np.testing.assert_array_equal(ReceiverGain(fixed_db=12).db(time, 1500.0, water), [12.0, 12.0])


@pytest.mark.parametrize(("model", "values", "word"), [
    (AnalogToDigitalConverter, {"full_scale_db": 150, "bits": 1}, "bits"),
    (AnalogToDigitalConverter, {"full_scale_db": 150, "bits": 33}, "bits"),
    (AnalogToDigitalConverter, {"full_scale_db": float("nan")}, "full_scale_db"),
    (AnalogToDigitalConverter, {}, "full_scale_db"), (ReceiverGain, {"start": -1e-3}, "start"),
    (ReceiverGain, {"tvg_db_per_decade": -20}, "tvg_db_per_decade"), (ReceiverGain, {"stop": 0.0}, "stop"),
    (Crosstalk, {"neighbours_db": 0.0}, "neighbours_db"),
    (Crosstalk, {"feedthrough_db": float("inf")}, "feedthrough_db"),
    (SelfNoise, {"tones": [{"frequency": 0.0, "level_db": 60}]}, "frequency"),
    (SelfNoise, {"level_db": 1e3}, "level_db"),
])  # fmt: skip
def test_electronics_that_cannot_be_are_refused_by_name(model, values, word):
    """Outside what an amplifier or a converter can do, or no number at all."""
    with pytest.raises(ValidationError, match=word):
        model(**values)
