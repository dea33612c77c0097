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
_FAST = {"contract", "reassoc", "nsz", "arcp"}  # not "nnan": unknown terrain is NaN
_TILE, _DOWN, _NEXT = np.uint64(NODES * NODES), np.uint64(NODES), np.uint64(MAX_SAMPLES)
_INSIDE, _NODES = np.int32(CELLS - 1), np.int32(NODES)


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
    """Least-squares planes of the heights at the samples of ellipses, linear between the nodes of the map.

    The pattern is symmetric about both axes, so that mean and slopes are independent. Samples without terrain count as
    the mean of the others. With fewer than half of them known, the plane is scaled towards the mean plane of the bed.

    Args:
        patches: The ellipses, and the result.
        count: Number of them.
        pattern: Coordinates of samples in the unit disc along the long and the short axis [1] and, in the last column,
            the sums of their squares, (2, samples + 1).
        heightmap: Tiles of terrain heights.
        missing: Result: True for the tiles that are needed and not loaded, (rows, columns) of tiles.
        known: Input: True for the ellipses to fit. Result: False for those of which a tile is missing, (n,).
    """
    samples, per = pattern.shape[1] - 1, 1 / heightmap.cell
    u, v, squares_u, squares_v = (
        pattern[0],
        pattern[1],
        np.float64(pattern[0, samples]),
        np.float64(pattern[1, samples]),
    )
    at, cells = np.empty(2 * MAX_SAMPLES, np.float32), np.empty(2 * MAX_SAMPLES, np.int32)
    flat, rows, wide = heightmap.heights, heightmap.row_of, np.int32(missing.shape[1])
    corner_a, corner_b = heightmap.corner_a * CELLS, heightmap.corner_b * CELLS
    begin_a, begin_b = corner_a + CELLS, corner_b + CELLS
    end_a, end_b = corner_a + (missing.shape[0] - 1) * CELLS, corner_b + (missing.shape[1] - 1) * CELLS
    for q in range(np.uint64(count)):
        if not known[q]:
            continue
        length, width = patches.half_length[q], patches.half_width[q]
        # from the map's own corner: other cached tiles must change no bit
        x0, y0 = patches.centre_a[q] * per, patches.centre_b[q] * per
        uc, us, vc, vs = (
            length * per * patches.cosine[q],
            length * per * patches.sine[q],
            width * per * patches.cosine[q],
            width * per * patches.sine[q],
        )
        # not math.isfinite: it takes a number from itself, which is 0 where sums may be put in any order
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
            at[k], at[_NEXT + k] = from_x - whole_x, from_y - whole_y
            i, j = np.int32(low_i + np.int32(whole_x)), np.int32(low_j + np.int32(whole_y))
            cells[k] = np.int32(np.int32(np.int32(i >> SHIFT) * wide) + np.int32(j >> SHIFT))
            cells[_NEXT + k] = np.int32(np.int32(np.int32(i & _INSIDE) * _NODES) + np.int32(j & _INSIDE))
        total = squares = along = across = 0.0
        for k in range(np.uint64(samples)):  # one by one: gathered, they take twice as long
            row = rows[np.uint32(cells[k])]
            if row < 0:
                known[q] = False
                break
            # without a sign, for a number that might be negative is checked each time
            first = np.uint64(np.uint32(row)) * _TILE + np.uint64(np.uint32(cells[_NEXT + k]))
            f, g, corner, below = at[k], at[_NEXT + k], flat[first], flat[first + _DOWN]
            low = corner + g * (flat[first + np.uint64(1)] - corner)
            high = below + g * (flat[first + _DOWN + np.uint64(1)] - below)
            height = np.float64(low + f * (high - low))
            total += height
            squares += height * height
            along += u[k] * height
            across += v[k] * height
        if not known[q]:
            for k in range(samples):
                if rows[cells[k]] < 0:
                    missing[cells[k] // wide, cells[k] % wide] = True
            continue
        mean, share, rest = total / samples, 1.0, squares / samples
        along, across = along / squares_u, across / squares_v
        if total != total:
            mean, along, across, rest, share = _partly_known(pattern, at, cells, heightmap)
        explained = mean * mean + (along * along * squares_u + across * across * squares_v) / samples
        patches.height[q], patches.along[q] = share * mean, share * along / length
        patches.across[q] = share * across / width
        patches.residual_variance[q] = max(rest - explained, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _partly_known(
    pattern: Singles, at: Singles, cells: NDArray[np.int32], heightmap: HeightmapTiles
) -> tuple[float, float, float, float, float]:
    """Moments of the heights of one ellipse, some of which are NaN.

    Args:
        pattern: See `fit_planes`.
        at: Position of each sample between nodes of its cell along both axes [1], first axis first, (2 MAX_SAMPLES,).
        cells: Tile of each sample, then its node in the tile, (2 MAX_SAMPLES,).
        heightmap: Tiles of terrain heights.

    Returns:
        Mean of the known heights [m], their slopes along the half axes [m], their mean square [m^2], and the factor
        on the plane: 1, or twice the known part where that is less than half [1].
    """
    samples, known = pattern.shape[1] - 1, 0
    total = squares = along = across = lean_u = lean_v = 0.0
    for k in range(samples):
        u, v, first = pattern[0, k], pattern[1, k], heightmap.row_of[cells[k]] * NODES * NODES + cells[MAX_SAMPLES + k]
        corner, below = heightmap.heights[first], heightmap.heights[first + NODES]
        low = corner + at[MAX_SAMPLES + k] * (heightmap.heights[first + 1] - corner)
        high = below + at[MAX_SAMPLES + k] * (heightmap.heights[first + NODES + 1] - below)
        height = np.float64(low + at[k] * (high - low))
        if height == height:
            known += 1
            total += height
            squares += height * height
            along += u * height
            across += v * height
            lean_u += u
            lean_v += v
    mean = total / max(known, 1)
    along, across = (along - mean * lean_u) / pattern[0, samples], (across - mean * lean_v) / pattern[1, samples]
    return mean, along, across, squares / max(known, 1), min(1.0, 2.0 * known / samples)
