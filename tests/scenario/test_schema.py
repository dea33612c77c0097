"""Claims about the schema of scenario files: it accepts what runs, refuses what does not, and explains every key."""

import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from insonify.cli import main
from insonify.scenario.schema import json_schema
from insonify.units import UNITS

ROOT = Path(__file__).parents[2]
FILES = [
    *sorted((ROOT / "src/insonify/scenario/templates").glob("*.yaml")),
    *sorted(set((ROOT / "examples").glob("*.yaml")) - set((ROOT / "examples").glob("*dataset.yaml"))),
]


@pytest.fixture(scope="module")
def schema():
    """The schema, itself valid."""
    made = json_schema()
    jsonschema.Draft202012Validator.check_schema(made)
    return made


@pytest.fixture(scope="module")
def nominal():
    """Plain values of the nominal scene."""
    return yaml.safe_load((ROOT / "examples/nominal.yaml").read_text())


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_templates_and_examples_are_valid(schema, file):
    """Every scenario that the project ships, with its units, shorthands and things of the library."""
    values = yaml.safe_load(file.read_text())
    assert not list(jsonschema.Draft202012Validator(schema).iter_errors(values))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("seabed", "depth"), "20 s"), (("seabed", "depth"), -5), (("seabed", "depth"), [20]), (("seabed", "dept"), 20),
        (("paths", "max_reflections"), 2.5), (("paths", "engine"), "paths"), (("paths", "thinning"), False),
        (("sonar", "pulse", "frequency"), "100 m"), (("surface", "reflection"), "mirror"), (("field",), "both"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_refused(schema, nominal, path, value):
    """A unit of another dimension, a value out of range, a list, a misspelt key, an old name, an unknown word."""
    changed = json.loads(json.dumps(nominal))
    *above, last = path
    place = changed
    for key in above:
        place = place.setdefault(key, {})
    place[last] = value
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema).validate(changed)  # the schema itself is checked once, above


def test_every_key_is_explained_with_unit_range_and_default(schema):
    """A description of at least two words for each; limits and default of a quantity are in its unit."""
    parts = {**schema["$defs"], "Scenario": schema}
    keys = {f"{name}.{key}": item for name, part in parts.items() for key, item in part.get("properties", {}).items()}
    assert len(keys) > 250
    assert not [key for key, item in keys.items() if len(item["description"].split()) < 2]
    depth = keys["Seabed.depth"]
    assert depth["description"].endswith("[m], 0.1 to 12000 m; default 20 m.")
    assert set(UNITS["length"]) <= set(depth["anyOf"][1]["pattern"].split("(")[-1].split(")")[0].split("|"))


def test_the_command_writes_what_a_new_scenario_names(tmp_path, monkeypatch, schema):
    """The first line of a new file is the editors' reference to the schema, and the command writes that file."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "harbour"]) == 0 and main(["schema"]) == 0
    first = Path("harbour.yaml").read_text().splitlines()[0]
    assert first.startswith("# yaml-language-server: $schema=")
    assert json.loads(Path(first.split("=")[1]).read_text()) == json.loads(json.dumps(schema))


def test_a_schema_that_cannot_be_written_is_reported(tmp_path, capsys):
    """Exit code 2, the path and the reason."""
    assert main(["schema", "-o", str(tmp_path / "none" / "s.json")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_the_step_of_a_baffle_is_described_at_every_array():
    """Nothing else in a scenario states that a target on the plane of an array is received in full or not at all."""
    models = json_schema()["$defs"]
    for name in ("PointTransducer", "LineArray", "PlanarArray", "ElementArray", "ArcArray"):
        text = models[name]["properties"]["element"]["description"]
        assert "steps from 1 to 0" in text and "in full or not at all" in text
