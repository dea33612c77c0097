"""How far a long run has come, for a person who watches; silent for everybody else."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

OnPing = Callable[[int, int], None]
"""Called after each ping with the number of pings done in this run and of pings to do."""


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

    rate = TextColumn("{task.fields[rate]}")
    columns = (TextColumn("pings"), BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("pings", total=None, rate="")

        def on_ping(done: int, total: int) -> None:
            elapsed = bar.tasks[0].elapsed or 1e-9
            bar.update(task, completed=done, total=total, rate=f"{done / elapsed:.3g} pings/s")

        yield on_ping
