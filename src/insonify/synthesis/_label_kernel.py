"""Kernels that deposit energies and energy-weighted positions of paths in bins of delay."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._fast_reverberation_energies import DelayCells
from insonify.synthesis._gridding import _SHIFT
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis._row_energies_kernel import mean_gain_product
from insonify.synthesis._simd_gridding import add_real_spike

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Complexes = NDArray[np.complex128]
MOMENTS = 5
"""Columns of the bins: energy, then energy times north, east, down re the receiver, and times grazing angle."""


class PoweredLegs(NamedTuple):
    """Legs from one end of the sonar to n points, f of them, with their beam."""

    delay: Floats
    """One-way delay [s], (f, n)."""
    power: Floats
    """Squared amplitude of each leg times that of each beam (or of one for all) towards it, (beams, f, n): [uPa^2] of
    transmit legs, [1] of receive legs."""
    grazing: Floats
    """Grazing angle at the point [rad], (f, n)."""


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_label_positions(
    grid: DelayCells, transmit: PoweredLegs, receive: PoweredLegs, pair: NDArray[np.int64], strength: Floats,
    scatterer_position: Floats, receiver: Floats,
) -> None:  # fmt: skip
    """Add energy [uPa^2], and energy times position, of every path to the two bins about its delay.

    Args:
        grid: Bins, (channels, bins, MOMENTS).
        transmit: Transmit legs.
        receive: Receive legs.
        pair: Rows of the transmit and the receive leg, (p, 2).
        strength: Magnitude of the pressure scattered to 1 m re incident [m], (p, n).
        scatterer_position: North, east, depth of each point [m], (n, 3).
        receiver: North, east, depth of the receiver [m], (3,).
    """
    bins, start, rate = grid
    last = bins.shape[1] - 1
    moments = np.empty(MOMENTS)
    for n in range(scatterer_position.shape[0]):
        north, east = scatterer_position[n, 0] - receiver[0], scatterer_position[n, 1] - receiver[1]
        down = scatterer_position[n, 2] - receiver[2]
        moments[0], moments[1], moments[2], moments[3] = 1.0, north, east, down
        for p in range(pair.shape[0]):
            i, j = pair[p, 0], pair[p, 1]
            position = (transmit.delay[i, n] + receive.delay[j, n] - start) * rate
            if not 0 <= position < last:
                continue
            k = math.floor(position)
            fraction = position - k
            moments[4] = (abs(transmit.grazing[i, n]) + abs(receive.grazing[j, n])) / 2
            for channel in range(bins.shape[0]):
                incident = transmit.power[channel % transmit.power.shape[0], i, n]
                energy = incident * receive.power[channel % receive.power.shape[0], j, n] * strength[p, n] ** 2
                if energy > 0:
                    for m in range(MOMENTS):
                        bins[channel, k, m] += (1 - fraction) * energy * moments[m]
                        bins[channel, k + 1, m] += fraction * energy * moments[m]


class LabelledPoints(NamedTuple):
    """Points, n of them, and f legs to each from a monostatic sonar."""

    delay: Floats
    """One-way delay [s], (f, n)."""
    transmit_weight: Complexes
    """Weight of each transmit leg, its beam included [uPa], (f, n)."""
    receive_weight: Complexes
    """Weight of each receive leg, its beam included [1], (f, n)."""
    grazing: Floats
    """Grazing angle at the point [rad], (f, n)."""
    strength: Floats
    """Magnitude of the pressure that p pairs scatter to 1 m re incident [m], (p, n)."""
    position: Floats
    """Position: north, east, depth [m], (n, 3)."""
    row: Floats
    """Row of directions of each receive leg, with fraction, (f, n); 0 where there is one row."""


class LabelGrid(NamedTuple):
    """Cells of energy and bins of position, by delay."""

    first_time: float
    """Delay of the first cell [s]."""
    rate: float
    """Cells per second [Hz]."""
    start: float
    """Delay of the first bin [s]."""
    bin_rate: float
    """Bins per second [Hz]."""
    row_phase: float
    """Phase x of which sin(x) / x is the mean product of gains one row apart: pi times the aperture [wavelengths] times
    the spacing of rows [rad]; 0: one row."""
    uses_energy_grid: bool
    """True: cells are those of the energy grid and hold all energies; False: they have the delays of the bins, and hold
    interference only."""


@njit(cache=True, nogil=True, error_model="numpy")
def _deposit_energy(cells: Floats, p: int, grid: LabelGrid, row: float, delay: float, energy: float) -> None:
    """Add one energy to the cells about its delay in the two adjacent rows; on the energy grid as `deposit_energy`."""
    first = math.floor(row)
    part = row - first
    if grid.uses_energy_grid:
        position = (delay - grid.first_time) * grid.rate - _SHIFT
        if position >= 0.0 and position < cells.shape[2] - CELLS_PER_SPIKE:
            cell = math.floor(position)
            fraction_in_cell = np.float64(np.float32(position - cell - 0.5))
            add_real_spike(cells[first, p], np.intp(cell), fraction_in_cell, (1.0 - part) * energy)
            if part > 0.0:
                add_real_spike(cells[first + 1, p], np.intp(cell), fraction_in_cell, part * energy)
        return
    position = (delay - grid.start) * grid.bin_rate
    if position >= 0.0 and position < cells.shape[2] - 1:
        k = math.floor(position)
        fraction = position - k
        for r, share in ((first, (1.0 - part) * energy), (first + 1, part * energy)):
            if share != 0.0:
                cells[r, p, k] += (1.0 - fraction) * share
                cells[r, p, k + 1] += fraction * share


@njit(cache=True, nogil=True, error_model="numpy")
def _deposit_position(
    bins: Singles, grid: LabelGrid, row: float, delay: float, energy: float, offset: tuple[float, float, float],
    grazing: float,
) -> None:  # fmt: skip
    """Add one energy, and energy times position, to the two bins about its delay in the two adjacent rows.

    Args:
        bins: Bins, (rows, bins, MOMENTS).
        grid: Delays of the bins.
        row: Row of the arrival, with fraction.
        delay: Two-way delay [s].
        energy: Energy [uPa^2].
        offset: North, east, depth of the scatterer re the receiver [m].
        grazing: Mean grazing angle of both legs [rad].
    """
    position = (delay - grid.start) * grid.bin_rate
    if not (energy > 0 and 0 <= position < bins.shape[1] - 1):
        return
    k, first = math.floor(position), math.floor(row)
    fraction, part = position - k, row - first
    for r, whole in ((first, (1.0 - part) * energy), (first + 1, part * energy)):
        if whole > 0.0:
            for bin_number, share in ((k, (1 - fraction) * whole), (k + 1, fraction * whole)):
                moments = bins[r, bin_number]
                moments[0] += share
                moments[1] += share * offset[0]
                moments[2] += share * offset[1]
                moments[3] += share * offset[2]
                moments[4] += share * grazing


class PulseOverlap(NamedTuple):
    """Interference of two replicas of the pulse by their lag."""

    support: float
    """Lag beyond which replicas do not interfere [s]."""
    autocorrelation: NDArray[np.complex64]
    """Autocorrelation of the pulse at lags from 0 on, 1 at 0 [1], (lags,); empty for a long pulse."""
    lag_rate: float
    """Lags per second [Hz]."""


@njit(cache=True, nogil=True, error_model="numpy")
def _interference(overlap: PulseOverlap, early: complex, late: complex, lag: float) -> float:
    """Energy of two interfering replicas beyond the sum of their own [uPa^2], given their weights [uPa] and lag [s]."""
    position = lag * overlap.lag_rate
    cell = min(int(position), overlap.autocorrelation.size - 2)
    low, high = overlap.autocorrelation[cell], overlap.autocorrelation[cell + 1]
    product = early * np.conj(late) * (low + (position - cell) * (high - low))
    return 2.0 * product.real


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_labels(
    points: LabelledPoints, pair: NDArray[np.int64], overlap: PulseOverlap, grid: LabelGrid, receiver: Floats,
    cells: Floats, pair_row: NDArray[np.int64], bins: Singles,
) -> tuple[NDArray[np.int64], Floats, Complexes]:  # fmt: skip
    """Deposit energies and positions of all pairs of legs of some points; a pair and its reverse arrive as one.

    Every pair counts for itself. The interference of two pairs within one pulse counts for the object: deposited half
    way between them for a short pulse, otherwise left to a coherent sum. In bins a pair and its reverse count apart.

    Args:
        points: The points.
        pair: Rows of two legs, the first not above the second, (p, 2).
        overlap: Interference of replicas by their lag.
        grid: Grids of the cells and the bins.
        receiver: North, east, depth of the receiver [m], (3,).
        cells: Energies, added to in place, (rows, q, cells): of each pair, on a fine grid; otherwise the interference
            of a pair with its reverse. Last, where there are two pairs or more, the interference between them, which
            may be negative.
        pair_row: Row of each pair in the second axis of the cells; -1 for none, (p,).
        bins: Energies and positions, added to in place, (rows, p, bins, MOMENTS).

    Returns:
        First of the replicas of each group that is left to a coherent sum, and one past the last, (groups + 1,).
        Delay of each of these replicas [s].
        Weight of each of these replicas [uPa].
    """
    count, point_count, is_short = pair.shape[0], points.delay.shape[1], overlap.autocorrelation.size > 0
    tau, w, interferes = np.empty(count), np.empty(count, np.complex128), np.empty(count, np.bool_)
    row = np.empty(count)
    capacity = 0 if is_short or count < 2 else count * point_count
    first, delays, weight = np.zeros(capacity + 1, np.int64), np.empty(capacity), np.empty(capacity, np.complex128)
    groups, filled = 0, 0  # numbers of groups and of replicas so far
    for n in range(point_count):
        m = 0
        position = points.position[n]
        offset = position[0] - receiver[0], position[1] - receiver[1], position[2] - receiver[2]
        for p in range(count):
            i, j, strength = pair[p, 0], pair[p, 1], points.strength[p, n]
            forward = points.transmit_weight[i, n] * points.receive_weight[j, n] * strength
            backward = points.transmit_weight[j, n] * points.receive_weight[i, n] * strength if i != j else 0j
            forward_energy, backward_energy = forward.real**2 + forward.imag**2, backward.real**2 + backward.imag**2
            if forward_energy + backward_energy == 0:
                continue
            delay, value = points.delay[i, n] + points.delay[j, n], forward + backward
            grazing = (abs(points.grazing[i, n]) + abs(points.grazing[j, n])) / 2
            forward_row, backward_row = points.row[j, n], points.row[i, n]
            tau[m], w[m], row[m], interferes[m] = delay, value, 0.5 * (forward_row + backward_row), False
            excess = 2.0 * (forward * np.conj(backward)).real
            excess *= mean_gain_product(grid.row_phase, forward_row - backward_row)
            if forward_row == backward_row:
                pair_energy = forward_energy + backward_energy
                _deposit_position(bins[:, p], grid, forward_row, delay, pair_energy, offset, grazing)
                if grid.uses_energy_grid:
                    excess += pair_energy
            else:
                for own_row, energy in ((forward_row, forward_energy), (backward_row, backward_energy)):
                    _deposit_position(bins[:, p], grid, own_row, delay, energy, offset, grazing)
                    if grid.uses_energy_grid:
                        _deposit_energy(cells, pair_row[p], grid, own_row, delay, energy)
            if pair_row[p] >= 0:
                _deposit_energy(cells, pair_row[p], grid, row[m], delay, excess)
            for k in range(m):
                lag = delay - tau[k]
                if abs(lag) >= overlap.support:
                    continue
                if is_short:
                    early, late = (w[k], value) if lag > 0 else (value, w[k])
                    excess = _interference(overlap, early, late, abs(lag))
                    excess *= mean_gain_product(grid.row_phase, row[m] - row[k])
                    _deposit_energy(
                        cells, cells.shape[1] - 1, grid, 0.5 * (row[k] + row[m]), tau[k] + 0.5 * lag, excess
                    )
                else:
                    interferes[k] = interferes[m] = True
            m += 1
        for k in range(m):
            if interferes[k]:
                delays[filled], weight[filled] = tau[k], w[k]
                filled += 1
        if filled > first[groups]:
            groups += 1
            first[groups] = filled
    return first[: groups + 1], delays[:filled], weight[:filled]
