"""Sizes that compressed chunks declare, compared with those of their array before memory is allocated.

A chunk of a few kilobytes may unpack to terabytes. Its first bytes give the size, and the description of its array
gives the size that it must have.
"""

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import zarr

HEAD = 18
"""Longest header of a compressed chunk up to its size [bytes]."""
_ZSTD = b"\x28\xb5\x2f\xfd"
_ABSENT = 2**64 - 1


def require_declared_size(content: bytes, size: int) -> None:
    """Refuse a compressed chunk that unpacks to more than its array has in a chunk.

    Args:
        content: The chunk, or its first `HEAD` bytes, compressed by zstd or blosc.
        size: Size of a chunk of the array [bytes].

    Raises:
        ValueError: The chunk declares no size, or a larger one.
    """
    if content[:4] == _ZSTD and len(content) > 5:
        # RFC 8878, 3.1.1.1: descriptor, window unless in a single segment, dictionary, size
        is_single, width = content[4] >> 5 & 1, (0, 2, 4, 8)[content[4] >> 6]
        width, begin = width or is_single, 6 - is_single + (0, 1, 2, 4)[content[4] & 3]
        declared = int.from_bytes(content[begin : begin + width], "little") + 256 * (width == 2) if width else -1
    else:  # header of blosc: version, version of the codec, flags, size of a number, size
        declared = int.from_bytes(content[4:8], "little") if content[:1] in (b"\1", b"\2") else -1
    if declared < 0:
        raise ValueError("it declares no size")
    if declared > size:
        raise ValueError(f"it declares {declared} bytes, and a chunk has {size}")


def require_declared_sizes(array: "zarr.Array[Any]", folder: Path, rows: range) -> None:
    """Refuse an array with a chunk among some rows that unpacks to more than a chunk.

    Args:
        array: The array.
        folder: Its folder.
        rows: Rows to look at, along the first axis; of an array without axes any.

    Raises:
        ValueError: Such a chunk is there.
    """
    if not any(type(codec).__name__ in ("ZstdCodec", "BloscCodec") for codec in _inner_codecs(array)):
        return
    pieces, size = array.shards or array.chunks, math.prod(array.chunks) * array.dtype.itemsize
    counts = [range(-(-extent // piece)) for extent, piece in zip(array.shape, pieces, strict=True)]
    if counts:
        counts[0] = range(min(rows) // pieces[0], max(rows) // pieces[0] + 1) if rows else range(0)
    for number in itertools.product(*counts):
        try:
            with (folder / array.metadata.encode_chunk_key(number)).open("rb") as file:
                heads = _shard_heads(file, array, number[0], rows) if array.shards else [file.read(HEAD)]
                for head in heads:
                    require_declared_size(head, size)
        except FileNotFoundError:
            continue  # a chunk of the fill value


def require_declared_axes(folder: Path) -> None:
    """Refuse a group with a coordinate of an axis, read whenever the group is opened, that unpacks to more than it has.

    Args:
        folder: Folder of the group.

    Raises:
        ValueError: Such a chunk is there.
    """
    for name, array in zarr.open_group(folder, mode="r", use_consolidated=True).arrays():
        described: Any = array.metadata  # of zarr 3, or of 2, which has no recordings
        if described.dimension_names == (name,):
            require_declared_sizes(array, folder / name, range(array.shape[0]))


def _inner_codecs(array: "zarr.Array[Any]") -> tuple[Any, ...]:
    """Codecs of a chunk, in a shard too."""
    described: Any = array.metadata
    codecs = tuple(described.codecs)
    return tuple(codecs[0].codecs) if array.shards else codecs


def _shard_heads(file: BinaryIO, array: "zarr.Array[Any]", number: int, rows: range) -> Iterator[bytes]:
    """First bytes of the chunks of some rows in a shard, by the index at its end."""
    pieces = array.shards or array.chunks
    grid = [-(-piece // chunk) for piece, chunk in zip(pieces, array.chunks, strict=True)]
    length = 16 * math.prod(grid)
    file.seek(-length - 4, 2)  # a checksum follows
    index = np.frombuffer(file.read(length), "<u8").reshape(*grid, 2)
    begin = number * pieces[0]
    first, last = (min(max(row - begin, 0), pieces[0] - 1) // array.chunks[0] for row in (min(rows), max(rows)))
    for offset, size in index[first : last + 1].reshape(-1, 2).tolist():
        if offset != _ABSENT:
            file.seek(min(offset, 1 << 62))
            yield file.read(min(HEAD, size))
