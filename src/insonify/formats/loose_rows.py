"""Loose rows: rows of incomplete shards, appended by each process to files of its own.

A file holds rows of one array and one shard by one process. Each row is a record: a header with the number of the row,
its length and two checksums, and its bytes, compressed. So a run creates a few files for each shard, not one for each
ping: on some file systems a new file costs a millisecond, and clusters limit the number of files. A process that is
killed leaves at most the last record of its files incomplete, which then ends the file.
"""

import errno
import os
import struct
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from google_crc32c import value as crc32c  # comes with zarr, whose checksum of shards it is

Confirm = Callable[[], object]
"""Function that raises an error where another recording has taken the place of the one that is written."""
_HEADER = struct.Struct("<QQII")
"""Number of the row, length of its bytes, their checksum, and the checksum of these three."""
_CHECKED = _HEADER.size - 4


class LooseRow(NamedTuple):
    """Position of one row in a file."""

    file: Path
    offset: int
    """First of its bytes."""
    length: int
    checksum: int

    def content(self) -> bytes:
        """Bytes of the row.

        Raises:
            FileNotFoundError: The file was deleted.
            ValueError: The bytes are not those that were written.
        """
        with self.file.open("rb", buffering=0) as opened:
            opened.seek(self.offset)
            content = opened.read(self.length)
        if len(content) != self.length or crc32c(content) != self.checksum:
            raise ValueError(f"{self.file} has damaged bytes from {self.offset} on")
        return content

    def is_intact(self) -> bool:
        """Return True where the bytes are those that were written."""
        with suppress(FileNotFoundError, ValueError):
            self.content()
            return True
        return False


class _OwnFiles:
    """Suffix of the files of this process: new in a forked one, and after a record that is incomplete."""

    suffix = uuid.uuid4().hex

    @classmethod
    def renew(cls) -> None:
        """Begin new files."""
        cls.suffix = uuid.uuid4().hex


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_OwnFiles.renew)


def append_row(folder: Path, shard: int, row: int, content: bytes, confirm: Confirm) -> None:
    """Append one row to this process's file of a shard.

    The file is opened in the folder before `confirm` is called: so it is never that of another recording.

    Args:
        folder: Folder of the loose rows of an array.
        shard: Number of the shard.
        row: Number of the row.
        content: Its bytes, compressed.
        confirm: Function that raises an error where the folder is that of another recording by now.
    """
    head = _HEADER.pack(row, len(content), crc32c(content), 0)[:_CHECKED]
    record = head + crc32c(head).to_bytes(4, "little") + content
    file = folder / f"{shard}-{_OwnFiles.suffix}"
    try:
        opened = file.open("ab", buffering=0)
    except FileNotFoundError:
        confirm()
        folder.mkdir(parents=True, exist_ok=True)
        opened = file.open("ab", buffering=0)
    with opened:
        confirm()
        try:
            if opened.write(record) != len(record):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except BaseException:
            _OwnFiles.renew()
            raise


def loose_rows(folder: Path, shard: int | None = None, *, intact: bool = False) -> dict[int, LooseRow]:
    """Rows that are loose.

    Args:
        folder: Folder of the loose rows of an array; without it there are none.
        shard: Number of the shard; None: of all.
        intact: True: only those whose bytes are the ones that were written; all of them are read.
    """
    return {
        row: found for file in _files(folder, shard) for row, found in _records(file)
        if not intact or found.is_intact()
    }  # fmt: skip


def loose_shards(folder: Path) -> set[int]:
    """Numbers of the shards with loose rows."""
    return {int(file.name.partition("-")[0]) for file in _files(folder)}


def delete_loose_rows(folder: Path, shard: int) -> None:
    """Delete the loose rows of a shard, those of all processes."""
    for file in _files(folder, shard):
        file.unlink(missing_ok=True)


def _files(folder: Path, shard: int | None = None) -> list[Path]:
    """Files of a shard, or of all, in the order of their names."""
    with suppress(FileNotFoundError):
        split = [name.partition("-") for name in sorted(os.listdir(folder))]
        return [
            folder / "".join(parts) for parts in split
            if parts[0].isdecimal() and parts[1] and shard in (None, int(parts[0]))
        ]  # fmt: skip
    return []


def _records(file: Path) -> Iterator[tuple[int, LooseRow]]:
    """Rows of one file, up to the first record that is incomplete."""
    with suppress(FileNotFoundError), file.open("rb", buffering=0) as opened:
        offset, size = 0, os.fstat(opened.fileno()).st_size
        while len(head := opened.read(_HEADER.size)) == _HEADER.size:
            row, length, checksum, own = _HEADER.unpack(head)
            offset += _HEADER.size
            if own != crc32c(head[:_CHECKED]) or offset + length > size:
                return
            yield row, LooseRow(file, offset, length, checksum)
            offset = opened.seek(offset + length)
