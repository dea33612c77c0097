"""File of a real instrument: an index of its datagrams, from which data are read on demand.

A file is a sequence of datagrams. Opening it reads their headers only, so that files larger than memory open. A
datagram that is damaged, cut off or unknown is left out, and listed in `omissions` with its offset and the reason.
"""

import os
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.store_description import StoreError

MAX_VALUES = 1 << 28
"""Most numbers of one array that is read at once: 1 GB of float32."""
MAX_OMISSIONS = 1000
"""Most omissions that are listed one by one."""
_WINDOWS = 1 << 8, 1 << 20  # bytes searched at once for the next datagram, at first and at most
_MOST_BACK, _MOST_AHEAD = 10.0, 86400.0  # seconds between datagrams of one kind

Parsed = TypeVar("Parsed")


class DatagramError(ValueError):
    """A datagram that cannot be read, with the reason; it becomes an omission."""


@dataclass(frozen=True, slots=True)
class Omission:
    """Part of a file that is left out."""

    offset: int
    """First byte of the part."""
    reason: str


@dataclass(frozen=True, slots=True)
class Instrument:
    """Maker, model and serial number; empty where the file does not state them."""

    maker: str = ""
    model: str = ""
    serial: str = ""


@dataclass(frozen=True, slots=True)
class Setting:
    """One value that a file states about the instrument or its installation."""

    name: str
    value: float | int | str
    unit: str
    """Unit in SI, "1" without dimension, empty of a text."""
    datagram: str
    """Kind of the datagram that holds the value."""
    offset: int
    """First byte of that datagram."""


@dataclass(frozen=True, slots=True)
class LeverArm:
    """Position of the transducer re the point whose positions a file logs."""

    position: tuple[float, float, float]
    """Forward, starboard, down [m]."""
    source: str
    """Settings that it follows from."""

    @property
    def text(self) -> str:
        """Numbers with commas."""
        return ", ".join(f"{part:.4g}" for part in self.position)


@dataclass(frozen=True, slots=True)
class Datagrams:
    """Index of the datagrams of a file, as columns of equal length n."""

    offset: NDArray[np.int64]
    """First byte, shape (n,)."""
    size: NDArray[np.int64]
    """Bytes with header and trailer, shape (n,)."""
    kind: NDArray[np.str_]
    """Name of the kind as the maker writes it, such as "#MRZ", shape (n,)."""
    time: NDArray[np.float64]
    """Seconds since 1970-01-01 UTC, NaN where the header has no time, shape (n,)."""

    def rows(self, *kinds: str) -> NDArray[np.int64]:
        """Rows of the datagrams of some kinds, in the order of the file."""
        return np.flatnonzero(np.any([self.kind == kind for kind in kinds], axis=0))


class InstrumentFile(ABC):
    """Recording of a real instrument; a subclass reads one format.

    A subclass sets `format`, yields the datagrams in `_index`, names its groups and reads their pings. It reads bytes
    with `_bytes` only, which refuses what the file does not hold, and raises `DatagramError` for what cannot be read.
    Variables have the attributes `units` and `long_name`; units are SI, angles radians, signs those of
    `docs/conventions.md`, `time` seconds since 1970-01-01 UTC.

    Example:
        >>> recording = insonify.simulate(insonify.load_scenario("sidescan.yaml"), pings=range(2))
        >>> with insonify.open_instrument(insonify.export(recording, "line.xtf")) as file:
        ...     print(np.unique(file.datagrams.kind).tolist(), file.omissions)
        ...     print(np.degrees(file.attitude()["yaw"].values).round(2))
        ['ATTITUDE', 'NAVIGATION', 'NOTES', 'SONAR'] ()
        [0.5 0.5]
    """

    format: ClassVar[str]
    """Name of the format, such as "Kongsberg KMALL"."""
    suffixes: ClassVar[tuple[str, ...]]
    """Suffixes of such files, in lower case with the dot."""
    kinds: ClassVar[Mapping[str, str]]
    """Content of each kind of datagram that the format has; others are listed as unknown."""
    unread: ClassVar[frozenset[str]] = frozenset()
    """Kinds of which nothing is read; `not_read` lists those that a file has."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file = self.path.open("rb")
        self._size = os.fstat(self._file.fileno()).st_size
        self._omitted: dict[int, Omission] = {}
        self._not_listed: set[int] = set()
        try:
            rows = list(self._index())
        except BaseException:
            self.close()
            raise
        offset, size, kind, time = zip(*rows, strict=True) if rows else ((), (), (), ())
        self.datagrams = Datagrams(
            np.array(offset, np.int64), np.array(size, np.int64), np.array(kind, np.str_), np.array(time, float)
        )
        if not rows:
            self.close()
            omission = next(iter(self._omitted.values()), Omission(0, "the file is empty"))
            raise StoreError(
                f"{path}, byte {omission.offset}: no datagram of the format {self.format} ({omission.reason}). Give a "
                f"file of a format that is read, or copy it again"
            )
        self._omit_unknown()

    def __repr__(self) -> str:
        """File, format, instrument and number of pings of each group, on one line."""
        instrument = " ".join(filter(None, (self.instrument.maker, self.instrument.model))) or "unknown"
        groups = ", ".join(f"{name}: {count} ping{'s' * (count != 1)}" for name, count in self.groups.items())
        return (
            f"{type(self).__name__}: {self.path.name}, {self.format}, instrument {instrument}; {groups or 'no pings'}"
        )

    @staticmethod
    @abstractmethod
    def matches(head: bytes) -> bool:
        """Return True if a file may be of this format, by its first 2048 bytes."""

    @abstractmethod
    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        """Offset, size, kind and time of each datagram whose header and length are sound; others are omitted."""

    @property
    @abstractmethod
    def instrument(self) -> Instrument:
        """Maker, model and serial number."""

    @property
    @abstractmethod
    def groups(self) -> Mapping[str, int]:
        """Number of pings of each group of data, such as "soundings", "water column", "port" or "38 kHz"."""

    @abstractmethod
    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Read pings of one group, with the settings of each ping.

        Args:
            group: One of `groups`.
            pings: Some of its pings. One that cannot be read is left out; the coordinate `ping` keeps the numbers.

        Returns:
            Dataset over (ping, beam or channel, sample), padded with NaN where beams or pings are shorter.

        Raises:
            StoreError: There is no such group, or the pings need more memory than is allowed.
        """

    @abstractmethod
    def settings(self) -> tuple[Setting, ...]:
        """Settings of the instrument and its installation, in the order of the file."""

    def navigation(self) -> xr.Dataset | None:
        """Latitude and longitude [rad] over time, None where the file has none."""
        return None

    def attitude(self) -> xr.Dataset | None:
        """Roll, pitch, yaw [rad] and heave [m, positive down] over time, None where the file has none."""
        return None

    def sound_speed_profiles(self) -> tuple[xr.Dataset, ...]:
        """Profiles of sound speed [m/s] over depth [m], each with the attribute `time`."""
        return ()

    def sensors(self) -> Mapping[str, xr.Dataset]:
        """Readings of other sensors over time, by name, such as "clock" or "height"."""
        return {}

    def lever_arm(self, group: str | None = None) -> LeverArm | None:
        """Position of a transducer re the point that `navigation` has positions of, None where it is not known.

        Args:
            group: Group of the transducer, of a file with several of them.
        """
        return None

    def setting_values(self, *names: str) -> list[float] | None:
        """Numbers of some settings, None where one is absent."""
        known = {setting.name: setting.value for setting in self.settings()}
        numbers = [known.get(name) for name in names]
        return (
            [float(one) for one in numbers if one is not None]
            if all(isinstance(one, int | float) for one in numbers)
            else None
        )

    def soundings(self, pings: slice = slice(None)) -> xr.Dataset | None:
        """Detections of the seabed over (ping, beam): the group "soundings", None where the file has none."""
        return self.read("soundings", pings) if "soundings" in self.groups else None

    @property
    def omissions(self) -> tuple[Omission, ...]:
        """Parts left out so far, by offset: on opening by their headers, on reading by their content."""
        listed = tuple(self._omitted[offset] for offset in sorted(self._omitted))
        more = f"and {len(self._not_listed)} more"
        return (*listed, Omission(self._size, more)) if self._not_listed else listed

    @property
    def not_read(self) -> tuple[Omission, ...]:
        """Kinds of datagrams that the format has and of which nothing is read, with their number, each at its first."""
        rows = (row for row in self._kind_counts() if row[0] in self.unread)
        return tuple(
            Omission(offset, f"{kind}: {self.kinds[kind]}: not read, {count} of them") for kind, offset, count in rows
        )

    @cached_property
    def clock_jumps(self) -> tuple[Omission, ...]:
        """Datagrams whose clock is far from that of the previous one of their kind: a buffer reorders by seconds."""
        jumps = []
        for kind in np.unique(self.datagrams.kind):
            rows = self.datagrams.rows(str(kind))
            step = np.diff(self.datagrams.time[rows])
            for row in np.flatnonzero((step < -_MOST_BACK) | (step > _MOST_AHEAD))[:MAX_OMISSIONS]:
                direction = "back" if step[row] < 0 else "ahead"
                why = f"{kind}: the clock jumps {direction} by {abs(step[row]):.3f} s"
                jumps.append(Omission(int(self.datagrams.offset[rows[row + 1]]), why))
        return tuple(sorted(jumps, key=lambda jump: jump.offset))

    def check(self) -> tuple[Omission, ...]:
        """Read every datagram once, and return what is left out."""
        for group, count in self.groups.items():
            for ping in range(count):
                self.read(group, slice(ping, ping + 1))
        self.settings(), self.navigation(), self.attitude(), self.sound_speed_profiles(), self.sensors()
        return self.omissions

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _bytes(self, offset: int, size: int) -> bytes:
        """Bytes of the file.

        Raises:
            DatagramError: The file ends before.
        """
        if size < 0 or offset < 0 or offset + size > self._size:
            raise DatagramError(f"{size} bytes are stated, and the file has {max(self._size - offset, 0)} more")
        self._file.seek(offset)
        content = self._file.read(size)
        if len(content) != size:
            raise DatagramError(f"{size} bytes are stated, and {len(content)} could be read")
        return content

    def _verify(self, content: bytes) -> None:  # noqa: B027, a format without checksum has nothing to add
        """Refuse a datagram whose checksum disagrees.

        Raises:
            DatagramError: It does.
        """

    def _find(self, pattern: "re.Pattern[bytes]", offset: int) -> int:
        """Offset of the next match (of at most 64 bytes), the size of the file where there is none."""
        window, most = _WINDOWS  # small at first: a file may be full of patterns that open no datagram
        while offset < self._size:
            content = self._bytes(offset, min(window, self._size - offset))
            if match := pattern.search(content):
                return offset + match.start()
            window = min(4 * window, most)
            offset += max(len(content) - 64, 1) if offset + len(content) < self._size else len(content)
        return self._size

    def _scan(
        self, offset: int, header: Callable[[int], tuple[int, str, float]], mark: "re.Pattern[bytes]", lead: int = 0
    ) -> Iterator[tuple[int, int, str, float]]:
        """Offset, size, kind and time of the datagrams that follow one another; a damaged stretch is omitted as one.

        Args:
            offset: First byte of the first datagram.
            header: Size, kind and time of the datagram at an offset; it refuses one that is not sound.
            mark: Bytes by which the next datagram is found behind a damaged one.
            lead: Bytes of a datagram in front of the mark.
        """
        sound = True
        while offset < self._size:
            try:
                size, kind, seconds = header(offset)
            except DatagramError as fault:
                if sound:
                    self._omit(offset, str(fault))
                sound, offset = False, self._find(mark, offset + lead + 1) - lead
                if offset + lead >= self._size:
                    return
                continue
            yield offset, size, kind, seconds
            sound, offset = True, offset + size

    def _omit(self, offset: int, reason: str) -> None:
        """List a part of the file as left out; a part is listed once."""
        if offset in self._omitted:
            return
        if len(self._omitted) < MAX_OMISSIONS:
            self._omitted[offset] = Omission(int(offset), reason)
        else:
            self._not_listed.add(offset)

    def _omit_unknown(self) -> None:
        """List the first datagram of each kind that the format does not have."""
        for kind, offset, count in self._kind_counts():
            if kind not in self.kinds:
                self._omit(offset, f"{kind}: unknown kind of datagram" + (f", {count} of them" if count > 1 else ""))

    def _kind_counts(self) -> Iterator[tuple[str, int, int]]:
        """Each kind of datagram with the offset of the first and their number."""
        kinds, first, counts = np.unique(self.datagrams.kind, return_index=True, return_counts=True)
        return zip(kinds.tolist(), self.datagrams.offset[first].tolist(), counts.tolist(), strict=True)

    def _parsed(self, rows: Iterable[int], parse: Callable[[bytes], Parsed]) -> Iterator[tuple[int, Parsed]]:
        """Rows of the index with their parsed datagrams; those that cannot be read are omitted."""
        for row in rows:
            offset = int(self.datagrams.offset[row])
            try:
                content = self._bytes(offset, int(self.datagrams.size[row]))
                self._verify(content)
                yield int(row), parse(content)
            except DatagramError as fault:
                self._omit(offset, f"{self.datagrams.kind[row]}: {fault}")

    def _require_group(self, group: str) -> int:
        """Number of pings of a group, refused if there is no such group."""
        if group not in self.groups:
            known = ", ".join(self.groups) or "none"
            raise StoreError(f"{self.path}: there is no group {group!r}. Its groups: {known}")
        return self.groups[group]


def records(
    content: bytes, layout: np.dtype[Any], offset: int, count: int = 1, size: int | None = None
) -> NDArray[Any]:
    """Records of a structured layout in a datagram, of which no more are taken than it holds.

    Args:
        content: The datagram.
        layout: Structured type of one record.
        offset: First byte in the datagram.
        count: Number of records.
        size: Bytes of one record as the file states it, of an earlier or later version than `layout`; its
            missing fields become NaN or 0.

    Raises:
        DatagramError: The datagram is shorter.
    """
    size = layout.itemsize if size is None else size
    if count < 0 or offset < 0 or size < 1 or offset + count * size > len(content):
        raise DatagramError(f"{count} records of {size} bytes are stated from byte {offset} of {len(content)}")
    if size == layout.itemsize:
        return np.frombuffer(content, layout, count, offset)
    table = np.zeros(count, layout)
    fields = [(name, kind.itemsize + start) for name, (kind, start, *_) in (layout.fields or {}).items()]
    for name, end in fields:
        if end > size and table[name].dtype.kind == "f":
            table[name] = np.nan
    whole = max((end for _, end in fields if end <= size), default=0)
    stated = np.frombuffer(content, np.uint8, count * size, offset).reshape(count, size)
    table.view(np.uint8).reshape(count, layout.itemsize)[:, :whole] = stated[:, :whole]
    return table


def require_memory(path: Path, *shape: int) -> None:
    """Refuse an array that needs too much memory, before the memory is taken.

    Args:
        path: The file, for the message.
        shape: Shape of the array; its first axis counts pings.

    Raises:
        StoreError: It has more than `MAX_VALUES` values.
    """
    each = int(np.prod(shape[1:], dtype=object))
    if shape[0] * each > MAX_VALUES:
        few = f"at most {MAX_VALUES // each} at once" if each <= MAX_VALUES else "others"
        raise StoreError(f"{path}: {shape[0]} pings of {each} values are too many. Read {few}")
