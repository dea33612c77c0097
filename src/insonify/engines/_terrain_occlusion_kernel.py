"""Occlusion by the seabed along lines. Plain numbers and arrays only."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.floating[Any]]
Integers = NDArray[np.int64]

CLEAR, OCCLUDED, TERRAIN = 0, 2, -2  # the values of records.legs.LegStatus, and of its SEABED


@njit(cache=True, nogil=True, error_model="numpy")
def horizon_at(line_horizon: Floats, rows: Integers, reach: Floats, points: Integers, horizon: Floats) -> None:
    """Fill the launch horizon at the distances of m of n points, infinite before the first sample.

    Args:
        line_horizon: Launch horizon along lines, see `LaunchHorizon.horizon` [1], (lines, samples).
        rows: Line of each selected point, (m,).
        reach: Distance of each point [steps], (n,).
        points: Indices of the selected points, (m,).
        horizon: Result [1], (n,).
    """
    last = line_horizon.shape[1] - 1
    for m in range(points.size):
        n = points[m]
        k = min(math.floor(reach[n]) - 1, last)
        horizon[n] = line_horizon[rows[m], k] if k >= 0 else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def rising_rays_clear(
    terrain_slope: Floats, horizon: Floats, launch_slope: Floats, rows: Integers, start: Floats, stop: Floats,
    points: Integers, clear: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Write False for rays that rise from a bounce and reach the seabed between two distances.

    Args:
        terrain_slope: Launch slope of the ray that reaches the seabed at each sample [1], (lines, samples).
        horizon: Largest launch slope from each sample on [1], (lines, samples): a ray above it clears all of these.
        launch_slope: Launch slopes of the rays [1], (n,).
        rows: Line of each selected point, (m,).
        start: Distance from which the ray is tested [steps], (n,).
        stop: Distance at which it ends [steps], (n,).
        points: Indices of the selected points, (m,).
        clear: Result, (n,).
    """
    for m in range(points.size):
        n, s = points[m], rows[m]
        first, end = max(math.ceil(start[n]) - 1, 0), min(math.floor(stop[n]), terrain_slope.shape[1])
        if first >= end or horizon[s, first] <= launch_slope[n]:
            continue
        for k in range(first, end):
            if terrain_slope[s, k] > launch_slope[n]:
                clear[n] = False
                break


@njit(cache=True, nogil=True, error_model="numpy")
def mark_terrain_occlusion(
    clear: NDArray[np.bool_], unoccluded: NDArray[Any], soft: bool, status: NDArray[Any], occluder: NDArray[Any],
    visibility: NDArray[Any],
) -> None:  # fmt: skip
    """Mark the clear legs that the seabed cuts; all columns are of shape (f, n).

    Args:
        clear: False where the seabed cuts a leg.
        unoccluded: Visibility without the seabed [1]; legs that are neither clear nor occluded keep it.
        soft: True: `visibility` holds the factor of crests and is kept for clear and occluded legs. False: it is set to
            `unoccluded`, and to 0 where the seabed cuts a leg.
        status: Changed from clear to occluded.
        occluder: Changed to the seabed where that happens.
        visibility: Result [1].
    """
    for f in range(clear.shape[0]):
        for n in range(clear.shape[1]):
            cut = status[f, n] == CLEAR and not clear[f, n]
            if not soft:
                visibility[f, n] = 0 if cut else unoccluded[f, n]
            elif status[f, n] != CLEAR and status[f, n] != OCCLUDED:
                visibility[f, n] = unoccluded[f, n]
            if cut:
                status[f, n], occluder[f, n] = OCCLUDED, TERRAIN


@njit(cache=True, nogil=True, error_model="numpy")
def clear_of_terrain(
    ray_depths: Floats, depth: Floats, rows: Integers, reach: Floats, ends: Floats, ignored_below: Floats,
    penetration: float, on_terrain: bool,
) -> NDArray[np.bool_]:  # fmt: skip
    """Return True if rays, given by their depths, stay above the seabed of a line until they end.

    Args:
        ray_depths: Depths of the rays at the samples [m], (n, samples).
        depth: Depth of the seabed there [m], (lines, samples).
        rows: Line of each ray, (n,).
        reach: Distance at which it ends [steps], (n,).
        ends: Depth at which it ends [m], (n,).
        ignored_below: Depth below which it is not tested [m], (n,).
        penetration: Largest permitted depth below the seabed [m].
        on_terrain: True if rays end on the seabed of their lines: each is sheared, so that its end lies on the line.

    Returns:
        True where a ray is clear, (n,).
    """
    clear = np.ones(rows.size, np.bool_)
    for n in range(rows.size):
        line = depth[rows[n]]
        last = min(math.floor(reach[n]) - 1, ray_depths.shape[1] - 1)
        shift = 0.0
        if on_terrain and last >= 0 and last + 1 < line.size:
            fraction = min(reach[n] - (last + 1), 1.0)
            shift = line[last] + fraction * (line[last + 1] - line[last]) - ends[n]
        for k in range(last + 1):
            ray = ray_depths[n, k] + shift * (k + 1) / reach[n]
            if ray > line[k] + penetration and ray <= ignored_below[n]:
                clear[n] = False
                break
    return clear


class LineDepths(NamedTuple):
    """Seabed along some lines."""

    depth: Floats
    """Depth at the samples [m], (lines, samples)."""
    shallowest: Floats
    """Least depth of each line [m], (lines,)."""
    step: float
    """Spacing of the samples [m]; sample k lies k + 1 steps out."""


@njit(cache=True, nogil=True, error_model="numpy")
def segments_clear(
    lines: LineDepths, rows: Integers, points: Integers, nodes: Floats, bounce_margin: Floats, on_terrain: bool,
    penetration: float, clear: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Write False for paths of straight segments that the seabed cuts, for m of n points.

    Only those parts of segments are tested that lie below the highest seabed of the line.

    Args:
        lines: Seabed along the lines.
        rows: Line of each selected point, (m,).
        points: Indices of the selected points, (m,).
        nodes: Horizontal distance and depth of the ends of all segments [m], (segments + 1, n, 2).
        bounce_margin: Horizontal distance about each node within which the seabed is not tested [m],
            (segments + 1, n).
        on_terrain: True if the paths end on the seabed of their line.
        penetration: Largest permitted depth below the seabed [m].
        clear: Result, False is written where the seabed cuts a path, (n,).
    """
    depth, shallowest, step = lines
    for m in range(points.size):
        n, line, top = points[m], depth[rows[m]], shallowest[rows[m]]
        for k in range(nodes.shape[0] - 1):
            begin_distance, begin_depth = nodes[k, n, 0], nodes[k, n, 1]
            end_distance, end_depth = nodes[k + 1, n, 0], nodes[k + 1, n, 1]
            if on_terrain and k == nodes.shape[0] - 2:
                sample = min(max(math.floor(end_distance / step) - 1, 0), line.size - 2)
                end_depth = line[sample] + min(end_distance / step - (sample + 1), 1.0) * (
                    line[sample + 1] - line[sample]
                )
            if max(begin_depth, end_depth) <= top or end_distance - begin_distance < 1e-9:
                continue
            slope = (end_depth - begin_depth) / (end_distance - begin_distance)
            first, last = begin_distance + bounce_margin[k, n], end_distance - bounce_margin[k + 1, n]
            if slope > 0:
                first = max(first, begin_distance + (top - begin_depth) / slope)
            elif slope < 0:
                last = min(last, begin_distance + (top - begin_depth) / slope)
            for s in range(max(math.ceil(first / step) - 1, 0), min(math.floor(last / step), line.size)):
                if begin_depth + slope * ((s + 1) * step - begin_distance) > line[s] + penetration:
                    clear[n] = False
                    break
