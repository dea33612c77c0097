"""SONAR-netCDF4 2.0 of the International Council for the Exploration of the Sea, with complex samples.

ICES (2022), The SONAR-netCDF4 convention for sonar data, version 2.0, Cooperative Research Report 341, tables of the
groups. Samples are received pressures, for which equation type 2 holds with a sensitivity of 0 dB re 1/uPa and no gain.
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.frames import mounting_rotation
from insonify.sonar.array import LineArray, PlanarArray
from insonify.surveys.survey import Survey

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
    "conversion_equation_t": {"type_1": 1, "type_2": 2, "type_3": 3, "type_4": 4},
    "transmit_t": {"CW": 0, "LFM": 1, "HFM": 2},
}  # fmt: skip
TIME = {
    "axis": "T",
    "calendar": "gregorian",
    "standard_name": "time",
    "units": "nanoseconds since 1970-01-01 00:00:00Z",
}
ALONG = {"coordinates": "ping_time platform_latitude platform_longitude"}
DEGREES, SECONDS, HERTZ, METRES = (dict[str, Any](units=unit) for unit in ("arc_degree", "s", "Hz", "m"))
TURN, TILT = (
    DEGREES | {"valid_range": np.array([-180, 180], np.float32)},
    DEGREES | {"valid_range": np.array([-90, 90], np.float32)},
)


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
        version = str(survey.recording.attrs.get("version", ""))
        sonar.setncatts({"sonar_manufacturer": "simulated", "sonar_model": "simulated", "sonar_serial_number": "",
                         "sonar_software_name": "insonify", "sonar_software_version": version,
                         "sonar_type": "omni-sonar"})  # fmt: skip
        types: dict[str, Any] = {name: sonar.createEnumType(np.int8, name, codes) for name, codes in ENUMS.items()}
        types["sample_t"] = sonar.createVLType(np.float32, "sample_t")
        _beam_group(survey, sonar.createGroup("Beam_group1"), types)


def _put(group: Any, name: str, kind: Any, dims: tuple[str, ...], values: Any, about: Mapping[str, Any]) -> None:
    """Variable with its attributes; one value is repeated over the dimensions."""
    fill = about.get("_FillValue")
    variable = group.createVariable(name, kind, dims, fill_value=fill)
    variable.setncatts({key: value for key, value in about.items() if key != "_FillValue"})
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
    version = str(survey.recording.attrs.get("version", ""))
    group.setncatts({"conversion_software_name": "insonify", "conversion_software_version": version,
                     "conversion_time": _now(), "history": f"{_now()} insonify export"})  # fmt: skip
    group.createDimension("filenames", 1)
    names = {"long_name": "Source filenames"}
    _put(group, "source_filenames", str, ("filenames",), [Path(survey.name).name], names)


def _environment(survey: Survey, file: Any) -> None:
    water, frequency = survey.scenario.water, survey.scenario.sonar.pulse.frequency
    group = file.createGroup("Environment")
    group.createDimension("frequency", 1)
    sound = {"long_name": "Acoustic frequency", "standard_name": "sound_frequency"} | HERTZ
    _put(group, "frequency", "f4", ("frequency",), frequency, sound)
    loss: dict[str, Any] = {"long_name": "Indicative acoustic absorption", "units": "dB/m", "valid_min": 0.0}
    _put(group, "absorption_indicative", "f4", ("frequency",), float(water.absorption(frequency)), loss)
    speed = {"long_name": "Indicative sound speed", "standard_name": "speed_of_sound_in_sea_water", "units": "m/s",
            }  # fmt: skip
    _put(group, "sound_speed_indicative", "f4", (), water.sound_speed, speed)


def _platform(survey: Survey, file: Any) -> None:
    """Sensors and transducer of the platform, with positions and attitudes over time."""
    sonar = survey.scenario.sonar
    group = file.createGroup("Platform")
    group.setncatts({"platform_name": "simulated platform", "platform_type": "", "platform_code_ICES": ""})
    kinds = group.createEnumType(np.int8, "transducer_type_t", {"receive_only": 0, "transmit_only": 1, "monostatic": 3})
    offsets = {"transducer": sonar.transmit.offset, "position": (0.0, 0.0, 0.0), "MRU": (0.0, 0.0, 0.0)}
    for sensor, offset in offsets.items():
        group.createDimension(sensor, 1)
        _put(group, f"{sensor}_ids", str, (sensor,), [SENSOR if sensor != "transducer" else "1"], {})
        for axis, value in zip("xyz", offset, strict=True):
            about = METRES | {"long_name": f"Distance along the {axis}-axis from the platform origin to the {sensor}"}
            _put(group, f"{sensor}_offset_{axis}", "f4", (sensor,), value, about)
            if sensor != "position":
                about = TURN | {"long_name": f"Extrinsic rotation of the {sensor} about the {axis}-axis"}
                _put(group, f"{sensor}_rotation_{axis}", "f4", (sensor,), 0.0, about)
    function = {"long_name": "Transducer function (transmit_only, receive_only, monostatic)"}
    _put(group, "transducer_function", kinds, ("transducer",), 3, function)
    _put(group, "water_level", "f4", (), 0.0, METRES | {"long_name": "Distance from the origin to the water level"})
    latitude, longitude, heading = _pose_on_earth(survey)
    positions = group.createGroup("Positions").createGroup(SENSOR)
    attitudes = group.createGroup("Attitudes").createGroup(SENSOR)
    for sensor_group in (positions, attitudes):
        sensor_group.createDimension("time", survey.rows.size)
        _put(sensor_group, "time", "u8", ("time",), _nanoseconds(survey), TIME | {"long_name": "Timestamps"})
    for name, values, unit in (("latitude", latitude, "degrees_north"), ("longitude", longitude, "degrees_east")):
        about = {"long_name": name, "units": unit, "coordinates": "time latitude longitude", "_FillValue": np.nan}
        _put(positions, name, "f8", ("time",), values, about)
    _put(positions, "speed_over_ground", "f4", ("time",), survey.speed, {"units": "m/s"})
    pitch, roll = np.degrees(survey.attitude[:, 1:]).T
    for name, values, about in (
        ("heading", heading, {"units": "degrees_north", "long_name": "Platform heading(true)"}),
        ("pitch", pitch, TILT | {"long_name": "pitch angle"}),
        ("roll", roll, DEGREES | {"long_name": "roll angle"}),
        ("vertical_offset", -survey.position[:, 2], METRES | {"long_name": "Platform vertical offset from nominal"}),
    ):
        _put(attitudes, name, "f4", ("time",), values, about)


def _pose_on_earth(survey: Survey) -> tuple[Floats, Floats, Floats]:
    """Latitude, longitude and true heading at each ping [deg]."""
    north, east = survey.position[:, 0], survey.position[:, 1]
    latitude, longitude = survey.frame.geodetic(north, east)
    return latitude, longitude, np.degrees(survey.attitude[:, 0] + survey.frame.convergence(north, east)) % 360


def _nanoseconds(survey: Survey) -> NDArray[np.uint64]:
    """Time of each ping [ns since 1970]."""
    since = np.asarray(survey.recording["ping_time"].values, float)[survey.rows]
    whole = np.round(survey.time - since).astype(np.uint64) * np.uint64(1_000_000_000)
    return np.asarray(whole + np.round(since * 1e9).astype(np.uint64))


def beam_rotations(survey: Survey) -> Floats:
    """Rotations phi, theta, psi of the beams about the platform's x, y, z [deg], shape (channel, 3).

    A beam points along its z axis, and its y axis is to the right of it, along the array.
    """
    rotations: list[tuple[float, float, float]] = []
    steer = np.asarray(survey.recording["steer"].values, float)
    for sonar in survey.scenario.sonar.side_sonars:
        boresight, right, down = mounting_rotation(sonar.mounting.bearing, sonar.mounting.tilt)
        for angle in steer[len(rotations) : len(rotations) + sonar.beam_count]:
            ahead = np.cos(angle) * boresight + np.sin(angle) * right
            aside = np.cos(angle) * right - np.sin(angle) * boresight
            axes = np.stack([-down, aside, ahead], axis=1)
            phi, psi = np.arctan2(axes[2, 1], axes[2, 2]), np.arctan2(axes[1, 0], axes[0, 0])
            rotations.append((phi, -np.arcsin(np.clip(axes[2, 0], -1, 1)), psi))
    return np.degrees(np.array(rotations))


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
    group.setncatts({"beam_mode": "inspection", "conversion_equation_type": np.int8(2), "preferred_MRU": np.int32(0),
                     "preferred_position": np.int32(0)})  # fmt: skip
    beams = recording.sizes["channel"]
    for name, size in (("beam", beams), ("subbeam", 1), ("ping_time", None), ("tx_beam", beams)):
        group.createDimension(name, size)
    names = [f"beam {number}" for number in range(beams)]
    _put(group, "beam", str, ("beam",), names, {"long_name": "Beam name"})
    time = group.createVariable("ping_time", "u8", ("ping_time",))
    time.setncatts(TIME | ALONG | {"long_name": "Time-stamp of each ping"})
    time[:] = _nanoseconds(survey)
    _put(group, "beam_type", types["beam_t"], (), 0, {"long_name": "Type of beam"})
    for name, kind, dims, values, about in _settings(survey, types):
        _put(group, name, kind, dims, values, about)
    index = {"valid_min": np.int32(0)}
    _put(group, "receive_transducer_index", "i4", ("beam",), 0, index)
    parts = {"backscatter_r": np.real, "backscatter_i": np.imag} if "pressure" in recording else {
        "backscatter_r": np.sqrt}  # fmt: skip
    field = recording["pressure" if "pressure" in recording else "intensity"].transpose("ping", "channel", "time")
    stored = {}
    for name in parts:
        stored[name] = group.createVariable(name, types["sample_t"], ("ping_time", "beam", "subbeam"))
        stored[name].setncatts({"long_name": f"Raw backscatter measurements ({parts[name].__name__} part)",
                                "units": "uPa"})  # fmt: skip
    for number, row in enumerate(survey.rows):
        values = field[int(row)].values
        for name, part in parts.items():
            samples = np.ascontiguousarray(part(values), np.float32)
            for beam in range(beams):
                stored[name][number, beam, 0] = samples[beam]


def _settings(survey: Survey, types: Mapping[str, Any]) -> list[tuple[str, Any, tuple[str, ...], Any, dict[str, Any]]]:
    """Name, type, dimensions, values and attributes of the variables that describe pings and beams."""
    scenario, pulse = survey.scenario, survey.scenario.sonar.pulse
    start = float(survey.recording["time"].values[0])
    half = pulse.bandwidth / 2 * (1 if pulse.sweep == "up" else -1)
    ping, beam, sent = ("ping_time",), ("ping_time", "beam"), ("ping_time", "tx_beam")
    latitude, longitude, heading = _pose_on_earth(survey)
    receive, transmit = (_beam_sizes(survey, array) for array in (scenario.sonar.receive, scenario.sonar.transmit))
    level = {"units": "dB re 1 uPa at 1m", "long_name": "Transmit source level"}
    flags = {"flag_meanings": "no_non_quantitative_processing", "flag_values": np.int16(0)} | ALONG
    settings: list[tuple[str, Any, tuple[str, ...], Any, dict[str, Any]]] = [
        ("beam_stabilisation", types["beam_stabilisation_t"], ping, 0, ALONG),
        ("non_quantitative_processing", "i2", ping, 0, flags),
        ("sample_interval", "f4", ping, survey.sample_interval, SECONDS | ALONG),
        ("sample_time_offset", "f4", sent, 0.0, SECONDS), ("blanking_interval", "f4", beam, start, SECONDS),
        ("sample_count", "i4", beam, survey.recording.sizes["time"], {"units": "1"}),
        ("beamwidth_receive_major", "f4", beam, receive[0], DEGREES),
        ("beamwidth_receive_minor", "f4", beam, receive[1], DEGREES),
        ("beamwidth_transmit_major", "f4", sent, transmit[0], DEGREES),
        ("beamwidth_transmit_minor", "f4", sent, transmit[1], DEGREES),
        ("equivalent_beam_angle", "f4", beam, receive[2], {"units": "sr", "substitute_value_used": np.int32(1)}),
        ("gain_correction", "f4", beam, 0.0, {"units": "dB"}),
        ("receiver_sensitivity", "f4", beam, 0.0, {"units": "dB re 1/uPa"}),
        ("transmit_duration_nominal", "f4", sent, pulse.duration, SECONDS),
        ("receive_duration_effective", "f4", sent, pulse.duration, SECONDS | {"substitute_value_used": np.int32(1)}),
        ("transmit_frequency_start", "f4", sent, pulse.frequency - half, HERTZ),
        ("transmit_frequency_stop", "f4", sent, pulse.frequency + half, HERTZ),
        ("transmit_source_level", "f4", sent, scenario.sonar.source_level_db, level),
        ("transmit_type", types["transmit_t"], sent, int(pulse.kind == "lfm"), {}),
        ("transmit_transducer_index", "i4", beam, 0, {}), ("active_MRU", "i4", ping, 0, ALONG),
        ("transmit_beam_index", "i4", beam, np.arange(survey.recording.sizes["channel"]), {}),
        ("active_position_sensor", "i4", ping, 0, ALONG),
        ("sound_speed_at_transducer", "f4", ping, scenario.water.sound_speed, {"units": "m/s"} | ALONG),
        ("platform_latitude", "f8", ping, latitude, {"units": "degrees_north"} | ALONG),
        ("platform_longitude", "f8", ping, longitude, {"units": "degrees_east"} | ALONG),
        ("platform_heading", "f4", ping, heading, {"units": "degrees_north"} | ALONG),
        ("platform_pitch", "f4", ping, np.degrees(survey.attitude[:, 1]), TILT | ALONG),
        ("platform_roll", "f4", ping, np.degrees(survey.attitude[:, 2]), DEGREES | ALONG),
        ("platform_vertical_offset", "f4", ping, -survey.position[:, 2], METRES | ALONG),
        ("tx_transducer_depth", "f4", ping, survey.position[:, 2], METRES | ALONG),
    ]  # fmt: skip
    for axis, (name, limits) in enumerate((("phi", TURN), ("theta", TILT), ("psi", TURN))):
        rotation = beam_rotations(survey)[:, axis]
        settings += [
            (f"{end}_beam_rotation_{name}", "f4", dims, rotation, limits) for end, dims in (("rx", beam), ("tx", sent))
        ]
    return settings
