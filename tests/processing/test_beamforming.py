"""Claims about delay-and-sum: patterns, focus, levels, phases."""

import numpy as np
import pytest

from insonify.frames import direction, pose_rotation
from insonify.processing import beamform_delay_sum
from oracles.point_echoes import bell, decibels, received, two_way

F, C, RATE = 100e3, 1500.0, 40e3
WAVE = C / F
PULSE = bell(6e3)


def line(count=64, spacing=WAVE / 2):
    """Elements to starboard of each other."""
    places = np.zeros((count, 3))
    places[:, 1] = (np.arange(count) - (count - 1) / 2) * spacing
    return places


def clock(slant, half=1e-3, rate=RATE):
    """Times about the echo of a slant range."""
    return 2 * slant / C + np.arange(-int(half * rate), int(half * rate) + 1) / rate


def aimed(bearings):
    """Directions to starboard of ahead, in a level plane."""
    return direction(np.asarray(bearings), 0.0)


def beams(points, elements, time, bearings, pulse=PULSE, amplitude=1.0, **options):
    """Beams of the echoes of some points, the transmitter at the origin."""
    series = received(time, two_way(np.atleast_2d(points), np.zeros(3), elements), F, pulse, amplitude)
    return beamform_delay_sum(
        series, elements, time, aimed(bearings), centre_frequency=F, **{"transmitter": np.zeros(3)} | options
    )


@pytest.mark.parametrize("steer_deg", [-10.0, 0.0, 10.0])
def test_the_pattern_is_the_array_factor(steer_deg):
    """64 elements, half a wavelength apart, a tone from far away: main lobe within 0.1 dB, first side lobe -13.3 dB."""
    elements, steer = line(), np.radians(steer_deg)
    time, long = clock(3e4), bell(1e3)
    offsets = np.concatenate([np.linspace(-0.8, 0.8, 17), [1.43]]) * 2 / 64  # in sine; first null at 2 / 64
    bearings = np.arcsin(np.sin(steer) + offsets)
    point = 3e4 * aimed([steer])
    got = beams(point, elements, time, bearings, pulse=long, focus="far")[:, time.size // 2]
    x = np.pi * offsets / 2
    factor = np.sin(64 * x) / np.where(x == 0, 1, 64 * np.sin(x))
    factor[x == 0] = 1
    np.testing.assert_allclose(decibels(got[:-1]), decibels(factor[:-1]), atol=0.1)
    assert decibels(got[-1]) == pytest.approx(-13.3, abs=0.3)


@pytest.mark.parametrize("slant", [2.0, 10.0, 150.0])
@pytest.mark.parametrize("bearing_deg", [-40.0, 0.0, 25.0])
def test_a_focused_echo_keeps_level_delay_and_phase(slant, bearing_deg):
    """A 1.5 m array at 2 to 150 m: the beam receives what one element at its centre would, to -60 dB."""
    elements, time = line(count=201), clock(slant)
    bearing = np.radians([bearing_deg])
    got = beams(slant * aimed(bearing), elements, time, bearing)[0]
    alone = received(time, np.full((1, 1), 2 * slant / C), F, PULSE)[0]
    middle = time.size // 2
    assert abs(got[middle] - alone[middle]) < 1e-4
    if slant >= 10:  # nearer, the focus moves on while the pulse lasts
        np.testing.assert_allclose(got, alone, atol=0.01)


def test_without_focus_a_near_echo_is_lost():
    """1.5 m at 10 m: plane-wave delays are wrong by 12 radians at the ends, focused ones within 0.2 dB."""
    elements, time, ahead = line(count=201), clock(10.0), np.zeros(1)
    point = 10 * aimed(ahead)
    levels = {f: decibels(beams(point, elements, time, ahead, focus=f)[0, time.size // 2]) for f in ("dynamic", 10.0)}
    assert max(abs(level) for level in levels.values()) < 0.2
    assert decibels(beams(point, elements, time, ahead, focus="far")[0, time.size // 2]) < -6


def test_the_focus_follows_the_sound():
    """One beam at 5 m and 40 m in one ping: both echoes have their level."""
    elements, ahead = line(count=101), np.zeros(1)
    time = np.arange(200, 2400) / RATE
    points = np.array([5.0, 40.0])[:, None] * aimed(ahead)
    got = np.abs(beams(points, elements, time, ahead)[0])
    for slant in (5.0, 40.0):
        assert got[np.argmin(np.abs(time - 2 * slant / C))] == pytest.approx(1, abs=0.03)  # the nearest sample
    fixed = np.abs(beams(points, elements, time, ahead, focus=40.0)[0])
    assert fixed[np.argmin(np.abs(time - 2 * 5.0 / C))] < 0.5


def test_the_transmitter_stands_in_its_own_place():
    """A transmitter 3 m ahead and 2 m below: the echo comes at the centre's own delay, in focus."""
    elements, bearing = line(count=101), np.radians([20.0])
    sent, point = np.array([3.0, 0.0, 2.0]), 12.0 * aimed(bearing)
    delay = two_way(point, sent, elements)
    middle = (np.linalg.norm(point - sent) + 12.0) / C
    time = middle + np.arange(-40, 41) / RATE
    got = beamform_delay_sum(received(time, delay, F, PULSE), elements, time, aimed(bearing), centre_frequency=F,
                             transmitter=sent)  # fmt: skip
    assert got[0, 40] == pytest.approx(np.exp(-2j * np.pi * F * middle), abs=2e-3)


def test_delays_between_samples_are_exact_in_the_band():
    """Tones up to 0.45 of the sample rate, read at any fraction of a sample: error below -60 dB."""
    time, place = np.arange(2000) / RATE, np.zeros((1, 3))
    for tone in np.array([-0.45, -0.2, 0.0, 0.33, 0.45]) * RATE:
        # the slow rise keeps the tone a tone
        rise = np.hanning(time.size)
        series = (rise * np.exp(2j * np.pi * tone * time))[None].astype(np.complex64)
        for fraction in (0.1, 0.25, 0.5, 0.77):
            # an element ahead of the centre receives earlier, and is read later by fraction / RATE
            ahead = np.array([[-fraction / RATE * C, 0, 0]])
            got = beamform_delay_sum(series, ahead, time, np.array([[1.0, 0, 0]]), centre_frequency=F, focus="far",
                                     centre=place[0])  # fmt: skip
            later = fraction / RATE
            cycles = tone * (time + later) + F * later
            exact = np.interp(time + later, time, rise, right=0) * np.exp(2j * np.pi * cycles)
            assert decibels(np.max(np.abs(got[0] - exact)[20:-20])) < -60


def test_shading_lowers_the_side_lobes():
    """Hamming's highest side lobe is below -38 dB (41 elements), uniform's is -13.3; both keep the level ahead."""
    elements, time = line(count=41), clock(3e4)
    bearings = np.arcsin(np.linspace(-0.9, 0.9, 361))
    for shading, highest in (("uniform", -13.0), ("hamming", -38.0), (np.hamming(41), -38.0)):
        got = decibels(beams([3e4, 0, 0], elements, time, bearings, pulse=bell(1e3), focus="far", shading=shading)
                       [:, time.size // 2])  # fmt: skip
        assert got.max() == pytest.approx(0, abs=0.01)
        main = np.abs(np.sin(bearings)) < (2 if highest > -20 else 4) / 41
        assert got[~main].max() < highest


@pytest.mark.parametrize("shading", ["uniform", "hann"])
def test_the_array_gain_against_noise_is_the_effective_number_of_elements(shading):
    """White noise of its own in each of 32 elements: mean power sum of w^2 in any beam, to 0.15 dB (N = 15 000)."""
    rng, elements = np.random.default_rng(7), line(count=32)
    time = np.arange(5000) / RATE
    # a band of half the rate, so that values between samples are as strong as samples
    bins = np.abs(np.fft.fftfreq(5000)) < 0.25
    white = rng.normal(size=(32, 5000)) + 1j * rng.normal(size=(32, 5000))
    series = np.fft.ifft(white * bins).astype(np.complex64)
    got = beamform_delay_sum(series, elements, time, aimed(np.radians([-30.0, 7, 50])), centre_frequency=F, focus="far",
                             shading=shading)  # fmt: skip
    places = (np.arange(32) - 15.5) / 32
    weight = np.ones(32) if shading == "uniform" else 0.5 + 0.5 * np.cos(2 * np.pi * places)
    gain = 10 * np.log10(np.sum((weight / weight.sum()) ** 2))
    power = np.mean(np.abs(got[:, 100:-100]) ** 2) / np.mean(np.abs(series) ** 2)
    assert 10 * np.log10(power) == pytest.approx(gain, abs=0.25)


def test_turning_array_and_beams_together_changes_nothing():
    """A frame of any heading, pitch and roll, moved by metres: the same beams to -80 dB."""
    elements, time, bearings = line(count=16), clock(12.0), np.radians([-20.0, 0, 35])
    turn, shift = pose_rotation(1.0, 0.3, -0.5), np.array([3.0, -7.0, 2.0])
    series = received(time, two_way(12 * aimed([0.2]), np.zeros(3), elements), F, PULSE)
    plain = beamform_delay_sum(series, elements, time, aimed(bearings), centre_frequency=F)
    turned = beamform_delay_sum(series, elements @ turn.T + shift, time, aimed(bearings) @ turn.T, centre_frequency=F)
    np.testing.assert_allclose(turned, plain, atol=1e-4)


def test_pings_and_threads_change_no_bit():
    """Two pings at once, with one thread or three."""
    rng = np.random.default_rng(5)
    elements, time, bearings = line(count=8), clock(20.0), np.radians(np.arange(-40, 41, 5.0))
    series = (rng.normal(size=(2, 8, time.size)) + 1j * rng.normal(size=(2, 8, time.size))).astype(np.complex64)
    both = beamform_delay_sum(series, elements, time, aimed(bearings), centre_frequency=F, threads=3)
    assert both.shape == (2, 17, time.size) and both.dtype == np.complex64
    for ping in (0, 1):
        one = beamform_delay_sum(series[ping], elements, time, aimed(bearings), centre_frequency=F, threads=1)
        np.testing.assert_array_equal(one, both[ping])


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"pressure": np.zeros((4, 81), np.complex64)}, r"require \(..., 8, 81\)"),
     ({"pressure": np.zeros((8, 81))}, "give complex baseband"),
     ({"pressure": np.full((8, 81), np.nan + 0j)}, "not finite"),
     ({"element_positions": np.zeros((8, 2))}, r"give \(any, 3\)"),
     ({"time": np.geomspace(0.1, 0.2, 81)}, "uneven"),
     ({"directions": np.array([[2.0, 0, 0]])}, "give length 1"),
     ({"focus": "near"}, "choose dynamic, far"),
     ({"focus": -3.0}, "focus is -3"),
     ({"shading": "flat"}, "shading is 'flat'"),
     ({"shading": np.ones(5)}, "one weight for each of 8"),
     ({"shading": np.tile([1.0, -1.0], 4)}, "sums to zero"),
     ({"centre_frequency": 0.0}, "centre_frequency is 0")],
)  # fmt: skip
def test_what_does_not_fit_is_refused(changes, message):
    """The value, and what would fit."""
    given = {"pressure": np.zeros((8, 81), np.complex64), "element_positions": line(count=8), "time": clock(10.0),
             "directions": aimed([0.0]), "centre_frequency": F} | changes  # fmt: skip
    with pytest.raises(ValueError, match=message):
        beamform_delay_sum(**given)
