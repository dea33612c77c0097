"""The command export: a recording in the format of another program."""

from pathlib import Path
from typing import Annotated

import typer

from insonify.cli.pictures import start_drawing


def export(
    recording: Annotated[Path, typer.Argument(metavar="OUT", help="Recording made by `insonify run`.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write; its suffix names the format.")],
    form: Annotated[
        str | None,
        typer.Option("--as", metavar="NAME", help="Format, where a suffix has several, such as xtf-float32."),
    ] = None,
) -> None:
    """Write a recording in the format of another program: XTF, KMALL, GeoTIFF, CSV, GeoJSON, netCDF, HDF5, PNG.

    Example: insonify export harbour.zarr harbour.xtf

    Example: insonify export harbour.zarr harbour.tif --as waterfall
    """
    from insonify.writers.export import export as write

    start_drawing()
    typer.echo(write(recording, file, form))
