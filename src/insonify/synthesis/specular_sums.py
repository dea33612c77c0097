"""Sums of the interfering arrivals of one smooth target, accumulated block by block and squared at the end.

The facets of a target are processed in blocks, which bounds the memory of a ping. Interfering arrivals are
summed as pressures until the last block is complete. Each sum holds the cells of the times that the
target's arrivals reach, and no others.
"""

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.received_pulse import ReceivedPulse
from insonify.synthesis._gridding import deposit_pressure
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis.time_grid import OVERSAMPLING, TimeGrid, convolve_pulse, time_grid

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
PAGE = 64
"""Number of samples to a multiple of which extents are rounded: few distinct lengths of transforms."""


@dataclass(slots=True)
class _PressureSum:
    """Pressures on the cells of a range of samples."""

    first_sample: int
    """Number of the first sample, from the start of the time grid's window; may be negative."""
    cells: NDArray[np.complex64]
    """Grid of pressures [uPa], `OVERSAMPLING` cells to a sample, shape (channels, cells)."""

    def extended(self, first: int, stop: int) -> "_PressureSum":
        """Copy extended to samples from `first` to before `stop`."""
        last = self.first_sample + self.cells.shape[1] // OVERSAMPLING
        if first >= self.first_sample and stop <= last:
            return self
        low, high = min(first, self.first_sample), max(stop, last)
        cells = np.zeros((len(self.cells), (high - low) * OVERSAMPLING), np.complex64)
        begin = (self.first_sample - low) * OVERSAMPLING
        cells[:, begin : begin + self.cells.shape[1]] = self.cells
        return _PressureSum(low, cells)


@dataclass(slots=True)
class SpecularSums:
    """Sums of arrivals of one target that interfere, each with the weight of its power."""

    grid: TimeGrid
    pulse: ReceivedPulse
    object_name: str = ""
    sums: dict[Hashable, tuple[float, _PressureSum]] = field(default_factory=dict)
    """Weight of the power of each sum [1], and the sum."""

    def add(self, key: Hashable, power_fraction: float, delay: Floats, weight: Complexes) -> None:
        """Add arrivals to one sum.

        Args:
            key: Key of the sum.
            power_fraction: Weight of its power [1].
            delay: Delay of each arrival [s], shape (n,).
            weight: Complex weight in each channel, carrier phase included [uPa], shape (channels, n).
        """
        rate = self.grid.sample_rate
        sample = (delay - self.grid.start) * rate
        with np.errstate(invalid="ignore"):
            received = (
                (sample > -self.grid.lead_samples) & (sample < self.grid.padded_samples) & (weight != 0).any(axis=0)
            )
        if not received.any():
            return
        delay, weight, sample = delay[received], weight[:, received], sample[received]
        first = int(np.floor(sample.min() / PAGE)) * PAGE - CELLS_PER_SPIKE
        stop = int(np.ceil(sample.max() / PAGE)) * PAGE + CELLS_PER_SPIKE
        if key not in self.sums:
            self.sums[key] = (
                power_fraction,
                _PressureSum(first, np.zeros((len(weight), (stop - first) * OVERSAMPLING), np.complex64)),
            )
        pressures = self.sums[key][1].extended(first, stop)
        self.sums[key] = power_fraction, pressures
        delays = np.ascontiguousarray(delay)
        for row, channel in zip(pressures.cells, weight, strict=True):
            deposit_pressure(
                row, self.grid.start + pressures.first_sample / rate, self.grid.cell_rate, delays,
                np.ascontiguousarray(channel, np.complex64),
            )  # fmt: skip

    def flush_specular(self, intensity: Floats) -> None:
        """Add the power of all sums to an intensity [uPa^2], shape (channels, samples), and clear them."""
        rate = self.grid.sample_rate
        lead, tail = (int(np.ceil(abs(side) * rate)) + 1 for side in self.pulse.table_interval)
        for fraction, pressures in self.sums.values():
            last = pressures.first_sample + pressures.cells.shape[1] // OVERSAMPLING
            begin, end = max(pressures.first_sample - lead, 0), min(last + tail, self.grid.sample_count)
            if end <= begin:
                continue
            end = min(
                begin + -(-(end - begin) // PAGE) * PAGE, self.grid.sample_count
            )  # few distinct transform lengths
            part = time_grid(
                self.grid.start + begin / rate, self.grid.start + end / rate, rate, *self.pulse.table_interval
            )
            cells = part.cells(len(intensity))
            offset = (pressures.first_sample - begin + part.lead_samples) * OVERSAMPLING
            low, high = max(offset, 0), min(offset + pressures.cells.shape[1], cells.shape[1])
            cells[:, low:high] = pressures.cells[:, low - offset : high - offset]
            series = convolve_pulse(cells, part, _spectrum(self.pulse, part))
            intensity[:, begin:end] += fraction * (series.real.astype(float) ** 2 + series.imag.astype(float) ** 2)
        self.sums.clear()


@lru_cache(maxsize=64)
def _spectrum(pulse: ReceivedPulse, grid: TimeGrid) -> Complexes:
    """Spectrum of a pulse on a grid."""
    spectrum = pulse.spectrum(grid.frequencies)
    spectrum.flags.writeable = False  # shared by all pings
    return spectrum
