"""Descriptions of arrays on disk, checked before arrays are opened.

An array is described by a few hundred bytes of JSON. Reading an array takes the memory that its description declares,
so the declared sizes are compared with one another, and with limits, before any array is opened.
"""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import Any

from insonify.formats.shards import MOST_PINGS
from insonify.records.recording import FIELDS

IDENTITY = "insonify_recording"
"""Attribute with the unique identity of a recording."""
MUST_AGREE = ("scenario", "seed", "version")
"""Attributes that all writers of a recording share."""
SOUND = (*FIELDS, "recorded")
"""Arrays with results; a recording has one at least."""
REPAIR_ADVICE = "Restore it from a copy, or delete the folder and simulate again"
MOST_IN_PING = 1 << 28
"""Largest size of one chunk, which is a ping with all its channels [1]."""
MAX_PINGS = 100_000_000
MAX_CHUNKS = 100_000
"""Largest number of files of an array: that of `MAX_PINGS` in shards of 1024."""
_CODECS = ("bytes", "zstd", "blosc", "sharding_indexed", "crc32c")
_KINDS = ("bool", "uint8", "int32", "int64", "float32", "float64", "complex64")


class StoreError(ValueError):
    """A recording that cannot be written or read; the message gives the remedy."""


class WriteError(OSError):
    """A recording that can no longer be written; the message gives the reason and the remedy."""


def read_description(folder: Path) -> dict[str, Any]:
    """Read the description of a group or an array that zarr wrote.

    Raises:
        StoreError: The file is missing or damaged; the message names it.
    """
    file = folder / "zarr.json"
    try:
        return parse_description(file.read_bytes(), file)
    except FileNotFoundError:
        raise StoreError(f"{file} is missing from the recording. {REPAIR_ADVICE}") from None
    except OSError as fault:
        raise StoreError(f"{file} cannot be read: {fault.strerror}. {REPAIR_ADVICE}") from None


def parse_description(text: bytes, file: str | Path) -> dict[str, Any]:
    """Description of a group or an array.

    Args:
        text: Content of its file.
        file: Name of the file, or of the object.

    Raises:
        StoreError: It is damaged; the message names it.
    """
    try:
        content = json.loads(text)
    except UnicodeDecodeError:
        raise StoreError(f"{file} is damaged: not text. {REPAIR_ADVICE}") from None
    except json.JSONDecodeError as fault:
        where = f"line {fault.lineno}, column {fault.colno}"
        raise StoreError(f"{file}, {where}: damaged, not JSON ({fault.msg}). {REPAIR_ADVICE}") from None
    except (ValueError, RecursionError) as fault:
        raise StoreError(f"{file}: damaged, not JSON ({fault}). {REPAIR_ADVICE}") from None
    if not isinstance(content, dict):
        raise StoreError(f"{file} is damaged: it describes nothing. {REPAIR_ADVICE}")
    return content


def require_consistent_sizes(description: Mapping[str, Any], file: str | Path) -> None:
    """Refuse a group whose arrays declare contradictory or impossible sizes.

    Args:
        description: Description of the group, with those of its arrays.
        file: Name of its file, or of its object.

    Raises:
        StoreError: The sizes are inconsistent; the message names the array.
    """
    try:
        arrays = dict(description["consolidated_metadata"]["metadata"])
        sizes: dict[str, int] = {}
        for name, array in arrays.items():
            shape, names = array["shape"], array["dimension_names"]
            pieces = chunk = array["chunk_grid"]["configuration"]["chunk_shape"]
            codecs = array["codecs"]
            if codecs[0]["name"] == "sharding_indexed":
                codecs = [*codecs, *codecs[0]["configuration"]["codecs"]]
            if any(codec["name"] not in _CODECS for codec in codecs):
                raise StoreError(f"{file} is damaged: {name} is compressed as no recording is. {REPAIR_ADVICE}")
            if array["codecs"][0]["name"] == "sharding_indexed":  # a chunk is read at a time, with the index
                chunk = array["codecs"][0]["configuration"]["chunk_shape"]
                if chunk[1:] != pieces[1:] or chunk[0] != 1 or pieces[0] > MOST_PINGS:
                    raise StoreError(f"{file} is damaged: {name} has shards of {pieces}. {REPAIR_ADVICE}")
            if not (len(shape) == len(names) == len(pieces)) or array["data_type"] not in _KINDS:
                raise StoreError(f"{file} is damaged: the array {name} is none of a recording. {REPAIR_ADVICE}")
            for size, dimension, piece in zip(shape, names, pieces, strict=True):
                if type(size) is not int or not 0 <= size <= MOST_IN_PING or size != sizes.setdefault(dimension, size):
                    raise StoreError(f"{file} is damaged: {name} has {size} along {dimension}. {REPAIR_ADVICE}")
                if type(piece) is not int or not 0 < piece <= max(size, 1):
                    raise StoreError(f"{file} is damaged: {name} is stored in pieces of {piece}. {REPAIR_ADVICE}")
            if math.prod(-(-size // piece) for size, piece in zip(shape, pieces, strict=True)) > MAX_CHUNKS:
                raise StoreError(f"{file} is damaged: {name} promises {shape} in pieces of {pieces}. {REPAIR_ADVICE}")
            if math.prod(chunk) > MOST_IN_PING or sizes.get("ping", 0) > MAX_PINGS:
                raise StoreError(f"{file} is damaged: {name} promises {shape}, more than memory holds. {REPAIR_ADVICE}")
    except (KeyError, TypeError, AttributeError, ValueError) as fault:
        if isinstance(fault, StoreError):
            raise
        raise StoreError(f"{file} is damaged: it describes no arrays of a recording. {REPAIR_ADVICE}") from None


def require_same_scenario(
    where: str | Path, stored: Mapping[str, Any], attributes: Mapping[str, Any], advice: str
) -> None:  # fmt: skip
    """Refuse a recording of another scenario.

    Args:
        where: Folder of the recording, or its URL.
        stored: Attributes of the recording.
        attributes: Attributes of the run.
        advice: Remedy.

    Raises:
        StoreError: The scenario, the seed or the version is another.
    """
    differ = [name for name in MUST_AGREE if stored.get(name) != attributes.get(name)]
    if differ:
        raise StoreError(
            f"{where} holds a recording of another {' and '.join(differ)}{_first_difference(stored, attributes)}. "
            f"{advice}"
        )


def _first_difference(stored: Mapping[str, Any], attributes: Mapping[str, Any]) -> str:
    """First difference of the texts of two scenarios, in brackets; empty without texts or a difference."""
    texts = [attrs.get("scenario") for attrs in (stored, attributes)]
    if not all(isinstance(text, str) for text in texts):
        return ""
    for old_line, new_line in zip_longest(*(str(text).splitlines() for text in texts), fillvalue=""):
        if old_line != new_line:
            old, new = (" ".join(line.split()[:6]) or "nothing" for line in (old_line, new_line))
            return f" (the first line that differs: there {old!r}, now {new!r})"
    return ""


@contextmanager
def errors_as_store_errors(folder: str | Path) -> Iterator[None]:
    """Convert all errors of the library while a recording is opened into `StoreError`.

    Raises:
        StoreError: The recording cannot be opened.
    """
    try:
        yield
    except (StoreError, MemoryError):
        raise
    except Exception as fault:  # a reader of foreign files may fail in any way
        content = " ".join(str(fault).split())[:120]
        raise StoreError(
            f"{folder} is damaged: it cannot be opened ({content or type(fault).__name__}). {REPAIR_ADVICE}"
        ) from None
