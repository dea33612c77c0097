"""Claims about texture and scattering water in files: round trips, and errors for slips."""

import pytest
from pydantic import ValidationError

from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.validity import PhysicsWarning
from oracles.scenes import nominal

SCHOOL = {"label": "school", "position": (0.0, 60.0, 12.0), "size": (3.0, 2.0, 1.5), "volume_strength_db": -40.0}


def scene(water=None, **top):
    """The nominal scene with such water."""
    return nominal(water={"noise_level_db": None, **(water or {})}, **top)


@pytest.mark.parametrize("strength", [None, -70.0, ((0.0, -80.0), (8.0, -65.0), (12.0, None))])
def test_what_was_written_is_read_again(strength):
    """Layers, a patch and a texture: the same scenario."""
    written = scene(
        {"volume_strength_db": strength, "patches": [SCHOOL]},
        seabed={"texture": {"k_shape": 3, "correlation_length": "2 m"}},
    )
    assert parse_model(Scenario, to_yaml(written)) == written


@pytest.mark.parametrize(
    ("water", "top", "message"),
    [
        ({"volume_strength_db": ((5.0, -70.0), (3.0, -60.0))}, {}, "is not below the row above"),
        ({"volume_strength_db": ()}, {}, "has no rows"),
        ({"patches": [{**SCHOOL, "position": (0.0, 60.0, 25.0)}]}, {}, "is below the seabed"),
        ({"patches": [SCHOOL, SCHOOL]}, {}, "is taken"),
        ({"patches": [{**SCHOOL, "label": "water"}]}, {}, "is taken"),
        ({"patches": [{**SCHOOL, "label": ""}]}, {}, "at least 1 character"),
        ({"volume_strength_db": -70}, {"paths": {"geometry": "slice"}}, "a slice, which is one plane"),
        ({"patches": [SCHOOL]}, {"paths": {"engine": "tracer"}, "field": "incoherent"}, "not simulated by the tracer"),
    ],
)
def test_slips_are_reported_with_the_fix(water, top, message):
    """What is wrong, in words that name it."""
    with pytest.raises(ValidationError, match=message):
        scene(water, **top)


def test_water_that_no_beam_reaches_is_reported():
    """Causes that leave the water out are a caution, not a fault."""
    with pytest.warns(PhysicsWarning, match="water is not among them"):
        scene({"volume_strength_db": -70}, paths={"contributions": ["seabed"]})
