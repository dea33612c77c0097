"""Claims about beamforming by FFT: the same beams as delay-and-sum far away, over the whole band."""

import numpy as np
import pytest

from insonify.processing import beamform_delay_sum, beamform_fft
from oracles.point_echoes import bell, decibels, received, two_way

F, C, RATE, COUNT = 100e3, 1500.0, 60e3, 48
PITCH = C / F / 2
LINE = np.stack([0 * np.arange(COUNT), (np.arange(COUNT) - (COUNT - 1) / 2) * PITCH, 0 * np.arange(COUNT)], axis=1)
TIME = 0.02 + np.arange(300) / RATE


def towards(sines):
    """Unit vectors at angles whose sine to starboard is given."""
    sines = np.asarray(sines, float)
    return np.stack([np.sqrt(1 - sines**2), sines, 0 * sines], axis=-1)


def plane_waves(sines, delays, amplitudes, width=9e3):
    """What the line receives of echoes from far away in some directions."""
    delay = np.asarray(delays)[:, None] - towards(sines) @ LINE.T / C
    return received(TIME, delay, F, bell(width), np.asarray(amplitudes))


def scene():
    """Twelve echoes from anywhere, well within the record."""
    rng = np.random.default_rng(11)
    return plane_waves(rng.uniform(-0.8, 0.8, 12), rng.uniform(0.0215, 0.0235, 12), rng.normal(size=12) + 1j)


@pytest.mark.parametrize("shading", ["uniform", "hamming"])
def test_it_equals_delay_and_sum_far_away(shading):
    """Twelve echoes, a band of a fifth of the carrier, 97 beams: -60 dB of the strongest apart."""
    sines, series = np.linspace(-0.8, 0.8, 97), scene()
    by_fft = beamform_fft(series, TIME, sines, spacing=PITCH, centre_frequency=F, shading=shading)
    by_sum = beamform_delay_sum(series, LINE, TIME, towards(sines), centre_frequency=F, shading=shading, focus="far")
    assert decibels(np.max(np.abs(by_fft - by_sum)) / np.max(np.abs(by_sum))) < -60


def test_wide_bands_squint_no_beam():
    """An echo 50 degrees off a 20 kHz band keeps its pulse: narrow-band phases would stretch it over 12 samples."""
    sine = np.sin(np.radians(50))
    series = plane_waves([sine], [0.0225], [1.0], width=12e3)
    got = beamform_fft(series, TIME, [sine], spacing=PITCH, centre_frequency=F)[0]
    alone = received(TIME, np.full((1, 1), 0.0225), F, bell(12e3))[0]
    np.testing.assert_allclose(got, alone, atol=1e-4)
    narrow = np.mean(series * np.exp(-2j * np.pi * F * LINE[:, 1:2] * sine / C), axis=0)
    assert np.max(np.abs(narrow - alone)) > 0.2


def test_any_number_of_beams_and_any_start():
    """Beams are the same whichever others are formed beside them; pings are worked on by themselves."""
    series = np.stack([scene(), 2 * scene()])
    about = {"spacing": PITCH, "centre_frequency": F}
    many = beamform_fft(series, TIME, np.linspace(-0.6, 0.6, 121), **about)
    few = beamform_fft(series, TIME, np.linspace(-0.1, 0.3, 5), **about)
    np.testing.assert_allclose(few, many[:, 50:91:10], atol=1e-5)
    np.testing.assert_allclose(many[1], 2 * many[0], atol=1e-5)


def test_a_focus_that_follows_the_sound_is_that_of_delay_and_sum():
    """Echoes from 3 to 3.6 m at any angle, an array of 0.36 m whose near field ends at 8.6 m: -35 dB of DAS apart.

    Phases of 0.05 rad are left at the ends of the line where the series begins (seen: -38 dB). With a focus far away
    they are 4 dB below it apart.
    """
    time = 2 * 2.9 / C + np.arange(80) / RATE
    sines = np.array([-0.75, -0.3, 0.0, 0.4, 0.7])
    points = np.linspace(3.0, 3.6, 5)[:, None] * towards(sines)
    series = received(time, two_way(points, np.zeros(3), LINE, C), F, bell(9e3), np.ones(5))
    beams = np.linspace(-0.8, 0.8, 65)
    by_sum = beamform_delay_sum(series, LINE, time, towards(beams), centre_frequency=F)
    by_fft, far = (
        beamform_fft(series, time, beams, spacing=PITCH, centre_frequency=F, focus=focus)
        for focus in ("dynamic", "far")
    )
    strongest = np.max(np.abs(by_sum))
    assert strongest == pytest.approx(1, abs=0.1)
    assert decibels(np.max(np.abs(by_fft - by_sum)) / strongest) < -35
    assert decibels(np.max(np.abs(far - by_sum)) / strongest) > -10
    with pytest.raises(ValueError, match="choose far or dynamic"):
        beamform_fft(series, time, beams, spacing=PITCH, centre_frequency=F, focus="near")


def test_uneven_beams_are_refused_with_the_fix():
    """Evenly spaced angles are unevenly spaced sines."""
    with pytest.raises(ValueError, match="use beamform_delay_sum"):
        beamform_fft(scene(), TIME, np.sin(np.radians(np.arange(0, 60, 5))), spacing=PITCH, centre_frequency=F)
    with pytest.raises(ValueError, match="spacing is 0"):
        beamform_fft(scene(), TIME, [0.0], spacing=0, centre_frequency=F)
