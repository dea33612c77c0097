"""Parts of a job hold each of its items once."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.cli.arguments import InputError, parse_part
from insonify.part import Part


@given(st.integers(0, 300), st.integers(1, 40), st.integers(1, 9))
def test_parts_hold_each_item_once(items: int, count: int, unit: int) -> None:
    """Joined in their order they are the job; they begin at whole units and differ by one unit at most."""
    shares = [Part(number, count).share(items, unit) for number in range(1, count + 1)]
    assert [item for share in shares for item in share] == list(range(items))
    assert all(share.start % unit == 0 for share in shares if share)
    sizes = [-(-len(share) // unit) for share in shares]
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize(
    ("typed", "advice"),
    [
        ("0/4", "the first part is 1, not 0"),
        ("5/4", "parts are 1/4 to 4/4"),
        ("0/0", "one part at least: 1/1"),
        ("3", "write its number, from 1, and the number of parts: 3/64"),
        ("1/4/2", "3/64"),
        ("-1/4", "3/64"),
        ("1.5/4", "3/64"),
        ("", "3/64"),
        ("²/4", "3/64"),
    ],
)
def test_what_is_no_part_is_refused_with_advice(typed: str, advice: str) -> None:
    """The message has the option, the text and the remedy."""
    with pytest.raises(InputError, match=rf"^--part .*{re.escape(advice)}"):
        parse_part(typed)


def test_a_part_is_read_as_it_is_written() -> None:
    """Typed, shown and read again; without the option there is none."""
    assert parse_part("3/64") == Part(3, 64) == Part.parse(str(Part(3, 64)))
    assert parse_part(None) is None
    with pytest.raises(ValueError, match="of 4 parts give 1 to 4"):
        Part(5, 4)
