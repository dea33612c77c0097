"""Claims about changing a scenario in Python: by paths, checked as a file is, and never without a word."""

import pickle
import warnings
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

import insonify
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.ocean.water import Water
from insonify.scenario.load import load_scenario, parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.scene.surface import Surface

TEMPLATES = sorted((Path(insonify.__file__).parent / "scenario" / "templates").glob("*.yaml"))
NOMINAL = next(path for path in TEMPLATES if path.stem == "nominal")


@pytest.fixture(scope="module")
def nominal() -> Scenario:
    """The nominal scene."""
    return load_scenario(NOMINAL)


def test_equal_scenarios_have_equal_hashes_and_changed_ones_have_their_own(nominal):
    """A hash is kept with its model alone: a copy with changes, and one from another process, evaluate their own."""
    kept = hash(nominal)
    assert hash(nominal.unchecked_copy(seed=nominal.seed + 1)) != kept != hash(nominal.with_("seed", 99))
    assert not hasattr(pickle.loads(pickle.dumps(nominal)), "_hash")  # texts have other hashes there
    assert hash(pickle.loads(pickle.dumps(nominal))) == hash(nominal.with_("seed", nominal.seed)) == kept


@pytest.mark.parametrize("file", TEMPLATES, ids=lambda path: path.stem)
def test_nothing_but_the_named_value_changes(file):
    """Of every template: another seed is the file with another seed, and the old one stays as it was."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        first = load_scenario(file)
        other = first.with_("seed", 7)
        assert (first.seed, other.seed) != (7, 1)
        assert other.with_(seed=first.seed) == first
        assert to_yaml(other) == to_yaml(first).replace(f"\nseed: {first.seed}\n", "\nseed: 7\n")


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("track.heading", "90 deg", np.pi / 2),
        ("sonar.pulse.frequency", "90 kHz", 90e3),
        ("water.noise_level_db", "30 dB", 30.0),
        ("targets.0.position", [5, "151 m"], (5.0, 151.0)),
        ("targets.0.position.1", "152 m", 152.0),
        ("targets.0.scattering.strength_db", -12, -12.0),
        ("track.motion.roll", {"rms": "1 deg", "period": "5 s"}, None),
        ("water.inhomogeneity.rms_index", 1e-5, 1e-5),
        ("paths.families", ("D", "S"), ("D", "S")),
        ("sonar.receive.steer", np.array([0.0, 0.01]), (0.0, 0.01)),
        ("surface", Surface(reflection="statistical", wind_speed=6), Surface(reflection="statistical", wind_speed=6)),
        ("targets", [], ()),
    ],
)
def test_a_value_is_written_as_in_a_file(nominal, path, value, expected):
    """Units, lists, indices, groups that were left out, arrays and models."""
    changed = nominal.with_({path: value} if "inhomogeneity" not in path else {path: value, **UNEVEN})
    found: object = changed
    for step in path.split("."):
        found = found[int(step)] if step.isdigit() else getattr(found, step)
    if expected is not None:
        assert found == expected or np.allclose(found, expected)
    assert parse_model(Scenario, to_yaml(changed)) == changed


UNEVEN = {"water.inhomogeneity.correlation_length": "1 m"}


def test_several_values_fit_together(nominal):
    """A wind and the surface that it moves, in either form: neither would do alone."""
    flat = nominal.with_("surface", Surface())
    by_paths = flat.with_({"surface.reflection": "statistical", "surface.wind_speed": "6 m/s"})
    assert by_paths.surface.wind_speed == 6 and by_paths.surface.reflection == "statistical"
    assert flat.with_(surface__reflection="statistical", surface__wind_speed="6 m/s") == by_paths
    with pytest.raises(ScenarioError, match="moves a statistical surface only"):
        flat.with_("surface.wind_speed", "6 m/s")


def test_a_later_change_replaces_earlier_ones_below_its_path(nominal):
    """Without a trace of their text: targets that were moved and then left out are left out."""
    assert nominal.with_({"targets.0.position.1": "152 m", "targets": []}) == nominal.with_("targets", [])


def test_what_was_left_out_stays_left_out(nominal):
    """A profile takes the place of the sound speed that is not written, with no word about the two."""
    plain = nominal.with_("water", Water())
    layered = plain.with_("water.profile", [["0 m", 1510], ["20 m", 1490]])
    assert layered.water.layered


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"surface.wind_sped": 3}, ["surface.wind_sped", "did you mean 'wind_speed'"]),
        ({"surfce.wind_speed": 3}, ["surfce", "did you mean 'surface'"]),
        ({"seeed": 3}, ["did you mean 'seed'"]),
        ({"track.heading": "90 degrees"}, ["track.heading", "90 degrees", "deg"]),
        ({"track.heading": 90}, ["90 rad is out of range", "Did you mean 90 deg?"]),
        (
            {"sonar.pulse.frequency": 450, "sonar.pulse.duration": 0.2},
            ["sonar.pulse.frequency", "Did you mean 450 kHz?"],
        ),
        ({"track.window": [0, 240]}, ["track.window.1", "Did you mean 240 ms?"]),
        ({"targets.3.position": [0, 1]}, ["targets has indices 0 to 0"]),
        ({"targets.box.position": [0, 1]}, ["targets is a list", "targets.0"]),
        ({"water.patches.0.position": [0, 1, 2]}, ["water.patches has no entries", "as a whole"]),
        ({"seed.more": 1}, ["seed is 1, which has no keys"]),
        ({"water.sound_speed": True}, ["water.sound_speed"]),
        ({"water.ph": float("nan")}, ["water.ph", "finite"]),
        ({"track.position.2": "25 m"}, ["track.position.2", "below the seabed"]),
        ({"seed": -1, "water.salinity": "lots"}, ["seed", "water.salinity"]),
    ],
)
def test_a_change_that_means_nothing_is_refused_with_the_fix(nominal, changes, words):
    """Unknown keys and indices, wrong units and ranges, and faults between parts; several at once."""
    with pytest.raises(ScenarioError) as run_refusal:
        nominal.with_(changes)
    for word in words:
        assert word in str(run_refusal.value)
    assert ":0:" not in str(run_refusal.value) and ":1:" not in str(run_refusal.value)


@pytest.mark.parametrize(("paths", "values"), [("seed", ()), ("", (1,)), ({"seed": 1}, (2,)), ("seed", (1, 2))])
def test_a_path_and_its_value_come_together(nominal, paths, values):
    """One without the other is a mistake of the caller's."""
    with pytest.raises(TypeError, match="with_"):
        nominal.with_(paths, *values)


def test_a_bare_whole_angle_gets_a_warning(nominal):
    """5 is read as radians; with a unit nothing is reported."""
    with pytest.warns(UserWarning, match=r"track.heading: 5 .* rad \(286.5 deg\)"):
        nominal.with_("track.heading", 5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        nominal.with_("track.heading", "5 deg")


def test_a_copy_with_an_unknown_field_is_refused(nominal):
    """The nearest field is named."""
    with pytest.raises(AttributeError, match="Scenario has no field 'surfce'; did you mean 'surface'"):
        nominal.model_copy(update={"surfce": nominal.surface})
    with pytest.raises(AttributeError, match="'headng'; did you mean 'heading'"):
        nominal.track.model_copy(update={"headng": 1.0})


def test_a_copy_is_checked_as_a_new_model_is(nominal):
    """Numbers with units are turned into SI; what is refused is refused at once, not when pings are simulated."""
    assert nominal.track.model_copy(update={"heading": "90 deg"}).heading == pytest.approx(np.pi / 2)
    with pytest.raises(ValidationError, match="furlong"):
        nominal.track.model_copy(update={"heading": "9 furlongs"})
    with pytest.raises(ValidationError, match="below the seabed"):
        nominal.model_copy(update={"track": nominal.track.model_copy(update={"position": (0, 0, 30)})})
    with pytest.raises(ValidationError, match="bandwidth"):
        nominal.sonar.pulse.model_copy(update={"kind": "lfm"})


def test_a_copy_without_changes_is_equal(nominal):
    """Whole or deep; and one change leaves all the rest."""
    assert nominal.model_copy() == nominal and nominal.model_copy(deep=True) == nominal
    assert nominal.model_copy(update={"seed": 5}).model_copy(update={"seed": nominal.seed}) == nominal
