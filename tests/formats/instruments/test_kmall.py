"""Claims about KMALL: every field has its place, unit and sign; what is damaged is left out by name."""

import numpy as np
import pytest

from insonify.formats.instruments import open_instrument
from oracles import instrument_files as files

REAL = files.DATA / "real"
WHOLE = files.kmall()


@pytest.fixture
def opened(tmp_path):
    """The small file, open."""
    (tmp_path / "a.kmall").write_bytes(WHOLE)
    with open_instrument(tmp_path / "a.kmall") as file:
        yield file


def test_levels_and_settings_are_those_written(opened):
    """Water column in half decibels, seabed image in tenths, angles to starboard, depth below the water line."""
    water = opened.read("water column", slice(1, None))
    assert dict(water.sizes) == {"ping": 2, "beam": 5, "sample": 4, "tx_sector": 1} and list(water.ping) == [1, 2]
    expected = np.float32(0.5) * np.stack([files.kmall_level(1), files.kmall_level(2)])
    expected[:, -1, -1] = np.nan
    np.testing.assert_array_equal(water.level, expected)
    np.testing.assert_allclose(np.degrees(water.beam_angle[0]), [-60, -30, 0, 30, 60])
    np.testing.assert_allclose(water.phase[0, 0], np.pi / 2, rtol=1e-6)
    image = opened.read("seabed image")
    beams, samples = np.nonzero(np.arange(5) < np.arange(6)[:, None])
    np.testing.assert_allclose(image.level.values[0, beams, samples], -0.1 * np.arange(15), rtol=1e-6)
    assert np.isfinite(image.level).sum() == 3 * 15 and list(image.frequency[0]) == [300e3, 320e3]
    soundings = opened.soundings()
    np.testing.assert_allclose(soundings.depth, 9.0)
    np.testing.assert_allclose(soundings.absorption, 0.08)
    np.testing.assert_allclose(np.degrees(soundings.beam_angle[0]), np.arange(6) * 20 - 60, atol=1e-12)


def test_series_and_settings_are_those_written(opened):
    """Attitude with nanoseconds, a position that is not available, a profile, the texts as settings."""
    attitude, (profile,) = opened.attitude(), opened.sound_speed_profiles()
    np.testing.assert_allclose(attitude.time - files.START, [0, 0.25, 0.5, 0.75])
    np.testing.assert_allclose(np.degrees(attitude["roll"]), np.arange(4))
    assert np.isnan(opened.navigation().longitude).all() and np.isnan(profile.salinity).all()
    np.testing.assert_allclose(opened.navigation().latitude, np.pi / 4)
    assert list(profile.sound_speed) == [1480, 1490] and list(profile.depth) == [0, 10]
    settings = {setting.name: setting for setting in opened.settings()}
    assert settings["TRAI_TX1.P"].value == pytest.approx(np.pi / 2) and settings["TRAI_TX1.X"].unit == "m"
    assert settings["Depth settings.Max. depth"].value == 40 and opened.instrument.serial == "77"


def test_an_unknown_kind_and_a_clock_that_jumps_are_reported(opened, tmp_path):
    """Both files are read as far as they go."""
    assert [part.reason for part in opened.check()] == ["#XYZ: unknown kind of datagram"]
    late = files.kmall_datagram("#MWC", -3600, files.kmall_water(3))
    (tmp_path / "b.kmall").write_bytes(WHOLE + late)
    with open_instrument(tmp_path / "b.kmall") as file:
        assert [jump.offset for jump in file.clock_jumps] == [len(WHOLE)] and file.groups["water column"] == 4


def test_a_datagram_in_parts_is_joined(tmp_path):
    """The second part follows the first; without it the ping is left out."""
    body, p = files.kmall_water(0), files.kmall_parts.PARTITION
    cut = 40
    first, second = (files.kmall_datagram("#MWC", 0, files.record(p, count=2, number=n) + part)
                     for n, part in ((1, body[4:cut]), (2, body[cut:])))  # fmt: skip
    path = tmp_path / "a.kmwcd"
    for content, count in ((first + second, 1), (first + WHOLE + second, 3)):
        path.write_bytes(content)
        with open_instrument(path) as file:
            water = file.read("water column")
            assert water.sizes["ping"] == count
            for reason in ("2 parts are stated", "part 2 of 2 without the part before it"):
                assert any(reason in part.reason for part in file.omissions) == (count > 1)
            np.testing.assert_array_equal(water.level[0, :4], 0.5 * files.kmall_level(0)[:4])


def test_a_version_with_shorter_records_is_read(tmp_path):
    """Fields that an earlier version lacks are NaN, and the rest stands where it did."""
    p, short = files.kmall_parts, files.kmall_parts.SECTOR.itemsize - 12
    body = files.kmall_swath(0)
    at = p.PARTITION.itemsize + p.BODY.itemsize + p.PING.itemsize + 8
    about = np.frombuffer(body, p.PING, 1, at - 8 - p.PING.itemsize).copy()
    about["sector_size"] = short
    sectors = b"".join(body[at + k * p.SECTOR.itemsize :][:short] for k in range(2))
    body = body[: at - 8 - p.PING.itemsize] + about.tobytes() + bytes(8) + sectors + body[at + 2 * p.SECTOR.itemsize :]
    (tmp_path / "a.kmall").write_bytes(files.kmall_datagram("#MRZ", 0, body))
    with open_instrument(tmp_path / "a.kmall") as file:
        found = file.soundings()
    assert np.isnan(found.voltage_level).all() and list(found.frequency[0]) == [300e3, 320e3]
    np.testing.assert_allclose(found.depth, 9.0)


def test_attitudes_that_are_marked_as_invalid_are_none(tmp_path):
    """Bits 1, 2 and 3 of the status of a sample are invalid roll and pitch, heading, and heave; bit 17 is not."""
    size = files.kmall_parts.ATTITUDE.itemsize
    samples = files.record(files.kmall_parts.ATTITUDE, 4, seconds=files.START, roll=1.0, pitch=2.0, yaw=3.0, heave=4.0)
    samples = bytearray(samples)
    for row, status in enumerate((1 << 1, 1 << 2, 1 << 3, 1 << 17)):
        samples[row * size + 16 : row * size + 20] = status.to_bytes(4, "little")
    info = files.record(files.kmall_parts.ATTITUDE_INFO, count=4, sample_size=size)
    (tmp_path / "a.kmall").write_bytes(WHOLE + files.kmall_datagram("#SKM", 0, info + bytes(samples)))
    with open_instrument(tmp_path / "a.kmall") as file:
        attitude = file.attitude().isel(time=slice(4, None))
    invalid = {name: np.flatnonzero(np.isnan(attitude[name])).tolist() for name in ("roll", "pitch", "yaw", "heave")}
    assert invalid == {"roll": [0], "pitch": [0], "yaw": [1], "heave": [2]}
