"""Kernel that interpolates time series at a few points along an array to all its elements: a matrix product.

The curvature common to all wavefronts of one delay is removed before and restored afterwards. Plain numbers and
arrays.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.synthesis._element_arrivals_kernel import SectorLimits
from insonify.synthesis._simd_product import TILE, multiply_tile

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_FAST = {"contract", "nsz", "arcp"}
_ROWS, _COLUMNS = TILE
_NUMBERS = 16 * _COLUMNS
"""Numbers of each series that are processed together: those of all points stay in the second-level cache."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turn(series: Singles, curvature_phase: Floats, squared_position: float, work: Singles, turned: Singles) -> None:
    """Turn samples by a phase, the curvature phase at the array's ends times a squared position, and add them.

    Args:
        series: Samples, real and imaginary parts alternating, (2 samples or more,).
        curvature_phase: Curvature phase at the array's ends at each sample [cycles], (samples,).
        squared_position: Squared position along the array, 1 at its ends; its negative to turn back [1].
        work: Work array, (2, samples or more).
        turned: Result: the product is added to this, (2 samples or more,).
    """
    sine, cosine = work[0], work[1]
    for k in range(curvature_phase.size):
        sine[k], cosine[k] = sincos_cycles(curvature_phase[k] * squared_position)
    for k in range(curvature_phase.size):
        i, s, c = np.uintp(2 * k), sine[k], cosine[k]
        real, imaginary = series[i], series[i + np.uintp(1)]
        turned[i] += real * c - imaginary * s
        turned[i + np.uintp(1)] += real * s + imaginary * c


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def interpolate_to_elements(
    points: NDArray[np.complex64], elements: NDArray[np.complex64], first_delay: float, sample_rate: float,
    limits: SectorLimits, point_position: Floats, element_position: Floats, weights: Singles,
) -> None:  # fmt: skip
    """Add the time series at the interpolation points to those of the elements.

    Args:
        points: Time series at the points [uPa], (p, samples).
        elements: Time series of the elements [uPa], added to in place, (e, samples).
        first_delay: Delay of the echoes whose pulse has its middle in the first sample [s].
        sample_rate: Samples per second [Hz].
        limits: Limits of the sector; samples before its least delay have the curvature of this delay.
        point_position: Interpolation points along the array, -1..1, (p,).
        element_position: Positions of the elements along the array, -1..1, (e,).
        weights: Weight of each point at each element, (e, p).
    """
    count, point_count = weights.shape
    from_points, to_elements, at_once = points.view(np.float32), elements.view(np.float32), _NUMBERS // 2
    padded = np.zeros((count + -count % _ROWS, point_count), np.float32)
    padded[:count] = weights
    point, product, sample_phase = np.arange(point_count), np.empty(TILE, np.float32), np.empty(at_once)
    turned, tiles = np.empty(_NUMBERS, np.float32), np.empty((_NUMBERS // _COLUMNS, point_count, _COLUMNS), np.float32)
    interpolated, work = np.empty((_ROWS, _NUMBERS), np.float32), np.empty((2, at_once), np.float32)
    for begin in range(0, points.shape[1], at_once):
        stop = min(begin + at_once, points.shape[1])
        for k in range(begin, stop):
            delay = max(first_delay + k / sample_rate, limits.min_delay)
            sample_phase[k - begin] = limits.curvature_phase / (2 * math.pi) / delay
        block, phase = slice(2 * begin, 2 * stop), sample_phase[: stop - begin]
        for p in range(point_count):
            turned[:] = 0
            _turn(from_points[p, block], phase, point_position[p] * point_position[p], work, turned)
            for tile in range(tiles.shape[0]):
                tiles[tile, p] = turned[tile * _COLUMNS : (tile + 1) * _COLUMNS]
        for first in range(0, count, _ROWS):
            for tile in range(tiles.shape[0]):
                multiply_tile(product, padded, tiles[tile], point, (point_count, point_count), first)
                interpolated[:, tile * _COLUMNS : (tile + 1) * _COLUMNS] = product
            for e in range(first, min(first + _ROWS, count)):
                squared_position = element_position[e] * element_position[e]
                _turn(interpolated[e - first], phase, -squared_position, work, to_elements[e, block])
