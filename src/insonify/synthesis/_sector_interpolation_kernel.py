"""Kernel that interpolates deposits at a few points along an array to all its elements: a matrix product.

The curvature common to all wavefronts of one delay is removed before and restored afterwards. Plain numbers and
arrays.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.synthesis._simd_product import TILE, multiply_tile

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_FAST = {"contract", "nsz", "arcp"}
_ROWS, _COLUMNS = TILE
_NUMBERS = 16 * _COLUMNS
"""Numbers of each channel that are processed together: those of all points stay in the second-level cache."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turn(
    cells: Singles, lanes: int, curvature_phase: Floats, squared_position: float, work: Singles, turned: Singles
) -> None:
    """Multiply cells by a phase: the curvature at the array's ends [cycles] times a squared position.

    Args:
        cells: Cells, real and imaginary parts alternating, (2 lanes cells or more,).
        lanes: Number of waveforms in a cell.
        curvature_phase: Curvature at the array's ends in each cell [cycles], (cells,).
        squared_position: Squared position along the array [1].
        work: Work array, (4, lanes cells or more).
        turned: Result: the product is added to this, (2 lanes cells or more,).
    """
    sine, cosine, sines, cosines = work[0], work[1], work[2], work[3]
    for c in range(curvature_phase.size):
        sine[c], cosine[c] = sincos_cycles(curvature_phase[c] * squared_position)
    for c in range(curvature_phase.size):
        for k in range(lanes):
            sines[np.uintp(lanes * c + k)], cosines[np.uintp(lanes * c + k)] = sine[c], cosine[c]
    for k in range(lanes * curvature_phase.size):
        i, s, c = np.uintp(2 * k), sines[k], cosines[k]
        real, imaginary = cells[i], cells[i + np.uintp(1)]
        turned[i] += real * c - imaginary * s
        turned[i + np.uintp(1)] += real * s + imaginary * c


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def interpolate_to_elements(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, curvature_phase: float, point_position: Floats,
    element: Floats, weights: Singles,
) -> None:  # fmt: skip
    """Add the cells of the interpolation points to those of the elements, and clear the former.

    Args:
        cells: Grids of pressure, of elements and then of points, (e + p, groups, cells, waveforms of a group).
        first_time: Time of the first cell re the pulse's middle [s].
        cell_rate: Cells per second [Hz].
        curvature_phase: Curvature phase of `ArraySector` [rad s].
        point_position: Interpolation points along the array, -1..1, (p,).
        element: Positions of the elements along the array, -1..1, (e,).
        weights: Weight of each point at each element, (e, p).
    """
    elements, points = weights.shape
    count, lanes = cells.shape[2], cells.shape[3]
    flat, stride = cells.reshape(cells.shape[0], -1).view(np.float32), 2 * lanes
    padded = np.zeros((elements + -elements % _ROWS, points), np.float32)
    padded[:elements] = weights
    cells_at_once, point, product = _NUMBERS // stride, np.arange(points), np.empty(TILE, np.float32)
    turned, tiles = np.empty(_NUMBERS, np.float32), np.empty((_NUMBERS // _COLUMNS, points, _COLUMNS), np.float32)
    interpolated, work = np.empty((_ROWS, _NUMBERS), np.float32), np.empty((4, _NUMBERS), np.float32)
    cell_phase = np.empty(cells_at_once)
    for begin in range(0, cells.shape[1] * count, cells_at_once):
        stop = min(begin + cells_at_once, cells.shape[1] * count)
        for k in range(begin, stop):
            cell_phase[k - begin] = (
                curvature_phase / (2 * math.pi) / max(first_time + (k % count) / cell_rate, 1 / cell_rate)
            )
        block, phase = slice(stride * begin, stride * stop), cell_phase[: stop - begin]
        for p in range(points):
            turned[:] = 0
            _turn(flat[elements + p, block], lanes, phase, point_position[p] * point_position[p], work, turned)
            for tile in range(tiles.shape[0]):
                tiles[tile, p] = turned[tile * _COLUMNS : (tile + 1) * _COLUMNS]
        flat[elements:, block] = 0
        for first in range(0, elements, _ROWS):
            for tile in range(tiles.shape[0]):
                multiply_tile(product, padded, tiles[tile], point, (points, points), first)
                interpolated[:, tile * _COLUMNS : (tile + 1) * _COLUMNS] = product
            for e in range(first, min(first + _ROWS, elements)):
                _turn(interpolated[e - first], lanes, phase, -element[e] * element[e], work, flat[e, block])
