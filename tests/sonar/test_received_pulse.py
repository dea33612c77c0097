"""Claims about the pulse as the recording holds it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.sonar import (
    LineArray,
    Pulse,
    Receiver,
    Sonar,
    energy_duration,
    receive_pulse,
    received_pulse,
    response,
    spectrum,
)

TONE = Pulse(frequency="100 kHz", duration="0.2 ms", taper_fraction=0.2)
SWEEP = Pulse(kind="lfm", frequency="100 kHz", duration="10 ms", bandwidth="30 kHz", taper="none")
KINDS = [(TONE, False), (TONE, True), (SWEEP, False), (SWEEP, True)]


def by_direct_sum(received, time):
    """Inverse Fourier integral of the received spectrum, summed as it stands."""
    edge = 0.625 * received.receiver.bandwidth
    offset = np.linspace(-edge, edge, 10_001)
    line = received.spectrum(offset) * (offset[1] - offset[0])
    return np.array([np.sum(line * np.exp(2j * np.pi * offset * t)) for t in time])


def test_the_band_is_flat_then_falls_to_nothing_within_the_sample_rate():
    """One inside the band, a half at 1.125 half bands, zero from 0.625 of the band on: nothing can alias."""
    receiver = Receiver(bandwidth="20 kHz")
    offset = np.array([0, -9.9e3, 10e3, 11.25e3, -11.25e3, 12.5e3, 40e3])
    np.testing.assert_allclose(response(receiver, offset), [1, 1, 1, 0.5, 0.5, 0, 0], atol=1e-15)
    assert receiver.sample_rate == 25e3


@given(st.floats(1e3, 1e6), st.floats(-2, 2))
def test_the_response_is_even_and_between_zero_and_one(band, offset):
    """A real, even response has no delay and amplifies nothing."""
    receiver = Receiver(bandwidth=band)
    value = response(receiver, offset * band)
    assert 0 <= value <= 1
    assert value == response(receiver, -offset * band)


@pytest.mark.parametrize("band", [0, -1, "20 m"])
def test_a_receiver_without_a_band_is_refused(band):
    """A band is positive and a frequency."""
    with pytest.raises(ValidationError):
        Receiver(bandwidth=band)


@pytest.mark.parametrize("band", [5e3, 20e3, 100e3])
@pytest.mark.parametrize(("pulse", "compress"), KINDS)
def test_the_waveform_is_the_inverse_transform_of_its_spectrum(pulse, compress, band):
    """Table and cubic against a direct sum at arbitrary times: within 1e-6 of the peak."""
    received = receive_pulse(pulse, Receiver(bandwidth=band, matched_filter=compress))
    time = np.random.default_rng(3).uniform(received.start, received.stop, 20)
    np.testing.assert_allclose(received.samples(time), by_direct_sum(received, time), atol=1e-6 * received.peak)


def test_far_from_the_pulse_there_is_silence():
    """Times outside the table are reported with zero, in any shape."""
    pulse = receive_pulse(TONE, Receiver())
    assert np.all(pulse.samples([[-5.0, 1e3], [2.0, -1e9]]) == 0)
    assert pulse.samples(0.1e-3).shape == ()


@pytest.mark.parametrize(("pulse", "compress"), KINDS)
def test_start_and_stop_hold_all_but_a_millionth_of_the_energy(pulse, compress):
    """Mean square of the samples between start and stop, against Parseval's integral over the band."""
    received = receive_pulse(pulse, Receiver(matched_filter=compress))
    rate = 8 * received.receiver.sample_rate
    inside = np.sum(np.abs(received.samples(np.arange(received.start, received.stop, 1 / rate))) ** 2) / rate
    offset = np.linspace(-12.5e3, 12.5e3, 100_001)
    whole = np.trapezoid(np.abs(received.spectrum(offset)) ** 2, offset)
    assert received.effective_duration == pytest.approx(whole, rel=1e-7)
    assert 1 - inside / whole == pytest.approx(0, abs=3e-6)


@pytest.mark.parametrize("pulse", [TONE, SWEEP])
def test_compression_keeps_the_level_of_an_echo_and_puts_it_at_its_delay(pulse):
    """An echo of rms pressure p becomes a peak of p at time zero, real and symmetric."""
    received = receive_pulse(pulse, Receiver(bandwidth="150 kHz", matched_filter=True))
    assert received.samples(0.0) == pytest.approx(1, abs=1e-3)
    time = np.linspace(0, received.stop, 301)
    wave = received.samples(time)
    assert np.abs(wave).argmax() == 0
    np.testing.assert_allclose(received.samples(-time), np.conj(wave), atol=1e-7)


def test_the_compressed_tone_is_the_autocorrelation_of_the_sent_one():
    """A plain tone becomes a triangle of twice its length (to the ringing of a 150 kHz band)."""
    tone = Pulse(frequency=100e3, duration=1e-3, taper="none")
    pulse = receive_pulse(tone, Receiver(bandwidth="150 kHz", matched_filter=True))
    time = np.linspace(-1e-3, 1e-3, 41)
    np.testing.assert_allclose(pulse.samples(time), 1 - np.abs(time) / 1e-3, atol=2e-3)


def test_a_wide_receiver_receives_what_was_sent():
    """The energy lost shrinks to nothing, and the effective duration to the sent energy."""
    pulse = receive_pulse(TONE, Receiver(bandwidth="150 kHz"))
    assert pulse.out_of_band_energy < 3e-5
    assert pulse.effective_duration == pytest.approx(energy_duration(TONE), rel=3e-5)


def test_a_narrow_receiver_loses_the_sweep_outside_its_band():
    """A slow sweep spends its energy evenly: a 20 kHz band with soft edges passes 21.9 of 30 kHz (3/8 of each edge).

    Tolerance 1 %: ripples of the untapered spectrum, of order 1 / sqrt(bandwidth x duration).
    """
    long = SWEEP.model_copy(update={"duration": 0.2})
    passed = 20e3 + 2 * 0.375 * 2.5e3
    assert receive_pulse(long, Receiver()).out_of_band_energy == pytest.approx(1 - passed / 30e3, abs=0.01)


def test_resolution_time():
    """The energy duration of a tone, 1 / B for a compressed sweep."""
    tone = receive_pulse(TONE, Receiver(bandwidth="150 kHz"))
    assert tone.resolution_time == pytest.approx(energy_duration(TONE), rel=1e-3)
    sweep = receive_pulse(SWEEP, Receiver(bandwidth="100 kHz", matched_filter=True))
    assert sweep.resolution_time == pytest.approx(1 / 30e3, rel=0.01)


def test_both_readings_get_the_sonars_own_pulse():
    """The received pulse of a sonar is its pulse through its receiver: P H, or |P|^2 H / E when compressing."""
    arrays = {"transmit": LineArray(length=1.5), "receive": LineArray(length=1.5)}
    offset = np.linspace(-12e3, 12e3, 101)
    sent = spectrum(TONE, offset)
    for compress, expected in ((False, sent), (True, np.abs(sent) ** 2 / energy_duration(TONE))):
        receiver = Receiver(matched_filter=compress)
        received = received_pulse(Sonar(source_level_db=220, pulse=TONE, receiver=receiver, **arrays))
        np.testing.assert_allclose(received.spectrum(offset), expected * response(receiver, offset), atol=1e-18)
