"""Claims about XTF: fields at the offsets of the tables of rev. X41, in its units; 0 where a program states no value.

Neither the layouts of the reader nor those of the writer are used.
"""

import struct

import numpy as np
import pytest

import insonify
from insonify import open_instrument
from oracles.surveys import ORIGIN, sidescan

TIME = 1700000000
"""2023-11-14 22:13:20 UTC, in seconds since 1970."""
DATE = {14: ("H", 2023), 16: ("B", 11), 17: ("B", 14), 18: ("B", 22), 19: ("B", 13), 20: ("B", 20)}
CHANNEL, SAMPLES = {0: ("H", 0), 4: ("f", 75.0), 16: ("f", 0.1)}, np.array([1, 2, 40000], "<u2")


def put(size, fields):
    """Bytes with numbers at their offsets: {offset: (type, value)}."""
    content = bytearray(size)
    for offset, (kind, value) in fields.items():
        struct.pack_into(f"<{kind}", content, offset, value)
    return bytes(content)


def packet(kind, size, fields, body=b""):
    """A packet padded to a multiple of 64 bytes (section 4.2)."""
    whole = -(-(size + len(body)) // 64) * 64
    return (put(size, {0: ("H", 0xFACE), 2: ("B", kind), 10: ("I", whole)} | fields) + body).ljust(whole, b"\0")


def ping(*channels, **fields):
    """Tables H and I: a sonar ping with a header and samples of each channel."""
    body = b"".join(
        put(64, CHANNEL | {0: ("H", number), 42: ("I", samples.size)} | more) + samples.tobytes()
        for number, (more, samples) in enumerate(channels)
    )
    return packet(0, 256, {4: ("H", len(channels))} | DATE | fields.get("head", {}), body)


def opened(tmp_path, channels, *packets, head=None):
    """Tables C and D: a file of channels {offset: (type, value)} and packets, open."""
    about = {0: ("B", 123), 1: ("B", 1), 10: ("3s", b"223"), 164: ("H", 3), 166: ("H", len(channels))} | (head or {})
    whole = put(256, about) + b"".join(put(128, channel) for channel in channels)
    (tmp_path / "a.xtf").write_bytes(whole.ljust(1024, b"\0") + b"".join(packets))
    return open_instrument(tmp_path / "a.xtf")


def side(kind, size=2, **more):
    """Table D: type of a channel and bytes of a sample."""
    return {0: ("B", kind), 6: ("H", size)} | {int(offset[1:]): value for offset, value in more.items()}


def test_a_ping_has_the_units_of_its_tables(tmp_path):
    """Tables C, D, H, I: knots, half the sound speed, degrees, heave up, hundredths of a second, offsets X, Y, Z."""
    about = side(2, o28=("f", 2.5), o36=("f", 1.0), o44=("f", 50.0), o48=("f", 0.5), o52=("f", -3.0), o56=("f", 0.25))
    head = {21: ("B", 50), 28: ("I", 17), 32: ("f", 740.0), 152: ("f", 4.0), 160: ("d", 54.0), 168: ("d", -3.0),
            184: ("f", 30.0), 192: ("f", 6.0), 196: ("f", 4.0), 204: ("f", 1.0), 208: ("f", -2.0), 212: ("f", 90.0),
            216: ("f", 0.25)}  # fmt: skip
    more = {12: ("f", 0.01), 20: ("f", 0.2), 26: ("H", 450), 30: ("H", 6), 58: ("h", 3)}
    with opened(tmp_path, [about], ping((more, SAMPLES), head=head), head={204: ("i", 250), 216: ("f", 7.0)}) as file:
        found, settings = file.read("starboard"), {setting.name: setting.value for setting in file.settings()}
        assert file.check() == () and float(found.time[0]) == TIME + 0.5
    expected = {
        "sound_speed": 1480, "speed": 4 * 1852 / 3600, "latitude": np.radians(54), "longitude": np.radians(-3),
        "layback": 30, "sensor_depth": 6, "altitude": 4, "pitch": np.radians(1), "roll": np.radians(-2), "weight": 3,
        "heading": np.pi / 2, "heave": -0.25, "slant_range": 75, "time_delay": 0.01, "ping_interval": 0.2,
        "gain_code": 6, "frequency": 450e3, "sample_interval": 0.1 / 3, "ping_number": 17, "sample_count": 3,
    }  # fmt: skip
    for name, value in expected.items():
        assert float(found[name][0]) == pytest.approx(value, rel=1e-6), name
    assert found.amplitude.values.tolist() == [[1, 2, 40000]]  # a weight is that of EdgeTech and Kongsberg only
    stated = {"navigation latency": 0.25, "navigation forward": 7, "channel 0 volts at full scale": 2.5,
              "channel 0 along beam width": np.radians(1), "channel 0 across beam width": np.radians(50),
              "channel 0 starboard": 0.5, "channel 0 forward": -3, "channel 0 down": 0.25}  # fmt: skip
    assert {name: settings[name] for name in stated} == pytest.approx(stated, rel=1e-6)


def test_values_that_are_not_stated_are_none(tmp_path):
    """Table B: unused fields are 0, also sound speed, frequency and altitude; the computed sound speed comes next."""
    with opened(
        tmp_path, [side(1)], ping(({16: ("f", 0.0)}, SAMPLES)), ping(({}, SAMPLES), head={72: ("f", 1490.0)})
    ) as file:
        found, settings = file.read("port"), {setting.name for setting in file.settings()}
        assert list(file.groups) == ["port"]
    for name in ("altitude", "frequency", "ping_interval", "latitude"):
        assert np.isnan(found[name]).all(), name
    assert np.isnan(found.sound_speed[0]) and found.sound_speed[1] == 1490 and np.isnan(found.sample_interval[0])
    assert (
        not {"channel 0 volts at full scale", "channel 0 frequency as stated", "channel 0 along beam width"} & settings
    )


@pytest.mark.parametrize(("sonar", "factor"), [(24, 0.25), (35, 0.25), (38, 0.25), (48, 0.25), (32, 1)])
def test_samples_of_edgetech_have_a_weight(tmp_path, sonar, factor):
    """Table I, byte 58: counts are over 2^weight, so that pings of different weights have one scale."""
    pings = [ping(({58: ("h", weight)}, SAMPLES)) for weight in (2, 0)]
    with opened(tmp_path, [side(2)], *pings, head={34: ("H", sonar)}) as file:
        found = file.read("starboard").amplitude.values
    np.testing.assert_array_equal(found, SAMPLES * np.array([[factor], [1]]))


@pytest.mark.parametrize(("size", "samples"), [(1, [-3, 100, -128]), (2, [-3, 300, -32768]), (4, [-3, 300, -70000])])
def test_polar_samples_of_a_sub_bottom_profiler_are_signed(tmp_path, size, samples):
    """Table D, byte 4: 0 is polar, 1 unipolar; samples of an envelope (port, starboard) have no sign."""
    values = np.array(samples, f"<i{size}")
    for kind, unipolar, name in ((0, 0, "sub-bottom"), (0, 1, "sub-bottom"), (2, 0, "starboard")):
        with opened(tmp_path, [side(kind, size, o4=("H", unipolar))], ping(({}, values))) as file:
            found = file.read(name).amplitude.values[0]
        expected = values if (kind, unipolar) == (0, 0) else values.view(f"<u{size}")
        np.testing.assert_array_equal(found, expected.astype(np.float32))


def test_old_files_state_samples_in_the_file_header(tmp_path):
    """Section 4.3: bytes 8-11 of a channel, where the header of the ping's channel has 0."""
    with opened(tmp_path, [side(2, o8=("I", 3))], ping(({42: ("I", 0)}, SAMPLES)), head={10: ("3s", b"222")}) as file:
        found = file.read("starboard")
        assert file.check() == () and found.amplitude.values.tolist() == [[1, 2, 40000]]
        assert float(found.sample_interval[0]) == pytest.approx(0.1 / 3)


@pytest.mark.parametrize(("version", "is_padded"), [(302, False), (303, True), (312, True), (313, False)])
def test_versions_of_isis_that_pad_each_channel(tmp_path, version, is_padded):
    """Section 4.1: from 303 to 312, channels and not packets are multiples of 64 bytes."""
    padding = np.zeros(29 if is_padded else 0, "<u2")  # 6 + 58 bytes
    body = b"".join(
        put(64, CHANNEL | {0: ("H", number), 42: ("I", 3)}) + np.concatenate([SAMPLES + number, padding]).tobytes()
        for number in range(2)
    )
    one = packet(0, 256, {4: ("H", 2)} | DATE, body)
    head = {10: ("3s", str(version).encode())}
    with opened(tmp_path, [side(1), side(2)], one, one, head=head) as file:
        assert file.check() == () and file.read("starboard").amplitude.values[0].tolist() == [2, 3, 40001]


def test_sensors_have_the_units_and_times_of_their_tables(tmp_path):
    """Table E, P and that of 3.1.18: epochs with microseconds, dates with milliseconds, their tenths, microseconds."""
    date = {offset + 40: value for offset, value in DATE.items()}
    motion = {30: ("f", 1.0), 34: ("f", 2.0), 38: ("f", 0.5), 42: ("f", 3.0), 50: ("f", 45.0)}
    epoch = {22: ("I", 250_000), 26: ("I", TIME)}
    attitudes = [packet(3, 64, motion | epoch), packet(3, 64, motion | date | {22: ("I", 7), 61: ("H", 750)})]
    position = DATE | {33: ("d", 54.0), 41: ("d", -3.0), 49: ("d", 12.0), 57: ("B", 3)}
    fixes = [packet(42, 64, position | {21: ("I", 250_000), 25: ("I", TIME)}),
             packet(42, 64, position | {21: ("I", 750_000)})]  # fmt: skip
    raw = DATE | {21: ("H", 7501), 23: ("d", 55.0), 31: ("d", -4.0), 47: ("f", 1.0), 51: ("f", 2.0), 55: ("f", 0.5),
                  59: ("f", 45.0)}  # fmt: skip
    with opened(tmp_path, [side(2)], *attitudes, *fixes) as file:
        attitude, navigation = file.attitude(), file.navigation()
    for found in (attitude, navigation):
        np.testing.assert_allclose(found.time, [TIME + 0.25, TIME + 0.75], atol=1e-6, rtol=0)
    for name, value in (("pitch", np.radians(1)), ("roll", np.radians(2)), ("heave", -0.5), ("yaw", np.radians(45))):
        np.testing.assert_allclose(attitude[name], value, rtol=1e-6)
    np.testing.assert_allclose(navigation.latitude, np.radians(54))
    with opened(tmp_path, [side(2)], packet(107, 64, raw)) as file:
        attitude, navigation = file.attitude(), file.navigation()
    assert float(navigation.time[0]) - TIME == pytest.approx(0.7501, abs=1e-6)
    assert float(navigation.longitude[0]) == pytest.approx(np.radians(-4))
    assert float(attitude["roll"][0]) == pytest.approx(np.radians(2)) and float(attitude.heave[0]) == -0.5


def test_soundings_of_qinsy(tmp_path):
    """Section 3.1.16: two-way travel time, beam angle positive to starboard, tilt positive forward."""
    beams = b"".join(struct.pack("<ididdddffff", number, 7.0, 3, 0.02, 0.0, angle, 5.0, *(0.0,) * 4)
                     for number, angle in enumerate((-60.0, 60.0)))  # fmt: skip
    one = packet(28, 256, {4: ("H", 2), 32: ("f", 1500.0)} | DATE, beams)
    with opened(tmp_path, [side(3)], one) as file:
        found = file.soundings()
    np.testing.assert_allclose(found.beam_angle, np.radians([[-60, 60]]))
    for name, value in (
        ("travel_time", 0.02),
        ("tilt", np.radians(5)),
        ("intensity", 7),
        ("quality", 3),
        ("sound_speed", 1500),
    ):
        np.testing.assert_allclose(found[name], value, err_msg=name)


def test_a_written_file_has_the_fields_of_the_tables(tmp_path):
    """Mandatory fields, a version that readers take for a recent one (section 4.1), unsigned samples, units."""
    recording = insonify.simulate(sidescan(pings=2), threads=1).assign_attrs(ORIGIN)
    content = insonify.export(recording, tmp_path / "a.xtf").read_bytes()

    def number(kind, offset):
        return struct.unpack_from(f"<{kind}", content, offset)[0]

    assert (content[:2], content[10:18].rstrip(b"\0")) == (b"\x7b\1", b"223")
    assert [number("H", offset) for offset in (164, 166, 168)] == [3, 2, 0]
    for channel, kind in ((256, 1), (384, 2)):
        assert [content[channel], content[channel + 74]] == [kind, 3]  # type, 2-byte integers
        assert [number("H", channel + offset) for offset in (2, 4, 6)] == [1, 1, 2]  # slant range, unipolar, bytes
        assert [number("I", channel + 8), number("f", channel + 32)] == [recording.sizes["time"], 300.0]
    starts, at = {}, 1024
    while at < len(content):
        assert number("H", at) == 0xFACE and number("I", at + 10) % 64 == 0
        starts.setdefault(content[at + 2], at)
        at += number("I", at + 10)
    assert number("I", starts[1] + 10) == 256 and content[starts[1] + 56 :].startswith(b"1 count = ")
    sent = starts[0]
    assert [number("f", sent + offset) for offset in (32, 72, 192, 196)] == pytest.approx([750, 1500, 6, 4])
    assert number("f", sent + 152) * 1852 / 3600 == pytest.approx(2) and number("f", sent + 184) == 0
    assert [number("d", sent + 160), number("d", starts[42] + 33)] == pytest.approx([54, 54], abs=1e-3)
    far = float(recording.time[-1] + (recording.time[1] - recording.time[0])) * 750
    assert number("f", sent + 256 + 4) == pytest.approx(far) and number("H", sent + 256 + 26) == 300
    assert [number("f", starts[3] + offset) for offset in (30, 34)] == pytest.approx(
        np.degrees(recording.logged_attitude.values[0, 1:]), abs=1e-5
    )
