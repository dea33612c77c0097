"""Timing: candidates take turns, and each keeps its best time."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing import Pipe, Process
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

from insonify.recording_run import record
from insonify.scenario.scenario import Scenario
from insonify.simulator import Simulator, build_simulator, simulate_pings

THREADS = 2
"""Threads that simulate pings."""
SMOKE = False
"""True: everything is run once, without a warm-up, to see that it runs at all; the numbers then mean nothing."""
STRETCHES = 3
"""Stretches of a survey that are timed one after the other: other work on the machine slows some of them."""


@dataclass(frozen=True, slots=True)
class Result:
    """One line of the table."""

    bench: str
    """What was measured."""
    value: float
    """How fast, in `unit`."""
    unit: str
    """Such as "M spike-elements/s"."""
    note: str = ""
    """Ratio to another line, or the goal."""
    accuracy: str = ""
    """Error of the result that was timed, where the benchmark measures it."""


class CommandRun(NamedTuple):
    """One run of the command `insonify` in a process of its own."""

    code: int
    """Exit code."""
    message: str
    """What it wrote to stderr."""
    seconds: float
    """Processor time, all threads [s]."""
    memory: float
    """Largest resident set [bytes]."""


_WITH_PEAK = r"""
import re, sys
from insonify.cli import main
code = main(sys.argv[1:])
print(re.search("VmHWM:[ \t]*([0-9]+)", open("/proc/self/status").read())[1], file=sys.stderr)
sys.exit(code)
"""
"""The command, then the largest resident set of its process [KiB]. Linux counts in `ru_maxrss` that of the process by
which it was started, too."""


def run_command(
    arguments: list[str], environment: Mapping[str, str] | None = None, limit: Callable[[int], None] = lambda _: None
) -> CommandRun:
    """Run the command `insonify`, twice where the first run has to compile kernels.

    Args:
        arguments: Arguments of the command.
        environment: Additional environment variables.
        limit: Called with the number of the process once it is started.
    """
    while True:
        child = subprocess.Popen([sys.executable, "-c", _WITH_PEAK, *arguments], stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, text=True, env=os.environ | (environment or {}))  # fmt: skip
        limit(child.pid)
        assert child.stderr is not None
        lines = child.stderr.read().splitlines()
        _, status, used = os.wait4(child.pid, 0)
        code = child.returncode = os.waitstatus_to_exitcode(status)
        if code or SMOKE or not any(line.startswith("compiling") for line in lines):
            peak = 0.0 if code else float(lines.pop()) * 1024
            return CommandRun(code, "\n".join(lines), used.ru_utime + used.ru_stime, peak)


def best_seconds(candidates: Mapping[str, Callable[[], object]], repeats: int = 5) -> dict[str, float]:
    """Least seconds of each candidate over some rounds; all take part in each round, after one call to warm up.

    Args:
        candidates: What to time, by name.
        repeats: Rounds.

    Returns:
        Seconds by name. Other work on the machine then slows all candidates alike, and the minimum has least of it.
    """
    for run in () if SMOKE else candidates.values():
        run()
    best = dict.fromkeys(candidates, float("inf"))
    for _ in range(1 if SMOKE else repeats):
        for name, run in candidates.items():
            begin = time.perf_counter()
            run()
            best[name] = min(best[name], time.perf_counter() - begin)
    return best


def ping_seconds(simulator: Simulator, warm: int, timed: int) -> tuple[float, float]:
    """Wall and processor seconds of one ping of a survey in progress, the least of `STRETCHES` of it.

    Args:
        simulator: A scenario that has been prepared.
        warm: Pings simulated first, which compile kernels, draw the ground and touch the memory of a run.
        timed: Those of each stretch after them.
    """
    warm, timed, stretches = (1, 1, 1) if SMOKE else (warm, timed, STRETCHES)
    for _ in simulate_pings(simulator, range(warm), THREADS):
        pass
    found = []
    for begin in range(warm, warm + stretches * timed, timed):
        wall, cores = time.perf_counter(), time.process_time()
        for _ in simulate_pings(simulator, range(begin, begin + timed), THREADS):
            pass
        found.append(((time.perf_counter() - wall) / timed, (time.process_time() - cores) / timed))
    walls, cores_of = zip(*found, strict=True)
    return min(walls), min(cores_of)


def ratios_in_turns(scenarios: Sequence[Scenario], warm: int, batch: int, rounds: int) -> list[float]:
    """Processor time of a ping of each scenario over that of the first, the median of some rounds.

    In each round every scenario has a batch of pings, one after the other, in a process of its own: other work on the
    machine and its clock affect neighbouring batches alike, and no scenario takes the place of another in a cache.

    Args:
        scenarios: The scenarios, of which each has as many pings as are simulated.
        warm: Pings simulated first.
        batch: Pings of a batch.
        rounds: Rounds.
    """
    warm, batch, rounds = (1, 1, 1) if SMOKE else (warm, batch, rounds)
    ends, processes = list[Connection](), list[Process]()
    for scenario in scenarios:
        own, other = Pipe()
        processes.append(Process(target=_time_batches, args=(scenario, warm, batch, other), daemon=True))
        processes[-1].start()
        ends.append(own)
        own.recv()  # warm, before the next one starts
    ratios = []
    for number in range(rounds):
        seconds = list[float]()
        for end in ends:
            end.send(number)
            seconds.append(end.recv())
        ratios.append([one / seconds[0] for one in seconds])
    for end, process in zip(ends, processes, strict=True):
        end.send(None)
        process.join()
    return [statistics.median(column) for column in zip(*ratios, strict=True)]


def _time_batches(scenario: Scenario, warm: int, batch: int, end: Connection) -> None:
    """Send the processor time of each batch of pings whose number is received, after some pings to warm up."""
    simulator = build_simulator(scenario)
    for _ in simulate_pings(simulator, range(warm), 1):
        pass
    end.send(None)
    while (number := end.recv()) is not None:
        begin, cores = warm + number * batch, time.process_time()
        for _ in simulate_pings(simulator, range(begin, begin + batch), 1):
            pass
        end.send(time.process_time() - cores)


def recorded_seconds(scenario: Scenario, pings: int) -> float:
    """Wall seconds of one ping of a recording on disk in progress, behind its first quarter.

    Args:
        scenario: The scenario.
        pings: Pings that are recorded.
    """
    pings = 1 if SMOKE else pings
    times = list[float]()
    with tempfile.TemporaryDirectory() as folder:
        record(scenario, Path(folder) / "part.zarr", pings=range(pings), threads=THREADS,
               on_ping=lambda *_: times.append(time.perf_counter()))  # fmt: skip
    return (times[-1] - times[pings // 4]) / (pings - pings // 4)
