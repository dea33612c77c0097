"""Kongsberg .all and .wcd: soundings, seabed image and water column of multibeams before KMALL.

Kongsberg (2018), EM series multibeam echo sounders, datagram formats, 850-160692/W. A datagram has its length in front
and a sum of its bytes at its end. Receivers of a system with two have datagrams of their own, each with its `serial`.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import cached_property, partial
from typing import Any, ClassVar, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments import kongsberg_all_earlier as earlier
from insonify.formats.instruments import kongsberg_all_layouts as layouts
from insonify.formats.instruments.columns import (
    DEGREE,
    TIME_UNIT,
    Column,
    along,
    ping_dataset,
    ragged,
    record_settings,
    sample_levels,
    stacked,
    time_dataset,
    variable,
    variables,
    with_active,
)
from insonify.formats.instruments.instrument_file import (
    DatagramError,
    Instrument,
    InstrumentFile,
    LeverArm,
    Setting,
)
from insonify.formats.instruments.kongsberg_all_earlier import NO_METHOD, NO_QUALITY
from insonify.formats.instruments.kongsberg_all_layouts import byte_order, highest_is_none, ordered_records
from insonify.formats.instruments.kongsberg_all_sensors import ATTITUDE, SENSORS, readings
from insonify.formats.instruments.kongsberg_text import installation_settings

_HEAD = layouts.HEADER.itemsize
_TRAILER = 3  # bytes: the end identifier and the checksum
_TWO_BYTES = np.dtype("<u2")
_CENTI, _DECI = 0.01, 0.1
_START = re.compile(rb"\x02[0-9A-Za-z]..(?:..[\x2f-\x40]\x01|\x01[\x2f-\x40]..)", re.DOTALL)  # 1990 to 2099
_MODELS = {2045: "2040C", 3020: "3002", **dict.fromkeys(earlier.DUAL_HEADS, "3000D")}
"""Names of the models whose number is another ("Output datagrams", appendix B)."""
_IDENTITY = (
    Column("ping_number", "counter", "code", "number of the ping in the instrument"),
    Column("serial", "serial", "code", "serial number of the receiver"),
)
_SOUNDING_PING = highest_is_none(layouts.XYZ, (
    Column("heading", "heading", "rad", "heading of the vessel", _CENTI * DEGREE),
    Column("sound_speed", "sound_speed", "m/s", "sound speed at the transducer", _DECI),
    Column("transducer_depth", "transducer_depth", "m", "depth of the transmitter below the water line"),
    Column("sample_rate", "sample_rate", "Hz", "sample rate"),
))  # fmt: skip
_SOUNDING = highest_is_none(layouts.XYZ_BEAM, (
    Column("forward", "forward", "m", "position re the positioning system's reference, forward"),
    Column("starboard", "starboard", "m", "position re the positioning system's reference, to starboard"),
    Column("down", "down", "m", "position re the transmitter, down"),
    Column("backscatter", "level", "dB", "backscatter level", _DECI),
    Column("quality", "quality", "1", "standard deviation of the range re the range", 1 / 250, NO_QUALITY),
    Column("incidence_correction", "incidence_correction", "rad", "correction of the incidence angle", _DECI * DEGREE),
    Column("cleaning", "cleaning", "code", "negative where a beam is flagged out"),
))  # fmt: skip
_RANGE = highest_is_none(layouts.RANGE_BEAM, (
    Column("travel_time", "travel_time", "s", "two-way travel time"),
    Column("beam_angle", "angle", "rad", "beam angle re the receiver, positive to starboard", -_CENTI * DEGREE),
    Column("sector", "sector", "code", "transmit sector"),
))  # fmt: skip
_SECTOR = highest_is_none(layouts.RANGE_SECTOR, (
    Column("frequency", "frequency", "Hz", "centre frequency of the sector"),
    Column("sector_delay", "delay", "s", "delay of the sector's transmission re the first"),
    Column("tilt", "tilt", "rad", "steering of the transmitter along re the array", _CENTI * DEGREE),
    Column("focus_range", "focus_range", "m", "focal range of the transmitter, 0 without", _DECI),
    Column("bandwidth", "bandwidth", "Hz", "bandwidth of the sector's pulse"),
    Column("pulse_length", "pulse_length", "s", "length of the sector's pulse"),
    Column("absorption", "absorption", "dB/m", "mean absorption of the sector", 1e-5, 0.0),
    Column("waveform", "waveform", "code", "0 CW, 1 rising FM, 2 falling FM"),
))  # fmt: skip
_EXTRA_PING = highest_is_none(layouts.EXTRA, (
    Column("heading", "heading", "rad", "heading of the vessel", _CENTI * DEGREE),
    Column("sound_speed", "sound_speed", "m/s", "sound speed at the transducer", _DECI),
    Column("transducer_depth", "reference_depth", "m", "depth of the point that depths refer to"),
))  # fmt: skip
_EXTRA = highest_is_none(layouts.EXTRA_BEAM, (
    Column("travel_time", "travel_time", "s", "two-way travel time"),
    Column("beam_angle", "angle", "rad", "beam angle re the receiver, positive to starboard", -DEGREE),
    Column("forward", "forward", "m", "position forward"),
    Column("starboard", "starboard", "m", "position to starboard"),
    Column("down", "down", "m", "position re the transmitter, down"),
    Column("backscatter", "level", "dB", "backscatter level", _DECI),
    Column("sector", "sector", "code", "transmit sector"),
    Column("class_number", "class", "code", "class of the detection"),
    Column("confidence", "confidence", "code", "confidence level"),
    Column("water_column_beam", "water_column_beam", "code", "beam of the water column"),
    Column("water_column_sample", "water_column_sample", "code", "sample of the detection in the water column"),
))  # fmt: skip
_IMAGE_PING = highest_is_none(layouts.IMAGE, (
    Column("image_sample_rate", "sample_rate", "Hz", "sample rate of the seabed image"),
    Column("normal_sample", "normal_range", "1", "range of normal incidence used for the levels [samples]"),
    Column("normal_level", "normal_level", "dB", "backscatter level at normal incidence", _DECI),
    Column("oblique_level", "oblique_level", "dB", "backscatter level at oblique incidence", _DECI),
    Column("tx_beam_width", "tx_beam_width", "rad", "beam width of the transmitter, along", _DECI * DEGREE),
    Column("crossover_angle", "crossover", "rad", "crossover angle of the gain law", _DECI * DEGREE),
))  # fmt: skip
_IMAGE_BEAM = (
    Column("sample_count", "sample_count", "code", "samples of the beam"),
    Column("centre_sample", "centre_sample", "code", "number of the sample at the detection, from 1 in rising range"),
)
_WATER = highest_is_none(layouts.WATER, (
    Column("sample_rate", "sample_rate", "Hz", "sample rate", _CENTI),
    Column("sound_speed", "sound_speed", "m/s", "sound speed at the transducer", _DECI),
    Column("gain_exponent", "tvg_exponent", "1", "X of the gain X log10(r) + 2 alpha r + offset applied [dB]"),
    Column("gain_offset", "tvg_offset", "dB", "offset of the gain applied"),
    Column("heave", "heave", "m", "heave of the transmitter, positive down", _CENTI),
))  # fmt: skip
_WATER_SECTOR = highest_is_none(layouts.WATER_SECTOR, (
    Column("frequency", "frequency", "Hz", "centre frequency of the sector", 10.0),
    Column("tilt", "tilt", "rad", "steering of the transmitter along re the array", _CENTI * DEGREE),
))  # fmt: skip
_WATER_BEAM = highest_is_none(layouts.WATER_BEAM, (
    Column("beam_angle", "angle", "rad", "beam angle re vertical, positive to starboard", -_CENTI * DEGREE),
    Column("first_sample", "first_sample", "code", "sample number of the first sample, counted from the transducer"),
    Column("detected_sample", "detected", "1", "sample number of the detection, NaN without", 1.0, 0.0),
    Column("sector", "sector", "code", "transmit sector"),
    Column("sample_count", "sample_count", "code", "samples of the beam"),
))  # fmt: skip
_ACTIVE, _NUMBER = 0x80, 0x03  # bits of a position's system: active, and its number
_NO_ROLL = 0x02  # bit of an attitude's sensor whose roll is not used
_POSITION = highest_is_none(layouts.POSITION, (
    Column("latitude", "latitude", "rad", "latitude", DEGREE / 2e7),
    Column("longitude", "longitude", "rad", "longitude", DEGREE / 1e7),
    Column("speed", "speed", "m/s", "speed over ground", _CENTI),
    Column("course", "course", "rad", "course over ground", _CENTI * DEGREE),
    Column("heading", "heading", "rad", "heading", _CENTI * DEGREE),
    Column("position_uncertainty", "quality", "m", "quality of the position", _CENTI),
))  # fmt: skip
_RUNTIME = highest_is_none(layouts.RUNTIME, (
    Column("least depth", "least_depth", "m", ""),
    Column("largest depth", "largest_depth", "m", ""),
    Column("absorption", "absorption", "dB/m", "", 1e-5),
    Column("pulse length", "pulse_length", "s", "", 1e-6),
    Column("transmit beam width", "tx_beam_width", "rad", "", _DECI * DEGREE),
    Column("receive beam width", "rx_beam_width", "rad", "", _DECI * DEGREE),
    Column("transmit power", "power", "dB", ""),
    Column("receive bandwidth", "bandwidth", "Hz", "", 50.0),
    Column("crossover angle", "crossover", "rad", "", DEGREE),
    Column("port coverage", "port_coverage", "rad", "", DEGREE),
    Column("starboard coverage", "starboard_coverage", "rad", "", DEGREE),
    Column("port swath", "port_swath", "m", ""),
    Column("starboard swath", "starboard_swath", "m", ""),
    Column("mode", "mode", "code", ""),
    Column("mode 2", "mode2", "code", ""),
    Column("beam spacing", "beam_spacing", "code", ""),
    Column("stabilisation", "stabilisation", "code", ""),
    Column("filters", "filter", "code", ""),
    Column("filters 2", "filter2", "code", ""),
    Column("sound speed source", "speed_source", "code", ""),
))  # fmt: skip


class _Image(NamedTuple):
    """Parts of a seabed image datagram; levels [dB] over (beam, sample)."""

    head: NDArray[Any]
    ping: NDArray[Any]
    beams: NDArray[Any]
    level: NDArray[np.float32]


class _Ranges(NamedTuple):
    """Parts of a datagram of raw ranges and angles."""

    sectors: NDArray[Any]
    beams: NDArray[Any]
    earlier: bool = False
    """True of the datagrams before 2005, whose beams are those with a detection."""


class _Water(NamedTuple):
    """Parts of one or more water column datagrams of a ping; levels [dB] over (beam, sample)."""

    head: NDArray[Any]
    ping: NDArray[Any]
    sectors: NDArray[Any]
    beams: NDArray[Any]
    level: NDArray[np.float32]


class KongsbergAllFile(InstrumentFile):
    """Kongsberg .all or .wcd file."""

    format = "Kongsberg all"
    suffixes = (".all", ".wcd")
    kinds: ClassVar[Mapping[str, str]] = {
        "I": "installation, start", "i": "installation, stop", "p": "installation, remote",
        "r": "installation, remote", "R": "runtime parameters",
        "X": "soundings", "N": "raw ranges and angles", "Y": "seabed image", "k": "water column", "A": "attitude",
        "n": "attitude, network", "P": "position", "U": "sound-speed profile", "C": "clock", "h": "height",
        "H": "heading", "G": "sound speed at the transducer", "W": "sound-speed profile, text", "1": "processor status",
        "O": "quality factors", "l": "extra detections", "3": "extra parameters", "T": "tide", "J": "transducer tilt",
        "B": "built-in test", "E": "single beam depth", "D": "soundings, earlier", "f": "raw ranges, earlier",
        "S": "seabed image, earlier", "V": "sound-speed profile, earlier", "F": "raw ranges, earliest",
        "e": "raw ranges of EM 3000", "K": "central beams", "d": "nominal depths", "0": "processor identity",
    }  # fmt: skip
    unread = frozenset("W1O3BFeKd0")

    @staticmethod
    def matches(head: bytes) -> bool:
        """Return True if the first datagram begins as one, with a date."""
        return _START.match(head, 4) is not None

    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        self._identities: list[tuple[int, int]] = []
        return self._scan(0, self._header, _START, lead=4)

    def _header(self, offset: int) -> tuple[int, str, float]:
        """Size, kind and time of the datagram at an offset."""
        content = self._bytes(offset, _HEAD)
        if _START.match(content, 4) is None:
            raise DatagramError("no datagram begins here")
        header = ordered_records(content, layouts.HEADER, 0)[0]
        size, kind = int(header["length"]) + 4, header["kind"].decode()
        if size < _HEAD + _TRAILER:
            raise DatagramError(f"{kind}: a length of {size - 4} bytes is stated")
        if self._bytes(offset + size - _TRAILER, _TRAILER)[:1] != b"\x03":  # a file may end within the checksum
            raise DatagramError(f"{kind}: its end is not marked {size} bytes further on")
        self._identities.append((int(header["counter"]), int(header["serial"])))
        return size, kind, _seconds(int(header["date"]), int(header["milliseconds"]) * 1e-3)

    def _verify(self, content: bytes) -> None:
        checksum = int(np.frombuffer(content, np.uint8, len(content) - 5 - _TRAILER, 5).sum(dtype=np.uint64)) & 0xFFFF
        if checksum != (stated := int(ordered_records(content, _TWO_BYTES, len(content) - 2)[0])):
            raise DatagramError(f"its checksum is {checksum}, and {stated} is stated")

    @cached_property
    def instrument(self) -> Instrument:
        """Maker, model and serial number."""
        header = ordered_records(self._bytes(int(self.datagrams.offset[0]), _HEAD), layouts.HEADER, 0)[0]
        serial = next((str(s.value) for s in self.settings() if s.name == "SMH"), str(header["serial"]))
        return Instrument("Kongsberg", f"EM{_MODELS.get(int(header['model']), header['model'])}", serial)

    @cached_property
    def groups(self) -> Mapping[str, int]:
        """Number of pings of each group; each receiver counts as a ping."""
        counts = {"soundings": self.datagrams.rows("X", "D").size, "seabed image": self.datagrams.rows("Y", "S").size,
                  "water column": len(self._water_rows), "extra detections": self.datagrams.rows("l").size}  # fmt: skip
        return {group: count for group, count in counts.items() if count}

    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Read pings; levels [dB] over (ping, beam, sample), soundings over (ping, beam).

        Angles, travel times and settings of sectors come from the datagrams of raw ranges, where the file has them.
        """
        self._require_group(group)
        if group == "water column":
            return self._water_column(pings)
        if group == "extra detections":
            return self._extra(pings)
        return self._seabed_image(pings) if group == "seabed image" else self._soundings(pings)

    def _soundings(self, pings: slice) -> xr.Dataset:
        rows = self.datagrams.rows("X", "D")
        parsed = list(self._parsed(rows[pings], _soundings))
        kept = [row for row, _ in parsed]
        columns = variables([head for _, (head, _, _) in parsed], _IDENTITY, ("ping",))
        columns |= variables([ping for _, (_, ping, _) in parsed], _SOUNDING_PING, ("ping",))
        beams = [table for _, (_, _, table) in parsed]
        columns |= variables(beams, _SOUNDING, ("ping", "beam")) | _detections(beams)
        columns |= self._ranges_of(kept, [table.size for table in beams])
        below = columns["down"].values + columns["transducer_depth"].values[:, None]
        columns["depth"] = variable(("ping", "beam"), below, "m", "depth below the water line")
        return ping_dataset("soundings", np.searchsorted(rows, kept), self.datagrams.time[kept], columns)

    def _extra(self, pings: slice) -> xr.Dataset:
        rows = self.datagrams.rows("l")
        parsed = list(self._parsed(rows[pings], _extra_detections))
        kept, tables = [row for row, _ in parsed], [table for _, (_, _, table) in parsed]
        for row, table in zip(kept, tables, strict=True):
            half = table["sample_count"].astype(np.int64)  # samples before the detection, and as many behind it
            if count := int(np.where(half > 0, 2 * half + 1, 0).sum()):
                self._omit(int(self.datagrams.offset[row]), f"l: {count} samples about extra detections, not read")
        columns = variables([head for _, (head, _, _) in parsed], _IDENTITY, ("ping",))
        columns |= variables([ping for _, (_, ping, _) in parsed], _EXTRA_PING, ("ping",))
        columns |= variables(tables, _EXTRA, ("ping", "beam"))
        return ping_dataset("extra detections", np.searchsorted(rows, kept), self.datagrams.time[kept], columns)

    def settings(self) -> tuple[Setting, ...]:
        """Installation and runtime parameters."""
        settings: list[Setting] = []
        for row, content in self._parsed(self.datagrams.rows("I", "i", "p", "r", "R"), lambda content: content):
            source = str(self.datagrams.kind[row]), int(self.datagrams.offset[row])
            if source[0] != "R":
                settings += installation_settings(
                    content[_HEAD + 2 : -_TRAILER].rstrip(b"\0").decode("latin-1"), *source
                )
                continue
            if len(content) < _HEAD + layouts.RUNTIME.itemsize:
                self._omit(source[1], f"R: {len(content)} bytes are too few")
                continue
            settings += record_settings(ordered_records(content, layouts.RUNTIME, _HEAD)[0], _RUNTIME, source)
        return tuple(settings)

    def navigation(self) -> xr.Dataset | None:
        """Latitude, longitude [rad], speed, course, heading over time, of all systems; `active` marks the one used."""
        tables = [table for _, table in self._fixes]
        fixes = time_dataset(tables, self.datagrams.time[[row for row, _ in self._fixes]], _POSITION)
        return with_active(fixes, [bool(table["system"][0] & _ACTIVE) for table in tables])

    @cached_property
    def _fixes(self) -> list[tuple[int, NDArray[Any]]]:
        read = self._parsed(self.datagrams.rows("P"), lambda content: ordered_records(content, layouts.POSITION, _HEAD))
        return list(read)

    def lever_arm(self, group: str | None = None) -> LeverArm | None:
        """Position of the transmitter re the antenna of the active system, which P has the positions of."""
        systems = [int(fix["system"][0]) for _, fix in self._fixes]
        number = next((system & _NUMBER for system in systems if system & _ACTIVE), 1)
        names = [f"{part}{axis}" for part in ("S1", f"P{number}") for axis in "XYZ"]
        if (fix := self.setting_values(*names)) is None:
            return None
        arm = (fix[0] - fix[3], fix[1] - fix[4], fix[2] - fix[5])
        return LeverArm(arm, f"I: {', '.join(names[:3])} less {', '.join(names[3:])}")

    def attitude(self) -> xr.Dataset | None:
        """Attitude and heave of the transducer over time, of all sensors; `active` marks the one used."""
        parsed = list(self._parsed(self.datagrams.rows("A"), _attitude))
        times = [self.datagrams.time[row] + table["milliseconds"] * 1e-3 for row, (table, _) in parsed]
        poses = time_dataset(
            [table for _, (table, _) in parsed], np.concatenate(times) if times else np.empty(0), ATTITUDE
        )
        return with_active(poses, [active for _, (table, active) in parsed for _ in table])

    def sound_speed_profiles(self) -> tuple[xr.Dataset, ...]:
        """Profiles with their time."""
        return tuple(profile for _, profile in self._parsed(self.datagrams.rows("U", "V"), _profile))

    def sensors(self) -> Mapping[str, xr.Dataset]:
        """Clock, height, heading, sound speed at the transducer, tide, tilt and attitude of the network, by name."""
        datasets = {}
        for kind, sensor in SENSORS.items():
            read = list(self._parsed(self.datagrams.rows(kind), partial(readings, sensor)))
            times = [self.datagrams.time[row] + sensor.step * table["elapsed"] if sensor.step
                     else self.datagrams.time[[row]] for row, table in read]  # fmt: skip
            series = time_dataset(
                [table for _, table in read], np.concatenate(times) if times else np.empty(0), sensor.columns
            )
            if series is not None:
                datasets[sensor.name] = series
        return datasets

    def _seabed_image(self, pings: slice) -> xr.Dataset:
        rows = self.datagrams.rows("Y", "S")
        parsed = list(self._parsed(rows[pings], _image))
        kept, images = [row for row, _ in parsed], [image for _, image in parsed]
        columns = variables([image.head for image in images], _IDENTITY, ("ping",))
        columns |= variables([image.ping for image in images], _IMAGE_PING, ("ping",))
        columns |= variables([image.beams for image in images], _IMAGE_BEAM, ("ping", "beam"))
        columns |= _detections([image.beams for image in images])
        columns |= self._ranges_of(kept, [image.beams.size for image in images])
        columns["level"] = sample_levels(
            self.path, [image.level for image in images], "level of the seabed image, in rising range"
        )
        return ping_dataset("seabed image", np.searchsorted(rows, kept), self.datagrams.time[kept], columns)

    def _ranges_of(self, rows: Sequence[int], beam_counts: Sequence[int]) -> dict[str, xr.Variable]:
        """Travel times, angles and sectors of the pings of some datagrams, NaN where the file lacks them."""
        at = {self._identities[row]: row for row in reversed(self.datagrams.rows("N", "f").tolist())}
        ranges_by_row = dict(
            self._parsed(sorted({at[i] for i in map(self._identities.__getitem__, rows) if i in at}), _ranges)
        )
        none = _Ranges(np.empty(0, layouts.RANGE_SECTOR), np.empty(0, layouts.RANGE_BEAM))
        if not ranges_by_row:
            return {}
        pairs = [ranges_by_row.get(at.get(self._identities[row], -1), none) for row in rows]
        beams = [ranges.beams[:count] if not ranges.earlier or ranges.beams.size == count else none.beams
                 for ranges, count in zip(pairs, beam_counts, strict=True)]  # fmt: skip
        columns = variables([ranges.sectors for ranges in pairs], _SECTOR, ("ping", "tx_sector"))
        return columns | variables(beams, _RANGE, ("ping", "beam"), max(beam_counts, default=0))

    @cached_property
    def _water_rows(self) -> list[list[int]]:
        """Rows of the water column datagrams of each ping and receiver, in the order of the file."""
        pings: dict[tuple[int, int, float], list[int]] = {}
        for row in self.datagrams.rows("k").tolist():
            pings.setdefault((*self._identities[row], float(self.datagrams.time[row])), []).append(row)
        return list(pings.values())

    def _water_column(self, pings: slice) -> xr.Dataset:
        requested = range(len(self._water_rows))[pings]
        parsed = [(ping, part) for ping in requested if (part := self._water_ping(self._water_rows[ping])) is not None]
        waters = [part for _, part in parsed]
        columns = variables([water.head for water in waters], _IDENTITY, ("ping",))
        columns |= variables([water.ping for water in waters], _WATER, ("ping",))
        columns |= variables([water.sectors for water in waters], _WATER_SECTOR, ("ping", "tx_sector"))
        columns |= variables([water.beams for water in waters], _WATER_BEAM, ("ping", "beam"))
        columns["level"] = sample_levels(
            self.path, [water.level for water in waters], "level as recorded, gain included"
        )
        numbers = [ping for ping, _ in parsed]
        times = self.datagrams.time[[self._water_rows[ping][0] for ping in numbers]]
        return ping_dataset("water column", numbers, times, columns)

    def _water_ping(self, rows: Sequence[int]) -> _Water | None:
        """Beams of a ping from its datagrams; what is missing of them is listed."""
        parts = sorted((water for _, water in self._parsed(rows, _water)), key=lambda part: int(part.ping["part"]))
        if not parts:
            return None
        first, stated = parts[0], int(parts[0].ping["parts"])
        if stated != len(parts):
            self._omit(
                int(self.datagrams.offset[rows[0]]), f"k: {stated} parts are stated, and {len(parts)} can be read"
            )
        width = max(part.level.shape[1] for part in parts)
        levels = [np.pad(p.level, ((0, 0), (0, width - p.level.shape[1])), constant_values=np.nan) for p in parts]
        beams = np.concatenate([part.beams for part in parts])
        return _Water(first.head, first.ping, first.sectors, beams, np.concatenate(levels))


def _seconds(day: int, seconds: float) -> float:
    """Seconds since 1970 of a date such as 20221109 and a time of the day, NaN where there is no such date."""
    try:
        return (date(day // 10000, day // 100 % 100, day % 100) - date(1970, 1, 1)).days * 86400.0 + seconds
    except ValueError:
        return np.nan


def _table(content: bytes, head: np.dtype[Any], rows: np.dtype[Any]) -> tuple[NDArray[Any], NDArray[Any], int]:
    """First record of a datagram, shape (), the `beams` records after it, and the offset of what follows."""
    first = ordered_records(content, head, _HEAD)[0]
    table = ordered_records(content, rows, _HEAD + head.itemsize, int(first["beams"]))
    return first, table, _HEAD + head.itemsize + table.nbytes


def _soundings(content: bytes) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Header, settings and beams of a soundings datagram."""
    if content[5:6] == b"D":
        return earlier.soundings(content)
    ping, beams, _ = _table(content, layouts.XYZ, layouts.XYZ_BEAM)
    return ordered_records(content, layouts.HEADER, 0)[0], ping, beams


def _detections(tables: Sequence[NDArray[Any]]) -> dict[str, xr.Variable]:
    """Kind and method of the detections by their information byte (notes 3 and 4 of the tables)."""
    infos = [table["info"].astype(np.int64) for table in tables]
    rejected = [info >> 7 for info in infos]
    methods = [np.where((info >> 7 > 0) | (info & 15 == NO_METHOD), 0, (info & 15) + 1) for info in infos]
    kinds, dims = stacked([2 * bad for bad in rejected]), ("ping", "beam")
    return {
        "detection": variable(dims, kinds, "code", "0 normal, 2 rejected"),
        "detection_method": variable(dims, stacked(methods), "code", "0 none stated, 1 amplitude, 2 phase"),
    }


def _ranges(content: bytes) -> _Ranges:
    """Parts of a datagram of raw ranges and angles."""
    if content[5:6] == b"f":
        return _Ranges(*earlier.ranges(content), earlier=True)
    head = ordered_records(content, layouts.RANGE, _HEAD)[0]
    offset = _HEAD + layouts.RANGE.itemsize
    sectors = ordered_records(content, layouts.RANGE_SECTOR, offset, int(head["sectors"]))
    return _Ranges(sectors, ordered_records(content, layouts.RANGE_BEAM, offset + sectors.nbytes, int(head["beams"])))


def _image(content: bytes) -> _Image:
    """Parts of a seabed image datagram; samples of each beam in the order of rising range."""
    if content[5:6] == b"S":
        _, ping, beams, level = earlier.image(content)
        counts = beams["sample_count"].astype(np.int64)
    else:
        ping, beams, offset = _table(content, layouts.IMAGE, layouts.IMAGE_BEAM)
        counts = beams["sample_count"].astype(np.int64)
        if offset + 2 * int(counts.sum()) + _TRAILER > len(content):
            raise DatagramError(f"{counts.sum()} samples are stated from byte {offset} of {len(content)}")
        starts = offset + 2 * (np.cumsum(counts) - counts)
        level = ragged(content, f"{byte_order(content)}i2", starts.tolist(), counts.tolist(), _DECI)
    falling, beams = beams["order"] < 0, beams.copy()
    for beam in np.flatnonzero(falling & (counts > 0)):
        level[beam, : counts[beam]] = level[beam, : counts[beam]][::-1].copy()
        if 0 < beams["centre_sample"][beam] <= counts[beam]:
            beams["centre_sample"][beam] = counts[beam] + 1 - beams["centre_sample"][beam]
    return _Image(ordered_records(content, layouts.HEADER, 0)[0], ping, beams, level)


def _extra_detections(content: bytes) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Header, settings and detections of a datagram of extra detections."""
    ping = ordered_records(content, layouts.EXTRA, _HEAD)[0]
    offset = _HEAD + layouts.EXTRA.itemsize + int(ping["classes"]) * int(ping["class_size"])
    table = ordered_records(content, layouts.EXTRA_BEAM, offset, int(ping["beams"]), int(ping["beam_size"]))
    return ordered_records(content, layouts.HEADER, 0)[0], ping, table


def _water(content: bytes) -> _Water:
    """Parts of one water column datagram; refused where they contradict its length."""
    ping = ordered_records(content, layouts.WATER, _HEAD)[0]
    sectors = ordered_records(content, layouts.WATER_SECTOR, _HEAD + layouts.WATER.itemsize, int(ping["sectors"]))
    offset, beams, starts = _HEAD + layouts.WATER.itemsize + sectors.nbytes, [], []
    for _ in range(int(ping["beams"])):
        beams.append(ordered_records(content, layouts.WATER_BEAM, offset))
        starts.append(offset + layouts.WATER_BEAM.itemsize)
        offset = starts[-1] + int(beams[-1]["sample_count"][0])
    if offset + _TRAILER > len(content):
        raise DatagramError(f"samples are stated up to byte {offset} of {len(content)}")
    table = np.concatenate(beams) if beams else np.empty(0, layouts.WATER_BEAM)
    level = ragged(content, "i1", starts, table["sample_count"].tolist(), 0.5)
    return _Water(ordered_records(content, layouts.HEADER, 0)[0], ping, sectors, table, level)


def _attitude(content: bytes) -> tuple[NDArray[Any], bool]:
    """Samples of an attitude datagram, shape (n,), and whether its sensor is the one used."""
    count = int(ordered_records(content, _TWO_BYTES, _HEAD)[0])
    return ordered_records(content, layouts.ATTITUDE, _HEAD + 2, count), not content[-_TRAILER - 1] & _NO_ROLL


def _profile(content: bytes) -> xr.Dataset:
    """Sound-speed profile of a U datagram, or of an earlier V."""
    head = ordered_records(content, layouts.PROFILE, _HEAD)[0]
    point = layouts.PROFILE_POINT_EARLIER if content[5:6] == b"V" else layouts.PROFILE_POINT
    points = ordered_records(content, point, _HEAD + layouts.PROFILE.itemsize, int(head["count"]))
    depth = variable("depth", points["depth"] * float(head["resolution"]) * _CENTI, "m", "depth below the water line")
    speed = (Column("sound_speed", "sound_speed", "m/s", "sound speed", _DECI),)
    about = {"time": _seconds(int(head["date"]), float(head["seconds"])), "time_units": TIME_UNIT}
    return xr.Dataset(along("depth", points, speed), {"depth": depth}, about)
