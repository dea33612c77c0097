"""Cell areas of a boundary, and the tiles in reach of one ping: the arithmetic of `engines.resolution`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scene.scatterer_grid import BASE_PITCH, FINEST_SCALE, TILE

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
GridFrame = tuple[float, float, float, float]
"""North and east of the scatterer grid's origin [m], cosine and sine of its heading."""


class ResolutionCell(NamedTuple):
    """Size of a resolution cell, and its number of scatterers, see `resolution.Resolution`."""

    slant: float
    width: float
    per_cell: float
    pulse: float
    elongation: float


class ReceivableArea(NamedTuple):
    """Part of a boundary from which one ping receives, on the scatterer grid."""

    transmitter: Floats
    """Grid coordinates of the transmitter [m], (2,)."""
    receiver: Floats
    """Grid coordinates of the receiver [m], (2,)."""
    nearest: float
    """Least horizontal distance from the transmitter from which echoes are received [m]."""
    farthest: float
    """Greatest horizontal distance from the transmitter from which echoes are received [m]."""
    longest_path: float
    """Longest path from transmitter by a position to the receiver that is received [m]."""


MAX_ELONGATION = 6.0
"""Largest side of the square that one scatterer represents, over the length of a resolution cell on the seabed [1].

A square that is much longer than a range cell spreads its one point over several of them, so that the points of a cell
are counted as if by chance. With 5 points in cells that are 200 times as wide as long, the scintillation index is 2.05
to 2.10, where jittered squares shorter than the cell have 1.93 to 1.96.
"""
MAX_CELL_LENGTH_RATIO = 0.05
"""Longest resolution cell along slant range, re the slant range [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def _ground(cell: ResolutionCell, distance: float, height: float) -> float:
    """Length of a resolution cell on the seabed [m]; see `Resolution.ground_length`."""
    slant_range = math.hypot(distance, height)
    slant = max(cell.slant, min(cell.pulse, MAX_CELL_LENGTH_RATIO * slant_range))
    # Below the sonar the first return is a disc, not a strip.
    return min(slant * slant_range / max(distance, 1e-9), math.sqrt(2 * slant_range * slant))


@njit(cache=True, nogil=True, error_model="numpy")
def _cell(cell: ResolutionCell, distance: float, height: float) -> float:
    """Largest area that one scatterer may represent [m^2]; see `Resolution.cell_area`."""
    length = _ground(cell, distance, height)
    return min(length * (math.hypot(distance, height) * cell.width) / cell.per_cell, (cell.elongation * length) ** 2)


@njit(cache=True, nogil=True, error_model="numpy")
def ground(cell: ResolutionCell, distance: Floats, height: float, result: Floats) -> None:
    """Fill lengths of a resolution cell on the seabed at some horizontal distances [m], (n,)."""
    for n in range(distance.size):
        result[n] = _ground(cell, distance[n], height)


@njit(cache=True, nogil=True, error_model="numpy")
def cell_areas(cell: ResolutionCell, distance: Floats, height: float, result: Floats) -> None:
    """Fill the largest areas that one scatterer may represent [m^2] at some horizontal distances [m], (n,)."""
    for n in range(distance.size):
        result[n] = _cell(cell, distance[n], height)


@njit(cache=True, nogil=True, error_model="numpy")
def _extremum_distances(cell: ResolutionCell, height: float) -> tuple[float, float, float]:
    """Distances at which the area or length of a resolution cell may have a minimum [m].

    With slant range R at distance d, the area goes as R^2 / d where the range cell is the pulse's, and as R^3 / d where
    it is the longest, its length then as R^2 / d; between a least range cell and the longest one there is a kink.
    """
    kink = math.sqrt(max((cell.slant / MAX_CELL_LENGTH_RATIO) ** 2 - height**2, 0.0))
    return height, height * math.sqrt(0.5), kink


@njit(cache=True, nogil=True, error_model="numpy")
def finest(cell: ResolutionCell, nearest: Floats, farthest: Floats, height: float, result: Floats) -> None:
    """Fill the least areas that one scatterer may represent [m^2] between two distances [m], (n,)."""
    extremum_distances = _extremum_distances(cell, height)
    for n in range(nearest.size):
        min_area = min(_cell(cell, nearest[n], height), _cell(cell, farthest[n], height))
        for extremum_distance in extremum_distances:
            min_area = min(min_area, _cell(cell, min(farthest[n], max(nearest[n], extremum_distance)), height))
        result[n] = min_area


@njit(cache=True, nogil=True, error_model="numpy")
def min_ground_lengths(cell: ResolutionCell, nearest: Floats, farthest: Floats, height: float, result: Floats) -> None:
    """Fill the least lengths of a resolution cell on the seabed between two distances [m], (n,)."""
    extremum_distances = _extremum_distances(cell, height)
    for n in range(nearest.size):
        min_length = min(_ground(cell, nearest[n], height), _ground(cell, farthest[n], height))
        for extremum_distance in extremum_distances:
            min_length = min(min_length, _ground(cell, min(farthest[n], max(nearest[n], extremum_distance)), height))
        result[n] = min_length


@njit(cache=True, nogil=True, error_model="numpy")
def tile_distance_bounds(
    centre: Floats, half: Floats, away: Floats, outermost: Floats, wander: float, nearest: Floats, farthest: Floats
) -> None:
    """Fill least and greatest distances of tiles from a track.

    Args:
        centre: Centre of each tile in grid coordinates [m], shape (n, 2).
        half: Half of its diagonal [m], shape (n,).
        away: Distance of its centre from the polyline that represents the track [m], shape (n,).
        outermost: Corners of the polyline that may be the farthest point of it [m], shape (m, 2).
        wander: Largest distance between the track and its polyline [m].
        nearest: Result [m], shape (n,).
        farthest: Result [m], shape (n,).
    """
    for n in range(half.size):
        max_distance = 0.0
        for m in range(outermost.shape[0]):
            max_distance = max(max_distance, _distance(centre[n, 0], centre[n, 1], outermost[m]))
        nearest[n], farthest[n] = max(away[n] - half[n] - wander, 0.0), max_distance + half[n] + wander


@njit(cache=True, nogil=True, error_model="numpy")
def _distance(x: float, y: float, point: Floats) -> float:
    """Distance between two positions in a plane [m]."""
    return math.sqrt((x - point[0]) ** 2 + (y - point[1]) ** 2)


@njit(cache=True, nogil=True)
def tiles_between(low: Integers, high: Integers, along: Integers, across: Integers) -> None:
    """Fill the numbers of the tiles of one scale from corner `low` to corner `high`, row by row, (n,)."""
    n = 0
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            along[n], across[n], n = i, j, n + 1


@njit(cache=True, nogil=True, error_model="numpy")
def tiles_in_reach(
    pitch: float, along: Integers, across: Integers, area: ReceivableArea, frame: GridFrame, centre: Floats,
    centre_position: Floats,
) -> int:  # fmt: skip
    """Move the tiles of one scale that are near enough to both ends to the front; return their number.

    Args:
        pitch: Side of their cells [m].
        along: Number of each along the scatterer grid's first axis, changed, shape (n,).
        across: Number of each along its second axis, changed, shape (n,).
        area: Part of the boundary from which the ping receives.
        frame: Frame of the scatterer grid.
        centre: Result, centre of each that is left, in grid coordinates [m], shape (n, 2).
        centre_position: Result, north and east of these centres [m], shape (n, 2).
    """
    north, east, c, s = frame
    transmitter, receiver, nearest, farthest, longest_path = area
    side, half, m = TILE * pitch, TILE * pitch / math.sqrt(2.0), 0
    for n in range(along.size):
        x, y = (along[n] + 0.5) * side, (across[n] + 0.5) * side
        distance = _distance(x, y, transmitter)
        if distance - half > farthest or distance + half < nearest:
            continue
        if longest_path < np.inf and distance + _distance(x, y, receiver) - 2 * half > longest_path:
            continue
        along[m], across[m], centre[m, 0], centre[m, 1] = along[n], across[n], x, y
        centre_position[m, 0], centre_position[m, 1] = north + c * x - s * y, east + s * x + c * y
        m += 1
    return m


@njit(cache=True, nogil=True)
def tiles_above_floor(bound: Floats, floor: float, along: Integers, across: Integers, centre: Floats) -> int:
    """Move the tiles with a bound of the gain [1] not below a floor [1] to the front; return their number."""
    m = 0
    for n in range(bound.size):
        if bound[n] >= floor:
            along[m], across[m], centre[m, 0], centre[m, 1], m = along[n], across[n], centre[n, 0], centre[n, 1], m + 1
    return m


@njit(cache=True, nogil=True)
def subdivide_tiles(
    scale: int, along: Integers, across: Integers, finest: Floats
) -> tuple[Integers, Integers, Floats, Integers, Integers]:
    """Tiles of one scale that are fine enough, and the quarters of the others, which are tiles of the next finer scale.

    Args:
        scale: Scale of the tiles: side of a cell re BASE_PITCH, as a power of two.
        along: Number of each along the scatterer grid's first axis, shape (n,).
        across: Number of each along its second axis, shape (n,).
        finest: Smallest area that one scatterer may represent in each [m^2], shape (n,).

    Returns:
        Numbers along and across of those that are fine enough; fraction of their scatterers that fills the sonar's
        cells [1]; numbers along and across of the quarters of the others.
    """
    cell_area = (BASE_PITCH * 2.0**scale) ** 2
    fine_tiles, density, m, n = np.empty((2, along.size), np.int64), np.empty(along.size), 0, 0
    quarters = np.empty((2, 4 * along.size), np.int64)
    for t in range(along.size):
        if cell_area <= finest[t] or scale == FINEST_SCALE:
            fine_tiles[0, m], fine_tiles[1, m], density[m], m = (
                along[t], across[t], min(cell_area / finest[t], 1.0), m + 1,
            )  # fmt: skip
            continue
        for quarter in range(4):
            quarters[0, n], quarters[1, n], n = 2 * along[t] + quarter // 2, 2 * across[t] + quarter % 2, n + 1
    return fine_tiles[0, :m], fine_tiles[1, :m], density[:m], quarters[0, :n], quarters[1, :n]
