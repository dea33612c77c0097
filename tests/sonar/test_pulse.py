"""Claims about the sound a sonar sends."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.sonar import Pulse, energy_duration, envelope, spectrum
from insonify.validity import PhysicsWarning

TONE = Pulse(frequency="100 kHz", duration="0.2 ms", taper_fraction=0.2)
SWEEP = Pulse(kind="lfm", frequency="100 kHz", duration="10 ms", bandwidth="30 kHz")


def quadrature(pulse: Pulse) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of a fine Gauss rule over the pulse, broken at the corners of its taper."""
    node, weight = np.polynomial.legendre.leggauss(24)
    corner = pulse.taper_fraction / 2
    panels = int(6e4 * pulse.duration) + 20
    knots = np.unique(np.concatenate([np.linspace(0, 1, panels), [corner, 0.5, 1 - corner]])) * pulse.duration
    span = np.diff(knots)[:, None] / 2
    return (knots[:-1, None] + span * (node + 1)).ravel(), (span * weight).ravel()


def transform_by_quadrature(pulse: Pulse, offset: np.ndarray) -> np.ndarray:
    """Fourier integral of the envelope, summed as it stands."""
    time, weight = quadrature(pulse)
    received = weight * envelope(pulse, time)
    return np.array([np.sum(received * np.exp(-2j * np.pi * f * time)) for f in offset])


@pytest.mark.parametrize(("taper", "fraction"), [("none", 1), ("tukey", 0.13), ("tukey", 0.001), ("hann", 1)])
@pytest.mark.parametrize("product", [0, 1e-3, 0.1, 0.5, 1, 3, 300])
@pytest.mark.parametrize("sweep", ["up", "down"])
def test_the_spectrum_is_the_fourier_integral_of_the_envelope(product, taper, fraction, sweep):
    """Closed forms against quadrature, for any product of bandwidth and duration: within 1e-9 of the peak."""
    duration = 3e-3
    pulse = Pulse(
        kind="lfm" if product else "cw", frequency=150e3, duration=duration, bandwidth=product / duration,
        sweep=sweep, taper=taper, taper_fraction=fraction,
    )  # fmt: skip
    offset = np.linspace(-60e3, 60e3, 31)
    expected = transform_by_quadrature(pulse, offset)
    scale = np.abs(transform_by_quadrature(pulse, np.linspace(-product / duration, product / duration, 9) / 2)).max()
    assert np.max(np.abs(spectrum(pulse, offset) - expected)) < 1e-9 * scale


def test_the_nulls_of_a_plain_tone_are_at_multiples_of_one_over_its_duration():
    """A rectangle of T seconds: T on the centre frequency, nothing at k / T."""
    pulse = Pulse(frequency=100e3, duration=1e-3, taper="none")
    assert abs(spectrum(pulse, 0.0)) == pytest.approx(1e-3)
    assert np.abs(spectrum(pulse, np.arange(1, 20) * 1e3)).max() < 1e-17


def test_no_frequency_is_singular():
    """A taper's transform has a removable singularity at one over twice its length; nothing happens there."""
    critical = 1 / (2 * 0.2 * 0.2e-3 / 2)
    offset = critical * (1 + np.array([-1e-7, -1e-12, 0, 1e-12, 1e-7]))
    value = spectrum(TONE, offset)
    assert np.all(np.isfinite(value))
    np.testing.assert_allclose(value, value[2], atol=1e-6 * 0.2e-3)


@pytest.mark.parametrize("pulse", [TONE, SWEEP, Pulse(frequency=1e5, duration=1e-3, taper="hann")])
def test_parseval(pulse):
    """The energy in time is the energy in frequency (to the part beyond +-2 MHz)."""
    offset = np.arange(-2e6, 2e6, 0.4 / pulse.duration)
    in_frequency = np.sum(np.abs(spectrum(pulse, offset)) ** 2) * 0.4 / pulse.duration
    assert in_frequency == pytest.approx(energy_duration(pulse), rel=1e-6)


@given(st.floats(1e-3, 1), st.sampled_from(["none", "tukey", "hann"]), st.sampled_from(["cw", "lfm"]))
@settings(max_examples=20, deadline=None)
def test_the_energy_of_a_taper_in_closed_form(fraction, taper, kind):
    """Integral of |envelope|^2: T for none, T (1 - 5 a / 8) for Tukey, 3 T / 8 for Hann, whatever the sweep."""
    pulse = Pulse(
        kind=kind, frequency=1e5, duration=1e-3, bandwidth=4e3 if kind == "lfm" else 0, taper=taper,
        taper_fraction=fraction,
    )  # fmt: skip
    time, weight = quadrature(pulse)
    assert energy_duration(pulse) == pytest.approx(np.sum(weight * np.abs(envelope(pulse, time)) ** 2), rel=1e-9)


def test_the_envelope_lives_between_zero_and_the_duration():
    """One at the peak, silent outside, and continuous where it is tapered."""
    time = np.linspace(-1e-4, 3e-4, 4001)
    level = np.abs(envelope(TONE, time))
    assert level.max() == pytest.approx(1)
    assert np.all(level[(time < 0) | (time > 2e-4)] == 0)
    assert np.max(np.abs(np.diff(level))) < 1e-2
    assert abs(envelope(TONE, 1e-5)) == pytest.approx(0.5), "half way up the taper of 20 us"


@pytest.mark.parametrize(("sweep", "sign"), [("up", 1), ("down", -1)])
def test_a_sweep_glides_across_its_band(sweep, sign):
    """The phase's rate goes from -B/2 to B/2, or back, and is zero at mid-pulse."""
    pulse = SWEEP.model_copy(update={"sweep": sweep})
    time = np.array([1e-3, 5e-3, 9e-3])
    step = 1e-7
    ahead, behind = envelope(pulse, time + step), envelope(pulse, time - step)
    frequency = np.angle(ahead * np.conj(behind)) / (4 * np.pi * step)
    np.testing.assert_allclose(frequency, sign * np.array([-12e3, 0, 12e3]), atol=1e-3)


def test_a_falling_sweep_is_a_rising_one_played_backwards():
    """Time reversal conjugates the spectrum, up to the delay of one duration."""
    rising, falling = SWEEP, SWEEP.model_copy(update={"sweep": "down"})
    time = np.linspace(0, 10e-3, 999)
    np.testing.assert_allclose(envelope(falling, time), np.conj(envelope(rising, 10e-3 - time)), atol=1e-10)


@pytest.mark.parametrize(
    ("wrong", "advice"),
    [
        (
            {"kind": "lfm", "frequency": "30 kHz", "duration": "2 ms", "bandwidth": "80 kHz"},
            "bandwidth: 80 kHz at a centre of 30 kHz; the band would reach below 0 Hz. "
            "Give a bandwidth under 60 kHz, or a higher centre frequency.",
        ),
        ({"frequency": "20 kHz", "duration": "0.04 ms"}, "Give a duration over 0.05 ms"),
        ({"frequency": "100 kHz", "duration": "1 ms", "bandwidth": "5 kHz"}, "set kind to lfm"),
        ({"kind": "lfm", "frequency": "100 kHz", "duration": "1 ms"}, "Give the width of the sweep"),
        ({"frequency": 0, "duration": "1 ms"}, "frequency: 0 Hz is out of range (above 0, to 10000000 Hz)"),
        ({"frequency": "100 kHz", "duration": "-1 ms"}, "duration: -1 ms is out of range (above 0, to 10000 ms)"),
        ({"frequency": "100 kHz", "duration": "1 m"}, "duration: 1 m is not a time; use s, ms, us, min"),
        (
            {"frequency": "100 kHz", "duration": "1 ms", "taper_fraction": 1.5},
            "taper_fraction: 1.5 is out of range (0.001 to 1)",
        ),
        ({"frequency": float("nan"), "duration": "1 ms"}, "finite number"),
        (
            {"frequency": "100 kHz", "duration": "1 ms", "length": 3},
            "unknown key 'length' (known here: kind, frequency, duration,",
        ),
    ],
)
def test_an_impossible_pulse_is_refused_with_advice(wrong, advice):
    """What, the value, the limit, the fix."""
    with pytest.raises(ValidationError) as run_refusal:
        Pulse(**({"duration": "40 us"} | wrong))
    assert advice in str(run_refusal.value)


@pytest.mark.parametrize("frequency", ["5 kHz", "2 MHz"])
def test_a_frequency_outside_the_trade_is_a_warning(frequency):
    """Rays and flat-bed laws are trusted from 10 kHz to 1 MHz."""
    with pytest.warns(PhysicsWarning, match="10 to 1000 kHz"):
        Pulse(frequency=frequency, duration="1 ms")
