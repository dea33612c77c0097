"""Writing of pings and labels into a recording by one of any number of processes."""

from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.formats import label_store, zarr_store
from insonify.formats.shards import pack_shards, row_array
from insonify.part import Part
from insonify.processing.recorded_lines import RecordedLines
from insonify.records.labels import LabelNames, Labels
from insonify.records.recording import RecordingLayout


class RecordingWriter:
    """Writer of one process into a recording: it knows what is missing, and packs shards that become complete."""

    def __init__(
        self, path: Path, layout: RecordingLayout, attributes: Mapping[str, Any], *, lines: RecordedLines | None = None,
        label_names: LabelNames | None = None, overwrite: bool = False,
    ) -> None:  # fmt: skip
        """Create the recording, or open that of an earlier run or of another process.

        Args:
            path: Folder of the recording.
            layout: Layout of the recording.
            attributes: Attributes of the recording.
            lines: Lines of the recorder; None: none.
            label_names: Axes of the labels; None: none are wanted.
            overwrite: True: replace another recording at that path.
        """
        self.path, self._lines, self._labelled = path, lines, label_names is not None
        self._identity = zarr_store.create_recording(path, layout, attributes, overwrite=overwrite)
        if label_names is not None:
            label_store.create_labels(path, label_names, layout, attributes, into=self._identity)
        self._per_shard = row_array(path, "done").per_shard
        self._left = Counter[int]()

    def of_part(self, part: Part | None, wanted: list[int]) -> list[int]:
        """Those of the wanted pings that belong to a part: whole shards, or whole lines where shards are too few.

        Args:
            part: The part; None: all pings.
            wanted: Numbers of the pings.
        """
        if part is None:
            return wanted
        pings = row_array(self.path, "done").shape[0]
        unit = self._per_shard
        if -(-pings // unit) < part.count:
            unit = self._lines.recorder.pings_per_line if self._lines is not None else 1
        share = part.share(pings, unit)
        return [ping for ping in wanted if ping in share]

    def missing(self, wanted: list[int]) -> tuple[list[tuple[int, bool, bool]], int]:
        """Missing results of some pings: number, sound, labels; and the number of all pings that this concerns.

        Args:
            wanted: Numbers of the pings.
        """
        there = zarr_store.recorded_pings(self.path)
        if self._lines is not None:
            wanted = self._lines.plan(wanted, there, zarr_store.recorded_lines(self.path))
        whole = label_store.labelled_pings(self.path) if self._labelled else np.ones(len(there), bool)
        jobs = [(ping, False, True) for ping in wanted if there[ping] and not whole[ping]]
        jobs += [(ping, True, not whole[ping]) for ping in wanted if not there[ping]]
        self._left = Counter(ping // self._per_shard for ping, *_ in jobs)
        return jobs, len(wanted)

    def write(self, ping: int, series: NDArray[np.generic] | None, labels: Labels | None) -> None:
        """Write one ping, and pack its shard if it was the last.

        Args:
            ping: Number of the ping.
            series: Its pressure [uPa] or intensity [uPa^2], shape (channels, samples); None: it is there.
            labels: Its labels; None: they are there, or not wanted.
        """
        if labels is not None:  # first: a ping whose sound is there is whole
            label_store.write_label_ping(self.path, ping, labels, into=self._identity)
        if series is not None:
            write_line = partial(zarr_store.write_line, self.path, into=self._identity)
            complete = {ping: series} if self._lines is None else self._lines.add(ping, series, write_line)
            for number, one in complete.items():
                zarr_store.write_ping(self.path, number, one, into=self._identity)
        shard = ping // self._per_shard
        self._left[shard] -= 1
        if not self._left[shard]:
            self.pack([shard])

    def pack(self, shards: list[int] | None = None) -> None:
        """Pack shards of which all pings are there, of any writer; None: all such shards."""
        zarr_store.require_own_recording(self.path, self._identity)
        pack_shards(self.path, zarr_store.sound_arrays(self.path), shards)
        if self._labelled:
            label_store.pack_labels(self.path, shards)
