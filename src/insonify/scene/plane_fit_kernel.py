"""Least-squares planes of terrain heights over ellipses, from tiles of the map. Plain numbers and arrays only."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scene.heightmap_cache import CELLS, NODES, SHIFT, HeightmapTiles

Floats = NDArray[np.floating[Any]]
Singles = NDArray[np.float32]
MAX_SAMPLES = 32
"""Largest number of samples of an ellipse, see `plane_fit_samples.FINE_PATTERN`."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}  # not "nnan": unknown terrain is NaN
_TILE, _NEXT_ROW, _SECOND_AXIS = np.uint64(NODES * NODES), np.uint64(NODES), np.uint64(MAX_SAMPLES)
"""Offsets: of a tile and of a row of nodes in the heights; of the second axis in the work arrays of samples."""
_CELL_MASK, _NODES = np.int32(CELLS - 1), np.int32(NODES)


class EllipsePatches(NamedTuple):
    """Ellipses over which planes are fitted, and the planes: n of each."""

    centre_a: Floats
    """Position of each centre along the first axis of the map [m], (n,)."""
    centre_b: Floats
    """Position of each centre along the second axis of the map [m], (n,)."""
    cosine: Floats
    """Cosine of the angle from the first axis of the map to the long axis [1], (n,)."""
    sine: Floats
    """Sine of that angle, positive towards the second axis [1], (n,)."""
    half_length: Floats
    """Half of the long axis [m], (n,)."""
    half_width: Floats
    """Half of the short axis [m], (n,)."""
    height: Floats
    """Result: height of the plane at the centre [m], (n,)."""
    along: Floats
    """Result: slope of the plane along the long axis [1], (n,)."""
    across: Floats
    """Result: slope of the plane along the short axis, a quarter turn beyond the long one [1], (n,)."""
    residual_variance: Floats
    """Result: mean square of the heights about the plane [m^2], (n,)."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def fit_planes(
    patches: EllipsePatches, count: int, pattern: Singles, heightmap: HeightmapTiles, missing: NDArray[np.bool_],
    known: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Fit least-squares planes to the heights at the samples of ellipses, linear between the nodes of the map.

    The pattern is symmetric about both axes, so that mean and slopes are independent. Samples without terrain count as
    the mean of the others. If fewer than half are known, the plane is scaled towards the mean plane of the seabed.

    Args:
        patches: The ellipses, and the result.
        count: Number of ellipses to be processed.
        pattern: Coordinates of samples in the unit disc along the long and the short axis [1] and, in the last column,
            the sums of the squares of these coordinates, (2, samples + 1).
        heightmap: Tiles of terrain heights.
        missing: Result: True for the tiles that are needed and not loaded, (rows, columns) of tiles; entry (0, 0): an
            ellipse reaches beyond the border of these tiles.
        known: Input: True for the ellipses to fit. Result: False for those of which a tile is missing, (n,).
    """
    samples, cells_per_metre = pattern.shape[1] - 1, 1 / heightmap.cell
    u, v, squares_u, squares_v = (
        pattern[0],
        pattern[1],
        np.float64(pattern[0, samples]),
        np.float64(pattern[1, samples]),
    )
    offsets, cells = np.empty(2 * MAX_SAMPLES, np.float32), np.empty(2 * MAX_SAMPLES, np.int32)
    heights, rows, tile_columns = heightmap.heights, heightmap.row_of, np.int32(missing.shape[1])
    corner_a, corner_b = heightmap.corner_a * CELLS, heightmap.corner_b * CELLS
    begin_a, begin_b = corner_a + CELLS, corner_b + CELLS
    end_a, end_b = corner_a + (missing.shape[0] - 1) * CELLS, corner_b + (missing.shape[1] - 1) * CELLS
    for q in range(np.uint64(count)):
        if not known[q]:
            continue
        half_length, half_width = patches.half_length[q], patches.half_width[q]
        # relative to the map's corner: results must not depend on the cached tiles
        x0, y0 = patches.centre_a[q] * cells_per_metre, patches.centre_b[q] * cells_per_metre
        uc, us, vc, vs = (
            half_length * cells_per_metre * patches.cosine[q],
            half_length * cells_per_metre * patches.sine[q],
            half_width * cells_per_metre * patches.cosine[q],
            half_width * cells_per_metre * patches.sine[q],
        )
        # not math.isfinite: its difference of a number and itself is optimised to 0 under fastmath
        if not abs(x0) + abs(y0) + abs(uc) + abs(us) + abs(vc) + abs(vs) < np.inf:
            patches.height[q] = patches.along[q] = patches.across[q] = patches.residual_variance[q] = 0.0
            continue
        reach_a, reach_b = abs(uc) + abs(vs) + 2, abs(us) + abs(vc) + 2
        if not (x0 - reach_a >= begin_a and x0 + reach_a < end_a and y0 - reach_b >= begin_b and y0 + reach_b < end_b):
            missing[0, 0], known[q] = True, False
            continue
        first_i, first_j = math.floor(x0), math.floor(y0)
        # float32: counted from the middle, to a ten-thousandth of a cell
        x, y = np.float32(x0 - first_i), np.float32(y0 - first_j)
        low_i, low_j = np.int32(first_i - corner_a), np.int32(first_j - corner_b)
        per_uc, per_us, per_vc, per_vs = np.float32(uc), np.float32(us), np.float32(vc), np.float32(vs)
        for k in range(np.uint64(samples)):
            from_x, from_y = x + u[k] * per_uc - v[k] * per_vs, y + u[k] * per_us + v[k] * per_vc
            whole_x, whole_y = np.floor(from_x), np.floor(from_y)
            offsets[k], offsets[_SECOND_AXIS + k] = from_x - whole_x, from_y - whole_y
            i, j = np.int32(low_i + np.int32(whole_x)), np.int32(low_j + np.int32(whole_y))
            cells[k] = np.int32(np.int32(np.int32(i >> SHIFT) * tile_columns) + np.int32(j >> SHIFT))
            cells[_SECOND_AXIS + k] = np.int32(np.int32(np.int32(i & _CELL_MASK) * _NODES) + np.int32(j & _CELL_MASK))
        total = squares = along = across = 0.0
        for k in range(np.uint64(samples)):  # scalar loads: vector gathers take twice as long
            row = rows[np.uint32(cells[k])]
            if row < 0:
                known[q] = False
                break
            # unsigned: a signed index costs a test
            first = np.uint64(np.uint32(row)) * _TILE + np.uint64(np.uint32(cells[_SECOND_AXIS + k]))
            f, g, corner, below = offsets[k], offsets[_SECOND_AXIS + k], heights[first], heights[first + _NEXT_ROW]
            low = corner + g * (heights[first + np.uint64(1)] - corner)
            high = below + g * (heights[first + _NEXT_ROW + np.uint64(1)] - below)
            height = np.float64(low + f * (high - low))
            total += height
            squares += height * height
            along += u[k] * height
            across += v[k] * height
        if not known[q]:
            for k in range(samples):
                if rows[cells[k]] < 0:
                    missing[cells[k] // tile_columns, cells[k] % tile_columns] = True
            continue
        mean, factor, mean_square = total / samples, 1.0, squares / samples
        along, across = along / squares_u, across / squares_v
        if total != total:
            mean, along, across, mean_square, factor = _partly_known(pattern, offsets, cells, heightmap)
        explained = mean * mean + (along * along * squares_u + across * across * squares_v) / samples
        patches.height[q], patches.along[q] = factor * mean, factor * along / half_length
        patches.across[q] = factor * across / half_width
        patches.residual_variance[q] = max(mean_square - explained, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _partly_known(
    pattern: Singles, offsets: Singles, cells: NDArray[np.int32], heightmap: HeightmapTiles
) -> tuple[float, float, float, float, float]:
    """Moments of the heights of one ellipse, some of which are NaN.

    Args:
        pattern: See `fit_planes`.
        offsets: Fractional position of each sample in its cell along the first, then the second axis, (2 MAX_SAMPLES,).
        cells: Tile of each sample, then its node in the tile, (2 MAX_SAMPLES,).
        heightmap: Tiles of terrain heights.

    Returns:
        Mean of the known heights [m], their change over half of the long axis, and of the short axis [m], their mean
        square [m^2], and the factor on the plane: 1, or twice the known fraction where that is less than half [1].
    """
    samples, known = pattern.shape[1] - 1, 0
    total = squares = along = across = sum_u = sum_v = 0.0
    for k in range(samples):
        u, v, first = pattern[0, k], pattern[1, k], heightmap.row_of[cells[k]] * NODES * NODES + cells[MAX_SAMPLES + k]
        corner, below = heightmap.heights[first], heightmap.heights[first + NODES]
        low = corner + offsets[MAX_SAMPLES + k] * (heightmap.heights[first + 1] - corner)
        high = below + offsets[MAX_SAMPLES + k] * (heightmap.heights[first + NODES + 1] - below)
        height = np.float64(low + offsets[k] * (high - low))
        if height == height:
            known += 1
            total += height
            squares += height * height
            along += u * height
            across += v * height
            sum_u += u
            sum_v += v
    mean = total / max(known, 1)
    along, across = (along - mean * sum_u) / pattern[0, samples], (across - mean * sum_v) / pattern[1, samples]
    return mean, along, across, squares / max(known, 1), min(1.0, 2.0 * known / samples)
