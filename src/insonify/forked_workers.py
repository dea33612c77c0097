"""Worker processes that begin as copies of this one: arrays and machine code are shared, the interpreter is not."""

import ctypes
import gc
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import thread as thread_pool
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkProcess
from types import FrameType
from typing import Any, TypeVar

Item = TypeVar("Item")

ITEMS_AHEAD = 2
"""Items that a worker process has been given and not returned, at most [1]."""
_PR_SET_PDEATHSIG = 1
"""Option of prctl(2): signal to this process when its parent ends."""


class WorkerProcessError(RuntimeError):
    """A worker process that ended before its work was done."""


def can_fork() -> bool:
    """Return True where this process may be copied: on Linux, from its main thread, with no others but idle ones.

    Other threads may hold a lock, such as that of numba's compiler, for which a copy would wait for ever. Idle are
    daemons, such as those of libraries that wait for input, and the threads of a pool without work, such as that which
    dask keeps once an array was read.
    """
    own, frames = threading.current_thread(), sys._current_frames()
    others = (thread for thread in threading.enumerate() if thread is not own)
    idle = (thread.daemon or _waits_for_work(frames.get(thread.ident or 0)) for thread in others)
    return sys.platform == "linux" and own is threading.main_thread() and all(idle)


def _waits_for_work(frame: FrameType | None) -> bool:
    """Return True where the innermost function of a thread is the loop of a pool's threads over its work."""
    return frame is not None and (frame.f_code.co_filename, frame.f_code.co_name) == (thread_pool.__file__, "_worker")


def forked_results(function: Callable[[Item], Any], items: Sequence[Item], count: int) -> Iterator[tuple[Item, Any]]:
    """Results of a function for all items, by worker processes, in the order in which they are done.

    Each process begins at another part of the items and goes on with the next ones, so that what neighbours have in
    common is computed once; a process that has done its part continues with half of the largest remaining one.

    Args:
        function: Any function of one item, which need not be picklable; its results must be.
        items: The items.
        count: Number of processes.

    Raises:
        WorkerProcessError: A process was killed.

    Example:
        >>> sorted(forked_results(lambda number: number**2, [1, 2, 3], 2))
        [(1, 1), (2, 4), (3, 9)]
    """
    workers, seen = list[_Worker](), dict[Any, Any]()
    try:
        for first, stop in pairwise(len(items) * part // count for part in range(count + 1)):
            workers.append(_Worker.start(function, items, range(first, stop), [one.connection for one in workers]))
        for worker in workers * ITEMS_AHEAD:
            worker.submit_next(workers)
        while busy := [worker for worker in workers if worker.submitted]:
            ready = wait([worker.connection for worker in busy])
            for worker in (worker for worker in busy if worker.connection in ready):
                number, result, error, warned = worker.receive()
                worker.submit_next(workers)
                for message, category, file, line in warned:
                    warnings.warn_explicit(message, category, file, line, registry=seen)
                if error is not None:
                    raise error
                yield items[number], result
    finally:
        for worker in workers:
            worker.end()


@dataclass(slots=True)
class _Worker:
    """One worker process."""

    process: ForkProcess
    connection: Connection
    remaining: range
    """Numbers of the items of its part that have not been submitted."""
    submitted: int = 0
    """Items submitted whose results have not been received."""

    @classmethod
    def start(
        cls, function: Callable[[Any], Any], items: Sequence[Any], part: range, others: list[Connection]
    ) -> "_Worker":  # fmt: skip
        context = multiprocessing.get_context("fork")
        here, there = context.Pipe()
        arguments = function, items, there, [here, *others], os.getpid()
        process = context.Process(target=_serve, args=arguments, daemon=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of other threads, whose locks no worker needs
            process.start()
        there.close()
        return cls(process, here, part)

    def submit_next(self, workers: list["_Worker"]) -> None:
        """Submit the next item of its part, else of half of the largest remaining part."""
        if not self.remaining:
            other = max(workers, key=lambda worker: len(worker.remaining))
            kept = len(other.remaining) // 2
            other.remaining, self.remaining = other.remaining[:kept], other.remaining[kept:]
        if self.remaining:
            with suppress(BrokenPipeError):  # `receive` finds that the process has ended
                self.connection.send(self.remaining[0])
            self.remaining, self.submitted = self.remaining[1:], self.submitted + 1

    def receive(self) -> Any:
        """Number of an item, its result, its error or None, and the warnings given."""
        try:
            outcome = self.connection.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            code = self.process.exitcode
            reason = (
                "killed by the system, most likely since the memory is full" if code == -signal.SIGKILL else "ended"
            )
            raise WorkerProcessError(
                f"a worker process was {reason} (exit code {code}). Run the same command with fewer --threads: it goes "
                "on from what was recorded"
            ) from None
        self.submitted -= 1
        return outcome

    def end(self) -> None:
        """End the process, whatever it does."""
        self.process.kill()
        self.process.join()
        self.connection.close()


def _serve(
    function: Callable[[Any], Any], items: Sequence[Any], connection: Connection, others: list[Connection], parent: int
) -> None:  # fmt: skip
    """Apply a function to the items whose numbers are received, until the parent process ends.

    Args:
        function: The function.
        items: All items.
        connection: Connection to the parent process.
        others: Its ends of other connections.
        parent: Number of that process; an interrupt from the keyboard is left to it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    for other in others:
        other.close()
    gc.freeze()  # what was inherited stays on shared pages
    while os.getppid() == parent:
        number, result, error = connection.recv(), None, None
        with warnings.catch_warnings(record=True) as warned:
            try:
                result = function(items[number])
            except Exception as raised:
                error = _picklable(raised)
        connection.send((number, result, error, [(w.message, w.category, w.filename, w.lineno) for w in warned]))


def _picklable(error: Exception) -> Exception:
    """The error with its traceback as a note, or its text where it cannot be sent."""
    error.add_note(traceback.format_exc())
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
