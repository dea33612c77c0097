"""Claims about .all and XTF: every field has its place, unit and sign; checksums are verified."""

import numpy as np
import pytest

from insonify.formats.instruments import open_instrument
from oracles import instrument_files as files


@pytest.fixture
def opened(tmp_path):
    """The small .all file, open."""
    (tmp_path / "a.all").write_bytes(files.kongsberg_all())
    with open_instrument(tmp_path / "a.all") as file:
        yield file


def test_levels_and_soundings_are_those_written(opened):
    """Parts of a ping are put in order, falling samples turned round, angles to starboard, missing ranges are NaN."""
    water, image, soundings = opened.read("water column"), opened.read("seabed image"), opened.soundings()
    np.testing.assert_array_equal(water.level, [0.5 * files.kmall_level(ping) for ping in range(3)])
    np.testing.assert_allclose(np.degrees(water.beam_angle[0]), [-60, -30, 0, 30, 60])
    assert set(water.sample_rate.values) == {15e3} and set(water.heave.values) == {-0.25}
    np.testing.assert_allclose(image.level[1, 3, :3], [-0.5, -0.4, -0.3], rtol=1e-6)
    np.testing.assert_allclose(image.level[1, 4], [-0.6, -0.7, -0.8, -0.9], rtol=1e-6)
    assert list(image.centre_sample[0]) == [1, 1, 1, 3, 1]
    np.testing.assert_allclose(soundings.depth, 9.5)
    np.testing.assert_allclose(soundings.backscatter, -20.0)
    assert list(soundings.detection[0]) == [0, 0, 2, 2, 0] and list(soundings.detection_method[0]) == [1, 2, 0, 0, 2]
    assert np.isnan(soundings.travel_time[0]).all() and np.allclose(soundings.absorption[1:], 0.07764)
    np.testing.assert_allclose(np.degrees(soundings.beam_angle[2]), [-60, -30, 0, 30, 60], atol=1e-12)


def test_series_and_settings_are_those_written(opened):
    """Attitude within a datagram, a speed that is not available, a profile, texts and runtime parameters."""
    attitude, (profile,), navigation = opened.attitude(), opened.sound_speed_profiles(), opened.navigation()
    np.testing.assert_allclose(np.degrees(attitude["roll"]), [-1, 0, 1])
    np.testing.assert_allclose(attitude.time - attitude.time[0], [0, 0.01, 0.02], atol=1e-6)
    np.testing.assert_allclose(np.degrees([navigation.latitude[0], navigation.longitude[0]]), [45, -3])
    assert np.isnan(navigation.speed).all() and list(profile.depth) == [0, 10]
    settings = {setting.name: setting for setting in opened.settings()}
    assert settings["S1R"].value == pytest.approx(np.pi / 2) and settings["WLZ"].unit == "m"
    assert settings["pulse length"].value == pytest.approx(80e-6) and settings["transmit power"].value == -10
    assert opened.instrument.serial == "77" and opened.check()[0].reason == "Z: unknown kind of datagram"


def test_a_changed_byte_is_noticed_by_the_checksum(tmp_path):
    """Each byte between start and checksum of a datagram; what follows it is read."""
    whole = bytearray(files.kongsberg_all())
    at = whole.index(b"\x02X") - 4
    size = int.from_bytes(whole[at : at + 4], "little") + 4
    for offset in range(at + 19, at + size - 3, 7):
        changed = bytes(whole[:offset]) + bytes([whole[offset] ^ 4]) + bytes(whole[offset + 1 :])
        (tmp_path / "a.all").write_bytes(changed)
        with open_instrument(tmp_path / "a.all") as file:
            assert list(file.soundings().ping) == [1, 2]
            assert any(part.offset == at and "checksum" in part.reason for part in file.omissions)


def test_xtf_is_what_was_written(tmp_path):
    """Both channels from near to far, sound speed two-way, speed in m/s, heave down, no position where none was."""
    (tmp_path / "a.xtf").write_bytes(files.xtf())
    with open_instrument(tmp_path / "a.xtf") as file:
        assert dict(file.groups) == {"port": 3, "starboard": 3} and file.instrument.maker == "Klein"
        for channel, group in enumerate(file.groups):
            found = file.read(group, slice(1, None))
            np.testing.assert_array_equal(found.amplitude, [files.xtf_samples(ping, channel) for ping in (1, 2)])
        attitude, navigation = file.attitude(), file.navigation()
        assert [part.reason for part in file.check()] == ["TYPE_99: unknown kind of datagram"]
    assert set(found.sound_speed.values) == {1500} and set(found.frequency.values) == {600e3}
    np.testing.assert_allclose(found.speed, 2 * 1852 / 3600)
    np.testing.assert_allclose(found.sample_interval, 0.01, rtol=1e-6)
    np.testing.assert_allclose(attitude.time - navigation.time.values, 0.5, atol=1e-6)
    assert set(attitude.heave.values) == {-0.5} and np.isnan(navigation.latitude).values.tolist() == [
        True,
        False,
        False,
    ]
    np.testing.assert_allclose(attitude["roll"], np.pi / 2)


def reopened(path, *parts):
    """A file of some datagrams, open."""
    path.write_bytes(b"".join(parts))
    return open_instrument(path)


@pytest.mark.parametrize("count", [0, 3, 8])
def test_ranges_of_another_number_of_beams_are_cut_or_padded(count, tmp_path):
    """Soundings keep their five beams; travel times that the file lacks are NaN."""
    p = files.all_parts
    soundings = files.record(p.XYZ, beams=5) + files.record(p.XYZ_BEAM, 5, down=8.0) + b"\0"
    ranges = files.record(p.RANGE, beams=count)
    ranges += files.record(p.RANGE_BEAM, count, travel_time=0.01) if count else b""
    with reopened(
        tmp_path / "a.all", files.all_datagram("X", 1, soundings), files.all_datagram("N", 1, ranges + b"\0")
    ) as file:
        found = file.soundings()
        assert found.sizes["beam"] == 5 and file.check() == ()
        assert np.isfinite(found.travel_time).sum() == min(count, 5)


def test_ranges_of_another_receiver_or_ping_are_not_taken(tmp_path):
    """Pings are joined by the counter and the serial number of the receiver."""
    p = files.all_parts
    soundings = files.record(p.XYZ, beams=1) + files.record(p.XYZ_BEAM) + b"\0"
    ranges = files.record(p.RANGE, beams=1) + files.record(p.RANGE_BEAM, travel_time=0.01) + b"\0"
    other = bytearray(files.all_datagram("N", 1, ranges))
    other[18:20] = (201).to_bytes(2, "little")
    other[-2:] = (sum(other[5:-3]) & 0xFFFF).to_bytes(2, "little")
    parts = [files.all_datagram("X", 1, soundings), bytes(other), files.all_datagram("N", 2, ranges)]
    with reopened(tmp_path / "a.all", *parts) as file:
        found = file.soundings()
        assert "travel_time" not in found or np.isnan(found.travel_time).all()
        assert list(found.serial) == [200] and list(found.ping_number) == [1]
    with reopened(tmp_path / "b.all", *parts, files.all_datagram("N", 1, ranges)) as file:
        np.testing.assert_allclose(file.soundings().travel_time, 0.01)


def test_runtime_parameters_that_are_too_short_are_left_out(tmp_path):
    """What stands before and behind them is read."""
    text = files.all_datagram("I", 0, b"\0\0SMH=7,")
    with reopened(tmp_path / "a.all", text, files.all_datagram("R", 0, bytes(10)), text) as file:
        assert [setting.value for setting in file.settings()] == [7, 7]
        (left_out,) = file.omissions
        assert left_out.offset == len(text) and "too few" in left_out.reason


def test_parts_of_a_water_column_that_are_missing_are_reported(tmp_path):
    """One part of two: its beams are read."""
    for part, beams in ((1, 3), (2, 2)):
        with reopened(tmp_path / "a.wcd", files.all_datagram("k", 0, files.all_water(0, part))) as file:
            assert file.read("water column").sizes["beam"] == beams
            assert [left.reason for left in file.omissions] == ["k: 2 parts are stated, and 1 can be read"]


@pytest.mark.parametrize(("at", "value"), [(0, 0), (166, 0xFFFF), (168, 0xFFFF)])
def test_an_xtf_header_that_is_damaged_is_reported_and_read(at, value, tmp_path):
    """Its first byte, or an impossible number of channels: six are assumed, and the pings are read."""
    whole = bytearray(files.xtf())
    whole[at : at + (2 if at else 1)] = value.to_bytes(2 if at else 1, "little")
    with reopened(tmp_path / "a.xtf", bytes(whole)) as file:
        np.testing.assert_array_equal(file.read("port").amplitude[1], files.xtf_samples(1, 0))
        assert "the file header is damaged" in file.omissions[0].reason and file.omissions[0].offset == 0
