"""Progress of a long job on a terminal; nearly silent otherwise."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import typer

OnStep = Callable[[int, int], None]
"""Callback with the steps done and the steps in total, called before the first step and after each."""
ANEW = "--overwrite starts anew"
"""Option that starts a run anew."""


@contextmanager
def progress(quiet: bool, step: str = "ping", anew: str = ANEW) -> Iterator[OnStep]:
    """A bar on stderr with the pace and the time left, where stderr is a terminal.

    Anywhere on stderr, one line reports what an earlier run has completed.

    Args:
        quiet: Whether to stay silent in any case.
        step: What is counted, in the singular.
        anew: Action that starts the job anew, for the message.
    """
    if quiet or not sys.stderr.isatty():
        yield _report_resumed(quiet, step, anew)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn(f"{step}s"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(step, total=None, pace="")
        resumed: list[int] = []  # what an earlier run has left does not count for the pace

        def on_step(done: int, total: int) -> None:
            if not resumed:
                resumed.append(done)
                bar.reset(task, total=total, completed=done, pace="starting")
                if done:
                    bar.console.print(resumed_note(done, total, step, anew), highlight=False)
            else:
                bar.update(task, completed=done, pace=pace(done - resumed[0], bar.tasks[0].elapsed or 0.0, step))

        yield on_step


def pace(steps: int, seconds: float, step: str) -> str:
    """Speed of the job, in the unit in which the number is not small.

    Args:
        steps: Steps done.
        seconds: Time they took [s].
        step: What is counted, in the singular.
    """
    if steps == 0:
        return "starting"
    if seconds > steps:
        return f"{seconds / steps:.3g} s/{step}"
    return f"{steps / max(seconds, 1e-9):.3g} {step}s/s"


def resumed_note(done: int, total: int, step: str, anew: str = ANEW) -> str:
    """Message about the work of an earlier run.

    Args:
        done: Steps that were done when this run began.
        total: Number of steps in total.
        step: What is counted, in the singular.
        anew: Action that starts the job anew, for the message.
    """
    if done < total:
        return f"{done} of {total} {step}s were there already"
    what = f"all {total} {step}s were" if total > 1 else f"the {step} was"
    return f"{what} there already, so nothing was left to do; {anew}"


def _report_resumed(quiet: bool, step: str, anew: str) -> OnStep:
    """No bar, but a line on stderr where an earlier run has left something."""
    first = [not quiet]

    def on_step(done: int, total: int) -> None:
        if first and first.pop() and done:
            typer.echo(resumed_note(done, total, step, anew), err=True)

    return on_step
