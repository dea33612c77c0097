"""Claims about starting: commands load what they need and no more, and state when they compile."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from insonify.cli import compile_progress, main
from insonify.recording_run import record
from insonify.scenario import platform_poses
from insonify.scenario.load import load_scenario

HARBOUR = Path(__file__).parents[2] / "examples" / "harbour.yaml"
NOMINAL = Path(__file__).parents[2] / "examples" / "nominal.yaml"
LOADED = "import sys; from insonify.cli import main; code = main(sys.argv[1:]); print(*sys.modules, sep=chr(10))"


@pytest.fixture(autouse=True)
def progress_shown(monkeypatch, print_progress):
    """Progress of the compiler on stderr, as users see it."""
    monkeypatch.setattr(compile_progress.Progress, "_print", print_progress)


def loaded(*words: str) -> set[str]:
    """Packages, and parts of scipy, that a command has loaded when it ends."""
    done = subprocess.run([sys.executable, "-c", LOADED, *words], capture_output=True, text=True, check=True)
    names = [line.split(".") for line in done.stdout.splitlines() if " " not in line]
    return {name[0] for name in names} | {".".join(name[:2]) for name in names if name[0] == "scipy"}


def test_help_loads_no_array_library():
    """The words of the command line alone: no numpy, no compiler."""
    assert not loaded("--help") & {"numpy", "numba", "scipy", "pydantic"}


def test_check_loads_neither_compiler_nor_pictures_nor_recordings_nor_statistics():
    """Numba, tables, stores, pictures and scipy take seconds to load; a check of the nominal scene uses none."""
    heavy = {"numba", "xarray", "pandas", "zarr", "numcodecs", "matplotlib", "gsw"}
    parts = ("fft", "special", "linalg", "signal", "stats", "interpolate", "ndimage", "spatial", "optimize", "sparse")
    assert not loaded("check", str(NOMINAL)) & (heavy | {f"scipy.{part}" for part in parts})


def test_a_picture_of_a_scene_loads_neither_compiler_nor_geometry_of_scipy(tmp_path):
    """The footprint of a target is drawn triangle by triangle: no hull, whose library takes a third of a second."""
    names = loaded("show", str(NOMINAL), "-o", str(tmp_path / "scene.png"))
    assert "matplotlib" in names and not names & {"numba", "xarray", "scipy.spatial", "scipy.linalg"}


def test_a_picture_of_a_survey_loads_no_compiler(tmp_path):
    """A recording was simulated already: its waterfall needs no kernel, and no check of its scenario over relief."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        less = {"targets": (), "track.pings": 3, "track.window": ["0 ms", "20 ms"]}
        scenario = load_scenario(HARBOUR).with_(less | {"seabed.relief": [{"kind": "ripples", "wavelength": 1.5}]})
    out = record(scenario, tmp_path / "survey.zarr")
    assert not loaded("show", str(out), "-o", str(tmp_path / "survey.png")) & {"numba"}
    assert (tmp_path / "survey.png").stat().st_size > 0


def test_a_check_works_out_the_poses_once(monkeypatch):
    """Errors, warnings, cost and bands need the platforms ten times; they are computed once."""
    counted = []
    work_out = platform_poses._platforms
    monkeypatch.setattr(platform_poses, "_platforms", lambda scenario: counted.append(scenario) or work_out(scenario))
    assert main(["check", str(NOMINAL)]) == 0
    assert len(counted) == 1


def test_poses_follow_the_track_and_the_seed():
    """Another seed of a moving platform, or another track, has other poses: what is kept is of one scenario."""
    nominal = load_scenario(NOMINAL)
    moving = nominal.with_({"track.motion": {"heave": {"rms": "10 cm", "period": "5 s"}}, "track.pings": 3})
    first = platform_poses.platforms(moving).transmitter_poses.position
    other = platform_poses.platforms(moving.with_(seed=5)).transmitter_poses.position
    assert np.abs(first - other).max() > 1e-3
    np.testing.assert_array_equal(platform_poses.platforms(moving).transmitter_poses.position, first)
    assert not np.array_equal(platform_poses.platforms(nominal).transmitter_poses.position, first)


def test_a_command_that_compiles_reports_it_once(capsys):
    """A kernel that no cache holds: one line when the compiler begins, none for the kernels after it."""

    @njit
    def fresh(x: float) -> float:
        return x + 1.0

    compile_progress.report_compiling()
    assert fresh(1.0) + fresh(np.float32(2.0)) == 5.0
    output = capsys.readouterr()
    assert (
        output.out == ""
        and output.err == "compiling (once for this kind of scenario): the machine code is kept for later runs\n"
    )


@pytest.mark.parametrize("words", [["check"], ["info"]])
def test_every_command_begins_its_progress_anew(capsys, words):
    """The first kernel that a command compiles is announced, also where an earlier one has compiled."""
    compile_progress.report_compiling()
    compile_progress._PROGRESS[0].begin()
    capsys.readouterr()
    assert main([*words, str(NOMINAL)]) == 0
    compile_progress._PROGRESS[0].begin()
    assert (
        capsys.readouterr().err
        == "compiling (once for this kind of scenario): the machine code is kept for later runs\n"
    )


def test_a_command_that_compiles_nothing_is_silent(capsys):
    """Machine code from the cache is loaded without a word."""
    assert main(["info", str(NOMINAL)]) == 0
    assert capsys.readouterr().err == ""


def test_long_compilation_shows_progress(capsys, monkeypatch):
    """A line each five seconds, with the number of kernels so far."""
    now = [100.0]
    monkeypatch.setattr(compile_progress.time, "monotonic", lambda: now[0])
    progress = compile_progress.Progress()
    for seconds in (0.0, 2.0, 4.0, 1.0):
        progress.begin()
        now[0] += seconds
        progress.end()
    assert capsys.readouterr().err.splitlines()[1:] == ["compiling: 3 kernels so far"]
