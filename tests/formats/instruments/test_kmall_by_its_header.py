"""Claims about KMALL: bytes in the order of `EMdgmFormat.h`, of version 0 and of later ones, and values that are none.

No layout of the reader is used. Versions 0 are those of the first header that Kongsberg published (Copyright 2016-2018:
MRZ_VERSION, MWC_VERSION, SDE_VERSION 0); later fields follow at the end of each part.
"""

import struct

import numpy as np
import pytest

from insonify import open_instrument

TIME = 1_700_000_000


def datagram(kind, version, body):
    """EMdgmHeader: length, name, version, system, model, seconds, nanoseconds; the length again at the end."""
    size = 20 + len(body) + 4
    head = struct.pack("<I4sBBHII", size, kind.encode(), version, 0, 2040, TIME, 250_000_000)
    return head + body + struct.pack("<I", size)


def opened(tmp_path, *datagrams):
    """A file of some datagrams, open."""
    (tmp_path / "a.kmall").write_bytes(b"".join(datagrams))
    return open_instrument(tmp_path / "a.kmall")


def approx(value):
    """A value to the rounding of a 32-bit float."""
    return pytest.approx(value, rel=1e-6, nan_ok=True)


BODY = struct.pack("<HH", 1, 1) + struct.pack("<HH8B", 12, 321, 2, 1, 1, 0, 0, 1, 2, 0)


def soundings(version):
    """#MRZ with two sectors, two beams and an extra detection; longer parts since version 1."""
    later = version > 0
    ping = struct.pack("<f6BHf6f4f2h", 7.5, 1, 103, 0, 100, 100, 2, 0, 3e5, 28e4, 32e4, 2e-4, 1e-4, 9e3, 60.0, 65.0,
                       -64.0, 60.0, -59.0, 17, -16)  # fmt: skip
    ping += struct.pack("<BBHI3fHHf", 1, 2, 3, 0, 1.5, 1.25, -10.0, 0, 0, 0.5)
    ping += struct.pack("<HH6f4Bddf", 2, 48 if later else 36, 90.0, 1480.0, 2.5, -1.5, 0.0, 0.0, 1, 0, 0, 0, 59.0,
                        200.0, 40.0)  # fmt: skip
    ping += struct.pack("<fBBH", 0.5, 1, 0, 0) if later else b""
    sectors = b"".join(
        struct.pack("<4B7fBBH", number, 0, number, 0, 1e-4 * number, 2.0, 205.0, 0.0, 29e4 + 1e4 * number, 1e4, 2e-4,
                    40, 1, 0) + (struct.pack("<3f", -3.0, 0.0, 1e-4) if later else b"")
        for number in range(2)
    )  # fmt: skip
    rx = struct.pack("<4H4f4H", 32, 2, 1, 120, 20e3, 40e3, -20.0, -30.0, 0, 1, 1, 4) + bytes(4)
    beams = b"".join(
        struct.pack("<H8BH6f", number, 1, kind, 2 - kind, 0, 0, 0, 0, 7, 0, 100.0, 0.5, 0.04, 0.02, 1e-3, 2e-4)
        + struct.pack("<HHf", 3, 400, 60.5)
        + struct.pack("<7f", 62.0, -22.0, -23.0, -190.0, 204.0, 0.5, 80.0)
        + struct.pack("<4f", 61.0, 0.0, 0.0125, 0.0)
        + struct.pack("<6f", 1e-5, -2e-5, 9.0, -12.0, 0.25, -1.0)
        + struct.pack("<4H", 0, 390, 1, 2)
        for number, kind in enumerate((0, 2, 1))
    )
    part = struct.pack("<HH", 4 + len(ping), 0) + ping
    return BODY + part + sectors + rx + beams + struct.pack("<6h", -201, -202, -203, -204, -205, -206)


@pytest.mark.parametrize("version", [0, 1])
def test_soundings_have_the_units_and_signs_of_the_header(tmp_path, version):
    """EMdgmMRZ: angles positive to port, percent, dB/km, tenths of dB; depth from the reference point; 200 is none."""
    with opened(tmp_path, datagram("#MRZ", version, soundings(version))) as file:
        found, image = file.soundings(), file.read("seabed image")
        assert file.check() == () and file.instrument.model == "EM2040" and float(found.time[0]) == TIME + 0.25
    expected = {
        "ping_number": 321, "fan": 1, "swath": 0, "latitude": np.radians(59), "longitude": np.nan,
        "heading": np.pi / 2, "sound_speed": 1480, "transducer_depth": 2.5, "water_level": -1.5, "ping_rate": 7.5,
        "pulse_length": 2e-4, "tx_beam_width": np.radians(1.5), "transmit_power": -10, "depth_mode": 103,
        "pulse_form": 2, "image_sample_rate": 40e3, "water_column_sample_rate": 20e3, "oblique_level": -30,
    }  # fmt: skip
    for name, value in expected.items():
        assert float(found[name][0]) == approx(value), name
    voltage, effective = (-3, 1e-4) if version else (np.nan, np.nan)
    sectors = {"frequency": 30e4, "sector_delay": 1e-4, "tilt": np.radians(2), "source_level": 205, "shading": 0.4,
               "waveform": 1, "voltage_level": voltage, "effective_pulse_length": effective}  # fmt: skip
    for name, value in sectors.items():
        assert float(found[name][0, 1]) == approx(value), name
    beams = {
        "travel_time": 0.0125, "beam_angle": -np.radians(61), "forward": 0.25, "starboard": -12, "down": 9,
        "depth": 10.5, "delta_latitude": np.radians(1e-5), "backscatter": -23, "backscatter_maker": -22,
        "source_level_applied": 204, "sensitivity_applied": -190, "calibration": 0.5, "gain": 80, "absorption": 0.062,
        "sector": 1, "detection": 0, "detection_method": 2, "quality": 0.005, "vertical_uncertainty": 0.04,
        "echo_length": 2e-4, "incidence_correction": np.radians(-1), "water_column_beam": 3,
        "water_column_sample": 400, "water_column_angle": -np.radians(60.5),
    }  # fmt: skip
    for name, value in beams.items():
        assert float(found[name][0, 0]) == approx(value), name
    assert found.detection.values.tolist() == [[0, 2, 1]]
    np.testing.assert_allclose(image.level[0], [[-20.1, -20.2], [-20.3, -20.4], [-20.5, -20.6]], rtol=1e-6)
    assert image.first_sample.values[0, 0] == 390 and image.centre_sample.values[0, 0] == 1


@pytest.mark.parametrize(("version", "detected"), [(0, 12), (2, 12.25)])
def test_water_columns_of_earlier_versions_have_whole_ranges(tmp_path, version, detected):
    """EMdgmMWC: half decibels, the finer range of the detection since version 2, 0 without a detection."""
    tx = struct.pack("<HHHhf", 12, 1, 16, 0, -0.25) + struct.pack("<fffHh", 2.0, 3e5, 1.5, 0, 0)
    rx = struct.pack("<HHBBBbff", 16, 2, 16 if version else 12, 0, 30, -20, 4e4, 1480.0)
    beams = b""
    for angle, whole in ((60.0, 12), (-60.0, 0)):
        beams += struct.pack("<f4H", angle, 2, whole, 0, 3) + (
            struct.pack("<f", whole * 12.25 / 12) if version else b""
        )
        beams += struct.pack("<3b", -128, 1, 127)
    with opened(tmp_path, datagram("#MWC", version, BODY + tx + rx + beams)) as file:
        found = file.read("water column")
        assert file.check() == ()
    np.testing.assert_array_equal(found.level[0], [[-64, 0.5, 63.5]] * 2)
    np.testing.assert_array_equal(found.detected_sample[0], [detected, np.nan])
    expected = {"beam_angle": -np.pi / 3, "first_sample": 2, "heave": -0.25, "gain_exponent": 30, "gain_offset": -20}
    for name, value in expected.items():
        assert float(found[name].values.ravel()[0]) == approx(value), name


def test_values_that_a_position_sensor_marks_as_invalid_are_none(tmp_path):
    """EMdgmScommon: bit 4 of the status; speed -1, course -4 and height -999 are unavailable."""
    fix = struct.pack("<IIfddfff", TIME, 0, 0.5, 59.0, -10.0, -1.0, -4.0, -999.0) + b"$GPGGA\r\n"
    parts = [datagram("#SPO", 0, struct.pack("<4H", 8, 0, status, 0) + fix) for status in (0x01, 0x11, 0x05)]
    with opened(tmp_path, *parts) as file:
        found = file.navigation()
    np.testing.assert_allclose(np.degrees(found.latitude), [59, np.nan, 59])
    np.testing.assert_allclose(np.degrees(found.longitude), [-10, np.nan, -10])
    assert all(np.isnan(found[name]).all() for name in ("speed", "course", "ellipsoid_height"))


def test_a_probe_states_the_values_that_it_has(tmp_path):
    """EMdgmSVTinfo: bits of the contents for sound speed, temperature, pressure, salinity; bit 4 of the status."""
    sample = struct.pack("<II4f", TIME, 500_000_000, 1481.5, 0.0, 0.0, 0.0)
    parts = [datagram("#SVT", 0, struct.pack("<6H2f", 20, status, 8, 1, 24, contents, 1.0, 0.0) + sample)
             for status, contents in ((1, 0b0001), (1, 0b0011), (0x10, 0b1111))]  # fmt: skip
    with opened(tmp_path, *parts) as file:
        found = file.sensors()["sound speed at the transducer"]
    np.testing.assert_array_equal(found.sound_speed, [1481.5, 1481.5, np.nan])
    np.testing.assert_array_equal(found.temperature, [np.nan, 0, np.nan])
    assert np.isnan(found.salinity).all() and np.isnan(found.pressure).all() and float(found.time[0]) == TIME + 0.5


def test_the_deviation_of_a_clock_is_in_microseconds(tmp_path):
    """EMdgmSCL of revision I: clockDevPU_microsec; the numbers of an EM 2042, whose ZDA arrives 7.679 ms early."""
    body = struct.pack("<4H", 8, 5, 1, 0) + struct.pack("<fi", 0.0, -7679) + b"$INZDA,110537.10,27,11,2025,,*76\r\n"
    clock = struct.pack("<I4sBBHII", 24 + len(body), b"#SCL", 1, 0, 2042, 1_764_241_537, 92_320_437) + body
    with opened(tmp_path, clock + struct.pack("<I", 24 + len(body))) as file:
        found = file.sensors()["clock"]
    text = 11 * 3600 + 5 * 60 + 37.10
    assert float(found.deviation[0]) == approx(-7.679e-3)
    assert float(found.deviation[0]) == pytest.approx(float(found.time[0]) % 86400 - text, abs=1e-6)


def test_depths_that_a_sensor_marks_as_invalid_are_none(tmp_path):
    """EMdgmSDE, version 0: depth, offset, scale, latitude, longitude behind the status."""
    depth = struct.pack("<3fdd", 13.5, 0.0, 1.0, 59.0, -10.0) + bytes(32)
    parts = [datagram("#SDE", 0, struct.pack("<4H", 8, 0, status, 0) + depth) for status in (0x01, 0x11)]
    with opened(tmp_path, *parts) as file:
        np.testing.assert_array_equal(file.sensors()["depth of the sonar"].depth, [13.5, np.nan])


@pytest.mark.parametrize(("kind", "temperature"), [(b"S00", np.nan), (b"S01", 0.0)])
def test_a_profile_of_sound_speed_alone_has_no_temperature(tmp_path, kind, temperature):
    """EMdgmSVP: temperature and salinity are 0 where the profile is not of a CTD; a time of 0 was not found."""
    head = struct.pack("<HH4sIdd", 28, 1, kind, 0, 200.0, 200.0)
    point = struct.pack("<ffIff", 5.0, 1480.0, 0, 0.0, 0.0)
    with opened(tmp_path, datagram("#SVP", 1, head + point)) as file:
        (found,) = file.sound_speed_profiles()
    assert float(found.sound_speed[0]) == 1480 and float(found.depth[0]) == 5
    np.testing.assert_array_equal([found.temperature[0], found.salinity[0]], [temperature] * 2)
    assert np.isnan(found.attrs["time"]) and "latitude" not in found.attrs
