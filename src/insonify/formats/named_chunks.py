"""Variables of a recording, read on access: from shards and loose pings; an error names the damaged file."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from insonify.formats.checked_store import CheckedStore
from insonify.formats.loose_rows import LooseRow
from insonify.formats.shards import LOOSE, RowArray, row_array
from insonify.formats.store_description import StoreError


def open_named_chunks(store: CheckedStore, folder: Path | None, *, mask_and_scale: bool) -> xr.Dataset:
    """Open a zarr group that is read on access; access to a damaged chunk raises `StoreError` with its name.

    Args:
        store: Store with the group.
        folder: Folder with its loose pings, whose entries `done` lacks; None: none, in an object store.
        mask_and_scale: False: numbers stay as they are stored, fill values too.
    """
    try:
        dataset: xr.Dataset = xr.open_zarr(
            store, chunks=None, consolidated=True, decode_times=False, mask_and_scale=mask_and_scale
        )
    except Exception as fault:  # codecs fail in any way
        for axis, values in zarr.open_group(store, mode="r", use_consolidated=True).arrays():
            if getattr(values.metadata, "dimension_names", ()) == (axis,) and (key := _first_damaged(values)):
                raise store.damaged(f"{axis}/{key}", f"it cannot be unpacked ({fault})") from None
        raise
    named = {}
    for name, stored in dataset.variables.items():
        if name not in dataset.indexes:
            array = _NamedChunks(stored, store, folder, str(name))
            on_access: Any = indexing.LazilyIndexedArray(array)  # copied when changed, and kept, as xarray's own
            cached = indexing.MemoryCachedArray(indexing.CopyOnWriteArray(on_access))
            named[name] = xr.Variable(stored.dims, cached, stored.attrs, stored.encoding, fastpath=True)
    return dataset.assign(named)


def _store_error(error: BaseException) -> StoreError | None:
    """First error about the store among those of tasks that ended together; None: there is none."""
    if isinstance(error, BaseExceptionGroup):
        return next(filter(None, map(_store_error, error.exceptions)), None)
    return error if isinstance(error, StoreError) else None


class _NamedChunks(BackendArray):
    """Variable on disk or in an object store; an error while it is read names the chunk."""

    def __init__(self, stored: xr.Variable, store: CheckedStore, folder: Path | None, name: str) -> None:
        self.stored, self.store, self.folder, self.name = stored, store, folder, name
        self.shape, self.dtype = stored.shape, stored.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._values)

    def _values(self, key: tuple[Any, ...]) -> NDArray[np.generic]:
        try:
            loose = self._loose_values(key)
            values = np.array(self.stored[key].values)
            for index, row in loose.items():
                values[index] = row
            return values
        except (MemoryError, StoreError):
            raise
        except Exception as fault:  # codecs fail in any way
            if named := _store_error(fault):
                raise named from None
            raise self.store.damaged(self._first_damaged(key), f"it cannot be unpacked ({fault})") from None

    def _loose_values(self, key: tuple[Any, ...]) -> dict[Any, NDArray[np.generic]]:
        """Values of the loose rows among those of a key, by their index in the result.

        They are read before the shards: a row that is packed meanwhile is in one of them.
        """
        loose_values: dict[Any, NDArray[np.generic]] = {}
        if self.folder is None or self.name == "done" or not (self.folder / LOOSE / self.name).is_dir():
            return loose_values
        array, rows = row_array(self.folder, self.name), np.arange(self.shape[0])[key[0]]
        loose = array.loose_rows(np.unique(rows // array.per_shard).tolist())
        for index, row in enumerate(np.atleast_1d(rows).tolist()):
            if row in loose:
                with suppress(FileNotFoundError):  # packed meanwhile
                    if content := self._loose_content(array, row, loose[row]):
                        one = xr.Variable(self.stored.dims, array.decoded(content))[(0, *key[1:])]
                        loose_values[index if rows.ndim else ()] = one.values
        return loose_values

    def _loose_content(self, array: RowArray, row: int, loose: LooseRow) -> bytes:
        """Bytes of a loose row; where they are damaged, those of another file to which it was written again."""
        try:
            return loose.content()
        except ValueError as fault:
            shard = (row // array.per_shard,)
            if other := array.loose_rows(shard, intact=shard).get(row):
                return other.content()
            raise self.store.damaged(loose.file.relative_to(array.group).as_posix(), fault) from None

    def _first_damaged(self, key: tuple[Any, ...]) -> str:
        """Name of the first chunk or shard with a row of a key that cannot be unpacked; the array if all can."""
        array = zarr.open_group(self.store, mode="r", use_consolidated=True)[self.name]
        assert isinstance(array, zarr.Array)
        rows = np.atleast_1d(np.arange(self.shape[0])[key[0]]) if key else np.zeros(1, int)
        return f"{self.name}/{_first_damaged(array, rows) or ''}".rstrip("/")


def _first_damaged(array: "zarr.Array[Any]", rows: NDArray[np.int64] | None = None) -> str | None:
    """Name of the first chunk or shard with one of some rows that cannot be unpacked; None: all can.

    Args:
        array: The array.
        rows: The rows; None: all.
    """
    length = (array.shards or array.chunks)[0]
    for number in np.unique((np.arange(array.shape[0]) if rows is None else rows) // length).tolist():
        try:
            array[number * length : (number + 1) * length]
        except Exception:
            return str(array.metadata.encode_chunk_key((number, *[0] * (array.ndim - 1))))
    return None
