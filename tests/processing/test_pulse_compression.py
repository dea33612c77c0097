"""Claims about the matched filter: level, place, side lobes, resolution, noise."""

import numpy as np
import pytest

from insonify.processing import matched_filter
from insonify.sonar.pulse import Pulse, envelope, spectrum
from oracles.point_echoes import decibels

F, RATE = 100e3, 50e3
SWEEP = Pulse(kind="lfm", frequency=F, duration=4e-3, bandwidth=20e3)
TONE = Pulse(frequency=F, duration=1e-3)
TIME = 0.01 + np.arange(1500) / RATE


def echo(pulse, delay):
    """A band-limited echo of amplitude one: the pulse's spectrum in the band of the record, delayed."""
    bins = np.fft.fftfreq(4096, 1 / RATE)
    shifted = spectrum(pulse, bins) * np.exp(-2j * np.pi * bins * (delay - TIME[0])) * RATE
    return (np.fft.ifft(shifted)[: TIME.size] * np.exp(-2j * np.pi * (F * delay % 1))).astype(np.complex64)


@pytest.mark.parametrize("pulse", [SWEEP, TONE, SWEEP.model_copy(update={"sweep": "down"})])
@pytest.mark.parametrize("window", ["uniform", "hamming"])
@pytest.mark.parametrize("delay", [0.02, 0.0200077])
def test_an_echo_of_one_becomes_a_peak_of_one_at_its_delay(pulse, window, delay):
    """0 dB, at the delay, with the carrier's phase: read between samples by the band-limited sum."""
    got = matched_filter(echo(pulse, delay), pulse, RATE, window=window)
    at_delay = np.sum(got * np.sinc((delay - TIME) * RATE))
    assert at_delay == pytest.approx(np.exp(-2j * np.pi * (F * delay % 1)), abs=2e-3)
    assert abs(TIME[np.argmax(np.abs(got))] - delay) <= 0.51 / RATE


def test_a_tone_becomes_a_triangle():
    """The autocorrelation of a rectangular tone of duration T is 1 - |tau| / T."""
    plain = Pulse(frequency=F, duration=1e-3, taper="none")
    got = np.abs(matched_filter(echo(plain, 0.02), plain, RATE))
    np.testing.assert_allclose(got, np.maximum(0, 1 - np.abs(TIME - 0.02) / 1e-3), atol=0.01)


@pytest.mark.parametrize(("window", "highest", "width"), [("uniform", -13.3, 0.886), ("hamming", -38.0, 1.30)])
def test_a_sweep_becomes_a_narrow_peak_with_the_windows_side_lobes(window, highest, width):
    """B T = 80, ends hardly softened. -3 dB widths of 0.886 / B and 1.30 / B (Harris 1978, table 1)."""
    plain = SWEEP.model_copy(update={"taper": "none"})
    got = matched_filter(echo(plain, 0.02), plain, RATE, window=window)
    fine = 0.02 + np.arange(-800, 801) / (80 * RATE)
    curve = np.abs(np.sinc((fine[:, None] - TIME) * RATE) @ got)
    level = decibels(curve / curve.max())
    above = fine[level > -3]
    assert (above[-1] - above[0]) * 20e3 == pytest.approx(width, rel=0.06)
    lobes = level[np.abs(fine - 0.02) > (1.2 if window == "uniform" else 2.3) / 20e3]
    assert lobes.max() == pytest.approx(highest, abs=1.0) if window == "uniform" else lobes.max() < highest


def test_a_replica_in_samples_does_as_well_as_the_pulse():
    """Samples of the baseband from its start on: -30 dB of the peak apart, what lies outside of the band."""
    replica = envelope(SWEEP, np.arange(200) / RATE)
    got = matched_filter(echo(SWEEP, 0.02), replica, RATE)
    exact = matched_filter(echo(SWEEP, 0.02), SWEEP, RATE)
    assert decibels(np.max(np.abs(got - exact))) < -30


def test_noise_becomes_its_density_over_the_energy():
    """White noise of 1 uPa^2 in 50 kHz, N = 60 series: N0 / E to 0.2 dB, three standard errors and more."""
    rng = np.random.default_rng(3)
    noise = (rng.normal(size=(60, 1500)) + 1j * rng.normal(size=(60, 1500))) / np.sqrt(2)
    got = matched_filter(noise.astype(np.complex64), SWEEP, RATE)[:, 250:1200]
    bins = np.fft.fftfreq(4096, 1 / RATE)
    energy = np.sum(np.abs(spectrum(SWEEP, bins)) ** 2) * RATE / 4096
    assert 10 * np.log10(np.mean(np.abs(got) ** 2) * energy * RATE) == pytest.approx(0, abs=0.2)


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"pressure": np.zeros(50)}, "give complex baseband"),
     ({"replica": np.zeros(4)}, "no energy"),
     ({"replica": np.zeros((2, 4))}, "one row"),
     ({"window": "kaiser"}, "window is 'kaiser'; choose one of uniform"),
     ({"sample_rate": -1.0}, "sample_rate is -1")],
)  # fmt: skip
def test_what_does_not_fit_is_refused(changes, message):
    """The value, and what would fit."""
    given = {"pressure": np.zeros(50, np.complex64), "replica": TONE, "sample_rate": RATE} | changes
    with pytest.raises(ValueError, match=message):
        matched_filter(**given)
