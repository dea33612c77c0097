"""Claims about real recordings: every value agrees with readers that share no code with these.

The files are public (their README names the repositories) and not part of the project; the readers are packages that
are installed by hand, since they bring hundreds of megabytes.
"""

import numpy as np
import pytest

from insonify.formats.instruments import open_instrument
from oracles import instrument_files as files
from oracles.instrument_files import DATA

FILES = {"kmall": "real/em2042-ostend-os02-300khz-b.kmall", "kmwcd": "real/em2042-ostend-os02-300khz-b.kmwcd",
         "all": "real/em2040-belgica-0077.all", "wcd": "real/em2040-belgica-0077.wcd",
         "xtf": "scotsman-iver2.xtf"}  # fmt: skip
DEGREE, KM = np.pi / 180, 1e-3
SOUNDINGS = {
    "travel_time": ("two_way_travel_time_sec", 1), "beam_angle": ("beam_angle_re_rx_deg", -DEGREE),
    "forward": ("x_re_ref_point_m", 1), "starboard": ("y_re_ref_point_m", 1), "down": ("z_re_ref_point_m", 1),
    "delta_latitude": ("delta_latitude_deg", DEGREE), "delta_longitude": ("delta_longitude_deg", DEGREE),
    "backscatter": ("reflectivity_2_db", 1), "backscatter_maker": ("reflectivity_1_db", 1), "gain": ("tvg_db", 1),
    "source_level_applied": ("source_level_applied_db", 1), "absorption": ("mean_abs_coeff_db_per_km", KM),
    "sensitivity_applied": ("receiver_sensitivity_applied_db", 1), "sector": ("tx_sector_number", 1),
    "detection": ("detection_type", 1), "detection_method": ("detection_method", 1),
    "echo_length": ("echo_length_sec", 1),
    "quality": ("quality_factor", 0.01), "water_column_beam": ("wc_beam_number", 1),
    "water_column_angle": ("wc_nom_beam_angle_across_deg", -DEGREE),
}  # fmt: skip
SECTORS = {
    "frequency": ("centre_frequency_hz", 1), "sector_delay": ("sector_transmit_delay_sec", 1),
    "shading": ("pulse_shading", 0.01), "tilt": ("tilt_angle_re_tx_deg", DEGREE),
    "source_level": ("tx_nominal_source_level_db", 1), "focus_range": ("tx_focus_range_m", 1),
    "bandwidth": ("signal_band_width_hz", 1),
    "sector_pulse_length": ("total_signal_length_sec", 1), "effective_pulse_length": ("effective_signal_length_sec", 1),
}  # fmt: skip
ATTITUDE = {
    "roll": ("roll_deg", DEGREE), "pitch": ("pitch_deg", DEGREE), "yaw": ("heading_deg", DEGREE),
            "heave": ("heave_m", 1), "latitude": ("latitude_deg", DEGREE), "velocity_down": ("vel_down", 1),
}  # fmt: skip


def opened(kind):
    """One of the real files, open; skipped where it is absent."""
    path = DATA / FILES[kind]
    if not path.is_file():
        pytest.skip(f"{path.name}, a public recording, is not in the folder INSONIFY_DATA")
    return open_instrument(path)


def datagrams(kind, family, name, path=None):
    """Datagrams of one kind by the other reader, as a list; of a file of its own where a path is given."""
    module = pytest.importorskip(
        "themachinethatgoesping.echosounders", reason="the independent reader is not installed"
    )
    module = getattr(module, family)
    handler = module.KMALLFileHandler if family == "kmall" else module.KongsbergAllFileHandler
    kinds = module.t_KMALLDatagramIdentifier if family == "kmall" else module.t_KongsbergAllDatagramIdentifier
    opened = handler([str(path or DATA / FILES[kind])], show_progress=False, init=path is None)
    return list(opened.datagram_interface.datagrams(getattr(kinds, name)))


def assert_agree(ours, theirs, scale=1):
    """Equal to the last bit of what the file holds: float32 at most."""
    np.testing.assert_allclose(np.asarray(ours, float), np.asarray(theirs, float) * scale, rtol=3e-7, atol=1e-30)


def test_kmall_soundings_sectors_and_image():
    """Every sounding, sector and sample of the seabed image of the EM2042."""
    with opened("kmall") as file:
        swaths = datagrams("kmall", "kmall", "M_RANGE_AND_DEPTH")
        found, image = file.soundings(), file.read("seabed image")
        assert len(swaths) == found.sizes["ping"] == 6 and not [o for o in file.check() if "unknown" not in o.reason]
    for ping, swath in enumerate(swaths):
        for table, columns in ((swath.soundings, SOUNDINGS), (swath.tx_sectors, SECTORS)):
            for name, (field, scale) in columns.items():
                theirs = getattr(table, f"get_{field}_tensor")()
                assert_agree(found[name][ping][: theirs.size], theirs, scale)
                rest = found[name].values[ping, theirs.size :]
                assert np.all(np.isnan(rest) | (rest == -1))
        assert_agree(found.time[ping], swath.get_timestamp())
        levels = image.level.values[ping]
        assert_agree(levels[np.isfinite(levels)], np.concatenate([np.ravel(swath.get_seabed_image_samples_db())]))


def test_kmall_attitude_position_and_profile():
    """Every sample of attitude, every position, every point of the profile."""
    with opened("kmall") as file:
        attitude, navigation, (profile,) = file.attitude(), file.navigation(), file.sound_speed_profiles()
    samples = [found.sensor_data for found in datagrams("kmall", "kmall", "S_KM_BINARY")]
    for name, (theirs, scale) in ATTITUDE.items():
        assert_agree(
            attitude[name], np.concatenate([getattr(part, f"get_{theirs}_tensor")() for part in samples]), scale
        )
    np.testing.assert_allclose(
        attitude.time, np.concatenate([part.get_sensor_timestamp_tensor() for part in samples]), rtol=0, atol=1e-6
    )
    positions = datagrams("kmall", "kmall", "S_POSITION")
    assert_agree(navigation.latitude, [position.get_corrected_lat_deg() for position in positions], DEGREE)
    assert_agree(navigation.speed, [position.get_speed_over_ground_m_per_sec() for position in positions])
    (theirs,) = datagrams("kmall", "kmall", "S_SOUND_VELOCITY_PROFILE")
    assert_agree(profile.depth, theirs.get_svp_depths())
    assert_agree(profile.sound_speed, theirs.get_svp_sound_velocities())


def test_kmwcd_samples():
    """Every sample, angle and detection of the water column of the EM2042."""
    with opened("kmwcd") as file:
        columns, found = datagrams("kmwcd", "kmall", "M_WATER_COLUMN"), file.read("water column")
    assert len(columns) == found.sizes["ping"] == 5
    for ping, column in enumerate(columns):
        assert_agree(found.beam_angle[ping], column.beam_data.get_beam_pointing_angle_re_vertical_deg_tensor(), -DEGREE)
        assert_agree(found.first_sample[ping], column.beam_data.get_start_range_sample_number_tensor())
        assert_agree(found.heave[ping], column.tx_info.get_heave_m())
        assert_agree(found.sample_rate[ping], column.rx_info.get_sample_freq_hz())
        assert_agree(found.gain_exponent[ping], column.rx_info.get_tvg_function_applied())
        levels = found.level.values[ping]
        theirs = np.concatenate([np.ravel(beam.get_sample_amplitudes_in_db()) for beam in column.beam_data.beams])
        np.testing.assert_array_equal(levels[np.isfinite(levels)], theirs)


def test_all_soundings_ranges_and_image():
    """Every sounding, raw range and sample of the seabed image of both receivers of the EM2040."""
    with opened("all") as file:
        found, image = file.soundings(), file.read("seabed image")
        assert not file.check() and found.sizes["ping"] == image.sizes["ping"] == 9
    for ping, theirs in enumerate(datagrams("all", "kongsbergall", "XYZDatagram")):
        assert_agree(found.down[ping], theirs.beams.get_depth_tensor())
        assert_agree(found.starboard[ping], theirs.beams.get_acrosstrack_distance_tensor())
        assert_agree(found.backscatter[ping], theirs.beams.get_backscatter_tensor())
        assert_agree(found.transducer_depth[ping], theirs.get_transmit_transducer_depth())
        assert_agree(found.detection[ping] == 0, theirs.beams.get_detection_is_valid_tensor())
    ranges = {(part.get_ping_counter(), part.get_system_serial_number()): part
              for part in datagrams("all", "kongsbergall", "RawRangeAndAngle")}  # fmt: skip
    for ping in range(9):
        theirs = ranges[int(found.ping_number[ping]), int(found.serial[ping])]
        assert_agree(found.travel_time[ping], theirs.beams.get_two_way_travel_time_tensor())
        assert_agree(found.beam_angle[ping], theirs.beams.get_beam_crosstrack_angle_in_degrees_tensor(), -DEGREE)
        assert_agree(found.frequency[ping], theirs.transmit_sectors.get_center_frequency_tensor())
        assert_agree(
            found.absorption[ping], theirs.transmit_sectors.get_mean_absorption_coefficient_in_dB_per_m_tensor()
        )
    for ping, theirs in enumerate(datagrams("all", "kongsbergall", "SeabedImageData")):
        counts, order = theirs.beams.get_number_of_samples_tensor(), theirs.beams.get_sorting_direction_tensor()
        assert_agree(image.sample_count[ping], counts)
        samples = np.concatenate(
            [np.ravel(beam) for beam in theirs.get_sample_amplitudes().get_sample_amplitudes_in_db()]
        )
        for beam, part in enumerate(np.split(samples, np.cumsum(counts)[:-1])):
            assert_agree(image.level[ping, beam, : len(part)], part[:: int(order[beam])])


def test_all_attitude_position_and_profile():
    """Every sample of attitude and the profile; heave is that of the file, positive down."""
    with opened("all") as file:
        attitude, navigation, (profile,) = file.attitude(), file.navigation(), file.sound_speed_profiles()
    parts = datagrams("all", "kongsbergall", "AttitudeDatagram")
    for name, theirs, scale in (("roll", "roll_in_degrees", DEGREE), ("yaw", "heading_in_degrees", DEGREE),
                                ("heave", "heave_in_meters", 1)):  # fmt: skip
        assert_agree(
            attitude[name], np.concatenate([getattr(p.attitudes, f"get_{theirs}_tensor")() for p in parts]), scale
        )
    times = [p.get_timestamp() + np.float64(p.attitudes.get_time_in_seconds_tensor()) for p in parts]
    np.testing.assert_allclose(attitude.time, np.concatenate(times), rtol=0, atol=1e-6)
    positions = datagrams("all", "kongsbergall", "PositionDatagram")
    assert_agree(navigation.latitude, [p.get_latitude_in_degrees() for p in positions], DEGREE)
    (theirs,) = datagrams("all", "kongsbergall", "SoundSpeedProfileDatagram")
    assert_agree(profile.depth, theirs.get_depths_in_meters())
    assert_agree(profile.sound_speed, theirs.get_sound_speeds_in_meters_per_second())


def test_wcd_samples():
    """Every sample of the water column of the EM2040; of the last ping the file has one part of two."""
    with opened("wcd") as file:
        found = file.read("water column")
        assert [o.reason for o in file.check()] == ["k: 2 parts are stated, and 1 can be read"]
    pings: dict[tuple[int, int], list[object]] = {}
    for part in datagrams("wcd", "kongsbergall", "WatercolumnDatagram"):
        pings.setdefault((part.get_ping_counter(), part.get_system_serial_number()), []).append(part)
    assert len(pings) == found.sizes["ping"] == 10
    for ping, parts in enumerate(pings.values()):
        beams = [beam for part in sorted(parts, key=lambda p: p.get_datagram_number()) for beam in part.beams.beams]
        levels = found.level.values[ping]
        theirs = np.concatenate([np.ravel(beam.get_samples_in_db(0.0)) for beam in beams])
        np.testing.assert_array_equal(levels[np.isfinite(levels)], theirs)
        assert_agree(
            found.beam_angle[ping][: len(beams)], [b.get_beam_crosstrack_angle_in_degrees() for b in beams], -DEGREE
        )
        assert_agree(
            found.detected_sample[ping][: len(beams)].fillna(0), [b.get_detected_range_in_samples() for b in beams]
        )


def test_xtf_samples_and_navigation():
    """Every sample, position and attitude of the wreck's sidescan."""
    pyxtf = pytest.importorskip("pyxtf", reason="the independent reader is not installed")
    with opened("xtf") as file:
        port, starboard, attitude = file.read("port"), file.read("starboard"), file.attitude()
        assert not file.check()
    _, packets = pyxtf.xtf_read(str(DATA / FILES["xtf"]))
    pings = packets[pyxtf.XTFHeaderType.sonar]
    np.testing.assert_array_equal(port.amplitude.values[:, ::-1], [ping.data[0] for ping in pings])
    np.testing.assert_array_equal(starboard.amplitude, [ping.data[1] for ping in pings])
    assert_agree(port.latitude[1:], [ping.SensorYcoordinate for ping in pings[1:]], DEGREE)
    assert_agree(port.speed, [ping.SensorSpeed for ping in pings], 1852 / 3600)
    assert_agree(attitude["pitch"], [ping.SensorPitch for ping in pings], DEGREE)
    assert_agree(port.slant_range, [ping.ping_chan_headers[0].SlantRange for ping in pings])
    assert (
        np.isnan(port.latitude[0]) and set(port.sound_speed.values) == {1500.0} and set(port.frequency.values) == {6e5}
    )
    np.testing.assert_allclose(port.slant_range / 1024, port.sample_interval * 1500 / 2, rtol=1e-6)


def test_the_small_files_are_those_of_the_formats(tmp_path):
    """Other readers find in them what was written: the writer of the tests has not made the readers' mistakes."""
    (path := tmp_path / "a.kmall").write_bytes(files.kmall())
    for ping, swath in enumerate(datagrams("kmall", "kmall", "M_RANGE_AND_DEPTH", path)):
        assert swath.get_ping_count() == 100 + ping and swath.rx_info.get_number_of_extra_detections() == 1
        assert_agree(swath.soundings.get_beam_angle_re_rx_deg_tensor(), 60.0 - 20 * np.arange(files.BEAMS + 1))
        assert_agree(swath.tx_sectors.get_centre_frequency_hz_tensor(), [300e3, 320e3])
        assert_agree(swath.ping_info.get_z_water_level_re_ref_point_m(), -1.0)
        assert_agree(np.ravel(swath.get_seabed_image_samples_db()), -0.1 * np.arange(15))
    for column in datagrams("kmall", "kmall", "M_WATER_COLUMN", path):
        # Its beams are not compared: version 0.35 takes the phases of a beam for the beam that follows.
        assert_agree([column.rx_info.get_tvg_function_applied(), column.tx_info.get_heave_m()], [30, 0.5])
    (attitude,) = datagrams("kmall", "kmall", "S_KM_BINARY", path)
    assert_agree(attitude.sensor_data.get_roll_deg_tensor(), np.arange(4))
    (path := tmp_path / "a.all").write_bytes(files.kongsberg_all())
    for theirs in datagrams("all", "kongsbergall", "XYZDatagram", path):
        assert_agree(theirs.beams.get_backscatter_tensor(), np.full(files.BEAMS, -20.0))
        assert theirs.beams.get_detection_is_valid_tensor().tolist() == [True, True, False, False, True]
    for theirs in datagrams("all", "kongsbergall", "RawRangeAndAngle", path):
        assert_agree(theirs.beams.get_beam_crosstrack_angle_in_degrees_tensor(), 60.0 - 30 * np.arange(files.BEAMS))
    (theirs,) = datagrams("all", "kongsbergall", "SoundSpeedProfileDatagram", path)
    assert_agree(theirs.get_sound_speeds_in_meters_per_second(), [1480, 1490])
    assert theirs.get_depth_resolution() == 10  # which its depths in metres leave out
    for theirs in datagrams("all", "kongsbergall", "WatercolumnDatagram", path):
        first = 0 if theirs.get_datagram_number() == 1 else 3
        for beam, part in enumerate(theirs.beams.beams):
            assert_agree(part.get_samples_in_db(0.0), files.kmall_level(theirs.get_ping_counter())[first + beam] / 2)


@pytest.mark.filterwarnings("ignore:XTFHeaderType")
def test_the_small_xtf_file_is_one(tmp_path):
    """Pyxtf finds the channels as they are stored, the attitude and the packet of a kind unknown."""
    pyxtf = pytest.importorskip("pyxtf", reason="the independent reader is not installed")
    (tmp_path / "a.xtf").write_bytes(files.xtf())
    _, packets = pyxtf.xtf_read(str(tmp_path / "a.xtf"))
    assert {kind.name: len(found) for kind, found in packets.items()} == {"sonar": 3, "attitude": 3, "unknown": 1}
    for ping, theirs in enumerate(packets[pyxtf.XTFHeaderType.sonar]):
        for channel, samples in enumerate(theirs.data):
            assert samples.tolist() == files.xtf_samples(ping, channel)[:: 2 * channel - 1].tolist()
        assert theirs.SensorSpeed == 2.0 and theirs.Heave == 0.5 and theirs.Second == ping
    assert packets[pyxtf.XTFHeaderType.attitude][0].Roll == 90.0


def test_readings_of_other_sensors():
    """Clock, error of positions and positions at the water line of KMALL; clock, height and attitude of .all."""
    with opened("kmall") as file:
        found = file.sensors()
    for name, kind, source, values in (
        ("clock", "kmall", "S_CLOCK", {"deviation": ("clock_dev_pu_microsec", 1e-6), "offset": ("offset_sec", 1)}),
        ("position error", "kmall", "S_POSITION_ERROR", {"latitude_error": ("latitude_error_m", 1),
         "major_axis": ("ellipse_semi_major_axis_error_m", 1), "height_error": ("height_error_m", 1)}),
        ("position at the water line", "kmall", "C_POSITION", {"latitude": ("corrected_lat_deg", DEGREE)}),
    ):  # fmt: skip
        parts = datagrams(kind, "kmall", source)
        for ours, (theirs, scale) in values.items():
            assert_agree(found[name][ours], [getattr(part, f"get_{theirs}")() for part in parts], scale)
    with opened("all") as file:
        found = file.sensors()
    assert_agree(found["height"].height, [part.get_height() for part in datagrams("all", "kongsbergall",
                                                                          "DepthOrHeightDatagram")], 0.01)  # fmt: skip
    clocks = datagrams("all", "kongsbergall", "ClockDatagram")
    assert_agree(found["clock"].external_time, [part.get_time_since_midnight_external() for part in clocks], 1e-3)
    parts = [part.get_attitudes() for part in datagrams("all", "kongsbergall", "NetworkAttitudeVelocityDatagram")]
    roll = np.concatenate([np.ravel(part.get_roll_in_degrees_tensor()) for part in parts])
    assert_agree(found["attitude of the network"]["roll"], roll, DEGREE)
