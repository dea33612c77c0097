"""Reading and writing scenario files: a round trip in any unit, and advice that is accepted."""

import pytest
import yaml

from insonify.diagnostics.diagnostic import ScenarioError
from insonify.scenario.load import load_scenario, parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from oracles.scenes import nominal, point


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {
            "targets": [point(3.0, 60, 15), point(-3.0, 70, 12, label="other")],
            "paths": {"edge_diffraction": "knife-edge", "jitter": 0.1},
        },
        {"water": {"profile": [[0, 1510], [8, 1510.25], [14, 1490.1], [20, 1490]], "smoothing": 0.5}},
        {"seabed": {"scattering": {"law": "jackson", "sediment": "coarse sand"}, "reflection": "coarse sand"}},
        {"track": {"motion": {"roll": {"rms": 0.01, "period": 5}}, "pings": 3}},
        {"sonar": {"sides": ["port", "starboard"]}},
    ],
)
@pytest.mark.filterwarnings("ignore")
def test_writing_and_reading_is_the_identity_and_writing_is_settled(changes, tmp_path):
    """A scenario from its own YAML is equal to it, from text and from a file, and is written to the same bytes."""
    scenario = nominal(**changes)
    text = to_yaml(scenario)
    again = parse_model(Scenario, text)
    assert again == scenario and to_yaml(again) == text
    file = tmp_path / "written.yaml"
    file.write_text("\ufeff" + text.replace("\n", "\r\n"), encoding="utf-8", newline="")  # as an editor may save it
    assert load_scenario(file) == scenario


@pytest.mark.parametrize(
    ("key", "typed", "si"),
    [
        ("duration", "200 us", 2e-4),
        ("duration", "0.2 ms", 2e-4),
        ("frequency", "0.1 MHz", 1e5),
        ("frequency", "100 kHz", 1e5),
    ],
)
def test_units_change_the_writing_and_not_the_meaning(key, typed, si):
    """The same pulse in any unit is the same scenario."""
    values = yaml.safe_load(to_yaml(nominal()))
    values["sonar"]["pulse"][key] = typed
    scenario = parse_model(Scenario, yaml.safe_dump(values))
    assert getattr(scenario.sonar.pulse, key) == pytest.approx(si, rel=1e-15)


@pytest.mark.parametrize(
    ("field", "typed"),
    [
        ("seabed.depth", "-20 m"), ("seabed.depth", "-2000 cm"),
        ("sonar.mounting.bearing", "90"), ("track.heading", "45"),
        ("water.sound_speed", "-1500"), ("sonar.receive.length", "-1.5"), ("sonar.pulse.duration", "-0.2 ms"),
    ],
)  # fmt: skip
def test_what_advice_offers_is_accepted(field, typed):
    """Whatever writes what the advice offers is not advised again about that place."""
    values = yaml.safe_load(to_yaml(nominal()))
    *steps, last = [int(step) if step.isdigit() else step for step in field.split(".")]

    def faults(text):
        place = values
        for step in steps:
            place = place[step]
        place[last] = text
        try:
            parse_model(Scenario, yaml.safe_dump(values))
        except ScenarioError as error:
            return [fault for fault in error.faults if fault.field == field]
        return []

    (fault,) = faults(yaml.safe_load(typed))
    offered = fault.fix.removeprefix("Did you mean ").removeprefix("Depths are positive downwards; write ").rstrip("?.")
    assert offered and typed not in (offered,)
    assert faults(offered) == []


def test_a_file_without_an_end_is_refused():
    """A device is read up to the most that a scenario has."""
    with pytest.raises(ScenarioError, match="more than 64 MB"):
        load_scenario("/dev/zero")
