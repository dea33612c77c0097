"""The matched filter as its definition states, by quadrature and by theorem: delays, Schwarz, Doppler."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.processing import matched_filter
from insonify.sonar.pulse import Pulse
from oracles.time_series import sent

F, RATE, BINS = 100e3, 50e3, 1200
OFFSET = (np.arange(BINS) / BINS - 0.5) * RATE
TIME = np.arange(600) / RATE
WAVES = np.exp(2j * np.pi * np.outer(TIME, OFFSET)) * RATE / BINS
SEEDS = st.integers(0, 10**6)


def drawn(seed):
    """A tone or a sweep of 1 to 4 ms with softened ends, and its spectrum by quadrature in the band of the series."""
    rng = np.random.default_rng(seed)
    shape = {"duration": float(rng.uniform(1e-3, 4e-3)), "bandwidth": float(rng.choice([0.0, 8e3, 16e3]))}
    fraction = float(rng.uniform(0.3, 1.0))
    pulse = Pulse(frequency=F, kind="lfm" if shape["bandwidth"] else "cw", taper_fraction=fraction, **shape)
    fine = np.arange(32 * BINS) / (32 * RATE)  # the trapezium rule: the ends are soft
    bins = np.fft.fft(np.where(fine < pulse.duration, sent(fine, fraction=fraction, **shape), 0)) / (32 * RATE)
    return pulse, bins[np.round(OFFSET / RATE * BINS).astype(int)], rng


def series(spectrum, delay, amplitude=1.0):
    """Echoes made of a spectrum, frequency by frequency, at TIME."""
    weight = np.atleast_1d(amplitude) * np.exp(-2j * np.pi * ((F * np.atleast_1d(delay)) % 1))
    late = np.exp(-2j * np.pi * np.outer(OFFSET, np.atleast_1d(delay))) @ weight
    return WAVES @ (spectrum * late)


@settings(max_examples=20)
@given(SEEDS)
def test_echoes_become_the_autocorrelation_of_the_pulse_at_their_delays(seed):
    """Three echoes at any delays: the sum of |P|^2 over the band, frequency by frequency, within -55 dB of it."""
    pulse, inside, rng = drawn(seed)
    delay, amplitude = rng.uniform(2e-3, 7e-3, 3), rng.normal(size=3) + 1j * rng.normal(size=3)
    found = matched_filter(series(inside, delay, amplitude).astype(np.complex64), pulse, RATE)
    exact = series(np.abs(inside) ** 2, delay, amplitude) / (np.mean(np.abs(inside) ** 2) * RATE)
    assert np.abs(found - exact).max() < 2e-3 * np.abs(amplitude).sum()


@settings(max_examples=20)
@given(SEEDS, st.sampled_from(["uniform", "hann", "hamming", "taylor"]))
def test_later_by_samples_is_later_by_samples(seed, window):
    """An echo 57 samples later, the carrier's turn taken out, is compressed to the same 57 samples later."""
    pulse, inside, rng = drawn(seed)
    late = rng.uniform(2e-3, 4e-3) + np.array([0.0, 57 / RATE])
    here, there = (
        matched_filter(series(inside, d).astype(np.complex64), pulse, RATE, window=window)
        * np.exp(2j * np.pi * (F * d % 1))
        for d in late
    )
    np.testing.assert_allclose(there[57:], here[:-57], atol=2e-4)


@settings(max_examples=30)
@given(SEEDS)
def test_nothing_of_the_pulses_energy_is_received_stronger_than_the_pulse(seed):
    """Schwarz: whatever the series, no sample of its filter is above the root of its energy over the pulse's."""
    pulse, inside, rng = drawn(seed)
    noise = (rng.normal(size=600) + 1j * rng.normal(size=600)) * (rng.uniform(size=600) < rng.uniform(0.01, 1))
    energy = np.sum(np.abs(noise) ** 2) / RATE
    found = matched_filter(noise.astype(np.complex64), pulse, RATE)
    assert np.abs(found).max() <= 1.0001 * np.sqrt(energy / (np.mean(np.abs(inside) ** 2) * RATE))


@pytest.mark.parametrize("sweep", ["up", "down"])
@pytest.mark.parametrize("shift", [-600.0, 250.0, 600.0])
def test_an_echo_that_moves_is_received_early_or_late_by_its_shift_over_the_rate_of_the_sweep(sweep, shift):
    """Range-Doppler coupling of a sweep: -f_d T / B when it rises, + when it falls; within a tenth of 1 / B.

    Woodward (1953), Probability and Information Theory, with Applications to Radar, ch. 7; not verified.
    """
    pulse = Pulse(kind="lfm", frequency=F, duration=4e-3, bandwidth=16e3, taper="hann", sweep=sweep)
    late = 4e-3
    shape = sent(TIME - late, 4e-3, 1.0, 16e3)
    echo = np.where((late <= TIME) & (late + 4e-3 >= TIME), shape if sweep == "up" else np.conj(shape), 0)
    found = matched_filter((echo * np.exp(2j * np.pi * shift * TIME)).astype(np.complex64), pulse, RATE)
    fine = late + np.arange(-400, 401) * 1e-6
    curve = np.abs(np.sinc((fine[:, None] - TIME) * RATE) @ found)
    expected = late + (-1 if sweep == "up" else 1) * shift * 4e-3 / 16e3
    assert fine[np.argmax(curve)] == pytest.approx(expected, abs=0.1 / 16e3)
    assert curve.max() > 0.9


def test_a_tone_that_moves_fades_as_a_sinc():
    """A tone of 2 ms without a taper, shifted by up to 1.5 / T: its peak is |sinc(f_d T)| to 0.02."""
    pulse = Pulse(frequency=F, duration=2e-3, taper="none")
    echo = (TIME >= 4e-3 - 1e-9) & (TIME < 6e-3 - 1e-9)
    for shift in (0.0, 150.0, 333.0, 500.0, 750.0):
        found = matched_filter((echo * np.exp(2j * np.pi * shift * TIME)).astype(np.complex64), pulse, RATE)
        assert abs(found[200]) == pytest.approx(abs(np.sinc(shift * 2e-3)), abs=0.02)
