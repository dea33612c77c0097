"""Refracted rays between seabed, surface and bodies: first hits, and occlusion of reflected paths.

In a layer of constant gradient g a ray is an arc of a circle: its angle falls by p g for every metre, p the horizontal
slowness (Officer 1958, Introduction to the Theory of Sound Transmission; not verified). Between bodies and over relief
arcs are tested as chords that deviate by no more than `MAX_SAGITTA`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._terrain_hit_kernel import TerrainTiles, terrain_hit, terrain_normal
from insonify.engines.tracer._trace_kernel import BED, BODY, CLEARANCE, NOTHING, SURFACE, FirstHits
from insonify.jit import njit
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from insonify.propagation.triangle_tree import TriangleTree, nearest_hit

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

MAX_SAGITTA = 1e-3
"""Largest distance between an arc and its chord [m]."""
MIN_CURVATURE = 1e-9
"""Curvature below which a ray is straight within a layer [1/m]."""
MIN_ANGLE = 1e-6
"""Angle to the horizontal below which a ray stays at a least sound speed [rad]: its arcs would be millimetres long and
depart from it by less than a micrometre, where the curvature is above 1e-6 per metre."""
MAX_ARCS = 1_000_000
"""Number of arcs after which a ray is given up [1]."""
OMITTED_FRACTION = 1e-9
"""Fraction of the path to the end of the sonar that is not tested, so that it does not cross a boundary there [1]."""


class RefractingScene(NamedTuple):
    """Water and obstacles of refracted rays."""

    terrain: TerrainTiles
    """The seabed."""
    bodies: TriangleTree
    """Triangles of all bodies."""
    water: SoundSpeedLayers
    """Sound speed, down to the deepest seabed; the depth of the mean seabed, where paths are reflected, is a knot."""


@njit(cache=True, nogil=True, error_model="numpy")
def layer_of(z: float, angle: float, water: SoundSpeedLayers) -> int:
    """Layer that a ray enters at a depth [m] with an angle, positive down [rad]."""
    layer = 0
    while layer < water.depth.size - 2 and z >= water.depth[layer + 1]:
        layer += 1
    if angle < 0 and layer > 0 and z <= water.depth[layer]:
        layer -= 1
    return layer


@njit(cache=True, nogil=True, error_model="numpy")
def next_arc(
    z: float, angle: float, slowness: float, layer: int, longest: float, water: SoundSpeedLayers
) -> tuple[float, float, float, float, int]:
    """The next arc of a ray, up to the border of its layer or the largest length; straight along a least sound speed.

    Args:
        z: Depth [m].
        angle: Angle of travel, positive down [rad].
        slowness: Horizontal slowness [s/m].
        layer: Row of the layer.
        longest: Largest length [m].
        water: The layers.

    Returns:
        Its length [m]; its curvature, the decrease of the angle per metre [rad/m]; depth [m] and angle [rad] where it
        ends; and the layer entered, the same one where it has the largest length: -1 above the surface, and the number
        of layers below the last knot.
    """
    depth, speed = water.depth, water.speed
    gradient = (speed[layer + 1] - speed[layer]) / (depth[layer + 1] - depth[layer])
    curvature = slowness * gradient
    down = angle > 0 or (angle == 0 and gradient < 0)
    knot, end_angle = (layer + 1 if down else layer), angle
    if abs(angle) < MIN_ANGLE and _is_least_speed(z, layer, water):
        return longest, 0.0, z, angle, layer
    if abs(curvature) < MIN_CURVATURE:
        sine = math.sin(angle)
        length = (depth[knot] - z) / sine if abs(sine) > 1e-12 else math.inf
        curvature = 0.0
    else:
        cosine, sign = slowness * speed[knot], (1.0 if down else -1.0)
        if cosine >= 1 and (gradient > 0) == down:  # the ray turns before it reaches that border
            knot, sign = (layer if down else layer + 1), -sign
            cosine = slowness * speed[knot]
        cosine = min(cosine, 1.0)
        end_angle = sign * math.atan2(math.sqrt((1 - cosine) * (1 + cosine)), cosine)
        length = (angle - end_angle) / curvature
    if length > longest:
        half_angle = curvature * longest / 2
        end_depth = z + longest * _sinc(half_angle) * math.sin(angle - half_angle)
        return longest, curvature, end_depth, angle - 2 * half_angle, layer
    return max(length, 0.0), curvature, depth[knot], end_angle, (layer - 1 if knot == layer else layer + 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _is_least_speed(z: float, layer: int, water: SoundSpeedLayers) -> bool:
    """Return True if a depth [m] is that of a knot of a layer with less sound speed than the knots above and below."""
    depth, speed = water.depth, water.speed
    for knot in range(max(layer, 1), min(layer + 2, depth.size - 1)):
        if z == depth[knot] and speed[knot - 1] > speed[knot] < speed[knot + 1]:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _sinc(x: float) -> float:
    """Sine of x over x [1]."""
    return math.sin(x) / x if abs(x) > 1e-6 else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _arc_delay(z: float, angle: float, curvature: float, length: float, layer: int, water: SoundSpeedLayers) -> float:
    """Travel time along an arc [s], by Gauss-Legendre quadrature with four nodes.

    Args:
        z: Depth at its start [m].
        angle: Angle of travel there, positive down [rad].
        curvature: Decrease of that angle per metre [rad/m].
        length: Length of the arc [m].
        layer: Row of its layer.
        water: The layers.
    """
    depth, speed = water.depth, water.speed
    gradient, total = (speed[layer + 1] - speed[layer]) / (depth[layer + 1] - depth[layer]), 0.0
    start_speed = speed[layer] + gradient * (z - depth[layer])
    for node, weight in (
        (0.06943184420297371, 0.17392742256872692), (0.33000947820757187, 0.3260725774312731),
        (0.6699905217924281, 0.3260725774312731), (0.9305681557970263, 0.17392742256872692),
    ):  # fmt: skip
        half_angle = curvature * node * length / 2
        total += weight / (start_speed + gradient * node * length * _sinc(half_angle) * math.sin(angle - half_angle))
    return total * length


@njit(cache=True, nogil=True, error_model="numpy")
def _longest_chord(slowness: float, layer: int, water: SoundSpeedLayers) -> float:
    """Length of the chord that deviates from its arc by `MAX_SAGITTA` [m]; 89 km at most."""
    gradient = (water.speed[layer + 1] - water.speed[layer]) / (water.depth[layer + 1] - water.depth[layer])
    return math.sqrt(8 * MAX_SAGITTA / max(abs(slowness * gradient), 1e-12))


@njit(cache=True, nogil=True, error_model="numpy")
def refracted_hits(
    origin: Floats, direction: Floats, farthest: Floats, scene: RefractingScene, missing: Mask, hits: FirstHits
) -> None:
    """Find the first hits of refracted rays.

    Args:
        origin: Starting points [m], (n, 3).
        direction: Unit vectors [1], (n, 3).
        farthest: Path length beyond which no hit is searched [m], (n,).
        scene: Water and obstacles.
        missing: Result, True for tiles of the seabed that are not loaded.
        hits: Result: path length, delay, kind, position, direction and normal; kind `NOTHING` where none is.
    """
    terrain, bodies, water = scene.terrain, scene.bodies, scene.water
    has_obstacles, layer_count = bodies.normal.shape[0] > 0 or terrain.cell > 0, water.depth.size - 1
    for n in range(farthest.size):
        x, y, z = origin[n]
        horizontal = math.hypot(direction[n, 0], direction[n, 1])
        north, east = (direction[n, 0] / horizontal, direction[n, 1] / horizontal) if horizontal > 1e-12 else (1.0, 0.0)
        angle = math.atan2(direction[n, 2], horizontal)
        layer, kind, row, clearance = layer_of(z, angle, water), NOTHING, -1, CLEARANCE
        slowness = math.cos(angle) / np.interp(z, water.depth, water.speed)
        path_length, delay = 0.0, 0.0
        for _ in range(MAX_ARCS):
            longest = farthest[n] - path_length
            if longest <= 0:
                break
            if has_obstacles:
                longest = min(longest, _longest_chord(slowness, layer, water))
            length, curvature, z_end, end_angle, next_layer = next_arc(z, angle, slowness, layer, longest, water)
            half_angle = curvature * length / 2
            chord = length * _sinc(half_angle)
            cosine = math.cos(angle - half_angle)
            u, v, w = cosine * north, cosine * east, math.sin(angle - half_angle)
            hit_distance, row = chord, -1
            if has_obstacles:
                hit_distance, row = nearest_hit(bodies, (x, y, z), (u, v, w), clearance, chord)
                kind = BODY if row >= 0 else NOTHING
                if terrain.cell > 0:
                    terrain_distance = terrain_hit((x, y, z), (u, v, w), 0.0, hit_distance, terrain, missing)
                    if terrain_distance < hit_distance:
                        hit_distance, kind, row = terrain_distance, BED, -1
            if kind != NOTHING:
                length *= hit_distance / chord
                z_end, end_angle = z + hit_distance * w, angle - curvature * length
            delay += _arc_delay(z, angle, curvature, length, layer, water)
            x, y, z, angle = x + hit_distance * u, y + hit_distance * v, z_end, end_angle
            path_length, clearance = path_length + length, 0.0
            if kind == NOTHING and next_layer < 0:
                kind = SURFACE
            elif kind == NOTHING and next_layer >= layer_count:
                kind = BED
            if kind != NOTHING:
                break
            layer = next_layer
        hits.distance[n], hits.delay[n], hits.kind[n], hits.body_row[n] = path_length, delay, kind, -1
        hits.position[n, 0], hits.position[n, 1], hits.position[n, 2] = x, y, z
        u, v, w = math.cos(angle) * north, math.cos(angle) * east, math.sin(angle)
        hits.direction[n, 0], hits.direction[n, 1], hits.direction[n, 2] = u, v, w
        normal = hits.normal[n]
        if kind == BODY:
            hits.body_row[n] = bodies.solid_row[row]
            normal[:] = bodies.normal[row]
        elif kind == BED:
            normal[0], normal[1], normal[2] = terrain_normal(x, y, terrain, missing)
        else:
            normal[0], normal[1], normal[2] = 0.0, 0.0, 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def clear_refracted_paths(
    position: Floats, departure: Floats, length: Floats, bottom: Mask, wavelength: float, scene: RefractingScene,
    missing: Mask, is_clear: Mask,
) -> None:  # fmt: skip
    """Test reflected paths from some positions to one end of the sonar for occlusion, chord by chord.

    Terrain within the half length of the first Fresnel zone about a bounce on the seabed reflects and does not occlude.

    Args:
        position: The positions [m], (n, 3).
        departure: Directions in which the paths leave them [1], (n, 3).
        length: Path lengths [m], (n,).
        bottom: For each bounce from the position on, True at the seabed, False at the surface, (bounce count,).
        wavelength: Acoustic wavelength [m].
        scene: Water and obstacles.
        missing: Result, True for tiles of the seabed that are not loaded.
        is_clear: True for positions to test; set to False where terrain or a body blocks the path, (n,).
    """
    terrain, bodies, water = scene.terrain, scene.bodies, scene.water
    for n in range(length.size):
        if not is_clear[n]:
            continue
        x, y, z = position[n]
        horizontal = math.hypot(departure[n, 0], departure[n, 1])
        north, east = (departure[n, 0] / horizontal, departure[n, 1] / horizontal) if horizontal > 1e-12 else (1.0, 0.0)
        angle = math.atan2(departure[n, 2], horizontal)
        layer, slowness = layer_of(z, angle, water), math.cos(angle) / np.interp(z, water.depth, water.speed)
        path_length, bounce, clearance, since_bounce, reflecting_length = 0.0, 0, CLEARANCE, 0.0, 0.0
        for _ in range(MAX_ARCS):
            remaining = length[n] * (1 - OMITTED_FRACTION) - path_length
            if remaining <= 0:
                break
            longest = min(remaining, _longest_chord(slowness, layer, water))
            arc, curvature, z_end, end_angle, next_layer = next_arc(z, angle, slowness, layer, longest, water)
            half_angle = curvature * arc / 2
            chord = arc * _sinc(half_angle)
            cosine = math.cos(angle - half_angle)
            u, v, w = cosine * north, cosine * east, math.sin(angle - half_angle)
            at_seabed = bounce < bottom.size and bottom[bounce]
            stop = chord
            if at_seabed and w > 0:
                to_bounce = (terrain.depth - z) / w
                stop = min(chord, to_bounce - _half_fresnel_zone(path_length + to_bounce, length[n], w, wavelength))
            hit = nearest_hit(bodies, (x, y, z), (u, v, w), clearance, chord)[1] >= 0
            start = max(reflecting_length - since_bounce, 0.0)
            if terrain.cell > 0 and stop > start and not hit:
                hit = terrain_hit((x, y, z), (u, v, w), start, stop, terrain, missing) < stop
            if hit:
                is_clear[n] = False
                break
            x, y, z, angle, path_length, since_bounce, clearance = (
                x + chord * u, y + chord * v, z_end, end_angle, path_length + arc, since_bounce + arc, 0.0
            )  # fmt: skip
            # the reflecting plane is a knot, so that no arc crosses it
            at_boundary = bounce < bottom.size and (z == terrain.depth and w > 0 if at_seabed else next_layer < 0)
            if at_boundary:
                half_zone = _half_fresnel_zone(path_length, length[n], abs(math.sin(angle)), wavelength)
                reflecting_length = half_zone if at_seabed else 0.0
                angle, bounce, since_bounce = -angle, bounce + 1, 0.0
                layer = layer_of(z, angle, water)
            elif next_layer < 0 or next_layer >= water.depth.size - 1:
                break
            else:
                layer = next_layer


@njit(cache=True, nogil=True, error_model="numpy")
def _half_fresnel_zone(path_length: float, length: float, sine: float, wavelength: float) -> float:
    """Length of path before or after a bounce on the seabed, of the horizontal extent of half a Fresnel zone [m].

    The zone is the first, its half length that in the plane of incidence.

    Args:
        path_length: Length of the path before the bounce [m].
        length: Length of the whole path [m].
        sine: Sine of the grazing angle at the bounce [1].
        wavelength: Acoustic wavelength [m].
    """
    fraction = min(max(path_length / length, 0.0), 1.0)
    cosine = math.sqrt(max(1 - sine * sine, 1e-18))
    return math.sqrt(wavelength * length * fraction * (1 - fraction)) / max(sine * cosine, 1e-9)
