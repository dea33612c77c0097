"""Claims about XTF files of simulated recordings, by pyxtf and by the project's own reader."""

import numpy as np
import pytest
import xarray as xr

import insonify
from insonify.formats.store_description import StoreError
from insonify.processing import sidescan as sidescan_image
from oracles.surveys import ORIGIN, sidescan

POINT = {"shape": "point", "label": "starboard of the track", "position": (-3.0, 8.0, 9.0), "target_strength_db": 5.0}


@pytest.fixture(scope="module", params=["incoherent", "coherent"])
def sound(request):
    """A two-sided survey on Earth, with a target to starboard."""
    recording = insonify.simulate(sidescan(targets=[POINT], field=request.param), threads=1)
    return recording.assign_attrs(ORIGIN)


def amplitude(recording):
    """Rms amplitudes [uPa] in single precision, shape (ping, channel, time)."""
    values = np.abs(recording.pressure) if "pressure" in recording else np.sqrt(recording.intensity)
    return values.values.astype(np.float32)


def packets(path):
    """Packets by their kind, of a reader that shares no code with the writer."""
    return pytest.importorskip("pyxtf").xtf_read(str(path))


@pytest.mark.parametrize("name", ["xtf", "xtf-float32"])
def test_another_reader_finds_every_sample_and_setting(sound, tmp_path, name):
    """Float samples bit by bit, 16-bit ones within half a step; port from far to near; knots; half the sound speed."""
    head, found = packets(insonify.export(sound, tmp_path / "a.xtf", name))
    kinds = {kind.name: part for kind, part in found.items()}
    step = float(head.NoteString.decode().split()[3])
    expected, sent = amplitude(sound), kinds["sonar"]
    given = np.array([[ping.data[0][::-1], ping.data[1]] for ping in sent], np.float64)
    if name == "xtf":
        assert np.abs(given * step - expected).max() <= step * 0.501 and given.max() == 65535
    else:
        np.testing.assert_array_equal(given.astype(np.float32), expected)
    assert [info.TypeOfChannel for info in head.ChanInfo[:2]] == [1, 2]
    ping, header = sent[3], sent[3].ping_chan_headers[1]
    assert (ping.SoundVelocity, header.Frequency, header.NumSamples) == (750.0, 300, sound.sizes["time"])
    np.testing.assert_allclose(ping.SensorSpeed * 1852 / 3600, 2.0, rtol=1e-6)
    np.testing.assert_allclose(header.TimeDuration / header.NumSamples, np.diff(sound.time.values)[0], rtol=1e-6)
    np.testing.assert_allclose([ping.SensorPrimaryAltitude, ping.SensorDepth], [4.0, 6.0], rtol=1e-6)
    attitude = np.radians([[part.Heading, part.Pitch, part.Roll] for part in kinds["attitude"]])
    np.testing.assert_allclose(attitude, sound.logged_attitude, atol=1e-6)
    assert np.ptp(attitude[:, 2]) > 0.01  # the signs were put to the test
    clock = np.rint(1e3 * sound.ping_time.values)
    assert clock[-1] == 500
    for parts, tag in ((sent, "AttitudeTimeTag"), (sent, "NavFixMilliseconds"), (kinds["attitude"], "TimeTag"),
                       (kinds["navigation"], "TimeTag")):  # fmt: skip
        np.testing.assert_array_equal([getattr(part, tag) for part in parts], clock)  # joins attitudes to pings
    assert [ping.FixTimeHsecond for ping in sent] == [ping.HSeconds for ping in sent] == (clock // 10).tolist()


def test_this_reader_returns_navigation_and_image(sound, tmp_path):
    """Position and attitude with their signs; the image is that of the recording, target to starboard."""
    with insonify.open_instrument(insonify.export(sound, tmp_path / "a.xtf", "xtf-float32")) as file:
        port, starboard = (file.read(group) for group in ("port", "starboard"))
        navigation, attitude = file.navigation(), file.attitude()
        assert not file.omissions and file.instrument.model == "simulated"
    back = xr.Dataset(
        {
            "intensity": (("ping", "channel", "time"), np.stack([port.amplitude, starboard.amplitude], 1) ** 2.0),
            "position": sound.logged_position,
        },
        {"time": sound.time, "side": sound.side},
    )
    image, expected = (sidescan_image(one, gain="tvg30", geometry="ground", altitude=4.0) for one in (back, sound))
    np.testing.assert_allclose(image.level_db, expected.level_db, atol=2e-6)
    brightest = image.across[int(np.nanargmax(image.level_db.max("ping")))]
    assert 7 < brightest < 10
    metres = (np.degrees(navigation.latitude) - 54.0) * 111_300
    np.testing.assert_allclose(metres, sound.logged_position[:, 0], atol=2e-3)
    assert np.all(np.diff(navigation.longitude) > 0)
    for column, name in enumerate(("yaw", "pitch", "roll")):
        np.testing.assert_allclose(attitude[name], sound.logged_attitude[:, column], atol=1e-6)


def test_a_scene_nowhere_on_earth_has_northings_and_eastings(sound, tmp_path):
    """Metres with the false easting of UTM, the origin included."""
    nowhere = sound.drop_attrs().assign_attrs({name: sound.attrs[name] for name in ("scenario", "title", "version")})
    with insonify.open_instrument(insonify.export(nowhere, tmp_path / "a.xtf")) as file:
        place = file.navigation()
    found = np.stack([place.northing, place.easting - 500_000], axis=1)
    np.testing.assert_allclose(found, sound.logged_position[:, :2], atol=1e-9)


def test_a_recording_that_does_not_fit_is_refused_and_nothing_is_left(sound, tmp_path):
    """Elements, no scenario, unknown formats, folders: advice, and no file."""
    for wrong, file, name, advice in (
        (sound.drop_attrs(), "a.xtf", None, "has no scenario"),
        (sound, "a.xyzzy", None, "names no format. End it in one of"),
        (sound, "a.xtf", "xft", "Choose one of xtf"),
        (sound, "none/a.xtf", None, "Make it first: mkdir -p"),
        (sound.isel(ping=[]), "a.xtf", None, "holds no ping yet"),
    ):  # fmt: skip
        with pytest.raises(StoreError, match=advice):
            insonify.export(wrong, tmp_path / file, name)
    elements = sidescan(
        pings=1, field="coherent",
        sonar={"source_level_db": 210, "pulse": {"kind": "cw", "frequency": 300e3, "duration": 1e-4},
               "transmit": {"kind": "point"}, "receive": {"kind": "line", "length": 0.05, "elements": 2},
               "receiver": {"record": "elements"}},
    )  # fmt: skip
    with pytest.raises(StoreError, match="record: beams"):
        insonify.export(insonify.simulate(elements, threads=1), tmp_path / "a.xtf")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("keep", ["both", "recorded"])
def test_lines_of_a_recorder_are_written_as_they_are(tmp_path, keep):
    """Counts of 12 bit from mean pairs of pings, at the first ping of each, bit by bit; unrounded lines as floats."""
    stages = [{"kind": "gain", "tvg_db_per_decade": 30, "fixed_db": -30}, {"kind": "looks", "samples": 4, "pings": 2}]
    counts = [*stages, {"kind": "quantisation", "bits": 12, "signed": False}]
    base = sidescan(pings=6)
    for chain, kind in ((counts, np.uint16), (stages, np.float32)):
        recorder = {"full_scale_db": 160, "stages": chain, "keep": keep}
        lines = insonify.simulate(base.with_({"sonar.recorder": recorder}), threads=1)
        _, found = packets(insonify.export(lines, tmp_path / "a.xtf", "xtf-recorded"))
        sent = next(part for number, part in found.items() if number.name == "sonar")
        given = np.array([[ping.data[0][::-1], ping.data[1]] for ping in sent])
        assert given.dtype == kind and [ping.PingNumber for ping in sent] == [0, 2, 4]
        np.testing.assert_array_equal(given, lines.recorded.values.astype(kind))
    assert insonify.export(lines, tmp_path / "a.png").stat().st_size > 1000  # a picture of lines alone is one of pings
    with pytest.raises(StoreError, match="has no recorded lines"):
        insonify.export(insonify.simulate(base.with_("track.pings", 1), threads=1), tmp_path / "b.xtf", "xtf-recorded")
