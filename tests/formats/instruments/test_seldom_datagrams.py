"""Claims about datagrams that few files have: values as written, and what is not read is reported with its number."""

import json

import numpy as np
import pytest

from insonify import open_instrument
from insonify.cli import main
from insonify.formats.instruments import kongsberg_all_layouts as layouts
from oracles import other_datagrams as files
from oracles.instrument_files import START


@pytest.fixture
def opened(tmp_path, request):
    """The file of a format, open."""
    path = tmp_path / f"a{request.param}"
    path.write_bytes(files.OTHERS[request.param]())
    with open_instrument(path) as file:
        yield file


def of(suffix):
    """A test on the file of one format."""
    return pytest.mark.parametrize("opened", [suffix], indirect=True)


@of(".kmall")
def test_kmall_sensors_are_those_written(opened):
    """Clock in nanoseconds, error ellipse, two readings of sound speed without pressure, depths of both versions."""
    found = opened.sensors()
    clock, error, speed = (found[name] for name in ("clock", "position error", "sound speed at the transducer"))
    assert float(clock.offset[0]) == 0.5 and float(clock.deviation[0]) == pytest.approx(-8e-3)
    assert float(error.orientation[0]) == pytest.approx(np.pi / 2) and float(error.height_error[0]) == pytest.approx(
        0.008
    )
    assert (
        list(speed.sound_speed) == [1480, 1481] and np.isnan(speed.pressure).all() and float(speed.time[1]) == START + 1
    )
    depth = found["depth of the sonar"]
    assert list(depth.depth) == [12.5, 13.0] and np.isnan(depth.depth_raw[0]) and float(depth.depth_raw[1]) == 12.0
    assert float(found["heave of water columns"].heave[0]) == -0.25 and opened.check() == ()
    assert [part.reason for part in opened.not_read] == ["#SHI: height sensor: not read, 2 of them"]


@of(".all")
def test_earlier_multibeams_read_like_later_ones(opened):
    """Depths of 2 cm steps, a transducer 655.36 m deeper by the multiplier, half decibels, quarters of samples."""
    found, image, (profile,) = opened.soundings(), opened.read("seabed image"), opened.sound_speed_profiles()
    np.testing.assert_allclose(found.down[0], 0.02 * (1000 * files.COUNT - 500))
    np.testing.assert_allclose(found.starboard[0], 0.1 * (files.COUNT - 2), rtol=1e-6)
    assert float(found.transducer_depth[0]) == pytest.approx(655.36 + 1.5) and set(found.backscatter.values.flat) == {
        -20
    }
    assert list(found.detection_method[0]) == [1, 2, 1, 2] and np.isnan(found.quality).all()
    np.testing.assert_allclose(found.travel_time[0], 1200 / (4 * 15000))
    np.testing.assert_allclose(np.degrees(found.beam_angle[0]), [-60, -30, 0, 30])
    assert float(found.frequency[0, 0]) == 3e5 and float(found.bandwidth[0, 0]) == 8000
    assert float(
        found.sector_pulse_length[0, 0] if "sector_pulse_length" in found else found.pulse_length[0, 0]
    ) == pytest.approx(150e-6)
    np.testing.assert_allclose(image.level[0, 2, :2], [-0.5, -1.0])
    np.testing.assert_allclose(image.level[0, 1, 0], 0.0)
    np.testing.assert_allclose(image.level[0, 3, :3], [-2.5, -2.0, -1.5])  # stored in falling range
    assert (
        float(image.oblique_level[0]) == -25
        and list(profile.depth) == [0, 10]
        and list(profile.sound_speed) == [1480, 1490]
    )


@of(".all")
def test_extra_detections_and_sensors_of_all_files(opened):
    """Angles to starboard, levels in tenths of a decibel; readings at their own times; samples, status reported."""
    extra, found = opened.read("extra detections"), opened.sensors()
    np.testing.assert_allclose(np.degrees(extra.beam_angle[0]), [-60, 60])
    assert set(extra.backscatter.values.flat) == {-30.5} and float(extra.transducer_depth[0]) == 1.5
    network, start = found["attitude of the network"], opened.datagrams.time[0]
    np.testing.assert_allclose(np.degrees(network["roll"]), [0, 1])
    np.testing.assert_allclose(network.time - start, [0, 0.01], atol=1e-6)
    np.testing.assert_allclose(found["heading"].time - start, [0, 0.5], atol=1e-6)
    np.testing.assert_allclose(found["sound speed at the transducer"].time - start, [0, 1], atol=1e-6)
    values = {"height": 47.14, "tide": -1.2, "single-beam depth": 12.34}
    for name, value in values.items():
        assert float(next(iter(found[name].data_vars.values()))[0]) == pytest.approx(value), name
    assert float(found["tilt of the transducer"].tilt[0]) == pytest.approx(np.radians(-3))
    assert int(found["clock"].external_date[0]) == 20231114
    assert [part.reason for part in opened.check()] == ["l: 11 samples about extra detections, not read"]
    assert [part.reason for part in opened.not_read] == ["1: processor status: not read, 1 of them"]


def test_records_have_the_sizes_of_the_format():
    """Bytes of the tables of 850-160692/W: D 12 and 16, f 20, 20 and 12, S 16 and 6, l 36 and 68, n 11."""
    sizes = {"DEPTH": 12, "DEPTH_BEAM": 16, "OLD_RANGE": 20, "OLD_RANGE_SECTOR": 20, "OLD_RANGE_BEAM": 12,
             "OLD_IMAGE": 16, "OLD_IMAGE_BEAM": 6, "EXTRA": 36, "EXTRA_BEAM": 68, "NETWORK_ATTITUDE": 11}  # fmt: skip
    assert {name: getattr(layouts, name).itemsize for name in sizes} == sizes


@of(".xtf")
def test_soundings_of_an_xtf_file(opened):
    """Beams of QINSy without the padding behind them; a maker's own packets are reported as not read."""
    found = opened.soundings()
    assert dict(opened.groups) == {"soundings": 2} and dict(found.sizes) == {"ping": 2, "beam": 4}
    np.testing.assert_allclose(found.travel_time[1], [0.01, 0.02, 0.03, 0.04])
    np.testing.assert_allclose(np.degrees(found.beam_angle[0]), [-30, -10, 10, 30])
    assert float(np.degrees(found["roll"][0])) == pytest.approx(2) and opened.check() == ()
    assert [p.reason for p in opened.not_read] == ["R2SONIC_BATHY: bathymetry of a maker's own: not read, 1 of them"]


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_pyxtf_finds_the_same_soundings(tmp_path):
    """The other reader takes the packets for those of QINSy and finds the travel times and angles."""
    pyxtf = pytest.importorskip("pyxtf", reason="the independent reader is not installed")
    (tmp_path / "a.xtf").write_bytes(files.xtf())
    _, packets = pyxtf.xtf_read(str(tmp_path / "a.xtf"))
    for packet in packets[pyxtf.XTFHeaderType.q_multibeam]:
        assert [beam.TwoWayTravelTime for beam in packet.data] == pytest.approx([0.01, 0.02, 0.03, 0.04])
        assert [beam.BeamAngle for beam in packet.data] == [-30, -10, 10, 30]


@of(".raw")
def test_transmitted_pulses_and_lever_arms_of_an_echosounder(opened):
    """Pulses are a group of their own; the arm is re the enabled receiver of positions of the first priority."""
    assert dict(opened.groups) == {"38 kHz": 2, "38 kHz, transmitted": 2}
    difference = opened.read("38 kHz, transmitted").voltage - opened.read("38 kHz").voltage
    np.testing.assert_array_equal(difference, np.full((2, 4, 12), 5 - 5j))
    arm = opened.lever_arm("38 kHz")
    assert arm.position == (6.0, 2.0, 25.0) and arm.source.endswith("less position of GPS b")
    assert [part.reason for part in opened.not_read] == [
        "TAG0: annotation: not read, 1 of them"
    ] and opened.check() == ()


@pytest.mark.parametrize("suffix", files.OTHERS)
def test_info_names_what_is_not_read(suffix, tmp_path, capsys):
    """Each kind with its number and the first byte, in text and as JSON."""
    path = tmp_path / f"a{suffix}"
    path.write_bytes(files.OTHERS[suffix]())
    assert main(["info", str(path)]) == 0
    text = capsys.readouterr().out
    assert main(["info", str(path), "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    with open_instrument(path) as file:
        kinds = {row["kind"]: row["count"] for row in about["datagrams"] if row["kind"] in file.unread}
        assert kinds and {row["name"] for row in about["groups"]} == set(file.groups)
    for kind, count in kinds.items():
        assert f"{kind}: " in text and f"not read, {count} of them" in text
        assert any(part["reason"].startswith(f"{kind}:") for part in about["omissions"])
