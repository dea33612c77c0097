"""Variables of a recording, read on access: from shards and loose pings; an error names the damaged file."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from insonify.formats.chunk_sizes import require_declared_sizes
from insonify.formats.shards import LOOSE, row_array
from insonify.formats.store_description import REPAIR_ADVICE, StoreError


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
            loose = self._loose_values(key)
            for rows in self._rows(key):
                require_declared_sizes(self._array, self.folder, rows)
            values = np.array(self.stored[key].values)
            for index, row in loose.items():
                values[index] = row
            return values
        except MemoryError:
            raise
        except Exception as fault:  # codecs fail in any way
            raise StoreError(
                f"{self._first_damaged()} is damaged: it cannot be unpacked ({fault}). {self.advice}"
            ) from None

    @cached_property
    def _array(self) -> "zarr.Array[Any]":
        """The array by the description of its group, from which the dataset was opened."""
        array = zarr.open_group(self.folder.parent, mode="r", use_consolidated=True)[self.folder.name]
        assert isinstance(array, zarr.Array)
        return array

    def _rows(self, key: tuple[Any, ...]) -> list[range]:
        """Rows of a key, as one range of them or as each row by itself; one empty range without an axis."""
        if not key or isinstance(key[0], slice):
            return [range(self.shape[0])[key[0]] if key else range(0)]
        rows = np.unique(np.asarray(key[0]) % max(self.shape[0], 1)).tolist()
        return [range(row, row + 1) for row in rows]

    def _loose_values(self, key: tuple[Any, ...]) -> dict[Any, NDArray[np.generic]]:
        """Values of the loose rows among those of a key, by their index in the result.

        They are read before the shards: a row that is packed meanwhile is in one of them.
        """
        loose_values: dict[Any, NDArray[np.generic]] = {}
        if not (self.folder.parent / LOOSE / self.folder.name).is_dir():
            return loose_values
        array, rows = row_array(self.folder.parent, self.folder.name), np.arange(self.shape[0])[key[0]]
        loose_rows = set(array.loose_rows())
        for index, row in enumerate(np.atleast_1d(rows).tolist()):
            values = array.read_loose(row) if row in loose_rows else None
            if values is not None:
                one = xr.Variable(self.stored.dims, values)[(0, *key[1:])]
                loose_values[index if rows.ndim else ()] = one.values
        return loose_values

    def _first_damaged(self) -> Path:
        """File of the first chunk or shard that cannot be unpacked; the folder of the array if all can."""
        array = self._array
        rows = (array.shards or array.chunks)[0]
        for number in range(-(-array.shape[0] // rows)):
            part = range(number * rows, min((number + 1) * rows, array.shape[0]))
            try:
                require_declared_sizes(array, self.folder, part)
                array[part.start : part.stop]
            except Exception:
                return self.folder / array.metadata.encode_chunk_key((number, *[0] * (array.ndim - 1)))
        return self.folder
