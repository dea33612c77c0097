"""Files that a scenario names: where they lie, and whether they are still what they were."""

import csv
import hashlib
import signal
import stat
import subprocess
import sys
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo
from pydantic_core import PydanticCustomError

from insonify.model import field_error


def _resolve_path(value: str, info: ValidationInfo) -> str:
    folder = (info.context or {}).get("folder", "")
    return str(Path(folder, value).expanduser().absolute())


def _fill_in_digest(value: str | None, info: ValidationInfo) -> str | None:
    if value is not None or "file" not in info.data:
        return value
    try:
        return file_digest(info.data["file"])
    except (OSError, ValueError):
        return None  # reading the file reports what is wrong with it


DataFile = Annotated[str, AfterValidator(_resolve_path)]
"""A file that a scenario names: beside the scenario file (validation context `folder`), else beside the caller."""
Fingerprint = Annotated[str | None, AfterValidator(_fill_in_digest), Field(validate_default=True)]
"""SHA-256 of the file that the field `file` above it names, filled in when it is read."""


_OUT_OF_TIME = getattr(signal, "SIGXCPU", 0)
MAX_TRIAL_VALUES = 100_000_000
"""Numbers of an array above which it is not read on trial."""
_TRIAL_VALUES = 1_000_000
"""Numbers that are read at once on trial, and whole chunks: what a damaged file promises sets no time limit."""
_HDF5 = b"\x89HDF\r\n\x1a\n"
_TRIAL_TIMEOUT = 20.0  # seconds on the clock, and one more for each megabyte, also where the machine is busy
_TRIAL_SECONDS, _TRIAL_RATE = (
    1.0,
    5e7,
)  # processor time to open a file, and bytes read in a second of it: a tenth of usual
_TRIAL = f"""
import math, sys, time
try:
    import resource
except ImportError:  # not on this system: the clock alone decides
    resource = None

def allow(size):
    if resource:  # one limit for each part that is read, so that a library in circles is stopped in seconds
        most = math.ceil(time.process_time() + {_TRIAL_SECONDS} + size / {_TRIAL_RATE})
        resource.setrlimit(resource.RLIMIT_CPU, (most, resource.getrlimit(resource.RLIMIT_CPU)[1]))

if sys.argv[1].lower().endswith(".bag"):
    import rasterio
    allow(float(sys.argv[2]))
    with rasterio.open(sys.argv[1], driver="BAG") as file:
        for _, window in file.block_windows(1) if file.width * file.height <= {MAX_TRIAL_VALUES} else ():
            allow(8 * window.width * window.height)
            file.read(1, window=window)
else:
    import netCDF4
    allow(float(sys.argv[2]))
    with netCDF4.Dataset(sys.argv[1]) as file:
        for found in file.variables.values():
            if not found.shape or math.prod(found.shape) > {MAX_TRIAL_VALUES}:
                continue
            row, chunks = math.prod(found.shape[1:]), found.chunking()
            rows = max({_TRIAL_VALUES} // max(row, 1), 1 if isinstance(chunks, str) else chunks[0])
            for first in range(0, found.shape[0], rows):
                allow(8 * row * min(rows, found.shape[0]))
                found[first : first + rows]
"""
_TRIED: set[tuple[str, int, int, int]] = set()
"""Files that need no second trial: path, inode, size [bytes] and time of change [ns]."""
MAX_TABLE_BYTES = 256 << 20
"""Most bytes of a table in text: some millions of rows."""


def require_regular_file(path: str | Path, max_bytes: int) -> int:
    """Size of an ordinary file [bytes], before a byte of it is read.

    Args:
        path: Its path.
        max_bytes: Most bytes that it may have.

    Raises:
        OSError: It is not there, or a folder.
        ValueError: It is a device or a pipe, which may never end, or too large.
    """
    about = Path(path).stat()
    if stat.S_ISDIR(about.st_mode):
        raise IsADirectoryError(21, "it is a folder", str(path))
    if not stat.S_ISREG(about.st_mode):
        raise ValueError(f"{path}: not an ordinary file but a device or a pipe. Save its content in a file.")
    if about.st_size > max_bytes:
        raise ValueError(
            f"{path}: {about.st_size / 1e6:,.0f} MB; {max_bytes / 1e6:,.0f} MB is the most. Is it the right file? "
            "If so, keep the part that is needed."
        )
    return about.st_size


def table_text(path: str | Path) -> str:
    """Text of a table, without a mark of byte order.

    Raises:
        OSError: It cannot be opened.
        ValueError: It is not text in UTF-8, no ordinary file, or too large; the file and its line are named.
    """
    require_regular_file(path, MAX_TABLE_BYTES)
    raw = Path(path).read_bytes()
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        line = raw[: fault.start].count(b"\n") + 1
        raise ValueError(f"{path}, line {line}: not text. Save the table as CSV in UTF-8.") from None


def table_rows(path: str | Path, example: str) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of each row that is neither blank nor a comment, the header first.

    Cells are separated by commas, semicolons or tabs. A line ends at a line feed, as in every editor: no cell continues
    in the next line.

    Args:
        path: File of the table.
        example: Header that the error message of an empty file proposes.

    Raises:
        OSError: The file cannot be opened.
        ValueError: A row cannot be read, or has more or fewer cells than the header; file and line are named.
    """
    lines = table_text(path).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    filled = [(i, line) for i, line in enumerate(lines, 1) if line.strip(" \t,;") and not line.lstrip().startswith("#")]
    if not filled:
        raise ValueError(f"{path}, line 1: the file is empty. Write a header: {example}")
    delimiter = next((mark for mark in ";\t" if mark in filled[0][1]), ",")
    columns = 0
    for i, line in filled:
        if line.count('"') % 2:
            raise ValueError(f"{path}, line {i}: a quote is opened and not closed. Close it, or delete it.")
        try:
            row = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
        except csv.Error as fault:
            raise ValueError(f"{path}, line {i}: not a row of a table ({fault}). Correct or delete the line.") from None
        columns = columns or len(row)
        if len(row) != columns:
            raise ValueError(
                f"{path}, line {i}: {len(row)} columns where the header has {columns}. Is a value missing?"
            )
        yield i, row


def name_and_unit(title: str, synonyms: Mapping[str, str]) -> tuple[str, str]:
    """Name and unit of a column with a header such as "Depth [m]" or "heading (deg)"."""
    name, _, unit = title.replace("(", "[").partition("[")
    name = name.strip().lower()
    return synonyms.get(name, name), unit.strip(" ])")


def is_number(text: str) -> bool:
    """True for a cell that holds a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def file_digest(file: str | Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal digits; read again only where its time or size has changed.

    Raises:
        OSError: The file cannot be opened.
    """
    status = Path(file).stat()
    if not stat.S_ISREG(status.st_mode):
        raise ValueError(f"{file}: not an ordinary file")  # a device may never end
    return _digest(str(file), status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=64)
def _digest(file: str, changed: int, size: int) -> str:
    with Path(file).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


EXTRAS = {
    "io": ("netCDF4", "rasterio", "h5py"), "targets": ("trimesh",), "ros": ("rosbags",), "cluster": ("distributed",),
    "remote": ("fsspec",),
}  # fmt: skip
"""Packages of each extra of the installation."""


def install_advice(extra: str) -> str:
    """Command that installs an extra: from a checkout the checkout's own, else its packages by their names.

    Args:
        extra: One of `EXTRAS`.
    """
    checkout = Path(__file__).parents[2]
    if (checkout / "pyproject.toml").is_file() and Path(__file__).parents[1].name == "src":
        return f"pip install '{checkout}[{extra}]'"
    return f"pip install {' '.join(EXTRAS[extra])}"


def require_unchanged(file: str, sha256: str | None) -> None:
    """Refuse a file that has changed since its fingerprint was taken; other faults are reported on reading it.

    Args:
        file: Its path.
        sha256: The fingerprint.

    Raises:
        PydanticCustomError: It has changed.
    """
    if (fault := _changed(file, sha256)) is not None:
        raise fault


def _changed(file: str, sha256: str | None) -> PydanticCustomError | None:
    try:
        digest = file_digest(file)
    except (OSError, ValueError):
        return None
    if digest == sha256:
        return None
    return field_error("sha256", f"{str(sha256)[:12]}...", f"is not the fingerprint of {file}: the file has changed "
                   "since. Leave sha256 out to take the file as it is.")  # fmt: skip


def require_readable_hdf5(path: str | Path) -> None:
    """Refuse an HDF5 file (netCDF 4, BAG) over which its library would brood for ever, or end this process.

    A damaged file can lead the library round in circles (one in two to five hundred did), from which nothing in the
    same process can call it back. So such files are first read in a process of their own, once and for half a second;
    its processor time is limited by the size of the file, and of each variable, so that a busy machine changes nothing.

    Args:
        path: The file; other kinds pass.

    Raises:
        ValueError: There was no result in time, or the process crashed.
    """
    with Path(path).open("rb") as file:
        is_hdf5 = file.read(len(_HDF5)) == _HDF5
    if not is_hdf5 or not sys.executable:
        return
    about = Path(path).stat()
    size, state = about.st_size, (str(path), about.st_ino, about.st_size, about.st_mtime_ns)
    if state in _TRIED:
        return
    patience = _TRIAL_TIMEOUT + size / 1e6
    try:
        tried = subprocess.run(
            [sys.executable, "-c", _TRIAL, str(path), str(size)], timeout=patience, check=False,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        why = f"its library gave no result in {patience:.0f} s"
    else:
        if tried.returncode >= 0:  # what failed there fails here as well, and is reported here
            _TRIED.add(state)
            return
        hung = tried.returncode == -_OUT_OF_TIME
        why = "its library gave no result in the time that ten such files take" if hung else "its library crashed"
    raise ValueError(f"{path}: cannot be read: {why}. It is damaged: copy or export it again.")
