"""Shards: files of many consecutive pings, and the loose pings of which they are made.

Pings of a long recording are loose until all those of their shard are there: appended to files in the folder `.loose`
by any number of writers in any order (`loose_rows`). Then their bytes are joined to one file with an index (sharding
codec of zarr 3), which is renamed into place; its entry in the mask is written and the loose pings are deleted.
All writers of a ping write the same bytes, so that a second writer of a ping or a shard does no harm.
"""

import json
import math
import os
import time as clock
import uuid
from collections.abc import Collection, Iterable, Iterator, Mapping
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
from insonify.formats.loose_rows import Confirm, LooseRow, append_row, loose_files, loose_rows, loose_shards

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

    def make_folder(self, shard: int) -> None:
        """Make the folder of a shard's file; a recording that was renamed meanwhile is not made anew."""
        file, folder = self.shard_file(shard), self.group
        for name in file.parent.relative_to(folder).parts:
            folder /= name
            folder.mkdir(exist_ok=True)

    @property
    def loose_folder(self) -> Path:
        """Folder of the loose rows."""
        return self.group / LOOSE / self.name

    def rows(self, shard: int) -> range:
        """Rows of a shard."""
        return range(shard * self.per_shard, min((shard + 1) * self.per_shard, self.shape[0]))

    def loose_rows(
        self, shards: Collection[int] | None = None, *, intact: Collection[int] = ()
    ) -> dict[int, LooseRow]:  # fmt: skip
        """Rows that are loose; arguments see `loose_rows.loose_rows`."""
        return {} if self.per_shard == 1 else loose_rows(self.loose_folder, shards, intact=intact)

    def loose_shards(self) -> set[int]:
        """Shards with loose rows."""
        return set() if self.per_shard == 1 else loose_shards(self.loose_folder)

    def decoded(self, content: bytes) -> NDArray[Any]:
        """One row from its bytes, shape (1, ...)."""
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


def put_rows(rows: Iterable[tuple[RowArray, int, bytes]], confirm: Confirm = _confirmed) -> None:
    """Write rows of some arrays that have shards of one length: loose, or each as a file of its own.

    Args:
        rows: Array, number and bytes of each row, in the order in which they are written.
        confirm: See `loose_rows.append_row`.
    """
    files = []
    for array, row, content in rows:
        if array.per_shard > 1:
            append_row(array.loose_folder, row // array.per_shard, row, content, confirm)
        elif content:
            files.append((array, row, content))
    if files:
        _put_chunks(files, confirm)


def _put_chunks(chunks: Iterable[tuple[RowArray, int, bytes]], confirm: Confirm) -> None:
    """Write files atomically, as zarr does but ten times as fast: under other names, then renamed in their order.

    A recording may be replaced by another at any moment: its folder is renamed, and a new one takes its name. The files
    are created in one of them before `confirm` is called; where that is the old one, the renaming by path fails, and
    where it is the new one, `confirm` does.

    Args:
        chunks: Array, number and bytes of each chunk, compressed.
        confirm: Function that raises an error where the path is that of another recording by now.
    """
    pending: list[tuple[Path, Path]] = []
    try:
        for array, row, content in chunks:
            file = array.shard_file(row)
            pending.append((file.with_name(f".{file.name}.{uuid.uuid4().hex}.partial"), file))
            try:
                pending[-1][0].write_bytes(content)
            except FileNotFoundError:
                confirm()
                array.make_folder(row)
                pending[-1][0].write_bytes(content)
        confirm()
        while pending:
            os.replace(*pending[0])
            del pending[0]
    except FileNotFoundError:
        confirm()
        raise
    finally:
        for aside, _ in pending:
            aside.unlink(missing_ok=True)


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


def recorded_rows(group: Path, arrays: list[RowArray], *, intact: Collection[int] = ()) -> NDArray[np.bool_]:
    """Mask of the rows of `done` that are entered and are there in each of some arrays, shape (row,).

    Loose rows are looked at before shards: those that are packed meanwhile are in a shard then.

    Args:
        group: Folder of the recording, or of its labels.
        arrays: Arrays over the same rows.
        intact: See `loose_rows.loose_rows`.
    """
    done = row_array(group, "done")
    mask = np.zeros(done.shape, bool)
    loose = set(done.loose_rows(intact=intact))
    if loose:
        loose.intersection_update(*(array.loose_rows(intact=intact) for array in arrays))
    for shard in numbered(group / "done" / "c"):
        rows = done.rows(shard)
        entered = _entries(done, shard)[: len(rows)]
        there = all(array.shard_file(shard).is_file() for array in arrays)
        mask[rows.start : rows.start + len(entered)] = entered & there
    mask[sorted(loose)] = True
    return mask


def pack_shards(
    group: Path, names: Iterable[str], shards: Iterable[int] | None = None, confirm: Confirm = _confirmed
) -> None:  # fmt: skip
    """Pack the shards of which all rows are there, and delete their loose rows.

    Args:
        group: Folder of the recording, or of its labels.
        names: Its arrays but `done`.
        shards: Shards to look at; None: all that have loose rows.
        confirm: See `loose_rows.append_row`.
    """
    done = row_array(group, "done")
    if done.per_shard == 1:
        return
    arrays = [array for array in (row_array(group, name) for name in names) if array.per_shard > 1]
    if shards is None:
        _sweep(group / LOOSE)
        shards = {shard for array in (done, *arrays) for shard in array.loose_shards()}
    for shard in sorted(shards):
        if _is_packed(done, arrays, shard) or _pack(done, arrays, shard, confirm):
            # Entries first: without them, no other writer packs what is left.
            packed = [file for array in (done, *arrays) for file in loose_files(array.loose_folder, [shard])]
            confirm()  # after the files were listed, which are not those of a recording that takes its place
            for file in packed:
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
    for intact in ((), (shard,)):  # all bytes are read twice only where some are damaged
        try:
            return _pack_rows(done, arrays, shard, confirm, intact=intact)
        except ValueError:
            continue
    return False


def _pack_rows(
    done: RowArray, arrays: list[RowArray], shard: int, confirm: Confirm, *, intact: Collection[int]
) -> bool:  # fmt: skip
    """As `_pack`.

    Raises:
        ValueError: The bytes of a loose row are damaged.
    """
    rows = set(done.rows(shard))
    if not rows <= done.loose_rows([shard], intact=intact).keys():
        return False
    loose = [array.loose_rows([shard], intact=intact) for array in arrays]
    if not all(set(array.rows(shard)) <= there.keys() for array, there in zip(arrays, loose, strict=True)):
        return False
    try:
        for array, there in zip(arrays, loose, strict=True):
            if array.rows(shard):
                array.make_folder(shard)
                with _renamed(array.shard_file(shard), done.group / LOOSE, confirm) as aside:
                    with aside.open("wb") as packed:
                        packed.writelines(_shard_bytes(array, shard, there))
                    if not rows <= done.loose_rows([shard]).keys():  # entries are deleted before rows
                        raise _PackedMeanwhileError
    except _PackedMeanwhileError:
        return _is_packed(done, arrays, shard)
    entries = np.zeros(done.per_shard, bool)
    entries[: len(rows)] = True
    done.make_folder(shard)
    with _renamed(done.shard_file(shard), done.group / LOOSE, confirm) as aside:
        aside.write_bytes(done.codec.encode(entries))
    return True


class _PackedMeanwhileError(Exception):
    """Another writer has packed a shard, and deletes its loose rows."""


def _shard_bytes(array: RowArray, shard: int, loose: Mapping[int, LooseRow]) -> Iterator[bytes]:
    """Bytes of a shard: its rows, then an index of offsets and lengths with a checksum."""
    index, offset = np.full((array.per_shard, 2), ABSENT, "<u8"), 0
    for number, row in enumerate(array.rows(shard)):
        try:
            content = loose[row].content()
        except FileNotFoundError:
            raise _PackedMeanwhileError from None
        if content:
            index[number] = offset, len(content)
            offset += len(content)
            yield content
    encoded = index.tobytes()
    yield encoded + crc32c(encoded).to_bytes(4, "little")


def _entries(done: RowArray, shard: int) -> NDArray[np.bool_]:
    """Entries of one shard of the mask; none of a damaged one."""
    try:
        content = done.shard_file(shard).read_bytes()
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
