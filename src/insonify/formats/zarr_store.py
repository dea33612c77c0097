"""A recording on disk, ping by ping, that survives being killed at any moment.

One zarr chunk holds one ping with all its channels, so that pings can be written in any
order by any number of writers. Beside the data stands a mask of the pings done; a ping
enters the mask after its data has arrived, and zarr puts each chunk in place whole or
not at all. What the mask says is there, is there.
"""

import errno
import json
import os
import shutil
import time as clock
import uuid
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numcodecs.abc import Codec
from numcodecs.zstd import Zstd  # comes with zarr, whose compressor it is
from numpy.typing import ArrayLike, NDArray
from zarr.codecs import ZstdCodec
from zarr.core.common import JSON
from zarr.errors import ZarrUserWarning

from insonify.formats.store_description import (
    REPAIR_ADVICE,
    errors_as_store_errors,
    read_description,
    require_consistent_sizes,
)
from insonify.formats.store_description import StoreError as StoreError
from insonify.records.netcdf_recording import as_recording
from insonify.records.recording import COLUMNS, FIELDS, OPTIONAL_COLUMNS, RecordingLayout, columns_of, coordinates_of

_MUST_AGREE = ("scenario", "seed", "version")
IDENTITY = "insonify_recording"
"""Attribute that identifies a recording."""
_LEVEL = 0  # of compression: zarr's own
_PACKER = Zstd(level=_LEVEL)
PACKED = (ZstdCodec(level=_LEVEL),)
"""Codec of `put_chunk`."""
_FAILURES = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EMFILE, errno.ENFILE)  # the machine's, whatever the name
_STALE = 600.0  # seconds: creating an empty store never takes that long


def create_recording(
    path: str | Path, layout: RecordingLayout, attributes: Mapping[str, Any], *, overwrite: bool = False
) -> str:
    """Make an empty recording, or find the one that an earlier run began.

    Args:
        path: Folder of the recording, such as "harbour.zarr".
        layout: What it will hold.
        attributes: Whatever describes the recording as a whole, ready for JSON. An existing
            recording is continued only where `scenario`, `seed` and `version` are the same.
        overwrite: Whether to replace an existing recording instead.

    Returns:
        Its `identity`: what is written later goes into this recording and no other.

    Raises:
        StoreError: The path is taken by another recording, or by something else.
    """
    target = Path(path)
    with _placing(target):
        _sweep(target)
        if _is_taken(target) and not overwrite:
            return _require_same_scenario(target, attributes)
        target.parent.mkdir(parents=True, exist_ok=True)
        # Built aside and renamed, so that a recording is either whole or not there.
        aside = _aside(target)
        try:
            _build(aside, layout, attributes)
            _move(aside, target, overwrite=overwrite)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    return _require_same_scenario(target, attributes)


@contextmanager
def _placing(target: Path) -> Iterator[None]:
    """While a recording is begun: a place where none can be is said to be the fault of its name."""
    try:
        yield
    except OSError as error:
        if error.errno in _FAILURES:
            raise
        raise StoreError(
            f"{target} cannot be written: {error.strerror or error}. Choose a folder that is there, or can be made, "
            "and may be written to"
        ) from None


def identity(path: str | Path) -> str:
    """Identity of this recording among all that ever stood at the same path."""
    file = os.path.join(path, "zarr.json")
    state = os.stat(file)
    return _identity(file, state.st_ino, state.st_mtime_ns)


@lru_cache(maxsize=4)
def _identity(file: str, number: int, changed: int) -> str:
    """The identity of a file as it was at one time: reading it takes long, and every ping needs it."""
    described = json.loads(Path(file).read_text(encoding="utf-8"))
    return str(described["attributes"].get(IDENTITY))


def write_ping(path: str | Path, ping: int, data: ArrayLike, *, into: str | None = None) -> None:
    """Write one ping, then mark it in the mask of pings done.

    Args:
        path: Folder of the recording.
        ping: Number of the ping, from 0.
        data: Pressure [uPa] or intensity [uPa^2], shape (channel, time).
        into: Identity of the recording that is meant; by default whichever stands there.

    Raises:
        StoreError: Another run has replaced the recording meanwhile.
        ValueError: The data do not fit, or are not finite.
    """
    mine = require_own_recording(path, into)
    field, shape, dtype = _sound(str(path), mine)
    values = np.asarray(data, dtype=dtype)
    if values.shape != shape[1:]:
        raise ValueError(f"a ping of {path} has shape {shape[1:]}; these data have {values.shape}")
    if not 0 <= ping < shape[0]:
        raise ValueError(f"{path} has pings 0 to {shape[0] - 1}; there is no ping {ping}")
    if not np.isfinite(values).all():
        raise ValueError(f"ping {ping} has values that are not finite: a level in the scenario is beyond all bounds")
    put_chunk(Path(path) / field / "c" / str(ping) / "0" / "0", values.astype(dtype.newbyteorder("<"), order="C"))
    put_chunk(Path(path) / "done" / "c" / str(ping), np.ones(1, bool))


def require_own_recording(path: str | Path, into: str | None) -> str:
    """Identity of the recording at a path, which must be the one that is meant.

    Args:
        path: Folder of the recording.
        into: Identity of the recording that is meant; None: whichever stands there.

    Raises:
        StoreError: Another run has replaced the recording meanwhile.
    """
    mine = identity(path)
    if into is not None and mine != into:
        raise StoreError(f"{path} was replaced by another run while this one went on. Choose another name")
    return mine


@lru_cache(maxsize=4)
def _sound(path: str, mine: str) -> tuple[str, tuple[int, ...], np.dtype[Any]]:
    """Name, shape and kind of the sound in the recording of one identity: to open it takes as long as a ping."""
    field = next(name for name in FIELDS if (Path(path) / name).is_dir())
    there = zarr.open_array(Path(path) / field, mode="r")
    return field, there.shape, np.dtype(there.dtype)


def put_chunk(place: Path, values: NDArray[Any], packer: Codec = _PACKER) -> None:
    """Write one chunk as zarr does, ten times as fast: whole, under another name, which then becomes its own.

    Args:
        place: File of the chunk.
        values: Its values, in the order and the byte order of the array.
        packer: Compressor of the array.
    """
    aside = place.with_name(f".{place.name}.{uuid.uuid4().hex}.partial")
    packed = packer.encode(values)
    try:
        aside.write_bytes(packed)
    except FileNotFoundError:
        place.parent.mkdir(parents=True, exist_ok=True)
        aside.write_bytes(packed)
    os.replace(aside, place)


def recorded_pings(path: str | Path) -> NDArray[np.bool_]:
    """Mask of the pings of a recording that are done, shape (ping,)."""
    there = np.zeros(zarr.open_array(Path(path) / "done", mode="r").shape, bool)
    chunks = Path(path) / "done" / "c"
    # A ping that is not done has no chunk: the names of chunks hold as much as their contents, and are read at once.
    for chunk in os.scandir(chunks) if chunks.is_dir() else ():
        if chunk.name.isdigit() and chunk.stat().st_size > 0:
            there[int(chunk.name)] = True
    return there


def open_recording(path: str | Path) -> xr.Dataset:
    """A recording as a labelled dataset, read from disk as it is needed.

    Args:
        path: Folder of the recording.

    Returns:
        `pressure` complex64 [uPa] or `intensity` [uPa^2] over (ping, channel, time), NaN
        where a ping is not done; `recorded_pings`, `position`, `attitude`; coordinates with units.

    Raises:
        StoreError: There is no recording at that path.
    """
    if not _is_recording(Path(path)):
        raise StoreError(f"{path} is not a recording. Make one with: insonify run FILE -o {path}")
    _require_complete(Path(path))
    require_consistent_sizes(Path(path))
    with errors_as_store_errors(Path(path)):
        held: xr.Dataset = xr.open_zarr(path, chunks=None, consolidated=True, decode_times=False)
        held["done"].load()
        if "scenario" not in held.attrs or not set(FIELDS) & set(held.variables):
            raise StoreError(f"{path} is damaged: its scenario or its sound is not described. {REPAIR_ADVICE}")
    return as_recording(held)


@contextmanager
def chunk_errors_as_store_errors(path: str | Path) -> Iterator[None]:
    """While sound is read from a recording: a chunk that cannot be unpacked is said to be the recording's fault.

    Args:
        path: Folder of the recording.

    Raises:
        StoreError: A chunk is damaged.
    """
    try:
        yield
    except RuntimeError as error:
        if "compression" not in str(error):
            raise
        raise StoreError(f"{path} is damaged: a chunk of it cannot be unpacked ({error}). {REPAIR_ADVICE}") from None


def _build(path: Path, layout: RecordingLayout, attributes: Mapping[str, Any]) -> None:
    group = zarr.open_group(path, mode="w", zarr_format=3)
    group.attrs.update({**attributes, IDENTITY: uuid.uuid4().hex})
    pings, channels, samples = layout.ping_time.size, layout.steer.size, layout.time.size
    dtype, units, long_name = FIELDS[layout.field]
    group.create_array(
        layout.field, shape=(pings, channels, samples), chunks=(1, channels, samples), dtype=dtype, fill_value=np.nan,
        compressors=PACKED,
        dimension_names=("ping", "channel", "time"),
        attributes={"units": units, "long_name": long_name, "coordinates": " ".join(coordinates_of(layout))},
    )  # fmt: skip
    group.create_array(
        "done", shape=(pings,), chunks=(1,), dtype=bool, fill_value=False, dimension_names=("ping",),
        compressors=PACKED, attributes={"units": "1", "long_name": "whether the ping has been simulated"},
    )  # fmt: skip
    for name, (dims, unit, meaning) in columns_of(layout).items():
        values = np.asarray(getattr(layout, name), dtype=float)
        about: dict[str, JSON] = {"units": unit, "long_name": meaning}
        group.create_array(name, data=values, chunks=values.shape, dimension_names=dims, attributes=about)
    group.create_array(
        "ping", data=np.arange(pings), chunks=(pings,), dimension_names=("ping",),
        attributes={"units": "1", "long_name": "number of the ping"},
    )  # fmt: skip
    with warnings.catch_warnings():
        # One file that names all the arrays: readers look for it, though the format calls it an extension.
        warnings.simplefilter("ignore", ZarrUserWarning)
        zarr.consolidate_metadata(group.store)


def _is_recording(path: Path) -> bool:
    if not (path / "zarr.json").is_file():
        return False
    attributes = read_description(path).get("attributes")
    return isinstance(attributes, dict) and IDENTITY in attributes


def _require_complete(path: Path) -> None:
    """Names the first file without which a recording cannot be read."""
    fields = [name for name in FIELDS if (path / name).is_dir()]
    if not fields:
        raise StoreError(f"{path} is damaged: it has neither {' nor '.join(FIELDS)}. {REPAIR_ADVICE}")
    for name in (*fields, "done", "ping", *COLUMNS):
        if name not in OPTIONAL_COLUMNS or (path / name).is_dir():
            read_description(path / name)
    # A column of zeros has no chunk; time is one only where there is a single sample.
    if read_description(path / "time").get("shape") != [1] and not (path / "time" / "c").exists():
        raise StoreError(f"{path / 'time' / 'c'} is missing from the recording. {REPAIR_ADVICE}")


def _is_taken(target: Path) -> bool:
    """Check that a recording stands there; anything else that does is never touched."""
    if _is_recording(target):
        return True
    if target.is_dir() and not any(target.iterdir()):
        return False
    if target.exists():
        raise StoreError(f"{target} exists and is not a recording. Choose another name")
    return False


def _require_same_scenario(target: Path, attributes: Mapping[str, Any]) -> str:
    """Refuse a recording of another scenario; returns the identity of this one."""
    _require_complete(target)
    stored = zarr.open_group(target, mode="r").attrs.asdict()
    differ = [name for name in _MUST_AGREE if stored.get(name) != attributes.get(name)]
    if differ:
        raise StoreError(
            f"{target} holds a recording of another {' and '.join(differ)}{_first_difference(stored, attributes)}. "
            "Choose another name, or replace it with --overwrite"
        )
    return str(stored[IDENTITY])


def _first_difference(stored: Mapping[str, Any], attributes: Mapping[str, Any]) -> str:
    """First difference between the texts of two scenarios, in brackets; empty where they are no texts or the same."""
    texts = [one.get("scenario") for one in (stored, attributes)]
    if not all(isinstance(text, str) for text in texts):
        return ""
    for there, here in zip_longest(*(str(text).splitlines() for text in texts), fillvalue=""):
        if there != here:
            then, now = (" ".join(line.split()[:6]) or "nothing" for line in (there, here))
            return f" (the first line that differs: there {then!r}, now {now!r})"
    return ""


def _move(aside: Path, target: Path, *, overwrite: bool) -> None:
    if overwrite and _is_recording(target):
        old = _aside(target)
        os.replace(target, old)
        os.replace(aside, target)
        shutil.rmtree(old, ignore_errors=True)
        return
    try:
        os.replace(aside, target)
    except OSError:  # another process was first: the caller compares the two
        if not _is_recording(target):
            raise


def _aside(target: Path) -> Path:
    """A new name beside the target, which no other process uses."""
    return target.parent / f".{target.name}.{uuid.uuid4().hex}.partial"


def _sweep(target: Path) -> None:
    """Remove what runs that were killed while creating have left beside the target."""
    for stale in target.parent.glob(f".{target.name}.*.partial"):
        if clock.time() - stale.stat().st_mtime > _STALE:
            shutil.rmtree(stale, ignore_errors=True)
