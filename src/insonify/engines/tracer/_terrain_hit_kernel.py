"""First intersection of a straight ray with terrain, by a march over tiles of heights. Plain numbers and arrays only.

Heights of the seabed are stored in square tiles of a map, with the maxima of each tile and of its blocks of cells, so
that a ray above them steps over whole squares; only in cells that it may touch is it compared with the terrain, which
is bilinear between the nodes. A tile that is not loaded yet is marked as missing and skipped.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Vector = tuple[float, float, float]

BLOCK = 8
"""Cells along the side of a block."""
NUDGE = 1e-7
"""Distance by which a ray is moved over the border of a square [m]."""
MAX_START_DEPTH = 1e-4
"""Depth below the seabed up to which a ray's origin counts as on the seabed [m]."""
BISECTIONS = 24


class TerrainTiles(NamedTuple):
    """Heights about the mean plane, in tiles, with the row of each tile."""

    depth: float
    """Depth of the mean plane [m]."""
    cell: float
    """Side of a cell [m]; 0 for a flat seabed, for which the other fields are not used."""
    low: float
    """Lower bound of the heights [m above the mean plane]."""
    high: float
    """Upper bound of the heights [m above the mean plane]."""
    corner_a: int
    """Number of the first row of tiles in `row_of`."""
    corner_b: int
    """Number of the first column."""
    row_of: NDArray[np.int32]
    """Row of each tile in `tiles`, -1 where it is not loaded, (rows, columns)."""
    tiles: Singles
    """Heights on the nodes [m], (tiles, cells + 1, cells + 1)."""
    block_maxima: Singles
    """Highest node of each block [m], (tiles, blocks, blocks)."""
    tile_maxima: Singles
    """Highest node of each tile [m], (tiles,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def terrain_hit(
    origin: Vector, direction: Vector, start: float, stop: float, ground: TerrainTiles, missing: NDArray[np.bool_]
) -> float:  # fmt: skip
    """Distance along a ray at which it first reaches the seabed, infinite where it does not before `stop` [m].

    Args:
        origin: The ray's origin in the frame of the map, the third coordinate its depth [m].
        direction: The ray's unit vector, the third component positive down [1].
        start: Distance from which the ray is tested [m].
        stop: Distance up to which the ray is tested [m].
        ground: The seabed.
        missing: Result, True for tiles that the ray crosses and that are not loaded, shape of `ground.row_of`.
    """
    x, y, z = origin
    u, v, w = direction
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
        before = _height_above(origin, direction, at, i, j, row, ground)
        after = _height_above(origin, direction, out, i, j, row, ground)
        if before <= 0 and (not first or before < -MAX_START_DEPTH or after <= before):
            return at
        if after <= 0 < before:
            return _bisect_hit(origin, direction, (at, out), i, j, row, ground)
        at, first = out, first and after <= 0
    return math.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _plane_hit(z: float, w: float, start: float, stop: float, depth: float) -> float:
    """Distance along a ray to a flat seabed [m], infinite outside `start` to `stop`."""
    if w <= 0:
        return math.inf
    distance = (depth - z) / w
    return distance if start <= distance < stop else math.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _cell_exit(  # type: ignore[no-untyped-def]
    x, y, u, v, at, i, j, side
):
    """Distance along a ray at which it leaves square (i, j) of a grid of given side, always beyond `at` [m]."""
    out = math.inf
    if u != 0:
        out = ((i + 1 if u > 0 else i) * side - x) / u
    if v != 0:
        out = min(out, ((j + 1 if v > 0 else j) * side - y) / v)
    return max(out, at + NUDGE)


@njit(cache=True, nogil=True, error_model="numpy")
def _height_above(  # type: ignore[no-untyped-def]
    origin, direction, at, i, j, row, ground
):
    """Height of a ray above the bilinear terrain of one cell [m]; NaN over a gap in the terrain."""
    x, y, z = origin
    u, v, w = direction
    f, g = (x + u * at) / ground.cell - i, (y + v * at) / ground.cell - j
    cells = ground.tiles.shape[1] - 1
    m, n = i % cells, j % cells
    tile = ground.tiles[row]
    near = tile[m, n] + g * (tile[m, n + 1] - tile[m, n])
    far = tile[m + 1, n] + g * (tile[m + 1, n + 1] - tile[m + 1, n])
    return ground.depth - z - w * at - near - f * (far - near)


@njit(cache=True, nogil=True, error_model="numpy")
def _bisect_hit(  # type: ignore[no-untyped-def]
    origin, direction, distances, i, j, row, ground
):
    """Distance at which a ray enters the seabed in one cell [m], by bisection between distances above and below it."""
    above, below = distances
    for _ in range(BISECTIONS):
        middle = (above + below) / 2
        if _height_above(origin, direction, middle, i, j, row, ground) > 0:
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
    if row < 0:  # position rounded across the tile's border
        missing[row_p, row_q] = True
        return 0.0, 0.0, -1.0
    tile = ground.tiles[row]
    f, g, m, n = a - i, b - j, i % cells, j % cells
    along = (1 - g) * (tile[m + 1, n] - tile[m, n]) + g * (tile[m + 1, n + 1] - tile[m, n + 1])
    across = (1 - f) * (tile[m, n + 1] - tile[m, n]) + f * (tile[m + 1, n + 1] - tile[m + 1, n])
    p, q = along / ground.cell, across / ground.cell
    length = math.sqrt(1 + p * p + q * q)
    return -p / length, -q / length, -1 / length
