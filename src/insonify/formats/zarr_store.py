"""Recording on disk, one chunk for each ping, safe against interruption at any moment.

One zarr chunk holds one ping with all its channels, so that pings can be written in any
order by any number of writers. A mask of the recorded pings is stored with the data; a ping
enters the mask after its data are written, and each file is replaced atomically. All pings
in the mask are therefore complete. Chunks of long recordings are joined to shards
(`insonify.formats.shards`).
"""

import errno
import json
import os
import shutil
import time as clock
import uuid
import warnings
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from numpy.typing import ArrayLike, NDArray
from zarr.codecs import ZstdCodec
from zarr.core.common import JSON
from zarr.errors import ZarrUserWarning
from zarr.storage import LocalStore

from insonify.formats.checked_store import CheckedStore
from insonify.formats.locations import is_url
from insonify.formats.named_chunks import open_named_chunks
from insonify.formats.object_store import ObjectStore
from insonify.formats.other_files import programs_advice
from insonify.formats.shards import STALE, RowArray, pings_per_shard, put_rows, recorded_rows, row_array
from insonify.formats.store_description import (
    IDENTITY,
    REPAIR_ADVICE,
    SOUND,
    errors_as_store_errors,
    read_description,
    require_consistent_sizes,
    require_same_scenario,
)
from insonify.formats.store_description import StoreError as StoreError
from insonify.part import Part
from insonify.records.netcdf_recording import as_recording
from insonify.records.recording import (
    COLUMNS,
    FIELDS,
    OPTIONAL_COLUMNS,
    RECORDED,
    RecordingLayout,
    columns_of,
    coordinates_of,
)

PACKED = (ZstdCodec(level=0),)  # zarr's own
"""Codec of sound and masks."""
_FAILURES = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EMFILE, errno.ENFILE)  # of the machine, not of the name


def create_recording(
    path: str | Path, layout: RecordingLayout, attributes: Mapping[str, Any], *, overwrite: bool = False,
    shard: int | None = None,
) -> str:  # fmt: skip
    """Create an empty recording, or keep that of an earlier run.

    Args:
        path: Folder of the recording, such as "harbour.zarr".
        layout: Layout of the recording.
        attributes: Attributes of the recording, serialisable as JSON. An existing
            recording is continued only where `scenario`, `seed` and `version` are the same.
        overwrite: True to replace an existing recording.
        shard: Pings of one shard; None: `shard_length`.

    Returns:
        The `identity` of the recording, to be given to the functions that write into it.

    Raises:
        StoreError: The folder is another recording, or something else.
    """
    target = Path(path)
    with _placing(target):
        sweep(target)
        if _is_taken(target) and not overwrite:
            return _require_same_scenario(target, attributes)
        target.parent.mkdir(parents=True, exist_ok=True)
        # Built under another name and renamed, so that a recording is either complete or absent.
        aside = _aside(target)
        try:
            _build(aside, layout, attributes, shard or shard_length(layout))
            _move(aside, target, overwrite=overwrite)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    return _require_same_scenario(target, attributes)


@contextmanager
def _placing(target: Path) -> Iterator[None]:
    """Convert errors of the file system while a recording is created into `StoreError`, unless the disk fails."""
    try:
        yield
    except OSError as error:
        if error.errno in _FAILURES:
            raise
        raise StoreError(
            f"{target} cannot be written: {error.strerror or error}. Choose a folder that exists, or can be created, "
            "and is writable"
        ) from None


def identity(path: str | Path) -> str:
    """Unique identity of a recording, different from those of earlier recordings in the same folder."""
    file = os.path.join(path, "zarr.json")
    state = os.stat(file)
    return _identity(file, state.st_ino, state.st_mtime_ns)


@lru_cache(maxsize=4)
def _identity(file: str, number: int, changed: int) -> str:
    """Identity of a recording by file, inode and time of change, cached because every ping needs it."""
    description = json.loads(Path(file).read_text(encoding="utf-8"))
    return str(description["attributes"].get(IDENTITY))


def write_ping(path: str | Path, ping: int, data: ArrayLike, *, into: str | None = None) -> None:
    """Write one ping, then its entry in the mask of recorded pings.

    Args:
        path: Folder of the recording.
        ping: Number of the ping, from 0.
        data: Pressure [uPa] or intensity [uPa^2], shape (channel, time); left out where only recorded lines are kept.
        into: Identity of the intended recording; None: the present one.

    Raises:
        StoreError: Another run has replaced the recording meanwhile.
        ValueError: The data have another shape, or are not finite.
    """
    mine = require_own_recording(path, into)
    name = next(iter(sound_arrays(path)), SOUND[0])  # of a recording that is being removed: a file that is not there
    array, rows = row_array(path, name), list[tuple[RowArray, int, bytes]]()
    if array.name in FIELDS:
        values = _checked("ping", ping, data, array)
        if not np.isfinite(values).all():
            raise ValueError(f"ping {ping} has values that are not finite: a level in the scenario is too high")
        rows.append((array, ping, array.codec.encode(values)))
    put_rows([*rows, ping_entry(path, ping)], partial(require_own_recording, path, mine))


def ping_entry(group: str | Path, ping: int) -> tuple[RowArray, int, bytes]:
    """Array, row and content of the entry of one ping in the mask of a recording, or of its labels.

    Args:
        group: Folder of the recording, or of its labels.
        ping: Number of the ping, from 0.
    """
    done = row_array(group, "done")
    return done, ping, done.codec.encode(np.ones(1, bool))


def write_line(path: str | Path, line: int, data: ArrayLike, *, into: str | None = None) -> None:
    """Write one line of a recorder, before its pings.

    Args:
        path: Folder of the recording.
        line: Number of the line, from 0.
        data: Recorded numbers, shape (channel, bin).
        into: Identity of the intended recording; None: the present one.

    Raises:
        StoreError: Another run has replaced the recording meanwhile.
        ValueError: The data have another shape.
    """
    mine, array = require_own_recording(path, into), row_array(path, "recorded")
    content = array.codec.encode(_checked("line", line, data, array))
    put_rows([(array, line, content)], partial(require_own_recording, path, mine))


def _checked(kind: str, row: int, data: ArrayLike, array: RowArray) -> NDArray[Any]:
    """One row of an array, in the type and order of its chunk."""
    values = np.asarray(data, dtype=array.dtype)
    if values.shape != array.shape[1:]:
        raise ValueError(f"a {kind} of {array.group} has shape {array.shape[1:]}; these data have {values.shape}")
    if not 0 <= row < array.shape[0]:
        raise ValueError(f"{array.group} has {kind}s 0 to {array.shape[0] - 1}; there is no {kind} {row}")
    return values.astype(array.dtype, order="C")


def require_own_recording(path: str | Path, into: str | None) -> str:
    """Identity of the present recording, refused if it is not the intended one.

    Args:
        path: Folder of the recording.
        into: Identity of the intended recording; None: the present one.

    Raises:
        StoreError: Another run has replaced the recording meanwhile.
    """
    mine = identity(path)
    if into is not None and mine != into:
        raise StoreError(f"{path} was replaced by another run while this one went on. Choose another name")
    return mine


def recorded_pings(path: str | Path, *, intact: Collection[int] = ()) -> NDArray[np.bool_]:
    """Mask of the recorded pings, shape (ping,); False where the entry in the mask, or the sound, is lost.

    Args:
        path: Folder of the recording.
        intact: See `insonify.formats.loose_rows.loose_rows`.
    """
    arrays = [row_array(path, name) for name in sound_arrays(path) if name in FIELDS]
    return recorded_rows(Path(path), arrays, intact=intact)


def recorded_lines(path: str | Path, *, intact: Collection[int] = ()) -> NDArray[np.bool_]:
    """Mask of the lines of a recorder that are there, shape (line,).

    Args:
        path: Folder of the recording.
        intact: See `insonify.formats.loose_rows.loose_rows`.
    """
    array = row_array(path, "recorded")
    loose = array.loose_rows(intact=intact)  # before shards: those that are packed meanwhile are in one then
    packed = {shard for shard in range(-(-array.shape[0] // array.per_shard)) if array.shard_file(shard).is_file()}
    return np.array([k // array.per_shard in packed or k in loose for k in range(array.shape[0])], bool)


def pings_of_part(path: str | Path, part: Part) -> range:
    """Pings of one part of a run: whole shards; whole lines of a recorder, or pings, where shards are too few.

    Args:
        path: Folder of the recording.
        part: The part.
    """
    done = row_array(path, "done")
    pings = done.shape[0]
    return part.share(pings, done.per_shard if -(-pings // done.per_shard) >= part.count else pings_together(path))


def pings_together(path: str | Path) -> int:
    """Number of pings that one process should simulate together: those of one line of a recorder [1]."""
    if "recorded" not in sound_arrays(path):
        return 1
    lines = np.asarray(zarr.open_array(Path(path) / "line_ping", mode="r")[:])
    return _pings_per_line(lines, row_array(path, "done").shape[0])


def _pings_per_line(line_ping: NDArray[np.generic], pings: int) -> int:
    """Pings of one line of a recorder, by the first ping of each; all pings where there is one line [1]."""
    if line_ping.size < 2:
        return pings if line_ping.size else 1
    return int(line_ping[1]) - int(line_ping[0])


def sound_arrays(path: str | Path) -> list[str]:
    """Names of the arrays of a recording with the sound of its pings or its lines."""
    return [name for name in SOUND if (Path(path) / name).is_dir()]


def require_recording(path: str | Path) -> None:
    """Refuse a folder that is no recording, or lacks a file.

    Raises:
        StoreError: The folder is not a recording, or is damaged.
    """
    if not _is_recording(Path(path)):
        if Path(path).is_file() and (advice := programs_advice(path)) is not None:
            raise StoreError(advice)
        raise StoreError(f"{path} is not a recording. Make one with: insonify run FILE -o {path}")
    _require_complete(Path(path))
    require_consistent_sizes(read_description(Path(path)), Path(path) / "zarr.json")


def loose_pings(path: str | Path) -> int:
    """Number of recorded pings that are not in a shard yet [1]."""
    return len(row_array(path, "done").loose_rows())


def open_recording(path: str | Path) -> xr.Dataset:
    """Open a recording as a labelled dataset, which is read from disk on access.

    Args:
        path: Folder of the recording, or its URL in an object store.

    Returns:
        `pressure` complex64 [uPa] or `intensity` [uPa^2] over (ping, channel, time), NaN where a ping is not recorded;
        with a recorder `recorded` over (line, channel, bin), or alone; `done`, `position`, `attitude`; coordinates with
        units.

    Raises:
        StoreError: The folder is not a recording, or is damaged.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> recording = insonify.open_recording(insonify.record(scenario, "opened.zarr", pings=[0, 1]))
        >>> recording.pressure.dims
        ('ping', 'channel', 'time')
    """
    dataset = ObjectStore(str(path)).open_group() if is_url(path) else _open_on_disk(Path(path))
    with errors_as_store_errors(path):
        dataset["done"].load()
        if "scenario" not in dataset.attrs or not set(SOUND) & set(dataset.variables):
            raise StoreError(f"{path} is damaged: its scenario or its sound is not described. {REPAIR_ADVICE}")
        for axis in {"ping", "time"} & set(dataset.indexes):
            if not np.all(np.diff(dataset[axis].values) > 0):  # a lost chunk is read as zeros
                raise StoreError(f"{path}/{axis} is damaged: its numbers do not increase. {REPAIR_ADVICE}")
    return as_recording(dataset)


def _open_on_disk(path: Path) -> xr.Dataset:
    """Arrays of a recording on disk."""
    require_recording(path)
    with errors_as_store_errors(path):
        store = CheckedStore(LocalStore(path, read_only=True), path, read_description(path))
        dataset = open_named_chunks(store, path, mask_and_scale=True)
        return dataset.assign(done=dataset["done"].load().copy(data=recorded_pings(path)))


def stored_bytes(path: str | Path) -> int:
    """Size of all files or objects of a recording [bytes].

    Args:
        path: Folder of the recording, or its URL in an object store.
    """
    if is_url(path):
        return sum(ObjectStore(str(path)).sizes().values())
    return sum(file.stat().st_size for file in Path(path).rglob("*") if file.is_file())


def shard_length(layout: RecordingLayout, *, in_store: bool = False) -> int:
    """Pings of one shard of a new recording; 1 where each ping has a file of its own.

    Args:
        layout: Layout of the recording.
        in_store: True: of a recording in an object store.
    """
    pings, ping_samples = layout.ping_time.size, layout.steer.size * layout.time.size
    ping_bytes = ping_samples * np.dtype(FIELDS[layout.field][0]).itemsize
    return pings_per_shard(pings, ping_bytes, _pings_per_line(layout.line_ping, pings), in_store=in_store)


def _build(path: Path, layout: RecordingLayout, attributes: Mapping[str, Any], shard: int) -> None:
    mine = attributes.get(IDENTITY, uuid.uuid4().hex)
    group = zarr.open_group(path, mode="w", zarr_format=3, attributes={**attributes, IDENTITY: mine})
    pings, channels, samples = layout.ping_time.size, layout.steer.size, layout.time.size
    names = ("recorded",) * bool(layout.bin_time.size)
    line = _pings_per_line(layout.line_ping, pings)
    for field in (layout.field, *names) if layout.keeps_field else names:
        dtype, units, long_name = FIELDS.get(field, (np.float32, layout.recorded_units, ""))
        lines, bins = layout.line_ping.size, layout.bin_time.size
        shape = (pings, channels, samples) if field in FIELDS else (lines, channels, bins)
        rows = shard if field in FIELDS else max(shard // line, 1)
        group.create_array(
            field, shape=shape, chunks=(1, *shape[1:]), shards=None if rows == 1 else (rows, *shape[1:]),
            dtype=dtype, fill_value=np.nan, compressors=PACKED,
            dimension_names=("ping", "channel", "time") if field in FIELDS else ("line", "channel", "bin"),
            attributes={"units": units, "long_name": long_name or RECORDED[units],
                        "coordinates": " ".join(coordinates_of(layout))},
        )  # fmt: skip
    columns = {name: (np.asarray(getattr(layout, name), float), *about) for name, about in columns_of(layout).items()}
    complete_group(group, "whether the ping has been simulated", (pings, shard), columns)


def complete_group(
    group: zarr.Group, mask: str, pings: tuple[int, int],
    columns: Mapping[str, tuple[NDArray[Any], tuple[str, ...], str, str]],
) -> None:  # fmt: skip
    """Add what recordings and labels share: a mask of pings, small arrays, and one file with all descriptions.

    Args:
        group: Group of the recording, or of its labels, with its arrays over pings.
        mask: Meaning of the mask `done`.
        pings: Number of pings, and of those of a shard.
        columns: Values, dimensions, unit and meaning of each small array; the numbers of the pings are added.
    """
    group.create_array(
        "done", shape=pings[:1], chunks=pings[1:], dtype=bool, fill_value=False, dimension_names=("ping",),
        compressors=PACKED, attributes={"units": "1", "long_name": mask},
    )  # fmt: skip
    numbers = {"ping": (np.arange(pings[0]), ("ping",), "1", "number of the ping")}
    for name, (values, dims, unit, meaning) in {**columns, **numbers}.items():
        about: dict[str, JSON] = {"units": unit, "long_name": meaning}
        group.create_array(name, data=values, chunks=values.shape, dimension_names=dims, attributes=about)
    with warnings.catch_warnings():
        # One file with all descriptions: readers use it, though the format calls it an extension.
        warnings.simplefilter("ignore", ZarrUserWarning)
        zarr.consolidate_metadata(group.store)


def _is_recording(path: Path) -> bool:
    if not (path / "zarr.json").is_file():
        return False
    attributes = read_description(path).get("attributes")
    return isinstance(attributes, dict) and IDENTITY in attributes


def _require_complete(path: Path) -> None:
    """Refuse a recording with a missing file, and name the first."""
    if not (fields := sound_arrays(path)):
        raise StoreError(f"{path} is damaged: it has neither {' nor '.join(SOUND)}. {REPAIR_ADVICE}")
    for name in (*fields, "done", "ping", *COLUMNS):
        if name not in OPTIONAL_COLUMNS or (path / name).is_dir():
            read_description(path / name)
    # A column of zeros has no chunk; time is one only where there is a single sample.
    if read_description(path / "time").get("shape") != [1] and not (path / "time" / "c").exists():
        raise StoreError(f"{path / 'time' / 'c'} is missing from the recording. {REPAIR_ADVICE}")


def _is_taken(target: Path) -> bool:
    """True where the folder is a recording; any other content is refused and never changed."""
    for _ in range(2):  # another process may create it between two looks
        if _is_recording(target):
            return True
        if not target.exists() or (target.is_dir() and not any(target.iterdir())):
            return False
    raise StoreError(f"{target} exists and is not a recording. Choose another name")


def _require_same_scenario(target: Path, attributes: Mapping[str, Any]) -> str:
    """Refuse a recording of another scenario; return the identity of the recording."""
    _require_complete(target)
    stored = zarr.open_group(target, mode="r").attrs.asdict()
    require_same_scenario(target, stored, attributes, "Choose another name, or replace it with --overwrite")
    return str(stored[IDENTITY])


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
    """Unique temporary name in the folder of the target."""
    return target.parent / f".{target.name}.{uuid.uuid4().hex}.partial"


def delete_recording(path: Path) -> None:
    """Delete a recording; its folder is renamed first, so that no process writes into the rest of it."""
    with suppress(FileNotFoundError):  # deleted by another process
        old = _aside(path)
        os.replace(path, old)
        shutil.rmtree(old, ignore_errors=True)


def sweep(target: Path, age: float = STALE) -> None:
    """Remove temporary folders of interrupted runs in the folder of the target.

    Args:
        target: Folder of a recording, whose name may be a pattern.
        age: Time after which a folder that has not changed is that of an interrupted run [s].
    """
    for stale in target.parent.glob(f".{target.name}.*.partial"):
        with suppress(FileNotFoundError):  # another process has renamed its folder meanwhile
            if clock.time() - stale.stat().st_mtime > age:
                shutil.rmtree(stale, ignore_errors=True)
