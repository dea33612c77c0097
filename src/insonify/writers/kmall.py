"""Kongsberg KMALL and KMWCD: soundings with a seabed image, and the water column, of a simulated multibeam.

Kongsberg (2021), EM datagrams on *.kmall format, 410224 rev. I. The sonar states to be an EM 2042 with one transmitter
and one receiver, since its installation text states all offsets of its arrays: zero here. Levels are those of a
receiver of `SENSITIVITY`.
"""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from functools import reduce
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments import kmall_layouts as layouts
from insonify.formats.store_description import StoreError
from insonify.frames import pose_rotation
from insonify.sonar.array import LineArray, PlanarArray
from insonify.surveys.survey import START, Survey
from insonify.writers.pulse_code import pulse_code
from insonify.writers.swath import Swath, arrays, attitude_at, attitude_times, profile, surface_speed, swaths

Floats = NDArray[np.float64]
PingContent = Callable[[Survey, int, Swath], bytes]
"""Body of the datagram of one ping, from its number and swath."""

MODEL, VERSIONS = 2042, {"#MRZ": 3, "#MWC": 2, "#SKM": 1, "#SVP": 1}
SENSITIVITY = -200.0
"""Sensitivity of the receiver that levels of the water column are those of [dB re 1 V/uPa]."""
GAIN_EXPONENT, REFERENCE = 30, 235.0
"""Range law of the water column, and source level for which its gain has no offset [dB]."""
HALF_POWER = 0.886
"""Width of a uniform line's beam at half power re wavelength over length [rad]; Urick (1983), table 3.2."""
LONGEST_IMAGE = 50
"""Most samples of the seabed image on either side of a detection [1]."""
NO_COURSE = -4.0
"""Course over ground that is not known [deg]."""
LATER_FIELDS = 8
"""Bytes of the ping's part that revision I has behind those of `layouts.PING`."""
BY_AMPLITUDE, BY_PHASE, REJECTED = 1, 2, 2
MOST_SAMPLES = 65535
AVAILABLE = 0b1001111
"""Position and velocity, roll and pitch, heading, heave, and delayed heave of the attitude sensor."""
NO_ACCELERATION, NO_ERRORS = 1 << 4, 1 << 5
"""Bits of its status: these fields are invalid."""


def write_kmall(survey: Survey, path: Path) -> None:
    """Write soundings and seabed image with installation, profile, position and attitude.

    Args:
        survey: Recording of a multibeam's elements.
        path: File to write.
    """
    _write_pings(survey, path, "#MRZ", _soundings)


def write_kmwcd(survey: Survey, path: Path) -> None:
    """Write the water column of all beams in half decibels, with installation, profile, position and attitude.

    Args:
        survey: Recording of a multibeam's elements.
        path: File to write.
    """
    _write_pings(survey, path, "#MWC", _water_column)


def _write_pings(survey: Survey, path: Path, kind: str, content: PingContent) -> None:
    """File of one kind of datagram for each ping, behind those that describe the survey."""
    last = _first_sample(survey) + survey.recording.sizes["time"]
    if last > MOST_SAMPLES:
        raise StoreError(f"{survey.name}: KMALL counts samples up to {MOST_SAMPLES} from the start of transmission, "
                         f"and the last one is number {last}. Shorten track.window or reduce sonar.receiver.bandwidth "
                         "in the scenario, or write it as netCDF (.nc)")  # fmt: skip
    with path.open("wb") as file:
        _write_survey(survey, file)
        for number, swath in enumerate(swaths(survey)):
            _put(file, "#SPO", survey.time[number], _position(survey, number))
            _put(file, kind, survey.time[number], content(survey, number, swath))


def _write_survey(survey: Survey, file: BinaryIO) -> None:
    """Datagrams that stand before the pings."""
    start = float(survey.time[0])
    _put(file, "#IIP", start, _text(_installation(survey)))
    _put(file, "#IOP", start, _text(_runtime(survey)))
    _put(file, "#SVP", start, _profile(survey))
    for first in range(0, survey.rows.size + 1, 100):
        _put(file, "#SKM", float(attitude_times(survey)[first]), _attitude(survey, slice(first, first + 100)))


def _put(file: BinaryIO, kind: str, time: float, body: bytes) -> None:
    """Datagram with its length at both ends."""
    seconds, nanoseconds = _clock(np.array([time]))
    size = layouts.HEADER.itemsize + len(body) + 4
    head = _record(
        layouts.HEADER, size=size, kind=kind.encode(), version=VERSIONS.get(kind, 0), system=40, model=MODEL,
        seconds=seconds[0], nanoseconds=nanoseconds[0],
    )  # fmt: skip
    file.write(head + body + size.to_bytes(4, "little"))


def _record(layout: np.dtype[Any], rows: int = 1, /, **fields: Any) -> bytes:
    """Bytes of records whose size field, where they have one, is their own size."""
    table = np.zeros(rows, layout)
    if "size" in (layout.names or ()):
        table["size"] = layout.itemsize
    for name, value in fields.items():
        table[name] = value
    return table.tobytes()


def _clock(time: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Whole seconds and nanoseconds of times, to the microsecond."""
    since = np.round((time - START) * 1e6).astype(np.int64)
    return START + since // 1_000_000, since % 1_000_000 * 1000


def _text(text: str) -> bytes:
    content = text.encode("ascii", "replace")
    content += bytes(-len(content) % 4)
    return (6 + len(content)).to_bytes(2, "little") + bytes(4) + content


def _installation(survey: Survey) -> str:
    """Lever arms in metres, forward, starboard, down, and the mean water line."""
    arms = arrays(survey)
    tx, rx = ("X={:.3f};Y={:.3f};Z={:.3f};R=0.000;P=0.000;H=0.000".format(*arm + 0.0)
              for arm in (arms.transmitter, arms.receiver))  # fmt: skip
    inner = ";".join(f"I{part}{axis}=0.00000" for part in "PCS" for axis in "XYZ")
    sensor = "X=0.000;Y=0.000;Z=0.000"
    return (
        f"OSCV:Empty,EMXV:EM{MODEL},\nPU_0,\nSN=1,\nIP=127.0.0.1:0xffff0000,\nUDP=1997,\nTYPE=simulated,\nVERSIONS:,\n"
        f"CPU:insonify {survey.version},\nVERSIONS-END,\nSERIALno:\nTX:1,\nRX:1,\n"
        f"SERIALno-END,\nKMALL:Rev I 2021-09-01,\nSYSTEM:EM {MODEL} - Single Tx single Rx,"
        f"TRAI_TX1:N=1;{tx};S={_widths(survey)[0]:.1f};{inner},TRAI_RX1:N=1;{rx};G=0.00;IX=0.00000;IY=0.00000;IZ=0.00000,"
        f"POSI_1:{sensor};D=0.000;G=WGS84;T=Datagram;C=On;F=GGA;Q=Off;U=ACTIVE,POSI_2:U=NOT_SET,POSI_3:U=NOT_SET,"
        f"ATTI_1:{sensor};R=0.000;P=0.000;H=0.000;D=0.000;M=Rotation;F=KM Binary;U=ACTIVE,ATTI_2:U=NOT_SET,"
        f"EMXI:SWLZ={-survey.position[:, 2].mean():.3f},\n"
    )


def _runtime(survey: Survey) -> str:
    pulse, widest = survey.scenario.sonar.pulse, 64.0
    return (
        f"Sector coverage\nMax angle Port: {widest:.1f}\nMax angle Starboard: {widest:.1f}\n\nDepth settings\n"
        f"Frequency: {pulse.frequency / 1e3:.0f}kHz\nDual swath: Off\n\nTransmit Control\nPitch stabilisation: Off\n\n"
        f"Water Column: On\nWater column: {GAIN_EXPONENT} log R\nWater column: {_offset(survey)} dB Offset\n"
        "Water phase data: Off\n\nSimulation setup\nEnable Simulation: On\n"
    )


def _profile(survey: Survey) -> bytes:
    depth, speed = profile(survey)
    latitude, longitude, _ = survey.pose_on_earth
    head = _record(layouts.PROFILE, count=depth.size, format=b"S00", seconds=int(survey.time[0]),
                   latitude=latitude[0], longitude=longitude[0])  # fmt: skip
    return head + _record(layouts.PROFILE_POINT, depth.size, depth=depth, sound_speed=speed)  # S00: the rest is 0


def _position(survey: Survey, number: int) -> bytes:
    latitude, longitude, _ = (column[number] for column in survey.pose_on_earth)
    seconds, nanoseconds = _clock(survey.time[number : number + 1])
    fix = _record(
        layouts.POSITION, seconds=seconds, nanoseconds=nanoseconds, latitude=latitude, longitude=longitude,
        speed=survey.speed[number], course=_course(survey, number), ellipsoid_height=-999.0,
    )  # fmt: skip
    return _record(layouts.SENSOR, status=1) + fix + _gga(survey.time[number], latitude, longitude)


def _course(survey: Survey, number: int) -> float:
    """True course over ground of the logged track [deg]; `NO_COURSE` where it stands still."""
    if survey.speed[number] == 0:
        return NO_COURSE
    north, east = (np.gradient(survey.position[:, axis], survey.time)[number] for axis in (0, 1))
    turn = survey.frame.convergence(*survey.position[number : number + 1, :2].T)[0]
    return float(np.degrees(np.arctan2(east, north) + turn) % 360)


def _gga(time: float, latitude: float, longitude: float) -> bytes:
    """Sentence of a position receiver, padded to four bytes."""
    clock = datetime.fromtimestamp(round(time, 2), UTC).strftime("%H%M%S.%f")[:9]
    text_fields = []
    for angle, digits, letters in ((float(latitude), 2, "NS"), (float(longitude), 3, "EW")):
        degrees, minutes = divmod(round(abs(angle) * 60e6), 60_000_000)
        text_fields.append(f"{degrees:0{digits}d}{minutes / 1e6:09.6f},{letters[int(angle < 0)]}")
    text = f"GPGGA,{clock},{text_fields[0]},{text_fields[1]},4,10,0.9,0.0,M,0.0,M,,"
    check = reduce(lambda total, letter: total ^ letter, text.encode())
    content = f"${text}*{check:02X}\r\n".encode()
    return content + bytes(-len(content) % 4)


def _attitude(survey: Survey, rows: slice) -> bytes:
    """Attitude at pings, and one interval behind the last: heading, pitch, roll, heave about the mean depth, rates."""
    time, position = attitude_times(survey), survey.position
    after = position[-1:] + np.diff(position, axis=0)[-1:].sum(axis=0)
    position, pose = np.concatenate([position, after]), attitude_at(survey, time)
    velocity, turn_rate = (np.gradient(values, time - START, axis=0)[rows] for values in (position, pose[:, :3]))
    position, pose, time = position[rows], pose[rows], time[rows]
    latitude, longitude = survey.frame.geodetic(position[:, 0], position[:, 1])
    turn = survey.frame.convergence(position[:, 0], position[:, 1])
    heave = pose[:, 3] - survey.position[:, 2].mean()
    degrees, seconds, nanoseconds = np.degrees(pose[:, :3]), *_clock(time)
    to_north, to_east = np.cos(turn), np.sin(turn)
    samples = _record(
        layouts.ATTITUDE, time.size, kind=b"#KMB", version=1, seconds=seconds, nanoseconds=nanoseconds,
        status=NO_ACCELERATION | NO_ERRORS, latitude=latitude, longitude=longitude, ellipsoid_height=-999.0,
        yaw=(degrees[:, 0] + np.degrees(turn)) % 360, pitch=degrees[:, 1], roll=degrees[:, 2],
        heave=heave, yaw_rate=np.degrees(turn_rate[:, 0]), pitch_rate=np.degrees(turn_rate[:, 1]),
        roll_rate=np.degrees(turn_rate[:, 2]), velocity_down=velocity[:, 2],
        velocity_north=velocity[:, 0] * to_north - velocity[:, 1] * to_east,
        velocity_east=velocity[:, 0] * to_east + velocity[:, 1] * to_north,
        delayed_seconds=seconds, delayed_nanoseconds=nanoseconds, delayed_heave=heave,
    )  # fmt: skip
    info = _record(layouts.ATTITUDE_INFO, status=1, format=1, count=time.size, sample_size=layouts.ATTITUDE.itemsize,
                   contents=AVAILABLE)  # fmt: skip
    return info + samples


def _body(survey: Survey, number: int) -> bytes:
    """Parts that open a datagram of a ping."""
    ping = int(survey.recording["ping"].values[survey.rows[number]])
    return _record(layouts.PARTITION, count=1, number=1) + _record(
        layouts.BODY, ping=ping % 65536, fans=1, swaths=1, rx_arrays=1
    )


def _soundings(survey: Survey, number: int, swath: Swath) -> bytes:
    """Body of an #MRZ datagram."""
    scenario, pulse, rate = survey.scenario, survey.scenario.sonar.pulse, 1 / survey.sample_interval
    latitude, longitude, heading = (float(column[number]) for column in survey.pose_on_earth)
    widths = _widths(survey)
    edge = float(np.degrees(swath.angle[-1]))
    depth, lean = float(survey.position[number, 2]), pose_rotation(0.0, *survey.attitude[number, 1:])
    across = np.clip(np.nan_to_num(swath.sounding[:, 1]), -32768, 32767)
    ping = _record(
        layouts.PING, ping_rate=1 / (survey.ping_interval or 1.0), beam_spacing=1, depth_mode=100,
        frequency_mode=pulse.frequency, lowest_frequency=pulse.frequency, highest_frequency=pulse.frequency,
        pulse_length=pulse.duration, effective_pulse_length=1 / _bandwidth(survey), bandwidth=_bandwidth(survey),
        absorption=1e3 * _absorption(survey), port_metres=round(across.min()), starboard_metres=round(across.max()),
        port_edge=edge, starboard_edge=-edge, port_coverage=edge, starboard_coverage=-edge, tx_beam_width=widths[0],
        rx_beam_width=widths[1], sectors=1, sector_size=layouts.SECTOR.itemsize, heading=heading,
        sound_speed=surface_speed(survey, number), transducer_depth=depth + (lean @ arrays(survey).transmitter)[2],
        water_level=-depth, position_method=1, latitude=latitude, longitude=longitude, ellipsoid_height=-999.0,
    )  # fmt: skip
    about = np.frombuffer(ping, layouts.PING).copy()
    about["size"] += LATER_FIELDS
    sector = _record(
        layouts.SECTOR, source_level=scenario.sonar.source_level_db, frequency=pulse.frequency,
        bandwidth=_bandwidth(survey), pulse_length=pulse.duration, effective_pulse_length=1 / _bandwidth(survey),
        waveform=_waveform(survey),
    )  # fmt: skip
    table, image = _detections(survey, number, swath)
    rx = _record(
        layouts.RX, soundings=len(table), valid=int((table["type"] == 0).sum()), water_column_rate=rate,
        sounding_size=layouts.SOUNDING.itemsize, seabed_image_rate=rate, class_size=4,
    )  # fmt: skip
    parts = _body(survey, number), about.tobytes(), bytes(LATER_FIELDS), sector, rx, table.tobytes(), image.tobytes()
    return b"".join(parts)


def _detections(survey: Survey, number: int, swath: Swath) -> tuple[NDArray[Any], NDArray[np.int16]]:
    """Table of soundings, and the seabed image of all beams [0.1 dB]."""
    detected = np.isfinite(swath.travel_time)
    point = np.where(detected[:, None], swath.sounding, 0.0)
    table = np.zeros(swath.angle.size, layouts.SOUNDING)
    heading = float(survey.attitude[number, 0])
    north, east = survey.position[number, :2]
    world_position = (north + point[:, 0] * np.cos(heading) - point[:, 1] * np.sin(heading),
             east + point[:, 0] * np.sin(heading) + point[:, 1] * np.cos(heading))  # fmt: skip
    latitude, longitude = survey.frame.geodetic(*world_position)
    vessel = [column[number] for column in survey.pose_on_earth]
    time, start = np.where(detected, swath.travel_time, 0.0), survey.sample_time[0]
    gain = _strength_gain(survey, swath)
    strength = np.maximum(swath.level, -300.0) + gain - survey.scenario.sonar.source_level_db
    sample = np.clip(np.rint((time - start) / survey.sample_interval).astype(int), 0, strength.shape[1] - 1)
    near, first = _image_spans(swath, sample, detected), _first_sample(survey)
    level, gain = (np.where(detected, values[np.arange(time.size), sample], 0.0) for values in (strength, gain))
    speed = float(surface_speed(survey, number))
    spread = np.where(detected, np.nan_to_num(swath.deviation) * speed / 2, 0.0)
    fields = {
        "index": np.arange(time.size), "type": np.where(detected, 0, REJECTED), "range_factor": 100.0,
        "method": np.where(detected, np.where(swath.by_phase, BY_PHASE, BY_AMPLITUDE), 0), "travel_time": time,
        "quality": 100 * spread / np.maximum(np.linalg.norm(point, axis=1), 1e-3), "sensitivity": SENSITIVITY,
        "vertical_uncertainty": spread * np.cos(swath.angle),
        "horizontal_uncertainty": spread * np.abs(np.sin(swath.angle)),
        "water_column_beam": np.arange(time.size), "water_column_sample": np.where(detected, first + sample, 0),
        "water_column_angle": -np.degrees(swath.vertical_angle), "absorption": 1e3 * _absorption(survey),
        "level1": level, "level2": level, "tvg": gain, "source_level": survey.scenario.sonar.source_level_db,
        "angle": -np.degrees(swath.angle), "delta_latitude": np.where(detected, latitude - vessel[0], 0.0),
        "delta_longitude": np.where(detected, longitude - vessel[1], 0.0), "forward": point[:, 0],
        "starboard": point[:, 1], "down": point[:, 2], "first_sample": np.where(detected, first + near[:, 0], 0),
        "centre_sample": np.where(detected, sample - near[:, 0], 0),
        "sample_count": near[:, 1] - near[:, 0],
    }  # fmt: skip
    for name, values in fields.items():
        table[name] = values
    rows = [strength[beam, start:stop] for beam, (start, stop) in enumerate(near)]
    image = np.rint(10 * np.clip(np.concatenate(rows), -3276, 3276)).astype("<i2")
    return table, image


def _image_spans(swath: Swath, sample: NDArray[np.int64], detected: NDArray[np.bool_]) -> NDArray[np.int64]:
    """First and last sample of the image of each beam, half-way to its neighbours' detections, shape (beam, 2)."""
    step = np.abs(np.gradient(sample.astype(float)))
    half = np.clip(np.ceil(step / 2), 1, LONGEST_IMAGE).astype(int)
    low, high = np.maximum(sample - half, 0), np.minimum(sample + half + 1, swath.level.shape[1])
    return np.where(detected[:, None], np.stack([low, high], axis=1), 0)


def _strength_gain(survey: Survey, swath: Swath) -> Floats:
    """Gain from echo level to backscatter strength plus source level at every sample [dB], shape (beam, time).

    It is the sonar equation with the area of pulse or beams on a flat bed. Source: Urick (1983), Principles of
    Underwater Sound, ch. 8.
    """
    speed, (along, across) = survey.scenario.water.sound_speed, np.radians(_widths(survey))
    slant = np.maximum(survey.sample_time * speed / 2, 0.1)
    angle = np.maximum(np.abs(swath.vertical_angle), 1e-3)[:, None]
    pulse = speed / 2 / _bandwidth(survey) / np.sin(angle)
    beam = across * slant / np.cos(np.minimum(angle, 1.4)) ** 2
    area = along * slant * np.minimum(pulse, beam)
    return np.asarray(40 * np.log10(slant) + 2 * _absorption(survey) * slant - 10 * np.log10(area), float)


def _first_sample(survey: Survey) -> int:
    """Number of the first sample, counted from the start of transmission."""
    return round(float(survey.sample_time[0]) / survey.sample_interval)


def _water_column(survey: Survey, number: int, swath: Swath) -> bytes:
    """Body of an #MWC datagram."""
    rate, first = 1 / survey.sample_interval, _first_sample(survey)
    counts = np.clip(np.rint(2 * (swath.level + water_column_gain(survey))), -128, 127).astype(np.int8)
    tx = _record(layouts.WATER_TX, sectors=1, sector_size=layouts.WATER_SECTOR.itemsize,
                 heave=survey.position[number, 2] - survey.position[:, 2].mean())  # fmt: skip
    sector = _record(layouts.WATER_SECTOR, frequency=survey.scenario.sonar.pulse.frequency,
                     beam_width=_widths(survey)[0])  # fmt: skip
    rx = _record(
        layouts.WATER_RX, beams=len(counts), beam_size=layouts.WATER_BEAM.itemsize, tvg_exponent=GAIN_EXPONENT,
        tvg_offset=_offset(survey), sample_rate=rate, sound_speed=surface_speed(survey, number),
    )  # fmt: skip
    return b"".join([_body(survey, number), tx, sector, rx, *_beams(swath, counts, first, rate)])


def _beams(swath: Swath, counts: NDArray[np.int8], first: int, rate: float) -> Iterator[bytes]:
    """Beams of the water column with their samples, whose numbers count from the start of transmission."""
    detected = np.nan_to_num(swath.travel_time) * rate
    for beam, samples in enumerate(counts):
        yield _record(
            layouts.WATER_BEAM, angle=-np.degrees(swath.vertical_angle[beam]), first_sample=first,
            detected=round(float(detected[beam])),
            sample_count=samples.size, detected_range=detected[beam],
        )  # fmt: skip
        yield samples.tobytes()


def water_column_gain(survey: Survey) -> Floats:
    """Gain from levels re 1 uPa to the stored ones [dB], shape (time,): sensitivity, 30 log r, absorption, offset."""
    slant = np.maximum(survey.sample_time * survey.scenario.water.sound_speed / 2, 0.1)
    law = GAIN_EXPONENT * np.log10(slant) + 2 * _absorption(survey) * slant
    return np.asarray(SENSITIVITY + law + _offset(survey), float)


def _offset(survey: Survey) -> int:
    """Offset of the gain of the water column, by which echoes are in the range of its samples [dB]."""
    return int(np.clip(round(REFERENCE - survey.scenario.sonar.source_level_db), -128, 127))


def _absorption(survey: Survey) -> float:
    """Absorption at the centre frequency [dB/m]."""
    return float(survey.scenario.water.absorption(survey.scenario.sonar.pulse.frequency))


def _waveform(survey: Survey) -> int:
    """Code of the pulse: 0 CW, 1 rising FM, 2 falling FM."""
    sweep = 1 if survey.scenario.sonar.pulse.sweep == "up" else 2
    return pulse_code(survey, {"cw": 0, "linear sweep": sweep, "hyperbolic sweep": sweep}, "KMALL")


def _bandwidth(survey: Survey) -> float:
    pulse = survey.scenario.sonar.pulse
    return pulse.bandwidth or 1 / pulse.duration


def _widths(survey: Survey) -> tuple[float, float]:
    """Beam width of the transmitter along the track, and of the receiver across it [deg]."""
    sonar = survey.scenario.sonar
    wave = survey.scenario.water.sound_speed / sonar.pulse.frequency
    along = sonar.transmit.height if isinstance(sonar.transmit, PlanarArray) else 0.0
    line = sonar.receive
    across = line.length if isinstance(line, LineArray) else getattr(line, "width", 0.0)
    along_deg, across_deg = (np.degrees(HALF_POWER * wave / size) if size else 180.0 for size in (along, across))
    return min(float(along_deg), 180.0), min(float(across_deg), 180.0)
