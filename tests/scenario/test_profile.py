"""A scenario with layered water reports the errors of its profile, and records what it read."""

import warnings

import pytest

import insonify
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.template import template_text
from insonify.scenario.write import to_yaml
from insonify.validity import PhysicsWarning

NOMINAL = template_text("nominal")
GOOD = "depth,speed\n0,1510\n8,1510\n14,1490\n20,1490\n"


@pytest.fixture
def written(tmp_path):
    """Writes a nominal scenario with other water, and a table beside it; gives the file."""

    def write(water: str, table: str = GOOD):
        (tmp_path / "cast.csv").write_text(table)
        file = tmp_path / "summer.yaml"
        file.write_text(NOMINAL.replace("sound_speed: 1500 m/s", water))
        return file

    return write


def messages(file) -> list[str]:
    """The lines that the author of a file gets, without its folder."""
    with pytest.raises(ScenarioError) as caught:
        insonify.load_scenario(file)
    return [line.replace(f"{file.parent}/", "") for line in str(caught.value).splitlines()]


def test_a_table_is_looked_for_beside_the_scenario(written):
    """Wherever the program runs; what was read comes back from the recorded text alone."""
    file = written("profile: cast.csv")
    scenario = insonify.load_scenario(file)
    (file.parent / "cast.csv").unlink()
    assert scenario.water.layered
    assert parse_model(Scenario, to_yaml(scenario)) == scenario
    assert scenario.water.profile.sha256 in to_yaml(scenario) and "cast.csv" in to_yaml(scenario)


FIRST = next(i for i, line in enumerate(NOMINAL.splitlines(), 1) if line.startswith("  sound_speed: 1500 m/s"))
MISTAKES = {
    "profile: nowhere.csv": (0, "water.profile: nowhere.csv is not in the folder"),
    "profile:\n  - [0, 1500]\n  - [20, 15]": (2, "water.profile.1.1: 15 m/s is no speed of any water (1300 to"),
    "profile:\n  - [0, 1500]\n  - [20, .nan]": (2, "water.profile.1.1: .nan is not a finite number"),
    "profile:\n  - [9 m, 1500]\n  - [0 km, 1500]": (2, "water.profile.1.0: 0 m comes after 9 m"),
    "profile:\n    depth: [0, 20]\n    speed: [1500, fast]": (2, "water.profile.speed.1: 'fast' is not a speed"),
    "profile: [[0, 1500]]": (0, "water.profile: 1 depth(s) make no profile"),
    "profile: yes": (0, "water.profile: yes means true in YAML; it should be a sound-speed profile"),
    "profile: [[0, 1500], [15, 1500]]": (0, "water.profile: ends at 15 m, above the seabed (20 m). Add a row for 20 m"),
    "profile: [[1, 1500], [25, 1500]]": (0, "water.profile: begins at 1 m"),
    "profile: cast.csv\n  sound_speed: 1500": (0, "water.profile: sound_speed is given as well"),
    "profile: cast.csv\n  smoothing: 1 s": (1, "water.smoothing: 1 s is not a length"),
}  # fmt: skip


@pytest.mark.parametrize("water", MISTAKES)
def test_one_mistake_gets_one_line_with_its_location(written, water):
    """File, line, field, value, limits, way out."""
    after, message = MISTAKES[water]
    (line,) = messages(written(water))
    assert line.startswith(f"summer.yaml:{FIRST + after}: {message}")
    assert line.count(".") > 2 and line.endswith((".", "?"))


def test_a_fault_of_the_table_names_its_line(written):
    """Both files are named, each with a line."""
    (line,) = messages(written("profile: cast.csv", "depth,speed\n0,1510\n8,nan\n"))
    assert line.startswith(f"summer.yaml:{FIRST}: water.profile:")
    assert "cast.csv, line 3, column 2 (speed): nan m/s is not possible" in line


def cautions(file) -> list[str]:
    """Warnings of a scenario without faults."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        insonify.load_scenario(file)
    assert all(word.category is PhysicsWarning for word in caught)
    return [str(word.message) for word in caught]


def test_a_kink_that_gathers_rays_is_reported_with_the_fix(written):
    """Depth, jump, where it begins; and rounding is the fix."""
    sharp = "profile: [[0, 1520], [5, 1505], [20, 1490]]"
    (word,) = cautions(written(sharp))
    assert word.startswith("water.profile: the gradient jumps by 2 1/s at 5 m") and "water.smoothing" in word
    assert cautions(written(sharp + "\n  smoothing: 1 m")) == []


def test_kinks_beyond_what_is_received_are_not_reported(written):
    """The window ends before its range, or the seabed lies above it."""
    file = written("profile: [[0, 1520], [5, 1505], [20, 1490]]")
    file.write_text(file.read_text().replace("[0 ms, 240 ms]", "[0 ms, 60 ms]"))
    assert not any("caustic" in word for word in cautions(file))
    assert cautions(written("profile: [[0, 1490], [25, 1505], [30, 1520]]")) == []
