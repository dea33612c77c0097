"""Word on stderr while kernels are compiled: the first run of a fresh installation would be silent for a minute."""

import time
from typing import Any

import typer

from insonify.jit import when_loaded
from insonify.kernel_compilation import report_compilation

OFTEN = 5.0
"""Time between two lines of progress [s]."""


class Progress:
    """Lines about the compiler's work: one when it begins, then how many kernels there are so far."""

    def __init__(self) -> None:
        self._kernels, self._printed = 0, -OFTEN

    def begin(self) -> None:
        """Note that a kernel is being compiled."""
        if self._printed < 0:
            self._print("compiling (once for this kind of scenario): the machine code is kept for later runs")

    def end(self) -> None:
        """Note that a kernel has been compiled."""
        self._kernels += 1
        if time.monotonic() - self._printed >= OFTEN:
            self._print(f"compiling: {self._kernels} kernels so far")

    def count(self, done: int, kernels: int, processes: int) -> None:
        """Note how many of some kernels have been compiled by processes."""
        if done == 0:
            self._print(
                f"compiling {kernels} kernels by {processes} processes (once for this kind of scenario): the machine "
                "code is kept for later runs"
            )
        elif done < kernels and time.monotonic() - self._printed >= OFTEN:
            self._print(f"compiling: {done} of {kernels} kernels so far")

    def _print(self, line: str) -> None:
        typer.echo(line, err=True)
        self._printed = time.monotonic()


_PROGRESS: list[Progress] = []
"""The process's one progress, once it is reported."""


def report_compiling() -> None:
    """Print progress on stderr whenever this process compiles a kernel from now on."""
    if _PROGRESS:
        _PROGRESS[0] = Progress()  # the next command of the same process begins anew
        return
    _PROGRESS.append(Progress())
    report_compilation(_count)
    when_loaded(_report_to_progress)


def _count(done: int, kernels: int, processes: int) -> None:
    """Report how many of some kernels have been compiled by processes."""
    _PROGRESS[0].count(done, kernels, processes)


def _report_to_progress() -> None:
    """Register a listener of numba that reports each compiled kernel."""
    from numba.core import event

    class Lines(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            _PROGRESS[0].begin()

        def on_end(self, event: Any) -> None:
            _PROGRESS[0].end()

    event.register("numba:compile", Lines())
