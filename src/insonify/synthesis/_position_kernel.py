"""Energies and positions of seabed samples by delay, and their convolution with the pulse. Plain numbers and arrays.

Bins are those of `_label_kernel`: energy, then energy times north, east, down re the receiver, and times grazing angle.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._fast_reverberation_energies import BLOCK, DelayCells, WeightedSamples, fill_pair_energies

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Integers = NDArray[Any]


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_positions(
    grid: DelayCells, delay: Floats, energy: Floats, points: Integers, position: Floats, out: Singles, back: Singles,
    receiver: Floats,
) -> None:  # fmt: skip
    """Add energies, and energies times positions, to the two bins beside each delay.

    Args:
        grid: Bins, (bins, MOMENTS).
        delay: Two-way delay [s], (m,).
        energy: Energies [uPa^2], (m,).
        points: Index of the point of each, (m,).
        position: North, east, depth of the points [m], (3, n).
        out: Grazing angle of the transmit legs at the points [rad], (n,).
        back: Grazing angle of the receive legs at the points [rad], (n,).
        receiver: North, east, depth of the receiver [m], (3,).
    """
    bins, start, rate = grid
    last = bins.shape[0] - 1
    for k in range(delay.size):
        at = (delay[k] - start) * rate
        if not (energy[k] > 0 and 0 <= at < last):
            continue
        n, b = points[k], int(at)
        north, east, down = position[0, n] - receiver[0], position[1, n] - receiver[1], position[2, n] - receiver[2]
        grazing = 0.5 * (np.float64(out[n]) + back[n])
        more = (at - b) * energy[k]
        less = energy[k] - more
        one, two = bins[b], bins[b + 1]
        one[0] += less
        one[1] += less * north
        one[2] += less * east
        one[3] += less * down
        one[4] += less * grazing
        two[0] += more
        two[1] += more * north
        two[2] += more * east
        two[3] += more * down
        two[4] += more * grazing


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_pair_positions(
    samples: WeightedSamples, grid: DelayCells, position: Floats, grazing: Singles, receiver: Floats
) -> None:
    """Deposit energies and positions of all pairs; energies are those of `deposit_pair_energies`.

    Args:
        samples: The samples.
        grid: Bins, (p, bins, MOMENTS).
        position: North, east, depth of the points [m], (3, n).
        grazing: Grazing angles of the legs at the points [rad], (f, n).
        receiver: North, east, depth of the receiver [m], (3,).
    """
    late, energy = np.empty((2, BLOCK))
    for p in range(samples.pair.shape[0]):
        own = DelayCells(grid.cells[p], grid.first_time, grid.rate)
        out, back = grazing[samples.pair[p, 0]], grazing[samples.pair[p, 1]]
        for begin in range(0, samples.point_count[p], BLOCK):
            m = min(BLOCK, samples.point_count[p] - begin)
            some = samples.rows[p, begin : begin + m]
            fill_pair_energies(samples, p, some, begin, late, energy)
            deposit_positions(own, late[:m], energy[:m], some, position, out, back, receiver)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def smear_energies(bins: NDArray[Any], pulse: Floats, per_sample: int, out: Floats) -> None:
    """Convolve energies with a pulse, added to samples: sums over the bins that contribute to each.

    Args:
        bins: Energies by delay, (channels, bins).
        pulse: Energy of the pulse at the lag of each bin, for some successive samples [1], (phases, lags).
        per_sample: Bins from one sample, of each phase, to the next.
        out: Result, added to in place, (channels, samples).
    """
    phases, size = pulse.shape[0], bins.shape[1] // per_sample
    energy, series = np.zeros(size), np.empty(-(-out.shape[1] // phases))
    for channel in range(bins.shape[0]):
        first, last = bins.shape[1], 0
        for k in range(bins.shape[1]):
            if bins[channel, k] != 0:
                first, last = min(first, k), k + 1
        if last == 0:
            continue
        begin, end = first // per_sample, min(-(-last // per_sample), size)
        for phase in range(phases):
            series[:] = 0.0
            for part in range(per_sample):
                for k in range(begin, end):
                    energy[k] = bins[channel, k * per_sample + part]
                for k in range(part, pulse.shape[1], per_sample):
                    if pulse[phase, k] > 0.0:
                        shift = k // per_sample
                        to, until = max(begin - shift, 0), min(end - shift, series.size)
                        _add_multiple(series[to:until], pulse[phase, k], energy[to + shift : until + shift])
            for n in range((out.shape[1] - phase + phases - 1) // phases):
                out[channel, n * phases + phase] += series[n]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _add_multiple(series: Floats, weight: float, energy: Floats) -> None:
    """Add a multiple of one array to another of the same size."""
    for n in range(min(series.size, energy.size)):
        series[n] += weight * energy[n]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def smear_positions(
    bins: Singles, pulse: Floats, per_sample: int, strongest: Integers, number: int, out: Floats
) -> None:  # fmt: skip
    """Mean position of the contributions to the samples of one contribution, weighted by energy.

    Args:
        bins: Energies and positions of the contribution by delay, (channels, bins, MOMENTS).
        pulse: Energy of the pulse at the lag of each bin, for some successive samples [1], (phases, lags).
        per_sample: Bins from one sample, of each phase, to the next.
        strongest: Number of the contribution that each sample is of, (channels, samples).
        number: Number of this one.
        out: Result, the samples of other contributions unchanged, (MOMENTS - 1, channels, samples).
    """
    phases = pulse.shape[0]
    for channel in range(strongest.shape[0]):
        for m in range(strongest.shape[1]):
            if strongest[channel, m] != number:
                continue
            energy, north, east, down, grazing = 0.0, 0.0, 0.0, 0.0, 0.0
            first, weights = m // phases * per_sample, pulse[m % phases]
            for k in range(min(weights.size, bins.shape[1] - first)):
                row, part = bins[channel, first + k], weights[k]
                energy += part * row[0]
                north += part * row[1]
                east += part * row[2]
                down += part * row[3]
                grazing += part * row[4]
            means = out[:, channel, m]
            means[0], means[1], means[2] = north / energy, east / energy, down / energy
            means[3] = grazing / energy


@njit(cache=True, nogil=True, error_model="numpy")
def largest_rows(values: Floats, counts: NDArray[np.bool_], none: int, largest: Integers) -> None:
    """Row of the largest value of each sample, the first of equals.

    Args:
        values: Values, (channels, rows, samples).
        counts: False: a sample of no row, (channels, samples).
        none: Number of no row.
        largest: Result, (channels, samples).
    """
    best = np.empty(values.shape[2])
    for c in range(values.shape[0]):
        best[:], largest[c] = values[c, 0], 0
        for k in range(1, values.shape[1]):
            for n in range(best.size):
                if values[c, k, n] > best[n]:
                    best[n], largest[c, n] = values[c, k, n], k
        for n in range(best.size):
            if not counts[c, n]:
                largest[c, n] = none


@njit(cache=True, nogil=True, error_model="numpy")
def take_stronger(
    value: Floats, own: Integers, row: int, number: int, highest: Floats, strongest: Integers
) -> None:  # fmt: skip
    """Give one contribution the samples of its object in which it is stronger than those before.

    Args:
        value: Energies of the contribution, (channels, samples).
        own: Row of the object of each sample, (channels, samples).
        row: Row of the contribution's object.
        number: Number of the contribution.
        highest: Energy of the strongest so far, changed in place, (channels, samples).
        strongest: Its number, changed in place, (channels, samples).
    """
    for c in range(value.shape[0]):
        for n in range(value.shape[1]):
            if own[c, n] == row and value[c, n] > highest[c, n]:
                highest[c, n], strongest[c, n] = value[c, n], number
