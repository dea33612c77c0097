"""eXtended Triton Format (XTF): sidescan and sub-bottom channels with navigation and attitude.

Triton Imaging (2016), XTF file format, rev. X41: section 2.3.1 (order of samples), tables C-I, P and S (fields; 0 where
a program states no value), 4.1-4.3 (versions, padding, numbers of samples). The format has no checksum: a packet is
taken where its samples and the next packet agree with its length. Port channels are stored from far to near, and are
turned round on reading. Speeds are in knots; many programs write half the sound speed ("one way"), which is doubled.
Samples of sub-bottom channels are signed where they are stated to be polar. Weights are those of EdgeTech's block
floating point: a sample is its count over 2 to the power of the weight.
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
_BUGGY_VERSIONS = range(303, 313)
"""Versions of Isis that pad each channel to a multiple of 64 bytes; section 4.1."""
_WEIGHTED = (24, 35, 38, 48)
"""Types of sonars whose samples have a weight; table I."""
_KINDS = {
    0: "SONAR", 1: "NOTES", 2: "BATHY", 3: "ATTITUDE", 4: "FORWARD", 5: "ELAC", 6: "RAW_SERIAL", 7: "EMBED_HEAD",
    8: "HIDDEN_SONAR", 9: "SEAVIEW_PROCESSED_BATHY", 10: "SEAVIEW_DEPTHS", 11: "RSVD_HIGHSPEED_SENSOR",
    12: "ECHOSTRENGTH", 13: "GEOREC", 14: "KLEIN_RAW_BATHY", 15: "HIGHSPEED_SENSOR", 16: "ELAC_XSE", 17: "BATHY_XYZA",
    18: "K5000_BATHY_IQ", 19: "BATHY_SNIPPET", 20: "GPS", 21: "STAT", 22: "SINGLE_BEAM", 23: "GYRO", 24: "TRACKPOINT",
    25: "MULTIBEAM", 26: "Q_SINGLEBEAM", 27: "Q_MULTITX", 28: "Q_MULTIBEAM", 42: "NAVIGATION", 50: "TIME",
    60: "BENTHOS_CAATI_SARA", 61: "RESON_7125", 62: "RESON_7125_SNIPPET", 65: "Q_R2SONIC_BATHY", 66: "Q_R2SONIC_FTS",
    67: "R2SONIC_TRUEPIX", 68: "R2SONIC_BATHY", 69: "R2SONIC_FTS", 70: "CODA_ECHOSCOPE_DATA",
    71: "CODA_ECHOSCOPE_CONFIG", 72: "CODA_ECHOSCOPE_IMAGE", 73: "EDGETECH_4600", 78: "RESON_7018_WATERCOLUMN",
    84: "SOURCETIME_GYRO", 100: "POSITION", 102: "BATHY_PROC", 103: "ATTITUDE_PROC", 104: "SINGLEBEAM_PROC",
    105: "AUX_PROC", 106: "KLEIN3000_DATA_PAGE", 107: "POS_RAW_NAVIGATION", 108: "KLEINV4_DATA_PAGE", 199: "CUSTOM",
    200: "USERDEFINED",
}  # fmt: skip
_MAKERS = {
    "Klein": (5, 9, 14, 32, 57, 58, 60, 66), "EdgeTech": (7, 10, 23, 24, 35, 38, 43, 56), "CMAX": (36, 51),
    "Benthos": (34, 37, 39, 40, 41, 42), "Kongsberg": (48, 59), "Reson": (8, 15, 46), "GeoAcoustics": (30, 50),
}  # fmt: skip
"""Numbers of the types of sonars of each maker."""
_SIDES = {0: "sub-bottom", 1: "port", 2: "starboard", 3: "bathymetry"}
_SUB_BOTTOM, _PORT = 0, 1
_TYPES = {(1, 0): "u1", (2, 0): "<u2", (4, 0): "<u4", (4, 2): "<i4", (2, 3): "<u2", (4, 5): "<f4", (1, 8): "u1"}
"""Types of samples by their size and stated format."""
_SINGLE = (
    Column("ping_number", "ping", "code", "number of the ping in the instrument"),
    Column("altitude", "altitude", "m", "height of the sonar above the seabed", missing=0.0),
    Column("sensor_depth", "sensor_depth", "m", "depth of the sonar"),
    Column("speed", "speed", "m/s", "speed of the sonar", _KNOT),
    Column("heading", "heading", "rad", "heading of the sonar", DEGREE),
    Column("roll", "roll", "rad", "roll, positive starboard down", DEGREE),
    Column("pitch", "pitch", "rad", "pitch, positive bow up", DEGREE),
    Column("heave", "heave", "m", "heave, positive down", -1.0),
    Column("layback", "layback", "m", "horizontal distance of the sonar behind the position, 0 if it is the sonar's"),
)
_CHANNEL = (
    Column("slant_range", "slant_range", "m", "range of the last sample"),
    Column("time_delay", "time_delay", "s", "time of the first sample"),
    Column("ping_interval", "ping_interval", "s", "time between pings as stated", missing=0.0),
    Column("gain_code", "gain", "code", "gain as the sonar codes it"),
    Column("initial_gain_code", "initial_gain", "code", "initial gain as the sonar codes it"),
    Column("processing", "processing", "code", "processing applied, 4 time-varying gain, 8 beam angle, 16 filter"),
    Column("weight", "weight", "code", "weight of the samples as the sonar states it"),
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
    Column("beam_angle", "beam_angle", "rad", "beam angle, positive to starboard", DEGREE),
    Column("tilt", "tilt", "rad", "steering of the transmitter, positive forward", DEGREE),
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
    Column("frequency as stated", "frequency", "1", "", missing=0.0),
    Column("volts at full scale", "volts", "V", "", missing=0.0),
    Column("bytes of a sample", "sample_size", "code", ""),
    Column("correction", "correction", "code", ""),
    *(Column(axis, axis, "m", "") for axis in ("forward", "starboard", "down")),
    *(Column(angle.replace("_", " "), angle, "rad", "", DEGREE)
      for angle in ("tilt", "yaw", "pitch", "roll")),
    *(Column(width.replace("_", " "), width, "rad", "", DEGREE, 0.0)
      for width in ("along_beam_width", "across_beam_width")),
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
            at += layouts.PING_CHANNEL.itemsize
            length = self._sample_count(header, channel) * int(self._channels["sample_size"][channel])
            at += -(-length // _PADDING) * _PADDING if self._is_padded else length
        if at > size:
            raise DatagramError(f"SONAR: samples are stated up to byte {at} of {size}")
        return channels, at

    @cached_property
    def _is_padded(self) -> bool:
        version = text_of(self._head["version"])
        return version.isdecimal() and int(version) in _BUGGY_VERSIONS

    def _sample_count(self, header: Any, channel: int) -> int:
        """Samples of a channel of a ping; files of before 1998 state them in the file header."""
        return int(header["samples"] or self._channels["samples"][channel])

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
            frequency = _hertz(self._channels["frequency"][number]) / 1e3
            name = side if alone or np.isnan(frequency) else f"{side} {frequency:g} kHz"
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
        kind = _TYPES.get((int(about["sample_size"]), int(about["sample_format"])))
        if about["kind"] == _SUB_BOTTOM and about["unipolar"] == 0 and kind is not None:
            kind = kind.replace("u", "i")  # an envelope has no sign, whatever a program states
        if kind is None:
            self._omit(
                0, f"{group}: samples of {about['sample_size']} bytes, format {about['sample_format']}, not read"
            )
            requested = []
        for number, (row, at) in requested:
            for _, content in self._parsed([row], lambda content: content):
                header = records(content, layouts.PING_CHANNEL, at)[0]
                count, start = self._sample_count(header, channel), at + layouts.PING_CHANNEL.itemsize
                values = np.frombuffer(content, kind or "u1", count, start).astype(np.float32)
                values = values[::-1] if about["kind"] == _PORT else values
                if self._head["sonar_type"] in _WEIGHTED:
                    with np.errstate(all="ignore"):  # a damaged number may be any
                        values = np.ldexp(values, -int(header["weight"]))
                parsed.append((number, row, records(content, layouts.PING, 0)[0], header, values))
        numbers, rows, heads, headers, samples = ([part[field] for part in parsed] for field in range(5))
        if parsed:
            require_memory(self.path, len(parsed), max(part.size for part in samples))
        columns = variables(heads, _SINGLE, ("ping",)) | variables(headers, _CHANNEL, ("ping",))
        columns |= self._ping_settings(channel, heads, headers)
        filled = stacked(samples) if parsed else np.empty((0, 0), np.float32)
        columns["amplitude"] = variable(
            ("ping", "sample"), filled, "1", "amplitude in counts, weight included, near to far"
        )
        dataset = ping_dataset(group, numbers, self.datagrams.time[rows], columns)
        return dataset.assign_attrs(range="ground" if about["correction"] == 2 else "slant")

    def _soundings(self, pings: slice) -> xr.Dataset:
        """Soundings of the packets that QINSy writes, over (ping, beam)."""
        rows = self.datagrams.rows("Q_MULTIBEAM")
        parsed = list(self._parsed(rows[pings], _multibeam))
        heads = [head for _, (head, _) in parsed]
        columns = variables([beams for _, (_, beams) in parsed], _BEAM, ("ping", "beam"))
        columns |= variables(heads, _SINGLE, ("ping",))
        speed = np.array([_sound_speed(head) for head in heads])
        columns["sound_speed"] = variable(
            "ping", speed, "m/s", "sound speed, twice the stated one where that is one-way"
        )
        kept = [row for row, _ in parsed]
        return ping_dataset("soundings", np.searchsorted(rows, kept), self.datagrams.time[kept], columns)

    def _ping_settings(self, channel: int, heads: list[Any], headers: list[Any]) -> dict[str, xr.Variable]:
        """Position, sound speed, frequency and sample interval of each ping."""
        settings = _without_zeros(variables(heads, self._position_columns, ("ping",)), self._position_columns)
        speed = np.array([_sound_speed(head) for head in heads])
        frequency = np.array(
            [_hertz(header["frequency"] or self._channels["frequency"][channel]) for header in headers]
        )
        counts = np.array([max(self._sample_count(header, channel), 1) for header in headers])
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
    if kind == "NAVIGATION":  # those of an attitude belong to the epoch
        fractions = {"microseconds": 1e-6}
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
    """Frequency [Hz] of a number that is kHz in most files, and Hz in some; NaN where it is 0."""
    return float(frequency) * (1e3 if frequency < 5000 else 1.0) if frequency else np.nan


def _sound_speed(head: Any) -> float:
    """Sound speed [m/s] of a ping header: stated, and doubled where it is one-way; else computed; else NaN."""
    speed = float(head["sound_speed"]) or float(head["computed_sound_speed"])
    return (2 * speed if 0 < speed < 1000 else speed) or np.nan
