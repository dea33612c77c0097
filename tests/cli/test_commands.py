"""The command line ends with paths, advice and exit codes, never with a traceback."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from insonify.cli import main
from insonify.formats.zarr_store import create_recording
from insonify.records.recording import RecordingLayout


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def edited(here: Path, old: str, new: str) -> str:
    """A nominal scenario with one line changed; its name."""
    main(["new", "harbour"])
    path = here / "harbour.yaml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path.name


def test_a_new_scenario_has_nothing_wrong(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`new` writes a file that `check` accepts, and states its name on stdout."""
    assert main(["new", "harbour"]) == 0
    assert capsys.readouterr().out == "harbour.yaml\n"
    assert main(["check", "harbour.yaml"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("harbour.yaml: nothing wrong\n") and err == ""


def test_new_never_overwrites(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a person wrote is theirs."""
    (here / "harbour.yaml").write_text("mine")
    assert main(["new", "harbour"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert (here / "harbour.yaml").read_text() == "mine"


MISTAKES = [
    ("depth: 20 m", "dept: 20 m", "seabed.dept: unknown key 'dept'; did you mean 'depth'?"),
    ("depth: 20 m", "depth: 20 kHz", "seabed.depth: 20 kHz is not a length; use m, km, cm, mm, ft."),
    ("depth: 20 m", "depth: -20 m", "seabed.depth: -20 m is out of range (0.1 to 12000 m). Depths are positive"),
    ("depth: 20 m", "depth: .nan", "seabed.depth: .nan is not a finite number"),
    ("base_depth: null", "base_depth: 25 m", "targets.0.base_depth"),
    ("base_depth: null", "base_depth: -0.5 m", "targets.0.base_depth"),
    ("[0 m, 0 m, 11 m]", "[0 m, 0 m, 21 m]", "track.position.2: 21 m "),
    ("[0 m, 0 m, 11 m]", "[0 m, 0 m, -1 m]", "track.position.2: -1 m "),
    ("bandwidth: 20 kHz", "bandwidth: 200 kHz", "sonar.receiver.bandwidth: "),
    ("pings: 1", "pings: 0", "track.pings: "),
    (
        "{law: lambert, strength_db: -27}",
        "{law: lambert, strength_db: .inf}",
        "seabed.scattering.strength_db: .inf is not a finite number (-400 to -4.9715 dB).",
    ),
    ("bearing: 90 deg", "bearing: 90", "sonar.mounting.bearing: 90 rad is out of range"),
]


@pytest.mark.parametrize(("old", "new", "advice"), MISTAKES)
@pytest.mark.parametrize("command", ["check", "run"])
def test_a_wrong_scenario_is_reported_with_its_line(
    here: Path, capsys: pytest.CaptureFixture[str], command: str, old: str, new: str, advice: str
) -> None:
    """One line on stderr, exit code 2, nothing written."""
    file = edited(here, old, new)
    text = (here / file).read_text(encoding="utf-8")
    line = 1 + next(n for n, words in enumerate(text.splitlines()) if new in words)
    capsys.readouterr()
    assert main([command, file] + (["-o", "out.zarr"] if command == "run" else [])) == 2
    out, err = capsys.readouterr()
    (message,) = err.splitlines()
    assert out == ""
    where, _, problem = message.partition(": ")
    assert problem.startswith(advice)
    assert where == f"harbour.yaml:{line}" or "size" in advice  # the height's line, two above
    assert [entry.name for entry in here.iterdir()] == ["harbour.yaml"]


@pytest.mark.parametrize(
    "words",
    [
        ["run", "no.yaml", "-o", "out.zarr"],
        ["run", "harbour.yaml", "-o", "out.zarr", "--pings", "3:2"],
        ["run", "harbour.yaml", "-o", "out.zarr", "--pings", "5:"],
        ["run", "harbour.yaml", "-o", "out.zarr", "--pings", "one"],
        ["run", "harbour.yaml", "-o", "out.zarr", "--threads", "0"],
        ["run", "harbour.yaml"],
        ["rum"],
        ["new", "x", "--template", "nomnal"],
        ["show", "no.zarr", "-o", "out.png"],
        ["show", "begun.zarr", "-o", "out.doc"],
        ["show", "begun.zarr", "-o", "nowhere/out.png"],
        ["explain", "begun.zarr", "--time", "201.9 kHz"],
        ["explain", "begun.zarr", "--time", "9 s"],
        ["explain", "begun.zarr", "--time", "1 ms", "--ping", "7"],
    ],
    ids=" ".join,
)
def test_a_wrong_command_writes_nothing(here: Path, capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    """Exit code 2, something on stderr, nothing on stdout or on disk."""
    main(["new", "harbour"])
    empty = np.zeros((2, 3))
    layout = RecordingLayout("pressure", np.arange(5) / 1e3, np.arange(2.0), np.zeros(1), empty, empty)
    create_recording("begun.zarr", layout, {"scenario": ""})
    before = sorted(here.rglob("*"))
    capsys.readouterr()
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == "" and err
    assert "Traceback" not in err
    assert sorted(here.rglob("*")) == before


def test_a_failed_run_is_distinguished_from_a_wrong_input(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit code 1, and one line that states what broke."""

    def breaks(path: Path) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr("insonify.scenario.load.load_scenario", breaks)
    assert main(["check", "harbour.yaml"]) == 1
    assert capsys.readouterr().err.startswith("the run failed: OSError: the disk is full")


@pytest.mark.parametrize("command", ["new", "check", "run", "show", "explain", "info", "paper"])
def test_every_command_shows_an_example(capsys: pytest.CaptureFixture[str], command: str) -> None:
    """--help of each command has a line to copy."""
    assert main([command, "--help"]) == 0
    assert f"Example: insonify {command}" in capsys.readouterr().out


def test_help_names_its_words_alike(capsys: pytest.CaptureFixture[str]) -> None:
    """Places and numbers in capitals, ranges of pings by example, no names of types; the first page has an example."""
    problem = {}
    for command in ("new", "check", "run", "show", "explain", "info", "paper"):
        assert main([command, "--help"]) == 0
        problem[command] = capsys.readouterr().out
        for strange in ("list[int]", "<int range>", "{file}", "{name}"):
            assert strange not in problem[command]
    assert "just 7" in " ".join(problem["run"].split())
    assert main(["--help"]) == 0
    assert "Example: insonify new harbour" in capsys.readouterr().out.splitlines()[-1]


def test_help_waits_for_nothing_heavy() -> None:
    """`insonify --help` imports neither numpy nor the packages that bring it."""
    heavy = "{'numpy', 'numba', 'scipy', 'xarray', 'zarr', 'pydantic', 'matplotlib', 'yaml', 'rich'}"
    script = f"import sys; from insonify.cli import main; main(['--help']); sys.exit(bool({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "explain" in done.stdout


def described(here: Path, targets: list[dict[str, Any]]) -> str:
    """A nominal scenario with these targets; its name."""
    main(["new", "nominal"])
    scenario = yaml.safe_load((here / "nominal.yaml").read_text(encoding="utf-8"))
    copied = json.loads(json.dumps(targets))  # of shared lists, YAML would write aliases
    (here / "nominal.yaml").write_text(yaml.safe_dump(scenario | {"targets": copied}), encoding="utf-8")
    return "nominal.yaml"


def test_many_warnings_alike_are_counted_not_printed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """100 equal targets, 99 warnings that differ in numbers and labels: five of them, and the number of the others."""
    target: dict[str, Any] = {"shape": "sphere", "diameter": "0.5 m", "position": ["30 m", "50 m"]}
    assert main(["check", described(here, [target | {"label": f"s{k}"} for k in range(100)])]) == 0
    errors = capsys.readouterr().err.splitlines()
    assert sum("their echoes add up" in line for line in errors) == 5
    assert errors[-1] == "94 more warnings like these"


def test_many_errors_alike_are_counted_not_printed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """100 targets with a wrong key, and one with another: five lines, that of the other, and the number of the rest."""
    target: dict[str, Any] = {"shape": "sphere", "diameter": "0.5 m", "position": ["30 m", "50 m"], "law": "x"}
    targets: list[dict[str, Any]] = [target | {"label": f"s{k}"} for k in range(100)]
    targets.append(target | {"label": "last", "burial": "none"})
    assert main(["check", described(here, targets)]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert sum("unknown key 'law'" in line for line in errors) == 5 and any("burial" in line for line in errors)
    assert errors[-1] == "and 96 more lines like these"
