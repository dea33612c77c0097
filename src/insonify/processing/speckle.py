"""Speckle drawn from an expected intensity.

Where many scatterers share a resolution cell, pressure is a circular complex Gaussian process whose mean square is the
expected intensity and whose correlation along range is that of the received pulse; its magnitude is Rayleigh
distributed (Jackson & Richardson 2007, High-Frequency Seafloor Acoustics, ch. 16). Pings are independent, as they are
where the sonar moves by half its aperture or more from one to the next.
"""

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.sonar.received_pulse import ReceivedPulse

Floats = NDArray[np.float64]
MAX_LOOKS = 64
"""Looks above which more are not distinguished [1]."""


def speckle_intensity(
    pulse: ReceivedPulse, sample_rate: float, shape: tuple[int, int, int], *, seed: int, stream: int, looks: int = 1
) -> Floats:  # fmt: skip
    """Intensity of speckle re its mean.

    Args:
        pulse: Received pulse, which correlates neighbouring samples.
        sample_rate: Samples per second [Hz].
        shape: Pings, channels and samples.
        seed: Seed of the draw [1].
        stream: Stream of `insonify.random_keys` [1].
        looks: Independent realisations that are averaged.

    Returns:
        Factors of mean 1 [1], shape (pings, channels, samples): exponentially distributed for one look.
    """
    pings, channels, samples = shape
    first = int(np.floor(pulse.start * sample_rate))
    taps = pulse.samples(np.arange(first, int(np.ceil(pulse.stop * sample_rate)) + 1) / sample_rate)
    taps = taps / np.sqrt(np.sum(np.abs(taps) ** 2))
    out = np.empty(shape)
    count, looks = samples + len(taps) - 1, min(looks, MAX_LOOKS)
    for ping in range(pings):
        for channel in range(channels):
            total = np.zeros(samples)
            for look in range(looks):
                row = channel + look * channels
                white = random_keys.complex_normals(seed, stream, ping, row, count)
                total += np.abs(np.convolve(white, taps, mode="valid")) ** 2
            out[ping, channel] = total / looks
    return out
