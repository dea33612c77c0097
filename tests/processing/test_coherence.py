"""Claims about coherence: its size, its phase, its delay, and the phase centres it finds."""

import numpy as np
import pytest

from insonify.processing import (
    coherence_by_delay,
    complex_coherence,
    displaced_phase_centres,
    dpca_displacement,
    parabolic_peak,
)


def noise(*shape, seed=0):
    """Circular Gaussian numbers of unit power."""
    rng = np.random.default_rng(seed)
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)


@pytest.mark.parametrize("true", [0.95, 0.6 * np.exp(1j), 0.3j])
def test_coherence_is_what_was_put_in(true):
    """40 000 samples: three standard errors, (1 - |g|^2) / sqrt(2 N), are under 0.011."""
    a = noise(40_000)
    b = np.conj(true) * a + np.sqrt(1 - abs(true) ** 2) * noise(40_000, seed=1)
    assert abs(complex_coherence(a, b) - true) < 0.011
    assert abs(complex_coherence(3j * a, 0.1 * b) - 1j * true) < 0.011


def test_of_n_looks_the_modulus_has_a_floor():
    """Independent series, N = 25 looks: mean modulus sqrt(pi / 4 N) = 0.177 within 3 % (2500 values)."""
    a, b = noise(500, 125), noise(500, 125, seed=1)
    centres = (slice(2, None, 5), slice(2, None, 5))
    got = np.abs(complex_coherence(a, b, (5, 5))[centres])
    assert got.mean() == pytest.approx(0.886 / 5, rel=0.03)


def test_running_looks_equal_the_sum_written_out():
    """At one sample of a picture; silence has no coherence."""
    a, b = noise(9, 20), noise(9, 20, seed=1)
    a[:, :5] = 0
    got = complex_coherence(a, b, (3, 5))
    x, y = a[3:6, 10:15], b[3:6, 10:15]
    exact = np.sum(x * np.conj(y)) / np.sqrt(np.sum(np.abs(x) ** 2) * np.sum(np.abs(y) ** 2))
    assert got[4, 12] == pytest.approx(exact)
    assert got[4, 1] == 0


@pytest.mark.parametrize("late", [-3.0, 0.0, 2.35])
def test_a_later_echo_has_its_peak_at_its_delay(late):
    """A band of half the sample rate, delayed by any part of a sample: peak to 0.03 samples, coherence to 2 %."""
    size, rate = 2048, 40e3
    bins = np.fft.fftfreq(size)
    spectrum = noise(size) * (np.abs(bins) < 0.25) * size
    a = np.fft.ifft(spectrum)
    b = np.fft.ifft(spectrum * np.exp(-2j * np.pi * bins * late))
    curve, delays = coherence_by_delay(a, b, rate, max_delay=6 / rate)
    place, height = parabolic_peak(np.abs(curve), 1 / rate, delays[0])
    assert place * rate == pytest.approx(late, abs=0.03)
    assert height == pytest.approx(1, abs=0.02)


def test_a_parabola_is_found_exactly():
    """Peak 2.3 of height 5, sampled at whole numbers; a curve that rises to its end has its peak there."""
    place, height = parabolic_peak(5 - (np.arange(6) - 2.3) ** 2, 1.0)
    assert (place, height) == (pytest.approx(2.3), pytest.approx(5))
    assert parabolic_peak([1.0, 2.0, 4.0], 0.5, 10.0)[0] == 11.0


@pytest.mark.parametrize("channels", [0, 3, -2])
def test_phase_centres_coincide_where_the_sonar_moved_to(channels):
    """Speckle that varies along the track, received at phase centres: the displacement is half a spacing a channel."""
    places, width = np.arange(-30, 31), 1.2
    field = np.array([[np.exp(-((i - j) ** 2) / (2 * width**2)) for j in places] for i in places]) @ noise(61, 900)
    first, second = field[20:40], field[20 + channels : 40 + channels]
    matrix = displaced_phase_centres(first, second)
    assert matrix.shape == (20, 20)
    place, height = dpca_displacement(matrix, 0.1)
    assert place == pytest.approx(channels * 0.05, abs=0.003)
    assert height == pytest.approx(1, abs=0.03)


def test_dpca_coherence_falls_with_parallax():
    """A seabed at 30 m, transmitter and receiver 2 d apart about one phase centre: delays differ by (2 d)^2 / 4 R.

    Coherence is that of one place read twice with that delay, so it stays near one: 0.999 at 20 cm, 0.98 at 40 cm.
    """
    rng, f, c = np.random.default_rng(4), 150e3, 1500.0
    x, y = rng.uniform(-1.5, 1.5, 30_000), rng.uniform(27, 31, 30_000)
    time = 2 * 30 / c + np.arange(-60, 61) / 40e3
    series = []
    for d in (0.0, 0.2, 0.4):
        delay = (np.hypot(x - d, y) + np.hypot(x + d, y)) / c
        weight = np.sinc(0.1 * f / c * (x - d) / y) * np.sinc(0.1 * f / c * (x + d) / y)
        cell = np.round((delay - time[0]) * 40e3 * 8).astype(int)
        turn = weight * np.exp(2j * np.pi * (rng_phase(x) - f * delay))
        fine = np.zeros(2000, complex)
        near = (cell >= 0) & (cell < 2000)
        np.add.at(fine, cell[near], turn[near])
        series.append(np.convolve(fine, np.hanning(33), "same")[:968:4])
    kept = [abs(complex_coherence(series[0], s)) for s in series[1:]]
    assert kept[0] == pytest.approx(0.999, abs=0.003)
    assert kept[1] == pytest.approx(0.98, abs=0.015)


def rng_phase(x):
    """Phase that belongs to a scatterer, in turns."""
    return np.random.default_rng(9).uniform(size=x.size)


def test_what_does_not_fit_is_refused():
    """The value, and what would fit."""
    with pytest.raises(ValueError, match="two of one shape"):
        complex_coherence(noise(4), noise(5))
    with pytest.raises(ValueError, match="give complex baseband"):
        complex_coherence(np.ones(4), np.ones(4))
    with pytest.raises(ValueError, match="looks is 4; give odd"):
        complex_coherence(noise(9), noise(9), 4)
    with pytest.raises(ValueError, match="max_delay is 1 s"):
        coherence_by_delay(noise(9), noise(9), 10.0, max_delay=1.0)
    with pytest.raises(ValueError, match=r"give \(channel, channel\)"):
        dpca_displacement(np.ones((2, 3)), 0.1)
