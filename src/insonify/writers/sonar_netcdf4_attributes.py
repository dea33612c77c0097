"""Attributes that SONAR-netCDF4 2.0 states for its variables.

ICES (2022), The SONAR-netCDF4 convention for sonar data, version 2.0, Cooperative Research Report 341, tables of the
groups, with the later edits of the convention's repository.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

Attributes = Mapping[str, Any]


def _about(
    long_name: str, units: str = "", standard_name: str = "", *, least: float | None = None,
    limits: tuple[float, float] | None = None, along: str = "", kind: type[np.generic] = np.float32,
) -> Attributes:  # fmt: skip
    """Attributes of one variable: names, units, least value or limits, coordinates."""
    about: dict[str, Any] = {"long_name": long_name}
    about |= {name: text for name, text in (("units", units), ("standard_name", standard_name)) if text}
    if least is not None:
        about["valid_min"] = kind(least)
    if limits is not None:
        about["valid_range"] = np.array(limits, kind)
    return about | ({"coordinates": along} if along else {})


def _time(long_name: str, along: str = "") -> Attributes:
    fixed = {"axis": "T", "calendar": "gregorian"}
    return fixed | dict(_about(long_name, "nanoseconds since 1970-01-01 00:00:00Z", "time", along=along))


def _geodetic(along: str) -> dict[str, Attributes]:
    """Latitude and longitude."""
    return {
        name: _about(name, units, f"Platform {name}", limits=(-limit, limit), along=along, kind=np.float64)
        for name, units, limit in (("latitude", "degrees_north", 90), ("longitude", "degrees_east", 180))
    }


def _tilts(along: str = "") -> dict[str, Attributes]:
    """Pitch and roll."""
    return {
        "pitch": _about("pitch angle", "arc_degree", "platform_pitch_angle", limits=(-90, 90), along=along),
        "roll": _about("roll angle", "arc_degree", "platform_roll_angle", along=along),
    }


PING, FIX = "ping_time platform_latitude platform_longitude", "time latitude longitude"
TURN, TILT, CIRCLE = (-180, 180), (-90, 90), (0, 360)
SUBSTITUTE = {"substitute_value_used": np.int32(1)}
"""A nominal value, where none was measured or calibrated."""
_AXES = {"phi": ("x", TURN), "theta": ("y", TILT), "psi": ("z", TURN)}
_OFFSETS = {
    "MRU": "Distance along the {}-axis from the platform coordinate system origin to the motion reference unit sensor "
           "origin",
    "position": "Distance along the {}-axis from the platform coordinate system origin to the latitude/longitude "
                "sensor origin",
    "gyro": "Distance from the platform coordinate system origin to the gyro sensor origin along the {}-axis.",
    "transducer": "{}-axis distance from the platform coordinate system origin to the sonar transducer",
}  # fmt: skip

ENVIRONMENT: Mapping[str, Attributes] = {
    "frequency": _about("Acoustic frequency", "Hz", "sound_frequency", least=0),
    "absorption_indicative": _about("Indicative acoustic absorption", "dB/m", least=0),
    "sound_speed_indicative": _about("Indicative sound speed", "m/s", "speed_of_sound_in_sea_water", least=0),
}
PLATFORM: Mapping[str, Attributes] = {
    **{f"{sensor}_offset_{axis}": _about(long_name.format(axis), "m")
       for sensor, long_name in _OFFSETS.items() for axis in "xyz"},
    **{f"{sensor}_rotation_{axis}": _about(f"Extrinsic rotation about the {axis}-axis {between} coordinate systems",
                                           "arc_degree", limits=TURN)
       for sensor, between in (("MRU", "from the platform to MRU"), ("transducer", "from the transducer to reference"))
       for axis in "xyz"},
    "transducer_function": _about("Transducer function (transmit_only, receive_only, monostatic)"),
    "water_level": _about(
        "Distance from the platform coordinate system origin to the nominal water level along the z-axis", "m"),
}  # fmt: skip
POSITION: Mapping[str, Attributes] = {
    "time": _time("Timestamps for position data", FIX),
    "altitude": _about("altitude", "m", "altitude", along=FIX),
    "speed_over_ground": _about("speed_over_ground", "m/s", "platform_speed_wrt_ground", least=0, along=FIX),
    **_geodetic(FIX),
}
ATTITUDE: Mapping[str, Attributes] = {
    "time": _time("Timestamps for attitude data"),
    "heading": _about("Platform heading(true)", "degrees_north", "platform_orientation", limits=CIRCLE),
    "vertical_offset": _about("Platform vertical offset from nominal", "m"),
    **_tilts(),
}
GYRO: Mapping[str, Attributes] = {
    "time": _time("Timestamps for gyro data"),
    "heading": _about("Platform heading(true)", "degree", "platform_orientation"),
}
BEAMS: Mapping[str, Attributes] = {
    "beam": _about("Beam name"),
    "ping_time": _time("Time-stamp of each ping", PING),
    "backscatter_r": _about("Raw backscatter measurements (real part)", "uPa"),
    "backscatter_i": _about("Raw backscatter measurements (imaginary part)", "uPa"),
    "time_varied_gain": _about("Time-varied-gain coefficients", "dB", along=PING),
    "beam_type": _about("Type of beam"),
    "beam_stabilisation": _about("Beam stabilisation applied (or not)", along=PING),
    "non_quantitative_processing": _about(
        "Presence or not of non-quantitative processing applied to the backscattering data (sonar specific)",
        along=PING),
    **{f"beamwidth_{end}_{side}": _about(
        f"Half power one-way {end} beam width along {side} ({plane}) axis of beam", "arc_degree", limits=CIRCLE)
       for end in ("receive", "transmit") for side, plane in (("major", "horizontal"), ("minor", "vertical"))},
    **{f"{end}_beam_rotation_{name}": _about(
        f"{word} beam angular rotation about the {axis} axis", "arc_degree", limits=limits)
       for end, word in (("rx", "receive"), ("tx", "transmit")) for name, (axis, limits) in _AXES.items()},
    "equivalent_beam_angle": _about("Equivalent beam angle", "sr", limits=(0, 4 * np.pi)),
    "blanking_interval": _about("Amount of time during reception where samples are discarded", "s", least=0),
    "sample_interval": _about("Interval between recorded raw data samples", "s", least=0, along=PING),
    "sample_time_offset": _about("Time offset that is subtracted from the timestamp of each sample", "s"),
    "sample_count": _about("Number of samples per ping in each beam, and optionally subbeam", "1", least=0,
                           kind=np.int32),
    "gain_correction": _about("Gain correction", "dB"),
    "receiver_sensitivity": _about("Receiver sensitivity (re 1/\u03bcPa)", "dB"),
    "receive_duration_effective": _about("Effective duration of received pulse", "s", least=0),
    "receive_transducer_index": _about("Receive transducer index", least=0, kind=np.int32),
    "transmit_transducer_index": _about("Transmit transducer index", least=0, kind=np.int32),
    "transmit_beam_index": _about("Transmit beam index associated with the given beam", least=0, kind=np.int32),
    "transmit_duration_nominal": _about("Nominal duration of transmitted pulse", "s", least=0),
    "transmit_frequency_start": _about("Start frequency in transmitted pulse", "Hz", "sound_frequency", least=0),
    "transmit_frequency_stop": _about("Stop frequency in transmitted pulse", "Hz", "sound_frequency", least=0),
    "transmit_source_level": _about("Transmit source level (re 1 \u03bcPa at 1 m)", "dB"),
    "transmit_type": _about("Type of transmitted pulse"),
    **{f"active_{name}": _about(f"Active {word} sensor index", least=0, along=PING, kind=np.int32)
       for name, word in (("MRU", "MRU"), ("position_sensor", "position"), ("gyro_sensor", "gyro"))},
    "sound_speed_at_transducer": _about("Indicative sound speed at ping time and transducer depth", "m/s",
                                        "speed_of_sound_in_sea_water", least=0, along=PING),
    "tx_transducer_depth": _about("Tx transducer depth below waterline", "m", along=PING),
    "platform_heading": _about("Platform heading(true)", "degrees_north", "platform_orientation", limits=CIRCLE,
                               along=PING),
    "platform_vertical_offset": _about("Platform vertical distance from reference point to the water line", "m",
                                       along=PING),
    **{f"platform_{name}": about for name, about in (_geodetic(PING) | _tilts(PING)).items()},
}  # fmt: skip
