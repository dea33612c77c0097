"""A range in words states each limit, and whether the limit itself is allowed."""

import re

import pytest

from insonify.value_range import value_range

LIMITS = [
    ({}, ""),
    ({"ge": 0}, "0 m or more"),
    ({"gt": 0}, "above 0 m"),
    ({"le": 1e7}, "10000000 m or less"),
    ({"lt": -2.5}, "below -2.5 m"),
    ({"ge": -90, "le": 90}, "-90 to 90 m"),
    ({"gt": 0, "le": 100}, "above 0, to 100 m"),
    ({"ge": 0, "lt": 1}, "0 to below 1 m"),
    ({"gt": 1e-6, "lt": 1e9}, "above 1e-06, below 1e+09 m"),
]


@pytest.mark.parametrize(("limits", "text"), LIMITS)
def test_limits_in_words(limits: dict[str, float], text: str) -> None:
    """With a unit, and without one for a ratio."""
    assert value_range(limits, "m") == text
    assert value_range(limits) == re.sub(r" m\b", "", text)


@pytest.mark.parametrize(("limits", "text"), LIMITS[1:])
def test_a_reader_of_the_words_knows_the_limits(limits: dict[str, float], text: str) -> None:
    """Read back by a grammar of their own: number by number, with what excludes it."""
    read = {}
    for excluding, number, after in re.findall(r"(above|below)? ?(-?[\d.]+(?:e[-+]\d+)?)(?: m)?( or more)?", text):
        is_low = excluding == "above" or bool(after) or (not read and " to " in text)
        read[("gt" if excluding == "above" else "ge") if is_low else ("lt" if excluding == "below" else "le")] = number
    assert {name: float(number) for name, number in read.items()} == limits
