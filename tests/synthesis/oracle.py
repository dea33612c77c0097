"""A pulse and a sum of echoes written out in float64, frequency by frequency; shares no code with the synthesis."""

import numpy as np
from numpy.typing import NDArray

from oracles.time_series import summed

RATE = 25e3
CARRIER = 100e3
DURATION = 2e-4


def pulse_spectrum(offset: NDArray[np.float64]) -> NDArray[np.complex128]:
    """A 0.2 ms rectangle received in a band of 0.8 RATE, rolled off to nothing at RATE / 2 [s]."""
    roll_off = np.cos(np.pi / 2 * np.clip((np.abs(offset) / RATE - 0.4) / 0.1, 0, 1)) ** 2
    delayed = np.exp(-1j * np.pi * offset * DURATION)
    return roll_off * DURATION * np.sinc(offset * DURATION) * delayed


def series(delay, weight, time, spectrum=pulse_spectrum, bins=4096):
    """Sum of weight p(t - delay), by the midpoint rule over the band; periodic in bins / RATE."""
    return summed(delay, weight, time, spectrum, RATE, bins)


def carried(delay, amplitude):
    """Amplitudes with the phase of the carrier."""
    return amplitude * np.exp(-2j * np.pi * CARRIER * np.asarray(delay))


def relative_rms(value, truth):
    """Root mean square difference over root mean square truth."""
    return np.linalg.norm(value - truth) / np.linalg.norm(truth)


def spikes(count, start, stop, seed=1):
    """Random delays [s] and complex Gaussian amplitudes."""
    random = np.random.default_rng(seed)
    amplitude = random.normal(size=count) + 1j * random.normal(size=count)
    return random.uniform(start, stop, count), amplitude.astype(np.complex64)
