"""Models that are made in Python refuse wrong arguments with the advice that a file gets."""

import pickle

import numpy as np
import pytest
from pydantic import ValidationError

import insonify
from insonify.scene import Box, Sphere
from insonify.sonar import LineArray
from oracles.scenes import nominal

CALLS = {
    "missing": (lambda: Box(position=(0, 50)), "Box: size: missing; it should be a list of 3. Give size=..."),
    "range": (lambda: Box(position=(0, 50), size=(1, 1, "-30 cm")),
              "Box: size.2: -30 cm is out of range (above 0, to 100000 cm). Did you mean 30 cm?"),
    "unknown": (lambda: Sphere(position=(0, 50), diametre=1, diameter=1),
                "Sphere: diametre: unknown key 'diametre'; did you mean 'diameter'?"),
    "unit": (lambda: LineArray(length="3 Hz"), "LineArray: length: 3 Hz is not a length; use m, km, cm, mm, ft."),
    "choice": (lambda: LineArray(length=1, element="omny"), "LineArray: element: 'omny' is not known here (one of "
               "omni, baffled, cosine, piston). Did you mean 'omni'?"),
    "array": (lambda: Box(position=np.array([0.0, 50.0]), size=np.array([1.0, 1.0, 0.0])),
              "Box: size.2: 0.0 m is out of range (above 0, to 1000 m)."),
    "object": (lambda: LineArray(length=1 + 2j), "LineArray: length: (1+2j) where a length in m should be."),
    "copy": (lambda: Box(position=(0, 50), size=(1, 1, 1)).model_copy(update={"size": (1, 1, 0)}),
             "Box: size.2: 0 m is out of range (above 0, to 1000 m)."),
    "together": (lambda: insonify.Scenario(sonar=nominal().sonar, track={"kind": "static", "position": (0, 0, 25)}),
                 "Scenario: track.position.2: 25 m puts the transmit array at or below the seabed (20 m)"),
}  # fmt: skip


@pytest.mark.parametrize("call", CALLS)
def test_arguments_are_refused_with_advice(call):
    """Model, field, value, allowed range and fix in one line; a ValueError, as of any argument."""
    make, advice = CALLS[call]
    with pytest.raises(ValueError, match=r"^\w+: ") as caught:
        make()
    assert str(caught.value).startswith(advice) and len(str(caught.value).splitlines()) == 1
    assert "pydantic" not in str(caught.value) and repr(caught.value) == str(caught.value)


def test_a_scenario_without_arguments_names_what_is_missing():
    """All of it, in the words of a file."""
    with pytest.raises(ValueError, match="sonar") as caught:
        insonify.Scenario()
    sonar, track = str(caught.value).splitlines()
    assert sonar.startswith("Scenario: sonar: missing; it should be a group of keys (source_level_db, ")
    assert track.endswith("Give track=...")


def test_the_errors_of_the_validator_stay():
    """By their kinds and locations; after a pickle, and within another model."""
    with pytest.raises(ValidationError) as caught:
        Box(position=(0, 50), size=(1, 1, -1), lenght=3)
    errors = caught.value.errors()
    assert [(one["type"], one["loc"]) for one in errors] == [
        ("greater_than", ("size", 2)),
        ("extra_forbidden", ("lenght",)),
    ]
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and again.errors() == errors
    with pytest.raises(ValueError, match="Scenario: ") as outer:
        insonify.Scenario(sonar=nominal().sonar, track=nominal().track, targets=[{"shape": "box", "size": (1, 1, -1)}])
    assert str(outer.value).splitlines()[-1] == (
        "Scenario: targets.0.size.2: -1 m is out of range (above 0, to 1000 m). Did you mean 1 m?"
    )
