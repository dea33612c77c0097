"""The command that draws the paper's figures."""

from pathlib import Path
from typing import Annotated

import typer

from insonify.cli.words import InputError


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
    from insonify.cli.progress import progress
    from insonify.study import paper as study

    strange = [number for number in figure or [] if number not in study.FIGURES]
    if strange:
        there = ", ".join(map(str, study.FIGURES))
        raise InputError(f"--figure {strange[0]}: not a figure that can be drawn; choose from {there}")
    with progress(False, "figure") as on_figure:
        paths = study.run(figure or None, out, on_figure=on_figure)
    for path in paths:
        typer.echo(path)
