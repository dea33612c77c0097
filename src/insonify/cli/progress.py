"""How far a long run has come, for a person who watches; silent for everybody else."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

OnPing = Callable[[int, int], None]
"""Told the pings done and the pings wanted, once before the first ping and after each."""


@contextmanager
def progress(quiet: bool) -> Iterator[OnPing]:
    """A bar on stderr with pings per second and the time left, where stderr is a terminal.

    Args:
        quiet: Whether to stay silent there too.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda done, total: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    speed = TextColumn("{task.fields[rate]}")
    columns = (TextColumn("pings"), BarColumn(), MofNCompleteColumn(), speed, TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("pings", total=None, rate="")
        there: list[int] = []  # pings that an earlier run has left do not count for the rate

        def on_ping(done: int, total: int) -> None:
            there.append(done) if not there else None
            rate = (done - there[0]) / (bar.tasks[0].elapsed or 1e-9)
            bar.update(task, completed=done, total=total, rate=f"{rate:.3g} pings/s")

        yield on_ping
