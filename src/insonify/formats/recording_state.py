"""Content of a recording on disk or in an object store: recorded and labelled pings, shards and loose pings."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.formats import label_store, zarr_store
from insonify.formats.locations import is_url
from insonify.formats.object_store import ObjectStore, spooled_recording
from insonify.formats.shards import row_array
from insonify.formats.store_description import IDENTITY
from insonify.formats.store_writer import groups_of
from insonify.part import Part


class RecordingState(NamedTuple):
    """Recorded pings, labelled pings and shards of a recording."""

    location: str | Path
    recorded: NDArray[np.bool_]
    """Mask of the recorded pings, shape (ping,)."""
    labelled: NDArray[np.bool_] | None
    """Mask of the labelled pings, shape (ping,); None without labels."""
    per_shard: int
    """Pings of a shard; 1: each ping has a file of its own."""
    loose: int
    """Recorded pings that are not in a shard yet [1]."""
    folder: Path
    """Folder of the loose pings."""

    def pings_of_part(self, part: Part) -> range:
        """Pings of one part of a run."""
        if is_url(self.location):
            return part.share(self.recorded.size, self.per_shard)
        return zarr_store.pings_of_part(self.location, part)


def recording_state(path: str | Path) -> RecordingState:
    """Recorded and labelled pings of a recording.

    Args:
        path: Folder of the recording, or its URL; pings that wait on this machine for their shard count too.

    Raises:
        StoreError: The location is not a recording, or is damaged.
    """
    if is_url(path):
        return _state_in_store(ObjectStore(str(path)))
    zarr_store.require_recording(path)
    folder = Path(path)
    recorded, labelled = zarr_store.recorded_pings(folder), _labelled_on_disk(folder)
    return RecordingState(
        path, recorded, labelled, row_array(folder, "done").per_shard, zarr_store.loose_pings(folder), folder
    )


def _state_in_store(store: ObjectStore) -> RecordingState:
    description = store.require_recording()
    names = store.names()
    *labels, sound = groups_of(description, store.description(label_store.FOLDER))
    recorded, labelled, loose = sound.rows(names), labels[0].rows(names) if labels else None, 0
    spool = spooled_recording(store.url, description["attributes"][IDENTITY])
    if (spool / "zarr.json").is_file():
        waiting = zarr_store.recorded_pings(spool) & ~recorded
        recorded, loose = recorded | waiting, int(waiting.sum())
        if labelled is not None and (there := _labelled_on_disk(spool)) is not None:
            labelled = labelled | there
    return RecordingState(store.url, recorded, labelled, sound.done.per_shard, loose, spool)


def _labelled_on_disk(folder: Path) -> NDArray[np.bool_] | None:
    has_labels = (folder / label_store.FOLDER / "zarr.json").is_file()
    return label_store.labelled_pings(folder) if has_labels else None
