"""Blueprint Subsea Oculus: images of a forward-looking sonar, as sent over the network or in the log of its viewer.

Layout: the definitions of `Oculus.h` as published with liboculus (University of Washington, 2017-2022), "simple ping
result", versions 1 and 2. A message opens with the mark 0x4f53 and its length; there is no checksum. The log (.oculus)
wraps each message in an item with a time.
"""

import re
import zlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments import instrument_file
from insonify.formats.instruments.columns import (
    DEGREE,
    Column,
    ping_dataset,
    stacked,
    time_dataset,
    variable,
    variables,
)
from insonify.formats.instruments.instrument_file import (
    DatagramError,
    Instrument,
    InstrumentFile,
    Setting,
    records,
    require_memory,
)

MARK, LOG_MARK, ITEM_MARK = b"\x53\x4f", b"\x44\x33\x22\x11", b"\xdd\xcc\xbb\xaa"
HEADER = np.dtype("S2,<u2,<u2,<u2,<u2,<u4,<u2")
HEADER.names = ("mark", "source", "destination", "kind", "version", "size", "pad")
LOG_ITEM = np.dtype(
    {
        "names": ["mark", "size", "kind", "time", "compression", "original", "payload"],
        "formats": ["S4", "<u4", "<u2", "<f8", "<u2", "<u4", "<u4"],
        "offsets": [0, 4, 8, 16, 24, 28, 32],
        "itemsize": 40,
    }
)
_LOG_HEADER_SIZE, _SONAR_ITEM = 48, 10
_OPENING = re.compile(rb"^SO|SO....\x23\x00", re.DOTALL)
_DEMAND: list[tuple[str, str]] = [
    ("mode", "u1"), ("ping_rate", "u1"), ("network_speed", "u1"), ("gamma", "u1"), ("flags", "u1"),
    ("range_demand", "<f8"), ("gain", "<f8"), ("speed_demand", "<f8"), ("salinity", "<f8"),
]  # fmt: skip
_WATER = [("ping_id", "<u4"), ("status", "<u4"), ("frequency", "<f8"), ("temperature", "<f8"), ("pressure", "<f8")]
_ATTITUDE_FIELDS = [("heading", "<f8"), ("pitch", "<f8"), ("roll", "<f8")]
_IMAGE = [("width", "u1"), ("range_step", "<f8"), ("ranges", "<u2"), ("beams", "<u2")]
_SIZES = [("image_offset", "<u4"), ("image_size", "<u4"), ("message_size", "<u4")]
PINGS = (
    np.dtype([("head", "V16"), *_DEMAND, *_WATER, ("sound_speed", "<f8"), ("clock", "<u4"), *_IMAGE, *_SIZES]),
    np.dtype(
        [("head", "V16"), *_DEMAND, ("reserved", "V36"), *_WATER, *_ATTITUDE_FIELDS, ("sound_speed", "<f8"),
         ("clock", "<f8"), *_IMAGE, ("spare", "V16"), *_SIZES]
    ),
)  # fmt: skip
"""Layouts of a simple ping result, version 1 and 2."""
KINDS = {0x15: "fire", 0x22: "ping result", 0x23: "simple ping result", 0x55: "user configuration", 0x80: "log"}
_CONTENT = {
    "simple ping result": "image", "simple ping result 2": "image and attitude", "fire": "demand of a ping",
    "ping result": "image in the full form", "user configuration": "network", "log": "messages of the sonar",
    "message 0xff": "idle", "item": "other data of the log",
}  # fmt: skip
_SIMPLE = ("simple ping result", "simple ping result 2")
_WITH_GAIN = 0x04
_COLUMNS = (
    Column("ping_id", "ping_id", "code", "number of the ping as the sonar counts"),
    Column("status", "status", "code", "status bits"),
    Column("mode", "mode", "code", "1 low, 2 high frequency"),
    Column("flags", "flags", "code", "flags of the demand"),
    Column("frequency", "frequency", "Hz", "centre frequency"),
    Column("range_demand", "range_demand", "1", "demanded range, m or percent as the flags state"),
    Column("gain_percent", "gain", "%", "demanded gain"),
    Column("gamma", "gamma", "code", "exponent of the image as a fraction of 255; 0 and 255 mean 1"),
    Column("sound_speed", "sound_speed", "m/s", "sound speed of the instrument"),
    Column("salinity", "salinity", "g/kg", "salinity as set"),
    Column("temperature", "temperature", "degC", "temperature of the water"),
    Column("pressure", "pressure", "Pa", "pressure", 1e5),
    Column("clock", "clock", "1", "start of the ping by the sonar's clock: s since power-up in version 2"),
    Column("range_step", "range_step", "m", "step of range"),
)
_ATTITUDE = (
    Column("roll", "roll", "rad", "roll", DEGREE),
    Column("pitch", "pitch", "rad", "pitch", DEGREE),
    Column("yaw", "heading", "rad", "heading", DEGREE),
)
_PLAUSIBLE = {"temperature": (-5.0, 60.0), "pressure": (1e3, 1e8)}
"""Limits outside which a value is none: instruments without the sensor send random bytes."""


class BlueprintOculusFile(InstrumentFile):
    """Images of an Oculus."""

    format = "Blueprint Oculus"
    suffixes = (".oculus", ".raw")
    kinds = _CONTENT
    unread = frozenset(_CONTENT) - {"simple ping result", "simple ping result 2", "message 0xff"}
    """The maker publishes the names, not the meaning, of the fields of the full form of a ping."""

    @staticmethod
    def matches(head: bytes) -> bool:
        """Return True if a file may be of this format, by its first 2048 bytes."""
        return head.startswith(LOG_MARK) or _OPENING.search(head) is not None

    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        self._unpacked_size: dict[int, int] = {}
        self._logged = self._size >= _LOG_HEADER_SIZE and self._bytes(0, 4) == LOG_MARK
        mark = re.compile(re.escape(ITEM_MARK if self._logged else MARK))
        offset = _LOG_HEADER_SIZE if self._logged else 0
        while offset < self._size:
            try:
                item = self._item(offset) if self._logged else self._message(offset)
            except DatagramError as fault:
                self._omit(offset, str(fault))
                offset = self._find(mark, offset + 1)
                continue
            yield (offset, *item)
            offset += item[0]

    def _message(self, offset: int) -> tuple[int, str, float]:
        """Size, kind and time of a message."""
        header = records(self._bytes(offset, HEADER.itemsize), HEADER, 0)[0]
        if header["mark"] != MARK:
            raise DatagramError("no message with the mark 0x4f53")
        size = HEADER.itemsize + int(header["size"])
        if offset + size > self._size:
            raise DatagramError(f"{size} bytes are stated, and the file has {self._size - offset} more")
        return size, _kind(header), np.nan

    def _item(self, offset: int) -> tuple[int, str, float]:
        """Size, kind and time of an item of a log."""
        item = records(self._bytes(offset, LOG_ITEM.itemsize), LOG_ITEM, 0)[0]
        if item["mark"] != ITEM_MARK or item["size"] != LOG_ITEM.itemsize:
            raise DatagramError("no item with the mark 0xaabbccdd and a header of 40 bytes")
        size = LOG_ITEM.itemsize + int(item["payload"])
        if offset + size > self._size:
            raise DatagramError(f"{size} bytes are stated, and the file has {self._size - offset} more")
        stated = float(item["time"])
        time = stated if abs(stated) < 1e11 else stated * 1e-3
        if item["kind"] != _SONAR_ITEM:
            return size, "item", time
        head = _unpacked(self._bytes(offset, min(size, 1024)), HEADER.itemsize)
        self._unpacked_size[offset] = int(item["original"])
        return size, _kind(records(head, HEADER, 0)[0]), time

    @property
    def groups(self) -> Mapping[str, int]:
        """Number of pings of each group of data."""
        count = self.datagrams.rows(*_SIMPLE).size
        return {"image": int(count)} if count else {}

    @property
    def instrument(self) -> Instrument:
        """Maker, model and serial number."""
        return Instrument("Blueprint Subsea", "Oculus", self._serial)

    @cached_property
    def _serial(self) -> str:
        for row in self.datagrams.rows(*_SIMPLE)[:1]:
            return str(records(self._content(int(row)), HEADER, 0)[0]["source"])
        return ""

    def _content(self, row: int) -> bytes:
        """Message of one row of the index, out of its wrapper."""
        content = self._bytes(int(self.datagrams.offset[row]), int(self.datagrams.size[row]))
        return _unpacked(content, HEADER.itemsize) if self._logged else content

    def _pings(self, rows: Sequence[int] | NDArray[np.int64]) -> Iterator[tuple[int, "_Ping"]]:
        """Rows with their pings; what cannot be read is omitted."""
        wrapped = self._logged
        return self._parsed(
            rows, lambda content: _Ping(_unpacked(content, instrument_file.MAX_VALUES) if wrapped else content)
        )

    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Read images.

        Args:
            group: "image".
            pings: Some of its pings.

        Returns:
            `amplitude` over (ping, beam, sample) in counts, after the instrument's gain and gamma; the bearing of each
            beam, positive to the right, range of sample 0 and step of range; the gain of each range where the file has
            it; the settings of each ping.

        Raises:
            StoreError: There is no such group, or the pings need more memory than is allowed.
        """
        self._require_group(group)
        every = self.datagrams.rows(*_SIMPLE)
        rows = every[pings]
        sizes = [self._unpacked_size.get(int(self.datagrams.offset[row]), 0) for row in rows]
        require_memory(self.path, len(rows), max(int(self.datagrams.size[rows].max(initial=0)), *sizes, 0))
        by_row = dict(self._pings(rows))
        kept, read_pings = list(by_row), list(by_row.values())
        columns = _stated([ping.header for ping in read_pings])
        columns["first_range"] = variable("ping", np.zeros(len(kept)), "m", "range of sample 0")
        bearing, image = stacked([p.bearing for p in read_pings]), stacked([p.image for p in read_pings], axes=2)
        columns["bearing"] = variable(("ping", "beam"), bearing, "rad", "bearing of the beam, positive to the right")
        columns["amplitude"] = variable(("ping", "beam", "sample"), image, "1", "amplitude of the echo in counts")
        if any(ping.gain.size for ping in read_pings):
            gain = stacked([ping.gain for ping in read_pings])
            columns["sample_gain"] = variable(("ping", "sample"), gain, "1", "gain of each range, as sent")
        return ping_dataset(group, np.searchsorted(every, kept), self.datagrams.time[kept], columns)

    def settings(self) -> tuple[Setting, ...]:
        """Settings of the first ping that can be read."""
        for row, ping in self._pings(self.datagrams.rows(*_SIMPLE)):
            offset, kind = int(self.datagrams.offset[row]), str(self.datagrams.kind[row])
            values = {name: (v.values[0].item(), v.attrs["units"]) for name, v in _stated([ping.header]).items()}
            values |= {"beams": (ping.image.shape[0], "1"), "samples": (ping.image.shape[1], "1")}
            known = {name: pair for name, pair in values.items() if pair[0] == pair[0]}  # not NaN
            return tuple(Setting(name, value, unit, kind, offset) for name, (value, unit) in known.items())
        return ()

    def attitude(self) -> xr.Dataset | None:
        """Roll, pitch and yaw [rad] over time, None where no ping has any."""
        headers = [(row, ping.header) for row, ping in self._pings(self.datagrams.rows("simple ping result 2"))]
        if not any(header[column.field] for _, header in headers for column in _ATTITUDE):
            return None
        times = self.datagrams.time[[row for row, _ in headers]]
        return time_dataset([np.array([header]) for _, header in headers], times, _ATTITUDE)


class _Ping:
    """One image: header, bearings (beams,) [rad], counts (beams, ranges), gain of each range (ranges,) or (0,)."""

    def __init__(self, content: bytes) -> None:
        layout = PINGS[1 if records(content, HEADER, 0)[0]["version"] == 2 else 0]
        self.header: Any = records(content, layout, 0)[0]
        beams, ranges, width = (int(self.header[name]) for name in ("beams", "ranges", "width"))
        if width > 3 or not beams or not ranges:
            raise DatagramError(f"{beams} beams of {ranges} ranges with numbers of kind {width} are no image")
        width += 1
        gain_size = 4 if self.header["flags"] & _WITH_GAIN else 0
        stride = beams * width + gain_size
        rows = records(content, np.dtype((np.uint8, (stride,))), int(self.header["image_offset"]), ranges)
        if int(self.header["image_size"]) != ranges * stride:
            raise DatagramError(f"{ranges} ranges of {stride} bytes are not {self.header['image_size']} bytes")
        self.bearing = records(content, np.dtype("<i2"), layout.itemsize, beams) * (0.01 * DEGREE)
        self.gain = np.ascontiguousarray(rows[:, :gain_size]).view("<f4").reshape(-1)
        digits = rows[:, gain_size:].reshape(ranges, beams, width)
        kind = np.float64 if width > 2 else np.float32
        self.image = (digits.astype(kind) @ (256.0 ** np.arange(width)).astype(kind)).T


def _stated(headers: Sequence[Any]) -> dict[str, xr.Variable]:
    """Settings of pings as variables, without values that cannot be."""
    settings = variables(headers, _COLUMNS, ("ping",))
    for name, (low, high) in _PLAUSIBLE.items():
        values = settings[name].values
        settings[name] = settings[name].copy(data=np.where((values > low) & (values < high), values, np.nan))
    return settings


def _kind(header: Any) -> str:
    """Kind of a message; version 2 of the simple ping result is a kind of its own."""
    name = KINDS.get(int(header["kind"]), f"message {int(header['kind']):#x}")
    return f"{name} 2" if name == _SIMPLE[0] and header["version"] == 2 else name


def _unpacked(item: bytes, limit: int) -> bytes:
    """Message in an item of a log, of which no more than a limit is decompressed.

    Raises:
        DatagramError: It is damaged, or compressed in another way.
    """
    header = records(item, LOG_ITEM, 0)[0]
    payload = item[LOG_ITEM.itemsize : LOG_ITEM.itemsize + int(header["payload"])]
    if header["compression"] == 0:
        return payload
    if header["compression"] != 1:
        raise DatagramError(f"compression {header['compression']} is not read")
    try:  # Qt writes the size, then a zlib stream
        return zlib.decompressobj().decompress(payload[4:], min(limit, int(header["original"]) or 1))
    except zlib.error as fault:
        raise DatagramError(f"the compressed message is damaged: {fault}") from None
