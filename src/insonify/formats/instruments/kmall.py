"""Kongsberg KMALL and KMWCD: soundings, seabed image and water column of multibeams since 2016.

Kongsberg (2021), EM datagrams on *.kmall format, 410224 rev. I. A datagram opens and closes with its length; it has no
checksum, so that a change of its content is noticed only where sizes contradict one another. Every part states its own
size, by which fields of later versions are skipped; fields that an earlier version lacks are NaN. Values of a sensor
whose status marks them as invalid, or whose contents lack them, are none. Values that are none, and versions before
revision I, are those that the comments of `EMdgmFormat.h` state (Scommon, SVP, SVTinfo, MWCrxBeamData). Axes and signs
are those of this project, but for beam angles, which Kongsberg counts positive to port.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Any, ClassVar, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments import kmall_layouts as layouts
from insonify.formats.instruments.columns import (
    DEGREE,
    TIME_UNIT,
    Column,
    along,
    ping_dataset,
    ragged,
    sample_levels,
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
    LeverArm,
    Setting,
    records,
)
from insonify.formats.instruments.km_binary import without_invalid
from insonify.formats.instruments.kongsberg_text import installation_settings, runtime_settings

_BODY = layouts.HEADER.itemsize + layouts.PARTITION.itemsize
_CONTINUED = "+"  # after the kind of a datagram that continues another one
_KIND = re.compile(rb"#[A-Z]{3}")
_INVALID = 1 << 4  # of the status that all sensors have
_SPEED_CONTENTS = ("sound_speed", "temperature", "pressure", "salinity")
"""Values of a sound-speed probe, in the order of the bits that state which of them it has."""
_KM = 1e-3  # from one in a kilometre to one in a metre
_PING = (
    Column("ping_number", "ping", "code", "number of the ping in the instrument"),
    Column("fan", "fan", "code", "receive fan of the ping, 0 aft and port"),
    Column("swath", "swath", "code", "swath of the ping, 0 aft"),
)
_SETTINGS = (
    Column("latitude", "latitude", "rad", "latitude of the reference point", DEGREE, 200.0),
    Column("longitude", "longitude", "rad", "longitude of the reference point", DEGREE, 200.0),
    Column("heading", "heading", "rad", "heading of the vessel", DEGREE),
    Column("sound_speed", "sound_speed", "m/s", "sound speed at the transmitter"),
    Column("transducer_depth", "transducer_depth", "m", "depth of the transmitter below the water line"),
    Column("water_level", "water_level", "m", "water line re the reference point, positive down"),
    Column("ping_rate", "ping_rate", "Hz", "ping rate, averaged"),
    Column("pulse_length", "pulse_length", "s", "longest pulse of the sectors"),
    Column("tx_beam_width", "tx_beam_width", "rad", "beam width of the transmitter, along", DEGREE),
    Column("rx_beam_width", "rx_beam_width", "rad", "beam width of the receiver, across", DEGREE),
    Column("transmit_power", "power", "dB", "power set by the operator re the largest"),
    Column("depth_mode", "depth_mode", "code", "depth mode, plus 100 where set by hand"),
    Column("pulse_form", "pulse_form", "code", "0 CW, 1 both, 2 FM"),
    Column("detection_mode", "detection_mode", "code", "0 normal, 1 waterway, 2 tracking, 3 least depth"),
)
_RX = (
    Column("image_sample_rate", "seabed_image_rate", "Hz", "sample rate of the seabed image"),
    Column("water_column_sample_rate", "water_column_rate", "Hz", "sample rate of the water column"),
    Column("normal_level", "normal_level", "dB", "backscatter level at normal incidence"),
    Column("oblique_level", "oblique_level", "dB", "backscatter level at oblique incidence"),
)
_SECTOR = (
    Column("frequency", "frequency", "Hz", "centre frequency of the sector"),
    Column("sector_delay", "delay", "s", "delay of the sector's transmission re the first"),
    Column("tilt", "tilt", "rad", "steering of the transmitter along re the array", DEGREE),
    Column("source_level", "source_level", "dB re 1 uPa at 1 m", "nominal source level of the sector"),
    Column("voltage_level", "voltage_level", "dB", "level of the supply re its nominal one, added to the source level"),
    Column("focus_range", "focus_range", "m", "focal range of the transmitter, 0 without"),
    Column("bandwidth", "bandwidth", "Hz", "bandwidth of the sector's pulse"),
    Column("sector_pulse_length", "pulse_length", "s", "length of the sector's pulse"),
    Column("effective_pulse_length", "effective_pulse_length", "s", "length used for the footprint"),
    Column("shading", "shading", "1", "share of the pulse that is shaded by a squared cosine", 0.01),
    Column("waveform", "waveform", "code", "0 CW, 1 rising FM, 2 falling FM"),
)
_SOUNDING = (
    Column("travel_time", "travel_time", "s", "two-way travel time"),
    Column("beam_angle", "angle", "rad", "beam angle re the receiver, positive to starboard", -DEGREE),
    Column("forward", "forward", "m", "position re the reference point, forward"),
    Column("starboard", "starboard", "m", "position re the reference point, to starboard"),
    Column("down", "down", "m", "position re the reference point, down"),
    Column("delta_latitude", "delta_latitude", "rad", "latitude re the reference point", DEGREE),
    Column("delta_longitude", "delta_longitude", "rad", "longitude re the reference point", DEGREE),
    Column("backscatter", "level2", "dB", "backscatter level, gain undone by range and absorption"),
    Column("backscatter_maker", "level1", "dB", "backscatter level, gain of the maker's own law"),
    Column("source_level_applied", "source_level", "dB", "source level used for the backscatter level"),
    Column("sensitivity_applied", "sensitivity", "dB", "receiver sensitivity used for the backscatter level"),
    Column("calibration", "calibration", "dB", "calibration added to the backscatter level"),
    Column("gain", "tvg", "dB", "time-varying gain at the detection"),
    Column("absorption", "absorption", "dB/m", "mean absorption used for the gain", _KM),
    Column("sector", "sector", "code", "transmit sector"),
    Column("detection", "type", "code", "0 normal, 1 extra, 2 rejected"),
    Column("detection_method", "method", "code", "0 none, 1 amplitude, 2 phase"),
    Column("quality", "quality", "1", "standard deviation re the depth", 0.01),
    Column("vertical_uncertainty", "vertical_uncertainty", "m", "vertical uncertainty"),
    Column("horizontal_uncertainty", "horizontal_uncertainty", "m", "horizontal uncertainty"),
    Column("echo_length", "echo_length", "s", "length of the echo"),
    Column("incidence_correction", "incidence_correction", "rad", "correction of the angle of incidence", DEGREE),
    Column("water_column_beam", "water_column_beam", "code", "beam of the water column"),
    Column("water_column_sample", "water_column_sample", "code", "sample of the detection in the water column"),
    Column("water_column_angle", "water_column_angle", "rad", "angle of that beam re vertical, to starboard", -DEGREE),
)
_IMAGE_BEAM = (
    *(column for column in _SOUNDING if column.name in ("beam_angle", "travel_time", "sector", "detection")),
    Column("first_sample", "first_sample", "code", "sample number of the first sample, counted from the transducer"),
    Column("centre_sample", "centre_sample", "code", "number of the sample at the detection"),
    Column("sample_count", "sample_count", "code", "samples of the beam"),
)
_WATER = (
    Column("sample_rate", "sample_rate", "Hz", "sample rate"),
    Column("sound_speed", "sound_speed", "m/s", "sound speed at the transducer"),
    Column("gain_exponent", "tvg_exponent", "1", "X of the gain X log10(r) + 2 alpha r + offset applied [dB]"),
    Column("gain_offset", "tvg_offset", "dB", "offset of the gain applied"),
)
_WATER_SECTOR = (
    Column("frequency", "frequency", "Hz", "centre frequency of the sector"),
    Column("tilt", "tilt", "rad", "steering of the transmitter along re the array", DEGREE),
    Column("tx_beam_width", "beam_width", "rad", "beam width of the transmitter, along", DEGREE),
)
_WATER_BEAM = (
    Column("beam_angle", "angle", "rad", "beam angle re vertical, positive to starboard", -DEGREE),
    Column("first_sample", "first_sample", "code", "sample number of the first sample, counted from the transducer"),
    Column("detected_sample", "detected_range", "1", "sample number of the detection, 0 without", 1.0, 0.0),
    Column("sector", "sector", "code", "transmit sector"),
    Column("sample_count", "sample_count", "code", "samples of the beam"),
)
_HEAVE = (Column("heave", "heave", "m", "heave of the reference point, positive down"),)
_ATTITUDE = (
    Column("roll", "roll", "rad", "roll, positive starboard down", DEGREE),
    Column("pitch", "pitch", "rad", "pitch, positive bow up", DEGREE),
    Column("yaw", "yaw", "rad", "heading", DEGREE),
    Column("heave", "heave", "m", "heave, positive down"),
    Column("roll_rate", "roll_rate", "rad/s", "rate of roll", DEGREE),
    Column("pitch_rate", "pitch_rate", "rad/s", "rate of pitch", DEGREE),
    Column("yaw_rate", "yaw_rate", "rad/s", "rate of heading", DEGREE),
    Column("latitude", "latitude", "rad", "latitude", DEGREE),
    Column("longitude", "longitude", "rad", "longitude", DEGREE),
    Column("velocity_north", "velocity_north", "m/s", "velocity to north"),
    Column("velocity_east", "velocity_east", "m/s", "velocity to east"),
    Column("velocity_down", "velocity_down", "m/s", "velocity downwards"),
)
_POSITION = (
    Column("latitude", "latitude", "rad", "latitude of the reference point", DEGREE, 200.0),
    Column("longitude", "longitude", "rad", "longitude of the reference point", DEGREE, 200.0),
    Column("speed", "speed", "m/s", "speed over ground", 1.0, -1.0),
    Column("course", "course", "rad", "course over ground", DEGREE, -4.0),
    Column("ellipsoid_height", "ellipsoid_height", "m", "height above the ellipsoid", 1.0, -999.0),
    Column("position_uncertainty", "quality", "m", "quality of the position as the sensor states it"),
)
_SENSORS = {
    "#CPO": ("position at the water line", layouts.POSITION, _POSITION),
    "#SCL": ("clock", layouts.CLOCK, (
        Column("offset", "offset", "s", "offset from the clock source"),
        Column("deviation", "deviation", "s", "time of arrival less time in the clock source", 1e-6))),
    "#SPE": ("position error", layouts.POSITION_ERROR, (
        Column("major_axis", "major_axis", "m", "standard deviation along the major axis of the error ellipse"),
        Column("minor_axis", "minor_axis", "m", "standard deviation along the minor axis of the error ellipse"),
        Column("orientation", "orientation", "rad", "direction of the major axis", DEGREE),
        *(Column(f"{name}_error", name, "m", f"standard deviation of the {name}")
          for name in ("latitude", "longitude", "height")))),
    "#SVT": ("sound speed at the transducer", layouts.SPEED, (
        Column("sound_speed", "sound_speed", "m/s", "sound speed at the transducer"),
        Column("temperature", "temperature", "degC", "temperature", 1.0, -9999.0),
        Column("pressure", "pressure", "Pa", "pressure", 1.0, -9999.0),
        Column("salinity", "salinity", "g/kg", "salinity", 1.0, -9999.0))),
    "#SDE": ("depth of the sonar", layouts.DEPTH, (
        Column("depth", "depth", "m", "depth as used"),
        Column("depth_raw", "raw", "m", "depth as the sensor states it, NaN before revision I"))),
    "#CHE": ("heave of water columns", layouts.HEAVE, (Column("heave", "heave", "m", "heave, positive down"),)),
}  # fmt: skip
"""Name, records and variables of the datagrams of other sensors."""
_PROFILE = (
    Column("sound_speed", "sound_speed", "m/s", "sound speed"),
    Column("temperature", "temperature", "degC", "temperature"),
    Column("salinity", "salinity", "g/kg", "salinity", 1.0, -99.0),
)


class _Swath(NamedTuple):
    """Parts of an #MRZ datagram."""

    body: NDArray[Any]
    ping: NDArray[Any]
    sectors: NDArray[Any]
    rx: NDArray[Any]
    soundings: NDArray[Any]
    image: NDArray[np.int16]


class _WaterColumn(NamedTuple):
    """Parts of an #MWC datagram; levels in half decibels and phases over (beam, sample), shorter beams padded."""

    body: NDArray[Any]
    tx: NDArray[Any]
    sectors: NDArray[Any]
    rx: NDArray[Any]
    beams: NDArray[Any]
    level: NDArray[np.float32]
    phase: NDArray[np.float32] | None


class KmallFile(InstrumentFile):
    """Kongsberg .kmall or .kmwcd file."""

    format = "Kongsberg KMALL"
    suffixes = (".kmall", ".kmwcd")
    kinds: ClassVar[Mapping[str, str]] = {
        "#IIP": "installation", "#IOP": "runtime parameters", "#SPO": "position", "#SKM": "attitude",
        "#SVP": "sound-speed profile", "#SVT": "sound speed at the transducer", "#SCL": "clock", "#SDE": "depth sensor",
        "#SHI": "height sensor", "#MRZ": "soundings and seabed image", "#MWC": "water column",
        "#SPE": "position error", "#CPO": "position, compatible", "#CHE": "heave, compatible",
        "#FCF": "calibration file", "#MRZ+": "continued soundings", "#MWC+": "continued water column",
        "#SHA": "heading", "#IBE": "built-in test", "#IBR": "built-in test, reply", "#IBS": "built-in test, short",
    }  # fmt: skip
    unread = frozenset({"#SHI", "#SHA", "#FCF", "#IBE", "#IBR", "#IBS"})
    _of_group: ClassVar[Mapping[str, str]] = {"soundings": "#MRZ", "seabed image": "#MRZ", "water column": "#MWC"}

    @staticmethod
    def matches(head: bytes) -> bool:
        """Return True if the first datagram has the name of a kind."""
        return _KIND.fullmatch(head[4:8]) is not None

    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        self._awaited: tuple[str, int] | None = None
        return self._scan(0, self._header, _KIND, lead=4)

    def _header(self, offset: int) -> tuple[int, str, float]:
        """Size, kind and time of the datagram at an offset."""
        head = self._bytes(offset, _BODY)
        header = records(head, layouts.HEADER, 0)[0]
        parts = records(head, layouts.PARTITION, layouts.HEADER.itemsize)[0]
        if not _KIND.fullmatch(header["kind"]):
            raise DatagramError("no datagram begins here")
        size, kind = int(header["size"]), header["kind"].decode()
        if size < _BODY + 4:
            raise DatagramError(f"{kind}: a length of {size} bytes is stated")
        if int.from_bytes(self._bytes(offset + size - 4, 4), "little") != size:
            raise DatagramError(f"{kind}: its length, {size}, is not repeated at its end")
        count, part = (int(parts["count"]), int(parts["number"])) if kind[1] == "M" else (1, 1)
        if part > 1 and self._awaited != (kind, part):
            raise DatagramError(f"{kind}: part {part} of {count} without the part before it")
        self._awaited = (kind, part + 1) if part < count else None
        return size, kind + _CONTINUED * (part > 1), float(header["seconds"]) + float(header["nanoseconds"]) * 1e-9

    @cached_property
    def instrument(self) -> Instrument:
        """Maker, model and serial number."""
        header = records(self._bytes(int(self.datagrams.offset[0]), layouts.HEADER.itemsize), layouts.HEADER, 0)[0]
        serial = next((str(s.value) for s in self.settings() if s.datagram == "#IIP" and s.name == "SN"), "")
        return Instrument("Kongsberg", f"EM{header['model']}", serial)

    @cached_property
    def groups(self) -> Mapping[str, int]:
        """Number of pings of each group; of several swaths or fans each counts as a ping."""
        counts = {group: self.datagrams.rows(kind).size for group, kind in self._of_group.items()}
        return {group: count for group, count in counts.items() if count}

    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Read pings; levels [dB] over (ping, beam, sample), soundings over (ping, beam) with extra ones at the end."""
        self._require_group(group)
        if group == "water column":
            return self._water_column(pings)
        numbers, swaths = self._multibeam("#MRZ", pings, _swath)
        columns_read = _swath_settings(swaths)
        columns, beams = _SOUNDING if group == "soundings" else _IMAGE_BEAM, ("ping", "beam")
        columns_read |= variables([swath.soundings for swath in swaths], columns, beams)
        if group == "soundings":
            below = columns_read["down"] - columns_read["water_level"]
            columns_read["depth"] = variable(beams, below.values, "m", "depth below the water line")
        else:
            images = [_image(swath) for swath in swaths]
            columns_read["level"] = sample_levels(self.path, images, "level of the seabed image as recorded")
        return ping_dataset(group, numbers, self._times("#MRZ", numbers), columns_read)

    def settings(self) -> tuple[Setting, ...]:
        """Installation and runtime parameters, each where it first has its value."""
        rows = self.datagrams.rows("#IIP", "#IOP")
        settings: list[Setting] = []
        for row, text in self._parsed(rows, _text):
            kind, offset = str(self.datagrams.kind[row]), int(self.datagrams.offset[row])
            settings += (installation_settings if kind == "#IIP" else runtime_settings)(text, kind, offset)
        return tuple(settings)

    def navigation(self) -> xr.Dataset | None:
        """Latitude, longitude [rad], speed, course and height over time."""
        for kind in ("#SPO", "#CPO"):
            if positions := [position for _, position in self._parsed(self.datagrams.rows(kind), _position)]:
                return time_dataset(positions, _seconds(positions), _POSITION)
        return None

    def lever_arm(self, group: str | None = None) -> LeverArm | None:
        """Position of the transmitter re the vessel's reference point, which #SPO has the positions of."""
        for part in ("TRAI_TX1", "TRAI_HD1"):
            names = [f"{part}.{axis}" for axis in "XYZ"]
            if (values := self.setting_values(*names)) is not None:
                return LeverArm((values[0], values[1], values[2]), f"#IIP: {', '.join(names)}; #SPO: reference point")
        return None

    def attitude(self) -> xr.Dataset | None:
        """Attitude, rates, position and velocity over time, of all sensors in the order of the file."""
        tables = [samples for _, samples in self._parsed(self.datagrams.rows("#SKM"), _attitude)]
        return time_dataset(tables, _seconds(tables), _ATTITUDE)

    def sound_speed_profiles(self) -> tuple[xr.Dataset, ...]:
        """Profiles with their time and position."""
        return tuple(profile for _, profile in self._parsed(self.datagrams.rows("#SVP"), _profile))

    def sensors(self) -> Mapping[str, xr.Dataset]:
        """Clock, position error, position at the water line, sound speed at the transducer, depth, heave, by name."""
        datasets = {}
        for kind, (name, part, columns) in _SENSORS.items():
            read = list(self._parsed(self.datagrams.rows(kind), partial(_sensor, kind, part)))
            tables = [rows for _, rows in read]
            timed = "seconds" in (part.names or ())
            times = _seconds(tables) if timed else self.datagrams.time[[row for row, _ in read]]
            if (series := time_dataset(tables, times, columns)) is not None:
                datasets[name] = series
        return datasets

    def _water_column(self, pings: slice) -> xr.Dataset:
        numbers, columns = self._multibeam("#MWC", pings, _water_column)
        variables_read = variables([column.body for column in columns], _PING, ("ping",))
        variables_read |= variables([column.tx for column in columns], _HEAVE, ("ping",))
        variables_read |= variables([column.rx for column in columns], _WATER, ("ping",))
        variables_read |= variables([column.sectors for column in columns], _WATER_SECTOR, ("ping", "tx_sector"))
        variables_read |= variables([column.beams for column in columns], _WATER_BEAM, ("ping", "beam"))
        levels = [column.level for column in columns]
        variables_read["level"] = sample_levels(self.path, levels, "level as recorded, gain included")
        phases = [column.phase for column in columns if column.phase is not None]
        if columns and len(phases) == len(columns):
            samples = ("ping", "beam", "sample")
            variables_read["phase"] = variable(
                samples, stacked(phases), "rad", "phase between the halves of the receiver"
            )
        return ping_dataset("water column", numbers, self._times("#MWC", numbers), variables_read)

    def _times(self, kind: str, numbers: Sequence[int]) -> NDArray[np.float64]:
        return self.datagrams.time[self.datagrams.rows(kind)[list(numbers)]]

    def _multibeam(self, kind: str, pings: slice, parse: Any) -> tuple[list[int], list[Any]]:
        """Numbers and parts of the pings of a kind; those that cannot be read are left out."""
        rows = self.datagrams.rows(kind)
        number = dict(zip(rows.tolist(), range(rows.size), strict=True))
        whole = self._parsed(rows[pings].tolist(), lambda content: content)
        parsed: list[tuple[int, Any]] = []
        for row, content in whole:
            try:
                parsed.append((number[row], parse(self._joined(row, content))))
            except DatagramError as fault:
                self._omit(int(self.datagrams.offset[row]), f"{kind}: {fault}")
        return [ping for ping, _ in parsed], [parts for _, parts in parsed]

    def _joined(self, row: int, content: bytes) -> bytes:
        """Datagram with those that continue it, without the closing length."""
        count = int(records(content, layouts.PARTITION, layouts.HEADER.itemsize)["count"][0])
        joined = content[:-4]
        for part in range(1, count):
            more = row + part
            if more >= self.datagrams.kind.size or self.datagrams.kind[more] != self.datagrams.kind[row] + _CONTINUED:
                raise DatagramError(f"{count} parts are stated, and {part} follow one another")
            joined += self._bytes(int(self.datagrams.offset[more]), int(self.datagrams.size[more]))[_BODY:-4]
        return joined


def _part(content: bytes, layout: np.dtype[Any], offset: int) -> tuple[NDArray[Any], int]:
    """Record that begins with its own size, shape (), and the offset of what follows."""
    size = int.from_bytes(content[offset : offset + 2], "little")
    return records(content, layout, offset, 1, size)[0], offset + size


def _swath(content: bytes) -> _Swath:
    """Parts of an #MRZ datagram; refused where they contradict its length."""
    body, offset = _part(content, layouts.BODY, _BODY)
    ping, offset = _part(content, layouts.PING, offset)
    sector_count, size = int(ping["sectors"]), int(ping["sector_size"])
    sectors = records(content, layouts.SECTOR, offset, sector_count, size)
    rx, offset = _part(content, layouts.RX, offset + sector_count * size)
    offset += int(rx["classes"]) * int(rx["class_size"])
    count, size = int(rx["soundings"]) + int(rx["extra"]), int(rx["sounding_size"])
    soundings = records(content, layouts.SOUNDING, offset, count, size)
    samples = int(soundings["sample_count"].sum(dtype=np.int64))
    offset += count * size
    if offset + 2 * samples > len(content):
        raise DatagramError(f"{samples} samples of the seabed image are stated from byte {offset} of {len(content)}")
    return _Swath(body, ping, sectors, rx, soundings, np.frombuffer(content, "<i2", samples, offset))


def _swath_settings(swaths: Sequence[_Swath]) -> dict[str, xr.Variable]:
    settings = variables([swath.body for swath in swaths], _PING, ("ping",))
    settings |= variables([swath.ping for swath in swaths], _SETTINGS, ("ping",))
    settings |= variables([swath.rx for swath in swaths], _RX, ("ping",))
    return settings | variables([swath.sectors for swath in swaths], _SECTOR, ("ping", "tx_sector"))


def _image(swath: _Swath) -> NDArray[np.float32]:
    """Levels of the seabed image [dB] over (beam, sample), shorter beams padded with NaN."""
    counts = swath.soundings["sample_count"].astype(np.int64)
    filled = np.full((counts.size, counts.max(initial=0)), np.nan, np.float32)
    filled[np.arange(filled.shape[1]) < counts[:, None]] = swath.image * np.float32(0.1)
    return filled


def _water_column(content: bytes) -> _WaterColumn:
    """Parts of an #MWC datagram; refused where they contradict its length."""
    body, offset = _part(content, layouts.BODY, _BODY)
    tx, offset = _part(content, layouts.WATER_TX, offset)
    count, size = int(tx["sectors"]), int(tx["sector_size"])
    sectors = records(content, layouts.WATER_SECTOR, offset, count, size)
    rx, offset = _part(content, layouts.WATER_RX, offset + count * size)
    width = {0: 0, 1: 1, 2: 2}.get(int(rx["phase"]))
    if width is None:
        raise DatagramError(f"phases of an unknown kind, {rx['phase']}")
    size, beams, starts = int(rx["beam_size"]), [], []
    for _ in range(int(rx["beams"])):
        beams.append(records(content, layouts.WATER_BEAM, offset, 1, size))
        starts.append(offset + size)
        offset += size + int(beams[-1]["sample_count"][0]) * (1 + width)
    if offset > len(content):
        raise DatagramError(f"samples are stated up to byte {offset} of {len(content)}")
    table = np.concatenate(beams) if beams else np.empty(0, layouts.WATER_BEAM)
    if size < layouts.WATER_BEAM.itemsize:  # before version 2, without the finer range of the detection
        table["detected_range"] = table["detected"]
    counts = table["sample_count"].tolist()
    level = ragged(content, "i1", starts, counts, 0.5)
    after = [start + count for start, count in zip(starts, counts, strict=True)]
    step = DEGREE * (180 / 128 if width == 1 else 0.01)
    phase = ragged(content, f"<i{width}", after, counts, step) if width else None
    return _WaterColumn(body, tx, sectors, rx, table, level, phase)


def _text(content: bytes) -> str:
    """Text of an #IIP or #IOP datagram."""
    size = int.from_bytes(content[20:22], "little")
    if 20 + size > len(content):
        raise DatagramError(f"a text up to byte {20 + size} of {len(content)} is stated")
    return content[26 : 20 + size].split(b"\0")[0].decode("latin-1")


def _position(content: bytes) -> NDArray[Any]:
    """Position of an #SPO or #CPO datagram, shape (1,)."""
    head, offset = _part(content, layouts.SENSOR, layouts.HEADER.itemsize)
    position = records(content, layouts.POSITION, offset)
    return _without(position, layouts.POSITION.names or ()) if head["status"] & _INVALID else position


def _without(rows: NDArray[Any], names: Sequence[str]) -> NDArray[Any]:
    """Copy of records in which some values are NaN, where they are floats."""
    rows = rows.copy()
    for name in names:
        rows[name] = np.nan if rows[name].dtype.kind == "f" else rows[name]
    return rows


def _sensor(kind: str, part: np.dtype[Any], content: bytes) -> NDArray[Any]:
    """Readings in a datagram of another sensor, shape (n,)."""
    if kind == "#SVT":
        info, offset = _part(content, layouts.SPEED_INFO, layouts.HEADER.itemsize)
        speeds = records(content, part, offset, int(info["count"]), int(info["sample_size"]))
        has = 0 if info["status"] & _INVALID else int(info["contents"]) or ~0  # some programs state no contents
        return _without(speeds, [name for bit, name in enumerate(_SPEED_CONTENTS) if not has >> bit & 1])
    head, offset = _part(content, layouts.BODY if kind == "#CHE" else layouts.SENSOR, layouts.HEADER.itemsize)
    if kind == "#SDE" and content[8] == 0:  # before revision I without the raw depth
        rows = np.zeros(1, part)
        older = records(content, layouts.DEPTH_EARLIER, offset)
        for name in older.dtype.names or ():
            rows[name] = older[name]
        rows["raw"] = np.nan
    else:
        rows = records(content, part, offset)
    return _without(rows, part.names or ()) if kind != "#CHE" and head["status"] & _INVALID else rows


def _attitude(content: bytes) -> NDArray[Any]:
    """Samples of an #SKM datagram, shape (n,); values that are marked as invalid are NaN."""
    info, offset = _part(content, layouts.ATTITUDE_INFO, layouts.HEADER.itemsize)
    return without_invalid(records(content, layouts.ATTITUDE, offset, int(info["count"]), int(info["sample_size"])))


def _profile(content: bytes) -> xr.Dataset:
    """Sound-speed profile of an #SVP datagram."""
    head, offset = _part(content, layouts.PROFILE, layouts.HEADER.itemsize)
    points = records(content, layouts.PROFILE_POINT, offset, int(head["count"])).copy()
    for name in ("temperature", "salinity") if text_of(head["format"]) == "S00" else ():  # not from a CTD
        points[name][points[name] == 0] = np.nan
    with np.errstate(invalid="ignore"):  # signalling NaN of a damaged file
        depth = variable("depth", points["depth"].astype(float), "m", "depth below the water line")
    about = {"time": float(head["seconds"]) or np.nan, "time_units": TIME_UNIT}
    about |= {name: float(head[name]) * DEGREE for name in ("latitude", "longitude") if abs(head[name]) <= 180}
    return xr.Dataset(along("depth", points, _PROFILE), {"depth": depth}, about)


def _seconds(tables: Sequence[NDArray[Any]]) -> NDArray[np.float64]:
    """Times of records that have seconds and nanoseconds [s since 1970]."""
    rows = np.concatenate([np.atleast_1d(part)[["seconds", "nanoseconds"]] for part in tables]) if tables else None
    return np.empty(0) if rows is None else rows["seconds"] + rows["nanoseconds"] * 1e-9
