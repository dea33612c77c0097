"""Matched filter: compresses every echo to a peak at its delay."""

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from insonify.processing.element_series import taper
from insonify.sonar.pulse import Pulse, envelope, spectrum
from insonify.validity import require_number

Complexes = NDArray[np.complex128]

_FINER = 8
"""Samples of a windowed pulse per sample of the series."""


def matched_filter(
    pressure: ArrayLike, replica: Pulse | ArrayLike, sample_rate: float, *, window: str = "uniform"
) -> NDArray[np.complex64]:
    """Series compressed by a replica of the transmitted pulse.

    An echo of amplitude 1 becomes a peak of 1 at its delay, the start of the echo, so the time axis is unchanged.
    Noise of spectral density N0 becomes N0 over the pulse's energy (integral of its squared envelope).

    Args:
        pressure: Complex baseband, shape (..., time); float input is refused.
        replica: The pulse, or its complex baseband from its start on at `sample_rate`, shape (n,).
        sample_rate: Sample rate of the series [Hz].
        window: Taper of the replica over its duration: uniform, cosine, hann, hamming, taylor. On a sweep it lowers the
            side lobes in time (Hamming: 42 dB) and widens the peak.

    Returns:
        Complex baseband, shape (..., time), complex64. Echoes truncated by the end of the series are weaker.

    Raises:
        ValueError: Real series, or a replica without energy in the band.

    Source: van Trees (2001), Detection, Estimation, and Modulation Theory, part III, ch. 9 (matched filter of a
    complex envelope); Cook & Bernfeld (1967), Radar Signals, ch. 7 (weighted sweeps); not verified.

    Example:
        >>> from insonify.sonar import Pulse, envelope
        >>> pulse = Pulse(kind="lfm", frequency="100 kHz", bandwidth="20 kHz", duration="2 ms")
        >>> time = np.arange(0, 0.03, 1 / 50e3)
        >>> compressed = abs(matched_filter(envelope(pulse, time - 0.02), pulse, 50e3))
        >>> print(time[np.argmax(compressed)], compressed.max().round(2), compressed[997:1004].round(1))
        0.02 1.0 [0.1 0.3 0.8 1. 0.8 0.3 0.1]
    """
    series = np.asarray(pressure)
    if series.dtype.kind != "c" or series.ndim < 1:
        raise ValueError(f"pressure is {series.dtype} of shape {series.shape}; give complex baseband, (..., time)")
    rate = require_number("sample_rate", sample_rate, "Hz", 0.0, exclude_low=True, example="50e3")
    length = _samples(replica, rate)
    size = scipy.fft.next_fast_len(series.shape[-1] + 2 * length)
    pulse, windowed = _spectra(replica, rate, size, window)
    gain = np.sum(pulse * np.conj(windowed)) * rate / size
    if not abs(gain) > 0:
        raise ValueError("replica has no energy in the band of the series; give the transmitted pulse")
    bins = scipy.fft.fft(series.astype(np.complex64, copy=False), size, axis=-1)
    bins *= (np.conj(windowed) / gain).astype(np.complex64)
    return np.asarray(scipy.fft.ifft(bins, axis=-1)[..., : series.shape[-1]], np.complex64)


def _samples(replica: Pulse | ArrayLike, rate: float) -> int:
    if isinstance(replica, Pulse):
        return int(np.ceil(replica.duration * rate)) + 8
    given = np.asarray(replica)
    if given.ndim != 1 or given.size < 1 or given.dtype.kind not in "cfiu":
        raise ValueError(f"replica has shape {given.shape}; give a Pulse, or one row of its baseband samples")
    return int(given.size)


def _spectra(replica: Pulse | ArrayLike, rate: float, size: int, window: str) -> tuple[Complexes, Complexes]:
    """Fourier transforms of the pulse and of the windowed pulse, in the series' bins [s], each (size,)."""
    if not isinstance(replica, Pulse):
        given = np.asarray(replica, complex)
        position = np.asarray((np.arange(given.size) + 0.5) / given.size - 0.5, float)
        rows = [given, given * taper("window", window, position)]
        pulse, windowed = (scipy.fft.fft(row, size) / rate for row in rows)
        return pulse, windowed
    pulse = spectrum(replica, scipy.fft.fftfreq(size, 1 / rate))
    if window == "uniform":
        return pulse, pulse
    count = int(np.ceil(replica.duration * rate * _FINER)) + 1
    time = np.asarray(np.arange(count) * (replica.duration / (count - 1)), float)
    fine = envelope(replica, time) * taper("window", window, time / replica.duration - 0.5)
    fine[[0, -1]] *= 0.5  # the trapezium rule
    return pulse, _transform(fine, time, scipy.fft.fftfreq(size, 1 / rate))


def _transform(values: Complexes, time: NDArray[np.float64], frequency: NDArray[np.float64]) -> Complexes:
    """Integral of values exp(-j 2 pi f t) dt at evenly spaced frequencies [s], shape (frequency,)."""
    from scipy.signal import czt

    step, bins = time[1] - time[0], np.fft.fftshift(frequency)
    width = bins[1] - bins[0]
    out = czt(values, bins.size, np.exp(-2j * np.pi * width * step), np.exp(2j * np.pi * bins[0] * step))
    return np.asarray(np.fft.ifftshift(out) * step)
