"""Claims about Oculus and ARIS files: images, bearings, ranges and settings are those written and those published."""

import itertools
import struct

import numpy as np
import pytest

from insonify.formats.instruments import open_instrument
from insonify.formats.instruments.sound_metrics_aris import bearings
from insonify.formats.store_description import StoreError
from oracles import imaging_sonar_files as files
from oracles.instrument_files import DATA

OCULUS, ARIS = DATA / "real" / "oculus-three-pings-8bit.raw", DATA / "real" / "aris-1200-sample.aris"


def real(path):
    """Skip without a recording."""
    return pytest.mark.skipif(not path.is_file(), reason=f"the recording {path.name} is not in the folder of data")


def opened(tmp_path, content, name="a.raw"):
    """A file with some content, open."""
    (tmp_path / name).write_bytes(content)
    return open_instrument(tmp_path / name)


def test_oculus_images_of_each_version_and_width_are_those_written(tmp_path):
    """Counts of one, two and four bytes, gains of ranges where sent, bearings in hundredths of a degree, attitude."""
    with opened(tmp_path, files.oculus()) as file:
        read, attitude = file.read("image"), file.attitude()
        assert file.groups == {"image": 3} and file.instrument.serial == "77" and not file.check()
    for ping, width in enumerate((1, 2, 4)):
        np.testing.assert_array_equal(read.amplitude[ping], files.oculus_counts(ping, width))
        np.testing.assert_allclose(np.degrees(read.bearing[ping]), 10 * np.arange(files.BEAMS) - 25)
    np.testing.assert_array_equal(read.sample_gain[1], [1, 2, 3, 4])
    assert np.isnan(read.sample_gain[0]).all() and list(read.range_step) == [0.01] * 3
    assert list(read.clock) == [75, 7.5, 75] and list(read.gain_percent) == [50] * 3
    assert list(read.temperature) == [12] * 3 and np.isnan(read.pressure).all()
    np.testing.assert_allclose(np.degrees([attitude.yaw[0], attitude.pitch[0], attitude["roll"][0]]), [90, -5, 10])


def test_an_oculus_log_gives_times_and_unpacks_images(tmp_path):
    """Items of other kinds are counted; a compressed image is that written; an unknown way of packing is reported."""
    whole = files.oculus_log()
    with opened(tmp_path, whole, "a.oculus") as file:
        read = file.read("image")
        assert not file.omissions and "item" in file.datagrams.kind
    np.testing.assert_array_equal(read.amplitude, [files.oculus_counts(0), files.oculus_counts(1)])
    np.testing.assert_allclose(read.time, [1.7e9, 1.7e9 + 2])
    packed = whole.rindex(b"\xdd\xcc\xbb\xaa")
    for place, value, reason in ((24, 9, "compression 9 is not read"), (28, 40, "records of")):
        content = bytearray(whole)
        struct.pack_into("<H" if place == 24 else "<I", content, packed + place, value)
        with opened(tmp_path, bytes(content), "b.oculus") as file:
            assert file.read("image").sizes["ping"] == 1
            assert [part.offset for part in file.omissions] == [packed] and reason in file.omissions[0].reason
    content = bytearray(whole)
    struct.pack_into("<I", content, packed + 28, 2**31)
    with opened(tmp_path, bytes(content), "c.oculus") as file, pytest.raises(StoreError, match="are too many"):
        file.read("image")


@pytest.mark.parametrize(("mode", "beams"), [(1, 48), (3, 96), (6, 64), (9, 128)])
@pytest.mark.parametrize("ordered", [True, False])
def test_aris_frames_are_those_written(tmp_path, mode, beams, ordered):
    """Levels in 80/255 dB in the order of the beams, also where the file has them in that of reception."""
    with opened(tmp_path, files.aris(mode=mode, beams=beams, ordered=ordered), "a.aris") as file:
        read, attitude, fixes = file.read("image", slice(1, None)), file.attitude(), file.navigation()
        assert not file.check() and file.instrument.model == "ARIS 1200" and file.instrument.serial == "1098"
    expected = [files.aris_counts(frame, beams).T * np.float32(80 / 255) for frame in (1, 2)]
    np.testing.assert_array_equal(read.level_db, expected)
    np.testing.assert_allclose(read.first_range, 4600e-6 * 1436 / 2)
    np.testing.assert_allclose(read.range_step, 14e-6 * 1436 / 2)
    np.testing.assert_allclose(np.degrees(read.tilt), -2.25)
    np.testing.assert_allclose(read.time - 1.6e9, [0.500001, 0.500002], atol=1e-6)
    np.testing.assert_allclose(np.degrees([attitude.yaw[0], attitude.pitch[0], fixes.latitude[0]]), [90, -2, 45])
    assert np.all(np.diff(read.bearing[0]) < 0) and read.bearing[0, 0] == -read.bearing[0, -1] > 0


@pytest.mark.parametrize(
    ("beams", "telephoto", "outer", "inner"),
    [(48, False, 13.5735, 0.3461), (128, False, 15.0068, 0.1178), (48, True, 7.339, 0.1602)],
)
def test_aris_beams_point_where_the_maker_measured(beams, telephoto, outer, inner):
    """Outermost and innermost angle of the maker's tables for three lenses [deg]; the rightmost beam is the first."""
    angles = np.degrees(bearings(beams, telephoto))
    np.testing.assert_allclose(angles[[0, beams // 2 - 1]], [outer, inner], atol=0.015)


def test_a_damaged_frame_or_message_is_left_out_and_the_next_is_found(tmp_path):
    """Marks, sizes and modes that are none, with offset and reason; a full ping is reported not to be read."""
    aris, size = bytearray(files.aris()), 1024 + 5 * 48
    aris[1024 + size + 12] ^= 1
    with opened(tmp_path, bytes(aris), "a.aris") as file:
        assert list(file.read("image").frame_index) == [0, 2]
        assert [(part.offset, part.reason[:5]) for part in file.omissions] == [(1024 + size, "frame")]
    oculus = files.oculus()
    bad = bytearray(oculus)
    struct.pack_into("<H", bad, 16 + 37 + 32 + 8 + 4 + 9, 60000)  # number of ranges of the first image
    for content, pings, reason in (
        (bytes(bad), 2, "60000 records"),
        (oculus[:-3], 2, "bytes are stated, and the file has"),
        (b"\0" + oculus, 3, "no message with the mark"),
        (files.oculus_message(0x22, b"") + oculus, 3, "ping result: image in the full form: not read, 1 of them"),
    ):
        with opened(tmp_path, content) as file:
            assert file.read("image").sizes["ping"] == pings
            left_out = [part for part in (*file.omissions, *file.not_read) if "log" not in part.reason]
            assert len(left_out) == 1 and reason in left_out[0].reason


@real(OCULUS)
def test_the_real_oculus_images_are_those_of_its_layout():
    """703 ranges of 2.84 mm, 256 beams over 60 deg, sound speed and gain as published; counts by documented offsets."""
    content = OCULUS.read_bytes()
    with open_instrument(OCULUS) as file:
        read = file.read("image")
        assert file.groups == {"image": 3} and not file.check()
    assert dict(read.sizes) == {"ping": 3, "beam": 256, "sample": 703}
    np.testing.assert_allclose(read.range_step, 2.84e-3, atol=5e-6)
    np.testing.assert_allclose(read.sound_speed, 1490.66, atol=5e-3)
    np.testing.assert_allclose(read.frequency, 2.099e6, rtol=1e-4)
    assert list(read.gain_percent) == [50] * 3 and list(read.gamma) == [127] * 3
    np.testing.assert_allclose(np.degrees(read.bearing[:, [0, -1]]), [[-30, 30]] * 3)
    for ping in range(3):
        image = np.frombuffer(content, np.uint8, 703 * 256, ping * 182016 + 2048).reshape(703, 256)
        np.testing.assert_array_equal(read.amplitude[ping].values.T, image)


@real(ARIS)
def test_the_real_aris_frames_are_those_published():
    """48 beams of 2000 samples at 14 us, gain, temperature, tilt; correlation of successive frames 0.835."""
    content = ARIS.read_bytes()
    with open_instrument(ARIS) as file:
        read = file.read("image")
        assert file.groups == {"image": 6} and file.instrument.model == "ARIS 1200" and not file.check()
    assert dict(read.sizes) == {"ping": 6, "beam": 48, "sample": 2000}
    for name, value, digit in (
        ("sample_interval", 14e-6, 1e-9), ("gain_db", 24, 0), ("temperature", 9, 0), ("salinity", 0, 0),
        ("sound_speed", 1435.9, 0.05), ("tilt", np.radians(-2.2), np.radians(0.06)),
    ):  # fmt: skip
        np.testing.assert_allclose(read[name], value, rtol=0, atol=digit)
    levels = read.level_db.values.reshape(6, -1)
    alike = [np.corrcoef(pair)[0, 1] for pair in itertools.pairwise(levels)]
    assert np.mean(alike) == pytest.approx(0.835, abs=1e-3)
    # the maker's formula; the window of 3.33 m to 23.6 m in the header has another sound speed (1450 m/s)
    end = read.first_range[0] + 2000 * read.range_step[0]
    scale = 1450 / float(read.sound_speed[0])
    assert scale * float(read.first_range[0]) == pytest.approx(3.33, abs=5e-3)
    assert scale * float(end) == pytest.approx(23.6, abs=0.05)
    for frame in range(6):
        start = 1024 + frame * 97024 + 1024
        counts = np.frombuffer(content, np.uint8, 96000, start).reshape(2000, 48)
        np.testing.assert_array_equal(read.level_db[frame].values.T, counts * np.float32(80 / 255))
