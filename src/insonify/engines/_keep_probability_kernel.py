"""Keep probabilities of the scatterers of tiles, part by part: the arithmetic of `engines.beam_importance`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scene.scatterer_grid import BASE_PITCH, PARTS, TILE

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
GridFrame = tuple[float, float, float, float]
"""North and east of the scatterer grid's origin [m], cosine and sine of its heading."""


class GainBounds(NamedTuple):
    """Upper bounds of the gain over n tiles."""

    density: Floats
    """Fraction of each tile's scatterers that fills the sonar's cells [1], shape (n,): scales are powers of two."""
    tile_gain: Floats
    """Largest two-way pressure gain anywhere in each tile, re that above which all scatterers are kept [1], (n,)."""
    centre_gain: Floats
    """Two-way pressure gain in the middle of each tile, re that above which all scatterers are kept [1], (n,)."""
    row: Integers
    """Row of each tile in `part_gains`, -1 for one with few scatterers that is evaluated as a whole, shape (n,)."""
    part_gains: Floats
    """Largest gain in each part of some tiles, re the same [1], shape (any, PARTS, PARTS)."""

    def take(self, rows: slice) -> "GainBounds":
        """Bounds of some tiles."""
        return GainBounds(
            self.density[rows], self.tile_gain[rows], self.centre_gain[rows], self.row[rows], self.part_gains
        )


@njit(cache=True, nogil=True, error_model="numpy")
def keep_probability_of(gain: float, linear_below: float, min_probability: float) -> float:
    """Keep probability of scatterers [1].

    Args:
        gain: Two-way pressure gain re that above which all scatterers are kept [1].
        linear_below: Gain below which the probability is proportional to it instead of its square [1].
        min_probability: Smallest keep probability [1].
    """
    gain = min(gain, 1.0)  # where nothing else arrives, the ratio has no upper bound
    return min(max(gain * gain, linear_below * gain, min_probability), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def keep_probabilities(gain: Floats, linear_below: float, min_probability: float, probability: Floats) -> None:
    """Fill keep probabilities of scatterers by their gains; arguments are those of `keep_probability_of`, (n,)."""
    for n in range(gain.size):
        probability[n] = keep_probability_of(gain[n], linear_below, min_probability)


@njit(cache=True, nogil=True, error_model="numpy")
def grid_positions(
    scale: Integers, along: Integers, across: Integers, rows: Integers, part: Floats, frame: GridFrame, position: Floats
) -> None:
    """Fill north and east of a square lattice of positions in each of some tiles.

    Args:
        scale: Scale of each tile, shape (tiles,).
        along: Number of each along the scatterer grid's first axis, shape (tiles,).
        across: Number of each along its second axis, shape (tiles,).
        rows: Rows of the requested tiles, shape (m,).
        part: Positions along both sides of a tile, re its side [1], shape (k,).
        frame: Frame of the scatterer grid.
        position: Result [m], shape (m k^2, 2).
    """
    north, east, c, s = frame
    n = 0
    for t in rows:
        side = TILE * (BASE_PITCH * 2.0 ** scale[t])
        for i in range(part.size):
            a = (along[t] + part[i]) * side
            for j in range(part.size):
                b = (across[t] + part[j]) * side
                position[n, 0], position[n, 1] = north + c * a - s * b, east + s * a + c * b
                n += 1


@njit(cache=True, nogil=True, error_model="numpy")
def classify_tiles(tile_gain: Floats, centre_gain: Floats, row: Integers, peak: float) -> tuple[Integers, Integers]:
    """Tiles that are evaluated part by part, and those evaluated as a whole with a gain that is not uniform.

    Args:
        tile_gain: Largest gain anywhere in each tile, re that above which all scatterers are kept, shape (tiles,).
        centre_gain: Gain in its middle, re the same, shape (tiles,).
        row: -1 for a tile that is evaluated as a whole, shape (tiles,).
        peak: Gain in the middle of a tile re its largest, above which the tile counts as uniform [1].

    Returns:
        Rows of the tiles of either kind.
    """
    by_part, nonuniform = np.empty((2, tile_gain.size), np.int64)
    m = n = 0
    for t in range(tile_gain.size):
        if row[t] >= 0:
            by_part[m], m = t, m + 1
        elif centre_gain[t] < peak * min(tile_gain[t], 1.0):
            nonuniform[n], n = t, n + 1
    return by_part[:m], nonuniform[:n]


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate_corner_gains(
    bounds: GainBounds, by_part: Integers, at_parts: Floats, nonuniform: Integers, at_ends: Floats, corner: Floats,
    largest: Floats,
) -> None:  # fmt: skip
    """Fill gains at the corners of all parts of some tiles, and the largest gain in each part.

    Args:
        bounds: Upper bounds of the gain over the tiles.
        by_part: First result of `classify_tiles`, shape (m,).
        at_parts: Gain at the corners of their parts, shape (m * (PARTS + 1)**2,).
        nonuniform: Second result of `classify_tiles`, shape (k,).
        at_ends: Gain at the corners of these tiles, shape (4 k,).
        corner: Result, shape (tiles, PARTS + 1, PARTS + 1).
        largest: Result, shape (tiles, PARTS, PARTS).
    """
    _, tile_gain, centre_gain, row, parts = bounds
    for t in range(tile_gain.size):
        corner[t, :, :] = centre_gain[t]
        for i in range(PARTS):
            for j in range(PARTS):
                largest[t, i, j] = tile_gain[t] if row[t] < 0 else parts[row[t], i, j]
    for m in range(by_part.size):
        for i in range(PARTS + 1):
            for j in range(PARTS + 1):
                corner[by_part[m], i, j] = at_parts[(m * (PARTS + 1) + i) * (PARTS + 1) + j]
    for m in range(nonuniform.size):
        a, b, c, d = at_ends[4 * m], at_ends[4 * m + 1], at_ends[4 * m + 2], at_ends[4 * m + 3]
        for i in range(PARTS + 1):
            for j in range(PARTS + 1):
                x, y = i / PARTS, j / PARTS
                corner[nonuniform[m], i, j] = (1 - x) * ((1 - y) * a + y * b) + x * ((1 - y) * c + y * d)


@njit(cache=True, nogil=True, error_model="numpy")
def find_peaked_parts(
    corner: Floats, largest: Floats, bounds: GainBounds, peak: float, linear_below: float, min_probability: float,
    is_peaked: NDArray[np.bool_], max_probability_of_part: Floats,
) -> None:  # fmt: skip
    """Find parts of tiles with a gain peak far above their corners; fill the largest keep probability of each part.

    Args:
        corner: Gains re that above which all scatterers are kept, shape (tiles, PARTS + 1, PARTS + 1).
        largest: Largest gain in each part, or in the tile, shape (tiles, PARTS, PARTS).
        bounds: Upper bounds of the gain over the tiles; a tile evaluated as a whole has one peak or none in all parts.
        peak: Largest gain at a corner, re the largest gain of the part, below which the part has a peak [1].
        linear_below: See `keep_probability_of`.
        min_probability: See `keep_probability_of`.
        is_peaked: Result, True for such parts, shape (tiles, PARTS, PARTS).
        max_probability_of_part: Result, shape (tiles, PARTS, PARTS): the keep probability at the position of largest
            gain, or at the largest corner in parts without a gain peak.
    """
    density, row = bounds.density, bounds.row
    for t in range(corner.shape[0]):
        for i in range(PARTS):
            for j in range(PARTS):
                part_corner_gain = _max_corner_gain(corner[t], i, j, 1)
                corner_gain = _max_corner_gain(corner[t], 0, 0, PARTS) if row[t] < 0 else part_corner_gain
                is_peaked[t, i, j] = corner_gain < peak * min(largest[t, i, j], 1.0)
                top = largest[t, i, j] if is_peaked[t, i, j] else min(largest[t, i, j], part_corner_gain)
                max_probability_of_part[t, i, j] = density[t] * keep_probability_of(top, linear_below, min_probability)


@njit(cache=True, nogil=True, error_model="numpy")
def _max_corner_gain(corner: Floats, i: int, j: int, step: int) -> float:
    """Largest gain at the corners of the square from node (i, j) to node (i + step, j + step)."""
    low, high = max(corner[i, j], corner[i, j + step]), max(corner[i + step, j], corner[i + step, j + step])
    return max(low, high)
