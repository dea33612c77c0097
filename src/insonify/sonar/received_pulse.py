"""Received pulse: the transmitted waveform after the receiver's filter and, if there is one, its matched filter.

An echo of unit rms pressure and zero delay leaves this waveform in the recording. Coherent pressure and expected
intensity of a ping use the same object.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.fourier import fast_length
from insonify.sonar.modulation import Complexes
from insonify.sonar.pulse import Pulse, energy_duration
from insonify.sonar.pulse import spectrum as pulse_spectrum
from insonify.sonar.receiver import Receiver, response
from insonify.sonar.sonar import Sonar

OVERSAMPLING = 32
"""Points of the waveform's table per output sample; cubic Hermite error (pi / 32)^4 / 384 = 2.4e-7 of the peak."""
RINGING = 400.0
"""Duration on each side of the pulse for the filter's ringing [1 / bandwidth]; the ringing falls as time^-3."""
TAIL_ENERGY = 1e-6
"""Fraction of the energy outside `ReceivedPulse.start` to `stop` [1]."""
RINGING_ENERGY = 1e-10
"""Fraction of the energy outside `ReceivedPulse.ringing_start` to `ringing_stop` [1], for a window cut out of a longer
recording."""


@dataclass(frozen=True, slots=True, eq=False)
class ReceivedPulse:
    """Waveform that an echo of unit rms pressure and zero delay leaves in the recording; times are re the delay.

    Example:
        >>> pulse = Pulse(kind="lfm", frequency="100 kHz", bandwidth="20 kHz", duration="2 ms")
        >>> compressed = receive_pulse(pulse, Receiver(bandwidth="40 kHz", matched_filter=True))
        >>> f"peak {compressed.peak:.2f}, resolution {compressed.finest_resolution(1500.0) * 100:.2f} cm"
        'peak 1.00, resolution 3.75 cm'
    """

    pulse: Pulse
    receiver: Receiver
    start: float
    """Time before which the waveform has half of `TAIL_ENERGY` or less [s]; negative when filtered."""
    stop: float
    """Time after which the waveform has half of `TAIL_ENERGY` or less [s]."""
    ringing_start: float
    """Time before which the filter's ringing has half of `RINGING_ENERGY` [s]."""
    ringing_stop: float
    """Time after which the filter's ringing has half of `RINGING_ENERGY` [s]."""
    effective_duration: float
    """Integral of the squared magnitude [s], to which mean reverberation is proportional."""
    out_of_band_energy: float
    """Fraction of the transmitted energy that the receiver's band does not pass [1]."""
    peak: float
    """Largest magnitude [1]."""
    table_start: float = field(repr=False)
    """Time of the table's first row [s]."""
    table_rate: float = field(repr=False)
    """Rows of the table per second [Hz]."""
    table: Complexes = field(repr=False)
    """Waveform [1] and its slope per row [1], shape (rows, 2)."""

    def spectrum(self, offset: ArrayLike, doppler: float = 0.0) -> Complexes:
        """Fourier transform of the waveform [s].

        Args:
            offset: Frequency relative to the centre [Hz], any shape.
            doppler: Relative compression of the echo in time, d(emission time) / d(arrival time) - 1 [1].

        Returns:
            P(f) H(f), or with a matched filter P(f) P0(f)* H(f) / E, P0 the transmitted pulse; shape of `offset`.
        """
        return _received_spectrum(self.pulse, self.receiver, np.asarray(offset, dtype=float), doppler)

    def samples(self, time: ArrayLike) -> Complexes:
        """The waveform at any times [1].

        Args:
            time: Time since the echo's delay [s], any shape.

        Returns:
            Band-limited complex waveform, within 1e-6 of its peak, shape of time.
        """
        x = (np.asarray(time, dtype=float) - self.table_start) * self.table_rate
        inside = (x >= 0) & (x < len(self.table) - 1)
        row = np.where(inside, x, 0.0).astype(np.int64)
        t = np.where(inside, x - row, 0.0)
        before, after = self.table[row], self.table[row + 1]
        p, m, q, n = before[..., 0], before[..., 1], after[..., 0], after[..., 1]
        cubic = p + t * (m + t * (3 * (q - p) - 2 * m - n + t * (2 * (p - q) + m + n)))
        return np.asarray(np.where(inside, cubic, 0.0))

    def doppler_filtered(
        self, doppler: float, weight: Callable[[NDArray[np.float64]], NDArray[Any]]
    ) -> "ReceivedPulse":
        """Waveform of a Doppler-compressed echo, with a weighting of its spectrum; only for `samples`.

        Args:
            doppler: Relative increase of the echo's frequencies, as for `spectrum` [1].
            weight: Weight of the spectrum as a function of the offset from the carrier [Hz], shape of the offset [1].
        """
        first, period = _span(self.pulse, self.receiver)
        bins = int(self.receiver.sample_rate / 2 * period)
        offset = np.arange(-bins, bins + 1) / period
        return replace(self, table=_table(offset, self.spectrum(offset, doppler) * weight(offset), first, period))

    @property
    def table_interval(self) -> tuple[float, float]:
        """First and last time of waveform and ringing [s]: a periodic record of them may be this short."""
        return self.table_start, self.table_start + len(self.table) / self.table_rate

    @property
    def resolution_time(self) -> float:
        """Duration of a rectangle with this peak and this energy [s].

        The pulse's energy duration for a tone, 1 / bandwidth for a compressed sweep.
        """
        # ripples of the filter lift the peak above one, but do not sharpen the pulse
        return self.effective_duration / min(self.peak, 1.0) ** 2

    def finest_resolution(self, sound_speed: float) -> float:
        """Range resolution of the recording after pulse compression, now or later [m].

        Args:
            sound_speed: Sound speed [m/s].
        """
        # frequencies outside the receiver's band are not in the recording
        band = min(self.pulse.bandwidth, self.receiver.sample_rate)
        compressed = 1 / band if band > 0 else np.inf
        return sound_speed / 2 * float(min(self.resolution_time, compressed))


def received_pulse(sonar: Sonar) -> ReceivedPulse:
    """Received pulse of a sonar: the waveform that an echo of unit rms pressure leaves in the recording.

    Args:
        sonar: The sonar; only its pulse and receiver matter.

    Source: matched filter normalised by the pulse's energy E = integral |p|^2, so that an echo of
    rms pressure p peaks at p; Turin (1960), IRE Trans. Inf. Theory 6(3), 311-329.

    Example:
        >>> pulse, point = Pulse(frequency="100 kHz", duration="1 ms"), PointTransducer()
        >>> sonar = Sonar(source_level_db="200 dB", pulse=pulse, transmit=point, receive=point)
        >>> f"range resolution {received_pulse(sonar).finest_resolution(1500.0):.2f} m"
        'range resolution 0.70 m'
    """
    return receive_pulse(sonar.pulse, sonar.receiver)


@lru_cache(maxsize=8)  # checks, warnings and the simulator of one sonar use the same
def receive_pulse(pulse: Pulse, receiver: Receiver) -> ReceivedPulse:
    """Received pulse of a transmitted pulse and a receiver.

    Example:
        >>> echo = receive_pulse(Pulse(frequency="100 kHz", duration="1 ms"), Receiver(bandwidth="20 kHz"))
        >>> f"{np.abs(echo.samples(0.5e-3)):.2f}"
        '1.00'
    """
    first, period = _span(pulse, receiver)
    bins = int(receiver.sample_rate / 2 * period)
    offset = np.arange(-bins, bins + 1) / period
    spectrum = _received_spectrum(pulse, receiver, offset)
    passed_spectrum = np.abs(pulse_spectrum(pulse, offset) * response(receiver, offset)) ** 2
    table = _table(offset, spectrum, first, period)
    rate = len(table) / period
    magnitude = np.abs(table[:, 0])
    start, stop = _support(magnitude**2, TAIL_ENERGY)
    ringing_start, ringing_stop = _support(magnitude**2, RINGING_ENERGY)
    return ReceivedPulse(
        pulse=pulse, receiver=receiver, start=first + start / rate, stop=first + stop / rate,
        ringing_start=first + ringing_start / rate, ringing_stop=first + ringing_stop / rate,
        effective_duration=float(np.sum(np.abs(spectrum) ** 2) / period),
        out_of_band_energy=max(0.0, 1 - float(np.sum(passed_spectrum)) / period / energy_duration(pulse)),
        peak=float(magnitude.max()), table_start=first, table_rate=rate, table=table,
    )  # fmt: skip


def _received_spectrum(
    pulse: Pulse, receiver: Receiver, offset: NDArray[np.float64], doppler: float = 0.0
) -> Complexes:  # fmt: skip
    """Fourier transform of the waveform [s], as `ReceivedPulse.spectrum`."""
    echo = pulse_spectrum(pulse, (offset - doppler * pulse.frequency) / (1 + doppler)) / (1 + doppler)
    if receiver.matched_filter:
        replica = echo if doppler == 0 else pulse_spectrum(pulse, offset)
        echo = np.asarray(echo * np.conj(replica) / energy_duration(pulse) + 0j)
    return np.asarray(echo * response(receiver, offset))


def _span(pulse: Pulse, receiver: Receiver) -> tuple[float, float]:
    """Start and duration of the interval that contains the waveform and its ringing [s]."""
    ringing = RINGING / receiver.bandwidth
    first = -ringing - (pulse.duration if receiver.matched_filter else 0.0)
    return first, pulse.duration + ringing - first


def _table(offset: NDArray[np.float64], spectrum: Complexes, first: float, period: float) -> Complexes:
    """Waveform and its slope per row [1], shape (rows, 2): inverse transform of a band-limited spectrum."""
    rows = fast_length(OVERSAMPLING * len(offset))
    bins = np.round(offset * period).astype(np.int64)
    transform = np.zeros((2, rows), dtype=complex)
    transform[0, bins] = spectrum * np.exp(2j * np.pi * offset * first) * rows / period
    transform[1, bins] = transform[0, bins] * 2j * np.pi * offset * period / rows
    return np.ascontiguousarray(np.fft.ifft(transform, axis=1).T)


def _support(energy: NDArray[np.float64], tail: float) -> tuple[int, int]:
    """First and last row of the interval outside which a fraction `tail` of the energy lies, rounded outwards."""
    # summed from either end: a fraction of 1e-10 would be lost in the rounding of the total
    before, after = np.cumsum(energy), np.cumsum(energy[::-1])
    first, last = (int(np.searchsorted(part, tail / 2 * before[-1])) for part in (before, after))
    return max(first - 1, 0), min(len(energy) - last, len(energy) - 1)
