"""Validator of SONAR-netCDF4 2.0: obligatory parts, transcribed from the convention's tables."""

TOP = ("Conventions", "date_created", "keywords", "sonar_convention_authority", "sonar_convention_name",
       "sonar_convention_version", "summary", "title")  # fmt: skip
PING, BEAM, SENT = ("ping_time",), ("ping_time", "beam"), ("ping_time", "tx_beam")
BEAM_GROUP = {
    "beam": ("beam",), "ping_time": PING, "backscatter_r": (*BEAM, "subbeam"), "beam_stabilisation": PING,
    "beam_type": (), "beamwidth_receive_major": BEAM, "beamwidth_receive_minor": BEAM, "blanking_interval": BEAM,
    "equivalent_beam_angle": BEAM, "non_quantitative_processing": PING, "sample_interval": PING,
    "sample_time_offset": SENT, "transmit_duration_nominal": SENT, "transmit_frequency_start": SENT,
    "transmit_frequency_stop": SENT, "transmit_type": SENT,
    **{f"platform_{name}": PING for name in ("heading", "latitude", "longitude", "pitch", "roll", "vertical_offset")},
    **{f"rx_beam_rotation_{name}": BEAM for name in ("phi", "psi", "theta")},
    **{f"tx_beam_rotation_{name}": SENT for name in ("phi", "psi", "theta")},
}  # fmt: skip
APPLICABLE = {
    "time_varied_gain": PING, "gain_correction": BEAM, "receiver_sensitivity": BEAM, "transmit_source_level": SENT,
    "receive_duration_effective": SENT, "transmit_beam_index": BEAM, "receive_transducer_index": ("beam",),
    "transmit_transducer_index": SENT, "beamwidth_transmit_major": SENT, "beamwidth_transmit_minor": SENT,
    **{f"active_{name}": PING for name in ("MRU", "position_sensor", "gyro_sensor")},
}  # fmt: skip
"""Variables that are obligatory where they apply: of conversion type 2, of several beams, transducers and sensors."""
OPTIONAL = {"sample_count": (*BEAM, "subbeam"), "tx_transducer_depth": PING, "sound_speed_at_transducer": PING,
            "backscatter_i": (*BEAM, "subbeam")}  # fmt: skip
TYPES = {"beam_stabilisation": "beam_stabilisation_t", "beam_type": "beam_t", "transmit_type": "transmit_t",
         "backscatter_r": "sample_t", "backscatter_i": "sample_t", "time_varied_gain": "sample_t"}  # fmt: skip
CONVERSIONS = {f"type_{number}": number for number in range(1, 7)}
STAMP = "nanoseconds since 1970-01-01 00:00:00Z"
UNITS = {
    "arc_degree": ("beamwidth_receive_major", "beamwidth_receive_minor", "beamwidth_transmit_major",
                   "beamwidth_transmit_minor", "platform_pitch", "platform_roll", "pitch", "roll",
                   *(f"{end}_beam_rotation_{angle}" for end in ("rx", "tx") for angle in ("phi", "psi", "theta")),
                   *(f"{part}_rotation_{axis}" for part in ("MRU", "transducer") for axis in "xyz")),
    "s": ("blanking_interval", "sample_interval", "sample_time_offset", "transmit_duration_nominal",
          "receive_duration_effective"),
    "Hz": ("frequency", "transmit_frequency_start", "transmit_frequency_stop"),
    "dB": ("gain_correction", "receiver_sensitivity", "transmit_source_level", "time_varied_gain"),
    "m": ("platform_vertical_offset", "vertical_offset", "tx_transducer_depth", "water_level", "altitude",
          *(f"{part}_offset_{axis}" for part in ("MRU", "transducer", "position", "gyro") for axis in "xyz")),
    "m/s": ("sound_speed_at_transducer", "sound_speed_indicative", "speed_over_ground"),
    "sr": ("equivalent_beam_angle",),
    "degrees_north": ("platform_latitude", "latitude", "platform_heading"), "1": ("sample_count",),
    "degrees_east": ("platform_longitude", "longitude"), "dB/m": ("absorption_indicative",),
    STAMP: ("ping_time", "time"),
}  # fmt: skip
STANDARD_NAMES = {
    "ping_time": "time", "time": "time", "frequency": "sound_frequency", "transmit_frequency_start": "sound_frequency",
    "transmit_frequency_stop": "sound_frequency", "sound_speed_indicative": "speed_of_sound_in_sea_water",
    "sound_speed_at_transducer": "speed_of_sound_in_sea_water", "platform_heading": "platform_orientation",
    "heading": "platform_orientation", "platform_pitch": "platform_pitch_angle", "pitch": "platform_pitch_angle",
    "platform_roll": "platform_roll_angle", "roll": "platform_roll_angle", "platform_latitude": "Platform latitude",
    "latitude": "Platform latitude", "platform_longitude": "Platform longitude", "longitude": "Platform longitude",
    "altitude": "altitude", "speed_over_ground": "platform_speed_wrt_ground",
}  # fmt: skip
LONG_NAMES = {
    "transducer_offset_x": "x-axis distance from the platform coordinate system origin to the sonar transducer",
    "gyro_offset_y": "Distance from the platform coordinate system origin to the gyro sensor origin along the y-axis.",
    "MRU_offset_z": "Distance along the z-axis from the platform coordinate system origin to the motion reference unit "
                    "sensor origin",
    "position_offset_x": "Distance along the x-axis from the platform coordinate system origin to the "
                         "latitude/longitude sensor origin",
    "platform_vertical_offset": "Platform vertical distance from reference point to the water line",
    "transmit_source_level": "Transmit source level (re 1 \u03bcPa at 1 m)",
}  # fmt: skip
NOT_NEGATIVE = (
    "frequency", "absorption_indicative", "sound_speed_indicative", "sound_speed_at_transducer", "blanking_interval",
    "sample_interval", "transmit_duration_nominal", "receive_duration_effective", "transmit_frequency_start",
    "transmit_frequency_stop", "sample_count", "speed_over_ground", "transmit_beam_index", "receive_transducer_index",
    "transmit_transducer_index", "active_MRU", "active_position_sensor", "active_gyro_sensor",
)  # fmt: skip
RANGES = {
    "platform_latitude": (-90, 90), "latitude": (-90, 90), "platform_longitude": (-180, 180), "longitude": (-180, 180),
    "platform_heading": (0, 360), "platform_pitch": (-90, 90), "pitch": (-90, 90), "rx_beam_rotation_theta": (-90, 90),
    "rx_beam_rotation_phi": (-180, 180), "rx_beam_rotation_psi": (-180, 180), "tx_beam_rotation_theta": (-90, 90),
    "tx_beam_rotation_phi": (-180, 180), "tx_beam_rotation_psi": (-180, 180), "beamwidth_receive_major": (0, 360),
    "beamwidth_transmit_minor": (0, 360), "equivalent_beam_angle": (0, 12.566371),
}  # fmt: skip
SUBGROUPS = {"Position": ("time", "latitude", "longitude"), "Gyro": ("time", "heading"),
             "Attitude": ("time", "pitch", "roll", "vertical_offset")}  # fmt: skip


def faults(file):
    """What an open file lacks or has otherwise than the convention states, one line each."""
    found = [f"attribute {name}" for name in TOP if name not in file.ncattrs()]
    expected = {"sonar_convention_version": "2.0", "sonar_convention_authority": "ICES",
              "Conventions": "CF-1.7, SONAR-netCDF4-2.0, ACDD-1.3"}  # fmt: skip
    found += [f"{name} is {getattr(file, name, None)}" for name, text in expected.items()
              if getattr(file, name, None) != text]  # fmt: skip
    groups = ("Annotation", "Environment", "Platform", "Provenance", "Sonar", "Vendor_specific")
    found += [f"group {name}" for name in groups if name not in file.groups]
    environment, platform, sonar = (file[name] for name in ("Environment", "Platform", "Sonar"))
    found += [f"Environment {name}" for name in ("frequency", "absorption_indicative", "sound_speed_indicative")
              if name not in environment.variables]  # fmt: skip
    found += [f"Platform dimension {name}" for name in ("transducer", "position", "MRU", "gyro")
              if name not in platform.dimensions]  # fmt: skip
    found += [] if platform["transducer_function"].datatype.name == "transducer_type_t" else ["transducer_function"]
    for kind, names in SUBGROUPS.items():
        sensors = platform[kind].groups if kind in platform.groups else {}
        found += [] if sensors else [f"Platform {kind}"]
        found += [f"{kind} {name}" for sensor in sensors.values() for name in names if name not in sensor.variables]
    conversions = sonar.enumtypes["conversion_equation_t"].enum_dict
    found += [] if conversions == CONVERSIONS else [f"conversions {conversions}"]
    found += [f"{group.path} {fault}" for group in _walk(file) for name, variable in group.variables.items()
              for fault in _attribute_faults(name, variable)]  # fmt: skip
    found += [] if sonar.sonar_type in ("omni-sonar", "echosounder") else [f"sonar_type {sonar.sonar_type}"]
    return found + [f"{name}: {fault}" for name in sonar.groups for fault in _beam_faults(sonar[name])]


def _walk(group):
    yield group
    for part in group.groups.values():
        yield from _walk(part)


def _attribute_faults(name, variable):
    """Units, names, limits of one variable, and values beyond its limits."""
    units = {one: unit for unit, names in UNITS.items() for one in names}
    needed = {"units": units.get(name), "standard_name": STANDARD_NAMES.get(name), "long_name": LONG_NAMES.get(name)}
    found = [] if name.endswith("_ids") or getattr(variable, "long_name", "") else [f"{name} has no long_name"]
    found += [f"{name} has {key} {getattr(variable, key, None)}" for key, text in needed.items()
             if text is not None and getattr(variable, key, None) != text]  # fmt: skip
    if name in NOT_NEGATIVE and getattr(variable, "valid_min", None) != 0:
        found.append(f"{name} has no valid_min")
    if name in RANGES and [round(float(end), 5) for end in getattr(variable, "valid_range", ())] != [
        round(end, 5) for end in RANGES[name]
    ]:
        found.append(f"{name} has no valid_range")
    limits = (getattr(variable, "valid_min", None), None) if "valid_min" in variable.ncattrs() else getattr(
        variable, "valid_range", (None, None))  # fmt: skip
    for end, sense in zip(limits, (1, -1), strict=True):
        if end is not None and (sense * (variable[...] - end) < 0).any():
            found.append(f"{name} is outside of {limits}")
    return found


def _beam_faults(group):
    known = BEAM_GROUP | APPLICABLE | OPTIONAL
    found = [f"{name} is missing" for name in BEAM_GROUP | APPLICABLE if name not in group.variables]
    found += [f"attribute {name}" for name in ("beam_mode", "conversion_equation_type") if name not in group.ncattrs()]
    found += [] if group.beam_mode in ("vertical", "horizontal", "inspection") else ["beam_mode"]
    for name, variable in group.variables.items():
        if name not in known or variable.dimensions != known[name]:
            found.append(f"{name} is over {variable.dimensions}")
        if name in TYPES and variable.datatype.name != TYPES[name]:
            found.append(f"{name} is of type {variable.datatype}")
        if variable.dimensions == PING and not getattr(variable, "coordinates", "").startswith(
            "ping_time platform_lat"
        ):
            found.append(f"{name} has no coordinates")
    return found
