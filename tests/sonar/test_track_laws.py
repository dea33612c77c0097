"""Laws of motion, of logs and of surveys: what scales, what turns with the world, what does not mix."""

import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.data_file import file_digest
from insonify.ocean.water import Water
from insonify.sonar import (
    LineTrack,
    Motion,
    NavigationErrors,
    Poses,
    WaypointTrack,
    logged_poses,
    received_pulse,
    true_poses,
)
from insonify.sonar.navigation_file import local_plane_position, read_navigation
from insonify.sonar.ping_geometry import array_depths, ping_geometry
from insonify.sonar.track.motion import DEGREES_OF_FREEDOM, RandomTranslation, displacement
from insonify.sonar.track.navigation_errors import COLUMNS
from insonify.sonar.track_extent import distance_to_segments, simplified_polyline, track_extent
from oracles.scenes import nominal

TIME = np.arange(0, 60, 0.25)
TABLE = ((0.1, 0.0), (0.2, 3.0), (0.4, 1.0))
SONAR = nominal().sonar
FLAT = np.zeros(len(TIME))
TRUE = Poses(TIME, np.column_stack([TIME, 2 * TIME, FLAT + 8]), FLAT + 0.4, FLAT + 0.01, FLAT - 0.02)
EVERY = {
    "north": {"offset": 3.0, "noise": 0.5}, "east": {"drift": 0.02}, "depth": {"noise": 0.1, "correlation_time": 20.0},
    "heading": {"offset": 0.01, "noise": 0.02}, "pitch": {"noise": 0.03, "correlation_time": 3.0},
    "roll": {"drift": 1e-4},
}  # fmt: skip


def columns(log):
    """North, east, depth, heading, pitch and roll of poses, shape (pings, 6)."""
    return np.column_stack([log.position, log.attitude])


def heave(rms=1.0, time=TIME, seed=5, **spectrum):
    """Heave of a platform."""
    return displacement(Motion(heave={"rms": rms, **spectrum}), np.asarray(time, float), seed)["heave"]


@given(st.floats(0.01, 50), st.floats(0.1, 20))
@settings(max_examples=20, deadline=None)
def test_motion_scales_with_its_rms_and_its_period(rms, factor):
    """Twice the rms is twice the motion; twice the period is the same motion at half the pace."""
    one = heave(period=8.0)
    np.testing.assert_allclose(heave(rms, period=8.0), rms * one, atol=1e-12 * rms)
    np.testing.assert_allclose(heave(period=8.0 * factor, time=TIME * factor), one, atol=1e-8)


@given(st.floats(1e-3, 1e3))
@settings(max_examples=10, deadline=None)
def test_only_the_shape_of_a_spectrum_counts(factor):
    """All densities times a number: the same motion, for its rms states how much."""
    scaled = tuple((frequency, density * factor) for frequency, density in TABLE)
    np.testing.assert_allclose(heave(spectrum=scaled), heave(spectrum=TABLE), atol=1e-9)


def test_shares_of_simple_spectra_have_closed_forms():
    """Flat: energy below grows evenly; rising from nothing: as the square; and all of it lies within the table."""
    share = np.linspace(0, 1, 21)
    flat = RandomTranslation(rms=1, spectrum=((0.1, 2.0), (0.5, 2.0)))
    np.testing.assert_allclose(flat.frequencies(share), 0.1 + 0.4 * share, atol=1e-9)
    rising = RandomTranslation(rms=1, spectrum=((0.1, 0.0), (0.3, 7.0)))
    np.testing.assert_allclose(rising.frequencies(share), 0.1 + 0.2 * np.sqrt(share), atol=1e-4)
    assert np.all(np.diff(RandomTranslation(rms=1, period=6.0).frequencies(share)) > 0)


@pytest.mark.parametrize("frequency", [0.1, 0.7])
def test_a_narrow_spectrum_crosses_zero_twice_a_cycle(frequency):
    """Rice (1944): zero crossings come at 2 sqrt(m2 / m0) a second, here twice the one frequency, to 3 %."""
    band = ((frequency * 0.95, 1.0), (frequency * 1.05, 1.0))
    time = np.arange(0, 400 / frequency, 0.05 / frequency)
    moved = heave(time=time, spectrum=band)
    assert np.sum(moved[1:] * moved[:-1] < 0) / time[-1] == pytest.approx(2 * frequency, rel=0.03)


@pytest.mark.parametrize("name", DEGREES_OF_FREEDOM)
def test_no_freedom_minds_the_others(name):
    """Requested alone or among all six, a freedom moves the same; and no two of them move alike."""
    all_six = {freedom: {"rms": 0.1, "period": 7.0} for freedom in DEGREES_OF_FREEDOM}
    together = displacement(Motion(**all_six), TIME, 3)
    alone = displacement(Motion(**{name: all_six[name]}), TIME, 3)
    for freedom in DEGREES_OF_FREEDOM:
        np.testing.assert_array_equal(alone[freedom], together[freedom] if freedom == name else 0)
        if freedom != name:
            assert np.abs(together[freedom] - together[name]).max() > 0.05


@pytest.mark.parametrize("name", COLUMNS)
def test_no_column_of_a_log_minds_the_others(name):
    """A column's error is the same alone as among all six, and leaves the others true."""
    together = columns(logged_poses(NavigationErrors(**EVERY), TRUE, 9)) - columns(TRUE)
    alone = columns(logged_poses(NavigationErrors(**{name: EVERY[name]}), TRUE, 9)) - columns(TRUE)
    for row, column in enumerate(COLUMNS):
        np.testing.assert_array_equal(alone[:, row], together[:, row] if column == name else 0)


def test_errors_do_not_depend_on_where_the_platform_is():
    """The log of a moved and turned survey is wrong by as much as that of the survey."""
    errors = NavigationErrors(**EVERY)
    far = Poses(TIME, TRUE.position + np.array([500, -70, 3]), TRUE.heading + 2, TRUE.pitch, TRUE.roll)
    wrong = columns(logged_poses(errors, TRUE, 2)) - columns(TRUE)
    np.testing.assert_allclose(columns(logged_poses(errors, far, 2)) - columns(far), wrong, atol=1e-9)


@pytest.mark.parametrize("memory", [0.0, 5.0])
def test_noise_scales_with_its_rms_and_a_log_begins_like_a_shorter_one(memory):
    """Twice the rms, twice the noise; fewer pings, the first of the same."""
    small, large = (NavigationErrors(north={"noise": rms, "correlation_time": memory}) for rms in (0.5, 1.0))
    one, two = (columns(logged_poses(e, TRUE, 4)) - columns(TRUE) for e in (small, large))
    np.testing.assert_allclose(two, 2 * one, atol=1e-9)
    short = Poses(*(getattr(TRUE, n)[:50] for n in ("time", "position", "heading", "pitch", "roll")))
    np.testing.assert_array_equal(columns(logged_poses(small, short, 4)), columns(logged_poses(small, TRUE, 4))[:50])


def test_a_long_memory_keeps_all_and_a_short_one_nothing():
    """Limits: of the memory of weeks a constant is left, of that of a microsecond white noise, draw for draw."""
    kinds = {memory: NavigationErrors(depth={"noise": 1.0, "correlation_time": memory}) for memory in (0.0, 1e-6, 1e7)}
    white, short, long = (columns(logged_poses(e, TRUE, 4))[:, 2] for e in kinds.values())
    np.testing.assert_allclose(short, white, rtol=1e-12)
    assert np.ptp(long) < 0.05 * np.ptp(white)
    assert long[0] == pytest.approx(white[0], rel=1e-12) and abs(long[0] - 8) > 0.01  # no start at rest


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_a_log_written_down_is_read_back(tmp_path_factory, seed):
    """Round trip, whatever the delimiter, the line ends and the units of the table."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.1, 2, 12))
    place = rng.uniform(-500, 500, (12, 3)) * [1, 1, 0.1]
    lean = np.cumsum(rng.uniform(-0.1, 0.1, (12, 3)), axis=0)
    size, header = rng.choice([1, 1000]), ["time [s]", "north [m]", "east", "depth [m]"]
    header[1], angle = ("north [mm]", np.pi / 180) if size == 1000 else ("north [m]", 1.0)
    header += [f"{name} [{'deg' if size == 1000 else 'rad'}]" for name in ("heading", "pitch", "roll")]
    table = np.column_stack([time, place[:, 0] * size, place[:, 1:], lean / angle])
    mark, end = rng.choice([",", ";", "\t"]), rng.choice(["\n", "\r\n"])
    path = tmp_path_factory.mktemp("log") / "log.csv"
    path.write_bytes(
        (end.join(mark.join(map(str, row)) for row in [header, *table.tolist()]) + end).encode("utf-8-sig")
    )
    log = read_navigation(path)
    np.testing.assert_allclose(log.time, time - time[0], atol=1e-12)
    np.testing.assert_allclose(log.position, place, atol=1e-9)
    np.testing.assert_allclose(log.attitude, lean, atol=1e-12)
    np.testing.assert_array_equal(log.line, np.arange(2, 14))


def test_the_digest_is_that_of_the_bytes(tmp_path):
    """The sha256 of what stands in the file, also after it was changed."""
    path = tmp_path / "log.csv"
    for content in (b"time\n", b"time,north\n"):
        path.write_bytes(content)
        assert file_digest(path) == hashlib.sha256(content).hexdigest()


def test_degrees_on_the_plane_have_the_symmetries_of_the_globe():
    """South mirrors north, only differences of longitude count, and the date line is no edge."""
    lat, lon = np.array([45.01, 44.98]), np.array([10.02, 9.99])
    plane = local_plane_position(lat, lon, (45.0, 10.0))
    np.testing.assert_allclose(local_plane_position(-lat, lon, (-45.0, 10.0)), plane * [-1, 1], atol=1e-8)
    np.testing.assert_allclose(local_plane_position(lat, lon + 170, (45.0, 180.0)), plane, atol=1e-6)
    np.testing.assert_allclose(local_plane_position(lat, lon + 170 - 360, (45.0, 180.0)), plane, atol=1e-6)


def test_degrees_at_equator_and_pole_have_the_radii_of_the_ellipsoid():
    """East on the equator a; north there b^2 / a; north at the pole a^2 / b (a, b of WGS 84)."""
    a, b, step = 6378137.0, 6356752.3142, np.radians(0.01)
    east = local_plane_position(np.array([0.0]), np.array([0.01]), (0.0, 0.0))[0]
    np.testing.assert_allclose(east, [0, a * step], rtol=1e-9, atol=1e-9)
    north = local_plane_position(np.array([0.005]), np.array([0.0]), (-0.005, 0.0))[0]
    np.testing.assert_allclose(north, [b**2 / a * step, 0], rtol=1e-9, atol=1e-9)
    pole = local_plane_position(np.array([90.0]), np.array([0.0]), (89.99, 0.0))[0, 0]
    assert pole == pytest.approx(a**2 / b * step, rel=1e-7)


@given(st.integers(0, 2**32 - 1), st.floats(-np.pi, np.pi))
@settings(max_examples=20, deadline=None)
def test_distance_from_a_run_has_its_closed_form(seed, turn):
    """Beside the run its height, beyond an end the distance from the end; and the world may be turned."""
    rng = np.random.default_rng(seed)
    along, beside = rng.uniform(-30, 40, 50), rng.uniform(-20, 20, 50)
    expected = np.hypot(np.maximum(np.maximum(-along, along - 10), 0), beside)
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    place, run = np.column_stack([along, beside]) @ matrix.T + 3, np.array([[0, 0], [10, 0]]) @ matrix.T + 3
    np.testing.assert_allclose(distance_to_segments(place, run[None]), expected, atol=1e-9)
    cut = np.stack([run, run[::-1]])  # the same run twice, the other way round
    np.testing.assert_allclose(distance_to_segments(place, cut), expected, atol=1e-9)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_a_polyline_keeps_to_its_places(seed):
    """First and last place are corners, corners are places, and no place is farther away than it states."""
    places = np.cumsum(np.random.default_rng(seed).normal(size=(150, 2)), axis=0)
    corners, wander = simplified_polyline(places)
    assert {tuple(c) for c in corners} <= {tuple(p) for p in places}
    np.testing.assert_array_equal(corners[[0, -1]], places[[0, -1]])
    away = distance_to_segments(places, np.stack([corners[:-1], corners[1:]], axis=1))
    assert away.max() <= wander + 1e-9 <= 1.0 + 1e-9 and len(corners) < 150


def test_a_survey_turns_with_the_scene():
    """Poses turned and moved have the turned and moved survey; depths stay."""
    bend = true_poses(
        WaypointTrack(waypoints=((0, 0, 5), (80, 0, 9), (80, 60, 9)), speed=2, turn_radius=20, window=(0, 0.1))
    )
    turn, away = 0.9, np.array([40.0, -500.0, 0.0])
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    there = Poses(bend.time, bend.position @ matrix.T + away, bend.heading + turn, bend.pitch, bend.roll)
    one, other = track_extent(SONAR, bend), track_extent(SONAR, there)
    np.testing.assert_allclose(other.corners, one.corners @ matrix[:2, :2].T + away[:2], atol=1e-9)
    assert other.polyline_error == pytest.approx(one.polyline_error, abs=1e-9) and other.depths == pytest.approx(
        one.depths
    )


def test_every_ping_stands_at_a_depth_that_was_foretold():
    """Ends of all pings, with lever arms and motion, are the depths of the track, no more and no fewer."""
    moved = {"pitch": {"rms": 0.05, "period": 5}, "roll": {"rms": 0.1, "period": 7}, "heave": {"rms": 0.3, "period": 6}}
    sonar = nominal(transmit={"offset": (2, 1, 0.5)}, receive={"offset": (-1, 0.3, 0.7)}).sonar
    track = true_poses(LineTrack(start=(0, 0, 9), speed=1, pings=25, window=(0, 0.2), motion=moved))
    pulse, water = received_pulse(sonar), Water(sound_speed=1480)
    stood = [ping_geometry(sonar, track, ping, window=(0.1, 0.2), pulse=pulse, water=water) for ping in range(25)]
    found = np.sort([place[2] for one in stood for place in (one.transmit_position, one.receive_position)])
    np.testing.assert_allclose(array_depths(sonar, track), found, atol=1e-8)
    for one in stood:
        assert not one.is_monostatic and one.wavelength == pytest.approx(1480 / sonar.pulse.frequency)
        assert np.linalg.norm(one.transmit_position - one.receive_position) == pytest.approx(np.sqrt(9 + 0.49 + 0.04))
        assert one.recorded_delays[0] < 0.1 - sonar.pulse.duration and one.recorded_delays[1] > 0.2
