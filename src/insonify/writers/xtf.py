"""eXtended Triton Format: sidescan pings with navigation and attitude packets.

Triton Imaging (2016), XTF file format, rev. X41, with the usage of its programs: port channels from far to near, speed
in knots, half the sound speed, packets padded to 64 bytes. Amplitudes are rms pressures; samples of 16 bit are
multiples of a step that the note in the file header states, of the largest amplitude in the recording.
"""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments import xtf_layouts as layouts
from insonify.formats.store_description import StoreError
from insonify.sonar.array import LineArray, PlanarArray
from insonify.surveys.survey import START, Survey

MAGIC, PADDING, HEADER = 0xFACE, 64, 1024
KNOT = 1852 / 3600
SONAR, NOTES, ATTITUDE, NAVIGATION = 0, 1, 3, 42
SUB_BOTTOM, PORT, STARBOARD = 0, 1, 2
SLANT_RANGE, DEGREES, METRES = 1, 3, 0
FALSE_EASTING = 500_000.0
"""Easting of a scene's east 0, as in UTM [m]: readers take the position 0, 0 for a missing one."""
VERSION = b"223"
"""Version from which readers take numbers of samples from channel headers; section 4.1."""
MOST_CHANNELS = 60
HALF_POWER = 0.886
"""Width of a uniform line's beam at half power re wavelength over length [rad]; Urick (1983), table 3.2."""
FORMATS = {"<u2": (2, 3), "<f4": (4, 5)}
"""Bytes and stated format of each type of samples."""


def write_xtf(survey: Survey, path: Path) -> None:
    """Write a sidescan recording with samples of 16 bit.

    Args:
        survey: Recording of beams.
        path: File to write.
    """
    survey.require_beams("XTF")
    highest = max(float(amplitude.max(initial=0.0)) for _, amplitude in survey.amplitudes())
    _write(survey, path, "<u2", (highest or 1.0) / 65535)


def write_xtf_float32(survey: Survey, path: Path) -> None:
    """Write a sidescan recording with unrounded samples [uPa], as `write_xtf`."""
    survey.require_beams("XTF")
    _write(survey, path, "<f4", 1.0)


def write_xtf_recorded(survey: Survey, path: Path) -> None:
    """Write the lines of a recorder as they are: counts of up to 16 bit, all other numbers as floats."""
    survey.require_beams("XTF")
    lines = survey.recorded_lines()
    is_count = all(
        np.array_equal(line, np.rint(line)) and line.min(initial=0) >= 0 and line.max(initial=0) <= 65535
        for _, line in lines.amplitudes()
    )
    unit = str(survey.recording["recorded"].attrs.get("units", "1"))
    _write(lines, path, "<u2" if is_count else "<f4", 1.0, f"numbers of the recorder [{unit}]")


def _write(survey: Survey, path: Path, dtype: str, step: float, note: str = "") -> None:
    """Write header, notes and packets; one count of the samples is `step` [uPa], or as a note states."""
    note = note or f"1 count = {step:.9g} uPa, rms amplitude"
    channels = survey.recording.sizes["channel"]
    if channels > MOST_CHANNELS:
        raise StoreError(f"{survey.name}: XTF holds sidescan channels, and this recording has {channels} beams. Write "
                         "it as netCDF (.nc)")  # fmt: skip
    kinds = _kinds(survey)
    packets = _pings(survey, kinds)
    latitude, longitude, heading = survey.pose_on_earth
    if survey.frame.origin is None:  # northing and easting [m] of a scene that is nowhere on Earth
        latitude, longitude = survey.position[:, 0], FALSE_EASTING + survey.position[:, 1]
    with path.open("wb") as file:
        file.write(_header(survey, kinds, dtype, note))
        for text in (note, f"insonify {survey.version}, seed {survey.scenario.seed}"):
            file.write(_notes(survey, text))
        for row, amplitude in survey.amplitudes():
            where = {"latitude": latitude[row], "longitude": longitude[row], "heading": heading[row]}
            file.write(_navigation(survey, row, where) + _attitude(survey, row, where))
            counts = np.rint(amplitude / np.float32(step)) if dtype == "<u2" else amplitude
            counts = np.where(kinds[:, None] == PORT, counts[:, ::-1], counts).astype(dtype)
            file.write(_ping(survey, packets, row, where, counts))


def _kinds(survey: Survey) -> NDArray[np.int64]:
    """Type of each channel: port, starboard, or downwards, by its side or by the bearing of the sonar."""
    side = np.asarray(survey.scenario.sonar.channel_sides)
    mounting = survey.scenario.sonar.mounting
    across = np.cos(mounting.tilt) * np.sin(mounting.bearing)
    alone = SUB_BOTTOM if abs(across) < 0.1 else STARBOARD if across > 0 else PORT
    return np.where(side < 0, PORT, np.where(side > 0, STARBOARD, alone))


def _header(survey: Survey, kinds: NDArray[np.int64], dtype: str, note: str) -> bytes:
    """File header with the description of each channel, a multiple of 1024 bytes."""
    sonar, recording = survey.scenario.sonar, survey.recording
    head = np.zeros((), layouts.FILE)
    about: dict[str, Any] = {
        "format": 123, "system": 1, "program": b"insonify", "version": VERSION, "note": note.encode()[:63],
        "sonar": b"simulated", "name": Path(survey.name).name.encode("latin-1", "replace")[:63],
        "sonar_channels": len(kinds),
        "navigation_units": METRES if survey.frame.origin is None else DEGREES,
    }  # fmt: skip
    for name, value in about.items():
        head[name] = value
    channels = np.zeros(max(len(kinds), 6), layouts.CHANNEL)
    of = channels[: len(kinds)]
    of["kind"], of["number"] = kinds, np.arange(len(kinds))
    of["correction"], of["unipolar"] = SLANT_RANGE, 1
    of["sample_size"], of["sample_format"] = FORMATS[dtype]
    of["samples"] = recording.sizes["time"]
    of["frequency"], of["tilt"] = sonar.pulse.frequency / 1e3, np.degrees(sonar.mounting.tilt)
    of["name"] = [{PORT: b"port", STARBOARD: b"starboard"}.get(kind, b"down") for kind in kinds]
    wave_length = survey.scenario.water.sound_speed / sonar.pulse.frequency
    if isinstance(sonar.transmit, LineArray | PlanarArray):
        length = sonar.transmit.length if isinstance(sonar.transmit, LineArray) else sonar.transmit.width
        of["along_beam_width"] = np.degrees(HALF_POWER * wave_length / length)
    if isinstance(sonar.transmit, PlanarArray):
        of["across_beam_width"] = np.degrees(HALF_POWER * wave_length / sonar.transmit.height)
    for axis, name in enumerate(("forward", "starboard", "down")):
        of[name] = recording["element_position"].values[:, axis]
    of["yaw"] = np.degrees(recording["steer"].values)
    content = head.tobytes() + channels.tobytes()
    return content.ljust(-(-len(content) // HEADER) * HEADER, b"\0")


def _packet(record: NDArray[Any], kind: int, survey_time: float, body: bytes = b"") -> bytes:
    """Packet with magic number, kind, size and date, padded to a multiple of 64 bytes."""
    when = datetime.fromtimestamp(round(survey_time, 6), UTC)
    names = record.dtype.names or ()
    content = -(-(record.dtype.itemsize + len(body)) // PADDING) * PADDING
    dates = {
        "hundredths": when.microsecond // 10_000, "milliseconds": when.microsecond // 1000,
        "microseconds": when.microsecond, "epoch": int(when.timestamp()), "julian_day": when.timetuple().tm_yday,
        "fix_hour": when.hour, "fix_minute": when.minute, "fix_second": when.second,
        "fix_hundredths": when.microsecond // 10_000,
    }  # fmt: skip
    dates |= dict.fromkeys(("tag", "attitude_tag", "fix_tag"), round(1e3 * (survey_time - START)) % 2**32)
    dates |= {name: getattr(when, name) for name in ("year", "month", "day", "hour", "minute", "second")}
    for name, value in ({"magic": MAGIC, "kind": kind, "size": content} | dates).items():
        if name in names:
            record[name] = value
    return (record.tobytes() + body).ljust(content, b"\0")


def _notes(survey: Survey, text: str) -> bytes:
    """Packet with a line of text."""
    record = np.zeros((), layouts.NOTE)
    record["text"] = text.encode("latin-1", "replace")[:199]
    return _packet(record, NOTES, float(survey.time[0]))


def _navigation(survey: Survey, row: int, where: dict[str, float]) -> bytes:
    record = np.zeros((), layouts.NAVIGATION)
    record["latitude"], record["longitude"] = where["latitude"], where["longitude"]
    record["height"], record["flag"] = -survey.position[row, 2], 3
    return _packet(record, NAVIGATION, float(survey.time[row]))


def _attitude(survey: Survey, row: int, where: dict[str, float]) -> bytes:
    record = np.zeros((), layouts.ATTITUDE)
    record["heading"] = record["yaw"] = where["heading"]
    record["pitch"], record["roll"] = np.degrees(survey.attitude[row, 1:])
    return _packet(record, ATTITUDE, float(survey.time[row]))


def _pings(survey: Survey, kinds: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Ping header of each ping, and the channel headers that all pings have."""
    scenario, recording = survey.scenario, survey.recording
    time, speed = survey.sample_time, scenario.water.sound_speed
    heads = np.zeros(survey.rows.size, layouts.PING)
    heads["channels"] = len(kinds)
    heads["ping"] = heads["event"] = recording["ping"].values[survey.rows]
    heads["sound_speed"], heads["computed_sound_speed"] = speed / 2, speed
    heads["speed"] = heads["ship_speed"] = survey.speed / KNOT
    heads["sensor_depth"], heads["altitude"] = survey.position[:, 2], survey.altitude
    heads["pitch"], heads["roll"] = np.degrees(survey.attitude[:, 1:]).T
    channels = np.zeros(len(kinds), layouts.PING_CHANNEL)
    channels["channel"], channels["samples"] = np.arange(len(kinds)), time.size
    duration = survey.sample_interval * time.size
    channels["time_delay"], channels["time_duration"] = time[0], duration
    channels["slant_range"] = (time[0] + duration) * speed / 2
    channels["ping_interval"] = survey.ping_interval
    channels["frequency"] = min(round(scenario.sonar.pulse.frequency / 1e3), 65535)
    return heads, channels


def _ping(
    survey: Survey, packets: tuple[NDArray[Any], NDArray[Any]], row: int, where: dict[str, float], counts: NDArray[Any]
) -> bytes:
    """Sonar packet: its header, and for each channel a header with the samples."""
    head = packets[0][row].copy()
    head["latitude"] = head["ship_latitude"] = where["latitude"]
    head["longitude"] = head["ship_longitude"] = where["longitude"]
    head["heading"] = head["ship_heading"] = where["heading"]
    body = b"".join(header.tobytes() + samples.tobytes() for header, samples in zip(packets[1], counts, strict=True))
    return _packet(np.asarray(head), SONAR, float(survey.time[row]), body)
