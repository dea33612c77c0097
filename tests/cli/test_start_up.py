"""Claims about starting: commands load what they need and no more, and say when they compile."""

import subprocess
import sys
from pathlib import Path

import numpy as np
from numba import njit

from insonify.cli import compiling

NOMINAL = Path(__file__).parents[2] / "examples" / "nominal.yaml"
LOADED = "import sys; from insonify.cli import main; code = main(sys.argv[1:]); print(*sys.modules, sep=chr(10))"


def loaded(*words: str) -> set[str]:
    """Packages, and parts of scipy, that a command has loaded when it ends."""
    done = subprocess.run([sys.executable, "-c", LOADED, *words], capture_output=True, text=True, check=True)
    names = [line.split(".") for line in done.stdout.splitlines() if " " not in line]
    return {name[0] for name in names} | {".".join(name[:2]) for name in names if name[0] == "scipy"}


def test_help_loads_no_array_library():
    """The words of the command line alone: no numpy, no compiler."""
    assert not loaded("--help") & {"numpy", "numba", "scipy", "pydantic"}


def test_check_loads_neither_pictures_nor_recordings_nor_statistics():
    """Tables, stores, pictures and most of scipy take seconds to load; a check of the nominal scene uses none."""
    heavy = {"xarray", "pandas", "zarr", "numcodecs", "matplotlib", "gsw"}
    heavy |= {f"scipy.{part}" for part in ("signal", "stats", "interpolate", "ndimage", "spatial", "optimize")}
    assert not loaded("check", str(NOMINAL)) & heavy


def test_a_command_that_compiles_says_so_once(capsys):
    """A kernel that no cache holds: one line when the compiler begins, none for the kernels after it."""

    @njit
    def fresh(x: float) -> float:
        return x + 1.0

    def command() -> float:
        return fresh(1.0) + fresh(np.float32(2.0))

    assert compiling.reporting(command)() == 5.0
    said = capsys.readouterr()
    assert said.out == "" and said.err == "compiling (once): the machine code is kept for later runs\n"


def test_a_command_that_compiles_nothing_is_silent(capsys):
    """Machine code from the cache is loaded without a word."""
    assert compiling.reporting(lambda: 3)() == 3
    assert capsys.readouterr().err == ""


def test_long_compilation_shows_progress(capsys, monkeypatch):
    """A line each five seconds, with the number of kernels so far."""
    now = [100.0]
    monkeypatch.setattr(compiling.time, "monotonic", lambda: now[0])
    progress = compiling.Progress()
    for seconds in (0.0, 2.0, 4.0, 1.0):
        progress.begin()
        now[0] += seconds
        progress.end()
    assert capsys.readouterr().err.splitlines()[1:] == ["compiling (once): 3 kernels so far"]
