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
"""Number of cells along the side of a block."""
BORDER_STEP = 1e-7
"""Distance by which a ray is moved over the border of a square [m]."""
MAX_START_DEPTH = 1e-4
"""Depth below the seabed up to which a ray's origin counts as on the seabed [m]."""
BISECTIONS = 24
"""Number of bisections by which a hit within a cell is found."""


class TerrainTiles(NamedTuple):
    """Heights above the mean seabed, in tiles, with the row of each tile."""

    depth: float
    """Depth of the mean seabed [m]."""
    cell: float
    """Side of a cell [m]; 0 for a flat seabed, for which the other fields are not used."""
    low: float
    """Lower bound of the heights [m]."""
    high: float
    """Upper bound of the heights [m]."""
    corner_a: int
    """Number, in the map, of the first row of tiles in `row_of_tile`."""
    corner_b: int
    """Number of the first column."""
    row_of_tile: NDArray[np.int32]
    """Row of each tile in `tiles`, -1 where it is not loaded, (rows, columns)."""
    tiles: Singles
    """Heights on the nodes [m], (tiles, cells + 1, cells + 1)."""
    block_maxima: Singles
    """Highest node of each block [m], (tiles, blocks, blocks)."""
    tile_maxima: Singles
    """Highest node of each tile [m], (tiles,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def terrain_hit(
    origin: Vector, direction: Vector, start: float, stop: float, terrain: TerrainTiles, missing: NDArray[np.bool_]
) -> float:  # fmt: skip
    """Distance along a ray at which it first reaches the seabed, infinite where it does not before `stop` [m].

    Args:
        origin: The ray's origin in the frame of the map, the third coordinate its depth [m].
        direction: The ray's unit vector, the third component positive down [1].
        start: Distance from which the ray is tested [m].
        stop: Distance up to which the ray is tested [m].
        terrain: The seabed.
        missing: Result, True for tiles that the ray crosses and that are not loaded, shape of `terrain.row_of_tile`.
    """
    x, y, z = origin
    u, v, w = direction
    if terrain.cell == 0.0:
        return _plane_hit(z, w, start, stop, terrain.depth)
    if w > 0:
        start = max(start, (terrain.depth - terrain.high - z) / w)
        stop = min(stop, (terrain.depth - terrain.low - z) / w + terrain.cell)
    elif w < 0:
        stop = min(stop, (terrain.depth - terrain.high - z) / w)
    elif z < terrain.depth - terrain.high:
        return math.inf
    cells = terrain.tiles.shape[1] - 1
    distance, is_start, blocks = start, True, cells // BLOCK
    while distance < stop:
        a, b = (x + u * (distance + BORDER_STEP)) / terrain.cell, (y + v * (distance + BORDER_STEP)) / terrain.cell
        i, j = math.floor(a), math.floor(b)
        p, q = i // cells, j // cells
        row_p, row_q = p - terrain.corner_a, q - terrain.corner_b
        if row_p < 0 or row_q < 0 or row_p >= terrain.row_of_tile.shape[0] or row_q >= terrain.row_of_tile.shape[1]:
            return math.inf
        row = terrain.row_of_tile[row_p, row_q]
        if row < 0:
            missing[row_p, row_q] = True
            distance, is_start = _cell_exit(x, y, u, v, distance, p, q, cells * terrain.cell), False
            continue
        if terrain.depth - z - w * distance > terrain.tile_maxima[row]:
            exit_distance = min(stop, _cell_exit(x, y, u, v, distance, p, q, cells * terrain.cell))
            if terrain.depth - z - w * (distance if w < 0 else exit_distance) > terrain.tile_maxima[row]:
                distance, is_start = exit_distance, False
                continue
        m, n = (i - p * cells) // BLOCK, (j - q * cells) // BLOCK
        exit_distance = min(
            stop, _cell_exit(x, y, u, v, distance, p * blocks + m, q * blocks + n, BLOCK * terrain.cell)
        )
        if terrain.depth - z - w * (distance if w < 0 else exit_distance) > terrain.block_maxima[row, m, n]:
            distance, is_start = exit_distance, False
            continue
        exit_distance = min(stop, _cell_exit(x, y, u, v, distance, i, j, terrain.cell))
        height_before = _height_above(origin, direction, distance, i, j, row, terrain)
        height_after = _height_above(origin, direction, exit_distance, i, j, row, terrain)
        if height_before <= 0 and (not is_start or height_before < -MAX_START_DEPTH or height_after <= height_before):
            return distance
        if height_after <= 0 < height_before:
            return _bisect_hit(origin, direction, (distance, exit_distance), i, j, row, terrain)
        distance, is_start = exit_distance, is_start and height_after <= 0
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
    x, y, u, v, distance, i, j, side
):
    """Distance along a ray at which it leaves square (i, j) of a grid of given side, always beyond `distance` [m]."""
    exit_distance = math.inf
    if u != 0:
        exit_distance = ((i + 1 if u > 0 else i) * side - x) / u
    if v != 0:
        exit_distance = min(exit_distance, ((j + 1 if v > 0 else j) * side - y) / v)
    return max(exit_distance, distance + BORDER_STEP)


@njit(cache=True, nogil=True, error_model="numpy")
def _height_above(  # type: ignore[no-untyped-def]
    origin, direction, distance, i, j, row, terrain
):
    """Height of a ray above the bilinear terrain of one cell [m]; NaN over a gap in the terrain."""
    x, y, z = origin
    u, v, w = direction
    f, g = (x + u * distance) / terrain.cell - i, (y + v * distance) / terrain.cell - j
    cells = terrain.tiles.shape[1] - 1
    m, n = i % cells, j % cells
    tile = terrain.tiles[row]
    near = tile[m, n] + g * (tile[m, n + 1] - tile[m, n])
    far = tile[m + 1, n] + g * (tile[m + 1, n + 1] - tile[m + 1, n])
    return terrain.depth - z - w * distance - near - f * (far - near)


@njit(cache=True, nogil=True, error_model="numpy")
def _bisect_hit(  # type: ignore[no-untyped-def]
    origin, direction, distances, i, j, row, terrain
):
    """Distance at which a ray enters the seabed in one cell [m], by bisection between distances above and below it."""
    above, below = distances
    for _ in range(BISECTIONS):
        middle = (above + below) / 2
        if _height_above(origin, direction, middle, i, j, row, terrain) > 0:
            above = middle
        else:
            below = middle
    return above


@njit(cache=True, nogil=True, error_model="numpy")
def terrain_normal(x: float, y: float, terrain: TerrainTiles, missing: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Unit normal of the seabed at a position, in the frame of the map, depth downwards [1]."""
    if terrain.cell == 0.0:
        return 0.0, 0.0, -1.0
    cells = terrain.tiles.shape[1] - 1
    a, b = x / terrain.cell, y / terrain.cell
    i, j = math.floor(a), math.floor(b)
    row_p, row_q = i // cells - terrain.corner_a, j // cells - terrain.corner_b
    row = terrain.row_of_tile[row_p, row_q]
    if row < 0:  # position rounded across the tile's border
        missing[row_p, row_q] = True
        return 0.0, 0.0, -1.0
    tile = terrain.tiles[row]
    f, g, m, n = a - i, b - j, i % cells, j % cells
    along = (1 - g) * (tile[m + 1, n] - tile[m, n]) + g * (tile[m + 1, n + 1] - tile[m, n + 1])
    across = (1 - f) * (tile[m, n + 1] - tile[m, n]) + f * (tile[m + 1, n + 1] - tile[m + 1, n])
    p, q = along / terrain.cell, across / terrain.cell
    length = math.sqrt(1 + p * p + q * q)
    return -p / length, -q / length, -1 / length
