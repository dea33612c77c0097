"""Many echoes of the same cell, gathered as moments before they are deposited on the grid.

The cells of a spike are polynomials of its position between cells (`_gridding_kernel`). So for all spikes that start in
one cell the sums of their weights times the powers of their positions suffice: a few numbers to add for each,
contiguous in memory, and the polynomials once for all. That pays where echoes come in order of delay, some tens to
a cell: a window that moves along the grid holds the moments of the cells of all elements, and echoes
outside of it are deposited directly. Plain numbers and arrays.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._simd_gridding import (
    add_complex_spike,
    add_spike_of_2,
    add_spike_of_4,
    deposit_cell_of_1,
    deposit_cell_of_2,
    deposit_cell_of_4,
    gather_spike_of_1,
    gather_spike_of_2,
    gather_spike_of_4,
    moment_vectors,
)
from insonify.synthesis._waveform_basis_kernel import BasisWeights

Singles = NDArray[np.float32]
WINDOW = 64
"""Number of cells in the window, a power of 2: it is a ring, so that cells stay where they are while it moves."""
MARGIN = 16
"""Number of cells of the window before the current cell at the array's centre."""
_VECTORS = 0, moment_vectors(1), moment_vectors(2), 0, moment_vectors(4)
"""Vectors of 8 numbers in the moments of a cell, by its number of waveforms."""


@njit(cache=True, nogil=True, error_model="numpy")
def empty_window(elements: int, lanes: int) -> Singles:
    """Empty window: moments of the cells of all elements, for grids of `lanes` (1, 2 or 4) waveforms."""
    return np.zeros(elements * WINDOW * 8 * _VECTORS[lanes], np.float32)


@njit(cache=True, nogil=True, error_model="numpy")
def gather_moments(
    cells: NDArray[np.complex64], moments: Singles, window_start: int, first_element: int, elements: int,
    element_stride: int,
    first_cell: NDArray[np.int32], fraction: Singles, weight: Singles, x: Singles, basis: BasisWeights, count: int,
) -> None:  # fmt: skip
    """Add the spikes of some echoes at each element to the moments, or to the grids where they are off the window.

    Args:
        cells: Grids of pressure [uPa], (elements or more, 1, cells, waveforms).
        moments: Window from `empty_window`.
        window_start: First cell of the window.
        first_element: First element that receives these spikes.
        elements: Number of such elements.
        element_stride: Number of spikes from one element to the next, `count` or more.
        first_cell: First cell of each spike, -1 where it is off the grid, (spikes,).
        fraction: Position of each spike between cells [1], (spikes,).
        weight: Weight of each spike [uPa], real and imaginary parts alternating, (2 spikes,).
        x: Coordinate of each spike in the waveform basis [1], (spikes,).
        basis: Waveform basis.
        count: Number of echoes.
    """
    flat, coefficients, row = cells.reshape(-1).view(np.float32), basis.coefficients, cells.shape[2]
    lanes = cells.shape[3]
    for i in range(count):
        for e in range(elements):
            k = np.uintp(e * element_stride + i)
            cell = np.intp(first_cell[k])
            if np.uintp(cell - window_start) < WINDOW:
                cell = (cell & (WINDOW - 1)) + (first_element + e) * WINDOW
                if lanes == 4:
                    gather_spike_of_4(moments, cell, fraction[k], weight, x[k], coefficients, np.intp(k))
                elif lanes == 2:
                    gather_spike_of_2(moments, cell, fraction[k], weight, x[k], coefficients, np.intp(k))
                else:
                    gather_spike_of_1(moments, cell, fraction[k], weight, x[k], coefficients, np.intp(k))
            elif first_cell[k] >= 0:
                first = np.intp((first_element + e) * row + first_cell[k])
                if lanes == 4:
                    add_spike_of_4(flat, first, fraction[k], weight, x[k], coefficients, np.intp(k))
                elif lanes == 2:
                    add_spike_of_2(flat, first, fraction[k], weight, x[k], coefficients, np.intp(k))
                else:
                    add_complex_spike(flat, first, fraction[k], weight, np.intp(k))


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_moments(cells: NDArray[np.complex64], moments: Singles, start: int, stop: int, elements: int) -> None:
    """Deposit the moments of some cells of a window on the grids, and clear them.

    Args:
        cells: Grids of pressure [uPa], (elements or more, 1, cells, waveforms).
        moments: Window from `empty_window`.
        start: First of these cells, as an index of the grid.
        stop: One past the last of these cells.
        elements: Number of elements.
    """
    flat, row, lanes = cells.reshape(-1).view(np.float32), cells.shape[2], cells.shape[3]
    for e in range(elements):
        for c in range(start, stop):
            first, cell = np.intp(e * row + c), np.intp(e * WINDOW + (c & (WINDOW - 1)))
            if lanes == 4:
                deposit_cell_of_4(flat, first, moments, cell)
            elif lanes == 2:
                deposit_cell_of_2(flat, first, moments, cell)
            else:
                deposit_cell_of_1(flat, first, moments, cell)
