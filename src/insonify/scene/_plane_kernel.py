"""Planes fitted to pieces of a map of heights: samples of an ellipse, least squares. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Integers = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def mark_ellipses(ellipses: Floats, pattern: Floats, side: float, corner_a: int, corner_b: int,
                  wanted: NDArray[np.bool_]) -> None:  # fmt: skip
    """Mark the pieces of a map that the samples of some ellipses lie on.

    Args:
        ellipses: Middle along and across [m], cosine and sine of the long axis, half length and half width [m], (n, 6).
        pattern: Samples of the unit disc, (s, 2).
        side: Side of a piece [m].
        corner_a: Number of the first row of pieces.
        corner_b: Number of the first column.
        wanted: Result, True for the pieces met, (rows, columns).
    """
    per = 1 / side
    for n in range(ellipses.shape[0]):
        a, b, c, s, length, width = ellipses[n]
        for k in range(pattern.shape[0]):
            u, v = pattern[k, 0] * length, pattern[k, 1] * width
            row = math.floor((a + u * c - v * s) * per) - corner_a
            wanted[row, math.floor((b + u * s + v * c) * per) - corner_b] = True


@njit(cache=True, nogil=True, error_model="numpy")
def fit_ellipses(
    ellipses: Floats, pattern: Floats, side: float, corner_a: int, corner_b: int, row_of: Integers, pieces: Floats,
    found: Floats,
) -> None:  # fmt: skip
    """Least-squares planes of heights at the samples of some ellipses, linear between the nodes of the map.

    The pattern is symmetric about both axes, so that mean and slopes are found one by one. Samples that nobody knows
    count as the mean of the others, and a plane of which fewer than half are known comes down to the mean plane.

    Args:
        ellipses: As of `mark_ellipses`.
        pattern: As of `mark_ellipses`.
        side: As of `mark_ellipses`.
        corner_a: As of `mark_ellipses`.
        corner_b: As of `mark_ellipses`.
        row_of: Row of each piece in `pieces`, (rows, columns).
        pieces: Heights on the nodes [m], (pieces, cells + 1, cells + 1).
        found: Result, height at the middle [m], slopes along the long and the short axis [1], mean square of what is
            left [m^2], (n, 4).
    """
    cells, samples = pieces.shape[1] - 1, pattern.shape[0]
    per, squares_u, squares_v = 1 / side, 0.0, 0.0
    for k in range(samples):
        squares_u += pattern[k, 0] ** 2
        squares_v += pattern[k, 1] ** 2
    for n in range(ellipses.shape[0]):
        a, b, c, s, length, width = ellipses[n]
        known, total, squares, along, across, lean_u, lean_v = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(samples):
            u, v = pattern[k, 0] * length, pattern[k, 1] * width
            x, y = (a + u * c - v * s) * per, (b + u * s + v * c) * per
            big_i, big_j = math.floor(x), math.floor(y)
            x, y = (x - big_i) * cells, (y - big_j) * cells
            i, j = min(int(x), cells - 1), min(int(y), cells - 1)
            f, g = x - i, y - j
            p = row_of[big_i - corner_a, big_j - corner_b]
            low = pieces[p, i, j] + g * (pieces[p, i, j + 1] - pieces[p, i, j])
            high = pieces[p, i + 1, j] + g * (pieces[p, i + 1, j + 1] - pieces[p, i + 1, j])
            height = low + f * (high - low)
            if height == height:
                known += 1
                total += height
                squares += height * height
                along += pattern[k, 0] * height
                across += pattern[k, 1] * height
                lean_u += pattern[k, 0]
                lean_v += pattern[k, 1]
        mean = total / max(known, 1)
        along, across = (along - mean * lean_u) / squares_u, (across - mean * lean_v) / squares_v
        explained = mean * mean + (along * along * squares_u + across * across * squares_v) / samples
        share = min(1.0, 2.0 * known / samples)
        found[n, 0] = share * mean
        found[n, 1], found[n, 2] = share * along / length, share * across / width
        found[n, 3] = max(squares / max(known, 1) - explained, 0.0)
