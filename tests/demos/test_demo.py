"""Claims about demonstrations: files that agree with each other, numbers in words, nothing overwritten by default."""

import json
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.demos import demo
from insonify.formats.zarr_store import open_recording
from insonify.paper.checked_numbers import CheckedNumber
from insonify.scenario.load import load_scenario
from insonify.scenario.template import template_text
from insonify.scenario.write import to_yaml
from oracles.shown import small

NUMBERS = [
    CheckedNumber("bearing", 19.9, "deg", 20.0, 0.2, "where it was put"),
    CheckedNumber("width", 2.5, "deg", 2.0, 0.2, "pattern"),
    CheckedNumber("within 5 %", 99.0, "%", 98.0, None, "usual"),
    CheckedNumber("depths", 31234.0, "1"),
]


def test_every_demonstration_is_a_template_and_has_a_picture_of_its_own():
    """The files that `new` offers, each with what it shows written on its first lines."""
    for name in demo.DEMOS:
        text = template_text(name)
        assert text.lstrip().startswith("#") and "title:" in text
        assert (files("insonify.scenario") / "templates" / f"{name}.yaml").is_file()
    assert len(set(map(template_text, demo.DEMOS))) == len(demo.DEMOS)


def test_words_state_what_holds_and_what_does_not():
    """One line for each number, with its unit; what is only given is neither right nor wrong."""
    bearing, beam, share, count = demo.numbers_table(NUMBERS).splitlines()
    assert bearing.endswith("holds") and "19.9 deg" in bearing and "20 +- 0.2" in bearing
    assert beam.endswith("FAILS")
    assert share.endswith("holds") and "98 or more" in share
    assert "31234" in count and "expected" not in count


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=5))
def test_any_number_can_be_reported(values):
    """Great, small and negative ones, each on a line, and no line ends in a blank."""
    lines = demo.numbers_table([CheckedNumber("x", value, "m") for value in values]).splitlines()
    assert len(lines) == len(values) and all(line == line.rstrip() for line in lines)
    for line, value in zip(lines, values, strict=True):
        found = float(line.split()[1])
        assert found == pytest.approx(value, rel=1e-4, abs=0.5 if abs(value) >= 1e4 else 1e-300)
        assert not (found == 0 and "-" in line.split()[1])


def test_what_could_not_be_measured_is_reported():
    """NaN is a word of its own, and does not hold."""
    line = demo.numbers_table([CheckedNumber("width", float("nan"), "cm", 5.0, 0.5)])
    assert "nan" in line and line.endswith("FAILS")


@pytest.fixture
def quick(monkeypatch):
    """A demonstration of a sphere and a mine alone, in the window in which they are received."""
    scenario = small("forward-looking")
    text = to_yaml(scenario)
    monkeypatch.setattr(demo, "template_text", lambda name: text)
    return scenario


def test_a_demonstration_leaves_files_that_agree(tmp_path, quick, monkeypatch):
    """Scenario, recording, picture and table; the table states what the words state; a second time nothing is done."""
    pings = []
    shown = demo.show("forward-looking", tmp_path / "new" / "folder", on_ping=lambda *done: pings.append(done))
    assert [path.name for path in sorted(shown.scenario.parent.iterdir())] == [
        f"forward-looking.{suffix}" for suffix in ("json", "png", "yaml", "zarr")
    ]
    assert load_scenario(shown.scenario) == quick
    assert shown.picture.read_bytes().startswith(b"\x89PNG")
    held = json.loads(shown.table.read_text())
    assert held["demo"] == "forward-looking"
    assert [row["name"] for row in held["numbers"]] == [number.name for number in shown.numbers]
    for row, number in zip(held["numbers"], shown.numbers, strict=True):
        assert row["value"] == pytest.approx(number.value) and row["holds"] == number.holds
    assert pings and pings[-1] == (1, 1)
    sound = open_recording(shown.recording)["pressure"].values
    monkeypatch.setattr(demo, "_draw_product", lambda *paths: shown.numbers)
    again = demo.show("forward-looking", shown.scenario.parent)
    np.testing.assert_array_equal(open_recording(again.recording)["pressure"].values, sound)
    assert demo.numbers_table(again.numbers) == demo.numbers_table(shown.numbers)


def test_a_scenario_that_was_edited_is_not_overwritten(tmp_path, quick):
    """It is refused, with the two ways out, and every file is as it was."""
    mine = tmp_path / "forward-looking.yaml"
    mine.write_text("title: mine\n")
    with pytest.raises(FileExistsError, match=r"--overwrite; or run it yourself: insonify run"):
        demo.show("forward-looking", tmp_path)
    assert mine.read_text() == "title: mine\n" and list(tmp_path.iterdir()) == [mine]
