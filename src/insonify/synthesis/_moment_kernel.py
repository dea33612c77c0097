"""Many echoes in the same cell, gathered as moments before they are laid on the grid.

The cells that a spike adds are polynomials of its place between cells (`_taps`). So of all spikes that start in one
cell it is enough to know the sums of their weights times the powers of their places: a few numbers to add for each,
side by side, and the polynomials once for all. That pays where echoes come in the order of their delays, some tens to
a cell: a window that moves along the grid holds the moments of the cells of all elements, and whatever comes
outside of it is laid down by itself. Plain numbers and arrays.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._lanes import (
    add_complex_spike,
    add_spike_of_2,
    add_spike_of_4,
    gather_spike_of_1,
    gather_spike_of_2,
    gather_spike_of_4,
    lay_down_cell_of_1,
    lay_down_cell_of_2,
    lay_down_cell_of_4,
    moment_vectors,
)
from insonify.synthesis._shape_kernel import Shaping

Singles = NDArray[np.float32]
WINDOW = 96
"""Cells of which moments are held at a time."""
MARGIN = 16
"""How many of them lie before the cell that has just come to the array's centre."""
_VECTORS = 0, moment_vectors(1), moment_vectors(2), 0, moment_vectors(4)
"""Vectors of 8 numbers in the moments of a cell, by its shapes."""


@njit(cache=True, nogil=True, error_model="numpy")
def empty_window(elements: int, lanes: int) -> Singles:
    """Room for the moments of the cells of all elements, nothing in it."""
    return np.zeros(elements * WINDOW * 8 * _VECTORS[lanes], np.float32)


@njit(cache=True, nogil=True, error_model="numpy")
def gather(
    cells: NDArray[np.complex64], moments: Singles, begin: int, first_element: int, elements: int, apart: int,
    at: NDArray[np.int32], place: Singles, weight: Singles, x: Singles, shaped: Shaping, count: int,
) -> None:  # fmt: skip
    """Spikes of some echoes at each element, added to the moments, or to the grids where they are off the window.

    Args:
        cells: Grids of pressure, (elements or more, 1, cells, shapes).
        moments: Of `empty_window`.
        begin: First cell of the window.
        first_element: The first that hears these spikes.
        elements: How many do, from there on.
        apart: Spikes from one element to the next, `count` or more.
        at: As of `lay_down_all`.
        place: Likewise.
        weight: Likewise.
        x: Likewise.
        shaped: Likewise.
        count: Likewise.
    """
    flat, curve, row, lanes = cells.reshape(-1).view(np.float32), shaped.curve, cells.shape[2], cells.shape[3]
    for i in range(count):
        for e in range(elements):
            k = np.uintp(e * apart + i)
            cell = np.intp(at[k]) - begin
            if cell >= 0 and cell < WINDOW:
                cell += (first_element + e) * WINDOW
                if lanes == 4:
                    gather_spike_of_4(moments, cell, place[k], weight, x[k], curve, np.intp(k))
                elif lanes == 2:
                    gather_spike_of_2(moments, cell, place[k], weight, x[k], curve, np.intp(k))
                else:
                    gather_spike_of_1(moments, cell, place[k], weight, x[k], curve, np.intp(k))
            elif at[k] >= 0:
                first = np.intp((first_element + e) * row + at[k])
                if lanes == 4:
                    add_spike_of_4(flat, first, place[k], weight, x[k], curve, np.intp(k))
                elif lanes == 2:
                    add_spike_of_2(flat, first, place[k], weight, x[k], curve, np.intp(k))
                else:
                    add_complex_spike(flat, first, place[k], weight, np.intp(k))


@njit(cache=True, nogil=True, error_model="numpy")
def lay_down_moments(cells: NDArray[np.complex64], moments: Singles, begin: int, elements: int) -> None:
    """What has been gathered in a window, laid on the grids; the window is empty then.

    Args:
        cells: Grids of pressure, (elements or more, 1, cells, shapes).
        moments: Of `empty_window`.
        begin: First cell of the window.
        elements: How many there are.
    """
    flat, row, lanes = cells.reshape(-1).view(np.float32), cells.shape[2], cells.shape[3]
    for e in range(elements):
        for c in range(WINDOW):
            first, cell = np.intp(e * row + begin + c), np.intp(e * WINDOW + c)
            if lanes == 4:
                lay_down_cell_of_4(flat, first, moments, cell)
            elif lanes == 2:
                lay_down_cell_of_2(flat, first, moments, cell)
            else:
                lay_down_cell_of_1(flat, first, moments, cell)
