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
CLEARANCE = 1e-6
"""Distance below which an intersection is that with the face just left [m]."""


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
    origin: Floats, direction: Floats, farthest: Floats, ground: TerrainTiles, bodies: TriangleTree,
    missing: NDArray[np.bool_], found: FirstHits,
) -> None:  # fmt: skip
    """First hits of rays.

    Args:
        origin: Starting points [m], (n, 3).
        direction: Unit vectors [1], (n, 3).
        farthest: Distance beyond which no hit is searched [m], (n,).
        ground: The seabed.
        bodies: Triangles of all bodies.
        missing: Result, True for tiles of the seabed that are not loaded.
        found: Result: distance, kind, row of the body and normal.
    """
    distance, hit_kind, body_row, normal = found.distance, found.kind, found.body_row, found.normal
    for n in range(farthest.size):
        x, y, z = origin[n]
        u, v, w = direction[n]
        far, kind, row = farthest[n], NOTHING, -1
        if w < 0 and -z / w < far:
            far, kind = -z / w, SURFACE
        far, row = nearest_hit(bodies, (x, y, z), (u, v, w), CLEARANCE, far)
        if row >= 0:
            kind = BODY
        bed = terrain_hit((x, y, z), (u, v, w), 0.0, far, ground, missing)
        if bed < far:
            far, kind, row = bed, BED, -1
        distance[n], hit_kind[n], body_row[n] = far, kind, -1
        if kind == BODY:
            body_row[n] = bodies.solid_row[row]
            normal[n] = bodies.normal[row]
        elif kind == BED:
            normal[n, 0], normal[n, 1], normal[n, 2] = terrain_normal(x + u * far, y + v * far, ground, missing)
        else:
            normal[n, 0], normal[n, 1], normal[n, 2] = 0.0, 0.0, 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def clear_image_paths(
    end: Floats, position: Floats, bottom: NDArray[np.bool_], wavelength: float, ground: TerrainTiles,
    bodies: TriangleTree, missing: NDArray[np.bool_], clear: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Test reflected paths between some ends and some positions for occlusion, segment by segment.

    Terrain within half the first Fresnel zone of a bounce on the seabed is the reflecting surface and does not occlude.

    Args:
        end: The other ends [m], (n, 3).
        position: The positions [m], (n, 3).
        bottom: For each bounce from those ends on, whether it is off the seabed or off the surface, (bounces,).
        wavelength: Acoustic wavelength [m].
        ground: The seabed.
        bodies: Triangles of all bodies.
        missing: Result, True for tiles of the seabed that are not loaded.
        clear: In: positions to test. Result: False where terrain or a body blocks the path, (n,).
    """
    bounces = bottom.size
    for n in range(position.shape[0]):
        if not clear[n]:
            continue
        dx, dy = position[n, 0] - end[n, 0], position[n, 1] - end[n, 1]
        climb = _vertical_path(end[n, 2], position[n, 2], bottom, ground.depth)
        length = math.sqrt(dx * dx + dy * dy + climb * climb)
        done, z, skip = 0.0, end[n, 2], 0.0
        for part in range(bounces + 1):
            goal, passed, margin = position[n, 2], 1.0, 0.0
            if part < bounces:
                goal = ground.depth if bottom[part] else 0.0
                passed = done + abs(goal - z) / max(climb, 1e-12)
                if bottom[part]:
                    sine = climb / length
                    zone = math.sqrt(wavelength * length * max(passed * (1 - passed), 0.0)) / sine
                    margin = zone / max(math.sqrt(1 - sine * sine), 1e-9)
            start = end[n, 0] + done * dx, end[n, 1] + done * dy, z
            stop = end[n, 0] + passed * dx, end[n, 1] + passed * dy, goal
            if not _segment_clear(start, stop, skip, margin, ground, bodies, missing):
                clear[n] = False
                break
            done, z, skip = passed, goal, margin


@njit(cache=True, nogil=True, error_model="numpy")
def _vertical_path(start: float, stop: float, bottom: NDArray[np.bool_], depth: float) -> float:
    """Vertical distance travelled with all bounces [m]."""
    z, climb = start, 0.0
    for is_seabed_bounce in bottom:
        goal = depth if is_seabed_bounce else 0.0
        climb += abs(goal - z)
        z = goal
    return climb + abs(stop - z)


@njit(cache=True, nogil=True, error_model="numpy")
def _segment_clear(  # type: ignore[no-untyped-def]
    start, stop, skip, margin, ground, bodies, missing
):
    """Return True if no terrain or body is between two points; terrain within a margin [m] of either end is ignored."""
    u, v, w = stop[0] - start[0], stop[1] - start[1], stop[2] - start[2]
    length = math.sqrt(u * u + v * v + w * w)
    if length <= 2 * CLEARANCE:
        return True
    u, v, w = u / length, v / length, w / length
    if nearest_hit(bodies, start, (u, v, w), CLEARANCE, length - CLEARANCE)[1] >= 0:
        return False
    if ground.cell == 0.0:
        return True
    # Traced from the position to the sonar: a ray may touch the seabed only at its start.
    hit = terrain_hit(stop, (-u, -v, -w), margin, length - skip, ground, missing)
    return hit == math.inf
