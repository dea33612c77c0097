"""From an empty folder to a picture and an explanation: the commands one after another, as a person types them."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from insonify.cli import main
from insonify.cli.progress import pace, progress
from insonify.formats.zarr_store import open_recording, recorded_pings
from insonify.scenario.load import load_scenario
from insonify.simulator import simulate

Captured = pytest.CaptureFixture[str]


def shortened(here: Path, **changes: str) -> Path:
    """The file of `new`, brought down to a slice of a few milliseconds and few pings."""
    assert main(["new", "bay"]) == 0
    path = here / "bay.yaml"
    text = path.read_text(encoding="utf-8")
    expected = {"window": "[199 ms, 206 ms]", "pings": "3", "geometry": "slice", "max_reflections": "1", **changes}
    for name, value in expected.items():
        text, found = re.subn(rf"^(\s*{name}:)[^#\n]*", rf"\1 {value}  ", text, count=1, flags=re.MULTILINE)
        assert found == 1, name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def bay(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a short scenario and its recording."""
    here = tmp_path_factory.mktemp("bay")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(here)
        shortened(here)
        assert main(["run", "bay.yaml", "-o", "bay.zarr"]) == 0
    return here


@pytest.fixture
def there(bay: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """That folder, stood in."""
    monkeypatch.chdir(bay)
    return bay


def test_each_command_states_what_it_made_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    """new, check, run, show: a line on stdout each, silence on stderr when nothing is shown, exit code 0.

    New hints at the schema once, where there is none; after its verdict, check may report what a finer recording would
    take.
    """
    monkeypatch.chdir(tmp_path)
    shortened(tmp_path, pings="2")
    out, err = capsys.readouterr()
    assert out == "bay.yaml\n" and err.endswith(": insonify schema\n") and err.count("\n") == 1
    for words, message in (
        (["check", "bay.yaml"], "bay.yaml: nothing wrong\n"),
        (["run", "bay.yaml", "-o", "bay.zarr"], "bay.zarr\n"),
        (["show", "bay.zarr", "-o", "bay.png"], "bay.png\n"),
    ):
        assert main(words) == 0
        out, err = capsys.readouterr()
        first, *more = out.splitlines(keepends=True)
        assert (first, err) == (message, "") and (not more or words[0] == "check")
    assert (tmp_path / "bay.png").read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in tmp_path.iterdir()} == {"bay.yaml", "bay.zarr", "bay.png"}


def test_what_the_command_stores_is_what_the_function_returns(there: Path) -> None:
    """`insonify run` and `simulate` of the same file: the same bits, and the scenario inside."""
    held = simulate(load_scenario("bay.yaml"))
    stored = open_recording("bay.zarr")
    np.testing.assert_array_equal(stored.pressure.values, held.pressure.values)
    assert stored.attrs["scenario"] == held.attrs["scenario"]
    assert stored.attrs["seed"] == held.attrs["seed"]


def test_the_recording_can_be_made_again_from_itself(there: Path) -> None:
    """The scenario kept in a recording is a scenario file: the same sound comes out of it."""
    (there / "again.yaml").write_text(open_recording("bay.zarr").attrs["scenario"], encoding="utf-8")
    assert main(["check", "again.yaml"]) == 0
    again = simulate(load_scenario("again.yaml"), pings=[1])
    np.testing.assert_array_equal(again.pressure.values[0], open_recording("bay.zarr").pressure.values[1])


def test_a_window_in_words_is_a_window_in_seconds(there: Path) -> None:
    """199 ms to 206 ms at 25 kHz: samples from 0.199 s on, 175 of them."""
    time = open_recording("bay.zarr").time.values
    assert time[0] == pytest.approx(0.199, abs=1e-12) and time.size == 175
    np.testing.assert_allclose(np.diff(time), 1 / 25e3)


def test_an_explanation_understands_any_unit_of_time(there: Path, capsys: Captured) -> None:
    """The same sample, whatever the unit; the result is a table of arrivals on stdout."""
    tables = []
    for when in ("201.9 ms", "0.2019 s", "0.2019", "201900 us"):
        assert main(["explain", "bay.zarr", "--time", when]) == 0, when
        out, err = capsys.readouterr()
        assert err == "", when
        tables.append(out)
    assert tables == 4 * [out]
    assert "box" in out and "seabed" in out and "dB" in out


def test_pings_are_explained_one_by_one(there: Path, capsys: Captured) -> None:
    """The last ping can be requested; the one after it is a wrong input that names the range."""
    assert main(["explain", "bay.zarr", "--ping", "2", "--time", "201.9 ms"]) == 0
    assert capsys.readouterr().out
    assert main(["explain", "bay.zarr", "--ping", "3", "--time", "201.9 ms"]) == 2
    assert "pings 0 to 2" in capsys.readouterr().err


def test_a_part_of_a_track_is_a_part_of_the_recording(there: Path, capsys: Captured) -> None:
    """--pings 1:2 leaves the others for later; the same command without it fills them in."""
    assert main(["run", "bay.yaml", "-o", "part.zarr", "--pings", "1:2"]) == 0
    assert recorded_pings("part.zarr").tolist() == [False, True, False]
    assert np.isnan(open_recording("part.zarr").pressure.values[0]).all()
    assert main(["run", "bay.yaml", "-o", "part.zarr", "--threads", "1"]) == 0
    np.testing.assert_array_equal(
        open_recording("part.zarr").pressure.values, open_recording("bay.zarr").pressure.values
    )
    capsys.readouterr()


def test_another_scenario_does_not_fall_into_the_same_recording(there: Path, capsys: Captured) -> None:
    """Exit code 2, the fix, and the recording as it was; with --overwrite it is replaced."""
    (there / "other.yaml").write_text(
        (there / "bay.yaml").read_text(encoding="utf-8").replace("strength_db: -27", "strength_db: -30"),
        encoding="utf-8",
    )
    assert main(["run", "bay.yaml", "-o", "mine.zarr", "--pings", "0"]) == 0
    before = open_recording("mine.zarr").pressure.values
    capsys.readouterr()
    assert main(["run", "other.yaml", "-o", "mine.zarr"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and "another scenario" in err and "--overwrite" in err
    np.testing.assert_array_equal(open_recording("mine.zarr").pressure.values, before)
    assert main(["run", "other.yaml", "-o", "mine.zarr", "--overwrite", "--pings", "0"]) == 0
    assert not np.array_equal(open_recording("mine.zarr").pressure.values[0], before[0])


def test_progress_is_for_people(capsys: Captured) -> None:
    """Into a pipe nothing is reported, requested to be quiet or not."""
    for quiet in (False, True):
        with progress(quiet) as on_ping:
            for n in range(3):
                on_ping(n, 2)
    assert capsys.readouterr() == ("", "")


def test_a_terminal_shows_how_far_the_run_is(monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    """On a terminal the bar goes to stderr, never to stdout; --quiet silences it there too."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for quiet in (True, False):
        with progress(quiet) as on_ping:
            on_ping(0, 2)
            on_ping(1, 2)
        out, err = capsys.readouterr()
        assert out == ""
        assert ("pings" in err) is (not quiet)


def test_a_warning_is_one_line_and_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    """A window longer than the interval is reported on stderr; the check still passes."""
    monkeypatch.chdir(tmp_path)
    shortened(tmp_path, interval="100 ms", pings="2")
    capsys.readouterr()
    assert main(["check", "bay.yaml"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("bay.yaml: nothing wrong but the warning above\n")
    (line,) = err.splitlines()
    assert line.startswith("warning: ") and "earlier pings are ignored" in line


def test_the_papers_geometry_comes_as_a_picture_and_its_numbers(tmp_path: Path, capsys: Captured) -> None:
    """Figure 10: every file that stdout names is there, the numbers are JSON."""
    assert main(["paper", "--figure", "10", "-o", str(tmp_path / "figures")]) == 0
    out, err = capsys.readouterr()
    files = [Path(line) for line in out.splitlines()]
    assert err == "" and {file.suffix for file in files} == {".png", ".json"}
    for file in files:
        assert file.stat().st_size > 0
    json.loads(next(file for file in files if file.suffix == ".json").read_text())


def test_a_figure_that_is_not_there_is_refused(tmp_path: Path, capsys: Captured) -> None:
    """Exit code 2, the figures there are, and no folder made."""
    assert main(["paper", "--figure", "99", "-o", str(tmp_path / "figures")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and "10, 11, 12, 13, 14" in err
    assert not (tmp_path / "figures").exists()


def test_the_version_is_the_packages(capsys: Captured) -> None:
    """--version prints it and stops."""
    from insonify import __version__

    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"{__version__}\n"


def test_a_rerun_states_what_was_there(there: Path, capsys: Captured) -> None:
    """One line on stderr: of a recording begun, how much; of a finished one, that nothing is left. Quiet: none."""
    assert main(["run", "bay.yaml", "-o", "again.zarr", "--pings", "0"]) == 0
    assert capsys.readouterr().err == ""
    assert main(["run", "bay.yaml", "-o", "again.zarr"]) == 0
    assert capsys.readouterr().err == "1 of 3 pings were there already\n"
    assert main(["run", "bay.yaml", "-o", "again.zarr"]) == 0
    assert capsys.readouterr().err.startswith("all 3 pings were there already, so nothing was left to do")
    assert main(["run", "bay.yaml", "-o", "again.zarr", "--quiet"]) == 0
    assert capsys.readouterr() == ("again.zarr\n", "")


@pytest.mark.parametrize(
    ("steps", "seconds", "text"),
    [(0, 3.0, "starting"), (2, 34.0, "17 s/ping"), (10, 4.0, "2.5 pings/s"), (3, 3.0, "1 pings/s")],
)
def test_a_pace_is_reported_in_the_unit_that_fits(steps: int, seconds: float, text: str) -> None:
    """Slow work in seconds a ping, fast work in pings a second, and none before the first ping."""
    assert pace(steps, seconds, "ping") == text


def test_a_ping_that_is_not_there_is_refused(there: Path, capsys: Captured) -> None:
    """Pictures and explanations of it: exit code 2, the command that would simulate it, and nothing on stdout."""
    assert main(["run", "bay.yaml", "-o", "begun.zarr", "--pings", "1"]) == 0
    capsys.readouterr()
    for words in (["explain", "begun.zarr", "--time", "202 ms"], ["show", "begun.zarr", "-o", "x.png", "--ping", "0"]):
        assert main(words) == 2
        out, err = capsys.readouterr()
        assert out == "" and "--ping 0: not simulated yet" in err and "insonify run FILE -o begun.zarr --pings 0" in err
    assert main(["show", "begun.zarr", "-o", "x.png", "--ping", "1", "--beam", "0"]) == 0


@pytest.mark.parametrize("command", [["explain", "bay.zarr", "--time", "202 ms"], ["show", "bay.zarr", "-o", "x.png"]])
def test_a_beam_that_is_not_there_is_refused(there: Path, capsys: Captured, command: list[str]) -> None:
    """Exit code 2 and the beams there are."""
    assert main([*command, "--beam", "1"]) == 2
    assert "--beam 1: the recording has only beam 0" in capsys.readouterr().err


def test_milliseconds_without_a_unit_are_guessed(there: Path, capsys: Captured) -> None:
    """A bare number is read as seconds; where milliseconds would fit, they are offered."""
    assert main(["explain", "bay.zarr", "--time", "202.5"]) == 2
    assert "read as 202.5 s, and the recording holds 199 to " in (err := capsys.readouterr().err)
    assert "did you mean 202.5 ms?" in err
    assert main(["explain", "bay.zarr", "--time", "94 ms"]) == 2
    assert "did you mean" not in capsys.readouterr().err


@pytest.mark.parametrize("name", ["harbour", "yes", "it's", "12"])
def test_a_new_file_names_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured, name: str) -> None:
    """Its title is its name, whatever YAML might read into that, and its comments name its own files."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", name]) == 0
    path = tmp_path / f"{name}.yaml"
    assert load_scenario(path).title == name
    text = path.read_text(encoding="utf-8")
    assert "nominal" not in text.lower()
    assert f"insonify show {shlex.quote(name + '.zarr')} -o {shlex.quote(name + '.png')}" in text
