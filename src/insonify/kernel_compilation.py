"""Compilation of kernels before they are called, by one process on each core.

Each process compiles one kernel after the other into the cache on disk, from which this process then loads them. What
goes wrong in them does not matter: a kernel that is not in the cache is compiled when it is called.
"""

import json
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Set
from contextlib import suppress

from insonify.kernel_signatures import PACKAGE, RecordedKernel, decoded, kernel_of, missing_kernels
from insonify.machine_memory import available_memory
from insonify.thread_count import thread_count

LEAST_SECONDS = 8.0
"""Processor time to compile below which processes do not pay: each takes a second to start [s]."""
MEMORY = 600e6
"""Memory of one process [bytes]."""
MAX_PROCESSES = 16
SETTING = "INSONIFY_COMPILE_PROCESSES"
"""Environment variable: largest number of processes; below 2, kernels are compiled when they are called."""
Report = Callable[[int, int, int], None]
"""Function of the numbers of kernels that are compiled, of all, and of processes."""
_REPORTS: list[Report] = []
_DONE: set[frozenset[str]] = set()
_LOCK = threading.Lock()


def report_compilation(report: Report) -> None:
    """Call a function whenever kernels are compiled ahead: before the first, and after each.

    Args:
        report: The function; it replaces the one before.
    """
    _REPORTS[:] = [report]


def compile_ahead(features: Set[str], threads: int | None = None) -> None:
    """Compile the kernels that a scenario needs and that are not in the cache, by one process on each core.

    Args:
        features: Features of the scenario, see `insonify.scenario.features`.
        threads: Largest number of processes; None: that of the cores.
    """
    key = frozenset(features)
    with _LOCK:
        if key in _DONE or (processes := _process_count(threads)) < 2:
            return
        _DONE.add(key)
        kernels = sorted(missing_kernels(key), key=lambda kernel: -kernel.seconds)
        if len(kernels) >= 2 and sum(kernel.seconds for kernel in kernels) > LEAST_SECONDS:
            _compile(kernels, min(processes, len(kernels)))


def _process_count(threads: int | None) -> int:
    """Number of processes that fit this machine, where a number of threads is requested, or None."""
    try:
        most = int(os.environ.get(SETTING, MAX_PROCESSES))
    except ValueError:
        most = MAX_PROCESSES
    return min(most, thread_count(threads), int(available_memory() / MEMORY))


def _compile(kernels: list[RecordedKernel], processes: int) -> None:
    """Compile kernels by a number of processes."""
    waiting, count, done = deque(kernels), len(kernels), 0
    lock = threading.Lock()

    def report(finished: int) -> None:
        nonlocal done
        with lock:
            done += finished
            for reported in _REPORTS:
                reported(done, count, processes)

    def employ(worker: subprocess.Popen[str]) -> None:
        assert worker.stdin is not None and worker.stdout is not None
        with suppress(OSError, IndexError):  # the process has ended; or nothing is waiting
            while True:
                worker.stdin.write(json.dumps(waiting.popleft()) + "\n")
                worker.stdin.flush()
                if not worker.stdout.readline():
                    return
                report(1)

    path = os.pathsep.join([str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    workers: list[subprocess.Popen[str]] = []
    report(0)
    try:
        for _ in range(processes):
            workers.append(
                subprocess.Popen(
                    [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL, text=True, env=os.environ | {"PYTHONPATH": path, SETTING: "0"},
                )
            )  # fmt: skip
        employers = [threading.Thread(target=employ, args=(worker,), daemon=True) for worker in workers]
        for employer in employers:
            employer.start()
        for employer in employers:
            employer.join()
    except OSError:  # no process can be started here
        return
    finally:
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.communicate()


def compile_requested() -> None:
    """Compile the kernels whose records come on standard input, a line each, and print a line after each."""
    for line in sys.stdin:
        kernel = RecordedKernel(*json.loads(line))
        with suppress(Exception):  # a record of another version: compiled when it is called
            kernel_of(kernel).dispatcher.compile(tuple(decoded(code) for code in kernel.signature))
        print(flush=True)


if __name__ == "__main__":
    compile_requested()
