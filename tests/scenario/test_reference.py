"""Claims about the reference page of scenario files: it is the models' own, and it has every key and every kind."""

from pathlib import Path

import pytest

from insonify.cli import main
from insonify.scenario.reference import scenario_reference
from insonify.scenario.schema import json_schema

PAGE = Path(__file__).parents[2] / "docs/reference/scenario.md"


@pytest.fixture(scope="module")
def page():
    """The page of this version."""
    return scenario_reference()


def test_the_page_in_the_docs_is_current(page):
    """After a change of a model: insonify schema -o docs/reference/scenario.md."""
    assert PAGE.read_text(encoding="utf-8") == page


def test_every_key_of_every_model_has_a_row(page):
    """Also of those kinds that no template shows."""
    schema = json_schema()
    for name, part in {"Scenario": schema, **schema["$defs"]}.items():
        _, _, section = page.partition(f'<a id="{name}"></a>')
        rows = section.partition("<a id=")[0]
        properties = next(form["properties"] for form in (part, *part.get("anyOf", ())) if "properties" in form)
        assert not [key for key in properties if f"\n| `{key}` |" not in rows], name


@pytest.mark.parametrize(
    "kind",
    [
        "tilted", "small-slope", "sediment-volume", "ellipsoid", "kind: decimation", "kind: quantisation", "kind: arc",
        "shape: truncated_cone", "law: apl-surface", "kind: navigation", "steer_down", "rain_rate", "manta",
    ],
)  # fmt: skip
def test_kinds_that_no_template_shows_are_named(page, kind):
    """As the heading of their keys, or among the words that a key takes."""
    assert kind in page


def test_rows_have_unit_range_default_and_description(page):
    """One of each sort: a quantity, a key that is needed, a list, a word."""
    for row in (
        "| `depth` | m | 0.1 to 12000 m | `20 m` | Depth of the flat seabed, or of the mean plane of its relief, below",
        "| `frequency` | Hz | above 0, to 10000000 Hz | needed | Centre frequency. |",
        "| `window` | s | each 0 to 100 s | `[0, 0.24] s` | Start and stop of the recording after each transmission. |",
        "| `geometry` |  | 3d; slice | `3d` | The whole scene, or the vertical plane of one beam, in which each point",
    ):
        assert f"\n{row}" in page


def test_the_command_writes_the_page(tmp_path, page):
    """By the suffix of the file."""
    assert main(["schema", "-o", str(tmp_path / "keys.md")]) == 0
    assert (tmp_path / "keys.md").read_text(encoding="utf-8") == page
