"""Laws of the pulse and of what the receiver makes of it: scale, mirror, stationary phase, limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.sonar import Pulse, Receiver, energy_duration, receive_pulse, spectrum
from insonify.sonar.pulse import envelope

TONE = {"frequency": 100e3, "duration": 1e-3}
SWEEP = {"frequency": 100e3, "duration": 5e-3, "kind": "lfm", "bandwidth": 20e3}
TAPERS = ["none", "tukey", "hann"]


@pytest.mark.parametrize("taper", TAPERS)
@pytest.mark.parametrize("values", [TONE, SWEEP])
@given(factor=st.floats(0.2, 5))
@settings(max_examples=10, deadline=None)
def test_slower_is_longer_and_narrower(values, taper, factor):
    """Stretched in time by a factor, the spectrum is that much higher and narrower: F p(t / k) = k P(k f)."""
    slow = values | {"duration": values["duration"] * factor, "bandwidth": values.get("bandwidth", 0) / factor}
    f = np.linspace(-25e3, 25e3, 101)
    one, other = Pulse(**values, taper=taper), Pulse(**slow, taper=taper)
    np.testing.assert_allclose(
        spectrum(other, f / factor), factor * spectrum(one, f), atol=2e-9 * factor * values["duration"]
    )


@pytest.mark.parametrize("values", [TONE, SWEEP])
def test_the_envelope_does_not_depend_on_its_carrier(values):
    """Another centre frequency, the same envelope and spectrum, bit for bit."""
    one, other = Pulse(**values), Pulse(**values | {"frequency": 300e3})
    time, f = np.linspace(-1e-3, 6e-3, 200), np.linspace(-30e3, 30e3, 200)
    np.testing.assert_array_equal(envelope(one, time), envelope(other, time))
    np.testing.assert_array_equal(spectrum(one, f), spectrum(other, f))


@pytest.mark.parametrize("values", [TONE, SWEEP])
def test_the_tapers_are_one_family(values):
    """Hann is a Tukey taper of all the pulse; a taper of a thousandth is nearly none."""
    f = np.linspace(-30e3, 30e3, 201)
    whole = spectrum(Pulse(**values, taper="tukey", taper_fraction=1), f)
    np.testing.assert_allclose(spectrum(Pulse(**values, taper="hann"), f), whole, atol=1e-15)
    sharp = spectrum(Pulse(**values, taper="tukey", taper_fraction=1e-3), f)
    assert np.abs(sharp - spectrum(Pulse(**values, taper="none"), f)).max() < 1.1e-3 / 2 * values["duration"]


def test_a_long_sweep_spends_on_each_frequency_what_its_taper_leaves():
    """Stationary phase: |P(f)|^2 = T / B w(t(f))^2, t(f) where the sweep passes f.

    At 1000 cycles of bandwidth times duration under a Hann taper, to 1e-2 of the middle.
    """
    pulse = Pulse(frequency=100e3, duration=50e-3, kind="lfm", bandwidth=20e3, taper="hann")
    f = np.linspace(-9e3, 9e3, 61)
    passed = np.sin(np.pi * (0.5 + f / 20e3)) ** 4
    np.testing.assert_allclose(np.abs(spectrum(pulse, f)) ** 2 / (50e-3 / 20e3), passed, atol=1e-2)


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("taper", TAPERS)
def test_time_and_band_scale_together_in_the_recording(taper, compress):
    """A pulse twice as long through half the band is the same waveform, twice as slow."""
    quick = receive_pulse(Pulse(**TONE, taper=taper), Receiver(bandwidth=10e3, matched_filter=compress))
    slow = receive_pulse(
        Pulse(**TONE | {"duration": 2e-3}, taper=taper), Receiver(bandwidth=5e3, matched_filter=compress)
    )
    time = np.linspace(-1e-3, 2e-3, 301)
    np.testing.assert_allclose(slow.samples(2 * time), quick.samples(time), atol=3e-6)
    assert slow.effective_duration == pytest.approx(2 * quick.effective_duration, rel=1e-6)
    assert slow.out_of_band_energy == pytest.approx(quick.out_of_band_energy, abs=1e-6)
    assert slow.resolution_time == pytest.approx(2 * quick.resolution_time, rel=1e-5)


@pytest.mark.parametrize("taper", TAPERS)
def test_a_falling_sweep_is_received_as_the_conjugate_of_a_rising_one(taper):
    """The receiver is real and even; a matched filter does not distinguish them at all."""
    time = np.linspace(-3e-3, 8e-3, 800)
    for compress in (False, True):
        up, down = (
            receive_pulse(Pulse(**SWEEP, taper=taper, sweep=way), Receiver(bandwidth=30e3, matched_filter=compress))
            for way in ("up", "down")
        )
        np.testing.assert_allclose(down.samples(time), np.conj(up.samples(time)), atol=2e-6)
        if compress:
            np.testing.assert_allclose(down.samples(time), up.samples(time), atol=2e-6)


@pytest.mark.parametrize("values", [TONE, SWEEP])
@pytest.mark.parametrize("compress", [False, True])
def test_a_narrower_band_never_passes_more(values, compress):
    """Energy lost grows as the band shrinks, and the received energy falls: the responses are nested."""
    received = [
        receive_pulse(Pulse(**values), Receiver(bandwidth=band, matched_filter=compress))
        for band in (80e3, 30e3, 12e3, 4e3, 1e3)
    ]
    lost = [pulse.out_of_band_energy for pulse in received]
    assert np.all(np.diff(lost) > 0) and 0 <= lost[0] < 0.01 and lost[-1] < 1
    assert np.all(np.diff([pulse.effective_duration for pulse in received]) < 0)


@pytest.mark.parametrize("values", [TONE, SWEEP])
@pytest.mark.parametrize("compress", [False, True])
def test_times_of_the_received_pulse_are_in_order_and_hold_its_energy(values, compress):
    """Ringing holds weak, weak holds strong; outside the strong part lies less than a millionth of the energy."""
    pulse = receive_pulse(Pulse(**values), Receiver(bandwidth=20e3, matched_filter=compress))
    first, last = pulse.table_interval
    assert first <= pulse.ringing_start <= pulse.start < pulse.stop <= pulse.ringing_stop <= last
    time = np.arange(first, last, 1 / 400e3)
    power = np.abs(pulse.samples(time)) ** 2
    inside = (time >= pulse.start) & (time <= pulse.stop)
    assert power[~inside].sum() <= 1.01e-6 * power.sum()
    assert power.sum() / 400e3 == pytest.approx(pulse.effective_duration, rel=1e-5)


@given(st.floats(1e-4, 2e-2), st.floats(3e3, 30e3), st.booleans())
@settings(max_examples=15, deadline=None)
def test_later_compression_never_makes_the_cell_coarser(duration, bandwidth, compress):
    """The finest cell is at most the recording's own, and c / 2B at most for any sweep."""
    pulse = Pulse(frequency=100e3, duration=duration, kind="lfm", bandwidth=bandwidth)
    received = receive_pulse(pulse, Receiver(bandwidth=40e3, matched_filter=compress))
    assert received.finest_resolution(1500) <= 750 * received.resolution_time * (1 + 1e-12)
    assert received.finest_resolution(1500) <= 750 / bandwidth * (1 + 1e-12)
    assert received.finest_resolution(3000) == pytest.approx(2 * received.finest_resolution(1500))


def test_a_matched_filter_output_is_hermitian_in_time():
    """An autocorrelation: the past is the conjugate of the future, and the largest value is at zero."""
    pulse = receive_pulse(Pulse(**SWEEP), Receiver(bandwidth=25e3, matched_filter=True))
    time = np.linspace(0, 5e-3, 700)
    np.testing.assert_allclose(pulse.samples(-time), np.conj(pulse.samples(time)), atol=2e-6)
    assert np.abs(pulse.samples(time)).argmax() == 0


@pytest.mark.parametrize("taper", TAPERS)
def test_the_spectrum_at_the_carrier_is_the_area_of_a_tone(taper):
    """P(0) = T (1 - a / 2), half of each tapered end; energy duration is less, for a window squared is less."""
    pulse = Pulse(**TONE, taper=taper, taper_fraction=0.4)
    share = {"none": 0, "tukey": 0.4, "hann": 1}[taper]
    area = spectrum(pulse, 0.0)
    assert area == pytest.approx(1e-3 * (1 - share / 2), rel=1e-12)
    assert energy_duration(pulse) <= area.real + 1e-18


@pytest.mark.parametrize(
    "wrong",
    [{"duration": 0}, {"duration": -1e-3}, {"duration": np.nan}, {"frequency": 0}, {"taper": "gauss"},
     {"taper_fraction": 0}, {"taper_fraction": 1.5}, {"bandwidth": -1}, {"sweep": "sideways"}, {"bandwith": 3}],
)  # fmt: skip
def test_a_pulse_that_cannot_be_sent_is_refused_by_name(wrong):
    """The message names the field that is wrong."""
    with pytest.raises(ValidationError, match=next(iter(wrong))):
        Pulse(**TONE | wrong)
