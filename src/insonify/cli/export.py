"""The command export: a recording in the format of another program."""

from pathlib import Path
from typing import Annotated, Any, cast

import typer

from insonify.cli.arguments import InputError
from insonify.cli.pictures import start_drawing
from insonify.formats.locations import location

AS_HELP = (
    "Format, where a suffix has several, the first without it: .xtf xtf, xtf-float32, xtf-recorded; .tif mosaic, "
    "labels, waterfall, bathymetry; .nc netcdf, sonar-netcdf4; .yolo yolo, yolo-segments; .maps maps, geotiff-maps."
)
MOST_DIGITS = 9
"""Digits of the largest tile."""


def export(
    recording: Annotated[
        str, typer.Argument(metavar="OUT", help="Recording made by `insonify run`: folder, URL or .nc.")
    ],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write; its suffix names the format.")],
    form: Annotated[
        str | None,
        typer.Option("--as", metavar="NAME", help=AS_HELP),
    ] = None,
    projection: Annotated[
        str | None, typer.Option(metavar="GRID", help="Grid of annotated images: slant, ground or mosaic.")
    ] = None,
    tile: Annotated[
        str | None, typer.Option(metavar="SIZE", help="Tiles of annotated images, rows x columns, such as 512x512.")
    ] = None,
    classes: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Classes of annotated images: parts, shapes or labels of targets."),
    ] = None,
) -> None:
    """Write a recording for another program: XTF, KMALL, GeoTIFF, CSV, GeoJSON, netCDF, HDF5, MCAP (ROS bags), PNG.

    Of a run with --labels also annotated images: COCO, YOLO, label maps.

    Example: insonify export harbour.zarr harbour.xtf

    Example: insonify export s3://bucket/harbour.zarr harbour.tif --as waterfall

    Example: insonify export harbour.zarr harbour.coco --projection ground --tile 512x512
    """
    from insonify.writers.export import export as write

    start_drawing()
    options = {"projection": cast(Any, projection), "tile": _tile(tile), "classes": cast(Any, classes)}
    typer.echo(write(location(recording), file, form, **options))


def _tile(text: str | None) -> tuple[int, int] | None:
    """Rows and columns of a tile, refused where they are none."""
    if text is None:
        return None
    rows, _, columns = text.lower().replace(" ", "").partition("x")
    if not rows.isdecimal() or not columns.isdecimal() or max(len(rows), len(columns)) > MOST_DIGITS:
        raise InputError(f"--tile {text}: no size of a tile. Write rows x columns, such as 512x512")
    return int(rows), int(columns)
