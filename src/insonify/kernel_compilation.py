"""Compilation of kernels before they are called, by one process on each core.

Each process compiles one kernel after the other into the cache on disk, from which this process then loads them. What
goes wrong in them does not matter: a kernel that is not in the cache is compiled when it is called.
"""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Set
from contextlib import suppress

from insonify.kernel_signatures import PACKAGE, RecordedKernel, decoded, kernel_of, missing_kernels, shares_kernels
from insonify.machine_memory import available_memory
from insonify.thread_count import thread_count

LEAST_SECONDS = 8.0
"""Processor time to compile below which processes do not pay: each takes a second to start [s]."""
MEMORY = 600e6
"""Memory of one process [bytes]."""
MAX_PROCESSES = 16
"""Largest number of processes."""
SETTING = "INSONIFY_COMPILE_PROCESSES"
"""Environment variable: largest number of processes; below 2, kernels are compiled when they are called."""
Group = list[RecordedKernel]
"""Kernels of one module."""
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
        groups = _groups(missing_kernels(key))
        if len(groups) >= 2 and sum(kernel.seconds for group in groups for kernel in group) > LEAST_SECONDS:
            _compile(groups, min(processes, len(groups)))


def _process_count(threads: int | None) -> int:
    """Largest number of processes for this machine and a requested number of threads.

    It is 0 where the interpreter is part of another program, whose executable cannot run a module of Python.
    """
    if not os.path.basename(sys.executable or "").lower().startswith(("python", "pypy")):
        return 0
    try:
        most = int(os.environ.get(SETTING, MAX_PROCESSES))
    except ValueError:
        most = MAX_PROCESSES
    return min(most, thread_count(threads), int(available_memory() / MEMORY))


def _groups(kernels: list[RecordedKernel]) -> list[Group]:
    """Kernels by module, the longest to compile first: those of one module call the same other kernels."""
    by_module: dict[str, list[RecordedKernel]] = {}
    for kernel in kernels:
        by_module.setdefault(kernel.module, []).append(kernel)
    return sorted(by_module.values(), key=lambda group: -sum(kernel.seconds for kernel in group))


def _next_group(waiting: list[Group], own: set[str], taken: set[str]) -> Group:
    """Remove and return the next group for a process: the longest, but first those that share kernels with its own.

    A group that shares kernels with one of another process comes last: both would compile these.

    Args:
        waiting: Groups, the longest first; changed.
        own: Modules assigned to the process; changed.
        taken: Modules assigned to any process; changed.

    Raises:
        ValueError: None is waiting.
    """

    def rank(group: Group) -> int:
        if any(shares_kernels(group[0].module, module) for module in own):
            return 0
        return 2 if any(shares_kernels(group[0].module, module) for module in taken) else 1

    chosen = min(waiting, key=rank)
    waiting.remove(chosen)
    own.add(chosen[0].module)
    taken.add(chosen[0].module)
    return chosen


def _compile(groups: list[Group], processes: int) -> None:
    """Compile groups of kernels by a number of processes, each group by one."""
    waiting, count, done = list(groups), sum(map(len, groups)), 0
    lock, taken = threading.Lock(), set[str]()

    def report(finished: int) -> None:
        nonlocal done
        with lock:
            done += finished
            for reported in _REPORTS:
                reported(done, count, processes)

    def send_groups(worker: subprocess.Popen[str]) -> None:
        assert worker.stdin is not None and worker.stdout is not None
        own = set[str]()
        with suppress(OSError, ValueError):  # the process has ended; or nothing is waiting
            while True:
                with lock:
                    group = _next_group(waiting, own, taken)
                for kernel in group:
                    worker.stdin.write(json.dumps(kernel) + "\n")
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
        senders = [threading.Thread(target=send_groups, args=(worker,), daemon=True) for worker in workers]
        for sender in senders:
            sender.start()
        for sender in senders:
            sender.join()
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
