"""Export of a recording to the format of another program, chosen by the suffix of the file."""

import errno
import os
import shutil
import uuid
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import xarray as xr

from insonify.caller_warning import warn_caller
from insonify.data_file import EXTRAS, install_advice
from insonify.formats.store_description import StoreError, WriteError
from insonify.records.recording import FIELDS
from insonify.surveys.survey import Survey, open_survey

if TYPE_CHECKING:
    from insonify.annotations.class_names import ClassScheme
    from insonify.annotations.labelled_image import Projection
    from insonify.annotations.labelled_images import Tile


class ExportFormat(NamedTuple):
    """Suffixes of a format, its content, and the function that writes it."""

    suffixes: tuple[str, ...]
    content: str
    writer: str
    """Module and function, called with a survey and the path of the file."""
    package: str = ""
    """Package that it needs beyond those that are always installed."""
    is_folder: bool = False
    """True for a folder of annotated images, whose writer also takes a projection and a size of tiles."""
    size: str = ""
    """Module and function that give the largest size of the file of a survey [bytes], and the reason for it."""


UNWRITABLE = {errno.ENAMETOOLONG, errno.EROFS, errno.ENOENT, errno.ENOTDIR}
"""Errors of the system that concern the name of the file, and not its content."""
GREAT_SIZE = 1e9
"""Size of a file from which it is stated before the file is written [bytes]."""
GREAT_RATIO, LEAST_GREAT = 4.0, 1e8
"""Size re that of the recording's samples from which it is stated [1], for files of the second size or more [bytes]."""
LEAST_FREE = 1 << 20
"""Free space below which a library that fails without a reason has found the disk full [bytes]."""
FORMATS: dict[str, ExportFormat] = {
    "xtf": ExportFormat((".xtf",), "sidescan pings, 16 bit", "xtf.write_xtf"),
    "xtf-float32": ExportFormat((".xtf",), "sidescan pings, unrounded", "xtf.write_xtf_float32"),
    "xtf-recorded": ExportFormat((".xtf",), "lines of the sonar's recorder", "xtf.write_xtf_recorded"),
    "mosaic": ExportFormat((".tif", ".tiff"), "sidescan mosaic on the terrain", "geotiff.write_mosaic", "rasterio"),
    "labels": ExportFormat((".tif", ".tiff"), "labels on the mosaic", "geotiff.write_labels", "rasterio"),
    "waterfall": ExportFormat((".tif", ".tiff"), "pings over ground range", "geotiff.write_waterfall", "rasterio"),
    "bathymetry": ExportFormat((".tif", ".tiff"), "soundings in cells", "soundings.write_bathymetry", "rasterio"),
    "csv": ExportFormat((".csv",), "soundings as a table", "soundings.write_csv"),
    "geojson": ExportFormat((".geojson", ".json"), "soundings as points", "soundings.write_geojson"),
    "netcdf": ExportFormat((".nc",), "all of the recording", "netcdf.write_netcdf", size="netcdf.netcdf_size"),
    "sonar-netcdf4": ExportFormat(
        (".nc",),
        "samples, beams and platform, ICES convention 2.0",
        "sonar_netcdf4.write_sonar_netcdf4",
        "netCDF4",
        size="netcdf.netcdf_size",
    ),
    "kmall": ExportFormat((".kmall",), "multibeam soundings and seabed image", "kmall.write_kmall"),
    "kmwcd": ExportFormat((".kmwcd",), "multibeam water column", "kmall.write_kmwcd"),
    "airsas": ExportFormat(
        (".h5", ".hdf5"), "synthetic aperture, AirSAS layout", "airsas.write_airsas", "h5py", size="airsas.airsas_size"
    ),
    "rosbag": ExportFormat(
        (".mcap",), "pings, their meaning and poses as ROS 2 messages", "rosbag.write_rosbag", "rosbags"
    ),
    "coco": ExportFormat((".coco",), "images, masks and boxes", "annotated_images.write_coco", is_folder=True),
    "yolo": ExportFormat((".yolo",), "images and boxes", "annotated_images.write_yolo", is_folder=True),
    "yolo-segments": ExportFormat(
        (".yolo",), "images and outlines", "annotated_images.write_yolo_segments", is_folder=True
    ),
    "maps": ExportFormat((".maps",), "images and label maps", "annotated_images.write_maps", is_folder=True),
    "geotiff-maps": ExportFormat(
        (".maps",), "levels and label maps as GeoTIFF", "annotated_images.write_geotiff_maps", "rasterio", True
    ),
    "picture": ExportFormat((".png", ".pdf", ".svg"), "picture with axes", "picture.write_picture"),
}
"""Formats by name; of several with one suffix, the first is written unless another is named."""


def export(
    recording: xr.Dataset | str | Path, path: str | Path, name: str | None = None, *,
    projection: "Projection | None" = None, tile: "Tile | None" = None, classes: "ClassScheme | None" = None,
) -> Path:  # fmt: skip
    """Write a recording in the format of another program.

    The file is written under a temporary name and renamed when it is whole; one of that name is replaced. Pings are
    read one after the other, so that recordings larger than memory can be written.

    Args:
        recording: As from `insonify.simulate` or `open_recording`, or the folder or URL of a recording.
        path: File to write, such as "harbour.xtf"; its suffix names the format.
        name: One of `insonify.writers.export.FORMATS`; None: the first with that suffix.
        projection: Grid of annotated images: "slant" range, "ground" range or "mosaic"; None: slant range.
        tile: Rows and columns of a tile of annotated images; None: not cut.
        classes: Classes of annotated images: "parts", or "shapes" or "labels" of targets; None: parts.

    Returns:
        The path.

    Raises:
        StoreError: No such format, or one that the recording does not fit; the message gives the remedy.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> insonify.export(insonify.simulate(scenario, pings=[0, 1]), "sidescan.xtf").name
        'sidescan.xtf'
    """
    target = Path(path)
    chosen = FORMATS[_format_name(target, name)]
    if chosen.package and find_spec(chosen.package) is None:
        extra = next(extra for extra, packages in EXTRAS.items() if chosen.package in packages)
        raise StoreError(f"{target}: writing it needs {chosen.package}. Install it: {install_advice(extra)}")
    if not target.parent.is_dir():
        raise StoreError(f"{target}: there is no folder {target.parent}. Make it first: mkdir -p {target.parent}")
    try:
        target.exists()
    except OSError as fault:
        raise StoreError(f"{target}: cannot be written: {fault.strerror}. Choose another name") from None
    if target.is_dir() or (chosen.is_folder and target.exists()):
        other = "of a folder that is not there yet" if chosen.is_folder else "of a file"
        raise StoreError(f"{target} {'is a folder' if target.is_dir() else 'is there'}. Choose the name {other}")
    options = {"projection": projection, "tile": tile, "classes": classes}
    given = {key: value for key, value in options.items() if value is not None}
    if given and not chosen.is_folder:
        folders = ", ".join(known for known, about in FORMATS.items() if about.is_folder)
        named = " and ".join(key if key == "classes" else f"a {key}" for key in given)
        raise StoreError(f"{target}: only annotated images have {named}. Leave it out, or write one of "
                         f"{folders}")  # fmt: skip
    survey = open_survey(recording)
    if chosen.size:
        _warn_of_size(target, survey, *_function(chosen.size)(survey))
    partial = target.with_name(f".{target.stem[:20]}.{uuid.uuid4().hex}.partial{target.suffix}")
    try:
        _function(chosen.writer)(survey, partial, **given)
        os.replace(partial, target)
    except OSError as fault:
        if fault.errno in UNWRITABLE and str(fault.filename) in (str(partial), str(target)):
            raise StoreError(f"{target}: cannot be written: {fault.strerror}. Choose another name or folder") from None
        if fault.errno == errno.ENOSPC:
            raise _full(target) from None
        raise
    except RuntimeError:
        if shutil.disk_usage(target.parent).free < LEAST_FREE:  # netCDF has one message for all faults
            raise _full(target) from None
        raise
    finally:
        if chosen.is_folder:
            shutil.rmtree(partial, ignore_errors=True)
        else:
            partial.unlink(missing_ok=True)
    return target


def _function(name: str) -> Callable[..., Any]:
    """Function of a writer, loaded."""
    module, function = name.split(".")
    return cast(Callable[..., Any], getattr(import_module(f"insonify.writers.{module}"), function))


def _warn_of_size(target: Path, survey: Survey, size: float, reason: str) -> None:
    """State the size of a file before it is written, where it is great or far above that of the recording."""
    samples = sum(survey.recording[name].nbytes for name in FIELDS if name in survey.recording)
    if size >= GREAT_SIZE or (size >= LEAST_GREAT and size > GREAT_RATIO * samples):
        free = shutil.disk_usage(target.parent).free
        warn_caller(
            f"{target} will have up to {_readable(size)}, and the recording has samples of {_readable(samples)}: "
            f"{reason}. {_readable(free)} are free"
        )


def _readable(size: float) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


def _full(target: Path) -> WriteError:
    return WriteError(f"{target}: No space left on device. Free some space, or choose another folder")


def _format_name(path: Path, name: str | None) -> str:
    """Name of the format of a file, refused where there is none."""
    suffix = path.suffix.lower()
    if name in FORMATS and FORMATS[name].is_folder and not suffix:
        return name
    of_suffix = [known for known, about in FORMATS.items() if suffix in about.suffixes]
    if not of_suffix:
        suffixes = sorted({suffix for about in FORMATS.values() for suffix in about.suffixes})
        raise StoreError(f"{path}: {suffix or 'no suffix'} names no format. End it in one of {', '.join(suffixes)}")
    if name is None:
        return of_suffix[0]
    if name not in FORMATS:
        raise StoreError(f"{name}: there is no such format. Choose one of {', '.join(FORMATS)}")
    if name not in of_suffix:
        raise StoreError(
            f"{path}: {name} is a format of {', '.join(FORMATS[name].suffixes)}. Change the suffix, or "
            f"choose one of {', '.join(of_suffix)}"
        )
    return name
