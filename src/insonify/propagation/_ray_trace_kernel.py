"""Kernel that traces rays through layered water, arc by arc. Plain numbers and arrays only.

Between two knots sound speed is linear in depth and a ray is an arc of a circle, so nothing is integrated: with
theta the elevation (+ down) and p = cos(theta) / c constant by Snell's law, the sine falls by p g over each metre of
range, the chord leans by half the sum of the angles at its ends, and its travel time is that of the closed form
T = (2 / |g|) asinh(|g| d / (2 sqrt(c1 c2))), d the length of the chord. The formulas hold for g = 0.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]
Integers = NDArray[Any]


class RayVertices(NamedTuple):
    """Vertices of rays, those of each ray in a row."""

    distance: Floats
    """Horizontal distance from the source [m], (v,)."""
    depth: Floats
    """Depth [m], (v,)."""
    time: Floats
    """Travel time [s], (v,)."""
    sine: Floats
    """Sine of the elevation, + down [1], (v,)."""
    gradient: Floats
    """Gradient of the sound speed along the arc that begins there [1/s], (v,)."""
    bounces: Integers
    """Bounces so far, (v,)."""
    turns: Integers
    """Turning points so far, (v,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def trace_rays(
    water: SoundSpeedLayers, source_depth: float, sines: Floats, max_range: float, max_bounces: int,
    first_row: Integers, vertices: RayVertices,
) -> None:  # fmt: skip
    """Write the vertices of every ray: at its source, knots, turning points, bounces and end.

    Args:
        water: The water column, which reflects at its first and last knot.
        source_depth: Depth of the source [m].
        sines: Sine of the launch elevation of each ray, + down [1], (n,).
        max_range: Horizontal distance at which rays end [m].
        max_bounces: Largest number of bounces; the next one ends a ray.
        first_row: Result: row of the first vertex of each ray, and the number of all vertices, (n + 1,).
        vertices: Result: the first v vertices; those beyond are counted and not written.
    """
    row = 0
    for ray in range(sines.size):
        first_row[ray] = row
        row = _trace(water, source_depth, sines[ray], max_range, max_bounces, row, vertices)
    first_row[sines.size] = row


@njit(cache=True, nogil=True, error_model="numpy")
def _trace(
    water: SoundSpeedLayers, source_depth: float, launch: float, max_range: float, max_bounces: int, row: int,
    vertices: RayVertices,
) -> int:  # fmt: skip
    """Trace one ray of sine `launch`; return the row after its last vertex."""
    depth, speed = water.depth, water.speed
    z, x, t = source_depth, 0.0, 0.0
    goes_down = launch >= 0
    layer = _layer(depth, z, goes_down)
    c0 = _speed_in(depth, speed, layer, z)
    c, s = c0, abs(launch)
    square, p = (1 - s) * (1 + s), math.sqrt((1 - s) * (1 + s)) / c0
    bounce_count, turn_count, reversals = 0, 0, 0
    while True:
        g = (speed[layer + 1] - speed[layer]) / (depth[layer + 1] - depth[layer])
        sense = 1.0 if goes_down else -1.0
        knot = layer + 1 if goes_down else layer
        # from the launch, not from p: at a nearly horizontal ray 1 - (p c)^2 would be a difference of equals
        s2 = launch * launch - square * (speed[knot] - c0) * (speed[knot] + c0) / (c0 * c0)
        if s == 0 and s2 <= 0 and reversals < 2 and g != 0 and _has_layer(depth, z, not goes_down):
            goes_down, reversals = not goes_down, reversals + 1  # refracts towards the other boundary, or not at all
            layer = _layer(depth, z, goes_down)
            continue
        is_horizontal = s == 0 and s2 <= 0  # along the axis of a channel, or in isovelocity water
        turns_here = s2 <= 0 and not is_horizontal
        _write(vertices, row, (x, z, t), sense * s, 0.0 if is_horizontal else g, bounce_count, turn_count)
        row, reversals = row + 1, 0
        end_s, end_z, end_c = math.sqrt(max(s2, 0.0)), depth[knot], speed[knot]
        dx = math.inf if is_horizontal else abs(end_z - z) * p * (c + end_c) / (s + end_s)
        if turns_here:
            dx, end_s = s / (p * abs(g)), 0.0
            end_z, end_c = z + sense * dx * s / (1 + p * c), 1 / p
        is_last = x + dx >= max_range
        if is_last:
            dx = max_range - x
            sine_end = sense * s - (0.0 if is_horizontal else p * g * dx)
            end_z = z + dx * (sense * s + sine_end) / (p * c + math.sqrt(max(0.0, (1 - sine_end) * (1 + sine_end))))
            sense, end_s, end_c = math.copysign(1.0, sine_end), abs(sine_end), c + g * (end_z - z)
        t += chord_time(math.hypot(dx, end_z - z), c, end_c, g)
        x, z, s, c = max_range if is_last else x + dx, end_z, end_s, end_c
        if not is_last and turns_here:
            goes_down, turn_count = not goes_down, turn_count + 1
        elif not is_last and 0 < knot < depth.size - 1:
            layer = layer + 1 if goes_down else layer - 1
        elif not is_last:
            bounce_count += 1
            is_last, goes_down = bounce_count > max_bounces, not goes_down
        if is_last:
            _write(vertices, row, (x, z, t), sense * s, 0.0, min(bounce_count, max_bounces), turn_count)
            return row + 1


@njit(cache=True, nogil=True, error_model="numpy")
def chord_time(chord: float, c1: float, c2: float, gradient: float) -> float:
    """Travel time along an arc with a chord [m], in water of one gradient [1/s], with speeds c1, c2 at its ends [s]."""
    mean = math.sqrt(c1 * c2)
    u = abs(gradient) * chord / (2 * mean)
    return chord / mean * (math.asinh(u) / u if u > 1e-8 else 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _layer(depth: Floats, z: float, down: bool) -> int:
    """Layer that a ray enters at a depth z; at a knot the layer ahead of it."""
    layer = 0
    while layer < depth.size - 2 and (depth[layer + 1] <= z if down else depth[layer + 1] < z):
        layer += 1
    return layer


@njit(cache=True, nogil=True, error_model="numpy")
def _has_layer(depth: Floats, z: float, down: bool) -> bool:
    """Return True if there is water below (down) or above a depth z."""
    return z < depth[-1] if down else z > depth[0]


@njit(cache=True, nogil=True, error_model="numpy")
def _speed_in(depth: Floats, speed: Floats, layer: int, z: float) -> float:
    """Sound speed at a depth of a layer [m/s]."""
    fraction = (z - depth[layer]) / (depth[layer + 1] - depth[layer])
    return speed[layer] * (1 - fraction) + speed[layer + 1] * fraction


@njit(cache=True, nogil=True, error_model="numpy")
def _write(
    vertices: RayVertices, row: int, at: tuple[float, float, float], sine: float, gradient: float, bounce_count: int,
    turn_count: int,
) -> None:  # fmt: skip
    """Write one vertex, if it fits; `at` is its distance [m], depth [m] and time [s]."""
    if row < vertices.sine.size:
        vertices.distance[row], vertices.depth[row], vertices.time[row] = at
        vertices.sine[row], vertices.gradient[row] = sine, gradient
        vertices.bounces[row], vertices.turns[row] = bounce_count, turn_count
