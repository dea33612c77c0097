"""Kernels of terrain lattices: low-pass and cubic spline of a rectangle of nodes.

Both are filters of `scipy.ndimage`, for squares of a few hundred nodes in a third of the time.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[Any]

POLE = -0.2679491924311227
"""Pole of the filter of a cubic spline, sqrt(3) - 2 [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def _blurred(values: Floats, weights: Floats) -> Floats:
    """Values (a, b) after a symmetric filter along both axes, with the values of the edges beyond them.

    `weights` are those of the middle and of the nodes to one side [1], (any,).
    """
    last, columns, reach = values.shape[0] - 1, values.shape[1], weights.size - 1
    result, padded = np.empty(values.shape), np.empty(columns + 2 * reach)
    line = padded[reach : reach + columns]
    for i in range(last + 1):
        line[:] = values[i] * weights[0]
        for k in range(reach, 0, -1):
            before, after, weight = values[max(i - k, 0)], values[min(i + k, last)], weights[k]
            for j in range(columns):
                line[j] += (before[j] + after[j]) * weight
        padded[:reach], padded[reach + columns :] = line[0], line[columns - 1]
        row = result[i]
        row[:] = line * weights[0]
        for k in range(reach, 0, -1):
            before, after, weight = padded[reach - k :], padded[reach + k :], weights[k]
            for j in range(columns):
                row[j] += (before[j] + after[j]) * weight
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def without_short_waves(depth: Floats, weights: Floats) -> Floats:
    """Depth less its short waves, 1 - (1 - g)^2, with g a symmetric filter along both axes.

    Args:
        depth: Depth of the nodes [m], (a, b).
        weights: Weights of the filter, of the middle and of the nodes to one side [1], (any,).
    """
    short = depth - _blurred(depth, weights)
    return depth - short + _blurred(short, weights)


@njit(cache=True, nogil=True, error_model="numpy")
def _spline_across(values: Floats) -> Floats:
    """Transpose of the coefficients, along the first axis, of the cubic spline through values (a, b), mirrored beyond.

    Source: Unser, Aldroubi & Eden (1991), IEEE Trans. Pattern Anal. Mach. Intell. 13, 277: a causal and an anticausal
    recursion.
    """
    count, columns = values.shape
    line = values * ((1 - POLE) * (1 - 1 / POLE))
    power, mirrored = POLE, POLE ** (count - 1)
    first = line[0] + mirrored * line[count - 1]
    for i in range(1, count - 1):
        for j in range(columns):
            first[j] += power * (line[i, j] + mirrored * line[count - 1 - i, j])
        power *= POLE
    line[0] = first / (1 - mirrored * mirrored)
    for i in range(1, count):
        for j in range(columns):
            line[i, j] += POLE * line[i - 1, j]
    line[count - 1] = (POLE * line[count - 2] + line[count - 1]) * POLE / (POLE * POLE - 1)
    for i in range(count - 2, -1, -1):
        for j in range(columns):
            line[i, j] = POLE * (line[i + 1, j] - line[i, j])
    return np.ascontiguousarray(line.T)


@njit(cache=True, nogil=True, error_model="numpy")
def spline_coefficients(values: Floats) -> Floats:
    """Coefficients of the bicubic spline through values (a, b), mirrored beyond the edges, (a, b)."""
    return _spline_across(_spline_across(values))
