"""Writing of pings and labels into a recording by one of any number of processes."""

import errno
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.formats import label_store, zarr_store
from insonify.formats.loose_rows import OwnFiles
from insonify.formats.shards import pack_shards, row_array
from insonify.formats.store_description import WriteError
from insonify.part import Part
from insonify.processing.recorded_lines import RecordedLines
from insonify.records.labels import LabelNames, Labels
from insonify.records.recording import RecordingLayout


class RecordingWriter:
    """Writer of one process into a recording; it determines missing pings, and packs shards that are complete."""

    def __init__(
        self, path: str | Path, layout: RecordingLayout, attributes: Mapping[str, Any], *,
        lines: RecordedLines | None = None, label_names: LabelNames | None = None, overwrite: bool = False,
        shard: int | None = None,
    ) -> None:  # fmt: skip
        """Create the recording, or open that of an earlier run or of another process.

        Args:
            path: Folder of the recording.
            layout: Layout of the recording.
            attributes: Attributes of the recording.
            lines: Lines of the recorder; None: none.
            label_names: Axes of the labels; None: none are written.
            overwrite: True: replace another recording at that path.
            shard: Pings of one shard of a new recording; None: by their number and size.
        """
        self.location: str | Path = Path(path)
        """Location of the recording as given."""
        self.path, self._lines, self._labelled = Path(path), lines, label_names is not None
        with writing(self.path):
            self._identity = zarr_store.create_recording(path, layout, attributes, overwrite=overwrite, shard=shard)
        with writing(self.path, self._identity):
            if label_names is not None:
                label_store.create_labels(path, label_names, layout, attributes, into=self._identity)
            self._per_shard = row_array(path, "done").per_shard
        self._left = Counter[int]()
        OwnFiles.renew()  # what is damaged in those of an earlier run of this process ends them

    def of_part(self, part: Part | None, pings: list[int]) -> list[int]:
        """Those of some pings that belong to a part, with a warning where there are none; None: all."""
        if part is None:
            return pings
        share = self._pings_of_part(part)
        mine = [ping for ping in pings if ping in share]
        if pings and not mine:
            warn_caller(
                f"part {part} is pings {share.start} to {share.stop - 1} of {self.location}, and none of them is "
                "requested: parts are those of all pings, not of a range. Give a range alone, or a part alone"
                if share else f"part {part} has no pings: {self._units()}"
            )  # fmt: skip
        return mine

    def _pings_of_part(self, part: Part) -> range:
        return zarr_store.pings_of_part(self.path, part)

    def _units(self) -> str:
        """Units that parts share out, for a message."""
        return f"{self.location} has {row_array(self.path, 'done').shape[0]} pings, which make fewer parts"

    @property
    def accepts_any_order(self) -> bool:
        """True where copies of this process may write pings too, in any order."""
        return self._lines is None

    def missing(self, pings: list[int]) -> tuple[list[tuple[int, bool, bool]], int]:
        """Missing results of some pings: number, sound, labels; and the number of all pings that this concerns.

        Args:
            pings: Numbers of the pings.
        """
        with writing(self.path, self._identity):
            recorded, lines, whole = self.masks(pings)
        if self._lines is not None:
            pings = self._lines.plan(pings, recorded, lines)
        jobs = [(ping, False, True) for ping in pings if recorded[ping] and not whole[ping]]
        jobs += [(ping, True, not whole[ping]) for ping in pings if not recorded[ping]]
        self._left = Counter(ping // self._per_shard for ping, *_ in jobs)
        return jobs, len(pings)

    def masks(self, pings: list[int]) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
        """Masks of recorded pings, of recorded lines, and of pings that are labelled or need no labels.

        Args:
            pings: Pings whose shards are looked at for damaged bytes.
        """
        own = {ping // self._per_shard for ping in pings}
        recorded = zarr_store.recorded_pings(self.path, intact=own)
        lines = zarr_store.recorded_lines(self.path, intact=own) if self._lines is not None else np.zeros(0, bool)
        whole = label_store.labelled_pings(self.path, intact=own) if self._labelled else np.ones(len(recorded), bool)
        return recorded, lines, whole

    def write(self, ping: int, series: NDArray[np.generic] | None, labels: Labels | None) -> None:
        """Write one ping, and pack its shard if it was the last.

        Args:
            ping: Number of the ping.
            series: Its pressure [uPa] or intensity [uPa^2], shape (channels, samples); None: it is there.
            labels: Its labels; None: they are there, or not written.
        """
        self.write_loose(ping, series, labels)
        self.pack_completed(ping)

    def pack_completed(self, ping: int) -> None:
        """Pack the shard of a ping that was written, by this process or a copy of it, if it was the last."""
        shard = ping // self._per_shard
        self._left[shard] -= 1
        if not self._left[shard]:
            self.pack([shard])

    def write_loose(self, ping: int, series: NDArray[np.generic] | None, labels: Labels | None) -> None:
        """Write one ping, and leave it loose.

        Args:
            ping: Number of the ping.
            series: Its pressure [uPa] or intensity [uPa^2], shape (channels, samples); None: it is there.
            labels: Its labels; None: they are there, or not written.
        """
        with writing(self.path, self._identity):
            if labels is not None:  # first: a ping whose sound is there is whole
                label_store.write_label_ping(self.path, ping, labels, into=self._identity)
            if series is not None:
                write_line = partial(zarr_store.write_line, self.path, into=self._identity)
                complete = {ping: series} if self._lines is None else self._lines.add(ping, series, write_line)
                for number, one in complete.items():
                    zarr_store.write_ping(self.path, number, one, into=self._identity)

    def pack(self, shards: list[int] | None = None) -> None:
        """Pack shards of which all pings are there, of any writer; None: all such shards."""
        with writing(self.path, self._identity):
            confirm = partial(zarr_store.require_own_recording, self.path, self._identity)
            confirm()
            pack_shards(self.path, zarr_store.sound_arrays(self.path), shards, confirm)
            if self._labelled:
                label_store.pack_labels(self.path, self._identity, shards)

    def finish(self) -> None:
        """Pack all shards of which all pings are there, at the end of a run."""
        self.pack()


@contextmanager
def writing(path: Path, into: str | None = None) -> Iterator[None]:
    """Convert errors of the file system while a recording is written.

    Args:
        path: Folder of the recording.
        into: Identity of the recording; None: not known yet.

    Raises:
        WriteError: The disk is full, or the folder was removed or locked; all that was recorded can be read.
        StoreError: Another run has replaced the recording meanwhile.
    """
    try:
        yield
    except WriteError:
        raise
    except OSError as error:
        is_removed = isinstance(error, FileNotFoundError)
        if is_removed and (path / "zarr.json").is_file():
            zarr_store.require_own_recording(path, into)
            is_removed = str(error.filename).endswith("zarr.json")  # a description; the one of the whole is next
        again = "What was recorded is kept; the same command goes on from there"
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            reason = f"{path}: the disk is full. Free some space, or copy the folder to a larger disk. {again}"
        elif is_removed:
            reason = f"{path} was removed or renamed during the run. The same command starts anew"
        else:
            reason = f"{path} cannot be written: {error.strerror or error}. {again} when the folder is writable"
        raise WriteError(reason) from error
