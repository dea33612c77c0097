"""Planes fitted to pieces of a map of heights: samples of an ellipse, least squares. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.scene.pages import CELLS, NODES, SHIFT, Pages

Floats = NDArray[np.floating[Any]]
MOST_SAMPLES = 32
_FAST = {"contract", "reassoc", "nsz", "arcp"}  # not "nnan": unknown ground is no number


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def fit_ellipse(
    a: float, b: float, c: float, s: float, length: float, width: float, pattern: Floats, pages: Pages,
    wanted: NDArray[np.bool_], at: NDArray[np.int32], inside: Floats, corners: Floats,
) -> tuple[bool, float, float, float, float]:  # fmt: skip
    """Least-squares plane of the heights at the samples of an ellipse, linear between the nodes of the map.

    The pattern is symmetric about both axes, so that mean and slopes are found one by one. Samples that nobody knows
    count as the mean of the others, and a plane of which fewer than half are known comes down to the mean plane.

    Args:
        a: Middle along the map's first axis [m].
        b: Along its second axis [m].
        c: Cosine of the long axis.
        s: Sine of the long axis.
        length: Half of it [m].
        width: Half of the short axis [m].
        pattern: Samples of the unit disc and, as a last row, the sums of their squares, (samples + 1, 2).
        pages: The map.
        wanted: Result, True for the pieces that are missing, (rows, columns) of pieces.
        at: Room for the cells of the samples, (2, `MOST_SAMPLES`).
        inside: Room for their places in the cells, likewise.
        corners: Room for the heights about them, float32, (4, `MOST_SAMPLES`).

    Returns:
        Whether no piece is missing; height at the middle [m], slopes along the long and the short axis [1], mean
        square of what is left [m^2].
    """
    samples, per = pattern.shape[0] - 1, 1 / pages.cell
    x0, y0 = a * per, b * per  # counted from the map's own corner, not the pages': what is kept must change no bit
    uc, us, vc, vs = length * c * per, length * s * per, width * c * per, width * s * per
    reach_a, reach_b = abs(uc) + abs(vs) + 1, abs(us) + abs(vc) + 1
    begin_a, begin_b = (pages.corner_a + 1) * CELLS, (pages.corner_b + 1) * CELLS
    end_a, end_b = begin_a + (wanted.shape[0] - 2) * CELLS, begin_b + (wanted.shape[1] - 2) * CELLS
    if not math.isfinite(x0 + y0 + reach_a + reach_b):
        return True, 0.0, 0.0, 0.0, 0.0
    if not (x0 - reach_a >= begin_a and x0 + reach_a < end_a and y0 - reach_b >= begin_b and y0 + reach_b < end_b):
        wanted[0, 0] = True
        return False, 0.0, 0.0, 0.0, 0.0
    flat, rows, columns = pages.heights, pages.row_of, np.int32(wanted.shape[1])
    corner_a, corner_b = np.int32(pages.corner_a), np.int32(pages.corner_b)
    piece, cell, f, g = at[0, :samples], at[1], inside[0], inside[1]
    for k in range(samples):
        x = x0 + pattern[k, 0] * uc - pattern[k, 1] * vs
        y = y0 + pattern[k, 0] * us + pattern[k, 1] * vc
        i, j = np.int32(math.floor(x)), np.int32(math.floor(y))
        f[k], g[k] = x - i, y - j
        piece[k] = ((i >> SHIFT) - corner_a) * columns + (j >> SHIFT) - corner_b
        cell[k] = (i & (CELLS - 1)) * NODES + (j & (CELLS - 1))
    least, here, beside, below, across_it = np.int32(0), corners[0], corners[1], corners[2], corners[3]
    for k in range(samples):
        row = rows[np.uint32(piece[k])]
        least = min(least, row)
        # without a sign, for a number that might be negative is checked each time
        first = np.uint64(max(row, np.int32(0))) * np.uint64(NODES * NODES) + np.uint64(cell[k])
        here[k], beside[k] = flat[first], flat[first + np.uint64(1)]
        below[k], across_it[k] = flat[first + np.uint64(NODES)], flat[first + np.uint64(NODES + 1)]
    total = squares = along = across = 0.0
    for k in range(samples):
        low = here[k] + g[k] * (beside[k] - here[k])
        high = below[k] + g[k] * (across_it[k] - below[k])
        height = low + f[k] * (high - low)
        total += height
        squares += height * height
        along += pattern[k, 0] * height
        across += pattern[k, 1] * height
    if least < 0:
        _mark(x0, y0, uc, us, vc, vs, pattern, pages, wanted)
        return False, 0.0, 0.0, 0.0, 0.0
    squares_u, squares_v = pattern[samples, 0], pattern[samples, 1]
    if total == total:
        mean, share = total / samples, 1.0
        along, across = along / squares_u, across / squares_v
        rest = squares / samples
    else:
        mean, along, across, rest, share = _known(x0, y0, uc, us, vc, vs, pattern, pages, wanted.shape[1])
    explained = mean * mean + (along * along * squares_u + across * across * squares_v) / samples
    return True, share * mean, share * along / length, share * across / width, max(rest - explained, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _mark(
    x0: float, y0: float, uc: float, us: float, vc: float, vs: float, pattern: Floats, pages: Pages,
    wanted: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Mark the pieces that samples lie on and that are missing; arguments as `fit_ellipse` makes them."""
    for k in range(pattern.shape[0] - 1):
        x, y = x0 + pattern[k, 0] * uc - pattern[k, 1] * vs, y0 + pattern[k, 0] * us + pattern[k, 1] * vc
        row, column = (math.floor(x) >> SHIFT) - pages.corner_a, (math.floor(y) >> SHIFT) - pages.corner_b
        if pages.row_of[row * wanted.shape[1] + column] < 0:
            wanted[row, column] = True


@njit(cache=True, nogil=True, error_model="numpy")
def _known(
    x0: float,
    y0: float,
    uc: float,
    us: float,
    vc: float,
    vs: float,
    pattern: Floats,
    pages: Pages,
    columns: int,
) -> tuple[float, float, float, float, float]:
    """Mean, slopes in units of the half axes, mean square and share, where some of the ground is unknown."""
    samples, known = pattern.shape[0] - 1, 0
    total = squares = along = across = lean_u = lean_v = 0.0
    for k in range(samples):
        u, v = pattern[k, 0], pattern[k, 1]
        x, y = x0 + u * uc - v * vs, y0 + u * us + v * vc
        i, j = math.floor(x), math.floor(y)
        f, g = x - i, y - j
        row, column = (i >> SHIFT) - pages.corner_a, (j >> SHIFT) - pages.corner_b
        first = pages.row_of[row * columns + column] * NODES * NODES
        piece = pages.heights[first : first + NODES * NODES].reshape(NODES, NODES)
        i, j = i & (CELLS - 1), j & (CELLS - 1)
        low = piece[i, j] + g * (piece[i, j + 1] - piece[i, j])
        high = piece[i + 1, j] + g * (piece[i + 1, j + 1] - piece[i + 1, j])
        height = low + f * (high - low)
        if height == height:
            known += 1
            total += height
            squares += height * height
            along += u * height
            across += v * height
            lean_u += u
            lean_v += v
    mean = total / max(known, 1)
    along, across = (along - mean * lean_u) / pattern[samples, 0], (across - mean * lean_v) / pattern[samples, 1]
    return mean, along, across, squares / max(known, 1), min(1.0, 2.0 * known / samples)
