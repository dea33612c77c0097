"""Quadrature points in rings of slant range and sectors of azimuth about a sonar. Plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

GOLDEN = 0.6180339887498949
"""Inverse of the golden ratio."""
_RING_STEP, _SECTOR_STEP = 0.7548776662466927, 0.5698402909980532
"""Steps of the priority from ring to ring and from sector to sector [1]: the inverse of the plastic number, and its
square. Their multiples fill the unit interval most evenly in two dimensions, and have no rational ratio to `GOLDEN`, by
which points are shifted within their cells."""


@njit(cache=True, nogil=True, error_model="numpy")
def priority(ring: int, sector: int) -> float:
    """Priority of a cell, 0 to 1: the cells below any priority are evenly spread along rings and along sectors."""
    steps = (ring + 0.5) * _RING_STEP + (sector + 0.5) * _SECTOR_STEP
    return steps - math.floor(steps)


@njit(cache=True, nogil=True, error_model="numpy")
def piece_edges(
    tiles: Integers, shape: tuple[int, int, int], slant: float, height: float, nearest: float, azimuth: float,
    origin: tuple[float, float, float], position: Floats,
) -> None:  # fmt: skip
    """Fill north and east of the inner and outer ends of the pieces of tiles, in the middle of each sector.

    Args:
        tiles: Index of each tile in slant range and in azimuth, (tiles, 2).
        shape: Number of rings of a tile, of pieces into which they are divided, and of sectors of a tile.
        slant: Slant range from ring to ring [m].
        height: Height of the sonar above the boundary [m].
        nearest: Least slant range of an end [m].
        azimuth: Angle from sector to sector [rad].
        origin: North and east of the sonar [m], bearing of the first sector [rad].
        position: Result [m], (tiles * (pieces + 1) * sectors, 2).
    """
    rings, pieces, sectors = shape
    rings_per_piece, n = rings / pieces, 0
    for t in range(tiles.shape[0]):
        for k in range(pieces + 1):
            reach = max((tiles[t, 0] * rings + k * rings_per_piece) * slant, nearest)
            distance = math.sqrt(max(reach * reach - height * height, 0.0))
            for j in range(sectors):
                bearing = origin[2] + (tiles[t, 1] * sectors + j + 0.5) * azimuth
                position[n, 0] = origin[0] + distance * math.cos(bearing)
                position[n, 1] = origin[1] + distance * math.sin(bearing)
                n += 1


@njit(cache=True, nogil=True, error_model="numpy")
def kept_points(
    tiles: Integers, keep_probability: Floats, rings: int, slant: float, height: float, azimuth: float,
    origin: tuple[float, float, float], position: Floats, area: Floats, key: NDArray[np.uint64],
) -> int:  # fmt: skip
    """Fill points of the cells with a priority below the keep probability of their piece; return their number.

    Args:
        tiles: See `piece_edges`.
        keep_probability: Fraction of the cells of each piece that is kept [1], (tiles, pieces, sectors).
        rings: Number of rings of a tile.
        slant: See `piece_edges`.
        height: See `piece_edges`.
        azimuth: See `piece_edges`.
        origin: See `piece_edges`.
        position: Result, north and east [m], (at least all, 2).
        area: Result, area that each represents: that of its cell over the keep probability [m^2].
        key: Result, numbers of ring and sector packed in 64 bits.
    """
    pieces, sectors = keep_probability.shape[1], keep_probability.shape[2]
    rings_per_piece, n = rings // pieces, 0
    cosine, sine, across = np.empty(sectors), np.empty(sectors), np.empty(sectors)
    for t in range(tiles.shape[0]):
        first = tiles[t, 1] * sectors
        for j in range(sectors):
            cosine[j] = math.cos(origin[2] + (first + j) * azimuth)
            sine[j] = math.sin(origin[2] + (first + j) * azimuth)
            across[j] = (first + j + 0.5) * GOLDEN
            across[j] -= math.floor(across[j])
        for k in range(rings):
            ring = tiles[t, 0] * rings + k
            inner, outer = max(ring * slant, height), (ring + 1) * slant
            if outer <= inner:
                continue
            own, shift = (outer * outer - inner * inner) / 2 * azimuth, (ring + 0.5) * GOLDEN
            shift -= math.floor(shift)
            cos_shift, sin_shift = math.cos(shift * azimuth), math.sin(shift * azimuth)
            for j in range(sectors):
                cell_probability = keep_probability[t, k // rings_per_piece, j]
                if priority(ring, first + j) >= cell_probability:
                    continue
                reach = inner + (outer - inner) * across[j]
                distance = math.sqrt(max(reach * reach - height * height, 0.0))
                position[n, 0] = origin[0] + distance * (cosine[j] * cos_shift - sine[j] * sin_shift)
                position[n, 1] = origin[1] + distance * (sine[j] * cos_shift + cosine[j] * sin_shift)
                area[n] = own / cell_probability
                key[n] = np.uint64(ring << 29 | (first + j))
                n += 1
    return n
