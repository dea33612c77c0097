"""Checks of bathymetry files for damage and false sizes, before memory is allocated."""

import os
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import DTypeLike

MAX_CELLS = 100_000_000
"""Largest number of cells of a grid, or of one of its compressed pieces: a gigabyte while it is read [1]."""


class GridError(ValueError):
    """Error of a bathymetry file, with the key of the scenario at which it is reported."""

    def __init__(self, message: str, field: str = "file") -> None:
        """Store the message and the key that it belongs to."""
        super().__init__(message)
        self.field = field


@contextmanager
def library_errors_as_grid_errors(path: str) -> Iterator[None]:
    """Context in which a library reads a file: any exception becomes an error on the file, with its name.

    Args:
        path: The file.

    Raises:
        GridError: The file cannot be read.
    """
    try:
        yield
    except GridError:
        raise
    except Exception as fault:  # a reader of foreign files may fail in any way
        reason = " ".join(str(fault).split())[:120]
        raise GridError(
            f"{path}: cannot be read: {reason or type(fault).__name__}. Is it whole? Copy or export it again."
        ) from None


def require_grid_size(path: str, shape: Sequence[int], piece: Sequence[int], kind: DTypeLike) -> None:
    """Refuse a grid that has no real numbers, or too many.

    Args:
        path: The file, for the message.
        shape: Cells along each axis.
        piece: Cells along each axis of a part that is decompressed at once; empty for an uncompressed file.
        kind: Data type of a cell.

    Raises:
        GridError: The grid is no such grid; with its size, the limit and the fix.
    """
    for sides, what in ((shape, "it has"), (piece, "it is stored in pieces of")):
        cells = int(np.prod([int(side) for side in sides], dtype=object))
        if cells > MAX_CELLS:
            raise GridError(
                f"{path}: {what} {' x '.join(map(str, sides))} cells; {MAX_CELLS:,} is the most. Cut out the part "
                "that the sonar reaches, or resample it: gdal_translate -srcwin X Y WIDTH HEIGHT IN OUT"
            )
    if np.dtype(kind).kind not in "fiu":
        raise GridError(f"{path}: its cells hold {kind}, which are no real numbers. Is it the right variable?")


def array_shape(archive: zipfile.ZipFile, name: str, path: str) -> tuple[int, ...]:
    """Shape of an array in a NumPy archive, from its header alone.

    Args:
        archive: The archive.
        name: Name of the member.
        path: The file, for the message.

    Raises:
        GridError: The array is too large, or the archive has fewer or more bytes than the header declares.
    """
    info = archive.getinfo(name)
    with archive.open(name) as file:
        version = np.lib.format.read_magic(file)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, kind = read_header(file)
        start = file.seek(0, os.SEEK_CUR)
    if len(shape) not in (1, 2):
        return shape  # not used, hence never decompressed
    require_grid_size(path, shape, (), kind)
    promised = int(np.prod(shape, dtype=object)) * kind.itemsize
    if promised != info.file_size - start:
        raise GridError(
            f"{path}: {name} promises {promised} bytes and has {info.file_size - start}. It is damaged: save it again."
        )
    return shape
