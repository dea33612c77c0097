"""The nominal scenario file, whole and maimed."""

import re
from collections.abc import Iterator
from typing import Any

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from insonify.diagnostics.diagnostic import ScenarioError
from insonify.propagation.path_settings import PathSettings
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.template import template_text
from insonify.scenario.write import to_yaml

NOMINAL = template_text("nominal")
LINES = NOMINAL.splitlines()

scraps = st.sampled_from(
    ["", "-", ":", "null", "no", ".nan", "1e999", "-1", "0", "1e30", "-20 m", "20 kHz", "[1, 2]", "{a: 1}", "[]", "{}",
     "[[[]]]", "*x", "&x 1", "!y", "'", "\t", "|", "? ", "#", "999999999999999999999999", "1:30", "🐟", "\x00", "box"]
)  # fmt: skip


def test_the_template_shows_the_defaults() -> None:
    """What the file shows is what leaving it out gives, but for the surface: left out, it is a mirror."""
    scenario = parse_model(Scenario, NOMINAL)
    sonar = "sonar:" + NOMINAL.split("\nsonar:")[1].split("  receiver:")[0]
    short = parse_model(Scenario, sonar + "\ntrack: {kind: static, position: [0, 0, 11]}")
    assert short.surface.reflection == "flat" and scenario.surface.reflection == "statistical"
    for name in ("seed", "water", "track", "paths", "field", "output"):
        assert getattr(short, name) == getattr(scenario, name), name
    assert short.sonar == scenario.sonar


def test_every_key_has_its_place_in_the_file() -> None:
    """As a key, or in a comment: what can be set is seen where all else is set; paths shows all of its keys."""
    assert list(_absent_keys(parse_model(Scenario, NOMINAL), yaml.safe_load(NOMINAL))) == []
    assert set(yaml.safe_load(NOMINAL)["paths"]) == set(PathSettings.model_fields)


def _absent_keys(model: BaseModel, written: dict[str, Any]) -> Iterator[str]:
    for key in type(model).model_fields:
        value, shown = getattr(model, key), written.get(key)
        first, *_ = value if isinstance(value, tuple) and value else [value]
        if isinstance(first, BaseModel) and shown:
            yield from _absent_keys(first, shown[0] if isinstance(shown, list) else shown)
        elif key not in written and not re.search(rf"\b{key}\b", NOMINAL):
            yield key


def test_the_scenario_in_the_attributes_is_the_scenario() -> None:
    """Written as YAML in SI and read again, nothing has changed."""
    scenario = parse_model(Scenario, NOMINAL)
    assert parse_model(Scenario, to_yaml(scenario)) == scenario


def assert_read_or_reported(text: str) -> None:
    """Either it loads or it is reported; nothing else may happen."""
    try:
        parse_model(Scenario, text, name="harbour.yaml")
    except ScenarioError as error:
        assert error.faults
        assert all(line.startswith("harbour.yaml:") for line in str(error).splitlines())


@settings(max_examples=60)
@given(st.integers(0, len(LINES) - 1), scraps)
def test_any_value_may_be_replaced_by_anything(row: int, scrap: str) -> None:
    """One value of the nominal file becomes nonsense."""
    key, colon, _ = LINES[row].partition(":")
    assert_read_or_reported("\n".join([*LINES[:row], f"{key}{colon} {scrap}", *LINES[row + 1 :]]))


@settings(max_examples=35)
@given(st.integers(0, len(NOMINAL)), st.integers(0, 40), scraps | st.text(max_size=5))
def test_any_piece_may_be_cut_out_and_replaced(start: int, length: int, scrap: str) -> None:
    """Text vanishes and other text appears, anywhere."""
    assert_read_or_reported(NOMINAL[:start] + scrap + NOMINAL[start + length :])


@settings(max_examples=50)
@given(st.integers(0, len(LINES) - 1), st.integers(0, len(LINES) - 1))
def test_any_line_may_stand_anywhere(row: int, other: int) -> None:
    """Two lines change places."""
    lines = list(LINES)
    lines[row], lines[other] = lines[other], lines[row]
    assert_read_or_reported("\n".join(lines))
