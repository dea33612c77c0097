"""Files of bathymetry that are damaged or lie about their size: refused by name, before memory is asked for."""

import subprocess
import sys
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

MOST_CELLS = 100_000_000
"""Most cells of a grid, or of one of its compressed pieces: ten thousand a side, a gigabyte while it is read [1]."""


_HDF5 = b"\x89HDF\r\n\x1a\n"
_PATIENCE = 20.0  # seconds, and one more for each megabyte: a thousand times what a whole file takes
_TRIAL = f"""
import sys
if sys.argv[1].lower().endswith(".bag"):
    import rasterio
    with rasterio.open(sys.argv[1], driver="BAG") as file:
        file.width * file.height > {MOST_CELLS} or file.read(1)
else:
    import math, netCDF4
    with netCDF4.Dataset(sys.argv[1]) as file:
        for found in file.variables.values():
            found.ndim > 2 or math.prod(found.shape) > {MOST_CELLS} or found[:]
"""


class GridError(ValueError):
    """A file that is no bathymetry, with the field of the scenario that says so."""

    def __init__(self, message: str, field: str = "file") -> None:
        """Hold what is wrong and where it was asked for."""
        super().__init__(message)
        self.field = field


@contextmanager
def foreign(path: str) -> Iterator[None]:
    """While a library reads a file: whatever it raises is the file's fault, and is said with its name.

    Args:
        path: The file.

    Raises:
        GridError: It cannot be read.
    """
    try:
        yield
    except GridError:
        raise
    except Exception as fault:  # a reader of foreign files may fail in any way
        said = " ".join(str(fault).split())[:120]
        raise GridError(
            f"{path}: cannot be read: {said or type(fault).__name__}. Is it whole? Copy or export it again."
        ) from None


def insist_on_size(path: str, shape: Sequence[int], piece: Sequence[int], kind: DTypeLike) -> None:
    """Refuse a grid that is no grid of numbers, or larger than memory should hold.

    Args:
        path: The file, for the message.
        shape: Cells along each axis.
        piece: Cells of what is unpacked at once, along each axis; empty where nothing is.
        kind: What a cell holds.

    Raises:
        GridError: It is; with its size, the limit and the way out.
    """
    for sides, what in ((shape, "it has"), (piece, "it is stored in pieces of")):
        cells = int(np.prod([int(side) for side in sides], dtype=object))
        if cells > MOST_CELLS:
            raise GridError(
                f"{path}: {what} {' x '.join(map(str, sides))} cells; {MOST_CELLS:,} is the most. Cut out the part "
                "that the sonar reaches, or resample it: gdal_translate -srcwin X Y WIDTH HEIGHT IN OUT"
            )
    if np.dtype(kind).kind not in "fiu":
        raise GridError(f"{path}: its cells hold {kind}, which are no real numbers. Is it the right variable?")


def array_shape(archive: zipfile.ZipFile, name: str, path: str) -> tuple[int, ...]:
    """Shape of an array in a NumPy archive, of which no more than the header is read.

    Args:
        archive: The archive.
        name: Name of the member.
        path: The file, for the message.

    Raises:
        GridError: The array is too large, or the archive holds fewer or more bytes than its header promises.
    """
    about = archive.getinfo(name)
    with archive.open(name) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, kind = read(file)
        start = file.tell()
    if len(shape) not in (1, 2):
        return shape  # of no use here, and never unpacked
    insist_on_size(path, shape, (), kind)
    promised = int(np.prod(shape, dtype=object)) * kind.itemsize
    if promised != about.file_size - start:
        raise GridError(
            f"{path}: {name} promises {promised} bytes and has {about.file_size - start}. It is damaged: save it again."
        )
    return shape


def insist_on_an_answer(path: str) -> None:
    """Refuse an HDF5 file over which its library would brood for ever, or end this process.

    A damaged file can lead the library round in circles (one in five hundred did), from which nothing in the same
    process can call it back. So such files are first read in a process of their own, for half a second.

    Args:
        path: The file; other kinds pass.

    Raises:
        GridError: There was no answer in time, or the process crashed.
    """
    with Path(path).open("rb") as file:
        is_hdf5 = file.read(len(_HDF5)) == _HDF5
    if not is_hdf5 or not sys.executable:
        return
    patience = _PATIENCE + Path(path).stat().st_size / 1e6
    try:
        tried = subprocess.run(
            [sys.executable, "-c", _TRIAL, path], timeout=patience, check=False,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        why = f"its library gave no answer in {patience:.0f} s"
    else:
        if tried.returncode >= 0:  # what failed there fails here as well, and is said here
            return
        why = "its library crashed"
    raise GridError(f"{path}: cannot be read: {why}. It is damaged: copy or export it again.")
