"""Ranges and times mean what a person means by them."""

import pytest

from insonify.cli.arguments import InputError, parse_ping_range, parse_quantity


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        (None, range(9)),
        ("2:5", range(2, 5)),
        (":4", range(4)),
        ("7:", range(7, 9)),
        ("3", range(3, 4)),
        ("0:9", range(9)),
    ],
)
def test_a_range_of_pings(typed: str | None, meant: range) -> None:
    """Counted from 0, the end not included, as Python counts."""
    assert parse_ping_range(typed, 9) == meant


@pytest.mark.parametrize("typed", ["", ":", "a:b", "3:3", "5:2", "9", "9:", "2:10", "-1:2", "1:2:3", "1.5"])
def test_a_range_that_the_track_does_not_have(typed: str) -> None:
    """Refused, with the range that would do."""
    with pytest.raises(InputError, match="--pings"):
        parse_ping_range(typed, 9)


def test_times_with_units() -> None:
    """A bare number is seconds."""
    assert parse_quantity("201.9 ms", "time", "--time") == pytest.approx(0.2019, rel=1e-15)
    assert parse_quantity("0.2", "time", "--time") == 0.2
    with pytest.raises(InputError, match="--time 3 m: 'm' is not a unit of time"):
        parse_quantity("3 m", "time", "--time")
