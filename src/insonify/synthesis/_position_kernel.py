"""Energies and positions of seabed samples by delay, and their convolution with the pulse. Plain numbers and arrays.

Bins are those of `_label_kernel`: energy, then energy times north, east, down re the receiver, and times grazing angle.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._fast_reverberation_energies import BLOCK, DelayCells, WeightedSamples, fill_pair_energies
from insonify.synthesis._gridding import deposit_energy

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Integers = NDArray[Any]
RUN_LENGTH = 128
"""Samples of each phase that are convolved at once: few enough for the first-level cache."""
MIN_RUN_SAMPLES = 32
"""Samples of a run below which each is convolved alone, which is faster."""


class SamplePositions(NamedTuple):
    """Mean positions of the echoes in each sample, weighted by energy."""

    position: Floats
    """North, east, depth [m], (channels, samples, 3)."""
    distance: Floats
    """Distance from the receiver [m], (channels, samples)."""
    grazing: Floats
    """Grazing angle [rad], (channels, samples)."""


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_positions(
    grid: DelayCells, delay: Floats, energy: Floats, points: Integers, position: Floats, transmit_grazing: Singles,
    receive_grazing: Singles, receiver: Floats,
) -> None:  # fmt: skip
    """Add energies, and energies times positions, to the two bins about each delay.

    Args:
        grid: Bins, (bins, MOMENTS).
        delay: Two-way delay [s], (m,).
        energy: Energies [uPa^2], (m,).
        points: Index of the point of each energy, (m,).
        position: North, east, depth of the points [m], (3, n).
        transmit_grazing: Grazing angle of the transmit legs at the points [rad], (n,).
        receive_grazing: Grazing angle of the receive legs at the points [rad], (n,).
        receiver: North, east, depth of the receiver [m], (3,).
    """
    bins, start, rate = grid
    last, half = bins.shape[0] - 1, np.float32(0.5)
    for k in range(delay.size):
        at = (delay[k] - start) * rate
        if not (energy[k] > 0 and 0 <= at < last):
            continue
        n, b = points[k], np.uintp(at)
        north, east = np.float32(position[0, n] - receiver[0]), np.float32(position[1, n] - receiver[1])
        down, grazing = np.float32(position[2, n] - receiver[2]), half * (transmit_grazing[n] + receive_grazing[n])
        share = (at - b) * energy[k]
        second, first_energy, second_energy = b + np.uintp(1), np.float32(energy[k] - share), np.float32(share)
        bins[b, 0] += first_energy
        bins[b, 1] += first_energy * north
        bins[b, 2] += first_energy * east
        bins[b, 3] += first_energy * down
        bins[b, 4] += first_energy * grazing
        bins[second, 0] += second_energy
        bins[second, 1] += second_energy * north
        bins[second, 2] += second_energy * east
        bins[second, 3] += second_energy * down
        bins[second, 4] += second_energy * grazing


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_pair_positions(
    samples: WeightedSamples, energies: DelayCells, grid: DelayCells, position: Floats, grazing: Singles,
    receiver: Floats,
) -> None:  # fmt: skip
    """Deposit energies and positions of all pairs, and the energies alone as `deposit_pair_energies` does.

    Args:
        samples: The samples.
        energies: Cells of the energy grid, (cells,); empty: not deposited there.
        grid: Bins, (p, bins, MOMENTS).
        position: North, east, depth of the points [m], (3, n).
        grazing: Grazing angles of the legs at the points [rad], (f, n).
        receiver: North, east, depth of the receiver [m], (3,).
    """
    pair_delay, energy = np.empty(BLOCK), np.empty(BLOCK)
    for p in range(samples.pair.shape[0]):
        pair_bins = DelayCells(grid.cells[p], grid.first_time, grid.rate)
        first_grazing, second_grazing = grazing[samples.pair[p, 0]], grazing[samples.pair[p, 1]]
        for begin in range(0, samples.point_count[p], BLOCK):
            m = min(BLOCK, samples.point_count[p] - begin)
            points = samples.rows[p, begin : begin + m]
            fill_pair_energies(samples, p, points, begin, pair_delay, energy)
            if energies.cells.size:
                deposit_energy(energies.cells, energies.first_time, energies.rate, pair_delay[:m], energy[:m])
            deposit_positions(
                pair_bins, pair_delay[:m], energy[:m], points, position, first_grazing, second_grazing, receiver
            )


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_energies_in_bins(grid: DelayCells, delay: Floats, energy: Floats) -> None:
    """Add energies to the two bins about each delay, without positions: bit-identical to `deposit_positions`.

    Args:
        grid: Bins of energy alone, (bins,).
        delay: Two-way delay [s], (m,).
        energy: Energies [uPa^2], (m,).
    """
    bins, start, rate = grid
    last = bins.size - 1
    for k in range(delay.size):
        at = (delay[k] - start) * rate
        if not (energy[k] > 0 and 0 <= at < last):
            continue
        b = np.uintp(at)
        share = (at - b) * energy[k]
        bins[b] += np.float32(energy[k] - share)
        bins[b + np.uintp(1)] += np.float32(share)


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_pair_energies_in_bins(samples: WeightedSamples, energies: DelayCells, grid: DelayCells) -> None:
    """Deposit energies of all pairs as `deposit_pair_positions` does, without positions.

    Args:
        samples: The samples.
        energies: Cells of the energy grid, (cells,); empty: not deposited there.
        grid: Bins of energy alone, (p, bins).
    """
    pair_delay, energy = np.empty(BLOCK), np.empty(BLOCK)
    for p in range(samples.pair.shape[0]):
        pair_bins = DelayCells(grid.cells[p], grid.first_time, grid.rate)
        for begin in range(0, samples.point_count[p], BLOCK):
            m = min(BLOCK, samples.point_count[p] - begin)
            fill_pair_energies(samples, p, samples.rows[p, begin : begin + m], begin, pair_delay, energy)
            if energies.cells.size:
                deposit_energy(energies.cells, energies.first_time, energies.rate, pair_delay[:m], energy[:m])
            deposit_energies_in_bins(pair_bins, pair_delay[:m], energy[:m])


@njit(cache=True, nogil=True, error_model="numpy")
def smear_energies(bins: NDArray[Any], pulse: Floats, per_sample: int, out: Floats) -> None:
    """Convolve energies with a pulse, added to samples: sums over the bins that contribute to each.

    A phase is the number of a sample within a bin that holds several samples; otherwise there is one phase.

    Args:
        bins: Energies by delay [uPa^2], (channels, bins).
        pulse: Weights of bins from `label_bins.pulse_energy` [1], (phases, lags).
        per_sample: Number of bins from one sample to the next of the same phase.
        out: Intensities [uPa^2], added to in place, (channels, samples).
    """
    phases, series = pulse.shape[0], np.empty((pulse.shape[0], RUN_LENGTH))
    for channel in range(bins.shape[0]):
        for begin in range(0, -(-out.shape[1] // phases), RUN_LENGTH):
            if not _smear_run(bins[channel], pulse, per_sample, begin, series):
                continue
            for phase in range(phases):
                samples = out[channel, begin * phases + phase :: phases]
                for n in range(min(RUN_LENGTH, samples.size)):
                    samples[n] += series[phase, n]


@njit(cache=True, nogil=True, error_model="numpy")
def _smear_run(bins: NDArray[Any], pulse: Floats, per_sample: int, begin: int, series: Floats) -> bool:
    """Fill `RUN_LENGTH` samples of every phase with energies convolved with a pulse; False where all energies are 0.

    Args:
        bins: Energies by delay, (bins,).
        pulse: Weights of bins, as for `smear_energies`.
        per_sample: Number of bins from one sample to the next of the same phase.
        begin: Number of the first sample among those of its phase.
        series: Result, (phases, RUN_LENGTH).
    """
    lags = -(-pulse.shape[1] // per_sample)
    energy, any_energy = np.empty(RUN_LENGTH + lags), False
    series[:] = 0.0
    for part in range(per_sample):
        every_nth = bins[begin * per_sample + part :: per_sample]
        count, has_energy = min(energy.size, every_nth.size), False
        for k in range(count):
            energy[k] = every_nth[k]
            has_energy |= energy[k] != 0
        energy[count:] = 0.0
        for phase in range(pulse.shape[0] if has_energy else 0):
            _correlate(energy, pulse[phase, part::per_sample], series[phase])
        any_energy |= has_energy
    return any_energy


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _correlate(values: Floats, weights: Floats, sums: Floats) -> None:
    """Add to sum n the values n + k times weight k, four weights at a time for fewer reads and writes of the sums."""
    whole = weights.size // 4 * 4
    for k in range(0, whole, 4):
        a, b, c, d = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
        one, two, three, four = values[k:], values[k + 1 :], values[k + 2 :], values[k + 3 :]
        for n in range(sums.size):
            sums[n] = sums[n] + a * one[n] + b * two[n] + c * three[n] + d * four[n]
    for k in range(whole, weights.size):
        rest = values[k:]
        for n in range(sums.size):
            sums[n] += weights[k] * rest[n]


@njit(cache=True, nogil=True, error_model="numpy")
def smear_positions(
    bins: Singles, energy: Floats, pulse: Floats, per_sample: int, strongest: Integers, number: int, receiver: Floats,
    means: SamplePositions,
) -> None:  # fmt: skip
    """Fill the mean position of one contribution, weighted by energy, in the samples in which it is the strongest.

    Other samples are left unchanged.

    Args:
        bins: Energies and positions of the contribution by delay, (channels, bins, MOMENTS).
        energy: Intensity of the contribution in each sample, from `smear_energies` [uPa^2], (channels, samples).
        pulse: Weights of bins, as for `smear_energies` [1], (phases, lags).
        per_sample: Number of bins from one sample to the next of the same phase.
        strongest: Number of the strongest contribution to each sample, (channels, samples).
        number: Number of this contribution.
        receiver: North, east, depth of the receiver [m], (3,).
        means: Result.
    """
    position, distance, grazing = means
    phases, moments = pulse.shape[0], np.empty((bins.shape[2] - 1, pulse.shape[0], RUN_LENGTH))
    for channel in range(strongest.shape[0]):
        for begin in range(0, -(-strongest.shape[1] // phases), RUN_LENGTH):
            is_own = strongest[channel, begin * phases : (begin + RUN_LENGTH) * phases] == number
            count = is_own.sum()
            for k in range(len(moments) if count >= MIN_RUN_SAMPLES else 0):
                _smear_run(bins[channel, :, k + 1], pulse, per_sample, begin, moments[k])
            for phase in range(phases):
                for k, m in enumerate(range(phase, is_own.size, phases)):
                    if not is_own[m]:
                        continue
                    if count < MIN_RUN_SAMPLES:
                        _smear_sample(bins[channel], pulse[phase], (begin + k) * per_sample, moments[:, phase, k])
                    n = begin * phases + m
                    sample_energy = energy[channel, n]
                    north, east, down = moments[0, phase, k], moments[1, phase, k], moments[2, phase, k]
                    north, east, down = north / sample_energy, east / sample_energy, down / sample_energy
                    distance[channel, n] = math.sqrt(north**2 + east**2 + down**2)
                    mean = position[channel, n]
                    mean[0], mean[1], mean[2] = north + receiver[0], east + receiver[1], down + receiver[2]
                    grazing[channel, n] = moments[3, phase, k] / sample_energy


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _smear_sample(bins: Singles, pulse: Floats, first: int, moments: Floats) -> None:
    """Fill all moments of one sample but the energy, (MOMENTS - 1,), from the bins from `first` on."""
    north, east, down, grazing = 0.0, 0.0, 0.0, 0.0
    for k in range(min(pulse.size, bins.shape[0] - first)):
        row, weight = bins[first + k], pulse[k]
        north += weight * row[1]
        east += weight * row[2]
        down += weight * row[3]
        grazing += weight * row[4]
    moments[0], moments[1], moments[2], moments[3] = north, east, down, grazing
