"""Types that messages name are those of the models."""

from insonify.diagnostics.expected_type import find
from insonify.diagnostics.yaml_source import dotted
from insonify.scenario.scenario import Scenario
from oracles.scenes import nominal


def test_a_key_has_the_units_and_limits_of_its_model():
    """Units, limits and kinds come from the models: a length in m, an angle, a frequency above zero, a list of 3."""
    values = nominal().model_dump(mode="json")

    def expected_kinds(dots):
        loc = tuple(int(step) if step.isdigit() else step for step in dots.split("."))
        path, found = find(Scenario, values, loc)
        assert dotted(path) == dots
        return [choice for choice in found if choice.kind is not type(None)]

    assert (
        expected_kinds("seabed.depth")[0].description() == "a length in m"
        and expected_kinds("seabed.depth")[0].dimension == "length"
    )
    assert any(choice.units == "Hz" for choice in expected_kinds("sonar.pulse.frequency"))
    assert expected_kinds("track.position.2")[0].units == "m"
    assert expected_kinds("seed")[0].limits == {"ge": 0.0, "lt": 2.0**63}
    assert expected_kinds("field")[0].description() == "one of coherent, incoherent"
