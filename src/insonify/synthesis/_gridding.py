"""Deposit of spikes on a fine time grid: the innermost loops of the simulator.

Each block of spikes is processed in two passes. First, for all of them: cell, position between cells, complex
weight; plain arithmetic that the compiler vectorises over spikes. Then, one spike after the other, the
kernel's cells. The kernels release the interpreter lock; chunks of spikes with their own cells, added
in a fixed order, give bit-identical results for any number of threads.

Spikes whose cells are not all on the grid, or whose delay is NaN, are dropped.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, WIDTH
from insonify.synthesis._simd_gridding import add_complex_spike, add_real_spike

_BLOCK = 512
"""Number of spikes that go through both passes together."""
_SHIFT = WIDTH / 2 - 1
_FAST = {"contract", "reassoc", "nsz", "arcp"}  # not "nnan": NaN delays must be detected


@njit(inline="always")
def _locate(
    delay: NDArray[np.float64], first_time: float, cell_rate: float, last: int, first_cell: NDArray[np.int32],
    fraction: NDArray[np.float32],
) -> None:  # fmt: skip
    """First cell of each spike of a block (-1 unless all its cells are on the grid), and its position between cells."""
    for i in range(delay.size):
        position = (delay[i] - first_time) * cell_rate - _SHIFT
        inside = (position >= 0.0) & (position < last)
        position = position if inside else 0.0
        cell = np.floor(position)
        first_cell[i] = np.int32(cell) if inside else np.int32(-1)
        fraction[i] = np.float32(position - cell - 0.5)


@njit(inline="always")
def _deposit(
    cells: NDArray[np.float32], first_cell: NDArray[np.int32], fraction: NDArray[np.float32],
    weight: NDArray[np.float32], count: int,
) -> None:  # fmt: skip
    """Deposit the spikes of a block one after the other; those off the grid or of zero weight are skipped."""
    for i in range(count):
        if first_cell[i] >= 0 and (weight[2 * i] != 0 or weight[2 * i + 1] != 0):
            add_complex_spike(cells, np.intp(first_cell[i]), fraction[i], weight, i)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_pressure(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, delay: NDArray[np.float64],
    weight: NDArray[np.complex64],
) -> None:  # fmt: skip
    """Deposit echoes whose weights include the phase of the carrier.

    Args:
        cells: Grid of one channel, added to in place, shape (cell_count,).
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        delay: Delay of each echo [s], shape (n,).
        weight: Complex weight of each echo, carrier phase included [uPa], shape (n,).
    """
    last = cells.size - CELLS_PER_SPIKE
    flat = cells.view(np.float32)
    first_cell, fraction = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.float32)
    for begin in range(0, delay.size, _BLOCK):
        # Slices, not begin + i: an index that starts at zero lets the compiler vectorise over spikes.
        tau, block_weight = delay[begin : begin + _BLOCK], weight[begin : begin + _BLOCK]
        _locate(tau, first_time, cell_rate, last, first_cell, fraction)
        _deposit(flat, first_cell, fraction, block_weight.view(np.float32), tau.size)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_energy(
    cells: NDArray[np.float64], first_time: float, cell_rate: float, delay: NDArray[np.float64],
    energy: NDArray[np.float64],
) -> None:  # fmt: skip
    """Deposit energies of echoes that do not interfere on the cells of the energy grid.

    Args:
        cells: Energy grid of one channel, added to in place, shape (cell_count,).
        first_time: Time of the first cell [s].
        cell_rate: Cells per second of the energy grid [Hz].
        delay: Delay of each echo [s], shape (n,).
        energy: Energy (mean-square weight) of each echo [uPa^2], shape (n,).
    """
    last = cells.size - CELLS_PER_SPIKE
    first_cell, fraction = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.float32)
    for begin in range(0, delay.size, _BLOCK):
        tau, weight = delay[begin : begin + _BLOCK], energy[begin : begin + _BLOCK]
        _locate(tau, first_time, cell_rate, last, first_cell, fraction)
        for i in range(tau.size):
            if first_cell[i] >= 0 and weight[i] != 0:
                add_real_spike(cells, np.intp(first_cell[i]), np.float64(fraction[i]), weight[i])


@njit(inline="always")
def add_to_adjacent_rows(
    cells: NDArray[np.float32], row: float, first_cell: int, fraction: float, energy: float
) -> None:  # fmt: skip
    """Share an energy between the two rows adjacent to a fractional row, linearly."""
    k = min(max(int(row), 0), cells.shape[0] - 2)
    part = row - k
    add_real_spike(cells[k], first_cell, fraction, energy * (1 - part))
    add_real_spike(cells[k + 1], first_cell, fraction, energy * part)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_energy_on_rows(
    cells: NDArray[np.float32], first_time: float, cell_rate: float, delay: NDArray[np.float64],
    energy: NDArray[np.float64], row: NDArray[np.float64],
) -> None:  # fmt: skip
    """Deposit energies of echoes from many directions, each shared between the two rows adjacent to its own.

    Args:
        cells: Energy grids of the rows, added to in place, shape (rows, cell_count).
        first_time: Time of the first cell [s].
        cell_rate: Cells per second of the energy grid [Hz].
        delay: Delay of each echo [s], shape (n,).
        energy: Energy (mean-square weight) of each echo [uPa^2], shape (n,).
        row: Row of each echo, with fraction, shape (n,).
    """
    last = cells.shape[1] - CELLS_PER_SPIKE
    first_cell, fraction = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.float32)
    for begin in range(0, delay.size, _BLOCK):
        tau, weight, index = delay[begin : begin + _BLOCK], energy[begin : begin + _BLOCK], row[begin : begin + _BLOCK]
        _locate(tau, first_time, cell_rate, last, first_cell, fraction)
        for i in range(tau.size):
            if first_cell[i] >= 0 and weight[i] != 0:
                add_to_adjacent_rows(cells, index[i], np.intp(first_cell[i]), np.float64(fraction[i]), weight[i])
