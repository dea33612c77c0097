"""Claims about .all: bytes in the order of the tables of 850-160692/W, with their own examples, in both byte orders.

No layout of the reader is used. Byte order: "Output datagrams"; the highest number of a field states no value.
"""

import struct

import numpy as np
import pytest

from insonify import open_instrument

DATE, CLOCK = 20090226, 29570234
"""Date and milliseconds of the day of the examples of table 45."""
TIME = 1235606400 + 29570.234
"""The same in seconds since 1970."""
orders = pytest.mark.parametrize("order", ["<", ">"], ids=["little-endian", "big-endian"])


def datagram(order, kind, model, body, counter=7):
    """One datagram: length, STX, type, model, date, time, counter, serial number, body, ETX, checksum; of even size."""
    body += bytes(1 - len(body) % 2)
    content = struct.pack(f"{order}sHIIHH", kind.encode(), model, DATE, CLOCK, counter, 123) + body
    head = struct.pack(f"{order}IB", 1 + len(content) + 3, 2)
    return head + content + struct.pack(f"{order}BH", 3, sum(content) & 0xFFFF)


def opened(tmp_path, *datagrams):
    """A file of some datagrams, open."""
    (tmp_path / "a.all").write_bytes(b"".join(datagrams))
    return open_instrument(tmp_path / "a.all")


def approx(value):
    """A value to the rounding of a 32-bit float."""
    return pytest.approx(value, rel=1e-6, nan_ok=True)


@orders
def test_a_ping_of_later_multibeams(tmp_path, order):
    """Tables 24, 29, 31 and 32: X, N, Y and k; the second beam has no valid detection, heading or level."""
    beams = struct.pack(f"{order}3fHBbBbH", 9.5, -4.0, 0.5, 12, 125, -3, 0x11, 0, 0xFF37)  # -20.1 dB
    beams += struct.pack(f"{order}3fHBbBbH", 9.0, 4.0, 0.25, 12, 255, 127, 0x83, -1, 0x7FFF)
    xyz = struct.pack(f"{order}HHfHHfB3x", 0xFFFF, 14800, 1.5, 2, 1, 15000.0, 0x13) + beams + b"\0"
    ranges = struct.pack(f"{order}HHHHfI", 14800, 1, 2, 1, 15000.0, 100)
    ranges += struct.pack(f"{order}hHfffHBBf", -150, 125, 2e-4, 3e-5, 3e5, 7764, 2, 1, 6687.0)
    ranges += struct.pack(f"{order}hBBHBbfhbB", 4500, 0, 0x01, 9, 50, -2, 0.0125, -201, 0, 0)
    ranges += struct.pack(f"{order}hBBHBbfhbB", -4500, 0, 0x83, 9, 255, 0, 0.013, -201, -1, 0) + b"\0"
    image = struct.pack(f"{order}fHhhHHH", 30000.0, 200, -85, -243, 5, 100, 2)
    image += struct.pack(f"{order}bBHHbBHH", 1, 0, 2, 1, -1, 1, 3, 3)
    image += struct.pack(f"{order}H4h", 0xFED2, -10, -3, -2, -1) + b"\0"  # -30.2 dB
    water = struct.pack(f"{order}6HIhBbB3x", 1, 1, 1, 2, 2, 14800, 1531863, -21, 30, 40, 0)
    water += struct.pack(f"{order}hHBB", 125, 30000, 0, 0)
    water += struct.pack(f"{order}hHHHBB4b", -6000, 3, 4, 0, 0, 0, -128, -60, 0, 127)
    water += struct.pack(f"{order}hHHHBB2b", 6000, 0, 2, 196, 0, 1, 20, -1)
    parts = [datagram(order, kind, 2040, body) for kind, body in zip("NXYk", (ranges, xyz, image, water), strict=True)]
    with opened(tmp_path, *parts) as file:
        found, levels, column = file.soundings(), file.read("seabed image"), file.read("water column")
        assert file.check() == () and file.instrument.model == "EM2040" and abs(float(found.time[0]) - TIME) < 1e-6
    expected = {
        "heading": np.nan, "sound_speed": 1480, "transducer_depth": 1.5, "sample_rate": 15000, "ping_number": 7,
        "serial": 123, "down": [9.5, 9], "starboard": [-4, 4], "forward": [0.5, 0.25], "depth": [11, 10.5],
        "backscatter": [-20.1, np.nan], "quality": [0.5, np.nan], "incidence_correction": [np.radians(-0.3), np.nan],
        "cleaning": [0, -1], "detection": [0, 2], "detection_method": [2, 0], "travel_time": [0.0125, 0.013],
        "beam_angle": np.radians([-45, 45]), "sector": [0, 0], "frequency": [3e5], "tilt": np.radians([-1.5]),
        "focus_range": [12.5], "pulse_length": [2e-4], "sector_delay": [3e-5], "bandwidth": [6687],
        "absorption": [0.07764], "waveform": [2],
    }  # fmt: skip
    for name, values in expected.items():
        assert np.ravel(found[name][0]).tolist() == approx(np.ravel(values).tolist()), name
    np.testing.assert_allclose(levels.level[0], [[-30.2, -1.0, np.nan], [-0.1, -0.2, -0.3]], rtol=1e-6)
    assert levels.centre_sample[0].values.tolist() == [1, 1] and float(levels.oblique_level[0]) == approx(-24.3)
    assert [float(levels[name][0]) for name in ("normal_level", "normal_sample", "image_sample_rate")] == approx(
        [-8.5, 200, 3e4]
    )
    assert np.degrees([levels.tx_beam_width[0], levels.crossover_angle[0]]).tolist() == approx([0.5, 10])
    np.testing.assert_array_equal(column.level[0], [[-64, -30, 0, 63.5], [10, -0.5, np.nan, np.nan]])
    assert np.degrees(column.beam_angle[0].values).tolist() == approx([60, -60])
    assert column.detected_sample[0].values.tolist() == approx([np.nan, 196]) and int(column.first_sample[0, 0]) == 3
    numbers = [float(column[name][0]) for name in ("sample_rate", "heave", "gain_exponent", "gain_offset")]
    assert [*numbers, float(column.frequency[0, 0])] == approx([15318.63, -0.21, 30, 40, 3e5])


@orders
@pytest.mark.parametrize("model", [300, 1002, 3020, 3002, 3005])
def test_a_ping_of_earlier_multibeams(tmp_path, order, model):
    """Tables 22, 23, 28 and 30: D, f and S. An EM 3000D (3002, 3005) states the depth of its second head, as of 128.

    An EM 300 has depths without sign; 3020 is the number of an EM 3002. Beams of the image state no method.
    """
    deeper = model == 3005
    depth = struct.pack(f"{order}HHHBBBBH", 9000, 14800, 150, 254, 3, 2, 10, 0x10000 - 40 if model > 3000 else 15000)
    for number, down, level, quality in ((1, 1000, 216, 0x05), (128, 40000, 0x7F, 0xC5), (129, 0, 0xFF, 0x85)):
        depth += struct.pack(f"{order}HhhhHHBBBB", down, -500, 0x7FFF, 4500, 0, 900, quality, 3, level, number)
    depth += struct.pack(f"{order}b", 1)
    ranges = struct.pack(f"{order}HHIiHHHH", 1, 3, 1500000, 0, 14800, 254, 0, 0)
    ranges += struct.pack(f"{order}hHIIIHBB", -100, 0, 150, 20, 300000, 800, 1, 0)
    ranges += b"".join(
        struct.pack(f"{order}hHBbBBhH", 3000 * k, 600 + k, 0, -40, 5, 2, k, 0) for k in (-1, 0, 1)
    ) + b"\0"  # fmt: skip
    image = struct.pack(f"{order}5HbbHBB", 4000, 150, 300, 0, 0, -20, 0x7F, 15, 25, 2)
    image += struct.pack(f"{order}BbHHBbHH", 0, 1, 2, 1, 1, -1, 2, 2) + struct.pack("4B", 196, 0, 254, 255)  # -30 dB
    parts = [datagram(order, kind, model, body) for kind, body in zip("fDS", (ranges, depth, image), strict=True)]
    with opened(tmp_path, *parts) as file:
        found, levels = file.soundings(), file.read("seabed image")
        names = {300: "EM300", 1002: "EM1002", 3020: "EM3002", 3002: "EM3000D", 3005: "EM3000D"}
        assert file.check() == () and file.instrument.model == names[model]
    down = [20.0, 0.02 * (40000 if model == 300 else 40000 - 65536) - 0.4 * deeper, -0.4 * deeper]
    assert found.down[0].values.tolist() == approx(down) and float(found.transducer_depth[0]) == approx(655.36 + 1.5)
    assert found.starboard[0].values.tolist() == approx([-50] * 3) and np.isnan(found.forward).all()
    assert found.backscatter[0].values.tolist() == approx([-20, np.nan, -0.5])
    assert found.detection_method[0].values.tolist() == [1, 2, 2] and np.degrees(found.heading[0]) == approx(90)
    rate = np.nan if model in (3002, 3005) else 65496 if model > 3000 else 15000
    assert float(found.sample_rate[0]) == approx(rate)
    assert found.travel_time[0].values.tolist() == approx([(600 + k) / (4 * 15000) for k in (-1, 0, 1)])
    assert np.degrees(found.beam_angle[0].values).tolist() == approx([30, 0, -30])
    sector = [float(found[name][0, 0]) for name in ("pulse_length", "sector_delay", "frequency", "bandwidth")]
    assert sector == approx([150e-6, 20e-6, 3e5, 8000]) and np.degrees(found.tilt[0, 0]) == approx(-1)
    np.testing.assert_allclose(levels.level[0], [[-30, 0], [-0.5, -1]])
    assert levels.detection_method[0].values.tolist() == [0, 0] and levels.centre_sample[0].values.tolist() == [1, 1]
    assert [float(levels.normal_level[0]), float(levels.oblique_level[0])] == approx([-20, np.nan])
    assert np.degrees([levels.tx_beam_width[0], levels.crossover_angle[0]]).tolist() == approx([1.5, 2.5])


@orders
def test_sensors_and_parameters(tmp_path, order):
    """Tables 34 to 46 and 48: attitude, position, clock, height, heading, tide, speeds, profile, parameters."""
    entries = struct.pack(f"{order}H", 2) + struct.pack(f"{order}HHhhhH", 0, 0x9090, -150, 75, 25, 35999)
    attitude = entries + struct.pack(f"{order}HHhhhH", 10, 0x9A90, 0x7FFF, 0x7FFF, 0x7FFF, 0xFFFF) + b"\1"
    network = struct.pack(f"{order}HbB", 2, 0x20, 0)
    for milliseconds, size in ((0, 3), (20, 5)):
        network += struct.pack(f"{order}HhhhHB", milliseconds, 100 + milliseconds, -200, -25, 9000, size) + bytes(size)
    position = struct.pack(f"{order}ii4HBB", -651333333, 1102500000, 0xFFFF, 250, 4500, 0xFFFF, 0x82, 3) + b"GGA"
    profile = struct.pack(f"{order}IIHH", DATE, 29571, 2, 10) + struct.pack(f"{order}4I", 0, 14800, 100, 14900) + b"\0"
    runtime = struct.pack(f"{order}6B5Hb5BH4BHhB", 0, 0, 0, 0, 1, 2, 8, 50, 7765, 80, 5, -10, 10, 255, 27, 10, 2,
                          500, 2, 70, 128, 65, 600, -15, 0)  # fmt: skip
    two = struct.pack(f"{order}H", 2)
    bodies = {
        "I": struct.pack(f"{order}H", 10123) + b"WLZ=-2.5,SMH=123,S1X=0.5,S1R=90.0,P2X=-3.25,MSG=1.5,", "R": runtime,
        "p": struct.pack(f"{order}H", 10123) + b"SNL=1,",  # remote information, 70h
        "A": attitude, "n": network, "P": position, "U": profile,
        "C": struct.pack(f"{order}IIB", DATE, CLOCK + 5, 1), "h": struct.pack(f"{order}iB", -4714, 200),
        "H": two + struct.pack(f"{order}4H", 0, 100, 500, 0xFFFF) + b"\1",
        "T": struct.pack(f"{order}IIh", DATE, CLOCK, -120) + b"\0", "E": struct.pack(f"{order}III", 0, 0, 1234) + b"T",
        "G": two + struct.pack(f"{order}4H", 0, 14807, 1, 14808) + b"\0",
        "J": two + struct.pack(f"{order}HhHh", 0, -300, 100, 200) + b"\0",
    }  # fmt: skip
    with opened(tmp_path, *(datagram(order, kind, 2040, body) for kind, body in bodies.items())) as file:
        poses, fixes, found, (sound,) = file.attitude(), file.navigation(), file.sensors(), file.sound_speed_profiles()
        settings = {setting.name: setting for setting in file.settings()}
        assert file.check() == () and {setting.datagram for setting in file.settings()} == {"I", "p", "R"}
    degrees = np.degrees([poses[name].values for name in ("roll", "pitch", "yaw")])
    np.testing.assert_allclose(degrees, [[-1.5, np.nan], [0.75, np.nan], [359.99, np.nan]])
    assert poses.heave.values.tolist() == approx([0.25, np.nan]) and (poses.time - TIME).values[1] == pytest.approx(
        0.01, abs=1e-6
    )
    assert poses.active.values.all() and fixes.active.values.all()
    assert np.degrees([fixes.latitude[0], fixes.longitude[0], fixes.course[0]]).tolist() == approx(
        [-(32 + 34 / 60), 110.25, 45]
    )
    assert [float(fixes[name][0]) for name in ("speed", "heading", "position_uncertainty")] == approx(
        [2.5, np.nan, np.nan]
    )
    assert sound.depth.values.tolist() == [0, 10] and sound.sound_speed.values.tolist() == approx([1480, 1490])
    assert sound.attrs["time"] == TIME - CLOCK / 1000 + 29571
    network_roll = np.degrees(found["attitude of the network"]["roll"].values)
    assert network_roll.tolist() == approx([1, 1.2]) and np.degrees(found["heading"].heading).values.tolist() == approx(
        [1, np.nan]
    )
    single = {"height": -47.14, "tide": -1.2, "single-beam depth": 12.34, "sound speed at the transducer": 1480.7}
    for name, value in single.items():
        assert float(next(iter(found[name].data_vars.values()))[0]) == approx(value), name
    assert np.degrees(found["tilt of the transducer"].tilt.values).tolist() == approx([-3, 2])
    assert float(found["clock"].external_time[0]) == approx(29570.239) and int(found["clock"].external_date[0]) == DATE
    values = {name: setting.value for name, setting in settings.items()}
    expected = {
        "absorption": 0.07765, "pulse length": 80e-6, "transmit power": -10, "receive beam width": np.radians(1),
        "transmit beam width": np.radians(0.5), "crossover angle": np.radians(10), "port swath": 500,
        "starboard swath": 600, "port coverage": np.radians(70), "starboard coverage": np.radians(65),
        "stabilisation": 128, "mode 2": 27, "S1R": np.pi / 2, "P2X": -3.25, "MSG": np.radians(1.5),
    }  # fmt: skip
    assert {name: values[name] for name in expected} == {name: approx(value) for name, value in expected.items()}
    assert "receive bandwidth" not in values  # 255: larger than 12.7 kHz
