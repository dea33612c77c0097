"""Kernel that interpolates deposits at a few points along an array to all its elements: a matrix product.

The curvature common to all wavefronts of one delay is removed before and restored afterwards. Plain numbers and
arrays.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_CELLS = 64
"""Cells that are processed together: those of all points stay in the first-level cache."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _wavefront_corrected(
    cells: Singles, lanes: int, curvature_phase: Floats, squared_position: float, corrected: Singles
) -> None:
    """Multiply cells by a phase: the curvature at the array's ends [cycles] times a squared position."""
    cosine, sine = np.empty(_CELLS, np.float32), np.empty(_CELLS, np.float32)
    for c in range(curvature_phase.size):
        s, k = sincos_cycles(curvature_phase[c] * squared_position)
        cosine[c], sine[c] = k, s
    for c in range(curvature_phase.size):
        for k in range(2 * lanes * c, 2 * lanes * (c + 1), 2):
            corrected[k] = cells[k] * cosine[c] - cells[k + 1] * sine[c]
            corrected[k + 1] = cells[k] * sine[c] + cells[k + 1] * cosine[c]


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
        weights: Weight of each point at each element, (e, p); p is a multiple of 4.
    """
    elements, points = weights.shape
    count, lanes = cells.shape[2], cells.shape[3]
    flat, stride = cells.reshape(cells.shape[0], -1).view(np.float32), 2 * lanes
    flattened, cell_phase = np.empty((points, stride * _CELLS), np.float32), np.empty(_CELLS)
    interpolated, restored = np.empty(stride * _CELLS, np.float32), np.empty(stride * _CELLS, np.float32)
    for begin in range(0, cells.shape[1] * count, _CELLS):
        stop = min(begin + _CELLS, cells.shape[1] * count)
        for k in range(begin, stop):
            cell_phase[k - begin] = (
                curvature_phase / (2 * math.pi) / max(first_time + (k % count) / cell_rate, 1 / cell_rate)
            )
        block, size = slice(stride * begin, stride * stop), stride * (stop - begin)
        for p in range(points):
            _wavefront_corrected(
                flat[elements + p, block], lanes, cell_phase[: stop - begin], point_position[p] * point_position[p],
                flattened[p],
            )  # fmt: skip
        flat[elements:, block] = 0
        for e in range(elements):
            interpolated[:size] = 0
            for p in range(0, points, 4):
                a, b, c, d = weights[e, p], weights[e, p + 1], weights[e, p + 2], weights[e, p + 3]
                point_a, point_b, point_c, point_d = flattened[p], flattened[p + 1], flattened[p + 2], flattened[p + 3]
                for k in range(size):
                    interpolated[k] += a * point_a[k] + b * point_b[k] + c * point_c[k] + d * point_d[k]
            _wavefront_corrected(interpolated, lanes, cell_phase[: stop - begin], -element[e] * element[e], restored)
            out = flat[e, block]
            for k in range(size):
                out[k] += restored[k]
