"""Loose rows: rows of incomplete shards, appended by each process to files of its own.

A file holds rows of one array and one shard by one process. Each row is a record: a header with the number of the row,
its length and two checksums, and its bytes, compressed. So a run creates a few files for each shard, not one for each
ping: on some file systems a new file costs a millisecond, and clusters limit the number of files. A process that is
killed leaves at most the last record of its files incomplete, which then ends the file.
"""

import os
import struct
import uuid
from collections.abc import Callable, Collection, Iterator
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
        with self.file.open("rb") as opened:
            opened.seek(self.offset)
            content = opened.read(self.length)
        if len(content) != self.length or crc32c(content) != self.checksum:
            raise ValueError(f"its bytes from {self.offset} on are not those that were written")
        return content

    def is_intact(self) -> bool:
        """Return True where the bytes are those that were written."""
        with suppress(FileNotFoundError, ValueError):
            self.content()
            return True
        return False


class OwnFiles:
    """Suffix of the files of this process: new of each writer, in a forked one, and after an incomplete record."""

    suffix = uuid.uuid4().hex

    @classmethod
    def renew(cls) -> None:
        """Begin new files."""
        cls.suffix = uuid.uuid4().hex


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=OwnFiles.renew)


def append_row(folder: Path, shard: int, row: int, content: bytes, confirm: Confirm) -> None:
    """Append one row to this process's file of a shard.

    The file is opened in the folder before `confirm` is called: so it is never that of another recording.

    Args:
        folder: Folder of the loose rows of an array, two levels below the recording or its labels, which are there.
        shard: Number of the shard.
        row: Number of the row.
        content: Its bytes, compressed; none: the row is that of an array without it.
        confirm: Function that raises an error where the folder is that of another recording by now.
    """
    head = _HEADER.pack(row, len(content), crc32c(content), 0)[:_CHECKED]
    record = head + crc32c(head).to_bytes(4, "little") + content
    file = folder / f"{shard}-{OwnFiles.suffix}"
    try:
        opened = file.open("ab", buffering=0)
    except FileNotFoundError:
        confirm()
        folder.parent.mkdir(exist_ok=True)  # without parents: a recording that was renamed since is not made anew
        folder.mkdir(exist_ok=True)
        opened = file.open("ab", buffering=0)
    with opened:
        confirm()
        try:
            while record:  # in one call, unless the disk is full or there are more than 2 GB
                record = record[opened.write(record) :]
        except BaseException:
            OwnFiles.renew()
            raise


def loose_rows(
    folder: Path, shards: Collection[int] | None = None, *, intact: Collection[int] = ()
) -> dict[int, LooseRow]:  # fmt: skip
    """Rows that are loose.

    Args:
        folder: Folder of the loose rows of an array; without it there are none.
        shards: Numbers of the shards; None: all.
        intact: Shards of which only those rows count whose bytes are the ones that were written; all of them are read.
    """
    return {
        row: found for file in loose_files(folder, shards) for row, found in _records(file)
        if _shard(file) not in intact or found.is_intact()
    }  # fmt: skip


def loose_shards(folder: Path) -> set[int]:
    """Numbers of the shards with loose rows."""
    return {_shard(file) for file in loose_files(folder)}


def loose_files(folder: Path, shards: Collection[int] | None = None) -> list[Path]:
    """Files of some shards, those of all processes, in the order of their names; None: of all shards."""
    with suppress(FileNotFoundError):
        split = [name.partition("-") for name in sorted(os.listdir(folder))]
        return [
            folder / "".join(parts) for parts in split
            if parts[0].isdecimal() and parts[1] and (shards is None or int(parts[0]) in shards)
        ]  # fmt: skip
    return []


def _shard(file: Path) -> int:
    """Number of the shard to which the rows of a file belong."""
    return int(file.name.partition("-")[0])


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
