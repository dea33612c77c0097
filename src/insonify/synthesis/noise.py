"""Noise after the receiver: a spectrum level, shaped by the receiver's filter, drawn for each channel."""

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

from insonify import random_keys
from insonify.sonar.pulse import energy_duration, spectrum
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.receiver import response
from insonify.units import intensity_ratio

Slope = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Power of a noise at offsets from the centre frequency [Hz], over that at the centre [1]."""


def receiver_filter(pulse: ReceivedPulse, offset: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Frequency response of the receiver [1]: its band, and the matched filter if it has one.

    Args:
        pulse: Received pulse, with transmitted pulse and receiver.
        offset: Frequency relative to the centre [Hz], any shape.
    """
    filtered = np.asarray(response(pulse.receiver, offset), complex)
    if pulse.receiver.matched_filter:
        filtered = filtered * np.conj(spectrum(pulse.pulse, offset)) / energy_duration(pulse.pulse)
    return filtered


def noise_intensity(pulse: ReceivedPulse, level_db: float | None, slope: Slope | None = None) -> float:
    """Mean-square noise pressure in the recording [uPa^2].

    Args:
        pulse: Received pulse.
        level_db: Spectrum level in the channel, at the centre frequency [dB re 1 uPa^2/Hz]; None: no noise.
        slope: Change of the spectrum over the band; None: white.
    """
    if level_db is None:
        return 0.0
    rate = pulse.receiver.sample_rate
    points = max(20_001, 8 * int(pulse.pulse.duration * rate) + 1)  # a few on each lobe of the pulse's spectrum
    offset = np.linspace(-0.5, 0.5, points) * rate
    power = np.abs(receiver_filter(pulse, offset)) ** 2 * (1.0 if slope is None else slope(offset))
    return float(intensity_ratio(level_db) * np.trapezoid(power, offset))


def receiver_noise(
    pulse: ReceivedPulse, level_db: float | None, seed: int, ping: int, channels: int, count: int, *,
    slope: Slope | None = None, stream: int = random_keys.NOISE,
) -> NDArray[np.complex64]:  # fmt: skip
    """Noise of one ping, independent between channels.

    Args:
        pulse: Received pulse.
        level_db: Spectrum level in each channel, at the centre frequency [dB re 1 uPa^2/Hz]; None: no noise.
        seed: Seed of the scenario.
        ping: Number of the ping.
        channels: Number of channels.
        count: Number of samples.
        slope: Change of the spectrum over the band; None: white.
        stream: Stream of the random numbers.

    Returns:
        Circular Gaussian pressure [uPa], shape (channels, count).
    """
    if level_db is None:
        return np.zeros((channels, count), np.complex64)
    rate = pulse.receiver.sample_rate
    period = scipy.fft.next_fast_len(count + int(np.ceil((pulse.stop - pulse.start) * rate)))
    offset = scipy.fft.fftfreq(period, 1 / rate)
    filter_response = receiver_filter(pulse, offset)
    filter_response = filter_response if slope is None else filter_response * np.sqrt(slope(offset))
    root = np.sqrt(float(intensity_ratio(level_db)) * rate)
    rows = [
        scipy.fft.ifft(
            scipy.fft.fft(random_keys.complex_normals(seed, stream, ping, channel, period)) * filter_response
        )[:count]
        for channel in range(channels)
    ]
    return (root * np.array(rows)).astype(np.complex64)
