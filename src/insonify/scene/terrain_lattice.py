"""Terrain on the nodes of square lattices that are fixed to the world, in tiles that are kept.

Searches about a moving sonar read nearly the same nodes in every ping; a tile is evaluated once.
"""

import math
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.recent_results import RecentResults
from insonify.scene._lattice_filter_kernel import spline_coefficients, symmetric_filter
from insonify.scene.terrain.relief import Relief

Floats = NDArray[np.float64]

TILE_NODES = 64
"""Nodes along the side of a tile [1]."""
MAX_WINDOWS = 4
"""Number of ranges of whole tiles that are cached in one piece, some MB together [1]."""
MAX_TILES = 256
"""Number of cached tiles, of 32 or 64 kB each [1]."""
NODES_PER_WAVE = 8
"""Number of nodes along the shortest wave of a lattice, of whose height `_without_short_waves` keeps half [1]."""
STEPS_PER_OCTAVE = 16
"""Number of lattice steps in an octave: few lattices are made for a sonar that heaves [1]."""
SQUARES_PER_SIDE = 4
"""Number of positions along the side of a square at which rms slopes are evaluated [1]."""
HALF_RESPONSE = 0.249
"""Standard deviation of the Gaussian of `_without_short_waves` re the wave of whose height half remains [1]."""
FILTER_MARGIN = 32
"""Nodes around a tile, beyond which nothing changes its low-pass and spline coefficients by more than rounding [1]."""
SLOPE_SAMPLES = 33
"""Number of samples of the slope along the side of a square [1]."""


class LongWaves(NamedTuple):
    """Whole tiles of a lattice, without the waves that it does not resolve, about some range of nodes."""

    depth: Floats
    """Depth at the nodes [m], shape (a, b)."""
    coefficients: Floats
    """Coefficients of the cubic spline through it [m], shape (a, b)."""
    first: tuple[int, int]
    """Row and column of the first node of the range."""


class TerrainLattice:
    """Lattices of one terrain."""

    def __init__(self, depth: float, relief: Relief, shortest_wavelength: float) -> None:
        """Create lattices without tiles.

        Args:
            depth: Depth of the mean plane [m].
            relief: Relief on it.
            shortest_wavelength: Shortest wavelength of the relief [m].
        """
        self._depth, self._relief, self._shortest = depth, relief, shortest_wavelength
        self._tiles = RecentResults[tuple[Floats, ...]](MAX_TILES)
        self._windows = RecentResults[tuple[Floats, Floats]](MAX_WINDOWS)
        self._slopes = RecentResults[float](MAX_TILES)

    def resolved_wavelength(self, needed: float) -> float:
        """Shortest wavelength of a lattice, within 2.2 % of the one given, but at least that of the terrain [m].

        Args:
            needed: Wavelength below which nothing need be resolved [m].
        """
        octaves = round(STEPS_PER_OCTAVE * math.log2(max(needed / self._shortest, 1.0))) / STEPS_PER_OCTAVE
        return float(self._shortest * 2.0**octaves)

    def depth(self, wavelength: float, first: tuple[int, int], shape: tuple[int, int]) -> Floats:
        """Depth of the terrain at nodes of the lattice for waves from a given length on [m], NaN where it is unknown.

        Args:
            wavelength: Shortest wavelength, from `resolved_wavelength` [m]; the step is that over `NODES_PER_WAVE`.
            first: Numbers of the first node to the north and the east [steps].
            shape: Number of nodes along both axes.
        """
        rows, columns = _tile_numbers(first, shape)
        whole = _joined([[self._raw_tile(wavelength, row, column) for column in columns] for row in rows])
        return whole[window(_offset(first), shape)].copy()

    def long_waves(self, wavelength: float, first: tuple[int, int], shape: tuple[int, int]) -> LongWaves:
        """Terrain at the same nodes as `depth`, without waves that the lattice does not resolve; known everywhere.

        Arguments are those of `depth`.
        """
        rows, columns = _tile_numbers(first, shape)

        def assembled() -> tuple[Floats, Floats]:
            tiles = [[self._filtered_tile(wavelength, row, column) for column in columns] for row in rows]
            depth, coefficients = (_joined([[tile[k] for tile in along] for along in tiles]) for k in range(2))
            return depth, coefficients

        return LongWaves(*self._windows.get((wavelength, rows, columns), assembled), _offset(first))

    def rms_slope(self, middle: Floats, reach: float) -> float:
        """Rms of one horizontal component of the terrain's slope about a position [1]; NaN where it is unknown.

        Args:
            middle: North, east [m], shape (2,).
            reach: Approximate side of the sampled square [m].
        """
        side = 2.0 ** (round(STEPS_PER_OCTAVE * math.log2(reach)) / STEPS_PER_OCTAVE)
        row, column = (round(float(x) * SQUARES_PER_SIDE / side) for x in middle)
        return self._slopes.get((side, row, column), partial(self._sampled_slope, side, row, column))

    def _sampled_slope(self, side: float, row: int, column: int) -> float:
        """Rms slope in a square; row, column: position of its middle in quarters of its side [m] from the origin."""
        offset = np.linspace(-side, side, SLOPE_SAMPLES) / 2
        north, east = (number * side / SQUARES_PER_SIDE + offset for number in (row, column))
        slope = self._relief.sample(north[:, None], east[None, :]).slope
        known = slope[np.isfinite(slope)]
        return float(np.sqrt(np.mean(np.square(known)))) if known.size else math.nan

    def _raw_tile(self, wavelength: float, row: int, column: int) -> Floats:
        """Depth at the nodes of one tile [m], shape (TILE_NODES, TILE_NODES)."""
        step, node = wavelength / NODES_PER_WAVE, np.arange(TILE_NODES)

        def evaluated() -> tuple[Floats]:
            north, east = ((number * TILE_NODES + node) * step for number in (row, column))
            return (np.asarray(self._depth - self._relief.height(north[:, None], east[None, :])),)

        return self._tiles.get((wavelength, row, column, False), evaluated)[0]

    def _filtered_tile(self, wavelength: float, row: int, column: int) -> tuple[Floats, ...]:
        """Depth without short waves, and its spline coefficients, at the nodes of one tile [m]."""

        def evaluated() -> tuple[Floats, Floats]:
            size = TILE_NODES + 2 * FILTER_MARGIN
            first = row * TILE_NODES - FILTER_MARGIN, column * TILE_NODES - FILTER_MARGIN
            depth = self.depth(wavelength, first, (size, size))
            unknown = ~np.isfinite(depth)
            if unknown.any():
                depth[unknown] = self._depth if unknown.all() else depth[~unknown].mean()
            smooth = depth if wavelength <= self._shortest else _without_short_waves(depth)
            inner = (slice(FILTER_MARGIN, -FILTER_MARGIN),) * 2
            return smooth[inner].copy(), spline_coefficients(smooth)[inner].copy()

        return self._tiles.get((wavelength, row, column, True), evaluated)


def _joined(tiles: list[list[Floats]]) -> Floats:
    """Tiles side by side, row by row: `numpy.block` without its checks."""
    return np.concatenate([np.concatenate(along, axis=1) for along in tiles])


def _tile_numbers(first: tuple[int, int], shape: tuple[int, int]) -> tuple[range, ...]:
    """Numbers of the tiles that a range of nodes overlaps, to the north and the east."""
    pairs = zip(first, shape, strict=True)
    return tuple(range(start // TILE_NODES, -(-(start + count) // TILE_NODES)) for start, count in pairs)


def _offset(first: tuple[int, int]) -> tuple[int, int]:
    """Row and column of a node in its tile."""
    return first[0] % TILE_NODES, first[1] % TILE_NODES


def window(first: tuple[int, int], shape: tuple[int, int]) -> tuple[slice, slice]:
    """Slices of a range of nodes.

    Args:
        first: Row and column of the first.
        shape: Number of nodes along both axes.
    """
    return slice(first[0], first[0] + shape[0]), slice(first[1], first[1] + shape[1])


def _without_short_waves(depth: Floats) -> Floats:
    """Depth [m] without its waves shorter than `NODES_PER_WAVE` nodes: filter 1 - (1 - g)^2, with g a Gaussian.

    Half of the height of a wave of that length remains.

    A wave six times as long loses 0.1 % of its height; a Gaussian with the same half alone takes 1.9 %.
    """
    short = depth - symmetric_filter(depth, _gaussian())
    return np.asarray(depth - short + symmetric_filter(short, _gaussian()))


@cache
def _gaussian() -> Floats:
    """Weights of the Gaussian at distances 0, 1 ... up to four standard deviations [1]."""
    deviation = HALF_RESPONSE * NODES_PER_WAVE
    reach = round(4 * deviation)
    weights = np.exp(-0.5 / deviation**2 * np.arange(-reach, reach + 1) ** 2)
    return np.asarray(weights / weights.sum())[reach:]
