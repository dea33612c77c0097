"""A scenario written down and read again is the same scenario."""

from typing import Annotated

from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field

from insonify.noun import Metres, Noun
from insonify.scattering import Lambert
from insonify.scenario.load import parse
from insonify.scenario.write import to_yaml


class Note(Noun):
    title: str
    depth: Metres
    seed: int
    law: Lambert | None
    places: Annotated[tuple[tuple[Metres, Metres], ...], Field()] = ()


numbers = st.floats(allow_nan=False, allow_infinity=False)
notes = st.builds(
    Note,
    title=st.text(max_size=40),
    depth=numbers,
    seed=st.integers(0, 2**64 - 1),
    law=st.none() | st.builds(Lambert, strength_db=st.floats(-100, -5)),
    places=st.lists(st.tuples(numbers, numbers), max_size=3).map(tuple),
)


@settings(max_examples=60)
@given(notes)
def test_round_trip_loses_nothing(note: Note) -> None:
    """Every bit of every number and every letter of every text comes back."""
    assert parse(Note, to_yaml(note)) == note
