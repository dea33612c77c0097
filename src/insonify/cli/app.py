"""The commands, gathered, and what becomes of an error."""

import atexit
import gc
import os
import warnings
from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any

import typer

from insonify.cli import comparison, dataset, export, info, paper_and_demo, parts, recordings, scenarios, serve
from insonify.cli.alike_lines import AlikeLines, shortened
from insonify.cli.arguments import InputError
from insonify.cli.compile_progress import report_compiling

DONE, FAILED, WRONG_INPUT = 0, 1, 2
STOPPED_BY_KEY = 130  # what typer makes of Ctrl-C
YOUNG = 500_000
"""New objects between two searches for cyclic garbage: imports make a million objects and no garbage [1]."""
INTERRUPTED = "interrupted; the same command goes on where this one stopped"

app = typer.Typer(
    help="What would this sonar record, in this water, over this seabed, with these targets, and why?",
    epilog="Example: insonify new harbour; insonify run harbour.yaml -o harbour.zarr",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
for _command in (
    scenarios.new, scenarios.schema, info.info, parts.plan, parts.status, comparison.compare, scenarios.scenario_from,
    scenarios.check, recordings.run, recordings.show, recordings.explain, export.export, dataset.dataset,
    paper_and_demo.paper, paper_and_demo.demo, paper_and_demo.study, serve.serve,
):  # fmt: skip
    app.command()(_command)


def _version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version as installed

        typer.echo(installed("insonify"))
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and stop.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options before any command. The parser itself prints the version and stops, so there is nothing left to do."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return how it ended.

    Args:
        arguments: The words after the program's name; by default those of the shell.

    Returns:
        Exit code: 0 done, 1 the run failed, 2 the input is wrong.

    Example:
        >>> main(["check", "no-such-harbour.yaml"])  # the reason is written to stderr
        2
    """
    report_compiling()
    gc.set_threshold(YOUNG)
    atexit.register(gc.freeze)  # the interpreter's last search would go through all that is about to end anyway
    command = typer.main.get_command(app)
    words = None if arguments is None else list(arguments)
    alike = AlikeLines()  # Python clears its own record whenever a module changes the filters
    with warnings.catch_warnings():
        warnings.showwarning = partial(_warn, alike)
        try:
            result = command.main(words, "insonify", standalone_mode=False)
        except KeyboardInterrupt:
            return _report(INTERRUPTED, FAILED)
        except Exception as error:
            return _verdict(error)
        finally:
            if alike.left_out():
                typer.echo(f"{alike.left_out()} more warnings like these", err=True)
    if result == STOPPED_BY_KEY:
        return _report(INTERRUPTED, FAILED)
    return result if isinstance(result, int) else DONE


def _warn(alike: AlikeLines, message: Warning | str, *_: Any, **__: Any) -> None:
    """A warning as text: one line, once in a run, without its position in the code; few of many alike."""
    line = " ".join(str(message).split())
    if alike.add(line):
        typer.echo(f"warning: {line}", err=True)


def _verdict(error: Exception) -> int:
    """The exit code of an error, after its message on stderr."""
    if hasattr(error, "show") and hasattr(error, "exit_code"):  # the command itself was misspelt
        error.show()
        return WRONG_INPUT
    if type(error).__name__ == "Abort":
        return _report(INTERRUPTED, FAILED)
    if _is_about_the_input(error):
        return _report(shortened(str(error)), WRONG_INPUT)
    if os.environ.get("INSONIFY_TRACEBACK"):
        raise error
    if type(error).__name__ in ("WriteError", "ClusterError", "WorkerProcessError"):
        return _report(str(error), FAILED)
    hint = "set INSONIFY_TRACEBACK=1 for the details"
    return _report(f"the run failed: {type(error).__name__}: {error} ({hint})", FAILED)


def _is_about_the_input(error: Exception) -> bool:
    from insonify.diagnostics.diagnostic import ScenarioError
    from insonify.formats.zarr_store import StoreError

    # A path that cannot be read or written was typed; a full disk was not.
    path_errors = (PermissionError, NotADirectoryError, IsADirectoryError, FileExistsError)
    return isinstance(error, (ScenarioError, StoreError, InputError, *path_errors))


def _report(message: str, code: int) -> int:
    typer.echo(message, err=True)
    return code
