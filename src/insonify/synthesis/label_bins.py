"""Bins of delay in which labels collect energies and positions, and their convolution with the pulse."""

from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.received_pulse import ReceivedPulse
from insonify.synthesis._position_kernel import smear_energies
from insonify.synthesis.incoherent import IncoherentAccumulator

Floats = NDArray[np.float64]
SIGNIFICANT = 1e-6
"""Intensity of a pulse re its maximum below which it interferes with no other [1]."""
ROUNDING = 1e-6
"""Fraction of a sample interval by which lags may lie outside the pulse [1]."""


class BinGrid(NamedTuple):
    """Bins over two-way delay, from the first to the last echo that contributes to a sample."""

    start: float
    """Delay of the first bin [s]."""
    rate: float
    """Bins per second [Hz]."""
    size: int
    """Number of bins [1]."""
    per_sample: int
    """Bins in a sample [1]."""
    samples: int
    """Output samples in a bin; this or `per_sample` is 1 [1]."""


def bin_grid(accumulator: IncoherentAccumulator, least_bins: float = 0.0, most_per_sample: int = 1) -> BinGrid:
    """Bins of energy and position of a ping: their number per sample, or samples per bin, is a power of two.

    Args:
        accumulator: Incoherent accumulator of the ping.
        least_bins: Least number of bins over the equivalent duration of the pulse [1]; 0: one per sample.
        most_per_sample: Largest number of bins per sample, which takes precedence [1].
    """
    grid = accumulator.grid
    lead, tail = _ringing(accumulator.ping_geometry.pulse, grid.sample_rate)
    ratio = least_bins / (accumulator.pulse_duration * grid.sample_rate) if least_bins else 1.0
    octaves = int(np.ceil(np.log2(ratio)))
    per_sample, samples = min(2 ** max(octaves, 0), most_per_sample), 2 ** max(-octaves, 0)
    size = (-(-(grid.sample_count + lead + tail) // samples) + 1) * per_sample
    return BinGrid(
        grid.start - lead / grid.sample_rate, grid.sample_rate * per_sample / samples, size, per_sample, samples
    )


@lru_cache(maxsize=4)
def _ringing(pulse: ReceivedPulse, rate: float) -> tuple[int, int]:
    """Number of samples of the pulse after, and before, an echo's delay; cached, as the extent is slow to compute."""
    return max(0, int(np.ceil(pulse.stop * rate))), max(0, int(np.ceil(-pulse.start * rate)))


def pulse_energy(accumulator: IncoherentAccumulator, grid: BinGrid) -> Floats:
    """Squared envelope of a ping's pulse at the lags of the bins that contribute to the samples of one bin [1].

    Intensity sample r + `grid.samples` q is the sum over k of row r at k times energy of bin k + `grid.per_sample` q.

    Returns:
        Weights of bins, shape (`grid.samples`, lags).
    """
    return _pulse_energy(accumulator.ping_geometry.pulse, accumulator.grid.sample_rate, grid)


@lru_cache(maxsize=4)
def _pulse_energy(pulse: ReceivedPulse, rate: float, grid: BinGrid) -> Floats:
    """Squared envelope of a pulse at the lags of bins; cached, as its samples are slow to compute."""
    lead, tail = _ringing(pulse, rate)
    bins = np.arange(-(-(lead + tail + grid.samples - 1) // grid.samples) * grid.per_sample + 1)
    lag = (lead + np.arange(grid.samples)[:, None]) / rate - bins / grid.rate
    within = (lag >= -(tail + ROUNDING) / rate) & (lag <= (lead + ROUNDING) / rate)
    energy = np.where(within, np.abs(pulse.samples(lag)) ** 2, 0.0)
    energy.flags.writeable = False  # shared by all pings
    return energy


def significant_duration(accumulator: IncoherentAccumulator, grid: BinGrid) -> float:
    """Duration of a ping's pulse down to `SIGNIFICANT` of its maximum [s]."""
    energy = pulse_energy(accumulator, grid)
    return int(np.ptp(np.flatnonzero((energy > SIGNIFICANT * energy.max()).any(axis=0))) + 1) / grid.rate


def smeared(energies: Iterable[NDArray[Any]], pulse: Floats, grid: BinGrid, shape: tuple[int, int]) -> Floats:
    """Intensities [uPa^2] from energies of bins, convolved with the pulse.

    Args:
        energies: Energies of k sums in bins [uPa^2], each of shape (channels, bins).
        pulse: Weights of bins, from `pulse_energy`.
        grid: The bins.
        shape: Number of channels, and of samples.

    Returns:
        Shape (k, channels, samples).
    """
    rows = list(energies)
    series = np.zeros((len(rows), *shape))
    for values, row in zip(rows, series, strict=True):
        smear_energies(values, pulse, grid.per_sample, row)
    return series
