"""Worker processes: every item once, neighbours together, errors and warnings as if there were one process."""

import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from multiprocessing import active_children
from pathlib import Path

import pytest

from insonify.forked_workers import WorkerProcessError, can_fork, forked_results
from oracles.few_of import few_of

pytestmark = pytest.mark.skipif(not can_fork(), reason="worker processes are forked on Linux alone")


@few_of((0, 1, 4), ("items", "count"), [(0, 2), (1, 3), (2, 2), (7, 3), (100, 4)])
def test_every_item_has_its_result_once(items: int, count: int) -> None:
    """Squares of any number of items, by more or fewer processes than items, and none of them is left."""
    numbers = [3 * k for k in range(items)]
    found = list(forked_results(lambda number: number**2, numbers, count))
    assert sorted(found) == [(number, number**2) for number in numbers]
    assert not active_children()


def test_each_process_takes_neighbours() -> None:
    """Of equal items, each process has one consecutive run, apart from the few that are left at the end."""
    found = list(forked_results(lambda _: (time.sleep(0.005), os.getpid())[1], range(60), 3))
    steps = {}
    for number, process in found:
        steps.setdefault(process, []).append(number)
    assert len(steps) == 3
    for taken in steps.values():
        assert sum(after != before + 1 for before, after in pairwise(taken)) <= 3
        assert len(taken) >= 10


def test_a_process_that_is_done_takes_over_half_of_what_is_left() -> None:
    """The items of the first half are slow: the other process does almost half of them."""
    found = list(forked_results(lambda k: (time.sleep(0.02 if k < 40 else 0), os.getpid())[1], range(80), 2))
    first = next(process for number, process in found if number == 0)
    assert 15 <= sum(process != first for number, process in found if number < 40) <= 25


class LockedError(ValueError):
    """An error that cannot be sent to another process."""

    def __init__(self, text: str) -> None:
        """Hold a lock."""
        super().__init__(text)
        self.lock = threading.Lock()


@pytest.mark.parametrize("error", [ZeroDivisionError("the fifth"), LockedError("the fifth")])
def test_an_error_is_that_of_the_item(error: Exception) -> None:
    """Its class and text, or its text alone where it cannot be sent; where it was raised is a note."""

    def failing(number: int) -> int:
        if number == 5:
            raise error
        return number

    with pytest.raises((ZeroDivisionError, RuntimeError), match="the fifth") as caught:
        list(forked_results(failing, range(9), 2))
    if isinstance(error, ZeroDivisionError):
        assert type(caught.value) is ZeroDivisionError
        assert "in failing" in caught.value.__notes__[0]
    else:
        assert str(caught.value) == "LockedError: the fifth"
    assert not active_children()


def test_a_warning_is_given_here_and_once() -> None:
    """Twenty equal warnings of three processes are one in this process, and another one of another text."""

    def warning(number: int) -> None:
        warnings.warn("even" if number % 2 == 0 else "odd", UserWarning, stacklevel=1)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        list(forked_results(warning, range(20), 3))
    assert sorted(str(one.message) for one in caught) == ["even", "odd"]


def test_a_process_that_is_killed_is_an_error() -> None:
    """Its exit code and what to do; the other processes end with the call."""
    with pytest.raises(WorkerProcessError, match=r"memory.*exit code -9.*fewer --threads"):
        list(forked_results(lambda number: os.kill(os.getpid(), signal.SIGKILL) if number == 4 else None, range(9), 2))
    assert not active_children()


def test_processes_end_with_the_loop_and_leave_an_interrupt_to_it() -> None:
    """After a break none is left; a keyboard interrupt sent to one while it works does not stop it."""
    here = os.getpid()

    def interrupted(number: int) -> int:
        os.kill(os.getpid(), signal.SIGINT)
        return os.getppid() == here and number

    results = forked_results(interrupted, range(100), 2)
    assert next(results) in ((0, 0), (50, 50))
    results.close()
    assert not active_children()


def test_processes_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    """No worker goes on writing when the run has been killed."""
    script = f"""
import time
from pathlib import Path
from insonify.forked_workers import forked_results
def write(number):
    time.sleep(0.02)
    Path({str(tmp_path)!r}, str(number)).touch()
for number, _ in forked_results(write, range(10_000), 2):
    print(number, flush=True)
"""
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    for _ in range(4):
        parent.stdout.readline()
    parent.kill()
    parent.wait()
    parent.stdout.close()
    time.sleep(0.1)
    there = len(list(tmp_path.iterdir()))
    time.sleep(0.3)
    assert len(list(tmp_path.iterdir())) == there >= 4


def test_a_process_is_copied_from_its_main_thread_alone() -> None:
    """Another thread may hold locks of the program that starts it, unless it is a daemon, as those of libraries are."""
    found, stop = list[bool](), threading.Event()
    thread = threading.Thread(target=lambda: found.append(can_fork()))
    thread.start()
    thread.join()
    assert found == [False]
    for daemon in (True, False):
        other = threading.Thread(target=stop.wait, daemon=daemon)
        other.start()
        assert can_fork() == daemon
        stop.set()
        other.join()
        stop.clear()


def test_an_idle_pool_of_threads_does_not_matter() -> None:
    """Threads of a pool matter as long as one of them has work, not while all of them wait for some."""
    stop = threading.Event()
    with ThreadPoolExecutor(2) as pool:
        for _ in range(3):
            assert list(pool.map(abs, [-1, -2])) == [1, 2]
            deadline = time.monotonic() + 10.0
            while not can_fork() and time.monotonic() < deadline:
                time.sleep(0.001)
            assert can_fork()
            waiting = pool.submit(stop.wait)
            while not waiting.running():
                time.sleep(0.001)
            time.sleep(0.01)
            assert not can_fork()
            stop.set()
            assert waiting.result()
            stop.clear()
