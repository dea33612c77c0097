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
FOR_TYPE_2 = ("gain_correction", "receiver_sensitivity", "transmit_source_level", "receive_duration_effective")
TYPES = {"beam_stabilisation": "beam_stabilisation_t", "beam_type": "beam_t", "transmit_type": "transmit_t",
         "backscatter_r": "sample_t", "backscatter_i": "sample_t"}  # fmt: skip
UNITS = {"sample_interval": "s", "equivalent_beam_angle": "sr", "transmit_frequency_start": "Hz",
         "rx_beam_rotation_phi": "arc_degree", "platform_vertical_offset": "m", "platform_latitude": "degrees_north",
         "ping_time": "nanoseconds since 1970-01-01 00:00:00Z"}  # fmt: skip


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
    found += [f"Platform dimension {name}" for name in ("transducer", "position", "MRU")
              if name not in platform.dimensions]  # fmt: skip
    found += [] if platform["transducer_function"].datatype.name == "transducer_type_t" else ["transducer_function"]
    for kind, names in (("Positions", ("time", "latitude", "longitude")),
                        ("Attitudes", ("time", "pitch", "roll", "vertical_offset"))):  # fmt: skip
        for sensor in platform[kind].groups.values():
            found += [f"{kind} {name}" for name in names if name not in sensor.variables]
    found += [] if sonar.sonar_type in ("omni-sonar", "echosounder") else [f"sonar_type {sonar.sonar_type}"]
    return found + [f"{name}: {fault}" for name in sonar.groups for fault in _beam_faults(sonar[name])]


def _beam_faults(group):
    found = [f"{name} is missing" for name in (*BEAM_GROUP, *FOR_TYPE_2) if name not in group.variables]
    found += [f"attribute {name}" for name in ("beam_mode", "conversion_equation_type") if name not in group.ncattrs()]
    found += [] if group.beam_mode in ("vertical", "horizontal", "inspection") else ["beam_mode"]
    for name, variable in group.variables.items():
        if name in BEAM_GROUP and variable.dimensions != BEAM_GROUP[name]:
            found.append(f"{name} is over {variable.dimensions}")
        if name in TYPES and variable.datatype.name != TYPES[name]:
            found.append(f"{name} is of type {variable.datatype}")
        if name in UNITS and variable.units != UNITS[name]:
            found.append(f"{name} is in {variable.units}")
        limits = getattr(variable, "valid_range", None)
        if limits is not None and not ((variable[:] >= limits[0]) & (variable[:] <= limits[1])).all():
            found.append(f"{name} is outside of {limits}")
    return found
