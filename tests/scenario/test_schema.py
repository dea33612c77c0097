"""Claims about the schema of scenario files: it accepts what runs, refuses what does not, and explains every key."""

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from insonify.cli import main
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
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
def keys(schema):
    """Schema of every key, by the names of its model and itself, and whether a file needs it."""
    parts = {**schema["$defs"], "Scenario": schema}
    forms = [(name, form) for name, part in parts.items() for form in (part, *part.get("anyOf", ()))]
    return {
        f"{name}.{key}": (item, any(key in one.get("required", ()) for one in (form, *form.get("anyOf", ()))))
        for name, form in forms
        for key, item in form.get("properties", {}).items()
        if isinstance(item, dict) and "description" in item
    }


@pytest.fixture(scope="module")
def nominal():
    """Plain values of the nominal scene."""
    return yaml.safe_load((ROOT / "examples/nominal.yaml").read_text())


def with_value(nominal, path, value):
    """Plain values of the nominal scene with one of them replaced."""
    changed = json.loads(json.dumps(nominal))
    *above, last = path.split(".")
    group = changed
    for key in above:
        group = group[int(key)] if isinstance(group, list) else group.setdefault(key, {})
    group[int(last) if isinstance(group, list) else last] = value
    return changed


def numbers(item):
    """Every number that a value, a list or a row may hold, with the text that may stand for it."""
    if item.get("type") in ("number", "integer"):
        yield item
    below = [*item.get("anyOf", ()), *item.get("prefixItems", ()), *([item["items"]] if "items" in item else [])]
    for part in below:
        yield from numbers(part)


def is_accepted(schema, values):
    """Whether the schema accepts plain values of a scenario; the schema itself is checked once, above."""
    return jsonschema.Draft202012Validator(schema).is_valid(values)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_templates_and_examples_are_valid(schema, file):
    """Every scenario that the project ships, with its units, shorthands and things of the library."""
    values = yaml.safe_load(file.read_text())
    assert not list(jsonschema.Draft202012Validator(schema).iter_errors(values))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("seabed.depth", "20 s"), ("seabed.depth", -5), ("seabed.depth", [20]), ("seabed.dept", 20),
        ("paths.max_reflections", 2.5), ("paths.engine", "paths"), ("paths.thinning", False),
        ("sonar.pulse.frequency", "100 m"), ("surface.reflection", "mirror"), ("field", "both"),
        ("seabed.scattering", {"law": "lambertt"}), ("seabed.scattering", {"foo": 1}), ("seabed.scattering", "lambert"),
        ("seabed.scattering", {"strength_db": "-27 m"}), ("seabed.scattering", {"strength_db": -3}),
        ("seabed.scattering", {"law": "lambert", "sediment": "clay"}), ("surface.scattering", {"law": "jackson"}),
        ("seabed.relief", {"kind": "nope"}), ("seabed.relief", {"wavelength": 1}), ("seabed.relief", "ripples"),
        ("seabed.relief", [[{"kind": "ripples"}]]), ("sonar.receive.steer", "7 kHz"), ("sonar.receive.steer", []),
        ("sonar.receive.steer", {"from": 0, "to": "5 deg"}), ("sonar.receive.steer", {"first": 0, "to": 1, "step": 1}),
        ("seabed.depth", "20 dB"), ("sonar.pulse.duration", "0.2 dB"), ("sonar.source_level_db", "220 dBm"),
        ("water.absorption_db_per_m", "34 dB"), ("water.salinity", "35 g/kg"), ("track.window", "240 ms"),
        ("track.window", [0]), ("track.position", [0, 0]), ("track.pings", 0), ("targets", {"shape": "drum"}),
        ("targets.0", {"shape": "library", "position": [0, 150]}), ("targets.0", {"position": [0, 150]}),
        ("targets.0", {"shape": "drum", "name": "drum", "position": [0, 150]}), ("paths.families", "D"),
        ("water.profile", 1500), ("water.profile", {"depth": [0, 20], "temperature": [10, 9]}),
        ("water.profile", [[0, 1500, 35], [20, 1500, 35]]), ("track", {"position": [0, 0, 11]}),
    ],
)  # fmt: skip
def test_a_wrong_value_is_refused(schema, nominal, path, value):
    """Units of another dimension, values out of range, unknown keys and words, and forms that are no shorthand."""
    changed = with_value(nominal, path, value)
    assert not is_accepted(schema, changed)
    with pytest.raises(ScenarioError):
        parse_model(Scenario, yaml.safe_dump(changed))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("seabed.scattering", {"strength_db": "-30 dB"}), ("seabed.scattering", {"sediment": 1.5}),
        ("seabed.scattering", None), ("seabed.scattering", {}), ("surface.scattering", {"wind_speed": "5 m/s"}),
        ("seabed.relief", {"kind": "ripples"}), ("seabed.relief", [{"kind": "ripples"}]), ("seabed.relief", None),
        ("sonar.receive.steer", "7 deg"), ("sonar.receive.steer", 0.1), ("sonar.receive.steer", ["-7 deg", "7 deg"]),
        ("sonar.receive.steer", None), ("sonar.receive.steer", {"from": "-6 deg", "to": "6 deg", "step": "1 deg"}),
        ("sonar.source_level_db", "220 dB re 1 uPa"), ("sonar.source_level_db", "220 dB"),
        ("water.absorption_db_per_m", "34 dB/km"), ("water.absorption_db_per_m", 0.034),
        ("targets.0", {"shape": "drum", "position": [0, 150]}),
        ("targets.0", {"shape": "library", "name": "drum", "position": [0, 150]}),
        ("sonar.receiver.gain", {"tvg_db_per_decade": "30 dB"}),
        ("water.volume_strength_db", [["0 m", -80], [8, None]]),
    ],
)  # fmt: skip
def test_shorthands_and_units_are_accepted(schema, nominal, path, value):
    """What the models complete, and what they read besides numbers in SI."""
    changed = with_value(nominal, path, value)
    assert is_accepted(schema, changed)
    assert parse_model(Scenario, yaml.safe_dump(changed))


@pytest.mark.parametrize(
    "profile",
    [
        [["0 m", "1510 m/s"], [20, 1490]], {"depth": [0, 20], "speed": [1510, 1490]},
        {"depth": ["0 m", "20 m"], "temperature": [12, "10 degC"], "salinity": [35, 35]},
    ],
    ids=["rows", "speeds", "temperatures"],
)  # fmt: skip
def test_every_form_of_a_profile_is_accepted(schema, nominal, profile):
    """Rows, columns of speed, and columns of temperature and salinity; a speed beside them is refused."""
    changed = with_value(nominal, "water.profile", profile)
    del changed["water"]["sound_speed"]
    assert is_accepted(schema, changed) and parse_model(Scenario, yaml.safe_dump(changed))


def test_every_key_is_explained_with_unit_range_and_default(keys):
    """A description that begins with a word, and the default of each key that a file may leave out."""
    assert len(keys) > 300
    assert not [key for key, (item, _) in keys.items() if not re.match("[A-Za-z]", item["description"])]
    assert not [key for key, (item, _) in keys.items() if re.search(r"\b(None|True|False)\b", item["description"])]
    unstated = re.compile(r"default[: ]|left out")
    assert not [
        key
        for key, (item, is_needed) in keys.items()
        if not is_needed and "const" not in item and not unstated.search(item["description"])
    ]
    depth = keys["Seabed.depth"][0]
    assert depth["description"].endswith("[m], 0.1 to 12000 m; default 20 m.")
    assert set(UNITS["length"]) <= set(depth["anyOf"][1]["pattern"].split("(")[-1].split(")")[0].split("|"))


def test_every_number_has_a_unit_and_limits(keys):
    """A unit in brackets for each kind of number of a key, and for each number both limits, which the text repeats."""
    found = {key: list(numbers(item)) for key, (item, _) in keys.items()}
    assert sum(map(bool, found.values())) > 180
    for key, several in found.items():
        for number in several:
            low, high = ({number.get(f"{end}imum"), number.get(f"exclusive{end.title()}imum")} - {None}
                         for end in ("min", "max"))  # fmt: skip
            assert len(low) == len(high) == 1, key
        limits = {(number.get("minimum"), number.get("exclusiveMinimum"), number.get("maximum")) for number in several}
        text = keys[key][0]["description"]
        assert len(re.findall(r"\[[^\]]+\], (each )?(above )?-?[\d.e+]+,? (to|below)", text)) == len(limits), text


def test_groups_and_lists_state_what_they_hold_by_default(keys):
    """The values of a list, and of a group of keys those that differ from its own defaults."""
    for key, default in (
        ("LineTrack.window", "[0, 0.24] s"), ("PathSettings.contributions", "[seabed, surface, target, water, boundary "
        "echo]"), ("Box.scattering", "{strength_db: -10}"), ("Scenario.water", "{}"), ("Water.patches", "[]"),
        ("Seabed.scattering", "{law: jackson, sediment: medium sand, volume: power-law}"), ("Scenario.title", '""'),
    ):  # fmt: skip
        assert keys[key][0]["description"].endswith(f"; default {default}."), key


def test_the_command_writes_what_a_new_scenario_names(tmp_path, monkeypatch, schema):
    """The first line of a new file is the editors' reference to the schema, and the command writes that file."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "harbour"]) == 0 and main(["schema"]) == 0
    first = Path("harbour.yaml").read_text().splitlines()[0]
    assert first.startswith("# yaml-language-server: $schema=")
    assert json.loads(Path(first.split("=")[1]).read_text()) == json.loads(json.dumps(schema))


def test_a_new_scenario_hints_at_the_schema_until_it_is_there(tmp_path, monkeypatch, capsys):
    """One line on stderr with the command that writes the file which the scenario names."""
    monkeypatch.chdir(tmp_path)
    Path("sea").mkdir()
    assert main(["new", "sea/harbour"]) == 0
    shown = capsys.readouterr()
    assert shown.out == "sea/harbour.yaml\n"
    assert shown.err.endswith(": insonify schema -o sea/insonify.schema.json\n") and shown.err.count("\n") == 1
    assert main(["new", "bay"]) == 0 and capsys.readouterr().err.endswith(": insonify schema\n")
    assert main(["schema"]) == 0 and main(["new", "cove"]) == 0
    assert capsys.readouterr().err == ""


def test_a_schema_that_cannot_be_written_is_reported(tmp_path, capsys):
    """Exit code 2, the path and the reason."""
    assert main(["schema", "-o", str(tmp_path / "none" / "s.json")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_editors_show_no_examples_of_python(schema):
    """Descriptions of models end before the examples of their docstrings."""
    assert "Sea water" in schema["$defs"]["Water"]["description"] and ">>> " not in json.dumps(schema)


def test_the_step_of_a_baffle_is_described_at_every_array():
    """Nothing else in a scenario states that a target on the plane of an array is received in full or not at all."""
    models = json_schema()["$defs"]
    for name in ("PointTransducer", "LineArray", "PlanarArray", "ElementArray", "ArcArray"):
        text = models[name]["properties"]["element"]["description"]
        assert "steps from 1 to 0" in text and "in full or not at all" in text
