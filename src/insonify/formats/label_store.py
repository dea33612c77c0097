"""Labels on disk: a folder inside the recording, one chunk for each ping, with a mask of the labelled pings.

Variables over (ping, channel, time) of one type are rows of one array, because every file of a ping costs time.
`open_labels` takes them apart again.
"""

import errno
import os
import shutil
import uuid
from collections.abc import Collection, Iterable, Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
import zarr
from numpy.typing import NDArray
from zarr.codecs import BloscCodec
from zarr.core.common import JSON
from zarr.storage import LocalStore

from insonify.formats.checked_store import CheckedStore
from insonify.formats.locations import is_url
from insonify.formats.named_chunks import open_named_chunks
from insonify.formats.object_store import ObjectStore
from insonify.formats.shards import RowArray, pack_shards, put_rows, recorded_rows, row_array
from insonify.formats.store_description import (
    IDENTITY,
    StoreError,
    errors_as_store_errors,
    read_description,
    require_consistent_sizes,
)
from insonify.formats.zarr_store import complete_group, identity, ping_entry, require_own_recording, sweep
from insonify.ocean.profile import FASTEST
from insonify.records.labels import COLUMNS, LabelNames, Labels, with_names
from insonify.records.recording import RecordingLayout

FOLDER = "labels"
"""Name of the folder of the labels."""
MANTISSA_BITS = 12
"""Stored bits of the mantissa of intensities and angles: 0.001 dB, in half the space after compression [1]."""
FINEST = 2.0**-10
"""Step of stored positions and distances: a binary fraction, whose last bytes are zero [m]."""
SINGLE_PRECISION_REACH = 0.99 * 2**24 * FINEST
"""Largest coordinate that single precision holds to that step, less a margin for the bodies of targets [m]."""
LABEL_CODECS = (BloscCodec(cname="lz4", clevel=5, shuffle="shuffle"),)
"""Codec of the labels, ten times as fast as that of the sound."""
_TYPES = (np.float32, np.uint8, np.bool_)
POSITION = "position"
"""The variable with an array of its own."""
ARRAYS = (POSITION, *(np.dtype(dtype).name for dtype in _TYPES))
"""Names of the arrays over pings."""


class TypeArray(NamedTuple):
    """Array of all variables of one type over (ping, channel, time)."""

    dtype: type
    rows: dict[str, int | slice]
    """Row of each variable, or rows of one with a further axis."""
    row_count: int

    @property
    def name(self) -> str:
        """Name of the type."""
        return np.dtype(self.dtype).name

    @property
    def row(self) -> str:
        """Name of the dimension of the rows."""
        return f"{self.name}_row"


@lru_cache(maxsize=4)
def _type_arrays(objects: int, pairs: int) -> list[TypeArray]:
    """Arrays of all variables but the positions, of labels with so many objects and pairs."""
    arrays, sizes = list[TypeArray](), {"object": objects, "pair": pairs, "time": 1}
    for dtype in _TYPES:
        rows, count = dict[str, int | slice](), 0
        for column, (dims, kind, _, _) in COLUMNS.items():
            if kind is dtype:
                size = sizes[dims[2]]
                rows[column] = slice(count, count + size) if len(dims) > 3 else count
                count += size
        arrays.append(TypeArray(dtype, rows, count))
    return arrays


def create_labels(
    path: str | Path, names: LabelNames, layout: RecordingLayout, attributes: Mapping[str, Any], *,
    into: str | None = None
) -> None:  # fmt: skip
    """Create empty labels in a recording, or keep those of an earlier run.

    Labels of another recording, which this recording has replaced, are deleted.

    Args:
        path: Folder of the existing recording.
        names: Objects and pairs.
        layout: Layout of the recording.
        attributes: Attributes of the recording.
        into: Identity of the intended recording; None: the present one.

    Raises:
        StoreError: Another run has replaced the recording meanwhile.
    """
    target, mine = Path(path) / FOLDER, require_own_recording(path, into)
    sweep(target)
    if _labelled_identity(target) == mine:
        return
    aside = target.parent / f".{FOLDER}.{uuid.uuid4().hex}.partial"
    try:
        _build(aside, names, layout, {**attributes, IDENTITY: mine}, row_array(path, "done").per_shard)
        require_own_recording(path, mine)  # labels of one that has taken its place meanwhile are not deleted
        if _labelled_identity(target) not in (mine, None):  # of a recording that this one has replaced
            shutil.rmtree(target, ignore_errors=True)
        os.replace(aside, target)
    except OSError:  # another process was first
        if _labelled_identity(target) != mine:
            raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _labelled_identity(folder: Path) -> str | None:
    """Identity of the recording to which labels belong; None without labels."""
    return identity(folder) if (folder / "zarr.json").is_file() else None


def _build(
    path: Path, names: LabelNames, layout: RecordingLayout, attributes: Mapping[str, Any], shard: int
) -> None:  # fmt: skip
    described = {**attributes, "owners": list(names.objects), "pairs": list(names.pairs)}
    group = zarr.open_group(path, mode="w", zarr_format=3, attributes=described)
    pings, channels, samples = layout.ping_time.size, layout.steer.size, layout.time.size
    dims, _, units, meaning = COLUMNS[POSITION]
    ends = [np.abs(end).max(initial=0.0) for end in (layout.position, layout.receiver_position)]
    reach = max(ends) + FASTEST * np.abs(layout.time).max(initial=0.0)  # of an echo, one way at least
    dtype: type = np.float32 if reach < SINGLE_PRECISION_REACH else np.float64
    arrays = [(POSITION, (pings, channels, samples, 3), dims, dtype, {"units": units, "long_name": meaning})]
    for array in _type_arrays(len(names.objects), len(names.pairs)):
        shape, axes = (pings, channels, array.row_count, samples), ("ping", "channel", array.row, "time")
        arrays.append((array.name, shape, axes, array.dtype, {"long_name": ", ".join(array.rows)}))
    for name, shape, dims, dtype, about in arrays:
        group.create_array(
            name, shape=shape, chunks=(1, *shape[1:]), shards=None if shard == 1 else (shard, *shape[1:]),
            dtype=dtype, fill_value=_fill(dtype), dimension_names=dims,
            chunk_key_encoding={"name": "default", "separator": "."},  # a file for each ping, without subfolders
            compressors=LABEL_CODECS, attributes=dict[str, JSON](about),
        )  # fmt: skip
    time = layout.time, ("time",), "s", "time after the start of transmission"
    complete_group(group, "whether the ping has been labelled", (pings, shard), {"time": time})


def write_label_ping(path: str | Path, ping: int, labels: Labels, *, into: str | None = None) -> None:
    """Write the labels of one ping, then its entry in the mask of labelled pings.

    Args:
        path: Folder of the recording.
        ping: Number of the ping.
        labels: Labels of the ping.
        into: Identity of the intended recording; None: the present one.

    Raises:
        StoreError: Another run has replaced the recording meanwhile.
    """
    mine, folder = require_own_recording(path, into), Path(path) / FOLDER
    confirm = partial(_require_own_labels, path, mine)
    confirm()
    stored = {POSITION: np.empty(labels.position.shape, row_array(folder, POSITION).dtype)}
    _store(labels.position, "m", stored[POSITION])
    channels, objects, samples = labels.object_intensity.shape
    for array in _type_arrays(objects, labels.pair_intensity.shape[1]):
        packed = stored[array.name] = np.empty((channels, array.row_count, samples), array.dtype)
        for column, rows in array.rows.items():
            _store(getattr(labels, column), COLUMNS[column][2], packed[:, rows])
    encoded = list[tuple[RowArray, int, bytes]]()
    for name, values in stored.items():
        target, is_written = row_array(folder, name), values.dtype != bool or values.any()
        encoded.append((target, ping, target.codec.encode(values) if is_written else b""))  # what is not there is False
    put_rows([*encoded, ping_entry(folder, ping)], confirm)


def _require_own_labels(path: str | Path, mine: str) -> None:
    """Raise an error where a recording, or its labels, are not of one identity."""
    require_own_recording(path, mine)
    if (known := _labelled_identity(Path(path) / FOLDER)) != mine:
        require_own_recording(path, mine)  # it may have been replaced since
        if known is None:  # removed, and the rest of the recording is about to be
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(Path(path) / FOLDER / "zarr.json"))
        raise StoreError(
            f"{Path(path) / FOLDER} are labels of another recording. Label this one: insonify run FILE -o {path} "
            "--labels"
        )


def pack_labels(path: str | Path, into: str, shards: Iterable[int] | None = None) -> None:
    """Pack the shards of a recording's labels of which all pings are there; None: all such shards."""
    names = _array_names(Path(path) / FOLDER)
    pack_shards(Path(path) / FOLDER, names, shards, partial(_require_own_labels, path, into))


def _array_names(folder: Path) -> list[str]:
    """Names of the arrays of labels."""
    return [name for name in ARRAYS if (folder / name).is_dir()]


def _fill(dtype: type) -> Any:
    """Value of a column where nothing is written: no object, False, or no number."""
    return np.nan if np.issubdtype(dtype, np.floating) else dtype(0) if dtype is np.bool_ else 255


def labelled_pings(path: str | Path, *, intact: Collection[int] = ()) -> NDArray[np.bool_]:
    """Mask of the labelled pings of a recording, shape (ping,).

    Args:
        path: Folder of the recording.
        intact: See `insonify.formats.loose_rows.loose_rows`.
    """
    folder = Path(path) / FOLDER
    arrays = [row_array(folder, name) for name in _array_names(folder)]
    needed = [array for array in arrays if array.per_shard > 1 or array.name == POSITION]  # else False has no file
    return recorded_rows(folder, needed, intact=intact)


def open_labels(path: str | Path) -> xr.Dataset:
    """Open the labels of a recording, which are read from disk on access.

    Args:
        path: Folder of the recording, or its URL in an object store.

    Returns:
        The variables of `insonify.records.labels.COLUMNS`; `labelled_pings` is the mask of labelled pings.

    Raises:
        StoreError: The recording has no labels.
    """
    dataset = ObjectStore(str(path)).open_group(FOLDER) if is_url(path) else _open_on_disk(Path(path))
    with errors_as_store_errors(path):
        dataset["done"].load()
        names = LabelNames(tuple(dataset.attrs["owners"]), tuple(dataset.attrs["pairs"]))
        return with_names(_taken_apart(dataset, names), names)


def _open_on_disk(path: Path) -> xr.Dataset:
    """Arrays of the labels of a recording on disk."""
    folder = path / FOLDER
    if not (folder / "zarr.json").is_file():
        raise StoreError(f"{path} has no labels. Make them: insonify run FILE -o {path} --labels")
    description = read_description(folder)
    require_consistent_sizes(description, folder / "zarr.json")
    with errors_as_store_errors(folder):
        if _labelled_identity(folder) != identity(path):
            raise StoreError(
                f"{folder} are labels of another recording. Make its own: insonify run FILE -o {path} --labels"
            )
        store = CheckedStore(LocalStore(folder, read_only=True), path, description, FOLDER)
        dataset = open_named_chunks(store, folder, mask_and_scale=False)
        return dataset.assign(done=dataset["done"].load().copy(data=labelled_pings(path)))


def _taken_apart(dataset: xr.Dataset, names: LabelNames) -> xr.Dataset:
    """The variables of `COLUMNS`, read on access, from the arrays of their types."""
    variables = {POSITION: dataset[POSITION]}
    for array in _type_arrays(len(names.objects), len(names.pairs)):
        for column, rows in array.rows.items():
            dims, _, units, meaning = COLUMNS[column]
            part = dataset[array.name].isel({array.row: rows}).assign_attrs(units=units, long_name=meaning)
            variables[column] = part.rename({array.row: dims[2]}) if len(dims) > 3 else part
    return dataset[["done"]].assign({column: variables[column] for column in COLUMNS})


def _store(values: NDArray[Any], units: str, stored: NDArray[Any]) -> None:
    """Fill an array with the values of one column, without insignificant digits."""
    if units == "m":
        np.rint(values * (1 / FINEST), out=stored, casting="same_kind")  # rounded once, in double precision
        stored *= FINEST
        return
    stored[...] = values
    if units in ("uPa^2", "rad"):  # numbers of one sign are rounded to the first bits of their mantissa
        dropped, bits = 23 - MANTISSA_BITS, stored.view(np.uint32)
        bits += np.uint32(1 << (dropped - 1))
        bits &= np.uint32(0xFFFFFFFF << dropped & 0xFFFFFFFF)
