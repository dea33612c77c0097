"""Claims about labelled recordings of elements: what is made of them lies in the world where it should."""

import numpy as np
import pytest
import xarray as xr

from insonify.frames import direction, pose_rotation
from insonify.processing import (
    beam_recording,
    compressed_recording,
    decimated_recording,
    interferometric_bathymetry,
    multibeam_soundings,
    sector_image_of_beams,
    sidescan,
    synthetic_aperture_image,
)
from insonify.sonar.pulse import Pulse, envelope
from oracles.point_echoes import bell, speckle, two_way

F, C, RATE = 100e3, 1500.0, 30e3
WAVE = C / F


def recorded(time, elements, points, position, attitude, *, sent=None, weight=None, pulse=None, speed=None, half=1e-3):
    """A recording of points in the world; with a speed, the elements move on while they receive."""
    position, attitude = np.atleast_2d(position).astype(float), np.atleast_2d(attitude).astype(float)
    elements = np.asarray(elements, float)
    transmitter = elements.mean(axis=0) if sent is None else np.asarray(sent, float)
    weights = np.broadcast_to(1.0 if weight is None else weight, (len(position), len(points)))
    rows = []
    for place, turn, strength in zip(position, attitude, weights, strict=True):
        body = pose_rotation(*turn)
        out = place + body @ transmitter
        received = place + elements @ body.T
        delay = two_way(points, out, received, C)
        for _ in range(10 if speed is not None else 0):
            there = received + np.asarray(speed) * delay[..., None]
            delay = (
                np.linalg.norm(points - out, axis=1)[:, None] + np.linalg.norm(points[:, None] - there, axis=2)
            ) / C
        rows.append(speckle(time, delay, F, pulse or bell(6e3), strength, half))
    pose = {"position": (("ping", "axis"), position), "attitude": (("ping", "axis"), attitude)}
    return xr.Dataset(
        {"pressure": (("ping", "channel", "time"), np.array(rows)), "element_position": (("channel", "axis"), elements),
         **pose, **({} if sent is None else {"transmitter_position": (("axis",), transmitter)})},
        {"time": time, "ping": np.arange(len(position)), "ping_time": ("ping", 0.2 * np.arange(len(position)))},
        {"centre_frequency": F, "title": "a test"},
    )  # fmt: skip


def line(count, axis, spacing=WAVE / 2):
    """Elements along forward (0) or starboard (1)."""
    places = np.zeros((count, 3))
    places[:, axis] = (np.arange(count) - (count - 1) / 2) * spacing
    return places


def test_a_forward_looking_sonar_shows_a_target_at_its_bearing_and_range():
    """20 m off, 25 degrees to starboard of a bow that heads south-east: beams, then a fan."""
    time = np.arange(0.02, 0.034, 1 / RATE)
    heading, bearing = np.radians(135), np.radians(25)
    target = np.array([100.0, 50, 3]) + 20 * direction(heading + bearing)
    held = recorded(time, line(64, 1), target[None], [100.0, 50, 3], [heading, 0, 0])
    beams = beam_recording(held, np.radians(np.arange(-60, 61, 1.0)))
    assert beams.pressure.dims == ("ping", "beam", "time") and beams.attrs["title"] == "a test"
    level = np.abs(beams.pressure.values[0])
    beam, sample = np.unravel_index(np.argmax(level), level.shape)
    assert np.degrees(beams.bearing.values[beam]) == pytest.approx(25)
    assert time[sample] * C / 2 == pytest.approx(20, abs=0.03)
    assert level[beam, sample] == pytest.approx(1, abs=0.02)
    fan = sector_image_of_beams(beams, np.arange(14, 24, 0.1), np.arange(0, 14, 0.1))
    x, y = np.unravel_index(np.nanargmax(fan.level_db.values[0]), fan.level_db.shape[1:])
    assert fan.ahead.values[x] == pytest.approx(20 * np.cos(bearing), abs=0.15)
    assert fan.starboard.values[y] == pytest.approx(20 * np.sin(bearing), abs=0.15)
    assert fan.level_db.attrs["units"] == "dB re 1 uPa" and fan.starboard.attrs["units"] == "m"


def test_an_array_along_the_keel_makes_a_sidescan():
    """Beams abeam of 1.5 m at 100 kHz: a point 25 m to starboard is strong in the ping that passes it, and only there.

    A line alone does not resolve port and starboard: elements that receive one side only are the recording's business.
    """
    time = np.arange(0.02, 0.04, 1 / RATE)
    along = np.arange(-5, 6)[:, None] * np.array([0.6, 0, 0])
    held = recorded(time, line(80, 0, 0.01875), np.array([[0.0, 25, 4]]), along, np.zeros((11, 3)))
    image = sidescan(beam_recording(held, np.radians([90.0])), gain="none", altitude=10.0)
    level = image.level_db.values
    ping, column = np.unravel_index(np.argmax(level), level.shape)
    assert ping == 5
    assert image.across.values[column] == pytest.approx(np.hypot(25, 4), abs=0.05)
    assert level.max() == pytest.approx(0, abs=0.3)  # the nearest sample
    assert np.all(level[[4, 6]].max(axis=1) < -10)
    both = sidescan(beam_recording(held, np.radians([-90.0, 90.0])), gain="none", altitude=10.0)
    np.testing.assert_allclose(both.level_db.values[:, ::-1], both.level_db.values, atol=0.01)


def test_a_sounding_lies_on_the_ellipsoid_of_a_transmitter_that_stands_apart():
    """One point on a beam 18 degrees to starboard, the transmitter 3 m ahead and 2 m to port: it is where it is."""
    time, angle = np.arange(2 * 8 / C, 2 * 20 / C, 1 / RATE), np.radians(18)
    point = np.array([[0.0, 14 * np.sin(angle), 14 * np.cos(angle)]])
    held = recorded(time, line(32, 1), point, np.zeros(3), np.zeros(3), sent=[3.0, -2, 0], half=3e-4)
    found = multibeam_soundings(held, [angle])
    np.testing.assert_allclose([found[axis].item() for axis in ("north", "east", "depth")], point[0], atol=0.02)


def test_compression_and_decimation_keep_what_they_should():
    """A sweep's echo becomes a peak of its level; the peak of fewer samples is that peak, their mean the energy."""
    pulse = Pulse(kind="lfm", frequency=F, duration=2e-3, bandwidth=12e3)
    time = np.arange(0.02, 0.034, 1 / RATE)
    point = np.array([[0.0, 18.0, 0.0]])
    held = recorded(time, line(2, 0), point, np.zeros(3), np.zeros(3), pulse=lambda t: envelope(pulse, t), half=2.1e-3)
    short = compressed_recording(held, pulse, window="hamming")
    level = np.abs(short.pressure.values[0, 0])
    assert time[np.argmax(level)] == pytest.approx(2 * 18 / C, abs=1 / RATE)
    assert level.max() == pytest.approx(1, abs=0.03)
    assert short.pressure.attrs["units"] == "uPa"
    few = decimated_recording(short, 60, keep="peak")
    assert few.sizes["time"] == 60 and "pressure" not in few and few.intensity.attrs["units"] == "uPa^2"
    assert few.intensity.max() == pytest.approx(level.max() ** 2)
    mean = decimated_recording(short, 60)
    assert mean.intensity.values[0, 0].mean() == pytest.approx(np.mean(level**2), rel=1e-6)
    assert mean.time.values[0] == pytest.approx(time[:7].mean(), abs=1 / RATE)


@pytest.mark.parametrize("crab_deg", [0.0, 5.0])
def test_a_synthetic_aperture_shows_a_point_where_it_is_in_the_world(crab_deg):
    """Ten pings at 2 m/s to the east, crabbing, rolling, simulator as they go; the log of the way is what counts."""
    rng = np.random.default_rng(1)
    speed = np.array([0.0, 2.0, 0.0])
    position = np.array([30.0, 0, 5]) + speed * 0.2 * np.arange(-10, 11)[:, None]
    attitude = np.radians(np.stack([90 + np.full(21, crab_deg), np.zeros(21), rng.normal(size=21)], axis=1))
    target = np.array([[5.0, 0.3, 12.0]])  # to starboard of a ship that heads east
    elements = line(8, 0, 0.05) + np.array([0.0, 0.4, 0.2])
    time = np.arange(2 * 24 / C, 2 * 29 / C, 1 / RATE)
    held = recorded(time, elements, target, position, attitude, sent=[0.5, 0.4, 0.2], speed=speed)
    north, east = np.arange(4.8, 5.21, 0.02), np.arange(0.1, 0.51, 0.02)
    image = synthetic_aperture_image(held, north, east, 12.0)
    value = np.abs(image.pressure.values)
    i, j = np.unravel_index(np.argmax(value), value.shape)
    assert (north[i], east[j]) == (pytest.approx(5.0, abs=0.011), pytest.approx(0.3, abs=0.011))
    assert value.max() == pytest.approx(1, abs=0.02)
    hop = np.abs(synthetic_aperture_image(held, north, east, 12.0, stop_and_hop=True).pressure.values)
    assert abs(east[np.unravel_index(np.argmax(hop), hop.shape)[1]] - (0.3 - 2.0 * np.sqrt(25**2 + 7**2) / C)) < 0.021
    # a log that is wrong by a metre to the north moves the image by as much
    logged = held.assign(logged_position=held.position + np.array([1.0, 0, 0]), logged_attitude=held.attitude)
    moved = synthetic_aperture_image(logged, north + 1, east, 12.0)
    np.testing.assert_allclose(moved.pressure.values, image.pressure.values, atol=1e-4)
    true = synthetic_aperture_image(logged, north, east, 12.0, navigation="true")
    np.testing.assert_allclose(true.pressure.values, image.pressure.values, atol=1e-5)
    wide = synthetic_aperture_image(held, north, east, 12.0, max_angle=np.radians(30))
    np.testing.assert_allclose(wide.pressure.values, image.pressure.values, atol=0.1)


@pytest.mark.parametrize("roll_deg", [0.0, 6.0])
def test_a_multibeam_sounds_a_slope_whatever_its_roll(roll_deg):
    """A bed of 10 % down to starboard, 12 m below, the ship rolled; +-45 degrees: soundings lie on it to 1 %."""
    rng = np.random.default_rng(2)
    time, angles = np.arange(2 * 8 / C, 2 * 30 / C, 1 / 20e3), np.radians(np.arange(-45, 46, 9.0))
    across = rng.uniform(-32, 32, 3000)
    points = np.stack([0 * across, across, 13.0 + 0.1 * across], axis=1)
    weight = np.exp(2j * np.pi * rng.uniform(size=(6, 3000))) / np.linalg.norm(points, axis=1)
    still = np.tile([0, 0, 1.0], (6, 1)), np.tile(np.radians([0, 0, roll_deg]), (6, 1))
    held = recorded(time, line(32, 1), points, *still, weight=weight, pulse=bell(4e3), half=2.5e-4)
    found = multibeam_soundings(held, angles)
    off = found.depth.values - 13.0 - 0.1 * found.east.values
    assert np.all(np.abs(off.mean(axis=0)) < 0.15)
    assert np.all(np.diff(found.east.values.mean(axis=0)) > 0)
    assert found.depth.attrs["units"] == "m" and found.travel_time.dims == ("ping", "beam")


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("roll_deg", [0.0, 4.0])
def test_an_interferometer_finds_the_bed_on_its_side_whatever_its_roll(side, roll_deg):
    """Receivers 4 wavelengths apart look 40 degrees down to one side from 2 m; the bed lies 10 m deep, to 5 cm."""
    rng, tilt = np.random.default_rng(3), np.radians(40)
    up = np.array([0, side * np.sin(tilt), -np.cos(tilt)])
    time = np.arange(2 * 11 / C, 2 * 22 / C, 1 / RATE)
    across = side * rng.uniform(5, 24, 3000)
    points = np.stack([0 * across, across, np.full(3000, 10.0)], axis=1)
    weight = np.exp(2j * np.pi * rng.uniform(size=3000))
    held = recorded(time, np.stack([up, -up]) * 2 * WAVE, points, [0, 0, 2.0], np.radians([0, 0, roll_deg]),
                    weight=weight, half=2e-4)  # fmt: skip
    held = held.assign_coords(side=("channel", [side, side]))
    found = interferometric_bathymetry(held, 8.0, looks=(1, 41))
    part = slice(60, -60)
    assert np.mean(found.depth.values[0, part]) == pytest.approx(10, abs=0.05)
    flat = side * np.sqrt((time * C / 2) ** 2 - 64)[part]
    np.testing.assert_allclose(found.across.values[0, part], flat, atol=0.4)
    assert found.coherence.values[0, part].mean() > 0.9
    with pytest.raises(ValueError, match="give the upper one first"):
        interferometric_bathymetry(held, 8.0, channels=(1, 0))
    with pytest.raises(ValueError, match="channels 0 to 1"):
        interferometric_bathymetry(held, 8.0, channels=(0, 2))


def test_what_a_recording_must_state_is_requested():
    """Places of elements, the carrier, a kind of navigation."""
    held = recorded(np.arange(0.01, 0.012, 1 / RATE), line(2, 0), np.array([[0.0, 8, 0]]), np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="no element_position; add it"):
        beam_recording(held.drop_vars("element_position"), [0.0])
    with pytest.raises(ValueError, match="no attribute centre_frequency"):
        beam_recording(held.drop_attrs(), [0.0])
    with pytest.raises(ValueError, match="navigation is 'best'; choose logged or true"):
        synthetic_aperture_image(held, [0.0], [1.0], 2.0, navigation="best")
