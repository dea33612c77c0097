"""SONAR-netCDF4 2.0 of the International Council for the Exploration of the Sea, with complex samples.

ICES (2022), The SONAR-netCDF4 convention for sonar data, version 2.0, Cooperative Research Report 341, tables of the
groups. Samples are received rms pressures. Equation type 2 takes the root of two off their amplitudes, which are peaks
to it: it holds with a sensitivity of -3 dB re 1/uPa and no gain.
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.frames import mounting_rotation, pose_rotation
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import beams
from insonify.sonar.modulation import Form
from insonify.sonar.pulse import energy_duration
from insonify.sonar.sonar import Sonar
from insonify.surveys.survey import Survey
from insonify.writers.pulse_code import pulse_code
from insonify.writers.sonar_netcdf4_attributes import (
    ATTITUDE,
    BEAMS,
    ENVIRONMENT,
    GYRO,
    PLATFORM,
    POSITION,
    SUBSTITUTE,
    Attributes,
)

Floats = NDArray[np.float64]

HALF_POWER = 0.886
"""Width of a uniform line's beam at half power re wavelength over length [rad]; Urick (1983), table 3.2."""
TWO_WAY = 2 / 3
"""Integral of a uniform line's two-way pattern over the sine re wavelength over length [1]: that of sinc^4."""
SENSOR = "navigation"
"""Name of the one position and attitude sensor."""
ENUMS = {
    "beam_stabilisation_t": {"not_stabilised": 0, "stabilised": 1},
    "beam_t": {"single": 0, "split_aperture_angles": 1, "split_aperture_4_subbeams": 2, "split_aperture_3_subbeams": 3,
               "split_aperture_3_1_subbeams": 4},
    "conversion_equation_t": {f"type_{number}": number for number in range(1, 7)},
    "transmit_t": {"CW": 0, "LFM": 1, "HFM": 2},
}  # fmt: skip
TRANSMIT_TYPES: dict[Form, int] = {"cw": 0, "linear sweep": 1, "hyperbolic sweep": 2}
RMS_SENSITIVITY = -10 * np.log10(2.0)
"""Sensitivity of samples that are rms values, in an equation that takes them for peaks [dB re 1/uPa]."""
LEVEL = 1e-7
"""Cosine of theta below which a beam is level [1]."""
TRANSMITS, RECEIVES, BOTH = 1, 0, 3
"""Functions of transducers."""


def write_sonar_netcdf4(survey: Survey, path: Path) -> None:
    """Write a recording with its platform, environment and beams.

    Args:
        survey: Recording on one platform.
        path: File to write.
    """
    import netCDF4

    survey.require_one_platform("SONAR-netCDF4")
    next(survey.amplitudes())  # refuses the lines of a recorder, before anything is written
    with netCDF4.Dataset(path, "w") as file:
        file.setncatts(_top(survey))
        file.createGroup("Annotation")
        file.createGroup("Vendor_specific").setncatts({"insonify_scenario": survey.recording.attrs["scenario"]})
        _provenance(survey, file)
        _environment(survey, file)
        _platform(survey, file)
        sonar = file.createGroup("Sonar")
        sonar.setncatts({"sonar_manufacturer": "simulated", "sonar_model": "simulated", "sonar_serial_number": "",
                         "sonar_software_name": "insonify", "sonar_software_version": survey.version,
                         "sonar_type": "omni-sonar"})  # fmt: skip
        types: dict[str, Any] = {name: sonar.createEnumType(np.int8, name, codes) for name, codes in ENUMS.items()}
        types["sample_t"] = sonar.createVLType(np.float32, "sample_t")
        _beam_group(survey, sonar.createGroup("Beam_group1"), types)


def _put(
    group: Any, name: str, kind: Any, dims: tuple[str, ...], values: Any, about: Attributes, fill: Any = None
) -> None:
    """Variable with its attributes; one value is repeated over the dimensions."""
    variable = group.createVariable(name, kind, dims, fill_value=fill)
    variable.setncatts(dict(about))
    shape = tuple(variable.shape)
    if kind is str:
        variable[:] = np.array(values, object)
    else:
        variable[...] = np.broadcast_to(np.asarray(values), shape) if shape else values


def _top(survey: Survey) -> dict[str, str]:
    title = survey.scenario.title or "Recording of a simulated sonar"
    return {
        "Conventions": "CF-1.7, SONAR-netCDF4-2.0, ACDD-1.3", "date_created": _now(),
        "keywords": "sonar, simulation", "sonar_convention_authority": "ICES",
        "sonar_convention_name": "SONAR-netCDF4", "sonar_convention_version": "2.0", "title": title,
        "summary": f"{title}. Simulated: times count from 2000-01-01, samples are received pressures in uPa.",
    }  # fmt: skip


def _now() -> str:
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def _provenance(survey: Survey, file: Any) -> None:
    group = file.createGroup("Provenance")
    group.setncatts({"conversion_software_name": "insonify", "conversion_software_version": survey.version,
                     "conversion_time": _now(), "history": f"{_now()} insonify export"})  # fmt: skip
    group.createDimension("filenames", 1)
    names = {"long_name": "Source filenames"}
    _put(group, "source_filenames", str, ("filenames",), [Path(survey.name).name], names)


def _environment(survey: Survey, file: Any) -> None:
    water, frequency = survey.scenario.water, survey.scenario.sonar.pulse.frequency
    group = file.createGroup("Environment")
    group.createDimension("frequency", 1)
    values = {"frequency": frequency, "absorption_indicative": float(water.absorption(frequency))}
    for name, value in values.items():
        _put(group, name, "f4", ("frequency",), value, ENVIRONMENT[name])
    speed = "sound_speed_indicative"
    _put(group, speed, "f4", (), water.sound_speed, ENVIRONMENT[speed])


def transducers(survey: Survey) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Transmit and receive transducers: elements where the channels are elements.

    Args:
        survey: Recording on one platform.

    Returns:
        Positions, forward, starboard, down [m], shape (transducer, 3); the numbers of the transmitting and of the
        receiving one of each channel, each of shape (channel,).
    """
    receiving = np.asarray(survey.recording["element_position"].values, float)
    sides = survey.scenario.sonar.side_sonars
    sending = np.repeat([side.transmit.offset for side in sides], [side.beam_count for side in sides], axis=0)
    ends = np.round(np.concatenate([sending, receiving]), 9) + 0.0
    positions, number = np.unique(ends, axis=0, return_inverse=True)
    number = number.reshape(2, -1)
    return positions, number[0], number[1]


def _platform(survey: Survey, file: Any) -> None:
    """Sensors and transducers of the platform, with positions and attitudes over time."""
    group = file.createGroup("Platform")
    group.setncatts({"platform_name": "simulated platform", "platform_type": "", "platform_code_ICES": ""})
    kinds = group.createEnumType(
        np.int8, "transducer_type_t", {"receive_only": RECEIVES, "transmit_only": TRANSMITS, "monostatic": BOTH}
    )
    positions, sending, receiving = transducers(survey)
    origin = np.zeros((1, 3))
    for sensor, offsets in {"transducer": positions, "position": origin, "MRU": origin, "gyro": origin}.items():
        group.createDimension(sensor, len(offsets))
        names = [str(number + 1) for number in range(len(offsets))] if sensor == "transducer" else [SENSOR]
        _put(group, f"{sensor}_ids", str, (sensor,), names, {})
        for axis, values in zip("xyz", offsets.T, strict=True):
            _put(group, f"{sensor}_offset_{axis}", "f4", (sensor,), values, PLATFORM[f"{sensor}_offset_{axis}"])
            if (name := f"{sensor}_rotation_{axis}") in PLATFORM:
                _put(group, name, "f4", (sensor,), 0.0, PLATFORM[name])
    number = np.arange(len(positions))
    function = np.where(np.isin(number, receiving), np.where(np.isin(number, sending), BOTH, RECEIVES), TRANSMITS)
    for name, kind, dims, values in (
        ("transducer_function", kinds, ("transducer",), function), ("water_level", "f4", (), 0.0),
    ):  # fmt: skip
        _put(group, name, kind, dims, values, PLATFORM[name])
    _sensors(survey, group)


def _sensors(survey: Survey, group: Any) -> None:
    """Logged positions, attitudes and headings over time."""
    latitude, longitude, heading = survey.pose_on_earth
    pitch, roll = np.degrees(survey.attitude[:, 1:]).T
    depth = survey.position[:, 2]
    columns = {
        "Position": (POSITION, {"latitude": latitude, "longitude": longitude, "altitude": -depth,
                                "speed_over_ground": survey.speed}),
        "Attitude": (ATTITUDE, {"heading": heading, "pitch": pitch, "roll": roll, "vertical_offset": -depth}),
        "Gyro": (GYRO, {"heading": heading}),
    }  # fmt: skip
    for kind, (attributes, series) in columns.items():
        sensor = group.createGroup(kind).createGroup(SENSOR)
        sensor.createDimension("time", survey.rows.size)
        _put(sensor, "time", "u8", ("time",), _nanoseconds(survey), attributes["time"])
        for name, values in series.items():
            is_angle = name in ("latitude", "longitude")
            _put(sensor, name, "f8" if is_angle else "f4", ("time",), values, attributes[name], np.nan)


def _nanoseconds(survey: Survey) -> NDArray[np.uint64]:
    """Time of each ping [ns since 1970]."""
    since = np.asarray(survey.recording["ping_time"].values, float)[survey.rows]
    whole = np.round(survey.time - since).astype(np.uint64) * np.uint64(1_000_000_000)
    return np.asarray(whole + np.round(since * 1e9).astype(np.uint64))


def beam_rotations(survey: Survey) -> tuple[Floats, Floats]:
    """Rotations phi, theta, psi of the beams about the platform's x, y, z [deg].

    A beam points along its z axis, and its y axis is to the right of it, along the array.

    Args:
        survey: Recording on one platform.

    Returns:
        Those of the transmit and of the receive beam of each channel, each of shape (channel, 3).
    """
    ends: tuple[list[Floats], list[Floats]] = ([], [])
    for sonar in survey.scenario.sonar.side_sonars:
        axes = mounting_rotation(sonar.mounting.bearing, sonar.mounting.tilt)
        for rotations, steer in zip(ends, _steers(sonar, survey.scenario.water.sound_speed), strict=True):
            rotations += [_rotation(axes, beam) for beam in np.broadcast_to(steer, (sonar.beam_count, 2))]
    return np.degrees(np.array(ends[0])), np.degrees(np.array(ends[1]))


def _steers(sonar: Sonar, speed: float) -> tuple[Floats, Floats]:
    """Sines of the transmit and of the receive beams to the right and down of boresight, shape (beam, 2) each."""
    ahead = np.zeros((1, 2))
    transmit, receive = (
        beams(array, sonar.pulse.frequency, speed).steer
        if isinstance(array, LineArray | PlanarArray | PointTransducer) else ahead
        for array in sonar.arrays
    )  # fmt: skip
    return transmit, ahead if sonar.receiver.record == "elements" else receive


def _rotation(array: Floats, steer: Floats) -> Floats:
    """Rotations phi, theta, psi [rad] of a beam, of the boresight, right, down of its array as rows."""
    boresight, right, down = array
    ahead = np.sqrt(max(1 - float(steer @ steer), 0.0)) * boresight + steer[0] * right + steer[1] * down
    aside = right - (right @ ahead) * ahead
    aside /= np.linalg.norm(aside)
    axes = np.stack([np.cross(aside, ahead), aside, ahead], axis=1)
    theta = -np.arcsin(np.clip(axes[2, 0], -1, 1))
    if np.hypot(axes[2, 1], axes[2, 2]) < LEVEL:  # phi and psi turn about one line
        return np.array([0.0, theta, np.arctan2(-axes[0, 1], axes[1, 1])])
    return np.array([np.arctan2(axes[2, 1], axes[2, 2]), theta, np.arctan2(axes[1, 0], axes[0, 0])])


def _beam_sizes(survey: Survey, array: Any) -> tuple[float, float, float]:
    """Widths of the beam along and across the array [deg], and nominal equivalent two-way angle [sr]."""
    wave = survey.scenario.water.sound_speed / survey.scenario.sonar.pulse.frequency
    lengths = [array.length, 0.0] if isinstance(array, LineArray) else [0.0, 0.0]
    lengths = [array.width, array.height] if isinstance(array, PlanarArray) else lengths
    widths = [min(np.degrees(HALF_POWER * wave / length), 360.0) if length else 360.0 for length in lengths]
    angles = [min(TWO_WAY * wave / length, 2.0) if length else 2.0 for length in lengths]
    return float(widths[0]), float(widths[1]), float(angles[0] * angles[1])


def _beam_group(survey: Survey, group: Any, types: Mapping[str, Any]) -> None:
    """Samples and settings of all channels."""
    recording = survey.recording
    sensors = {f"preferred_{name}": np.int32(0) for name in ("MRU", "position", "gyro")}
    group.setncatts({"beam_mode": "inspection", "conversion_equation_type": np.int8(2)} | sensors)
    beam_count = recording.sizes["channel"]
    for name, size in (("beam", beam_count), ("subbeam", 1), ("ping_time", None), ("tx_beam", beam_count)):
        group.createDimension(name, size)
    names = [f"beam {number}" for number in range(beam_count)]
    _put(group, "beam", str, ("beam",), names, BEAMS["beam"])
    time = group.createVariable("ping_time", "u8", ("ping_time",))
    time.setncatts(dict(BEAMS["ping_time"]))
    time[:] = _nanoseconds(survey)
    _put(group, "beam_type", types["beam_t"], (), 0, BEAMS["beam_type"])
    for name, kind, dims, values, more in _settings(survey, types):
        _put(group, name, kind, dims, values, {**BEAMS[name], **more})
    parts = {"backscatter_r": np.real, "backscatter_i": np.imag} if "pressure" in recording else {
        "backscatter_r": np.sqrt}  # fmt: skip
    field = recording["pressure" if "pressure" in recording else "intensity"].transpose("ping", "channel", "time")
    stored = {}
    dimensions = dict.fromkeys(parts, ("ping_time", "beam", "subbeam")) | {"time_varied_gain": ("ping_time",)}
    for name, dims in dimensions.items():
        stored[name] = group.createVariable(name, types["sample_t"], dims)
        stored[name].setncatts(dict(BEAMS[name]))
    no_gain = np.zeros(recording.sizes["time"], np.float32)
    for number, row in enumerate(survey.rows):
        stored["time_varied_gain"][number] = no_gain
        values = field[int(row)].values
        for name, part in parts.items():
            samples = np.ascontiguousarray(part(values), np.float32)
            for beam in range(beam_count):
                stored[name][number, beam, 0] = samples[beam]


def _effective_duration(survey: Survey) -> float:
    """Duration of the square pulse of the energy of the received one [s]."""
    sonar = survey.scenario.sonar
    is_compressed = sonar.pulse.bandwidth > 0 and sonar.receiver.matched_filter
    return 1 / sonar.pulse.bandwidth if is_compressed else energy_duration(sonar.pulse)


def _settings(survey: Survey, types: Mapping[str, Any]) -> list[tuple[str, Any, tuple[str, ...], Any, Attributes]]:
    """Name, type, dimensions, values and further attributes of the variables that describe pings and beams."""
    scenario, pulse = survey.scenario, survey.scenario.sonar.pulse
    half = pulse.bandwidth / 2 * (1 if pulse.sweep == "up" else -1)
    ping, beam, sent = ("ping_time",), ("ping_time", "beam"), ("ping_time", "tx_beam")
    latitude, longitude, heading = survey.pose_on_earth
    receive, transmit = (_beam_sizes(survey, array) for array in (scenario.sonar.receive, scenario.sonar.transmit))
    flags = {"flag_meanings": "no_non_quantitative_processing", "flag_values": np.int16(0)}
    positions, sending, receiving = transducers(survey)
    lean = pose_rotation(np.zeros(survey.rows.size), *survey.attitude[:, 1:].T)
    transmitter_depth = survey.position[:, 2] + (lean @ positions[sending[0]])[:, 2]
    settings: list[tuple[str, Any, tuple[str, ...], Any, Attributes]] = [
        ("beam_stabilisation", types["beam_stabilisation_t"], ping, 0, {}),
        ("non_quantitative_processing", "i2", ping, 0, flags),
        ("sample_interval", "f4", ping, survey.sample_interval, {}),
        ("sample_time_offset", "f4", sent, 0.0, {}), ("blanking_interval", "f4", beam, survey.sample_time[0], {}),
        ("sample_count", "i4", (*beam, "subbeam"), survey.recording.sizes["time"], {}),
        ("beamwidth_receive_major", "f4", beam, receive[0], SUBSTITUTE),
        ("beamwidth_receive_minor", "f4", beam, receive[1], SUBSTITUTE),
        ("beamwidth_transmit_major", "f4", sent, transmit[0], {}),
        ("beamwidth_transmit_minor", "f4", sent, transmit[1], {}),
        ("equivalent_beam_angle", "f4", beam, receive[2], SUBSTITUTE),
        ("gain_correction", "f4", beam, 0.0, {}), ("receiver_sensitivity", "f4", beam, RMS_SENSITIVITY, {}),
        ("transmit_duration_nominal", "f4", sent, pulse.duration, {}),
        ("receive_duration_effective", "f4", sent, _effective_duration(survey), SUBSTITUTE),
        ("transmit_frequency_start", "f4", sent, pulse.frequency - half, {}),
        ("transmit_frequency_stop", "f4", sent, pulse.frequency + half, {}),
        ("transmit_source_level", "f4", sent, scenario.sonar.source_level_db, {}),
        ("transmit_type", types["transmit_t"], sent, pulse_code(survey, TRANSMIT_TYPES, "SONAR-netCDF4"), {}),
        ("transmit_transducer_index", "i4", sent, sending, {}),
        ("receive_transducer_index", "i4", ("beam",), receiving, {}),
        ("transmit_beam_index", "i4", beam, np.arange(survey.recording.sizes["channel"]), {}),
        *((f"active_{sensor}", "i4", ping, 0, {}) for sensor in ("MRU", "position_sensor", "gyro_sensor")),
        ("sound_speed_at_transducer", "f4", ping, scenario.water.sound_speed_at(transmitter_depth), {}),
        ("platform_latitude", "f8", ping, latitude, {}), ("platform_longitude", "f8", ping, longitude, {}),
        ("platform_heading", "f4", ping, heading, {}),
        ("platform_pitch", "f4", ping, np.degrees(survey.attitude[:, 1]), {}),
        ("platform_roll", "f4", ping, np.degrees(survey.attitude[:, 2]), {}),
        ("platform_vertical_offset", "f4", ping, -survey.position[:, 2], {}),
        ("tx_transducer_depth", "f4", ping, transmitter_depth, {}),
    ]  # fmt: skip
    for end, dims, rotation in zip(("tx", "rx"), (sent, beam), beam_rotations(survey), strict=True):
        settings += [
            (f"{end}_beam_rotation_{name}", "f4", dims, rotation[:, axis], {})
            for axis, name in enumerate(("phi", "theta", "psi"))
        ]
    return settings
