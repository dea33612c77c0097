"""Store of zarr whose chunks are checked when they are read: an error names the file or object, and the remedy.

A chunk is refused before memory is allocated where it declares more than its array has in a chunk. The check needs no
request of its own, so that it is the same on disk and in an object store.
"""

import math
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from zarr.abc.store import ByteRequest, RangeByteRequest, Store
from zarr.core.buffer import Buffer, BufferPrototype
from zarr.storage import WrapperStore

from insonify.formats.chunk_sizes import HEAD, require_declared_size
from insonify.formats.shards import ABSENT, LOOSE
from insonify.formats.store_description import REPAIR_ADVICE, SOUND, StoreError

CHECKSUM = 4
"""Length of the checksum after the index of a shard [bytes]."""


class CheckedStore(WrapperStore[Store]):
    """Arrays of a recording, or of its labels."""

    def __init__(self, store: Store, recording: str | Path, description: Mapping[str, Any], labels: str = "") -> None:
        """Wrap a store.

        Args:
            store: Store of zarr with the group.
            recording: Folder of the recording, or its URL.
            description: Description of the group, with those of its arrays.
            labels: Name of the folder of the labels; empty: the recording itself.
        """
        super().__init__(store)
        self._recording, self._description, self._labels = recording, description, labels
        self._arrays = description["consolidated_metadata"]["metadata"]

    def _with_store(self, store: Store) -> Self:
        return type(self)(store, self._recording, self._description, self._labels)

    def damaged(self, key: str, reason: object) -> StoreError:
        """Error about a damaged file or object.

        Args:
            key: Its name in the group.
            reason: What is wrong with it.
        """
        advice, again = REPAIR_ADVICE, f"insonify run FILE -o {self._recording}"
        if key.startswith(LOOSE):
            advice = f"Write its pings again: {again}{' --labels' * bool(self._labels)}"
        elif self._labels:
            advice = f"Delete {self._recording}/{self._labels} and label again: {again} --labels"
        elif key.partition("/")[0] in (*SOUND, "done"):
            advice = f"Delete it and simulate its pings again: {again}"
        return StoreError(f"{self._name(key)} is damaged: {reason}. {advice}")

    def _name(self, key: str) -> str:
        return "/".join(part for part in (str(self._recording), self._labels, key) if part)

    async def get(
        self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None
    ) -> Buffer | None:  # fmt: skip
        """Content of a file or an object, or part of it; None without.

        Args:
            key: Its name in the group.
            prototype: Kind of memory.
            byte_range: Part to read; None: all.

        Raises:
            StoreError: A chunk is damaged, or cannot be read.
        """
        try:
            content = await self._store.get(key, prototype, byte_range)
        except Exception as error:  # of the package of any store
            raise self._unreadable(key, error) from error
        return self._checked(key, content, byte_range)

    def get_sync(
        self, key: str, *, prototype: BufferPrototype | None = None, byte_range: ByteRequest | None = None
    ) -> Buffer | None:  # fmt: skip
        """The same without waiting for others, as later versions of zarr can read."""
        try:
            content = self._store.get_sync(key, prototype=prototype, byte_range=byte_range)  # type: ignore[attr-defined]
        except Exception as error:
            raise self._unreadable(key, error) from error
        return self._checked(key, content, byte_range)

    async def get_ranges(
        self, key: str, byte_ranges: Sequence[ByteRequest | None], **options: Any
    ) -> AsyncIterator[Any]:
        """Several parts, as later versions of zarr read them: those of neighbouring chunks by one request."""
        async for group in self._store.get_ranges(key, byte_ranges, **options):  # type: ignore[attr-defined]
            yield [(index, self._checked(key, content, byte_ranges[index])) for index, content in group]

    def get_ranges_sync(self, key: str, byte_ranges: Sequence[ByteRequest | None], **options: Any) -> Any:
        """The same without waiting for others."""
        parts = self._store.get_ranges_sync(key, byte_ranges, **options)  # type: ignore[attr-defined]
        return [(index, self._checked(key, content, byte_ranges[index])) for index, content in parts]

    def _unreadable(self, key: str, error: Exception) -> StoreError:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        return StoreError(
            f"{self._name(key)} cannot be read: {reason}. Check the connection, and the permission to read"
        )

    def _checked(self, key: str, content: Buffer | None, byte_range: ByteRequest | None) -> Buffer | None:
        """The content of a file or an object, or part of it, where no chunk in it is damaged."""
        name, _, chunk = key.partition("/")
        if content is not None and chunk.startswith("c") and name in self._arrays:
            try:
                _require_chunk(content, self._arrays[name], byte_range)
            except ValueError as fault:
                raise self.damaged(key, fault) from None
        return content


def _require_chunk(content: Buffer, array: Mapping[str, Any], byte_range: ByteRequest | None) -> None:
    """Refuse a chunk, a shard, or a part of a shard that is cut or unpacks to more than its array has in a chunk."""
    codecs, shape = array["codecs"], array["chunk_grid"]["configuration"]["chunk_shape"]
    rows = 0
    if codecs[0]["name"] == "sharding_indexed":
        rows, shape = shape[0], codecs[0]["configuration"]["chunk_shape"]
        codecs = codecs[0]["configuration"]["codecs"]
    if codecs[-1]["name"] in ("zstd", "blosc"):
        size = math.prod(shape) * np.dtype(array["data_type"]).itemsize
        for head in _heads(content, rows, byte_range):
            require_declared_size(head, size)


def _heads(content: Buffer, rows: int, byte_range: ByteRequest | None) -> Iterator[bytes]:
    """First bytes of each chunk in a file or object of a shard of some rows; 0: without shards."""
    if not rows or isinstance(byte_range, RangeByteRequest):
        yield content[:HEAD].to_bytes()
        return
    length = 16 * rows + CHECKSUM
    if len(content) < length:
        raise ValueError(f"it has {len(content)} bytes, and the index of its shard alone has {length}")
    if byte_range is None:  # else the index alone
        index = np.frombuffer(content[-length:-CHECKSUM].to_bytes(), "<u8").reshape(rows, 2)
        for offset, size in index.tolist():
            if offset != ABSENT:
                yield content[offset : offset + min(HEAD, size)].to_bytes()
