"""A row of evenly spaced angles has its ends and its step, to the bit."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.sonar import LineArray
from insonify.units import si


def steer(*row: object) -> tuple[float, ...]:
    """The angles of an array steered from, to, in steps of."""
    return LineArray(length=1, steer=dict(zip(("from", "to", "step"), row, strict=True))).steer


@given(st.integers(-800, 700), st.integers(0, 60), st.sampled_from([1, 2, 5, 25]))
def test_each_angle_is_the_number_that_a_person_would_have_typed(first, count, step):
    """Hundredths of a degree, counted up: not one bit is lost in the summing."""
    typed = [f"{(10 * first + k * step) / 100:.2f} deg" for k in range(count + 1)]
    assert steer(typed[0], typed[-1], f"{step / 100} deg") == tuple(si(angle, "angle") for angle in typed)


def test_a_row_may_run_to_the_left_and_may_be_one_angle():
    """The sign of the step is the way it goes; plain numbers are radians, and 0 needs no unit."""
    assert steer("1 deg", "-1 deg", "-1 deg") == tuple(si(f"{angle} deg", "angle") for angle in (1, 0, -1))
    assert steer("5 deg", "5 deg", "1 deg") == (si("5 deg", "angle"),)
    assert steer(0, 0.3, 0.1) == (0, 0.1, 0.2, 0.3)
    assert steer(0, "2 deg", "1 deg") == steer("0 deg", "2 deg", "1 deg")
    assert steer("-100 mrad", 0.1, 0.1) == (-0.1, 0, 0.1)


@given(st.integers(1, 60), st.integers(1, 60), st.integers(1, 400))
def test_the_step_that_is_advised_works(first, last, step):
    """A value as the message states it is accepted."""
    row = (f"-{first} deg", f"{last} deg")
    try:
        steer(*row, f"{step / 10} deg")
    except ValidationError as run_refusal:
        advised = re.search(r"Write (\S+ deg), for (\d+) angles", str(run_refusal))
        assert advised
        assert len(steer(*row, advised[1])) == int(advised[2])


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (("-6 deg", "6 deg", "-1 deg"), "step: -1 deg does not lead from -6 to 6 deg; write 1 deg."),
        (("6 deg", "-6 deg", "1 deg"), "step: 1 deg does not lead from 6 to -6 deg; write -1 deg."),
        (("-6 deg", "6 deg", 0), "step: 0 deg does not lead from -6 to 6 deg; write, for instance, 3 deg."),
        (("0 deg", "1 deg", "0.3 deg"), "step: 0.3 deg does not come out even from 0 to 1 deg. Write 0.333333333 deg"),
        (("-6 deg", "6 deg", "1e-9 deg"), "and 1024 is the most"),
        (
            ("-6 deg", "6 m", True),
            "to: 6 m is not an angle; use rad, deg, mrad.\nLineArray: steer.step: True is not an angle",
        ),
        (("-95 deg", "6 deg", "1 deg"), "steered by less than 90 deg"),
        ((float("nan"), "6 deg", "1 deg"), "from: nan is not an angle"),
        (("-1e-999999999 deg", "1e999999999 deg", "1 deg"), "to: 1e999999999 deg is not an angle"),
    ],
)
def test_a_wrong_row_is_reported_with_the_remedy(row, message):
    """At the wrong key, all of them at once."""
    with pytest.raises(ValidationError, match=re.escape(message)):
        steer(*row)


@pytest.mark.parametrize("keys", [{}, {"from": 0}, {"from": 0, "to": 1, "step": 1, "stop": 2}, {1: 2}])
def test_a_row_has_three_keys(keys):
    """No more, no fewer."""
    with pytest.raises(ValidationError, match="a row of angles has from, to, step"):
        LineArray(length=1, steer=keys)
