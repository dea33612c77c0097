"""Small recordings of numbered pings, and writers of them that are killed."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np

from insonify.formats import shards
from insonify.part import Part
from insonify.records.labels import LabelNames, Labels
from insonify.records.recording import RecordingLayout

PINGS, CHANNELS, SAMPLES, PER_SHARD = 150, 2, 6, 64
SAME = {"scenario": "title: here", "seed": 1, "version": "0"}
NAMES = LabelNames(("seabed", "surface", "box"), ("D-D", "D-S"))


def layout(pings: int = PINGS) -> RecordingLayout:
    """A track of a sonar with two beams."""
    place = np.arange(3.0 * pings).reshape(pings, 3)
    return RecordingLayout("pressure", np.arange(SAMPLES) / 25e3, 0.3 * np.arange(pings), np.zeros(2), place, place)


@cache
def sound(ping: int) -> np.ndarray:
    """Some pressure, another one for every ping."""
    return np.random.default_rng(ping).normal(size=(CHANNELS, 2 * SAMPLES)).astype(np.float32).view(np.complex64)


@cache
def labels(ping: int) -> Labels:
    """Some labels, others for every ping; each third ping has masks of False only."""
    rng, shape = np.random.default_rng(1000 + ping), (CHANNELS, SAMPLES)
    rows = (rng.integers(0, 3, shape).astype(np.uint8) for _ in range(3))
    masks = (rng.random(shape) < (0.5 if ping % 3 else 0.0) for _ in range(3))
    return Labels(
        rng.random(shape), rng.random((CHANNELS, len(NAMES.objects), SAMPLES)), next(rows), *masks, next(rows),
        pair_intensity=rng.random((CHANNELS, len(NAMES.pairs), SAMPLES)), strongest_pair=next(rows),
        position=rng.random((*shape, 3)), distance=rng.random(shape), grazing=rng.random(shape),
    )  # fmt: skip


def write_and_kill(write_part: Callable[..., object], target: str, parts: int, at_once: int, longest: float) -> None:
    """Write a recording by processes of which the first 20 are killed, then whatever is missing.

    Args:
        write_part: Function that writes a part, or all, of the recording at `target`.
        target: Path or URL of the recording.
        parts: Number of parts.
        at_once: Parts that are written at the same time, one of them twice.
        longest: Longest time after which a process is killed [s].
    """
    shards.MOST_PINGS = shards.FEWEST_IN_OBJECT = PER_SHARD
    order, kills, left = random.Random(5), 20, [Part(k, parts) for k in range(1, parts + 1)]
    while left or kills:
        order.shuffle(left)
        pids = []
        for part in [*left[:at_once], *left[:1]]:
            pids.append(os.fork())
            if not pids[-1]:
                try:
                    write_part(target, part)
                except BaseException as error:
                    print(type(error), error, file=sys.stderr, flush=True)
                    os._exit(1)
                os._exit(0)
        for pid in pids:
            if kills:
                time.sleep(order.uniform(0.0, longest))
                os.kill(pid, signal.SIGKILL)
                kills -= 1
        ended = [os.waitpid(pid, 0)[1] for pid in pids]
        assert all(code in (0, signal.SIGKILL) for code in ended), ended
        if not kills:
            left = left[at_once:]
    write_part(target)


def write_and_kill_apart(test: str, target: str, *, parts: int, at_once: int, longest: float) -> None:
    """Call `write_and_kill` with the function `write_part` of a file of tests, in a process of its own."""
    arguments = f"write_part, {target!r}, {parts}, {at_once}, {longest}"
    script = f"from oracles.numbered_pings import write_and_kill\nwrite_and_kill({arguments})"
    run_apart(f"import warnings\nwarnings.simplefilter('ignore')\nfrom {Path(test).stem} import write_part\n{script}")


def run_apart(script: str) -> str:
    """Output of a script in a process of its own (one with threads cannot be forked), which may import these tests."""
    return subprocess.run(_apart(script), check=True, timeout=120, stdout=subprocess.PIPE, text=True).stdout


@contextlib.contextmanager
def replying_apart(script: str) -> Iterator[Callable[[object], str]]:
    """A function that writes a line to such a process and waits for the line with which it replies."""
    with subprocess.Popen(_apart(script), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None and process.stdout is not None
        yield lambda line: (print(line, file=process.stdin, flush=True), process.stdout.readline())[1]


def _apart(script: str) -> list[str]:
    tests = Path(__file__).parents[1]
    paths = f"import sys\nsys.path[:0] = {[str(tests / 'formats'), str(tests)]!r}\n"
    return [sys.executable, "-c", paths + script]
