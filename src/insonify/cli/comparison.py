"""The command compare: two recordings, measure by measure."""

from pathlib import Path
from typing import Annotated

import typer

from insonify.cli.arguments import InputError, require_writable
from insonify.formats.locations import location


def compare(
    real: Annotated[str, typer.Argument(metavar="REAL", help="Recording of an instrument, or of ours: file or URL.")],
    simulated: Annotated[str, typer.Argument(metavar="SIMULATED", help="Recording to compare with it.")],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="REPORT", help="Report to write, such as report.html, .json or .png."),
    ] = None,
    group: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Group of a file with several, such as '38 kHz', 'water column' or port."),
    ] = None,
) -> None:
    """Compare two recordings: echo trains, levels, distributions, each with an interval and a verdict.

    Example: insonify compare harbour.raw harbour.zarr --group "200 kHz" -o harbour.html
    """
    if out is not None:
        require_writable(out, "--out", "report", (".html", ".json", ".png"))
    sources = [location(text) for text in (real, simulated)]
    for path in sources:
        if isinstance(path, Path) and not path.exists():
            raise InputError(f"{path}: there is no such file. Give two recordings: insonify compare REAL SIMULATED")
    from insonify.comparison.compare import compare as compared
    from insonify.comparison.report import text_report, write_report

    comparison = compared(sources[0], sources[1], group=group)
    typer.echo(text_report(comparison))
    if out is not None:
        from insonify.cli.pictures import start_drawing

        start_drawing()
        typer.echo(write_report(comparison, out))
