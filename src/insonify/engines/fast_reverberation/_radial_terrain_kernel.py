"""Terrain along radials, from its map, and the tiles of the map that it needs. Plain numbers and arrays only."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._prefetch import prefetch
from insonify.engines.radial_tables import MapTiles, RadialFrame
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

CELLS = 64
"""Cells along a tile of the map."""
NODE_ROW = 3 * (CELLS + 1)
VALUES_PER_TILE = NODE_ROW * (CELLS + 1)
_SIX, _INSIDE, _THREE = np.uint32(6), np.uint32(CELLS - 1), np.uint32(3)
_NONE, _FIRST, _SECOND, _EAST, _NORTH, _BOTH = (np.uint64(n) for n in (0, 1, 2, 3, NODE_ROW, NODE_ROW + 3))


@njit(cache=True, nogil=True, error_model="numpy")
def tiles_under_radials(
    frame: RadialFrame, radials: Floats, samples: Integers, entries: Integers, cell: float, scratch: Integers,
    tiles: Integers,
) -> int:  # fmt: skip
    """Numbers in a window of the tiles of the map in which samples of some radials lie.

    Args:
        frame: Frame of the radials.
        radials: See `RadialSet`.
        samples: Number of samples of each list of points, (lists,).
        entries: Row of each radial's list in `samples`, (s,).
        cell: Side of a cell of the map [m].
        scratch: Scratch, zeros on entry and on exit, (any, any).
        tiles: Result, (most, 2).

    Returns:
        Number of these tiles, at most `most`.
    """
    for s in range(radials.shape[0]):
        spacing = frame.step * radials[s, 8]
        a, b, step_a, step_b = (
            frame.along / cell, frame.across / cell, radials[s, 0] * spacing / cell, radials[s, 1] * spacing / cell
        )  # fmt: skip
        for k in range(samples[entries[s]]):
            distance_steps = k + radials[s, 6]
            scratch[np.uint32(a + distance_steps * step_a) >> _SIX, np.uint32(b + distance_steps * step_b) >> _SIX] = 1
    count = 0
    for i in range(scratch.shape[0]):
        for j in range(scratch.shape[1]):
            if scratch[i, j] != 0:
                scratch[i, j] = 0
                if count < tiles.shape[0]:
                    tiles[count, 0], tiles[count, 1] = i, j
                    count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def sample_radial_terrain(
    frame: RadialFrame, radial: Floats, count: int, mean_depth: float, tiles: MapTiles, node_index: Integers,
    depth: Singles, slope: Singles,
) -> None:  # fmt: skip
    """Fill the terrain along one radial: depths linear between nodes, slopes of the nearest node without smoothing.

    Args:
        frame: Frame of the radials.
        radial: One row of `RadialSet.radials`, (9,).
        count: Number of samples.
        mean_depth: Depth of the mean plane [m].
        tiles: Tiles of the seabed's map.
        node_index: Scratch, unsigned, (at least count,).
        depth: Result [m], (at least count,).
        slope: Result, along the frame's axes [1], (2, at least count).
    """
    mean = np.float32(mean_depth)
    if tiles.flat:
        depth[:count] = mean
        slope[:, :count] = 0
        return
    step, cell, slot, nodes = frame.step * radial[8], tiles.cell, tiles.slot, tiles.nodes
    a, b, step_a, step_b = (
        frame.along / cell, frame.across / cell, radial[0] * step / cell, radial[1] * step / cell
    )  # fmt: skip
    node, half = nodes.reshape(nodes.size), np.float32(0.5)
    slope_a, slope_b = slope[0], slope[1]
    for k in range(count):  # first all positions, with prefetches: the map is larger than the processor's caches
        distance_steps = k + radial[6]
        x, y = a + distance_steps * step_a, b + distance_steps * step_b
        i, j = np.uint32(x), np.uint32(y)
        at = np.uint32(slot[i >> _SIX, j >> _SIX]) * np.uint32(VALUES_PER_TILE)
        at += (i & _INSIDE) * np.uint32(NODE_ROW) + (j & _INSIDE) * _THREE
        prefetch(node, np.uint64(at))
        prefetch(node, np.uint64(at) + _NORTH)
        node_index[k], slope_a[k], slope_b[k] = at, np.float32(x - i), np.float32(y - j)
    for k in range(count):
        first_node, f, g = np.uint64(node_index[k]), slope_a[k], slope_b[k]
        h00, h01, h10, h11 = (
            node[first_node],
            node[first_node + _EAST],
            node[first_node + _NORTH],
            node[first_node + _BOTH],
        )
        low, high = h00 + g * (h01 - h00), h10 + g * (h11 - h10)
        depth[k] = mean - (low + f * (high - low))
        nearest = first_node + (_NORTH if f >= half else _NONE) + (_EAST if g >= half else _NONE)
        slope_a[k], slope_b[k] = node[nearest + _FIRST], node[nearest + _SECOND]
