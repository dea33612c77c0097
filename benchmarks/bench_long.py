"""Long surveys: memory by the number of pings, and time by the number of workers of a cluster.

The survey is the coherent one of `bench_coherent`, recorded by the command in processes of its own.
"""

import contextlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from bench_sidescan import SCENE
from measure import THREADS, Result

COHERENT = SCENE.replace("ORDER", "2").replace("incoherent", "coherent").replace("pings: 1000", "pings: PINGS")
SURVEYS = (100, 10_000)
"""Pings of the surveys whose memory is compared."""
MEMORY_GOAL = 1.2
"""Largest memory of the long survey over that of the short one, at most [1]."""
WORKERS, SHARED = (1, 2), 600
"""Workers of a cluster on this machine, and pings that they share."""
SPEED_GOAL = 1.8
"""Time of one worker over that of two, at least [1]."""
PERIOD = 1.0
"""Seconds between two readings of the memory."""


class Survey(NamedTuple):
    """One survey that was recorded."""

    seconds: float
    """Wall time of the command from its start to its end [s]."""
    memory: float
    """Largest memory of all its processes together, shared pages counted once [bytes]."""


def record_survey(pings: int, *options: str) -> Survey:
    """Record a survey to disk by the command, and remove it.

    Args:
        pings: Number of pings.
        options: Further options of `insonify run`.

    Raises:
        RuntimeError: The command fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene, out = Path(folder) / "survey.yaml", Path(folder) / "survey.zarr"
        scene.write_text(COHERENT.replace("PINGS", str(pings)), encoding="utf-8")
        words = [sys.executable, "-m", "insonify", "run", str(scene), "-o", str(out), "--quiet", *options]
        begin, peak = time.perf_counter(), 0.0
        child = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while child.poll() is None:
            peak = max(peak, sum(proportional_set(pid) for pid in processes(child.pid)))
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(PERIOD)
        if child.returncode:
            raise RuntimeError(f"{' '.join(words)} fails with exit code {child.returncode}")
        return Survey(time.perf_counter() - begin, peak)


def processes(pid: int) -> Iterator[int]:
    """A process and all that it started, as far as they still run; Linux."""
    yield pid
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in children.read_text().split():
                yield from processes(int(child))


def proportional_set(pid: int) -> float:
    """Memory of a process, each shared page divided by the number of processes that share it [bytes]; 0: it ended."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return 1024 * float(line.split()[1])
    return 0.0


def memory() -> list[Result]:
    """Largest memory of a short survey, and that of a long one re it."""
    short, long = (record_survey(pings, "--threads", str(THREADS)).memory for pings in SURVEYS)
    name = "coherent pings, up to 2 bounces, memory"
    return [
        Result(f"{SURVEYS[0]} {name}", short / 2**20, "MiB"),
        Result(f"{SURVEYS[1]} {name}", long / short, f"x {SURVEYS[0]} pings", f"goal {MEMORY_GOAL:g}"),
    ]


def cluster() -> list[Result]:
    """Time of a survey shared by workers of a cluster on this machine, and ratio of the first to the last."""
    taken = [record_survey(SHARED, "--cluster", f"local:{workers}").seconds for workers in WORKERS]
    name = f"{SHARED} coherent pings, workers of dask"
    return [
        Result(f"{name}: {WORKERS[0]}", taken[0], "s"),
        Result(f"{name}: {WORKERS[-1]}", taken[0] / taken[-1], f"x {WORKERS[0]} worker", f"goal {SPEED_GOAL:g}"),
    ]


SMALL = {"COHERENT": COHERENT.replace("[0 ms, 267 ms]", "[20 ms, 30 ms]"), "SURVEYS": (1, 3), "SHARED": 2,
         "WORKERS": (1,)}  # fmt: skip
BENCHES = [memory, cluster]
