"""Straight rays between seabed, surface and bodies: first hits, and occlusion of reflected paths."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._terrain_hit_kernel import TerrainTiles, terrain_hit, terrain_normal
from insonify.jit import njit
from insonify.propagation.triangle_tree import TriangleTree, nearest_hit

Floats = NDArray[np.float64]

NOTHING, BED, SURFACE, BODY = 0, 1, 2, 3
"""Kinds of interface that a ray hits: none, seabed, water surface, triangle of a body."""
CLEARANCE = 1e-6
"""Distance from a ray's start below which a triangle of a body is not hit: it is the face just left [m]."""


class FirstHits(NamedTuple):
    """First hits of n rays."""

    distance: Floats
    """Path length to the hit [m], (n,)."""
    delay: Floats
    """Travel time to the hit [s], (n,)."""
    position: Floats
    """Position of the hit [m], (n, 3)."""
    direction: Floats
    """Direction of travel there [1], (n, 3)."""
    kind: NDArray[np.int8]
    """NOTHING, BED, SURFACE or BODY, (n,)."""
    body_row: NDArray[np.int64]
    """Row of the body hit, -1 for none, (n,)."""
    normal: Floats
    """Unit normal at the hit, into the water [1], (n, 3)."""


@njit(cache=True, nogil=True, error_model="numpy")
def first_hits(
    origin: Floats, direction: Floats, farthest: Floats, terrain: TerrainTiles, bodies: TriangleTree,
    missing: NDArray[np.bool_], hits: FirstHits,
) -> None:  # fmt: skip
    """Find the first hits of straight rays.

    Args:
        origin: Starting points [m], (n, 3).
        direction: Unit vectors [1], (n, 3).
        farthest: Distance beyond which no hit is searched [m], (n,).
        terrain: The seabed.
        bodies: Triangles of all bodies.
        missing: Result, True for tiles of the seabed that are not loaded.
        hits: Result: distance, kind, row of the body and normal; its other columns are not filled.
    """
    distance, hit_kind, body_row, normal = hits.distance, hits.kind, hits.body_row, hits.normal
    for n in range(farthest.size):
        x, y, z = origin[n]
        u, v, w = direction[n]
        hit_distance, kind, row = farthest[n], NOTHING, -1
        if w < 0 and -z / w < hit_distance:
            hit_distance, kind = -z / w, SURFACE
        hit_distance, row = nearest_hit(bodies, (x, y, z), (u, v, w), CLEARANCE, hit_distance)
        if row >= 0:
            kind = BODY
        terrain_distance = terrain_hit((x, y, z), (u, v, w), 0.0, hit_distance, terrain, missing)
        if terrain_distance < hit_distance:
            hit_distance, kind, row = terrain_distance, BED, -1
        distance[n], hit_kind[n], body_row[n] = hit_distance, kind, -1
        if kind == BODY:
            body_row[n] = bodies.solid_row[row]
            normal[n] = bodies.normal[row]
        elif kind == BED:
            north, east = x + u * hit_distance, y + v * hit_distance
            normal[n, 0], normal[n, 1], normal[n, 2] = terrain_normal(north, east, terrain, missing)
        else:
            normal[n, 0], normal[n, 1], normal[n, 2] = 0.0, 0.0, 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def clear_image_paths(
    end: Floats, position: Floats, bottom: NDArray[np.bool_], wavelength: float, terrain: TerrainTiles,
    bodies: TriangleTree, missing: NDArray[np.bool_], is_clear: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Test reflected paths between some ends and some positions for occlusion, segment by segment.

    Terrain within the half length of the first Fresnel zone about a bounce on the seabed reflects and does not occlude.

    Args:
        end: Starting points of the paths [m], (n, 3).
        position: End points of the paths [m], (n, 3).
        bottom: For each bounce from the starting points on, True at the seabed, False at the surface, (bounce count,).
        wavelength: Acoustic wavelength [m].
        terrain: The seabed.
        bodies: Triangles of all bodies.
        missing: Result, True for tiles of the seabed that are not loaded.
        is_clear: True for positions to test; set to False where terrain or a body blocks the path, (n,).
    """
    bounces = bottom.size
    for n in range(position.shape[0]):
        if not is_clear[n]:
            continue
        dx, dy = position[n, 0] - end[n, 0], position[n, 1] - end[n, 1]
        vertical_path = _vertical_path(end[n, 2], position[n, 2], bottom, terrain.depth)
        length = math.sqrt(dx * dx + dy * dy + vertical_path * vertical_path)
        start_fraction, z, start_margin = 0.0, end[n, 2], 0.0
        for segment in range(bounces + 1):
            end_depth, end_fraction, end_margin = position[n, 2], 1.0, 0.0
            if segment < bounces:
                end_depth = terrain.depth if bottom[segment] else 0.0
                end_fraction = start_fraction + abs(end_depth - z) / max(vertical_path, 1e-12)
                if bottom[segment]:
                    sine = vertical_path / length
                    zone = math.sqrt(wavelength * length * max(end_fraction * (1 - end_fraction), 0.0)) / sine
                    end_margin = zone / max(math.sqrt(1 - sine * sine), 1e-9)
            start = end[n, 0] + start_fraction * dx, end[n, 1] + start_fraction * dy, z
            stop = end[n, 0] + end_fraction * dx, end[n, 1] + end_fraction * dy, end_depth
            if not _segment_clear(start, stop, start_margin, end_margin, terrain, bodies, missing):
                is_clear[n] = False
                break
            start_fraction, z, start_margin = end_fraction, end_depth, end_margin


@njit(cache=True, nogil=True, error_model="numpy")
def _vertical_path(start: float, stop: float, bottom: NDArray[np.bool_], depth: float) -> float:
    """Vertical distance travelled with all bounces [m].

    Args:
        start: Depth of the starting point [m].
        stop: Depth of the end point [m].
        bottom: For each bounce, True at the seabed, False at the surface, (bounce count,).
        depth: Depth of the mean seabed [m].
    """
    z, vertical_path = start, 0.0
    for is_seabed_bounce in bottom:
        end_depth = depth if is_seabed_bounce else 0.0
        vertical_path += abs(end_depth - z)
        z = end_depth
    return vertical_path + abs(stop - z)


@njit(cache=True, nogil=True, error_model="numpy")
def _segment_clear(  # type: ignore[no-untyped-def]
    start, stop, start_margin, end_margin, terrain, bodies, missing
):
    """Return True if no terrain or body is between two points; terrain within a margin [m] of either end is ignored."""
    u, v, w = stop[0] - start[0], stop[1] - start[1], stop[2] - start[2]
    length = math.sqrt(u * u + v * v + w * w)
    if length <= 2 * CLEARANCE:
        return True
    u, v, w = u / length, v / length, w / length
    if nearest_hit(bodies, start, (u, v, w), CLEARANCE, length - CLEARANCE)[1] >= 0:
        return False
    if terrain.cell == 0.0:
        return True
    # Traced from the position to the sonar: a ray may touch the seabed only at its start.
    hit = terrain_hit(stop, (-u, -v, -w), end_margin, length - start_margin, terrain, missing)
    return hit == math.inf
