"""Simrad EK80 configuration, environment and parameters, which are XML in datagrams."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments.columns import DEGREE
from insonify.formats.instruments.instrument_file import DatagramError, Setting

MAX_XML = 1 << 26
"""Longest text that is parsed [bytes]."""
SAMPLE_RATES = {"WBT": 1.5e6, "WBT MINI": 1.5e6, "WBT TUBE": 1.5e6, "WBAT": 1.5e6, "WBT HP": 187.5e3, "WBT LF": 93.75e3,
                "SBT": 50e3, "GPT": 500e3}  # fmt: skip
"""Sample rates [Hz] of transceivers, for files of earlier versions that do not state them."""
CALIBRATION = {
    "gain_db": ("Gain", "dB", 1.0, "gain of the transducer"),
    "transducer_impedance": ("Impedance", "ohm", 1.0, "impedance of the transducer"),
    "beam_width_alongship": ("BeamWidthAlongship", "rad", DEGREE, "two-way beam width, fore and aft"),
    "beam_width_athwartship": ("BeamWidthAthwartship", "rad", DEGREE, "two-way beam width, athwart"),
    "angle_offset_alongship": ("AngleOffsetAlongship", "rad", DEGREE, "angle of the beam axis, positive forward"),
    "angle_offset_athwartship": ("AngleOffsetAthwartship", "rad", DEGREE, "angle of the axis, positive starboard"),
}
"""Variables over frequency of a calibrated channel: name in the file, unit, factor to the unit, meaning."""
ENVIRONMENT = {
    "temperature": ("Temperature", "degC", "temperature of the water"),
    "salinity": ("Salinity", "g/kg", "salinity"),
    "acidity": ("Acidity", "1", "pH"),
    "environment_depth": ("Depth", "m", "depth that the settings of the water refer to"),
    "environment_sound_speed": ("SoundSpeed", "m/s", "sound speed of the water"),
    "latitude_setting": ("Latitude", "deg", "latitude as set"),
    "drop_keel_offset": ("DropKeelOffset", "m", "offset of the drop keel"),
    "water_level": ("WaterLevelDraft", "m", "water level re the origin of the vessel, positive down"),
}
"""Settings of the environment: name in the file, unit, meaning."""
_UNITS = {
    "Frequency": ("Hz", 1.0), "Gain": ("dB", 1.0), "EquivalentBeamAngle": ("dB re 1 sr", 1.0), "MaxTxPower": ("W", 1.0),
    "Impedance": ("ohm", 1.0), "BeamWidth": ("rad", DEGREE), "AngleOffset": ("rad", DEGREE),
    "TransducerAlpha": ("rad", DEGREE), "TransducerOffset": ("m", 1.0),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Channel:
    """Transceiver and transducer of one channel, as the configuration states them."""

    transceiver: Mapping[str, str]
    channel: Mapping[str, str]
    transducer: Mapping[str, str]
    by_frequency: Sequence[Mapping[str, str]]
    """Calibration at several frequencies."""
    mounting: Mapping[str, str]
    """Position and angles of the transducer on the vessel."""

    @property
    def frequency(self) -> float:
        """Nominal frequency [Hz]."""
        return number(self.transducer, "Frequency")

    def by_pulse(self, name: str, duration: float, *, swept: bool) -> float:
        """Value of a list with one entry for each duration of the pulse, NaN where there is none.

        Args:
            name: "Gain" or "SaCorrection".
            duration: Duration of the pulse [s].
            swept: True for a frequency-modulated pulse.
        """
        values = numbers(self.transducer.get(name, ""))
        fields = ("PulseDurationFM",) if swept else ("PulseDuration", "PulseLength")  # the latter before 2018
        durations = numbers(next((self.channel[field] for field in fields if field in self.channel), ""))
        count = min(values.size, durations.size)
        if not count or not duration > 0:
            return math.nan
        with np.errstate(all="ignore"):
            return float(values[int(np.argmin(np.abs(durations[:count] - duration)))])

    def calibration(self) -> dict[str, NDArray[np.float64]]:
        """Frequency [Hz] and the values of `CALIBRATION` at it, by ascending frequency; empty without calibration."""
        order = sorted(self.by_frequency, key=lambda row: number(row, "Frequency"))
        table = {"calibration_frequency": np.array([number(row, "Frequency") for row in order])}
        for name, (field, _, scale, _) in CALIBRATION.items():
            table[name] = scale * np.array([number(row, field) for row in order])
        return table if order else {}


def parse_xml(content: bytes) -> ElementTree.Element:
    """Root of the XML in a datagram.

    Raises:
        DatagramError: It is not well formed, too long, or defines entities, which could expand without limit.
    """
    if len(content) > MAX_XML:
        raise DatagramError(f"{len(content)} bytes of XML; {MAX_XML} is the most")
    text = content.split(b"\0", 1)[0].decode("utf-8", "replace").strip()
    if "<!DOCTYPE" in text:
        raise DatagramError("XML with a DOCTYPE is refused")
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as fault:
        raise DatagramError(f"XML that is not well formed: {fault}") from None


def channels(root: ElementTree.Element) -> dict[str, Channel]:
    """Channels of a configuration by their identity."""
    mountings = {
        (row.get("TransducerName"), row.get("TransducerSerialNumber")): row.attrib
        for row in root.iterfind("Transducers/Transducer")
    }
    result = {}
    for transceiver in root.iterfind("Transceivers/Transceiver"):
        for channel in transceiver.iterfind("Channels/Channel"):
            transducer = channel.find("Transducer")
            attributes = {} if transducer is None else transducer.attrib
            table = [row.attrib for row in channel.iterfind("Transducer/FrequencyPar")]
            mounting = mountings.get((attributes.get("TransducerName"), attributes.get("SerialNumber")), {})
            parts = transceiver.attrib, channel.attrib, attributes, table, mounting
            result[channel.get("ChannelID", "")] = Channel(*parts)
    return result


def parameters(root: ElementTree.Element, channel: str) -> Mapping[str, str]:
    """Settings of a ping of one channel among those of a datagram; empty where it has none.

    Args:
        root: Parameters of one or more channels.
        channel: Identity of the channel.
    """
    rows = [row.attrib for row in root.iterfind("Channel") if row.get("ChannelID", channel) == channel]
    return rows[0] if rows else {}


def position_sensor(root: ElementTree.Element) -> Mapping[str, str] | None:
    """Name and place on the vessel (X forward, Y starboard, Z down [m]) of the first receiver of positions, or None.

    Args:
        root: Configuration, in which each receiver has the priority of its latitudes.
    """
    ranked = [
        (number(value.attrib, "Priority"), sensor.attrib)
        for sensor in root.iterfind("ConfiguredSensors/Sensor")
        for telegram in sensor.iterfind("Telegram")
        for value in telegram.iterfind("Value")
        if telegram.get("Enabled", "1") == "1" and value.get("Name") == "Latitude"
    ]
    known = [(rank, sensor) for rank, sensor in ranked if rank == rank]  # not NaN
    return min(known, key=lambda pair: pair[0])[1] if known else None


def channel_settings(name: str, channel: Channel, offset: int) -> list[Setting]:
    """Settings of one channel, each named after the group and the field of the configuration."""
    parts = {"transceiver": channel.transceiver, "channel": channel.channel, "transducer": channel.transducer,
             "mounting": channel.mounting}  # fmt: skip
    return [
        Setting(f"{name}.{part}.{field}", *_valued(field, text), "XML0 Configuration", offset)
        for part, fields in parts.items()
        for field, text in fields.items()
    ]


def _valued(field: str, text: str) -> tuple[float | str, str]:
    """A finite number in SI and its unit, else the text in one line and no unit."""
    value = number({"": text}, "")
    if not math.isfinite(value):
        return " ".join(text.split()), ""
    unit, scale = next((known for part, known in _UNITS.items() if part in field), ("1", 1.0))
    return value * scale, unit


def number(attributes: Mapping[str, str], name: str) -> float:
    """A number among the attributes, NaN where there is no finite one."""
    try:
        value = float(attributes.get(name, "nan"))
    except ValueError:
        return math.nan
    return value if abs(value) < 1e30 else math.nan


def numbers(text: str) -> NDArray[np.float64]:
    """Numbers of a list "1;2;3", NaN for what is none, shape (n,)."""
    return np.array([number({"": part}, "") for part in text.split(";")] if text else [], float)
