"""What share of the scatterers of tiles is kept, part by part: the arithmetic of `engines.loudness`."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scene.lattice import BASE_PITCH, PARTS, TILE

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Frame = tuple[float, float, float, float]
"""North and east of the lattice's origin [m], cosine and sine of its heading."""


@njit(cache=True, nogil=True, error_model="numpy")
def share_of(gain: float, fewer: float, least: float) -> float:
    """Part of the scatterers that is kept, by the gain re that above which all are [1]."""
    gain = min(gain, 1.0)  # what is loud where nothing else is heard is any number of times louder
    return min(max(gain * gain, fewer * gain, least), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def shares(gain: Floats, fewer: float, least: float, found: Floats) -> None:
    """Parts of the scatterers that are kept where gains are so large, re that above which all are, into found (n,)."""
    for n in range(gain.size):
        found[n] = share_of(gain[n], fewer, least)


@njit(cache=True, nogil=True, error_model="numpy")
def places(
    level: Integers, along: Integers, across: Integers, rows: Integers, part: Floats, frame: Frame, there: Floats
) -> None:
    """North and east at the same parts of the sides of some tiles [m], into there (rows * parts * parts, 2).

    Args:
        level: Of all tiles, shape (tiles,).
        along: Number of each along the lattice's first axis, likewise.
        across: Along its second, likewise.
        rows: Which tiles are asked for.
        part: Parts of their sides [1].
        frame: Of the lattice.
        there: To be filled.
    """
    north, east, c, s = frame
    n = 0
    for t in rows:
        side = TILE * (BASE_PITCH * 2.0 ** level[t])
        for i in range(part.size):
            a = (along[t] + part[i]) * side
            for j in range(part.size):
                b = (across[t] + part[j]) * side
                there[n, 0], there[n, 1] = north + c * a - s * b, east + s * a + c * b
                n += 1


@njit(cache=True, nogil=True, error_model="numpy")
def odd_ones(whole: Floats, middle: Floats, row: Integers, peak: float) -> tuple[Integers, Integers]:
    """Tiles that are judged part by part, and those judged as a whole for which their middles do not speak.

    Args:
        whole: Loudest gain anywhere in each tile, re that above which all scatterers are kept, shape (tiles,).
        middle: Gain in its middle, likewise.
        row: -1 for one that is judged as a whole, likewise.
        peak: Gain re the loudest place from which on it speaks for that place [1].
    """
    many, odd = np.empty((2, whole.size), np.int64)
    m = n = 0
    for t in range(whole.size):
        if row[t] >= 0:
            many[m], m = t, m + 1
        elif middle[t] < peak * min(whole[t], 1.0):
            odd[n], n = t, n + 1
    return many[:m], odd[:n]


@njit(cache=True, nogil=True, error_model="numpy")
def lay_out(
    whole: Floats, middle: Floats, row: Integers, parts: Floats, many: Integers, at_parts: Floats, odd: Integers,
    at_ends: Floats, corner: Floats, loudest: Floats,
) -> None:  # fmt: skip
    """Gains at the corners of all parts of some tiles, and the loudest in each part.

    Args:
        whole: As of `odd_ones`.
        middle: Likewise.
        row: Row in `parts` of each tile, -1 for one that is judged as a whole, shape (tiles,).
        parts: Loudest gain in each part of some tiles, shape (any, PARTS, PARTS).
        many: As returned by `odd_ones`.
        at_parts: Gain at the corners of their parts, shape (many * (PARTS + 1)**2,).
        odd: As returned by `odd_ones`.
        at_ends: Gain at the corners of these tiles, shape (odd * 4,).
        corner: Result, shape (tiles, PARTS + 1, PARTS + 1).
        loudest: Result, shape (tiles, PARTS, PARTS).
    """
    for t in range(whole.size):
        corner[t] = middle[t]
        if row[t] < 0:
            loudest[t] = whole[t]
        else:
            loudest[t] = parts[row[t]]
    for m in range(many.size):
        for i in range(PARTS + 1):
            for j in range(PARTS + 1):
                corner[many[m], i, j] = at_parts[(m * (PARTS + 1) + i) * (PARTS + 1) + j]
    for m in range(odd.size):
        a, b, c, d = at_ends[4 * m], at_ends[4 * m + 1], at_ends[4 * m + 2], at_ends[4 * m + 3]
        for i in range(PARTS + 1):
            for j in range(PARTS + 1):
                x, y = i / PARTS, j / PARTS
                corner[odd[m], i, j] = (1 - x) * ((1 - y) * a + y * b) + x * ((1 - y) * c + y * d)


@njit(cache=True, nogil=True, error_model="numpy")
def peaks(
    corner: Floats, loudest: Floats, row: Integers, density: Floats, peak: float, fewer: float, least: float,
    peaked: NDArray[np.bool_], most: Floats,
) -> None:  # fmt: skip
    """Parts of tiles that hold a place much louder than their corners, and the largest share in each part.

    Args:
        corner: Gains re that above which all scatterers are kept, shape (tiles, PARTS + 1, PARTS + 1).
        loudest: Loudest gain in each part, or in the tile, shape (tiles, PARTS, PARTS).
        row: -1 for tiles of which the corners and the loudest place of all are told, shape (tiles,).
        density: Share that fills the sonar's cells, shape (tiles,).
        peak: Loudest corner re the loudest place below which it is [1].
        fewer: As of `share_of`.
        least: Likewise.
        peaked: Result, shape (tiles, PARTS, PARTS).
        most: Result, likewise: the share at the loudest place, or at the loudest corner where corners speak for a part.
    """
    for t in range(corner.shape[0]):
        for i in range(PARTS):
            for j in range(PARTS):
                near = _loudest_corner(corner[t], i, j, 1)
                known = _loudest_corner(corner[t], 0, 0, PARTS) if row[t] < 0 else near
                peaked[t, i, j] = known < peak * min(loudest[t, i, j], 1.0)
                top = loudest[t, i, j] if peaked[t, i, j] else min(loudest[t, i, j], near)
                most[t, i, j] = density[t] * share_of(top, fewer, least)


@njit(cache=True, nogil=True, error_model="numpy")
def _loudest_corner(corner: Floats, i: int, j: int, step: int) -> float:
    """Largest of four values at the corners of a square of so many parts."""
    low, high = max(corner[i, j], corner[i, j + step]), max(corner[i + step, j], corner[i + step, j + step])
    return max(low, high)
