"""Content of a recording on disk or in an object store: recorded and labelled pings, shards and loose pings."""

from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.formats import label_store, zarr_store
from insonify.formats.locations import is_url
from insonify.formats.object_store import ObjectStore, spooled_recording
from insonify.formats.shards import row_array
from insonify.formats.store_description import IDENTITY
from insonify.formats.store_writer import groups_of
from insonify.part import Part

HALVINGS = 4
"""Times that the work left is halved: the last shares are 1/16 of the work of all workers [1]."""
TINY = 1e-6
"""Work of an item that is done already, over that of one that is not [1]."""


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

    def shares(self, pings: range, workers: int) -> list[range]:
        """Shares of some pings for workers that take one after the other, by the number of missing pings in each."""
        missing = ~self.recorded if self.labelled is None else ~(self.recorded & self.labelled)
        unit = self.per_shard if is_url(self.location) else zarr_store.pings_together(self.location)
        return decreasing_shares(missing[pings.start : pings.stop], workers, first=pings.start, unit=unit)


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
    spool = spooled_recording(store.url, description["attributes"][IDENTITY])
    waiting, there = None, None
    if (spool / "zarr.json").is_file():  # looked at before the store, into which a shard may be put meanwhile
        waiting, there = zarr_store.recorded_pings(spool), _labelled_on_disk(spool)
    names = store.names()
    *labels, sound = groups_of(description, store.description(label_store.FOLDER))
    recorded, labelled, loose = sound.rows(names), labels[0].rows(names) if labels else None, 0
    if waiting is not None:
        recorded, loose = recorded | waiting, int((waiting & ~recorded).sum())
    if labelled is not None and there is not None:
        labelled = labelled | there
    return RecordingState(store.url, recorded, labelled, sound.done.per_shard, loose, spool)


def _labelled_on_disk(folder: Path) -> NDArray[np.bool_] | None:
    has_labels = (folder / label_store.FOLDER / "zarr.json").is_file()
    return label_store.labelled_pings(folder) if has_labels else None


def decreasing_shares(weights: NDArray[Any], workers: int, *, first: int = 0, unit: int = 1) -> list[range]:
    """Consecutive shares of some items for workers that take one after the other: large ones first, small ones last.

    All workers then end at nearly the same time, however fast each is: the first shares are half of the work, the next
    ones half of what is left, and the last ones small.

    Args:
        weights: Work of each item, of any unit, shape (item,).
        workers: Number of workers [1].
        first: Number of the first item.
        unit: Items that stay together, from number 0 on [1].

    Returns:
        Numbers of the items of each share; each item is in one.

    Example:
        >>> decreasing_shares(np.ones(64), 1)
        [range(0, 32), range(32, 48), range(48, 56), range(56, 60), range(60, 64)]
    """
    sizes = np.repeat([*0.5 ** np.arange(1, HALVINGS + 1), 0.5**HALVINGS], workers) / workers
    work = np.cumsum(np.asarray(weights, float) + TINY)
    ends = np.searchsorted(work, np.cumsum(sizes)[:-1] * work[-1] * (1 + 1e-12), side="right") + first
    last = first + work.size
    edges = [first, *(min(-(-int(end) // unit) * unit, last) for end in ends), last]
    return [range(start, end) for start, end in pairwise(edges) if start < end]
