"""Claims about bags of simulated recordings, by the reader of rosbags and by mcap with its own decoder of ROS 2."""

import importlib.util

import numpy as np
import pytest
import xarray as xr

import insonify
from insonify.formats.store_description import StoreError
from insonify.processing import sidescan as sidescan_image
from insonify.surveys.survey import open_survey
from insonify.writers.ros_definitions import DEFINITIONS, message, typestore
from insonify.writers.swath import swaths
from oracles.surveys import MOTION, ORIGIN, multibeam, sidescan

highlevel, mcap = pytest.importorskip("rosbags.highlevel"), pytest.importorskip("mcap.reader")
decoder = pytest.importorskip("mcap_ros2.decoder")
START = 946_684_800_000_000_000
POINT = {"shape": "point", "label": "starboard of the track", "position": (-3.0, 8.0, 9.0), "target_strength_db": 5.0}
HASHES = {
    "RawSonarImage": "668954b8ea9854ec5c25c3ebdbdd9d53452169c7e1e365cad5baf0dc56ac9607",
    "ProjectedSonarImage": "e9d0b934ee8332c9f79e04c361de0793c165b2dee14f2c0d25c3227cd50d46f1",
    "SonarDetections": "2be9466b1dff9d71d6c8e21379e805805a5d315d899023961f183bc32182e60d",
    "SonarRanges": "f440f02f1adc9535848643a389997562f2672f1a74214c17970e1cf2a832343c",
    "SonarInfo": "baed9bc572d08d3b4cf54cc0062106c0aefa5c64d675912dacb26df64227b049",
}
"""Type hashes (REP 2011) of the packages' own message files: marine_acoustic_msgs 2.1.0, SonarInfo of July 2026."""


def by_rosbags(path):
    """Topics with times [ns] and messages, of the reader of rosbags with the definitions in the file."""
    topics = {}
    with highlevel.AnyReader([path]) as bag:
        for connection, time, raw in bag.messages():
            topics.setdefault(connection.topic, []).append((time, bag.deserialize(raw, connection.msgtype)))
    return topics


def by_mcap(path):
    """The same of a reader that shares no code with the writer."""
    topics = {}
    with path.open("rb") as file:
        bag = mcap.make_reader(file, validate_crcs=True, decoder_factories=[decoder.DecoderFactory()])
        for _, channel, record, decoded in bag.iter_decoded_messages():
            topics.setdefault(channel.topic, []).append((record.log_time, decoded))
    return topics


def samples(image, shape):
    """Samples of one image, shape (beam, time)."""
    kind = {2: "<u2", 8: "<f4", 9: "<f8"}[image.dtype]
    return np.frombuffer(bytes(image.data), kind).reshape(shape[::-1]).T


def vectors(found):
    """Components of vectors, shape (vector, 3)."""
    return np.array([[v.x, v.y, v.z] for v in found])


def turned(q):
    """Axes of a rotation as columns, from its quaternion (Diebel 2006, eq. 125)."""
    w, x, y, z = q.w, q.x, q.y, q.z
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def on_the_map(topics, frame, number, places):
    """East, north, up of places in the frame of a sonar at one ping, through the transforms of the bag [m]."""
    for transform in (
        next(t for t in topics["/tf_static"][0][1].transforms if t.child_frame_id == frame),
        topics["/tf"][number][1].transforms[0],
    ):
        places = places @ turned(transform.transform.rotation).T + vectors([transform.transform.translation])
    return places


@pytest.fixture(scope="module", params=["incoherent", "coherent"])
def survey(request, tmp_path_factory):
    """A two-sided survey on Earth, with a target to starboard, and its bag."""
    recording = insonify.simulate(sidescan(targets=[POINT], field=request.param), threads=1).assign_attrs(ORIGIN)
    return recording, insonify.export(recording, tmp_path_factory.mktemp("bags") / "a.mcap")


def test_definitions_are_those_of_their_packages(survey):
    """Type hashes of the packages' own files; each schema in the file makes the same types again."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    ours = typestore()
    for name in (n for n in DEFINITIONS if n.split("/")[2] in HASHES):
        assert ours.hash_rihs01(name) == "RIHS01_" + HASHES[name.split("/")[2]]
    with highlevel.AnyReader([survey[1]]) as bag:
        for connection in bag.connections:
            again = get_typestore(Stores.EMPTY)
            again.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            assert again.hash_rihs01(connection.msgtype) == ours.hash_rihs01(connection.msgtype)
            expected = ours.generate_msgdef(connection.msgtype, ros_version=2)[0]
            assert connection.msgdef.data == expected, "with its constants"


@pytest.mark.parametrize("read", [by_rosbags, by_mcap])
def test_two_readers_find_every_sample_time_and_range(survey, read):
    """Samples bit by bit, display counts within half a step, times to the nanosecond, ranges, one beam a side."""
    recording, path = survey
    topics, c = read(path), 1500.0
    powers = "intensity" in recording
    expected = recording.intensity.values if powers else np.abs(recording.pressure.values)
    level = 10 * np.log10(expected**2) if not powers else 10 * np.log10(expected)
    stamps = START + np.round(recording.ping_time.values * 1e9).astype(np.int64)
    for channel, side in enumerate(("port", "starboard")):
        (_, display), shape = topics[f"/sonar/{side}/display/sonar_info"][0], (1, recording.sizes["time"])
        for number, ((time, raw), (_, shown)) in enumerate(
            zip(topics[f"/sonar/{side}/raw_image"], topics[f"/sonar/{side}/display/projected_image"], strict=True)
        ):
            head = raw.header
            assert time == head.stamp.sec * 1_000_000_000 + head.stamp.nanosec == stamps[number]
            assert head.frame_id == shown.header.frame_id == f"sonar_{side}"
            given = samples(raw.image, shape)
            np.testing.assert_array_equal(given[0], expected[number, channel])
            assert given.dtype == expected.dtype
            counts = samples(shown.image, shape)[0].astype(float)
            inside = (counts > 0) & (counts < 65535)
            assert inside.mean() > 0.9
            off = counts * display.scale + display.offset - level[number, channel]
            assert np.abs(off[inside]).max() <= display.scale * 0.51
        late = 0.1e-3 / 2
        np.testing.assert_allclose(shown.ranges, (recording.time.values - late) * c / 2, rtol=1e-6)
        of_row = (np.arange(shape[1]) + raw.sample0) * raw.ping_info.sound_speed / (2 * raw.sample_rate)
        np.testing.assert_allclose(of_row, recording.time.values * c / 2, rtol=1e-6, atol=1e-6)
        assert (raw.samples_per_beam, raw.image.beam_count, bool(raw.image.is_bigendian)) == (shape[1], 1, False)
        assert raw.ping_info.frequency == 300e3


def test_the_samples_make_the_image_of_the_recording(survey):
    """A sidescan image of the amplitudes in the bag is that of the recording; the target is to starboard."""
    recording, path = survey
    topics, shape = by_mcap(path), (1, recording.sizes["time"])
    rows = [[samples(m.image, shape)[0] for _, m in topics[f"/sonar/{side}/raw_image"]]
            for side in ("port", "starboard")]  # fmt: skip
    sound = np.stack(rows, axis=1).astype(float)
    places = vectors([m.pose.position for _, m in topics["/navigation/pose"]])
    back = xr.Dataset(
        {
            "intensity": (("ping", "channel", "time"), sound if "intensity" in recording else sound**2),
            "position": (("ping", "axis"), places[:, [1, 0, 2]] * [1, 1, -1]),
        },
        {"time": recording.time, "side": recording.side},
    )
    image, expected = (sidescan_image(r, gain="tvg30", geometry="ground", altitude=4.0) for r in (back, recording))
    np.testing.assert_allclose(image.level_db, expected.level_db, atol=2e-6)
    assert 7 < image.across[int(np.nanargmax(image.level_db.max("ping")))] < 10


def test_poses_turn_with_their_signs(survey):
    """Bow, port and mast of the logged attitude, by the textbook's products of rotations; places north and east."""
    recording, path = survey
    topics = by_mcap(path)
    for source, name in (("navigation", "logged_"), ("ground_truth", "")):
        for number, (_, found) in enumerate(topics[f"/{source}/pose"]):
            heading, pitch, roll = recording[f"{name}attitude"].values[number]
            axes = turned(found.pose.orientation)
            level = np.cos(pitch)
            bow = np.sin(heading) * level, np.cos(heading) * level, np.sin(pitch)
            np.testing.assert_allclose(axes[:, 0], bow, atol=1e-12)
            np.testing.assert_allclose(axes[2, 1], np.sin(roll) * level, atol=1e-12)  # port side up: starboard down
            np.testing.assert_allclose(np.cross(axes[:, 0], axes[:, 1]), axes[:, 2], atol=1e-12)
            north, east, depth = recording[f"{name}position"].values[number]
            np.testing.assert_allclose(vectors([found.pose.position])[0], (east, north, -depth), atol=1e-12)
    fixes = [m for _, m in topics["/navigation/fix"]]
    np.testing.assert_allclose([(m.latitude - 54) * 111_300 for m in fixes], recording.logged_position[:, 0], atol=2e-3)
    starboard = on_the_map(topics, "sonar_starboard", 0, np.array([[0.0, 0.0, 1.0]]))[0]
    assert starboard[0] > 0.5 and starboard[1] < -0.3  # boresight of a sonar that goes towards 30 deg


@pytest.mark.parametrize(("heading", "target"), [(0.0, (12.0, 6.0, 5.0)), (np.pi / 2, (4.0, 14.0, 5.0))])
def test_a_target_lies_where_it_is(tmp_path, heading, target):
    """Brightest beam and range, through the transforms: a target ahead to starboard, then to port, of a rolling fan."""
    steer = [float(angle) for angle in np.radians(np.arange(-40, 41, 1.0))]
    array = {"kind": "planar", "width": 0.2, "height": 0.01}
    sonar = {
        "source_level_db": 200, "pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.1e-3},
        "transmit": {"kind": "planar", "width": 0.002, "height": 0.01}, "receive": array | {"steer": steer},
        "mounting": {"bearing": 0.0, "tilt": 0.0},
    }  # fmt: skip
    place = {"shape": "point", "label": "point", "position": target, "target_strength_db": 0.0}
    track = {"start": (0.0, 0.0, 5.0), "heading": heading, "window": (0.0, 0.03), "pings": 2, "motion": MOTION}
    scenario = sidescan(targets=[place], sonar=sonar, track=track, paths={"contributions": ("target",),
                        "max_reflections": 0}, water={"sound_speed": 1500.0, "noise_level_db": None})  # fmt: skip
    recording = insonify.simulate(scenario, threads=1)
    topics = by_mcap(insonify.export(recording, tmp_path / "a.mcap"))
    for number, (_, shown) in enumerate(topics["/sonar/display/projected_image"]):
        image = samples(shown.image, (len(steer), recording.sizes["time"]))
        beam, sample = np.unravel_index(int(image.argmax()), image.shape)
        ray = vectors(shown.beam_directions)[beam] * shown.ranges[sample]
        east, north, _ = on_the_map(topics, "sonar", number, ray[None])[0]
        np.testing.assert_allclose((north, east), target[:2], atol=0.25)  # 1 deg of 14 m
    _, raw = topics["/sonar/raw_image"][0]
    np.testing.assert_allclose(raw.rx_angles, steer, atol=1e-6)
    assert len(raw.tx_angles) == len(raw.tx_delays) == len(steer) and not np.any(raw.tx_angles)
    wave = 1500 / 300e3
    width = 0.886 * wave / 0.2  # Urick (1983), table 3.2
    middle = steer.index(0.0)
    assert raw.ping_info.rx_beamwidths[middle] == pytest.approx(width, rel=2e-3)
    assert raw.ping_info.rx_beamwidths[0] == pytest.approx(width / np.cos(steer[0]), rel=2e-3)
    assert raw.ping_info.tx_beamwidths[0] == pytest.approx(2 * np.arcsin(0.443 * wave / 0.01), rel=2e-3)


def test_detections_and_soundings_of_a_multibeam(tmp_path):
    """Soundings through the transforms are those of the swath, on the bed; flags, times, angles, levels."""
    recording = insonify.simulate(multibeam(), threads=1)
    path = insonify.export(recording, tmp_path / "a.mcap")
    expected = list(swaths(open_survey(recording)))
    for topics in (by_rosbags(path), by_mcap(path)):
        for number, swath in enumerate(expected):
            (_, found), (_, ranges) = topics["/sonar/detections"][number], topics["/sonar/ranges"][number]
            known = np.isfinite(swath.travel_time)
            assert known.sum() > 100
            assert [flag.flag for flag in found.flags] == [flag.flag for flag in ranges.flags] == (~known).tolist()
            np.testing.assert_array_equal(found.two_way_travel_times, swath.travel_time.astype(np.float32))
            np.testing.assert_allclose(found.rx_angles, swath.angle, atol=1e-6)
            rays = vectors(ranges.beam_unit_vec)
            np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1, atol=1e-12)
            place = on_the_map(topics, "sonar", number, rays[known] * np.asarray(ranges.ranges)[known, None])
            heading, north, east = *recording.attitude.values[number, :1], *recording.position.values[number, :2]
            forward, across, down = swath.sounding[known].T
            there = (east + forward * np.sin(heading) + across * np.cos(heading),
                     north + forward * np.cos(heading) - across * np.sin(heading),
                     -recording.position.values[number, 2] - down)  # fmt: skip
            np.testing.assert_allclose(place, np.stack(there, axis=1), atol=2e-5)
            assert np.median(place[:, 2]) == pytest.approx(-10, abs=0.03)
            _, image = topics["/sonar/raw_image"][number]
            beams = samples(image.image, swath.level.shape)
            np.testing.assert_array_equal(beams, (10 ** (swath.level / 20)).astype(np.float32))
            sample = np.rint((swath.travel_time[known] - recording.time.values[0]) * image.sample_rate).astype(int)
            np.testing.assert_array_equal(np.asarray(found.intensities)[known], beams[known, sample])
            widths = np.asarray(found.ping_info.rx_beamwidths)
            assert widths[128] == pytest.approx(1.30 * 0.005 / 0.16, rel=0.03)  # Hamming: Harris (1978), table 1
            assert widths[0] > 1.8 * widths[128] and found.ping_info.sound_speed == 1500


@pytest.mark.parametrize(
    ("pulse", "signal", "length", "bandwidth"),
    [({"kind": "cw", "taper": "hann"}, 1, 0.375e-3, 1 / 0.375e-3), ({"kind": "lfm", "bandwidth": 20e3}, 2, 1e-3, 20e3),
     ({"kind": "lfm", "bandwidth": 20e3, "sweep": "down"}, 3, 1e-3, 20e3)],
)  # fmt: skip
def test_sonar_info_states_what_the_numbers_mean(tmp_path, pulse, signal, length, bandwidth):
    """Every field: quantity, scale, reference, pulse, gain, pattern; one at least every 10 s, latched."""
    base = sidescan(track={"pings": 5, "interval": 5.0})
    scenario = base.with_({"sonar.pulse": {"frequency": 300e3, "duration": 1e-3} | pulse})
    recording = insonify.simulate(scenario, threads=1)
    topics = by_mcap(insonify.export(recording, tmp_path / "a.mcap"))
    for side in ("port", "starboard"):
        sent = topics[f"/sonar/{side}/sonar_info"]
        assert [(time - START) // 10**9 for time, _ in sent] == [0, 10, 20]
        _, linear = sent[0]
        _, shown = topics[f"/sonar/{side}/display/sonar_info"][0]
        for info in (linear, shown):
            assert info.header.frame_id == f"sonar_{side}"
            assert info.sonar_model == "simulated: a small survey"
            assert info.calibration_ref == f"insonify {recording.attrs['version']}"
            assert list(info.tx_signal_types) == [signal]
            np.testing.assert_allclose([*info.pulse_lengths, *info.bandwidths], [length, bandwidth], rtol=1e-6)
            assert (info.intensity_quantity, info.intensity_reference) == (3, 2)
            assert (info.tvg_model, info.angular_normalization, info.angular_response_tl) == (1, 1, 0)
            assert np.isnan([info.tvg_absorption_db_per_km, info.angular_response_absorption_db_per_m]).all()
            assert info.source_level_db == 210 and len(info.angular_response_angle_deg) == 0
            angle, gain = np.asarray(info.beam_pattern_angle_deg), np.asarray(info.beam_pattern_gain_db)
            assert angle[int(gain.argmax())] == 60 and gain.max() == pytest.approx(0, abs=1e-5)  # tilted by 30 deg
            x = 0.01 / 0.005 * np.sin(np.radians(20))
            np.testing.assert_allclose(gain[angle == 80], 40 * np.log10(np.sinc(x)), atol=1e-3)
        assert (linear.intensity_scale, linear.scale, linear.offset) == (1, 1, 0)
        assert shown.intensity_scale == 2
        assert shown.scale * 65535 + shown.offset == pytest.approx(210 - 20, abs=1e-3)


def test_a_message_has_all_of_its_fields():
    """A field that is left out is an error, not a zero."""
    with pytest.raises(KeyError, match="rx_beamwidths"):
        message(typestore(), "marine_acoustic_msgs/msg/PingInfo", {"frequency": 1.0, "sound_speed": 1.0,
                                                                    "tx_beamwidths": []})  # fmt: skip


def test_recordings_that_are_no_bag_are_refused(tmp_path, monkeypatch):
    """Elements that form no swath, lines of a recorder alone, a missing package: advice, and nothing is left."""
    recorder = {"full_scale_db": 160, "stages": [{"kind": "looks", "samples": 4}], "keep": "recorded"}
    lines = insonify.simulate(sidescan(pings=1).with_({"sonar.recorder": recorder}), threads=1)
    elements = multibeam(pings=1).with_({"sonar.mounting": {"bearing": "90 deg", "tilt": "20 deg"}})
    for wrong, advice in ((insonify.simulate(elements, threads=1), "record: beams"), (lines, "recorder alone")):
        with pytest.raises(StoreError, match=advice):
            insonify.export(wrong, tmp_path / "a.mcap")
    monkeypatch.setattr("insonify.writers.export.find_spec", lambda name: importlib.util.find_spec("no_such_package"))
    with pytest.raises(StoreError, match=r"needs rosbags. Install it: pip install .*(\[ros\]|rosbags)"):
        insonify.export(lines, tmp_path / "a.mcap")
    assert not list(tmp_path.iterdir())
