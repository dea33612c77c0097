"""Claims about back-projection: place, resolution, the exact sum, motion, defocus."""

import numpy as np
import pytest

from insonify.frames import pose_rotation
from insonify.processing import along_track_resolution, backproject
from oracles.point_echoes import decibels, two_way

F, C, RATE = 150e3, 1500.0, 80e3
SLANT, ALTITUDE, LENGTH = 30.0, 9.0, 0.10
GROUND = float(np.sqrt(SLANT**2 - ALTITUDE**2))
TARGET = np.array([0.0, GROUND, ALTITUDE])
TIME = 2 * SLANT / C + np.arange(-160, 161) / RATE
STEPS = np.arange(-140, 141) * 0.025  # a 7 m aperture, four pings to an element's length
BAND = 30e3


def compressed(t):
    """A sweep of 30 kHz after its matched filter: a flat spectrum whose ends are rounded over a tenth."""
    x, roll = BAND * t, 0.1
    base = 1 - (2 * roll * x) ** 2
    safe = np.where(np.abs(base) < 1e-9, 1.0, base)
    return np.sinc(x) * np.where(np.abs(base) < 1e-9, np.pi / 4, np.cos(np.pi * roll * x) / safe)


def beam(place, point=TARGET):
    """Two-way beam of elements of LENGTH, sending and simulator."""
    sine = (point[0] - place[:, 0]) / np.linalg.norm(point - place, axis=1)
    return np.sinc(LENGTH * F / C * sine) ** 2


def track(steps=STEPS):
    """Places of the sonar, on a line to the north."""
    return np.stack([steps, 0 * steps, 0 * steps], axis=1)


def pings(sent, received, delay=None, strength=None, pulse=compressed):
    """Matched-filtered echoes of the target, shape (ping, 1, time)."""
    tau = np.array([two_way(TARGET[None], s, h[None], C)[0, 0] for s, h in zip(sent, received, strict=True)])
    tau = tau if delay is None else delay
    weight = beam(sent) if strength is None else strength
    rows = weight[:, None] * np.exp(-2j * np.pi * (F * tau % 1))[:, None] * pulse(TIME - tau[:, None])
    return rows[:, None].astype(np.complex64), tau


def patch(north, east):
    """Pixels on the bed."""
    return np.stack([*np.meshgrid(north, east, indexing="ij"), np.full((len(north), len(east)), ALTITUDE)], axis=-1)


def exact(sent, pixels, tau, strength, pulse=compressed, speed=C):
    """The image of the target, each pixel the float64 sum over pings."""
    expected = 2 * np.linalg.norm(pixels[..., None, :] - sent, axis=-1) / speed
    turned = np.exp(2j * np.pi * (F * (expected - tau) % 1)) * pulse(expected - tau) * strength
    return turned.mean(axis=-1)


def width(place, value):
    """Distance between the points 3 dB below the peak, by straight lines."""
    level = decibels(value / np.abs(value).max())
    peak = int(np.argmax(level))
    left = np.interp(-3, level[: peak + 1], place[: peak + 1])
    right = np.interp(3, -level[peak:], place[peak:])
    return right - left


def focus(series, sent, pixels, **options):
    """The image."""
    return backproject(series, TIME, sent, sent[:, None], pixels, centre_frequency=F, sound_speed=C, **options)


def test_the_image_is_the_exact_sum():
    """Around a point: within 0.1 % of the peak of the sum in float64, phase included; the peak is at the target."""
    sent = track()
    series, tau = pings(sent, sent)
    north, east = np.arange(-20, 21) * 0.01, GROUND + np.arange(-20, 21) * 0.008
    got = focus(series, sent, patch(north, east))
    truth = exact(sent, patch(north, east), tau, beam(sent))
    assert np.max(np.abs(got - truth)) < 1e-3 * np.abs(truth).max()
    assert np.unravel_index(np.argmax(np.abs(got)), got.shape) == (20, 20)
    assert got[20, 20] == pytest.approx(np.mean(beam(sent)), rel=1e-3)


def test_resolution_is_that_of_the_element_and_of_the_band():
    """An element of 10 cm over 7 m at 30 m: 3.87 cm along (under half its length); 0.886 c / 2 B across, on the bed."""
    sent = track()
    series, _ = pings(sent, sent)
    north, east = np.arange(-60, 61) * 1e-3, GROUND + np.arange(-60, 61) * 1e-3
    along = focus(series, sent, patch(north, [GROUND]))[:, 0]
    across = focus(series, sent, patch([0.0], east))[0]
    assert width(north, along) == pytest.approx(0.0387, abs=0.0005)
    # the curve of ranges over so wide a beam hardly widens it
    assert width(east, across) == pytest.approx(0.8859 * C / (2 * BAND) * SLANT / GROUND, rel=0.03)


def test_equal_weight_over_an_angle_has_the_resolution_of_a_sinc():
    """All pings alike within 5 degrees: 0.886 c / (4 f sin 5) along the track; shading widens it to Hann's 1.44."""
    sent, half = track(), np.radians(5)
    series, _ = pings(sent, sent, strength=np.ones(len(STEPS)))
    north = np.arange(-80, 81) * 1e-3
    about = {"track_direction": np.array([1.0, 0, 0]), "max_angle": half}
    plain = focus(series, sent, patch(north, [GROUND]), **about)[:, 0]
    assert width(north, plain) == pytest.approx(along_track_resolution(half, F, C), rel=0.02)
    shaded = focus(series, sent, patch(north, [GROUND]), angle_shading="hann", **about)[:, 0]
    assert width(north, shaded) == pytest.approx(1.44 / 0.886 * along_track_resolution(half, F, C), rel=0.03)
    assert np.abs(plain).max() == pytest.approx(1, abs=2e-3) and np.abs(shaded).max() == pytest.approx(1, abs=2e-3)


def test_half_an_element_is_resolved_over_the_width_of_its_beam():
    """0.886 D / 2 of the angles to half a wavelength over D, where sinc(1/2) is -3.9 dB; no angle has no width."""
    assert along_track_resolution(np.arcsin(C / F / 2 / LENGTH), F, C) == pytest.approx(0.443 * LENGTH, rel=1e-3)
    assert decibels(np.sinc(0.5)) == pytest.approx(-3.92, abs=0.01)
    with pytest.raises(ValueError, match="half_angle"):
        along_track_resolution(0.0, F, C)


def moving(speed):
    """A sonar that runs on while the sound travels: exact delays by iteration."""
    sent, velocity = track(), np.array([speed, 0.0, 0.0])
    tau = np.full(len(sent), 2 * SLANT / C)
    for _ in range(30):
        received = sent + velocity * tau[:, None]
        tau = (np.linalg.norm(TARGET - sent, axis=1) + np.linalg.norm(TARGET - received, axis=1)) / C
    series, _ = pings(sent, sent, delay=tau)
    return sent, velocity, series


def test_a_sonar_that_moves_while_it_receives_is_imaged_in_place():
    """3 m/s: at its place with the receiver's own motion, 6.0 cm astern (-v tau / 2) as stop and hop."""
    sent, velocity, series = moving(3.0)
    north = np.arange(-120, 121) * 1e-3
    right = focus(series, sent, patch(north, [GROUND]), receive_velocity=velocity)[:, 0]
    hop = focus(series, sent, patch(north, [GROUND]))[:, 0]
    assert abs(north[np.argmax(np.abs(right))]) <= 1e-3
    assert north[np.argmax(np.abs(hop))] == pytest.approx(-0.060, abs=2e-3)
    still = exact(sent, patch([0.0], [GROUND]), 2 * np.linalg.norm(TARGET - sent, axis=1) / C, beam(sent))
    assert np.abs(right).max() == pytest.approx(np.abs(still).max(), rel=1e-3)


def test_transmitter_and_receivers_stand_apart():
    """Eight receivers on 0.35 m and a transmitter at their stern: two pings fill what eight would, the peak is one."""
    steps = np.arange(-3.5, 3.5, 0.175)
    sent = track(steps)
    received = sent[:, None] + np.arange(1, 9)[:, None] * np.array([0.05, 0, 0])
    delay = np.array([two_way(TARGET[None], s, h, C)[0] for s, h in zip(sent, received, strict=True)])
    turn = np.exp(-2j * np.pi * (F * delay % 1))
    series = (turn[..., None] * compressed(TIME - delay[..., None])).astype(np.complex64)
    got = backproject(series, TIME, sent, received, patch([-0.1, 0.0, 0.1], [GROUND]), centre_frequency=F)
    assert got[1, 0] == pytest.approx(1, abs=1e-3)
    assert np.all(np.abs(got[[0, 2], 0]) < 0.2)


@pytest.mark.parametrize("error", [0.002, 0.01])
def test_a_wrong_sound_speed_defocuses_as_the_wrong_curvature_does(error):
    """0.2 % and 1 %: peak and width along the track are those of the exact sum at the wrong speed."""
    sent, speed = track(), C * (1 + error)
    series, tau = pings(sent, sent)
    # the echo moves out with the speed: look where it is
    slant = speed * SLANT / C
    pixels = patch(np.arange(-150, 151) * 2e-3, [np.sqrt(slant**2 - ALTITUDE**2)])
    got = backproject(series, TIME, sent, sent[:, None], pixels, centre_frequency=F, sound_speed=speed)
    truth = exact(sent, pixels, tau, beam(sent), speed=speed)
    assert np.max(np.abs(got - truth)) < 2e-3 * np.abs(truth).max()
    sharp = np.mean(beam(sent))
    # phase at the beam's edge, 2 k (R - R0) error: under a radian it costs nothing, at many it costs most
    assert (np.abs(got).max() > 0.9 * sharp) == (error < 0.005)


def test_sway_that_is_not_logged_takes_its_toll():
    """Random sway of deviation s between pings: the peak falls to exp(-(2 k s cos)^2 / 2) in the mean (Ruze)."""
    rng = np.random.default_rng(8)
    sent, sway = track(), 0.6e-3
    true = sent + np.stack([0 * STEPS, rng.normal(size=len(STEPS)) * sway, 0 * STEPS], axis=1)
    series, _ = pings(true, true, strength=np.ones(len(STEPS)))
    point = patch([0.0], [GROUND])
    lost = np.abs(focus(series, sent, point))[0, 0]
    turn = 2 * (2 * np.pi * F / C) * sway * GROUND / SLANT
    # 281 draws: the mean of a phasor of that spread is known to 0.03
    assert lost == pytest.approx(np.exp(-(turn**2) / 2), abs=0.06)
    assert np.abs(focus(series, true, point))[0, 0] == pytest.approx(1, abs=1e-3)


def test_pings_are_added_with_their_own_weights():
    """Doubling every weight changes nothing; a weight of zero leaves a ping out; threads change no bit."""
    sent = track()
    series, _ = pings(sent, sent)
    pixels = patch(np.arange(-40, 41) * 0.01, GROUND + np.arange(-40, 41) * 0.01)
    taper = np.hanning(len(sent))
    once = focus(series, sent, pixels, shading=taper, threads=1)
    np.testing.assert_array_equal(once, focus(series, sent, pixels, shading=taper, threads=3))
    np.testing.assert_allclose(once, focus(series, sent, pixels, shading=2 * taper[:, None]), atol=1e-6)
    kept = np.arange(len(sent)) % 2 == 0
    half = focus(series, sent, pixels, shading=kept.astype(float))
    np.testing.assert_allclose(half, focus(series[kept], sent[kept], pixels), atol=1e-5)


def test_turning_track_and_pixels_together_changes_nothing():
    """A world turned and moved by kilometres has the same image: delays are float64."""
    sent = track(STEPS[::4])
    series, _ = pings(sent, sent)
    pixels, turn = patch(np.arange(-3, 4) * 0.02, GROUND + np.arange(-3, 4) * 0.02), pose_rotation(0.7, 0.1, -0.2)
    shift = np.array([4000.0, -9000.0, 12.0])
    moved = focus(series, sent @ turn.T + shift, pixels @ turn.T + shift)
    np.testing.assert_allclose(moved, focus(series, sent, pixels), atol=1e-5)


def test_pixels_that_no_ping_reaches_are_zero():
    """Beyond the record, and outside of the angle."""
    sent = track()
    series, _ = pings(sent, sent)
    assert focus(series, sent, np.array([[0.0, 500.0, 9.0]]))[0] == 0
    narrow = {"track_direction": np.array([1.0, 0, 0]), "max_angle": np.radians(5)}
    assert focus(series, sent, np.array([[25.0, 15.0, 9.0]]), **narrow)[0] == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"transmit": np.zeros((4, 3))}, r"give \(3, 3\)"),
     ({"receive": np.zeros((3, 2, 3))}, r"give \(3, 1, 3\)"),
     ({"grid": np.zeros((5, 2))}, "three axes"),
     ({"pressure": np.zeros((3, 321), np.complex64)}, r"give \(ping, channel, time\)"),
     ({"shading": np.ones(4)}, r"give \(3,\) or \(3, 1\)"),
     ({"max_angle": 0.1}, "without track_direction"),
     ({"max_angle": 0.1, "track_direction": np.array([2.0, 0, 0])}, "unit vectors"),
     ({"angle_shading": "hann"}, "without a limit"),
     ({"receive_velocity": np.zeros((2, 2))}, "broadcasts to"),
     ({"receive_velocity": 500.0}, "below a tenth")],
)  # fmt: skip
def test_what_does_not_fit_is_refused(changes, message):
    """The value, and what would fit."""
    given = {"pressure": np.zeros((3, 1, 321), np.complex64), "time": TIME, "transmit": np.zeros((3, 3)),
             "receive": np.zeros((3, 1, 3)), "grid": np.zeros((2, 3)), "centre_frequency": F} | changes  # fmt: skip
    with pytest.raises(ValueError, match=message):
        backproject(**given)
