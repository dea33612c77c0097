"""Filters along both axes of a lattice, as `scipy.ndimage` has them, but with the lines side by side in vectors.

The order of all sums is that of SciPy, so results are the same to the bit.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]

POLE = -0.267949192431122706
"""Pole of the cubic spline's filter, the square root of 3 less 2 [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def symmetric_filter(values: Floats, weights: Floats) -> Floats:
    """Correlation along both axes with symmetric weights, beyond the edges with the nearest value.

    Args:
        values: Values at the nodes, (a, b).
        weights: Weights of the nodes at distances 0, 1 ... [1].

    Returns:
        Result, (a, b).
    """
    rows, columns = values.shape
    reach = weights.size - 1
    padded, filtered = np.empty(columns + 2 * reach), np.empty(values.shape)
    along = np.empty(columns)
    for r in range(rows):
        for c in range(columns):
            along[c] = values[r, c] * weights[0]
        for k in range(reach, 0, -1):
            before, after, weight = values[max(r - k, 0)], values[min(r + k, rows - 1)], weights[k]
            for c in range(columns):
                along[c] += (before[c] + after[c]) * weight
        padded[reach : reach + columns] = along
        padded[:reach], padded[reach + columns :] = along[0], along[columns - 1]
        total = filtered[r]
        for c in range(columns):
            total[c] = along[c] * weights[0]
        for k in range(reach, 0, -1):
            before, after, weight = padded[reach - k :], padded[reach + k :], weights[k]
            for c in range(columns):
                total[c] += (before[c] + after[c]) * weight
    return filtered


@njit(cache=True, nogil=True, error_model="numpy")
def _filter_columns(values: Floats) -> None:
    """Turn each column into coefficients of the cubic spline through it, in place."""
    n, columns = values.shape
    gain, far = (1 - POLE) * (1 - 1 / POLE), POLE ** (n - 1)
    for i in range(n):
        for c in range(columns):
            values[i, c] *= gain
    first, last = values[0], values[n - 1]
    for c in range(columns):
        first[c] += far * last[c]
    power = POLE
    for i in range(1, n - 1):
        for c in range(columns):
            first[c] += power * (values[i, c] + far * values[n - 1 - i, c])
        power *= POLE
    for c in range(columns):
        first[c] /= 1 - far * far
    for i in range(1, n):
        for c in range(columns):
            values[i, c] += POLE * values[i - 1, c]
    for c in range(columns):
        last[c] = (POLE * values[n - 2, c] + last[c]) * POLE / (POLE * POLE - 1)
    for i in range(n - 2, -1, -1):
        for c in range(columns):
            values[i, c] = POLE * (values[i + 1, c] - values[i, c])


@njit(cache=True, nogil=True, error_model="numpy")
def spline_coefficients(values: Floats) -> Floats:
    """Coefficients of the cubic spline through values at the nodes, reflected at the edges.

    Args:
        values: Values, (a, b), at least two along each axis.

    Returns:
        Coefficients, (a, b).
    """
    along = values.copy()
    _filter_columns(along)
    transposed = along.T.copy()
    _filter_columns(transposed)
    return transposed.T.copy()
