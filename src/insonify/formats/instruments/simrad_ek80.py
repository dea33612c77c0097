"""Simrad EK80 .raw: complex samples of the sectors of split-beam echosounders, with their settings.

Kongsberg (2023), EK80 on-line help, "Interface" (file formats 1.20 to 1.25). FIL1 has two bytes between stage and
channel, as files of format 1.23 have them; the help lists three. NME1 of an EA640 (Kongsberg 413763, cited by echopype)
has 32 characters of a port before the sentence. A datagram opens and closes with its length; it has no checksum, so
that a change of its content is noticed only where sizes contradict one another. Samples are voltages of each transducer
sector, filtered and decimated by filters that the file states; `processing.split_beam` turns them into power, levels
and angles.
"""

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.etree import ElementTree

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments import simrad_xml
from insonify.formats.instruments.columns import DEGREE, Column, ping_dataset, time_dataset, variable
from insonify.formats.instruments.instrument_file import (
    DatagramError,
    Instrument,
    InstrumentFile,
    LeverArm,
    Setting,
    records,
    require_memory,
)
from insonify.formats.instruments.km_binary import without_invalid
from insonify.formats.instruments.nmea import Fix, position
from insonify.formats.instruments.simrad_xml import Channel, number, numbers, parse_xml

_KIND, _OPENING = re.compile(rb"[A-Z]{3}[0-9]"), re.compile(rb"XML0.{8}<\?xml|<Configuration>", re.DOTALL)
_ROOT = re.compile(rb"<([A-Za-z]+)")
_CHANNEL = re.compile(rb'ChannelID="([^"]*)"')
_PEEK = 720
"""Bytes of a datagram that are read for the index."""
_HEAD, _SAMPLE_HEAD, _FILTER_HEAD = 16, 156, 152
"""Bytes before the text, the samples and the filter coefficients, from the length on."""
_POWER, _ANGLES, _HALF, _SINGLE = 1, 2, 4, 8
"""Bits of the type of data: power, electrical angles, complex samples of half or single precision."""
TRANSMITTED = ", transmitted"
"""Ending of the names of groups with transmitted pulses, which have the form of echoes."""
POWER_DB = 10 * np.log10(2) / 256
"""Step of recorded power [dB]."""
_UNIX_EPOCH = 116_444_736_000_000_000  # steps of 100 ns from 1601
_KINDS = {
    "XML0 Configuration": "transceivers and transducers", "XML0 InitialParameter": "settings at the start",
    "XML0 Environment": "water", "XML0 Parameter": "settings of a ping", "XML0 PingSequence": "order of pings",
    "XML0 Sensor": "manual value of a sensor", "XML0 Filter": "receiver filter of a current profiler",
    "FIL1": "receiver filter", "RAW3": "samples", "RAW4": "transmitted pulse",
    "NME0": "NMEA sentence, of which positions are read", "NME1": "NMEA sentence, with its port", "MRU0": "attitude",
    "MRU1": "attitude", "TAG0": "annotation", "IDX0": "index of pings", "BOT0": "bottom",
}  # fmt: skip
_PORT = 32  # bytes of the port of a sentence of NME1
_MOTION = np.dtype([(name, "<f4") for name in ("heave", "roll", "pitch", "yaw")])
_KM_BINARY = np.dtype(
    {"names": ["mark", "status", "roll", "pitch", "yaw", "heave"], "formats": ["S4", "<u4", *4 * ["<f4"]],
     "offsets": [0, 16, 40, 44, 48, 52], "itemsize": 56}
)  # fmt: skip
_ATTITUDE = (
    Column("roll", "roll", "rad", "roll, positive starboard down", DEGREE),
    Column("pitch", "pitch", "rad", "pitch, positive bow up", DEGREE),
    Column("yaw", "yaw", "rad", "heading", DEGREE),
    Column("heave", "heave", "m", "heave, positive down"),
)


@dataclass(frozen=True, slots=True)
class _Samples:
    """Header of the samples of one ping, and the datagrams in force."""

    channel: str
    contents: int
    """Bits of the type of data; the number of sectors in bits 8 to 10."""
    first: int
    samples: int
    parameter: int
    """Offset of the parameters of the ping, -1 where there are none."""
    environment: int
    filters: tuple[int, ...]

    @property
    def sectors(self) -> int:
        """Number of sectors with complex samples."""
        return self.contents >> 8 & 7 if self.contents & (_HALF | _SINGLE) else 0

    @property
    def size(self) -> int:
        """Bytes of the samples."""
        real = 2 * bool(self.contents & _POWER) + 2 * bool(self.contents & _ANGLES)
        return self.samples * (real + self.sectors * (8 if self.contents & _SINGLE else 4))


class SimradEk80File(InstrumentFile):
    """Pings of the channels of an EK80, a group for each channel."""

    format = "Simrad EK80"
    suffixes = (".raw",)
    kinds = _KINDS
    unread = frozenset(
        {"XML0 InitialParameter", "XML0 PingSequence", "XML0 Sensor", "XML0 Filter", "TAG0", "IDX0", "BOT0"}
    )

    @staticmethod
    def matches(head: bytes) -> bool:
        """Return True if a file may be of this format, by its first 2048 bytes."""
        return _OPENING.search(head) is not None

    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        self._samples: dict[int, _Samples] = {}
        self._last_xml: tuple[int, ElementTree.Element | None] = (-1, None)
        latest: dict[tuple[str, str], int] = {}
        offset = 0
        while offset < self._size:
            try:
                size, kind, time, head = self._framed(offset)
            except DatagramError as fault:
                self._omit(offset, str(fault))
                offset = self._next(offset + 1)
                continue
            try:
                yield offset, size, self._noted(offset, size, kind, head, latest), time
            except DatagramError as fault:
                self._omit(offset, f"{kind}: {fault}")
            offset += size

    def _framed(self, offset: int) -> tuple[int, str, float, bytes]:
        """Size with both lengths, kind, time and first bytes of a datagram with sound lengths."""
        head = self._bytes(offset, min(_PEEK, self._size - offset))
        if len(head) < _HEAD + 4 or not _KIND.fullmatch(head[4:8]):
            raise DatagramError("no datagram of a known kind")
        length, _, ticks = struct.unpack_from("<I4sQ", head)
        kind = head[4:8].decode("ascii")
        if length < _HEAD - 4:
            raise DatagramError(f"{kind}: a length of {length} bytes, less than its header")
        if self._bytes(offset + 4 + length, 4) != head[:4]:
            raise DatagramError(f"{kind}: the lengths before and after it differ")
        return length + 8, kind, (ticks - _UNIX_EPOCH) * 1e-7, head[: length + 4]

    def _next(self, offset: int) -> int:
        """Offset of the next datagram with sound lengths, the size of the file where there is none."""
        while (candidate := self._find(_KIND, offset + 4)) < self._size:
            offset = candidate - 4
            try:
                self._framed(offset)
            except DatagramError:
                offset += 1
                continue
            return offset
        return self._size

    def _noted(self, offset: int, size: int, kind: str, head: bytes, latest: dict[tuple[str, str], int]) -> str:
        """Kind of a datagram for the index; its values of a ping are stored."""
        if kind == "XML0":
            root = _ROOT.search(head, _HEAD)
            name = root[1].decode("ascii") if root else "text"
            whole = head if size <= _PEEK else self._bytes(offset, size)
            for channel in (name == "Parameter" and _CHANNEL.findall(whole)) or [b""]:
                latest[name, channel.decode("utf-8", "replace")] = offset
            return f"XML0 {name}"
        if kind == "FIL1":
            stage = int(records(head, np.dtype("<i2"), _HEAD)[0])
            latest[f"filter {stage}", _text(head[20:148])] = offset
        if kind in ("RAW3", "RAW4"):
            contents, _, first, count = struct.unpack_from("<HHii", records(head, np.dtype("V12"), 144)[0].tobytes())
            name = _text(head[_HEAD:144])
            parameter, environment = latest.get(("Parameter", name), -1), latest.get(("Environment", ""), -1)
            filters = tuple(latest[part, name] for part in ("filter 1", "filter 2") if (part, name) in latest)
            samples = _Samples(name, contents, first, count, parameter, environment, filters)
            if count < 0 or first < 0 or samples.size > size - _SAMPLE_HEAD - 4:
                raise DatagramError(f"{count} samples of type {contents:#x} do not fit its {size} bytes")
            self._samples[offset] = samples
        return kind

    @cached_property
    def _configuration(self) -> tuple[int, ElementTree.Element | None]:
        """Offset and root of the first configuration that can be read, -1 and None without."""
        for row, root in self._parsed(self.datagrams.rows("XML0 Configuration"), _xml):
            return int(self.datagrams.offset[row]), root
        return -1, None

    @cached_property
    def _channels(self) -> Mapping[str, Channel]:
        root = self._configuration[1]
        return {} if root is None else simrad_xml.channels(root)

    @cached_property
    def _rows(self) -> Mapping[str, NDArray[np.int64]]:
        """Rows of the pings of each group, by ascending nominal frequency; transmitted pulses behind the echoes."""
        pulses = {f"{name}{TRANSMITTED}": rows for name, rows in self._rows_of("RAW4").items()}
        return self._rows_of("RAW3") | pulses

    def _rows_of(self, kind: str) -> dict[str, NDArray[np.int64]]:
        rows: dict[str, list[int]] = {}
        for row in self.datagrams.rows(kind):
            rows.setdefault(self._samples[int(self.datagrams.offset[row])].channel, []).append(int(row))
        known = {name: channel.frequency for name, channel in self._channels.items() if channel.frequency > 0}
        ordered = sorted((name for name in known if name in rows), key=lambda name: known[name])
        named: dict[str, NDArray[np.int64]] = {}
        for name in (*ordered, *(name for name in rows if name not in known)):
            title = f"{known[name] / 1e3:g} kHz" if name in known else name or "channel"
            named[f"{title}, {name}" if title in named else title] = np.array(rows[name])
        return named

    @property
    def groups(self) -> Mapping[str, int]:
        """Number of pings of each group of data."""
        return {name: len(rows) for name, rows in self._rows.items()}

    @property
    def instrument(self) -> Instrument:
        """Maker, model and serial numbers of the transceivers."""
        root = self._configuration[1]
        header = None if root is None else root.find("Header")
        model = "EK80" if header is None else header.get("ApplicationName", "EK80")
        serials = dict.fromkeys(channel.transceiver.get("SerialNumber", "") for channel in self._channels.values())
        return Instrument("Simrad", model, ", ".join(serials))

    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Read pings of one channel.

        Args:
            group: One of `groups`, such as "38 kHz".
            pings: Some of its pings.

        Returns:
            `voltage` over (ping, sector, sample) where the file has complex samples; `power_db` over (ping, sample),
            `phase_alongship` and `phase_athwartship` where it has power or angles; the settings of each ping, of the
            water, the transceiver and the transducer; the filters in force at the first ping.

        Raises:
            StoreError: There is no such group, or the pings need more memory than is allowed.
        """
        chosen = range(self._require_group(group))[pings]
        rows = self._rows[group][pings]
        heads = {int(row): self._samples[int(self.datagrams.offset[row])] for row in rows}
        sectors, samples = (
            max((getattr(h, part) for h in heads.values()), default=0) for part in ("sectors", "samples")
        )
        require_memory(self.path, len(rows), max(2 * sectors, 1), samples)
        number_of = dict(zip(heads, chosen, strict=True))
        read_pings = [(row, _values(heads[row], content)) for row, content in self._parsed(rows, bytes)]
        columns = _sample_variables([values for _, values in read_pings], sectors, samples)
        kept = [row for row, _ in read_pings]
        columns |= self._ping_variables([heads[row] for row in kept])
        if kept:
            columns |= self._channel_variables(heads[kept[0]])
        dataset = ping_dataset(group, [number_of[row] for row in kept], self.datagrams.time[kept], columns)
        dataset.attrs["channel"] = next((heads[row].channel for row in kept), "")
        return dataset

    def _ping_variables(self, heads: list[_Samples]) -> dict[str, xr.Variable]:
        """Settings of each ping: pulse, samples and water."""
        table: dict[str, list[float]] = {name: [] for name in (*_PULSE, *simrad_xml.ENVIRONMENT)}
        for head in heads:
            values = self._pulse(head)
            root = self._root(head.environment)
            water = {} if root is None else root.attrib
            values |= {name: number(water, field) for name, (field, _, _) in simrad_xml.ENVIRONMENT.items()}
            if not values["sound_speed"] > 0:
                values["sound_speed"] = values["environment_sound_speed"]
            values["range_step"] = values["sample_interval"] * values["sound_speed"] / 2
            values["first_range"] = values["range_step"] * head.first
            for name, column in table.items():
                column.append(values[name])
        about = _PULSE | {name: (unit, text) for name, (_, unit, text) in simrad_xml.ENVIRONMENT.items()}
        return {name: variable("ping", np.array(column, float), *about[name]) for name, column in table.items()}

    def _pulse(self, head: _Samples) -> dict[str, float]:
        """Parameters of one ping, NaN where the file does not state them."""
        root = self._root(head.parameter)
        stated = {} if root is None else simrad_xml.parameters(root, head.channel)
        swept = number(stated, "PulseForm") > 0
        tone = number(stated, "Frequency")
        duration = number(stated, "PulseDuration" if "PulseDuration" in stated else "PulseLength")  # before 2018
        values = {
            "frequency_start": number(stated, "FrequencyStart") if swept else tone,
            "frequency_end": number(stated, "FrequencyEnd") if swept else tone,
            "frequency": (number(stated, "FrequencyStart") + number(stated, "FrequencyEnd")) / 2 if swept else tone,
            "pulse_length": duration,
            "swept": float(swept),
            "slope": number(stated, "Slope"),
            "transmit_power": number(stated, "TransmitPower"),
            "channel_mode": number(stated, "ChannelMode"),
            "sample_interval": number(stated, "SampleInterval"),
            "sound_speed": number(stated, "SoundVelocity"),
            "gain_db": np.nan,
            "sa_correction_db": np.nan,
        }
        if (channel := self._channels.get(head.channel)) is not None:
            values["gain_db"] = channel.by_pulse("Gain", duration, swept=swept)
            values["sa_correction_db"] = channel.by_pulse("SaCorrection", duration, swept=swept)
        return values

    def _channel_variables(self, head: _Samples) -> dict[str, xr.Variable]:
        """Constants of a channel, its calibration over frequency and its filters."""
        columns: dict[str, xr.Variable] = {}
        for offset in head.filters:
            try:
                stage, decimation, coefficients = _filter(self._datagram(offset))
            except DatagramError as fault:
                self._omit(offset, f"FIL1: {fault}")
                continue
            columns[f"filter_{stage}"] = variable(f"tap_{stage}", coefficients, "1", f"receiver filter, stage {stage}")
            columns[f"filter_{stage}"].attrs["decimation"] = decimation
        channel = self._channels.get(head.channel)
        if channel is None:
            return columns
        for name, (source, field, unit, scale, text) in _CONSTANTS.items():
            columns[name] = variable((), scale * number(getattr(channel, source), field), unit, text)
        if not columns["receiver_sample_rate"] > 0:
            kind = channel.transceiver.get("TransceiverType", "")
            columns["receiver_sample_rate"].values = np.array(simrad_xml.SAMPLE_RATES.get(kind, np.nan))
        table = channel.calibration()
        for name, values in table.items():
            unit, text = ("Hz", "frequency") if name not in simrad_xml.CALIBRATION else (
                simrad_xml.CALIBRATION[name][1], simrad_xml.CALIBRATION[name][3]
            )  # fmt: skip
            title = name if name == "calibration_frequency" else f"calibrated_{name}"
            columns[title] = variable("calibration_frequency", values, unit, f"{text}, over frequency")
        return columns

    def _datagram(self, offset: int) -> bytes:
        """Datagram at an offset of the index."""
        row = int(np.searchsorted(self.datagrams.offset, offset))
        return self._bytes(offset, int(self.datagrams.size[row]))

    def _root(self, offset: int) -> ElementTree.Element | None:
        """Root of the XML at an offset, None where there is none or it cannot be read."""
        if offset >= 0 and self._last_xml[0] != offset:
            try:
                self._last_xml = offset, _xml(self._datagram(offset))
            except DatagramError as fault:
                self._omit(offset, f"XML0: {fault}")
                self._last_xml = offset, None
        return self._last_xml[1] if offset >= 0 else None

    def settings(self) -> tuple[Setting, ...]:
        """Fields of the configuration by group, and of the first environment."""
        offset = self._configuration[0]
        names = {self._channel_of(int(rows[0])): group for group, rows in self._rows_of("RAW3").items()}
        settings = []
        for name, channel in self._channels.items():
            settings += simrad_xml.channel_settings(names.get(name, name), channel, offset)
        for row, root in self._parsed(self.datagrams.rows("XML0 Environment")[:1], _xml):
            settings += [
                Setting(name, number(root.attrib, field), unit, "XML0 Environment", int(self.datagrams.offset[row]))
                for name, (field, unit, _) in simrad_xml.ENVIRONMENT.items()
                if number(root.attrib, field) == number(root.attrib, field)  # not NaN
            ]
        return tuple(settings)

    def _channel_of(self, row: int) -> str:
        return self._samples[int(self.datagrams.offset[row])].channel

    def navigation(self) -> xr.Dataset | None:
        """Latitude and longitude [rad] over time, None where the file has none.

        Two receivers may send positions of different antennas: the quality that most of the fixes have is kept.
        """
        positions = [
            (row, fix)
            for row, text in self._parsed(self.datagrams.rows("NME0", "NME1"), _sentence)
            if (fix := position(text)) is not None
        ]
        if not positions:
            return None
        kinds = [fix.quality for _, fix in positions]
        kept = [(row, fix) for row, fix in positions if fix.quality == max(dict.fromkeys(kinds), key=kinds.count)]
        fixes = np.array([tuple(fix) for _, fix in kept], [("latitude", "f8"), ("longitude", "f8"), ("quality", "i8")])
        return time_dataset([fixes], self.datagrams.time[[row for row, _ in kept]], _FIX)

    def lever_arm(self, group: str | None = None) -> LeverArm | None:
        """Position of a transducer re the receiver of positions that the file puts first.

        Args:
            group: Group of the transducer; None: the first.
        """
        root, rows = self._configuration[1], self._rows.get(group or next(iter(self._rows), ""))
        channel = None if rows is None else self._channels.get(self._channel_of(int(rows[0])))
        if root is None or channel is None or (sensor := simrad_xml.position_sensor(root)) is None:
            return None
        own = [number(channel.mounting, f"TransducerOffset{axis}") for axis in "XYZ"]
        other = [number(sensor, axis) for axis in "XYZ"]
        forward, starboard, down = (a - b for a, b in zip(own, other, strict=True))
        source = f"XML0 Configuration: TransducerOffset less position of {' '.join(sensor.get('Name', '').split())}"
        arm = LeverArm((forward, starboard, down), source)
        return arm if np.isfinite(arm.position).all() else None

    def attitude(self) -> xr.Dataset | None:
        """Roll, pitch, yaw [rad] and heave [m, positive down] over time, None where the file has none."""
        tables = list(self._parsed(self.datagrams.rows("MRU0", "MRU1"), _motion))
        return time_dataset(
            [values for _, values in tables], self.datagrams.time[[row for row, _ in tables]], _ATTITUDE
        )

    def sound_speed_profiles(self) -> tuple[xr.Dataset, ...]:
        """Profiles of sound speed [m/s] over depth [m], each with the attribute `time`."""
        profiles: list[xr.Dataset] = []
        for row, root in self._parsed(self.datagrams.rows("XML0 Environment"), _xml):
            points = numbers(root.get("SoundVelocityProfile", ""))
            pairs = points[: points.size // 2 * 2].reshape(-1, 2)
            if pairs.size and np.all(np.isfinite(pairs)):
                columns = {"sound_speed": variable("depth", pairs[:, 1], "m/s", "sound speed")}
                depth = {"depth": variable("depth", pairs[:, 0], "m", "depth")}
                profiles.append(xr.Dataset(columns, depth, {"time": float(self.datagrams.time[row])}))
        return tuple(profiles)


_FIX = (
    Column("latitude", "latitude", "rad", "latitude"),
    Column("longitude", "longitude", "rad", "longitude"),
    Column("quality", "quality", "code", Fix.quality.__doc__ or ""),
)
_PULSE = {
    "frequency_start": ("Hz", "frequency at the start of the pulse"),
    "frequency_end": ("Hz", "frequency at the end of the pulse"),
    "frequency": ("Hz", "centre frequency"),
    "pulse_length": ("s", "duration of the pulse"),
    "swept": ("1", "1 of a frequency-modulated pulse, 0 of a tone"),
    "slope": ("1", "part of the pulse over which its envelope rises"),
    "transmit_power": ("W", "transmit power"),
    "channel_mode": ("1", "0 active, 1 passive"),
    "sample_interval": ("s", "interval of samples"),
    "sound_speed": ("m/s", "sound speed at the transducer"),
    "gain_db": ("dB", "gain of the transducer for the duration of the pulse"),
    "sa_correction_db": ("dB", "correction of the integrated echo for the duration of the pulse"),
    "range_step": ("m", "step of range"),
    "first_range": ("m", "range of sample 0"),
}
_CONSTANTS = {
    "nominal_frequency": ("transducer", "Frequency", "Hz", 1.0, "frequency of the beam widths and sensitivities"),
    "receiver_sample_rate": ("transceiver", "RxSampleFrequency", "Hz", 1.0, "sample rate before the filters"),
    "transceiver_impedance": ("transceiver", "Impedance", "ohm", 1.0, "impedance of the receiver"),
    "beam_type": ("transducer", "BeamType", "1", 1.0, "1 four sectors, 17 three, 49, 65, 81 three, a centre; 97 pairs"),
    "equivalent_beam_angle_db": ("transducer", "EquivalentBeamAngle", "dB re 1 sr", 1.0, "two-way beam angle"),
    "beam_width_alongship": ("transducer", "BeamWidthAlongship", "rad", DEGREE, "beam width, fore and aft"),
    "beam_width_athwartship": ("transducer", "BeamWidthAthwartship", "rad", DEGREE, "beam width, athwart"),
    "angle_sensitivity_alongship": ("transducer", "AngleSensitivityAlongship", "1", 1.0, "phase per angle"),
    "angle_sensitivity_athwartship": ("transducer", "AngleSensitivityAthwartship", "1", 1.0, "phase per angle"),
    "angle_offset_alongship": ("transducer", "AngleOffsetAlongship", "rad", DEGREE, "angle of the beam axis, forward"),
    "angle_offset_athwartship": ("transducer", "AngleOffsetAthwartship", "rad", DEGREE, "angle of the axis, starboard"),
}


def _sample_variables(
    pings: Sequence[Mapping[str, NDArray[Any]]], sectors: int, samples: int
) -> dict[str, xr.Variable]:
    """Samples of the pings that have any, padded with NaN to one number of sectors and samples."""
    columns = {}
    for name, (unit, text) in _SAMPLED.items():
        if not any(name in values for values in pings):
            continue
        split = name == "voltage"
        shape = (len(pings), *((sectors,) if split else ()), samples)
        filled = np.full(shape, np.nan, np.complex64 if split else np.float32)
        for target, values in zip(filled, pings, strict=True):
            if name in values:
                target[tuple(slice(length) for length in values[name].shape)] = values[name]
        columns[name] = variable(("ping", "sector", "sample") if split else ("ping", "sample"), filled, unit, text)
    return columns


_SAMPLED = {
    "voltage": ("V", "voltage of each sector of the transducer"),
    "power_db": ("dB re 1 W", "received power"),
    "phase_alongship": ("rad", "electrical angle, positive forward"),
    "phase_athwartship": ("rad", "electrical angle, positive to starboard"),
}


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("utf-8", "replace")


def _sentence(content: bytes) -> str:
    """NMEA sentence of a datagram, behind the port where that is stated."""
    return content[_HEAD + (_PORT if content[4:8] == b"NME1" else 0) : -4].decode("latin-1")


def _xml(content: bytes) -> ElementTree.Element:
    return parse_xml(content[_HEAD:-4])


def _motion(content: bytes) -> NDArray[Any]:
    """Attitude in degrees and heave, shape (1,): of the instrument, or Kongsberg's binary datagram within its own.

    Values that the status of the latter marks as invalid are NaN.
    """
    if content[4:8] == b"MRU0":
        return records(content, _MOTION, _HEAD)
    table = records(content, _KM_BINARY, _HEAD)
    if table["mark"][0] != b"#KMB":
        raise DatagramError("no datagram KM binary inside")
    return without_invalid(table)[list(_MOTION.names or ())].astype(_MOTION)


def _filter(content: bytes) -> tuple[int, int, NDArray[np.complex64]]:
    """Stage, decimation and complex coefficients (n,) of a receiver filter."""
    stage = int(records(content, np.dtype("<i2"), _HEAD)[0])
    count, decimation = (int(value) for value in records(content, np.dtype("<i2"), 148, 2))
    if decimation < 1 or count < 1:
        raise DatagramError(f"{count} coefficients and a decimation of {decimation} are no filter")
    return stage, decimation, records(content[:-4], np.dtype("<c8"), _FILTER_HEAD, count)


def _values(head: _Samples, content: bytes) -> dict[str, NDArray[Any]]:
    """Samples of one ping: voltage (sectors, samples), power [dB] and electrical angles [rad], both (samples,)."""
    values: dict[str, NDArray[Any]] = {}
    offset, count = _SAMPLE_HEAD, head.samples
    if head.contents & _POWER:
        values["power_db"] = np.frombuffer(content, "<i2", count, offset) * np.float32(POWER_DB)
        offset += 2 * count
    if head.contents & _ANGLES:
        angles = np.frombuffer(content, "<i1", 2 * count, offset).reshape(count, 2) * np.float32(np.pi / 128)
        values["phase_athwartship"], values["phase_alongship"] = angles[:, 0], angles[:, 1]
        offset += 2 * count
    if head.sectors:
        kind = "<f4" if head.contents & _SINGLE else "<f2"
        pairs = np.frombuffer(content, kind, 2 * count * head.sectors, offset).astype(np.float32, copy=False)
        values["voltage"] = pairs.view(np.complex64).reshape(count, head.sectors).T
    return values
