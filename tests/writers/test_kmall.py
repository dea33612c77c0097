"""Claims about KMALL files of simulated surveys: they reprocess to the true depth, and another reader opens them."""

import struct

import numpy as np
import pytest

import insonify
from insonify.formats.store_description import StoreError
from insonify.frames import pose_rotation
from insonify.processing import beam_recording
from insonify.surveys.survey import open_survey
from insonify.writers.kmall import _gga, water_column_gain
from insonify.writers.swath import refracted_rays
from oracles.surveys import ORIGIN, multibeam, sidescan

TRANSMITTER, RECEIVER = (0.4, 0.1, 0.2), (0.1, 0.0, 0.15)
MOTION = {"roll": {"rms": "3 deg", "period": "3 s"}, "pitch": {"rms": "1.5 deg", "period": "4 s"},
          "heave": {"rms": "10 cm", "period": "4 s"}}  # fmt: skip
PROFILE = [[0, 1495], [3, 1497], [6, 1480], [14, 1476]]


@pytest.fixture(scope="module")
def sound():
    """Eight pings in layered water, from arrays with lever arms on a ship that rolls, pitches and heaves, on Earth."""
    base = multibeam(pings=8, water={"profile": PROFILE, "noise_level_db": None})
    track = base.track.model_dump() | {"motion": MOTION, "interval": 0.25}
    changed = base.with_({"sonar.transmit.offset": TRANSMITTER, "sonar.receive.offset": RECEIVER, "track": track})
    return insonify.simulate(changed, threads=1).assign_attrs(ORIGIN)


@pytest.fixture(scope="module")
def files(sound, tmp_path_factory):
    """Paths of its KMALL and KMWCD file."""
    folder = tmp_path_factory.mktemp("a")
    return [insonify.export(sound, folder / name) for name in ("a.kmall", "a.kmwcd")]


def ray_ends(time, sine, start, depth, speed):
    """Depths of rays after one-way times [s], marched in time by Snell's law; nothing is shared with the writer."""
    place, steps = start.copy(), 4000
    ratio = sine / np.interp(start, depth, speed)
    for _ in range(steps):
        half = place + np.interp(place, depth, speed) * np.sqrt(1 - (ratio * np.interp(place, depth, speed)) ** 2) * (
            time / steps / 2
        )
        here = np.interp(half, depth, speed)
        place = place + here * np.sqrt(1 - (ratio * here) ** 2) * time / steps
    return place


def test_a_survey_reprocesses_to_the_true_depth(files):
    """From angles, times, arms, attitude and profile of the file: means within 1 cm at nadir, 0.2 % at 60 deg."""
    with insonify.open_instrument(files[0]) as file:
        sounded, attitude, water = file.soundings(), file.attitude(), file.sound_speed_profiles()[0]
        arms = {setting.name: setting.value for setting in file.settings()}
        assert not file.omissions
    sender, receiver = (np.array([arms[f"TRAI_{end}1.{axis}"] for axis in "XYZ"]) for end in ("TX", "RX"))
    np.testing.assert_allclose([sender, receiver], [TRANSMITTER, RECEIVER], atol=1e-3)
    sent = sounded.time.values[:, None] + np.zeros(256)
    at = {name: (np.interp(sent, attitude.time, attitude[name]),
                 np.interp(sent + sounded.travel_time.values, attitude.time, attitude[name]))
          for name in ("pitch", "roll", "heave")}  # fmt: skip
    turn = pose_rotation(np.zeros(sent.shape), at["pitch"][0], at["roll"][1])
    angle = sounded.beam_angle.values
    look = np.stack([0 * angle, np.sin(angle), np.cos(angle)], axis=-1)
    beam = np.einsum("pbij,pbj->pbi", turn, look)
    arm = (
        receiver - look * (look @ (receiver - sender))[..., None] / 2
    )  # half of the way from there is half of the whole
    keel = at["heave"][0] - arms["EMXI.SWLZ"]
    start = keel + np.einsum("pbij,pbj->pbi", turn, arm)[..., 2]
    sine = np.hypot(beam[..., 0], beam[..., 1])
    depth = ray_ends(sounded.travel_time.values / 2, sine, start, water.depth.values, water.sound_speed.values)
    steep = np.abs(np.degrees(np.arctan2(beam[..., 1], beam[..., 2])))
    found = np.isfinite(depth) & (sounded.detection.values == 0)
    nadir, oblique = found & (steep < 15), found & (np.abs(steep - 60) < 3)
    assert nadir.sum() > 300 and oblique.sum() > 100
    assert abs(depth[nadir].mean() - 10) < 0.01, depth[nadir].mean() - 10
    assert abs(np.median(depth[oblique]) - 10) < 0.02, np.median(depth[oblique]) - 10
    ours = sounded.depth.values
    assert np.abs(ours - depth)[nadir].max() < 0.003 and np.abs(ours - depth)[oblique].max() < 0.005


def test_refracted_rays_satisfy_the_closed_forms():
    """Straight in uniform water; an arc of a circle where the speed grows evenly, Jensen et al. (2011), eq. 3.33."""
    time, angle, start = np.array([0.01, 0.02, np.nan]), np.radians([10.0, 60.0, 5.0]), np.full(3, 2.0)
    across, down = refracted_rays(time, angle, start, (np.array([0.0, 40.0]), np.array([1500.0, 1500.0])))
    np.testing.assert_allclose(across[:2], 1500 * time[:2] * np.sin(angle[:2]), rtol=1e-9)
    np.testing.assert_allclose(down[:2], 1500 * time[:2] * np.cos(angle[:2]), rtol=1e-9)
    assert np.isnan(across[2]) and np.isnan(down[2])
    gradient, top = 2.0, 1480.0
    across, down = refracted_rays(time, angle, start, (np.array([0.0, 60.0]), np.array([top, top + 60 * gradient])))
    first = top + gradient * 2.0
    ends = 2 * np.arctan(np.tan(angle / 2) * np.exp(gradient * time))  # d(theta)/dt = g sin(theta)
    radius = first / np.sin(angle) / gradient
    np.testing.assert_allclose(down[:2], (radius * (np.sin(ends) - np.sin(angle)))[:2], rtol=1e-6)
    np.testing.assert_allclose(across[:2], (radius * (np.cos(angle) - np.cos(ends)))[:2], rtol=1e-6)


def test_navigation_and_settings_keep_their_signs(sound, files):
    """Heading, pitch, roll, heave at each ping; position; frequency; soundings to starboard have positive angles."""
    with insonify.open_instrument(files[0]) as file:
        attitude, navigation, sounded = file.attitude(), file.navigation(), file.soundings()
    for column, name in enumerate(("yaw", "pitch", "roll")):
        np.testing.assert_allclose(attitude[name][:8], sound.logged_attitude[:, column], atol=1e-6)
    heave = sound.logged_position[:, 2] - sound.logged_position[:, 2].mean()
    np.testing.assert_allclose(attitude.heave[:8], heave, atol=1e-6)
    np.testing.assert_allclose((np.degrees(navigation.latitude) - 54) * 111_284, sound.logged_position[:, 0], atol=2e-3)
    assert np.all(sounded.frequency == 300e3) and np.ptp(attitude["roll"].values) > 0.05
    assert np.corrcoef(sounded.starboard[0], sounded.beam_angle[0])[0, 1] > 0.9
    north = sounded.delta_latitude.values * 6_364_000
    heading = float(sound.logged_attitude[0, 0])
    expected = sounded.forward * np.cos(heading) - sounded.starboard * np.sin(heading)
    np.testing.assert_allclose(north, expected.values, atol=0.05)
    np.testing.assert_allclose(np.diff(sounded.time.values), np.diff(sound.ping_time.values), atol=2e-6)


def test_the_water_column_gives_back_the_beams(sound, files):
    """Levels of formed beams within half a step of 0.5 dB, where the samples of 8 bit hold them."""
    survey = open_survey(sound)
    with insonify.open_instrument(files[1]) as file:
        column = file.read("water column", slice(2, 3))
        assert not file.omissions and file.groups["water column"] == 8
    angle = np.linspace(-np.radians(64), np.radians(64), 256)
    from insonify.demos.products.forward_looking import compressed

    short = compressed(sound.isel(ping=[2]), survey.scenario)
    local = float(column.sound_speed[0])
    beams = beam_recording(short, np.full(256, np.pi / 2), elevation=np.pi / 2 - angle, sound_speed=local,
                           shading="hamming")  # fmt: skip
    expected = 20 * np.log10(np.abs(beams.pressure.values[0])) + water_column_gain(survey)
    inside = (expected > -63) & (expected < 63)
    assert inside.mean() > 0.1
    np.testing.assert_allclose(column.level.values[0][inside], expected[inside], atol=0.2501)
    assert float(column.gain_exponent[0]) == 30


def water_column_beams(path):
    """First sample, detected sample, the same in high resolution, number of samples of each beam of the first ping.

    By the offsets of the format's description, without the layouts of the writer.
    """
    content = path.read_bytes()
    at = content.index(b"#MWC") - 4 + 24
    at += struct.unpack_from("<H", content, at)[0]
    size, sectors, sector_size = struct.unpack_from("<3H", content, at)
    at += size + sectors * sector_size
    size, count, beam_size = struct.unpack_from("<2HB", content, at)
    rate = struct.unpack_from("<f", content, at + 8)[0]
    at, beams = at + size, []
    for _ in range(count):
        first, detected, _, samples = struct.unpack_from("<4H", content, at + 4)
        beams.append((first, detected, struct.unpack_from("<f", content, at + 12)[0], samples))
        at += beam_size + samples
    return np.array(beams).T, rate


def test_samples_count_from_the_start_of_transmission(sound, files):
    """Detections in the water column, of soundings, and in the seabed image, of a record that starts at 8 ms."""
    (first, detected, fine, _), rate = water_column_beams(files[1])
    with insonify.open_instrument(files[0]) as file:
        sounded, image = file.soundings(), file.read("seabed image")
    time = sounded.travel_time.values[0]
    found = sounded.detection.values[0] == 0
    assert found.sum() > 200 and np.all(first == round(float(sound.time[0]) * rate)) and first[0] == 200
    np.testing.assert_allclose(fine, np.where(found, time * rate, 0), rtol=1e-6)
    for sample in (detected, sounded.water_column_sample.values[0],
                   (image.first_sample + image.centre_sample).values[0]):  # fmt: skip
        assert np.abs(sample - time * rate)[found].max() <= 0.51
        assert not sample[~found].any()


def test_levels_follow_from_the_fields_of_a_sounding(sound, files):
    """BS = EL - SL - M + TVG of the format, EL re 1 V of the received level; the gain is 40 log r with absorption."""
    survey = open_survey(sound)
    with insonify.open_instrument(files[0]) as file:
        sounded = file.soundings()
    with insonify.open_instrument(files[1]) as file:
        column = file.read("water column")
    found = sounded.detection.values == 0
    echo = (
        sounded.backscatter + sounded.source_level_applied + sounded.sensitivity_applied - sounded.gain
    ).values  # re 1 V
    index = sounded.water_column_sample.values - int(column.first_sample[0, 0])
    stored = np.take_along_axis(column.level.values, np.where(found, index, 0)[..., None], axis=2)[..., 0]
    law = (water_column_gain(survey) + 200)[np.where(found, index, 0)]
    clear = found & (np.abs(stored) < 60)
    assert clear.sum() > 1000
    np.testing.assert_allclose(echo[clear], (stored - law)[clear], atol=0.26)
    oblique = clear & (np.abs(np.degrees(sounded.water_column_angle.values)) > 20)
    slant, absorption = sounded.travel_time.values * 743, float(sounded.absorption[0, 0])
    area = (
        np.radians(0.886 * 0.005 / 0.2 * 180 / np.pi) * slant * 743 * 1e-4 / np.abs(np.sin(sounded.water_column_angle))
    )
    gain = 40 * np.log10(slant) + 2 * absorption * slant - 10 * np.log10(area.values)
    np.testing.assert_allclose(sounded.gain.values[oblique], gain[oblique], atol=0.1)


def test_the_ship_is_described_as_it_moves(sound, files):
    """Rates, velocities and course of the logged track; depth of the transmitter on its lever arm; widths in metres."""
    with insonify.open_instrument(files[0]) as file:
        attitude, navigation, sounded = file.attitude(), file.navigation(), file.soundings()
    position, angles, time = sound.logged_position.values, sound.logged_attitude.values, sound.ping_time.values
    inner = slice(1, 7)
    for column, name in enumerate(("yaw_rate", "pitch_rate", "roll_rate")):
        expected = (angles[2:, column] - angles[:-2, column]) / (time[2:] - time[:-2])
        np.testing.assert_allclose(attitude[name][inner], expected, atol=1e-6)
    for column, name in enumerate(("velocity_north", "velocity_east", "velocity_down")):
        expected = (position[2:, column] - position[:-2, column]) / (time[2:] - time[:-2])
        np.testing.assert_allclose(attitude[name][inner], expected, atol=1e-5)
    assert attitude.velocity_north[1] > 1 and np.ptp(attitude.velocity_down.values) > 0.05
    np.testing.assert_allclose(np.diff(attitude.latitude)[-1], np.diff(attitude.latitude)[-2], rtol=1e-3)
    np.testing.assert_allclose(navigation.course, np.radians(40), atol=1e-4)
    forward, starboard, down = TRANSMITTER
    _, pitch, roll = angles.T
    sunk = (down * np.cos(roll) + starboard * np.sin(roll)) * np.cos(pitch) - forward * np.sin(pitch)
    np.testing.assert_allclose(sounded.transducer_depth, position[:, 2] + sunk, atol=1e-5)
    content = files[0].read_bytes()
    information = content.index(b"#SKM") - 4 + 20
    assert struct.unpack_from("<H", content, information + 10) == (0b1001111,)  # no accelerations, no errors
    assert struct.unpack_from("<I", content, information + 12 + 16) == (0b110000,)
    ping = content.index(b"#MRZ") - 4 + 24 + 12
    assert struct.unpack_from("<2h", content, ping + 60) == (round(np.nanmin(sounded.starboard[0])),
                                                            round(np.nanmax(sounded.starboard[0])))  # fmt: skip
    assert struct.unpack_from("<f", content, ping + 40)[0] * 1e-3 == pytest.approx(float(sounded.absorption[0, 0]))


def test_the_effective_length_of_a_sweep_is_that_of_its_compressed_pulse(tmp_path):
    """The inverse bandwidth, by which the area of the strengths is computed, and not the length of the sweep."""
    pulse = {"kind": "lfm", "frequency": 300e3, "bandwidth": 10e3, "duration": 1e-3}
    recording = insonify.simulate(multibeam(pings=1).with_("sonar.pulse", pulse), threads=1)
    with insonify.open_instrument(insonify.export(recording, tmp_path / "a.kmall")) as file:
        sounded = file.soundings()
    assert float(sounded.sector_pulse_length[0, 0]) == pytest.approx(1e-3)
    assert float(sounded.effective_pulse_length[0, 0]) == pytest.approx(1e-4)


def test_minutes_of_a_fix_stay_below_sixty():
    """A latitude that rounds to the next degree; the signs as letters."""
    assert b"5400.000000,N,00029.999999,W" in _gga(946_684_800.0, 53.999_999_999_99, -0.499_999_983)


def test_another_reader_opens_both_files(sound, files):
    """Travel times, positions of soundings, samples and the pose of the transducer by themachinethatgoesping."""
    kmall = pytest.importorskip("themachinethatgoesping.echosounders", reason="not installed").kmall
    pings = kmall.KMALLFileHandler([str(path) for path in files], show_progress=False).get_pings()
    assert len(pings) == 8
    with insonify.open_instrument(files[0]) as file, insonify.open_instrument(files[1]) as water:
        sounded, column = file.soundings(), water.read("water column")
    for number, ping in enumerate(pings):
        np.testing.assert_allclose(ping.bottom.get_two_way_travel_times(), sounded.travel_time[number], rtol=1e-6)
        place = ping.bottom.get_xyz()
        np.testing.assert_allclose(place.x, sounded.forward[number], atol=1e-4)
        np.testing.assert_allclose(place.y, sounded.starboard[number], atol=1e-4)
        np.testing.assert_allclose(ping.watercolumn.get_amplitudes(), column.level[number], atol=1e-4)
    here = pings[3].get_geolocation()
    np.testing.assert_allclose([here.yaw, here.pitch, here.roll], np.degrees(sound.logged_attitude[3]), atol=0.01)
    np.testing.assert_allclose(here.latitude, 54 + float(sound.logged_position[3, 0]) / 111_284, atol=1e-5)


def test_more_samples_than_the_format_counts_are_refused(sound, tmp_path, monkeypatch):
    """Numbers of 16 bit from the start of transmission on: advice, and no file."""
    monkeypatch.setattr("insonify.writers.kmall.MOST_SAMPLES", 500)
    for name in ("a.kmall", "a.kmwcd"):
        with pytest.raises(StoreError, match=r"up to 500 .* Shorten track.window"):
            insonify.export(sound, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_only_swaths_of_a_multibeam_fit(tmp_path):
    """A sidescan is refused with advice."""
    with pytest.raises(StoreError, match="swaths of a multibeam"):
        insonify.export(insonify.simulate(sidescan(pings=1), threads=1), tmp_path / "a.kmall")
    assert not list(tmp_path.iterdir())
