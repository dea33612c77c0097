"""Quadrature points of the water in tiles of shells about the sonar, and those that are kept by the gain at each."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamMajorants, array_cosines, cosine_bounds, largest_beam

Floats = NDArray[np.float64]
NEAREST = 1e-9
"""Shortest path whose direction is evaluated [m]."""


class ShellGrid(NamedTuple):
    """Shells about the sonar, sectors of azimuth, strata of depth."""

    shells: int
    """Number of shells of a tile."""
    slant: float
    """Step from shell to shell [m]."""
    azimuth: float
    """Width of a sector [rad]."""
    first_bearing: float
    """Bearing of the first sector [rad]."""
    source: Floats
    """North, east and depth of the middle of the shells [m], shape (3,)."""
    evenly: Floats
    """Irrational steps that spread priorities and positions evenly [1], shape (3,)."""


class StraightPaths(NamedTuple):
    """Straight paths of f families from the images of the sonar's ends, whose two-way gain is evaluated at points."""

    position: Floats
    """North and east of each end [m], shape (ends, 2)."""
    depth: Floats
    """Depth of the image of each end by each family [m], shape (ends, f)."""
    vertical_sign: Floats
    """Sign of the vertical direction at the sonar re that at the image [1], shape (f,)."""
    rise: Floats
    """Largest vertical displacement of the bounces of each family by relief [m], shape (f,)."""
    same_ends: bool
    """True: transmitter and receiver are one; its gain is squared."""


@njit(cache=True, nogil=True, error_model="numpy")
def multiply_gains(
    position: Floats, end: int, family: int, paths: StraightPaths, beams: BeamMajorants, gain: Floats
) -> None:
    """Multiply gains (n,) [1] by bounds of one end's pressure pattern towards the points (n, 3) [m] by one family."""
    north, east, depth = paths.position[end, 0], paths.position[end, 1], paths.depth[end, family]
    vertical_sign, rise = paths.vertical_sign[family], paths.rise[family]
    for n in range(gain.size):
        x, y, z = position[n, 0] - north, position[n, 1] - east, (position[n, 2] - depth) * vertical_sign
        length = max(math.sqrt(x * x + y * y + z * z), NEAREST)
        ratio = rise / length
        sine = ratio if ratio < 1.0 else 0.0
        cosine = math.sqrt(1.0 - sine * sine) if ratio < 1.0 else -1.0
        w, u, v = array_cosines(beams.axes, x / length, y / length, z / length)
        _, w_most = cosine_bounds(w, cosine, sine)
        span_right, span_down = cosine_bounds(u, cosine, sine), cosine_bounds(v, cosine, sine)
        gain[n] *= largest_beam(beams, w_most + 1e-12, span_right, span_down)


@njit(cache=True, nogil=True, error_model="numpy")
def two_way_gains(
    position: Floats, paths: StraightPaths, transmit: BeamMajorants, receive: BeamMajorants, largest: Floats
) -> None:
    """Fill upper bounds of the two-way pressure gain at some points (n, 3) [m] by any family [1], (n,)."""
    largest[:] = 0.0
    gain = np.empty(largest.size)
    for family in range(paths.vertical_sign.size):
        gain[:] = 1.0
        multiply_gains(position, 0, family, paths, transmit, gain)
        if paths.same_ends:
            gain *= gain
        else:
            multiply_gains(position, 1, family, paths, receive, gain)
        for n in range(gain.size):
            largest[n] = max(largest[n], gain[n])


@njit(cache=True, nogil=True, error_model="numpy")
def tile_points(
    tiles: Floats, probability: Floats, grid: ShellGrid, position: Floats, volume: Floats, number: NDArray[np.uint64],
    tile: NDArray[np.int64], priority: Floats,
) -> int:  # fmt: skip
    """Fill the quadrature points of some tiles with a priority below the largest keep probability in the tile.

    Args:
        tiles: Row of shells, sector, upper side [m], thickness [m], gain from which on all points are kept [1], (n, 5).
        probability: Largest keep probability in each tile [1], shape (n,).
        grid: Shells and sectors.
        position: North, east, depth of each point kept [m], shape (any, 3), filled.
        volume: Volume of its cell [m^3], shape (any,), filled.
        number: Key of the point, shape (any,), filled.
        tile: Index of its tile, shape (any,), filled.
        priority: Its priority [1], shape (any,), filled; priorities are evenly spread, in any direction.

    Returns:
        Number of points kept.
    """
    a, b, c = grid.evenly
    north, east, source_depth = grid.source
    kept = 0
    for t in range(tiles.shape[0]):
        top, thick = tiles[t, 2], tiles[t, 3]
        first, sector, stratum = int(tiles[t, 0]) * grid.shells, int(tiles[t, 1]), round(top / thick)
        for ring in range(first, first + grid.shells):
            rank = (ring * a + sector * b + stratum * c) % 1.0
            if rank >= probability[t]:
                continue
            slant = grid.slant * (ring + ((sector + 0.5) * a + stratum * b) % 1.0)
            depth = top + thick * (((ring + 0.5) * b + (sector + 0.5) * c) % 1.0)
            squared = slant**2 - (depth - source_depth) ** 2
            if squared <= 0.0:
                continue
            bearing = grid.first_bearing + (sector + ((ring + 0.5) * a + stratum * c) % 1.0) * grid.azimuth
            distance = math.sqrt(squared)
            position[kept, 0] = north + math.cos(bearing) * distance
            position[kept, 1] = east + math.sin(bearing) * distance
            position[kept, 2], tile[kept], priority[kept] = depth, t, rank
            volume[kept] = (ring + 0.5) * grid.slant**2 * grid.azimuth * thick
            number[kept] = np.uint64(ring << 38 | sector << 16 | stratum & 0xFFFF)
            kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy")
def thin_points(
    keep_probability: Floats, position: Floats, volume: Floats, number: NDArray[np.uint64], priority: Floats
) -> int:
    """Keep the points whose priority is below their keep probability, each with its volume over that probability.

    Args:
        keep_probability: Keep probability of each point [1], shape (n,).
        position: Positions [m], shape (n, 3), changed: the points kept move to the front.
        volume: Volumes [m^3], shape (n,), changed.
        number: Keys of the points, shape (n,), changed.
        priority: Priorities [1], shape (n,).

    Returns:
        Number of points kept.
    """
    kept = 0
    for n in range(keep_probability.size):
        if priority[n] < keep_probability[n]:
            position[kept], number[kept], volume[kept] = position[n], number[n], volume[n] / keep_probability[n]
            kept += 1
    return kept
