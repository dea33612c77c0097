"""Terrain along radials, from its map, and the tiles of the map that it needs. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines._prefetch import prefetch
from insonify.engines.radial_tables import MapTiles, RadialFrame
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

CELLS = 64
"""Number of cells along a side of a tile of the map."""
RUN = 16
"""Samples of a radial of which the first and the last are compared: where both are in one tile, so are all."""
NODE_ROW = 3 * (CELLS + 1)
"""Number of values in one row of nodes of a tile: a height and two slopes for each node."""
VALUES_PER_TILE = NODE_ROW * (CELLS + 1)
"""Number of values in a tile."""
_SIX, _INSIDE, _THREE = np.uint32(6), np.uint32(CELLS - 1), np.uint32(3)
_NONE, _FIRST, _SECOND, _ACROSS, _ALONG, _BOTH = (np.uint64(n) for n in (0, 1, 2, 3, NODE_ROW, NODE_ROW + 3))
"""Offsets from the height at a node: none; its two slopes; the next node along the second axis, the first, both."""


@njit(cache=True, nogil=True, error_model="numpy")
def mark_tiles(
    frame: RadialFrame, radials: Floats, sample_counts: Integers, list_rows: Integers, cell_size: float,
    crossed: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Mark the tiles of the map, in a window, in which samples of some radials lie.

    Args:
        frame: Frame of the radials.
        radials: See `radial_columns`.
        sample_counts: Number of samples of each list of points, (lists,).
        list_rows: Row of each radial's list in `sample_counts`, (s,).
        cell_size: Side of a cell of the map [m].
        crossed: Result, set to True for such tiles, (any, any).
    """
    for s in range(radials.shape[0]):
        spacing = frame.step * radials[s, column.STRIDE]
        a, b = frame.origin_along / cell_size, frame.origin_across / cell_size
        step_a, step_b = radials[s, column.COSINE] * spacing / cell_size, radials[s, column.SINE] * spacing / cell_size
        first, count = radials[s, column.FIRST_SAMPLE], sample_counts[list_rows[s]]
        for begin in range(0, count, RUN):
            last = min(begin + RUN, count) - 1
            early_a, early_b = _tile(a, begin + first, step_a), _tile(b, begin + first, step_b)
            crossed[early_a, early_b] = True
            if early_a == _tile(a, last + first, step_a) and early_b == _tile(b, last + first, step_b):
                continue
            for k in range(begin + 1, last + 1):
                crossed[_tile(a, k + first, step_a), _tile(b, k + first, step_b)] = True


@njit(inline="always")
def _tile(start: float, steps: float, step: float) -> Any:
    """Row or column of the tile at a number of steps along a radial, on one axis; start and step in cells."""
    return np.uint32(start + steps * step) >> _SIX


@njit(cache=True, nogil=True, error_model="numpy")
def numbers_of_marked(crossed: NDArray[np.bool_]) -> Integers:
    """Row and column of each tile that is marked in a window, shape (n, 2)."""
    numbers, n = np.empty((crossed.size, 2), np.int64), 0
    for i in range(crossed.shape[0]):
        for j in range(crossed.shape[1]):
            if crossed[i, j]:
                numbers[n, 0], numbers[n, 1] = i, j
                n += 1
    return numbers[:n].copy()


@njit(cache=True, nogil=True, error_model="numpy")
def mark_passing(
    radials: Floats, bearing: Floats, heading: float, sonar: Floats, cylinders: Floats, wavelength: float,
    ripples: float, passing: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Mark the radials that pass each of some targets, or their zones of edge diffraction.

    Args:
        radials: See `radial_columns`.
        bearing: Bearing of each radial in its frame [rad], (s,).
        heading: Heading of that frame [rad].
        sonar: Position of the sonar: north, east, depth [m], (3,).
        cylinders: North, east and radius of each target's bounding cylinder [m], in the first columns, (t, any).
        wavelength: Wavelength [m].
        ripples: Fresnel number up to which edge diffraction is evaluated, 0 for none [1].
        passing: Result, True for such radials, (t, s).
    """
    for t in range(cylinders.shape[0]):
        north, east, radius = cylinders[t, 0] - sonar[0], cylinders[t, 1] - sonar[1], cylinders[t, 2]
        distance, turn = math.hypot(north, east), heading + math.pi - math.atan2(east, north)
        half_angle = math.asin(min(radius / max(distance, 1e-9), 1.0))
        half_angle += ripples * math.sqrt(wavelength / (2 * max(distance, wavelength)))
        for s in range(bearing.size):
            passing[t, s] = distance <= radius  # over or under the target
            if passing[t, s] or not radials[s, column.STOP] > distance - radius:
                continue
            angle = abs((bearing[s] + turn) % (2 * math.pi) - math.pi)
            passing[t, s] = angle <= half_angle + radials[s, column.CELL_WIDTH] / 2


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def sample_radial_terrain(
    frame: RadialFrame, radial: Floats, samples: tuple[int, int], mean_depth: float, tiles: MapTiles,
    node_index: Integers, depth: Singles, slope: Singles,
) -> None:  # fmt: skip
    """Fill the terrain along one radial: depths linear between nodes, slopes of the nearest node without smoothing.

    Args:
        frame: Frame of the radials.
        radial: One row of `RadialSet.radials`, (9,).
        samples: Index of the first sample, and count, the index after the last.
        mean_depth: Depth of the mean seabed [m].
        tiles: Tiles of the seabed's map.
        node_index: Scratch, unsigned, (at least count,).
        depth: Result [m], (at least count,).
        slope: Result, along the frame's axes [1], (2, at least count).
    """
    mean, (begin, count) = np.float32(mean_depth), samples
    if tiles.is_flat:
        depth[begin:count] = mean
        slope[:, begin:count] = 0
        return
    step, cell_size, tile_row, nodes = frame.step * radial[column.STRIDE], tiles.cell_size, tiles.tile_row, tiles.nodes
    a, b = frame.origin_along / cell_size, frame.origin_across / cell_size
    step_a, step_b = radial[column.COSINE] * step / cell_size, radial[column.SINE] * step / cell_size
    node_values, half = nodes.reshape(nodes.size), np.float32(0.5)
    slope_a, slope_b = slope[0], slope[1]
    for k in range(begin, count):  # first all positions, with prefetches: the map is larger than the processor's caches
        distance_steps = k + radial[column.FIRST_SAMPLE]
        x, y = a + distance_steps * step_a, b + distance_steps * step_b
        i, j = np.uint32(x), np.uint32(y)
        node_start = np.uint32(tile_row[i >> _SIX, j >> _SIX]) * np.uint32(VALUES_PER_TILE)
        node_start += (i & _INSIDE) * np.uint32(NODE_ROW) + (j & _INSIDE) * _THREE
        prefetch(node_values, np.uint64(node_start))
        prefetch(node_values, np.uint64(node_start) + _ALONG)
        node_index[k], slope_a[k], slope_b[k] = node_start, np.float32(x - i), np.float32(y - j)
    for k in range(begin, count):
        first_node, f, g = np.uint64(node_index[k]), slope_a[k], slope_b[k]
        h00, h01 = node_values[first_node], node_values[first_node + _ACROSS]
        h10, h11 = node_values[first_node + _ALONG], node_values[first_node + _BOTH]
        low, high = h00 + g * (h01 - h00), h10 + g * (h11 - h10)
        depth[k] = mean - (low + f * (high - low))
        nearest = first_node + (_ALONG if f >= half else _NONE) + (_ACROSS if g >= half else _NONE)
        slope_a[k], slope_b[k] = node_values[nearest + _FIRST], node_values[nearest + _SECOND]
