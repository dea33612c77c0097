"""Descriptions of arrays on disk, checked before arrays are opened.

An array is described by a few hundred bytes of JSON. Reading an array takes the memory that its description declares,
so the declared sizes are compared with one another, and with limits, before any array is opened.
"""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

REPAIR_ADVICE = "Restore it from a copy, or delete the folder and simulate again"
MOST_IN_PING = 1 << 28
"""Largest size of one chunk, which is a ping with all its channels [1]."""
MAX_PINGS = 100_000_000
_KINDS = ("bool", "uint8", "int32", "int64", "float32", "float64", "complex64")


class StoreError(ValueError):
    """A recording that cannot be written or read; the message gives the remedy."""


def read_description(folder: Path) -> dict[str, Any]:
    """Read the description of a group or an array that zarr wrote.

    Args:
        folder: Folder of the group or array.

    Raises:
        StoreError: The file is missing or damaged; the message names it.
    """
    file = folder / "zarr.json"
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise StoreError(f"{file} is damaged: not text. {REPAIR_ADVICE}") from None
    except json.JSONDecodeError as fault:
        where = f"line {fault.lineno}, column {fault.colno}"
        raise StoreError(f"{file}, {where}: damaged, not JSON ({fault.msg}). {REPAIR_ADVICE}") from None
    except (ValueError, RecursionError) as fault:
        raise StoreError(f"{file}: damaged, not JSON ({fault}). {REPAIR_ADVICE}") from None
    except FileNotFoundError:
        raise StoreError(f"{file} is missing from the recording. {REPAIR_ADVICE}") from None
    if not isinstance(content, dict):
        raise StoreError(f"{file} is damaged: it describes nothing. {REPAIR_ADVICE}")
    return content


def require_consistent_sizes(folder: Path) -> None:
    """Refuse a group whose arrays declare contradictory or impossible sizes.

    Args:
        folder: Folder of the group, whose description lists its arrays.

    Raises:
        StoreError: The sizes are inconsistent; the message names the array.
    """
    file = folder / "zarr.json"
    try:
        arrays = dict(read_description(folder)["consolidated_metadata"]["metadata"])
        sizes: dict[str, int] = {}
        for name, array in arrays.items():
            shape, names = array["shape"], array["dimension_names"]
            pieces = array["chunk_grid"]["configuration"]["chunk_shape"]
            if not (len(shape) == len(names) == len(pieces)) or array["data_type"] not in _KINDS:
                raise StoreError(f"{file} is damaged: the array {name} is none of a recording. {REPAIR_ADVICE}")
            for size, dimension, piece in zip(shape, names, pieces, strict=True):
                if type(size) is not int or not 0 <= size <= MOST_IN_PING or size != sizes.setdefault(dimension, size):
                    raise StoreError(f"{file} is damaged: {name} has {size} along {dimension}. {REPAIR_ADVICE}")
                if type(piece) is not int or not 0 < piece <= max(size, 1):
                    raise StoreError(f"{file} is damaged: {name} is stored in pieces of {piece}. {REPAIR_ADVICE}")
            if math.prod(pieces) > MOST_IN_PING or sizes.get("ping", 0) > MAX_PINGS:
                raise StoreError(f"{file} is damaged: {name} promises {shape}, more than memory holds. {REPAIR_ADVICE}")
    except (KeyError, TypeError, AttributeError, ValueError) as fault:
        if isinstance(fault, StoreError):
            raise
        raise StoreError(f"{file} is damaged: it describes no arrays of a recording. {REPAIR_ADVICE}") from None


@contextmanager
def errors_as_store_errors(folder: Path) -> Iterator[None]:
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


def with_named_chunks(dataset: xr.Dataset, folder: Path, advice: Mapping[str, str]) -> xr.Dataset:
    """The same dataset, read from disk on access; access to a damaged chunk raises `StoreError` with its file.

    Args:
        dataset: Dataset of a zarr group.
        folder: Folder of the group.
        advice: Remedy for a damaged chunk, by variable; `REPAIR_ADVICE` for others.
    """
    named = {}
    for name, stored in dataset.variables.items():
        if name not in dataset.indexes:
            array = _NamedChunks(stored, folder / str(name), advice.get(str(name), REPAIR_ADVICE))
            on_access: Any = indexing.LazilyIndexedArray(array)  # copied when changed, and kept, as xarray's own
            cached = indexing.MemoryCachedArray(indexing.CopyOnWriteArray(on_access))
            named[name] = xr.Variable(stored.dims, cached, stored.attrs, stored.encoding, fastpath=True)
    return dataset.assign(named)


class _NamedChunks(BackendArray):
    """Variable on disk; an error while it is read names the chunk."""

    def __init__(self, stored: xr.Variable, folder: Path, advice: str) -> None:
        self.stored, self.folder, self.advice = stored, folder, advice
        self.shape, self.dtype = stored.shape, stored.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._values)

    def _values(self, key: tuple[Any, ...]) -> NDArray[np.generic]:
        try:
            return np.asarray(self.stored[key].values)
        except MemoryError:
            raise
        except Exception as fault:  # codecs fail in any way
            raise StoreError(
                f"{self._first_damaged()} is damaged: it cannot be unpacked ({fault}). {self.advice}"
            ) from None

    def _first_damaged(self) -> Path:
        """File of the first chunk that cannot be unpacked; the folder of the array if all can."""
        array = zarr.open_array(self.folder, mode="r")
        for chunk in np.ndindex(*array.cdata_shape):
            try:
                array.blocks[chunk]
            except Exception:
                return self.folder / array.metadata.encode_chunk_key(chunk)
        return self.folder
