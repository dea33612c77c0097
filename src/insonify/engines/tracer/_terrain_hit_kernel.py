"""First intersection of a straight ray with terrain, by a march over tiles of heights. Plain numbers and arrays only.

Heights of the seabed lie on square tiles of a map. Each tile has the highest point of itself and of its blocks of
cells, so a ray above them steps over whole squares; only in cells that it may touch is it compared with the terrain,
which is bilinear between the nodes. A tile that is not loaded yet is marked as missing and passed over.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

BLOCK = 8
"""Cells along the side of a block."""
NUDGE = 1e-7
"""Distance by which a ray is moved over the border of a square [m]."""
MAX_START_DEPTH = 1e-4
"""A ray that starts no deeper than this in the seabed stands on it [m]."""
HALVINGS = 24


class TerrainTiles(NamedTuple):
    """Heights about the mean plane, in pieces, and how to find them."""

    depth: float
    """Depth of the mean plane [m]."""
    cell: float
    """Side of a cell [m]; 0 for a flat bed, which needs none of the rest."""
    low: float
    """No ground is lower [m above the mean plane]."""
    high: float
    """No ground is higher [m above the mean plane]."""
    corner_a: int
    """Number of the first row of pieces in `row_of`."""
    corner_b: int
    """Number of the first column."""
    row_of: NDArray[np.int32]
    """Row of each piece in `tiles`, -1 where it is not there, (rows, columns)."""
    tiles: Singles
    """Heights on the nodes [m], (pieces, cells + 1, cells + 1)."""
    block_maxima: Singles
    """Highest node of each block [m], (pieces, blocks, blocks)."""
    tile_maxima: Singles
    """Highest node of each piece [m], (pieces,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def terrain_hit(
    x: float, y: float, z: float, u: float, v: float, w: float, start: float, stop: float, ground: TerrainTiles,
    missing: NDArray[np.bool_],
) -> float:  # fmt: skip
    """Distance along a ray at which it first reaches the seabed, infinite where it does not before `stop` [m].

    Args:
        x: First coordinate of the ray's origin, in the frame of the map [m].
        y: Second coordinate [m].
        z: Depth [m].
        u: Components of its unit vector [1].
        v: Second coordinate in the same frame [m].
        w: Third coordinate, positive down [m].
        start: Distance from which on it is tested [m].
        stop: Distance up to which it is tested [m].
        ground: The seabed.
        missing: Pieces that are not there and may matter are marked, shape of `ground.row_of`.
    """
    if ground.cell == 0.0:
        return _plane_hit(z, w, start, stop, ground.depth)
    if w > 0:
        start = max(start, (ground.depth - ground.high - z) / w)
        stop = min(stop, (ground.depth - ground.low - z) / w + ground.cell)
    elif w < 0:
        stop = min(stop, (ground.depth - ground.high - z) / w)
    elif z < ground.depth - ground.high:
        return math.inf
    cells = ground.tiles.shape[1] - 1
    at, first, blocks = start, True, cells // BLOCK
    while at < stop:
        a, b = (x + u * (at + NUDGE)) / ground.cell, (y + v * (at + NUDGE)) / ground.cell
        i, j = math.floor(a), math.floor(b)
        p, q = i // cells, j // cells
        row_p, row_q = p - ground.corner_a, q - ground.corner_b
        if row_p < 0 or row_q < 0 or row_p >= ground.row_of.shape[0] or row_q >= ground.row_of.shape[1]:
            return math.inf
        row = ground.row_of[row_p, row_q]
        if row < 0:
            missing[row_p, row_q] = True
            at, first = _cell_exit(x, y, u, v, at, p, q, cells * ground.cell), False
            continue
        if ground.depth - z - w * at > ground.tile_maxima[row]:
            out = min(stop, _cell_exit(x, y, u, v, at, p, q, cells * ground.cell))
            if ground.depth - z - w * (at if w < 0 else out) > ground.tile_maxima[row]:
                at, first = out, False
                continue
        m, n = (i - p * cells) // BLOCK, (j - q * cells) // BLOCK
        out = min(stop, _cell_exit(x, y, u, v, at, p * blocks + m, q * blocks + n, BLOCK * ground.cell))
        if ground.depth - z - w * (at if w < 0 else out) > ground.block_maxima[row, m, n]:
            at, first = out, False
            continue
        out = min(stop, _cell_exit(x, y, u, v, at, i, j, ground.cell))
        before = _height_above(x, y, z, u, v, w, at, i, j, row, ground)
        after = _height_above(x, y, z, u, v, w, out, i, j, row, ground)
        if before <= 0 and (not first or before < -MAX_START_DEPTH or after <= before):
            return at
        if after <= 0 < before:
            return _bisect_hit(x, y, z, u, v, w, at, out, i, j, row, ground)
        at, first = out, first and after <= 0
    return math.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _plane_hit(z: float, w: float, start: float, stop: float, depth: float) -> float:
    """Distance to a flat bed [m]."""
    if w <= 0:
        return math.inf
    way = (depth - z) / w
    return way if start <= way < stop else math.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _cell_exit(  # type: ignore[no-untyped-def]
    x, y, u, v, at, i, j, side
):
    """Distance at which a ray that is in a square of a number and a side leaves it, always beyond `at` [m]."""
    out = math.inf
    if u != 0:
        out = ((i + 1 if u > 0 else i) * side - x) / u
    if v != 0:
        out = min(out, ((j + 1 if v > 0 else j) * side - y) / v)
    return max(out, at + NUDGE)


@njit(cache=True, nogil=True, error_model="numpy")
def _height_above(  # type: ignore[no-untyped-def]
    x, y, z, u, v, w, at, i, j, row, ground
):
    """Height of a ray above the bilinear ground of one cell [m]; no number over a hole."""
    f, g = (x + u * at) / ground.cell - i, (y + v * at) / ground.cell - j
    cells = ground.tiles.shape[1] - 1
    m, n = i % cells, j % cells
    piece = ground.tiles[row]
    near = piece[m, n] + g * (piece[m, n + 1] - piece[m, n])
    far = piece[m + 1, n] + g * (piece[m + 1, n + 1] - piece[m + 1, n])
    return ground.depth - z - w * at - near - f * (far - near)


@njit(cache=True, nogil=True, error_model="numpy")
def _bisect_hit(  # type: ignore[no-untyped-def]
    x, y, z, u, v, w, above, below, i, j, row, ground
):
    """Distance at which a ray goes into the seabed of one cell, between two at which it is above and below [m]."""
    for _ in range(HALVINGS):
        middle = (above + below) / 2
        if _height_above(x, y, z, u, v, w, middle, i, j, row, ground) > 0:
            above = middle
        else:
            below = middle
    return above


@njit(cache=True, nogil=True, error_model="numpy")
def terrain_normal(x: float, y: float, ground: TerrainTiles, missing: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Unit normal of the seabed at a position, in the frame of the map, depth downwards [1]."""
    if ground.cell == 0.0:
        return 0.0, 0.0, -1.0
    cells = ground.tiles.shape[1] - 1
    a, b = x / ground.cell, y / ground.cell
    i, j = math.floor(a), math.floor(b)
    row_p, row_q = i // cells - ground.corner_a, j // cells - ground.corner_b
    row = ground.row_of[row_p, row_q]
    if row < 0:  # rounded over a border
        missing[row_p, row_q] = True
        return 0.0, 0.0, -1.0
    piece = ground.tiles[row]
    f, g, m, n = a - i, b - j, i % cells, j % cells
    along = (1 - g) * (piece[m + 1, n] - piece[m, n]) + g * (piece[m + 1, n + 1] - piece[m, n + 1])
    across = (1 - f) * (piece[m, n + 1] - piece[m, n]) + f * (piece[m + 1, n + 1] - piece[m + 1, n])
    p, q = along / ground.cell, across / ground.cell
    length = math.sqrt(1 + p * p + q * q)
    return -p / length, -q / length, -1 / length
