"""Fields of ROS messages of a sonar: pings, what their numbers mean, poses. Messages are mappings, without ROS.

Rows of an image are samples, with the beams side by side, as the viewers of marine_acoustic_msgs read it.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from insonify.scenario.scenario import Scenario
from insonify.sonar.modulation import Form
from insonify.sonar.pulse import energy_duration
from insonify.writers.ros_fans import PLATFORM, Fan, east_north_up, map_rotation

Floats = NDArray[np.float64]
Fields = dict[str, Any]

FULL_SCALE_BELOW_SOURCE_DB, STEP_DB = 20.0, 0.002
"""Level of the largest count of a display image below the source level, and step of its counts [dB]."""
COUNTS = 65535
TYPES = {"<u2": 2, "<f4": 8, "<f8": 9}
"""Numbers of the types of samples in marine_acoustic_msgs/SonarImageData."""
AMPLITUDE, POWER = 2, 3
"""Quantities of SonarInfo: rms pressure [uPa], mean-square pressure [uPa^2]."""
SIGNAL_TYPES: dict[Form, tuple[int, int]] = {"cw": (1, 1), "linear sweep": (2, 3), "hyperbolic sweep": (2, 3)}
"""Signal types of SonarInfo by form, of a rising and of a falling pulse; any other form is 0, unknown."""
LINEAR, DECIBELS, OF_MICROPASCAL, NO_TVG, NOT_NORMALISED = 1, 2, 2, 1, 1
NO_DETECTION = 1


def header(stamp: int, frame: str) -> Fields:
    """Time [ns since 1970] and frame."""
    return {"stamp": dict(zip(("sec", "nanosec"), divmod(stamp, 1_000_000_000), strict=True)), "frame_id": frame}


def vector(values: Floats) -> Fields:
    """Vector of three numbers."""
    return dict(zip("xyz", map(float, values), strict=True))


def pose_stamped(stamp: int, position: Floats, attitude: Floats) -> Fields:
    """Pose of the platform on the map, from north, east, down [m] and heading, pitch, roll [rad]."""
    pose = {"position": vector(east_north_up(position)), "orientation": _quaternion(map_rotation(attitude))}
    return {"header": header(stamp, "map"), "pose": pose}


def platform_transform(stamp: int, position: Floats, attitude: Floats) -> Fields:
    """Transform of the platform on the map, arguments as those of `pose_stamped`."""
    return _transform(header(stamp, "map"), "base_link", east_north_up(position), map_rotation(attitude))


def sonar_transforms(stamp: int, fans: list[Fan]) -> Fields:
    """Transforms of the sonars on the platform."""
    base = header(stamp, "base_link")
    return {"transforms": [_transform(base, fan.frame, PLATFORM @ fan.position, fan.rotation) for fan in fans]}


def fix(stamp: int, latitude: float, longitude: float, depth: float) -> Fields:
    """Position on Earth [deg], [m]."""
    return {
        "header": header(stamp, "base_link"), "status": {"status": 0, "service": 1}, "latitude": latitude,
        "longitude": longitude, "altitude": -depth, "position_covariance": np.zeros(9), "position_covariance_type": 0,
    }  # fmt: skip


def ping_info(scenario: Scenario, fan: Fan, sound_speed: float) -> Fields:
    """Frequency, sound speed by which ranges are computed [m/s], beam widths."""
    return {
        "frequency": scenario.sonar.pulse.frequency, "sound_speed": sound_speed, "tx_beamwidths": fan.transmit_width,
        "rx_beamwidths": fan.receive_width,
    }  # fmt: skip


def raw_image(head: Fields, info: Fields, fan: Fan, time: Floats, samples: NDArray[Any]) -> Fields:
    """RawSonarImage.

    Args:
        head: Header.
        info: As from `ping_info`.
        fan: Fan of the beams.
        time: Times of the samples after the start of transmission [s], shape (time,).
        samples: Amplitudes in single precision [uPa] or powers in double precision [uPa^2], shape (beam, time).
    """
    rate = (time.size - 1) / (time[-1] - time[0]) if time.size > 1 else 0.0
    return {
        "header": head, "ping_info": info, "sample_rate": rate, "samples_per_beam": time.size,
        "sample0": round(float(time[0] * rate)), "tx_delays": np.zeros(len(samples)), "tx_angles": fan.transmit_angle,
        "rx_angles": fan.receive_angle, "image": _image(samples),
    }  # fmt: skip


def projected_image(head: Fields, info: Fields, fan: Fan, ranges: Floats, counts: NDArray[np.uint16]) -> Fields:
    """ProjectedSonarImage of counts for display, shape (beam, time), at ranges [m]; other arguments of `raw_image`."""
    directions = [vector(ray) for ray in fan.direction]
    return {"header": head, "ping_info": info, "beam_directions": directions, "ranges": ranges, "image": _image(counts)}


def display_counts(scenario: Scenario, power: Floats) -> NDArray[np.uint16]:
    """Counts of a display image, of mean-square pressures [uPa^2], any shape."""
    level = 10 * np.log10(np.maximum(power, 1e-30))
    return np.clip(np.rint((level - _display_offset(scenario)) / STEP_DB), 0, COUNTS).astype(np.uint16)


def sonar_info(head: Fields, scenario: Scenario, fan: Fan, *, power: bool, display: bool, version: str) -> Fields:
    """SonarInfo of one stream; the empirical angular response is left empty, because none has been measured.

    Args:
        head: Header.
        scenario: Scenario of the sonar.
        fan: Fan of its beams.
        power: True: samples are powers, False: amplitudes.
        display: True: samples are counts of levels, as from `display_counts`; False: linear, as they are.
        version: Version of the program that simulated them.
    """
    pulse = scenario.sonar.pulse
    signal_type = SIGNAL_TYPES.get(pulse.form, (0, 0))[pulse.sweep == "down"]
    return {
        "header": head, "sonar_model": f"simulated: {scenario.title}", "calibration_ref": f"insonify {version}",
        "calibration_time": head["stamp"],
        "pulse_lengths": [energy_duration(pulse) if pulse.form == "cw" else pulse.duration],
        "bandwidths": [pulse.bandwidth or 1 / energy_duration(pulse)],
        "tx_signal_types": [signal_type], "intensity_quantity": POWER if power else AMPLITUDE,
        "intensity_scale": DECIBELS if display else LINEAR, "intensity_reference": OF_MICROPASCAL,
        "scale": STEP_DB if display else 1.0, "offset": _display_offset(scenario) if display else 0.0,
        "tvg_model": NO_TVG, "tvg_absorption_db_per_km": np.nan, "source_level_db": scenario.sonar.source_level_db,
        "angular_normalization": NOT_NORMALISED, "angular_response_angle_deg": [], "angular_response_db_rel_nadir": [],
        "angular_response_tl": 0, "angular_response_absorption_db_per_m": np.nan,
        "beam_pattern_angle_deg": fan.pattern[0], "beam_pattern_gain_db": fan.pattern[1],
    }  # fmt: skip


def detections(head: Fields, info: Fields, fan: Fan, travel_time: Floats, amplitude: Floats) -> Fields:
    """SonarDetections of one ping.

    Args:
        head: Header.
        info: As from `ping_info`.
        fan: Fan of the beams.
        travel_time: Two-way travel times [s], NaN without a detection, shape (beam,).
        amplitude: Amplitudes there [uPa], shape (beam,).
    """
    return {
        "header": head, "ping_info": info, "flags": _flags(travel_time), "two_way_travel_times": travel_time,
        "tx_delays": np.zeros(travel_time.size), "intensities": amplitude, "tx_angles": fan.transmit_angle,
        "rx_angles": fan.receive_angle,
    }  # fmt: skip


def sonar_ranges(head: Fields, info: Fields, fan: Fan, position: Floats, amplitude: Floats) -> Fields:
    """SonarRanges of soundings x, y, z from the array [m], NaN without one, shape (beam, 3); others as `detections`."""
    reach = np.linalg.norm(position, axis=1)
    known = np.isfinite(reach)
    ray = np.where(known[:, None], position / np.where(known, reach, 1.0)[:, None], fan.direction)
    return {
        "header": head, "ping_info": info, "flags": _flags(reach), "transmit_delays": np.zeros(reach.size),
        "intensities": amplitude, "beam_unit_vec": [vector(one) for one in ray], "ranges": reach,
    }  # fmt: skip


def _display_offset(scenario: Scenario) -> float:
    """Level of the count 0 [dB re 1 uPa]."""
    return scenario.sonar.source_level_db - FULL_SCALE_BELOW_SOURCE_DB - COUNTS * STEP_DB


def _flags(values: Floats) -> list[Fields]:
    return [{"flag": 0 if known else NO_DETECTION} for known in np.isfinite(values)]


def _image(samples: NDArray[Any]) -> Fields:
    """Image data, one row for each sample."""
    rows = np.ascontiguousarray(samples.T)
    rows = rows.astype(rows.dtype.newbyteorder("<"), copy=False)
    return {
        "is_bigendian": False, "dtype": TYPES[rows.dtype.newbyteorder("<").str], "beam_count": len(samples),
        "data": np.frombuffer(rows.tobytes(), np.uint8),
    }  # fmt: skip


def _transform(head: Fields, child: str, position: Floats, rotation: Floats) -> Fields:
    moved = {"translation": vector(position), "rotation": _quaternion(rotation)}
    return {"header": head, "child_frame_id": child, "transform": moved}


def _quaternion(rotation: Floats) -> Fields:
    return dict(zip("xyzw", map(float, Rotation.from_matrix(rotation).as_quat()), strict=True))
