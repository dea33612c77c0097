"""The commands that draw the paper's figures, and what else there is to be shown."""

from pathlib import Path
from typing import Annotated

import typer

from insonify.cli.arguments import Cores, InputError, make_folder, require_choice


def paper(
    figure: Annotated[
        list[int] | None, typer.Option(metavar="N", help="Only this figure; may be repeated. [default: all]")
    ] = None,
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for the pictures and their numbers.")
    ] = Path("paper"),
) -> None:
    """Draw the paper's figures, each with a JSON file of its numbers.

    Example: insonify paper --figure 12 -o figures
    """
    from insonify import paper as study
    from insonify.cli.progress import progress

    strange = [number for number in figure or [] if number not in study.FIGURES]
    if strange:
        known = ", ".join(map(str, study.FIGURES))
        raise InputError(f"--figure {strange[0]}: not a figure that can be drawn; choose from {known}")
    make_folder(out, "-o")
    with progress(False, "figure") as on_figure:
        paths = study.run(figure or None, out, on_figure=on_figure)
    for path in paths:
        typer.echo(path)


def demo(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="nominal, coherent-sidescan, forward-looking, multibeam, interferometric, synthetic-aperture. "
            "[default: all]",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for scenarios, recordings, pictures, numbers.")
    ] = Path("demo"),
    threads: Cores = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace what is there of the same name.")] = False,
) -> None:
    """Show what can be simulated: scenario, recording, picture, and numbers beside the truth.

    Example: insonify demo forward-looking -o shown
    """
    from insonify.cli.progress import progress
    from insonify.demos.demo import DEMOS, numbers_table, show

    for name in names or []:
        require_choice(name, DEMOS, "demo")
    make_folder(out, "-o")
    for name in names or DEMOS:
        with progress(False) as on_ping:
            shown = show(name, out, threads=threads, overwrite=overwrite, on_ping=on_ping)
        typer.echo(shown.picture)
        typer.echo(numbers_table(shown.numbers))


def study(
    name: Annotated[str, typer.Argument(metavar="NAME", help="open-questions or real-recordings.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for the page and its pictures.")
    ] = Path("study"),
    recordings: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the real recordings, for real-recordings.")
    ] = None,
) -> None:
    """Run a study: a page with tables and pictures, in some ten minutes.

    open-questions: three models of one scene, multipath at a target, a synthetic aperture in inhomogeneous water.
    real-recordings: public recordings beside their simulations.

    Example: insonify study open-questions -o docs/validation
    """
    require_choice(name, ("open-questions", "real-recordings"), "study")
    if name == "real-recordings":
        from insonify.studies import real_recordings

        if recordings is None:
            raise InputError("real-recordings needs the folder of the recordings: --recordings DIR, with "
                             + " and ".join(real_recordings.FILES))  # fmt: skip
        try:
            real_recordings.located(recordings)
        except FileNotFoundError as error:
            raise InputError(str(error)) from None
        make_folder(out, "-o")
        files = real_recordings.write(out, recordings)
    else:
        from insonify.studies import open_questions

        make_folder(out, "-o")
        files = open_questions.write(out)
    for path in files:
        typer.echo(path)
