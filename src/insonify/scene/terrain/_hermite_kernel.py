"""A smooth surface through a grid: cubic Hermite patches that share heights and slopes at their corners."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def node_slopes(height: NDArray[Any], along_rows: NDArray[Any], along_columns: NDArray[Any]) -> None:
    """Fill slopes per cell at the nodes: central where both neighbours are known, one-sided where one is, else 0.

    Args:
        height: Heights [m], (n, m); NaN in holes.
        along_rows: Result, slope from row to row [m], (n, m).
        along_columns: Result, slope from column to column [m], (n, m).
    """
    n, m = height.shape
    for i in range(n):
        for j in range(m):
            middle = height[i, j]
            above, below = height[min(i + 1, n - 1), j], height[max(i - 1, 0), j]
            right, left = height[i, min(j + 1, m - 1)], height[i, max(j - 1, 0)]
            along_rows[i, j] = _slope(below, middle, above, i > 0, i < n - 1)
            along_columns[i, j] = _slope(left, middle, right, j > 0, j < m - 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _slope(before, middle, after, has_before, has_after):  # type: ignore[no-untyped-def]
    """Slope per cell at a node from its known neighbours [m]."""
    has_before, has_after = has_before and not math.isnan(before), has_after and not math.isnan(after)
    if has_before and has_after:
        return 0.5 * (after - before)
    if has_after:
        return after - middle
    return middle - before if has_before else 0.0 * middle


@njit(cache=True, nogil=True, error_model="numpy")
def hermite(
    height: NDArray[Any], along_rows: NDArray[Any], along_columns: NDArray[Any], row: Floats, column: Floats,
    out: Floats,
) -> None:  # fmt: skip
    """Fill height and both slopes per cell of the surface; NaN outside and where a cell's corner is a hole.

    The twist at the nodes is 0, so neighbouring patches share value and gradient along their whole common edge.

    Args:
        height: Heights at the nodes [m], (n, m).
        along_rows: Slopes of `node_slopes` [m], (n, m).
        along_columns: Slopes of `node_slopes` [m], (n, m).
        row: Fractional row of each point [1], (p,).
        column: Fractional column of each point [1], (p,).
        out: Result, height [m], slope from row to row and from column to column [m], (p, 3).
    """
    n, m = height.shape
    for p in range(row.size):
        inside = 0 <= row[p] <= n - 1 and 0 <= column[p] <= m - 1
        if not inside:
            out[p, 0] = out[p, 1] = out[p, 2] = np.nan
            continue
        i, j = min(int(row[p]), n - 2), min(int(column[p]), m - 2)
        f, g = row[p] - i, column[p] - j
        value = down = right = 0.0
        for a in range(2):
            x = f if a == 0 else 1 - f
            row_sign = 1.0 if a == 0 else -1.0
            h, dh = (1 + 2 * x) * (1 - x) * (1 - x), -6 * x * (1 - x) * row_sign
            t, dt = row_sign * x * (1 - x) * (1 - x), (1 - x) * (1 - 3 * x)
            for b in range(2):
                y = g if b == 0 else 1 - g
                column_sign = 1.0 if b == 0 else -1.0
                k, dk = (1 + 2 * y) * (1 - y) * (1 - y), -6 * y * (1 - y) * column_sign
                u, du = column_sign * y * (1 - y) * (1 - y), (1 - y) * (1 - 3 * y)
                z, zr, zc = height[i + a, j + b], along_rows[i + a, j + b], along_columns[i + a, j + b]
                value += h * k * z + t * k * zr + h * u * zc
                down += dh * k * z + dt * k * zr + dh * u * zc
                right += h * dk * z + t * dk * zr + h * du * zc
        out[p, 0], out[p, 1], out[p, 2] = value, down, right
