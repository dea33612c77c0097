"""Writing of pings and labels into a recording in an object store, by way of a recording on disk.

The pings of an incomplete shard are loose in a local recording, the spool, which all processes on the machine share.
Each shard that is packed there is put into the store as one object and deleted from the spool.
"""

import time as clock
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.formats import label_store, zarr_store
from insonify.formats.locations import is_url
from insonify.formats.loose_rows import loose_files
from insonify.formats.object_store import SPOOL, ObjectStore, StoredGroup, spooled_recording, stored_group
from insonify.formats.recording_writer import RecordingWriter, writing
from insonify.formats.shards import STALE, numbered, recorded_rows, row_array
from insonify.formats.store_description import IDENTITY, SOUND, StoreError, WriteError, read_description
from insonify.part import Part
from insonify.processing.recorded_lines import RecordedLines
from insonify.records.labels import LabelNames
from insonify.records.recording import FIELDS, RecordingLayout

COMPLETE = ".complete"
"""File in a spool whose recording is complete in the store."""


def writer_class(path: str | Path) -> type[RecordingWriter]:
    """Class of the writers into a recording.

    Args:
        path: Folder of the recording, or its URL.
    """
    return StoreWriter if is_url(path) else RecordingWriter


def groups_of(description: Mapping[str, Any], labels: Mapping[str, Any] | None) -> list[StoredGroup]:
    """Groups of a recording, its labels first, if it has any.

    Args:
        description: Description of the recording.
        labels: Description of its labels; None without.
    """
    sound = stored_group(description, "", SOUND, tuple(FIELDS))
    if labels is None:
        return [sound]
    return [stored_group(labels, label_store.FOLDER, label_store.ARRAYS, (label_store.POSITION,)), sound]


def _tidy(spool: Path) -> None:
    """Delete the spools of other recordings that are complete, and what killed processes have left of them.

    They are kept for a while, since a process that simulates the same part may be about to open them.
    """
    zarr_store.sweep(spool.parent / "*")
    (spool / COMPLETE).unlink(missing_ok=True)
    for mark in spool.parent.glob(f"*/{COMPLETE}"):
        with suppress(FileNotFoundError):
            if clock.time() - mark.stat().st_mtime > STALE:
                zarr_store.delete_recording(mark.parent)


class StoreWriter(RecordingWriter):
    """Writer of one process into a recording in an object store; parts are whole shards."""

    def __init__(
        self, path: str | Path, layout: RecordingLayout, attributes: Mapping[str, Any], *,
        lines: RecordedLines | None = None, label_names: LabelNames | None = None, overwrite: bool = False,
    ) -> None:  # fmt: skip
        """Create the recording, or open that of an earlier run or of another process.

        Args:
            path: URL of the recording.
            layout: Layout of the recording.
            attributes: Attributes of the recording.
            lines: Lines of the recorder; None: none.
            label_names: Axes of the labels; None: none are written.
            overwrite: True: refused, since objects cannot be replaced all at once.
        """
        self._store = ObjectStore(str(path))
        if overwrite:
            raise StoreError(f"{path}: a store cannot replace a recording while others may write into it. Delete it "
                             "first, or choose another name")  # fmt: skip
        mine = self._store.claim(attributes)
        spool = spooled_recording(self._store.url, mine)
        try:
            spool.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(f"{spool.parent}, in which pings wait for the others of their shard, cannot be made: "
                             f"{error.strerror}. Set {SPOOL} to a folder that can") from None  # fmt: skip
        _tidy(spool)
        description = self._store.description()  # its shards may be those of a recording that was copied here
        super().__init__(
            spool, layout, {**attributes, IDENTITY: mine}, lines=lines, label_names=label_names,
            shard=zarr_store.shard_length(layout, in_store=True) if description is None
            else groups_of(description, None)[0].done.per_shard,
        )  # fmt: skip
        self.location = str(path)
        self._groups = self._groups_on_disk()
        self._shards = set[int]()
        with writing(self.path, mine):
            for group in reversed(self._groups):  # labels belong to a recording that is there
                self._store.create(group, self.path)
        self._store.require_own(mine)
        self._store.is_created = True
        self.pack()

    def _groups_on_disk(self) -> list[StoredGroup]:
        """Groups of the spool, whose labels may be those of another process."""
        labels = self.path / label_store.FOLDER
        return groups_of(read_description(self.path), read_description(labels) if labels.is_dir() else None)

    def of_part(self, part: Part | None, pings: list[int]) -> list[int]:
        """As that of a recording on disk; a part is whole shards."""
        mine = super().of_part(part, pings)
        self._shards = {ping // self._per_shard for ping in mine}
        return mine

    def _pings_of_part(self, part: Part) -> range:
        return part.share(row_array(self.path, "done").shape[0], self._per_shard)

    def _units(self) -> str:
        shards = -(-row_array(self.path, "done").shape[0] // self._per_shard)
        return (
            f"{self.location} has {shards} shards of {self._per_shard} pings, and a part in an object store is whole "
            "shards"
        )

    @property
    def accepts_any_order(self) -> bool:
        """False: a connection to a store cannot be copied to another process."""
        return False

    def masks(self, pings: list[int]) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
        """Masks of `RecordingWriter.masks`, true of pings in the store too."""
        recorded, lines, whole = super().masks(pings)
        names = self._store.names()
        *labels, sound = self._groups
        if self._labelled:
            whole |= labels[0].rows(names)
        for array in sound.arrays if self._lines is not None else ():
            if array.name == "recorded":
                there = [array.shard_file(row // array.per_shard).as_posix() in names for row in range(lines.size)]
                lines |= np.array(there, bool)
        return recorded | sound.rows(names), lines, whole

    def write(self, ping: int, series: NDArray[np.generic] | None, labels: Any) -> None:
        """Write one ping, and put its shard into the store if it was the last."""
        try:
            super().write(ping, series, labels)
        except WriteError:
            if self.path.exists() or not self._in_store(ping):  # another process has completed the recording
                raise

    def pack(self, shards: list[int] | None = None) -> None:
        """Pack shards of which all pings are there, of any writer on this machine, and put them into the store."""
        super().pack(shards)
        with writing(self.path, self._identity):
            for group in self._groups:
                self._put_shards(group)

    def _put_shards(self, group: StoredGroup) -> None:
        """Put the shards that are packed on disk, each with its entry in the mask last, and delete them there."""
        local = group.below(self.path)
        packed = numbered(local.done.group / "done" / "c")
        complete = recorded_rows(local.done.group, local.needed) if packed else np.zeros(0, bool)
        for shard in packed:
            if complete[list(local.done.rows(shard))].all():
                files = [array.shard_file(shard) for array in local.arrays if array.rows(shard)]
                if local.done.per_shard == 1:  # a line of a recorder is of some pings
                    files += [array.shard_file(row) for array in local.arrays if array.name == "recorded"
                              for row in range(array.shape[0])]  # fmt: skip
                self._store.require_own(self._identity)
                for file in (*files, local.done.shard_file(shard)):
                    self._put(file)
                for file in (local.done.shard_file(shard), *files):
                    file.unlink(missing_ok=True)

    def _put(self, file: Path) -> None:
        """Put one file, if it is there: a row of False has none, nor has a shard that another process has put."""
        try:
            if file.is_file():
                self._store.put(file.relative_to(self.path).as_posix(), file)
        except WriteError:
            if file.is_file():
                raise

    def _in_store(self, ping: int) -> bool:
        """True where the store has the ping, and its labels if they are written."""
        names = self._store.names()
        return all(group.rows(names)[ping] for group in self._groups)

    def finish(self) -> None:
        """Put all shards that are complete; delete what the store has, and state what is left on disk."""
        if not self.path.exists() and self._is_complete(self._store.names()):
            return
        self._groups = self._groups_on_disk()
        self.pack()
        names = self._store.names()
        for group in self._groups:
            self._delete_stored(group, group.rows(names))
        if self._is_complete(names):
            (self.path / COMPLETE).touch()
            return
        loose = row_array(self.path, "done").loose_rows()
        waiting = [ping for ping in loose if ping // self._per_shard in self._shards]
        if waiting:
            first = min(waiting) // self._per_shard * self._per_shard
            warn_caller(
                f"{len(waiting)} pings wait in {self.path} for the others of their shards, and are not in "
                f"{self.location} yet. Simulate whole shards on this machine, such as --pings "
                f"{first}:{min(first + self._per_shard, row_array(self.path, 'done').shape[0])}"
            )  # fmt: skip

    def _is_complete(self, names: set[str]) -> bool:
        """True where all pings are in the store, and labels if there are any."""
        return all(group.rows(names).all() for group in self._groups)

    def _delete_stored(self, group: StoredGroup, stored: NDArray[np.bool_]) -> None:
        """Delete the files of a spool whose pings are in the store: those of a killed process, or of a second one."""
        local = group.below(self.path)
        for array in (local.done, *local.arrays):
            shards = [k for k in array.loose_shards() if stored[min(k * self._per_shard, stored.size - 1)]]
            for file in loose_files(array.loose_folder, shards):
                file.unlink(missing_ok=True)
            if array.shape[0] == stored.size or self._per_shard > 1:  # else a line of a recorder, put with any ping
                for shard in np.unique(np.flatnonzero(stored) // self._per_shard).tolist():
                    array.shard_file(shard).unlink(missing_ok=True)
