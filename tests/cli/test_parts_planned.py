"""A plan is a script that runs, and a status names what is missing."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from insonify.cli import main
from insonify.estimates import run_cost
from insonify.formats import shards
from insonify.formats.zarr_store import create_recording, write_ping
from insonify.records.recording import RecordingLayout

SAME = {"scenario": "title: here", "seed": 1, "version": "0"}


@pytest.fixture
def harbour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """A scenario of one ping in an empty folder."""
    monkeypatch.chdir(tmp_path)
    main(["new", "our harbour"])
    capsys.readouterr()
    return Path("our harbour.yaml")


@pytest.mark.parametrize("options", [[], ["--sbatch", "--labels", "-o", "x y.zarr"]])
def test_a_plan_is_a_script(harbour: Path, capsys: pytest.CaptureFixture[str], options: list[str]) -> None:
    """The shell can read it; it runs one part a task, and states time and memory."""
    text = harbour.read_text().replace("pings: 1", "pings: 30")
    harbour.write_text(text)
    assert main(["plan", str(harbour), "--tasks", "8", *options]) == 0
    script = capsys.readouterr().out
    assert subprocess.run(["bash", "-n"], input=script, text=True, check=False).returncode == 0
    assert "# each of 8 tasks, on one core: 4 pings, about" in script
    if options:
        for line in ("#SBATCH --job-name=our-harbour\n", "#SBATCH --output=our-harbour-%a.log\n",
                     "#SBATCH --array=1-8\n", "#SBATCH --time=0:", "#SBATCH --mem=", '--part "$SLURM_ARRAY_TASK_ID/8"',
                     "insonify run 'our harbour.yaml' -o 'x y.zarr' --labels --threads 1"):  # fmt: skip
            assert line in script
        assert script.index("#SBATCH") < script.index("\n# ")  # SLURM reads until the first command
    else:
        shown = script.splitlines()[-1].replace("insonify", "echo", 1)
        output = subprocess.run(["bash", "-c", shown], capture_output=True, text=True, check=True).stdout
        assert sorted(line.split()[-1] for line in output.splitlines()) == [f"{k}/8" for k in range(1, 9)]
        assert "run our harbour.yaml -o our harbour.zarr" in output
    assert main(["plan", str(harbour), "--tasks", "31"]) == 2
    assert "--tasks 31: the track has 30 pings. Give 30 at most" in capsys.readouterr().err


@pytest.mark.parametrize(("pings", "shards"), [(50, 50), (1000, 63), (3000, 66)])
def test_a_plan_for_a_store_has_no_more_tasks_than_shards(
    harbour: Path, capsys: pytest.CaptureFixture[str], pings: int, shards: int
) -> None:
    """Single pings up to 64 of them, then shards of 16 small ones or more; on a disk, any number of tasks."""
    harbour.write_text(harbour.read_text().replace("pings: 1", f"pings: {pings}"))
    url = "file:///plans/a.zarr"
    assert main(["plan", str(harbour), "--tasks", str(shards), "-o", url]) == 0
    capsys.readouterr()
    if shards < pings:
        assert main(["plan", str(harbour), "--tasks", str(shards + 1), "-o", url]) == 2
        message = capsys.readouterr().err
        assert f"{url} will have {shards} shard" in message and f"Give {shards} at most" in message
        assert main(["plan", str(harbour), "--tasks", str(shards + 1)]) == 0


def test_a_plan_in_memory_is_refused(harbour: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each task is a process of its own, and would leave nothing."""
    assert main(["plan", str(harbour), "--tasks", "1", "-o", "memory://plans/a.zarr"]) == 2
    message = capsys.readouterr().err
    assert "-o memory://plans/a.zarr: each task is a process" in message and "s3://" in message


def test_a_part_without_pings_is_reported(harbour: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """None of those requested, or more parts than pings: a warning, and a job array goes on; a part with one is silent.

    Parts are those of all pings, not of a range.
    """
    text = harbour.read_text().replace("pings: 1", "pings: 8").replace("0 ms, 240 ms", "0 ms, 5 ms")
    harbour.write_text(text)
    for options, warning in (
        (["2/4", "--pings", "0:2"], r"part 2/4 is pings 2 to 3 of .*a\.zarr, and none of them is requested"),
        (["1/9"], r"part 1/9 has no pings: .*a\.zarr has 8 pings, which make fewer parts"),
        (["2/4", "--pings", "0:3"], ""),
    ):
        assert main(["run", str(harbour), "-o", "a.zarr", "--quiet", "--part", *options]) == 0
        message = capsys.readouterr().err
        assert re.search(warning, message) if warning else "part" not in message
    capsys.readouterr()
    assert main(["status", "a.zarr"]) == 0
    assert "1 of 8 pings recorded" in capsys.readouterr().out


def test_a_plan_on_a_slow_machine_gives_tasks_more_time(
    harbour: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ten times the pace, ten times the minutes of each task, to the minute; memory is the same."""
    harbour.write_text(harbour.read_text().replace("pings: 1", "pings: 20000"))
    limits = []
    for pace in (1.0, 10.0):
        monkeypatch.setattr(run_cost, "machine_pace", lambda pace=pace: pace)
        assert main(["plan", str(harbour), "--tasks", "2", "--sbatch"]) == 0
        lines = capsys.readouterr().out.splitlines()
        hours, minutes, _ = next(line for line in lines if "--time=" in line).split("=")[1].split(":")
        memory = next(line for line in lines if "--mem=" in line)
        limits.append((60 * int(hours) + int(minutes), memory))
    assert limits[1][0] == pytest.approx(10 * limits[0][0], abs=10) and limits[0][1] == limits[1][1]


def test_a_status_names_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pings as --pings takes them, parts as --array takes them; a folder that is no recording is refused."""
    monkeypatch.setattr(shards, "FEWEST_PINGS", 4)
    monkeypatch.setattr(shards, "MOST_PINGS", 4)
    path, place = tmp_path / "a.zarr", np.zeros((20, 3))
    layout = RecordingLayout("intensity", np.arange(3.0), np.arange(20.0), np.zeros(1), place, place)
    create_recording(path, layout, SAME)
    for ping in (0, 1, 2, 3, 9, 16, 17, 18, 19):
        write_ping(path, ping, np.ones((1, 3)))
    assert main(["status", str(path), "--tasks", "5"]) == 0
    output = capsys.readouterr().out
    assert "9 of 20 pings recorded" in output and "9 of them loose" in output
    assert "missing: 4:9, 10:16, by --pings" in output
    assert "unfinished parts of 5: 2-4 (sbatch --array=2-4)" in output
    for ping in set(range(20)) - {0, 1, 2, 3, 9, 16, 17, 18, 19}:
        write_ping(path, ping, np.ones((1, 3)))
    assert main(["status", str(path), "--tasks", "5"]) == 0
    output = capsys.readouterr().out
    assert "all 20 pings recorded" in output and "missing" not in output and "unfinished parts of 5: none" in output
    assert main(["status", str(tmp_path)]) == 2
    assert "not a recording" in capsys.readouterr().err
