"""eXtended Triton Format (XTF): sidescan and sub-bottom channels with navigation and attitude.

Triton Imaging (2016), XTF file format, rev. X41. The format has no checksum: a packet is taken where its samples and
the next packet agree with its length. Port channels are stored from far to near, and are turned round on reading.
Speeds are in knots; many programs write half the sound speed ("one way"), which is doubled.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments import xtf_layouts as layouts
from insonify.formats.instruments.columns import (
    DEGREE,
    Column,
    ping_dataset,
    record_settings,
    stacked,
    text_of,
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

_MAGIC = re.compile(rb"\xce\xfa")
_HEADER, _CHANNELS_IN_HEADER, _MOST_CHANNELS = 1024, 6, 256
_PADDING = 64  # packets are padded to a multiple of it
_KNOT = 1852 / 3600
_KINDS = {
    0: "SONAR", 1: "NOTES", 2: "BATHY", 3: "ATTITUDE", 4: "FORWARD", 5: "ELAC", 6: "RAW_SERIAL", 8: "HIDDEN_SONAR",
    14: "KLEIN_RAW_BATHY", 15: "HIGHSPEED_SENSOR", 17: "BATHY_XYZA", 18: "K5000_BATHY_IQ", 19: "BATHY_SNIPPET",
    20: "GPS", 22: "SINGLE_BEAM", 23: "GYRO", 28: "Q_MULTIBEAM", 42: "NAVIGATION", 61: "RESON_7125",
    62: "RESON_7125_SNIPPET", 65: "Q_R2SONIC_BATHY", 67: "R2SONIC_TRUEPIX", 68: "R2SONIC_BATHY", 73: "EDGETECH_4600",
    78: "RESON_7018_WATERCOLUMN", 84: "SOURCETIME_GYRO", 107: "POS_RAW_NAVIGATION", 199: "CUSTOM",
}  # fmt: skip
_MAKERS = {
    "Klein": (5, 9, 14, 32, 57, 58, 60, 66), "EdgeTech": (7, 10, 23, 24, 35, 38, 43, 56), "CMAX": (36, 51),
    "Benthos": (34, 37, 39, 40, 41, 42), "Kongsberg": (48, 59), "Reson": (8, 15, 46), "GeoAcoustics": (30, 50),
}  # fmt: skip
"""Numbers of the types of sonars of each maker."""
_SIDES = {0: "sub-bottom", 1: "port", 2: "starboard", 3: "bathymetry"}
_PORT = 1
_TYPES = {(1, 0): "u1", (2, 0): "<u2", (4, 0): "<u4", (4, 2): "<i4", (2, 3): "<u2", (4, 5): "<f4", (1, 8): "u1"}
"""Types of samples by their size and stated format."""
_SINGLE = (
    Column("ping_number", "ping", "code", "number of the ping in the instrument"),
    Column("altitude", "altitude", "m", "height of the sonar above the seabed"),
    Column("sensor_depth", "sensor_depth", "m", "depth of the sonar"),
    Column("speed", "speed", "m/s", "speed of the sonar", _KNOT),
    Column("heading", "heading", "rad", "heading of the sonar", DEGREE),
    Column("roll", "roll", "rad", "roll, positive starboard down", DEGREE),
    Column("pitch", "pitch", "rad", "pitch, positive bow up", DEGREE),
    Column("heave", "heave", "m", "heave, positive down", -1.0),
    Column("layback", "layback", "m", "horizontal distance of the sonar behind the ship"),
)
_CHANNEL = (
    Column("slant_range", "slant_range", "m", "range of the last sample"),
    Column("time_delay", "time_delay", "s", "time of the first sample"),
    Column("ping_interval", "ping_interval", "s", "time between pings as stated"),
    Column("gain_code", "gain", "code", "gain as the sonar codes it"),
    Column("initial_gain_code", "initial_gain", "code", "initial gain as the sonar codes it"),
    Column("processing", "processing", "code", "processing applied, 4 time-varying gain, 8 beam angle, 16 filter"),
    Column("sample_count", "samples", "code", "samples of the ping"),
)
_POSITION = (
    Column("latitude", "latitude", "rad", "latitude", DEGREE),
    Column("longitude", "longitude", "rad", "longitude", DEGREE),
)
_GRID_POSITION = (
    Column("northing", "latitude", "m", "northing in the projection of the file"),
    Column("easting", "longitude", "m", "easting in the projection of the file"),
)
_BEAM = (
    Column("travel_time", "travel_time", "s", "two-way travel time"),
    Column("beam_angle", "beam_angle", "rad", "beam angle, signed as stated", DEGREE),
    Column("tilt", "tilt", "rad", "steering of the transmitter along", DEGREE),
    Column("intensity", "intensity", "1", "intensity of the detection as stated"),
    Column("quality", "quality", "code", "quality of the detection as stated"),
)
_ATTITUDE = tuple(column for column in _SINGLE if column.name in ("roll", "pitch", "heave"))
_YAW = Column("yaw", "heading", "rad", "heading", DEGREE)


_FILE_SETTINGS = (
    Column("program", "program", "", ""),
    Column("program version", "version", "", ""),
    Column("sonar", "sonar", "", ""),
    Column("note", "note", "", ""),
    Column("file", "name", "", ""),
    Column("sonar type", "sonar_type", "code", ""),
    Column("navigation latency", "latency", "s", "", 1e-3),
    *(Column(f"{name} {axis}", f"{name}_{axis}", "m", "") for name in ("navigation", "motion")
      for axis in ("forward", "starboard", "down")),
    *(Column(f"motion {angle}", f"motion_{angle}", "rad", "", DEGREE) for angle in ("yaw", "pitch", "roll")),
)  # fmt: skip
_CHANNEL_SETTINGS = (
    Column("name", "name", "", ""),
    Column("side", "kind", "code", ""),
    Column("frequency as stated", "frequency", "1", ""),
    Column("volts at full scale", "volts", "V", ""),
    Column("bytes of a sample", "sample_size", "code", ""),
    Column("correction", "correction", "code", ""),
    *(Column(axis, axis, "m", "") for axis in ("forward", "starboard", "down")),
    *(Column(angle.replace("_", " "), angle, "rad", "", DEGREE)
      for angle in ("along_beam_width", "across_beam_width", "tilt", "yaw", "pitch", "roll")),
)  # fmt: skip


class XtfFile(InstrumentFile):
    """XTF file."""

    format = "XTF"
    suffixes = (".xtf",)
    kinds: ClassVar[Mapping[str, str]] = {
        "SONAR": "sonar ping",
        "NOTES": "notes",
        "ATTITUDE": "attitude",
        "NAVIGATION": "position",
        "POS_RAW_NAVIGATION": "position and attitude",
        "RAW_SERIAL": "text of a serial port",
        "GYRO": "heading",
        "SOURCETIME_GYRO": "heading",
        "CUSTOM": "content of a maker's own",
        "Q_MULTIBEAM": "soundings",
    } | {
        name: "bathymetry of a maker's own" for name in _KINDS.values() if re.search("BATHY|RESON|R2S|EDGE|ELAC", name)
    }
    unread = frozenset(kinds) - {"SONAR", "ATTITUDE", "NAVIGATION", "POS_RAW_NAVIGATION", "Q_MULTIBEAM"}

    @staticmethod
    def matches(head: bytes) -> bool:
        """Return True if a file begins with the numbers of the format and of its system."""
        return head[:2] == b"\x7b\x01"

    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        self._pings: dict[int, list[tuple[int, int]]] = {}
        self._rows = 0
        return self._scan(self._read_header(), self._packet, _MAGIC)

    def _read_header(self) -> int:
        """Read the file header; return the offset of the first packet."""
        content = self._bytes(0, min(_HEADER, self._size)).ljust(_HEADER, b"\0")
        self._head = records(content, layouts.FILE, 0)[0]
        count = int(self._head["sonar_channels"]) + int(self._head["bathymetry_channels"])
        size = _HEADER
        if content[0] != 0x7B or count > _MOST_CHANNELS:
            self._omit(0, f"the file header is damaged: format {content[0]}, {count} channels")
            count = _CHANNELS_IN_HEADER
        if count > _CHANNELS_IN_HEADER:
            size = -(-(layouts.FILE.itemsize + count * layouts.CHANNEL.itemsize) // _HEADER) * _HEADER
            content = self._bytes(0, min(size, self._size)).ljust(size, b"\0")
        self._channels = records(content, layouts.CHANNEL, layouts.FILE.itemsize, count)
        return min(size, self._size)

    def _packet(self, offset: int) -> tuple[int, str, float]:
        """Length, kind and time of the packet at an offset; its channels are listed."""
        head = self._bytes(offset, min(layouts.PING.itemsize, max(self._size - offset, layouts.PACKET.itemsize)))
        packet = records(head, layouts.PACKET, 0)[0]
        size, kind = int(packet["size"]), _KINDS.get(int(packet["kind"]), f"TYPE_{packet['kind']}")
        if packet["magic"] != 0xFACE:
            raise DatagramError("no packet begins here")
        if size < layouts.PACKET.itemsize or offset + size > self._size:
            raise DatagramError(f"{kind}: {size} bytes are stated, and the file has {self._size - offset} more")
        channels: list[tuple[int, int]] = []
        used = size
        if kind == "SONAR":
            ping = records(head, layouts.PING, 0)[0]
            channels, used = self._ping_channels(offset, size, int(ping["channels"]))
        follows = offset + size == self._size or self._bytes(offset + size, 1) == b"\xce"
        if not follows and (kind != "SONAR" or size - used >= _PADDING or any(self._bytes(offset + used, size - used))):
            raise DatagramError(f"{kind}: no packet follows at its end, {size} bytes further on")
        for channel, at in channels:
            self._pings.setdefault(channel, []).append((self._rows, at))
        self._rows += 1
        return size, kind, _packet_time(head[:size], kind)

    def _ping_channels(self, offset: int, size: int, count: int) -> tuple[list[tuple[int, int]], int]:
        """Channels of a sonar packet with the offsets of their headers in it, and the bytes that they take."""
        channels, at = [], layouts.PING.itemsize
        for position in range(count):
            if at + layouts.PING_CHANNEL.itemsize > size:
                raise DatagramError(f"SONAR: {count} channels are stated, and {position} fit in {size} bytes")
            header = records(self._bytes(offset + at, layouts.PING_CHANNEL.itemsize), layouts.PING_CHANNEL, 0)[0]
            channel = int(header["channel"]) if header["channel"] < self._channels.size else position
            if channel >= self._channels.size:
                raise DatagramError(f"SONAR: channel {channel}, and the file has {self._channels.size}")
            channels.append((channel, at))
            at += layouts.PING_CHANNEL.itemsize + int(header["samples"]) * int(self._channels["sample_size"][channel])
        if at > size:
            raise DatagramError(f"SONAR: samples are stated up to byte {at} of {size}")
        return channels, at

    @cached_property
    def instrument(self) -> Instrument:
        """Maker and model as the file names them."""
        maker = next((name for name, numbers in _MAKERS.items() if self._head["sonar_type"] in numbers), "")
        return Instrument(maker, text_of(self._head["sonar"]))

    @cached_property
    def groups(self) -> Mapping[str, int]:
        """Number of pings of each channel, and of soundings."""
        counts = {name: len(self._pings[channel]) for name, channel in self._names.items()}
        count = self.datagrams.rows("Q_MULTIBEAM").size
        return counts | ({"soundings": int(count)} if count else {})

    @cached_property
    def _names(self) -> dict[str, int]:
        """Channels by name: the side, with the frequency or the number where several have one side."""
        sides = {number: _SIDES.get(int(self._channels["kind"][number]), "channel") for number in sorted(self._pings)}
        names: dict[str, int] = {}
        for number, side in sides.items():
            alone = list(sides.values()).count(side) == 1
            name = side if alone else f"{side} {_hertz(self._channels['frequency'][number]) / 1e3:g} kHz"
            names[name if name not in names else f"{name} {number}"] = number
        return names

    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Read pings of one channel; amplitudes [counts] over (ping, sample), port too from near to far."""
        self._require_group(group)
        if group == "soundings":
            return self._soundings(pings)
        channel = self._names[group]
        about, parsed = self._channels[channel], list[Any]()
        requested = list(enumerate(self._pings[channel]))[pings]
        if (kind := _TYPES.get((int(about["sample_size"]), int(about["sample_format"])))) is None:
            self._omit(
                0, f"{group}: samples of {about['sample_size']} bytes, format {about['sample_format']}, not read"
            )
            requested = []
        for number, (row, at) in requested:
            for _, content in self._parsed([row], lambda content: content):
                header = records(content, layouts.PING_CHANNEL, at)[0]
                count, start = int(header["samples"]), at + layouts.PING_CHANNEL.itemsize
                values = np.frombuffer(content, kind or "u1", count, start).astype(np.float32)
                values = values[::-1] if about["kind"] == _PORT else values
                parsed.append((number, row, records(content, layouts.PING, 0)[0], header, values))
        numbers, rows, heads, headers, samples = ([part[field] for part in parsed] for field in range(5))
        if parsed:
            require_memory(self.path, len(parsed), max(part.size for part in samples))
        columns = variables(heads, _SINGLE, ("ping",)) | variables(headers, _CHANNEL, ("ping",))
        columns |= self._ping_settings(about, heads, headers)
        filled = stacked(samples) if parsed else np.empty((0, 0), np.float32)
        columns["amplitude"] = variable(("ping", "sample"), filled, "1", "amplitude in counts as recorded, near to far")
        dataset = ping_dataset(group, numbers, self.datagrams.time[rows], columns)
        return dataset.assign_attrs(range="ground" if about["correction"] == 2 else "slant")

    def _soundings(self, pings: slice) -> xr.Dataset:
        """Soundings of the packets that QINSy writes, over (ping, beam)."""
        rows = self.datagrams.rows("Q_MULTIBEAM")
        parsed = list(self._parsed(rows[pings], _multibeam))
        heads = [head for _, (head, _) in parsed]
        columns = variables([beams for _, (_, beams) in parsed], _BEAM, ("ping", "beam"))
        columns |= variables(heads, _SINGLE, ("ping",))
        speed = np.array([_two_way(float(head["sound_speed"])) for head in heads])
        columns["sound_speed"] = variable(
            "ping", speed, "m/s", "sound speed, twice the stated one where that is one-way"
        )
        kept = [row for row, _ in parsed]
        return ping_dataset("soundings", np.searchsorted(rows, kept), self.datagrams.time[kept], columns)

    def _ping_settings(self, about: Any, heads: list[Any], headers: list[Any]) -> dict[str, xr.Variable]:
        """Position, sound speed, frequency and sample interval of each ping."""
        settings = _without_zeros(variables(heads, self._position_columns, ("ping",)), self._position_columns)
        speed = np.array([_two_way(float(head["sound_speed"])) for head in heads])
        frequency = np.array([_hertz(header["frequency"] or about["frequency"]) for header in headers])
        counts = np.array([max(int(header["samples"]), 1) for header in headers])
        with np.errstate(all="ignore"):
            duration = np.array([float(header["time_duration"]) for header in headers])
            ranges = np.array([float(header["slant_range"]) for header in headers])
            interval = np.where(duration > 0, duration, 2 * ranges / speed) / counts
        return settings | {
            "sound_speed": variable("ping", speed, "m/s", "sound speed, twice the stated one where that is one-way"),
            "frequency": variable("ping", frequency, "Hz", "centre frequency"),
            "sample_interval": variable("ping", interval, "s", "time between samples"),
        }

    @property
    def _position_columns(self) -> tuple[Column, ...]:
        return _GRID_POSITION if self._head["navigation_units"] == 0 else _POSITION

    def settings(self) -> tuple[Setting, ...]:
        """Values of the file header: program, sonar, mounting, and those of each channel."""
        source = ("file header", 0)
        settings = list(record_settings(self._head, _FILE_SETTINGS, source))
        for number, channel in enumerate(self._channels):
            settings += record_settings(channel, _CHANNEL_SETTINGS, source, f"channel {number} ")
        return tuple(settings)

    def navigation(self) -> xr.Dataset | None:
        """Position over time: of navigation packets, else of the sonar in its pings, NaN where there is none."""
        for kind, part in (("POS_RAW_NAVIGATION", layouts.RAW_POSITION), ("NAVIGATION", layouts.NAVIGATION),
                           ("SONAR", layouts.PING)):  # fmt: skip
            if (series := self._series(kind, part, self._position_columns)) is not None:
                return series.assign(_without_zeros(dict(series.variables), self._position_columns))
        return None

    def attitude(self) -> xr.Dataset | None:
        """Attitude over time: of attitude packets, else of the sonar in its pings."""
        for kind, part in (("ATTITUDE", layouts.ATTITUDE), ("POS_RAW_NAVIGATION", layouts.RAW_POSITION),
                           ("SONAR", layouts.PING)):  # fmt: skip
            if (series := self._series(kind, part, (*_ATTITUDE, _YAW))) is not None:
                return series
        return None

    def _series(self, kind: str, part: np.dtype[Any], columns: tuple[Column, ...]) -> xr.Dataset | None:
        parsed = list(self._parsed(self.datagrams.rows(kind), lambda content: records(content, part, 0)))
        return time_dataset([table for _, table in parsed], self.datagrams.time[[row for row, _ in parsed]], columns)


def _multibeam(content: bytes) -> tuple[Any, NDArray[Any]]:
    """Header and beams of a packet of soundings."""
    head, size = records(content, layouts.PING, 0)[0], layouts.MULTIBEAM_BEAM.itemsize
    count = min((len(content) - layouts.PING.itemsize) // size, int(head["channels"]))  # the rest is padding
    return head, records(content, layouts.MULTIBEAM_BEAM, layouts.PING.itemsize, count)


def _packet_time(head: bytes, kind: str) -> float:
    """Seconds since 1970 of a packet, NaN where it states no time."""
    part = {
        "ATTITUDE": layouts.ATTITUDE, "NAVIGATION": layouts.NAVIGATION, "POS_RAW_NAVIGATION": layouts.RAW_POSITION,
        "SONAR": layouts.PING, "Q_MULTIBEAM": layouts.PING,
    }.get(kind)  # fmt: skip
    if part is None or len(head) < part.itemsize:
        return np.nan
    fields = records(head, part, 0)[0]
    names = part.names or ()
    if "epoch" in names and fields["epoch"]:
        return float(fields["epoch"]) + float(fields["microseconds"]) * 1e-6
    fractions = {"hundredths": 1e-2, "milliseconds": 1e-3, "tenths": 1e-4}
    below = sum(float(fields[name]) * step for name, step in fractions.items() if name in names)
    year, month, day, hour, minute = (int(fields[name]) for name in ("year", "month", "day", "hour", "minute"))
    try:
        whole = datetime(year, month, day, hour, minute, tzinfo=UTC)
    except ValueError:
        return np.nan
    return whole.timestamp() + float(fields["second"]) + below


def _without_zeros(variables_read: Mapping[Any, xr.Variable], columns: Sequence[Column]) -> dict[str, xr.Variable]:
    """Positions, NaN where both coordinates are zero, which a file without a position has."""
    first, second = (variables_read[column.name] for column in columns)
    somewhere = (first.values != 0) | (second.values != 0)
    return {
        c.name: variables_read[c.name].copy(data=np.where(somewhere, variables_read[c.name].values, np.nan))
        for c in columns
    }


def _hertz(frequency: float) -> float:
    """Frequency [Hz] of a number that is kHz in most files, and Hz in some."""
    return float(frequency) * (1e3 if frequency < 5000 else 1.0)


def _two_way(speed: float) -> float:
    """Sound speed [m/s] of a number that many programs halve."""
    return 2 * speed if 0 < speed < 1000 else speed
