"""A scenario written down and read again is the same scenario."""

import importlib.util
from importlib.resources import files
from typing import Annotated

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field

from insonify.model import Metres, Model
from insonify.scattering import Lambert
from insonify.scenario.load import load_scenario, parse_model
from insonify.scenario.write import to_yaml

TEMPLATES = files("insonify.scenario") / "templates"


class Note(Model):
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
    assert parse_model(Note, to_yaml(note)) == note


@pytest.mark.parametrize("template", sorted(one.name for one in TEMPLATES.iterdir() if one.name.endswith(".yaml")))
def test_what_is_written_is_the_same_without_the_compiled_library(
    template: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Recordings go on where texts agree: PyYAML's own emitter and libyaml's write the same of each template."""
    scenario = load_scenario(str(TEMPLATES / template))
    written = to_yaml(scenario)
    monkeypatch.delattr(yaml, "CSafeDumper", raising=False)
    plain = importlib.util.module_from_spec(importlib.util.find_spec("insonify.scenario.write"))
    plain.__loader__.exec_module(plain)
    assert plain.to_yaml(scenario) == written and plain.SafeDumper is yaml.SafeDumper
