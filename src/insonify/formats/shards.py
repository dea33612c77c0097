"""Shards: files of many consecutive pings, and the loose pings of which they are made.

A long recording has one file for each ping only while it is simulated: in the folder `.loose`, by any number of
writers in any order. When all pings of a shard are there, their bytes are joined to one file with an index (sharding
codec of zarr 3), which is renamed into place; then its entry in the mask is written and the loose pings are deleted.
All writers of a ping write the same bytes, so that a second writer of a ping or a shard does no harm.
"""

import json
import math
import os
import time as clock
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from google_crc32c import value as crc32c  # comes with zarr, whose checksum of shards it is
from numcodecs.abc import Codec
from numcodecs.blosc import Blosc  # comes with zarr, as the next
from numcodecs.zstd import Zstd
from numpy.typing import NDArray

from insonify.formats.chunk_sizes import require_declared_size

LOOSE = ".loose"
"""Folder of the loose pings of a recording, or of its labels."""
FEWEST_PINGS, MOST_PINGS = 64, 1024
"""Pings of a shard, where their size allows; recordings of fewer have a file for each ping [1]."""
LEAST_BYTES, MOST_BYTES = 64 << 20, 512 << 20
"""Size of a shard, where its number of pings allows [bytes]."""
OBJECT_BYTES, FEWEST_IN_OBJECT, OBJECTS, MOST_OBJECTS = 8 << 20, 16, 64, 1 << 14
"""Size of a shard in an object store [bytes], its fewest pings, shards of a recording that they allow, and most [1]."""
ABSENT = 2**64 - 1
"""Offset and length of a row that a shard lacks."""
Confirm = Callable[[], object]
"""Function that raises an error where another recording has taken the place of the one that is written."""
ENTRY = ".entry"
"""End of the name of the file whose other names are the entries of loose pings."""
STALE = 600.0
"""Age at which an unfinished file is that of a killed writer [s]."""
_CODECS: dict[str, Codec] = {"zstd": Zstd(level=0), "blosc": Blosc("lz4", 5, Blosc.SHUFFLE)}


def _confirmed() -> None:
    """Nothing to confirm."""


def pings_per_shard(pings: int, ping_bytes: int, line: int = 1, *, in_store: bool = False) -> int:
    """Pings of one shard: 64 to 1024 of them and 64 to 512 MB, as far as both can be.

    In an object store a part of a run is whole shards, which are therefore smaller: 8 MB, or a 64th of the recording
    where that is less, of 16 pings at least.

    Args:
        pings: Pings of the recording.
        ping_bytes: Size of one ping [bytes].
        line: Pings of one line of the recorder, which share a shard [1].
        in_store: True: of a recording in an object store.

    Returns:
        1 where each ping has a file of its own.

    Example:
        >>> [pings_per_shard(count, size) for count, size in ((50, 10**4), (10**6, 10**4), (10**6, 10**6))]
        [1, 1024, 67]
        >>> [pings_per_shard(count, 10**4, in_store=True) for count in (50, 1000, 10**4, 10**6)]
        [1, 16, 156, 838]
    """
    if pings <= FEWEST_PINGS:
        return 1
    length = min(max(FEWEST_PINGS, LEAST_BYTES // max(ping_bytes, 1)), MOST_PINGS, pings)
    count = max(min(length, MOST_BYTES // max(ping_bytes, 1)), 1)
    if in_store:
        smaller = min(OBJECT_BYTES // max(ping_bytes, 1), pings // OBJECTS)
        count = min(count, max(smaller, FEWEST_IN_OBJECT, -(-pings // MOST_OBJECTS)))
    return min(max(count // line, 1) * line, pings // line * line) or 1


class RowArray(NamedTuple):
    """Array on disk whose rows are pings, or lines of a recorder."""

    group: Path
    """Folder of the recording, or of its labels."""
    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    per_shard: int
    """Rows of a shard; 1: each row has a file of its own."""
    separator: str
    codec: Codec

    def shard_file(self, shard: int) -> Path:
        """File of a shard, or of a row without shards."""
        key = self.separator.join(["c", str(shard), *["0"] * (len(self.shape) - 1)])
        return self.group / self.name / key

    def row_file(self, row: int) -> Path:
        """File to which a row is written."""
        return self.shard_file(row) if self.per_shard == 1 else self.group / LOOSE / self.name / str(row)

    def rows(self, shard: int) -> range:
        """Rows of a shard."""
        return range(shard * self.per_shard, min((shard + 1) * self.per_shard, self.shape[0]))

    def loose_rows(self) -> list[int]:
        """Rows that have a loose file."""
        return [] if self.per_shard == 1 else numbered(self.group / LOOSE / self.name)

    def read_loose(self, row: int) -> NDArray[Any] | None:
        """One row of its loose file, shape (1, ...); None without."""
        try:
            content = self.row_file(row).read_bytes()
        except FileNotFoundError:
            return None
        require_declared_size(content, math.prod(self.shape[1:]) * self.dtype.itemsize)
        values = np.frombuffer(bytes(self.codec.decode(content)), self.dtype)
        return values.reshape(1, *self.shape[1:])


def row_array(group: str | Path, name: str) -> RowArray:
    """Description of an array of a recording.

    Args:
        group: Folder of the recording, or of its labels.
        name: Name of the array.
    """
    state = os.stat(os.path.join(group, name, "zarr.json"))
    return _row_array(str(group), name, state.st_ino, state.st_mtime_ns)


@lru_cache(maxsize=64)
def _row_array(group: str, name: str, number: int, changed: int) -> RowArray:
    """Description by inode and time of change, cached because every ping needs it."""
    return described_array(
        Path(group), name, json.loads((Path(group) / name / "zarr.json").read_text(encoding="utf-8"))
    )


def described_array(group: Path, name: str, described: Mapping[str, Any]) -> RowArray:
    """Array of a recording by its description.

    Args:
        group: Folder of the recording, or of its labels.
        name: Name of the array.
        described: Content of its zarr.json.
    """
    codecs, shape = described["codecs"], tuple(described["shape"])
    chunk = described["chunk_grid"]["configuration"]["chunk_shape"]
    if codecs[0]["name"] == "sharding_indexed":
        codecs = codecs[0]["configuration"]["codecs"]
    separator = described["chunk_key_encoding"].get("configuration", {}).get("separator", "/")
    dtype = np.dtype(described["data_type"]).newbyteorder("<")
    return RowArray(group, name, shape, dtype, chunk[0], separator, _CODECS[codecs[-1]["name"]])


def put_chunks(chunks: Iterable[tuple[str, bytes]], confirm: Confirm = _confirmed) -> None:
    """Write files atomically, as zarr does but ten times as fast: under other names, then renamed in their order.

    A recording may be replaced by another at any moment: its folder is renamed, and a new one takes its name. The files
    are created in one of them before `confirm` is called; where that is the old one, the renaming by path fails, and
    where it is the new one, `confirm` does.

    Args:
        chunks: Path of the file of each chunk, and its bytes, compressed.
        confirm: Function that raises an error where the path is that of another recording by now.
    """
    pending: list[tuple[str, str]] = []
    try:
        for file, content in chunks:
            folder, name = os.path.split(file)
            pending.append((os.path.join(folder, f".{name}.{uuid.uuid4().hex}.partial"), file))
            _create(pending[-1][0], content, confirm)
        confirm()
        for aside, file in pending:
            os.replace(aside, file)
    except FileNotFoundError:
        confirm()
        raise
    finally:
        for aside, _ in pending:  # also after a renaming: one between two names of the same file does nothing
            Path(aside).unlink(missing_ok=True)


def _create(file: str, content: bytes, confirm: Confirm) -> None:
    """Create a file, and its folder if the recording is still the intended one."""
    try:
        _write(file, content)
    except FileNotFoundError:
        confirm()
        Path(file).parent.mkdir(parents=True, exist_ok=True)
        _write(file, content)


def _write(file: str, content: bytes) -> None:
    """Write a file; the entry of a loose ping as one more name of the first such file in its folder.

    All entries have the same content. A name costs a twentieth of what a file of its own may cost.
    """
    folder = os.path.dirname(file)
    if folder.endswith(os.path.join(LOOSE, "done")):
        first = os.path.join(folder, f".{crc32c(content):08x}{ENTRY}")
        try:
            if not os.path.isfile(first):
                aside = f"{first}.{uuid.uuid4().hex}.partial"
                Path(aside).write_bytes(content)
                os.replace(aside, first)
            os.link(first, file)
            return
        except OSError:  # no second names here, no more of them, or another writer has deleted the first one
            pass
    Path(file).write_bytes(content)


@contextmanager
def _renamed(file: Path, folder: Path, confirm: Confirm) -> Iterator[Path]:
    """Another name for a file, in some folder: renamed at the end if confirmed, deleted after an error."""
    aside = folder / f".{file.name}.{uuid.uuid4().hex}.partial"
    try:
        yield aside
        confirm()
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
    os.replace(aside, file)


def recorded_rows(group: Path, arrays: list[RowArray]) -> NDArray[np.bool_]:
    """Mask of the rows of `done` that are entered and have their file in each of some arrays, shape (row,).

    Args:
        group: Folder of the recording, or of its labels.
        arrays: Arrays over the same rows.
    """
    done = row_array(group, "done")
    mask = np.zeros(done.shape, bool)
    for shard in numbered(group / "done" / "c"):
        rows = done.rows(shard)
        entered = _entries(done, done.shard_file(shard))[: len(rows)]
        there = all(array.shard_file(shard).is_file() for array in arrays)
        mask[rows.start : rows.start + len(entered)] = entered & there
    for row in done.loose_rows():
        mask[row] |= bool(_entries(done, done.row_file(row)).all()) and all(a.row_file(row).is_file() for a in arrays)
    return mask


def pack_shards(
    group: Path, names: Iterable[str], shards: Iterable[int] | None = None, confirm: Confirm = _confirmed
) -> None:  # fmt: skip
    """Pack the shards of which all rows are there, and delete their loose rows.

    Args:
        group: Folder of the recording, or of its labels.
        names: Its arrays but `done`.
        shards: Shards to look at; None: all that have loose rows.
        confirm: See `put_chunks`.
    """
    done = row_array(group, "done")
    if done.per_shard == 1:
        return
    arrays = [array for array in (row_array(group, name) for name in names) if array.per_shard > 1]
    if shards is None:
        _sweep(group / LOOSE)
        shards = {row // array.per_shard for array in (done, *arrays) for row in array.loose_rows()}
    for shard in sorted(shards):
        if _is_packed(done, arrays, shard) or _pack(done, arrays, shard, confirm):
            confirm()
            for array in (done, *arrays):  # entries first: without them, no other writer packs what is left
                for row in array.rows(shard):
                    array.row_file(row).unlink(missing_ok=True)
    if not done.loose_rows():
        for file in (group / LOOSE / done.name).glob(f".*{ENTRY}"):
            file.unlink(missing_ok=True)


def _sweep(folder: Path) -> None:
    """Delete what writers that were killed have left of files."""
    for file in folder.rglob("*.partial"):
        with suppress(FileNotFoundError):
            if clock.time() - file.stat().st_mtime > STALE:
                file.unlink()


def _is_packed(done: RowArray, arrays: list[RowArray], shard: int) -> bool:
    """True where all files of a shard are there."""
    return all(array.shard_file(shard).is_file() for array in (done, *arrays) if array.rows(shard))


def _pack(done: RowArray, arrays: list[RowArray], shard: int, confirm: Confirm) -> bool:
    """Join the loose rows of a shard where all are there; True where this or another writer has done so."""
    if not set(done.rows(shard)) <= set(done.loose_rows()):  # no files are looked for one by one
        return False
    marks = [done.row_file(row) for row in done.rows(shard)]
    needed = [array.row_file(row) for array in arrays if array.dtype != bool for row in array.rows(shard)]
    if not all(file.is_file() for file in (*marks, *needed)):
        return False
    try:
        for array in arrays:
            if array.rows(shard):
                array.shard_file(shard).parent.mkdir(parents=True, exist_ok=True)
                with _renamed(array.shard_file(shard), done.group / LOOSE, confirm) as aside:
                    with aside.open("wb") as packed:
                        packed.writelines(_shard_bytes(array, shard))
                    if not all(mark.is_file() for mark in marks):  # entries are deleted before rows
                        raise _PackedMeanwhileError
    except _PackedMeanwhileError:
        return _is_packed(done, arrays, shard)
    entries = np.zeros(done.per_shard, bool)
    entries[: len(marks)] = True
    done.shard_file(shard).parent.mkdir(exist_ok=True)
    with _renamed(done.shard_file(shard), done.group / LOOSE, confirm) as aside:
        aside.write_bytes(done.codec.encode(entries))
    return True


class _PackedMeanwhileError(Exception):
    """Another writer has packed a shard, and deletes its loose rows."""


def _shard_bytes(array: RowArray, shard: int) -> Iterator[bytes]:
    """Bytes of a shard: its rows, then an index of offsets and lengths with a checksum."""
    index, offset = np.full((array.per_shard, 2), ABSENT, "<u8"), 0
    for number, row in enumerate(array.rows(shard)):
        try:
            content = array.row_file(row).read_bytes()
        except FileNotFoundError:
            if array.dtype != bool:
                raise _PackedMeanwhileError from None
            continue  # a row of False has no file
        index[number] = offset, len(content)
        offset += len(content)
        yield content
    encoded = index.tobytes()
    yield encoded + crc32c(encoded).to_bytes(4, "little")


def _entries(done: RowArray, file: Path) -> NDArray[np.bool_]:
    """Entries of one chunk of the mask; none of a damaged one."""
    try:
        content = file.read_bytes()
        require_declared_size(content, done.per_shard)
        return np.frombuffer(bytes(done.codec.decode(content)), bool)
    except (RuntimeError, ValueError, FileNotFoundError):
        return np.zeros(0, bool)


def numbered(folder: Path) -> list[int]:
    """Numbers that are names of files in a folder.

    Args:
        folder: The folder; none where it is not there.
    """
    try:
        return [int(name) for name in os.listdir(folder) if name.isdecimal()]
    except FileNotFoundError:
        return []
