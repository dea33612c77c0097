"""Occlusion of refracted rays by a box: depth of the ray over the box's footprint. Plain numbers and arrays only.

Between two knots the speed of sound is c = c0 + g (z - z0), and along a ray of horizontal slowness p the sine s of
its angle (+ down) falls by g p for every metre of range. So its depth over range is the root of a quadratic.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._image_source_kernel import BoxCrossing
from insonify.propagation.families import Bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]

MAX_ARCS = 100_000
"""Number of arcs after which the trace of a ray ends without a hit: more than any contributing ray has."""


class LaunchedRay(NamedTuple):
    """One refracted ray from the sonar to a point."""

    source_depth: float
    """Depth of the sonar [m]."""
    slowness: float
    """Horizontal slowness [s/m]."""
    sine: float
    """Sine of the launch angle, + down [1]."""
    distance: float
    """Horizontal distance of the point [m]."""
    end_depth: float
    """Depth of the point [m]."""


@njit(cache=True, nogil=True, error_model="numpy")
def ray_hits_box(water: SoundSpeedLayers, bounces: Bounces, ray: LaunchedRay, box: BoxCrossing) -> bool:
    """Return True if a ray is at a depth of the box while over its footprint.

    The ray is traced arc by arc, from knot to knot. One that ends on the box itself may touch it with its last
    segment: the box is convex, its end lies on a face in contact with water, and the ray is nearly straight there.

    Args:
        water: The water column.
        bounces: Reflections of the ray before it ends.
        ray: The ray.
        box: Passage over the box, seen from above.
    """
    (knots, speeds, plane), slowness, horizontal_distance = water, ray.slowness, ray.distance
    enter, leave, top, base = box.enter * ray.distance, box.leave * ray.distance, box.top, box.base
    x, z, s, bounce_count = 0.0, ray.source_depth, ray.sine, 0
    layer = _layer(knots, z, s, speeds)
    for _ in range(MAX_ARCS):
        if x > leave or x > horizontal_distance or (box.is_own and bounce_count == bounces.number):
            return False
        if s == 0:
            layer = _layer(knots, z, s, speeds)
        g = (speeds[layer + 1] - speeds[layer]) / (knots[layer + 1] - knots[layer])
        c = speeds[layer] + g * (z - knots[layer])
        down = s > 0 or (s == 0 and g < 0)
        if horizontal_distance < 1e-9 and bounce_count == bounces.number:
            # Vertical: the range does not determine its end, but the depth does.
            return min(z, ray.end_depth) <= base and max(z, ray.end_depth) >= top
        arc_range, border, s_end = _arc_end(z, s, c, g, slowness, knots[layer], knots[layer + 1], down)
        if x + arc_range >= enter:
            first = z if x >= enter else z + _depth_change(enter - x, s, c, g, slowness)
            last = border if x + arc_range <= leave else z + _depth_change(leave - x, s, c, g, slowness)
            low, high = min(first, last), max(first, last)
            range_to_turn = s / (g * slowness) if s * s_end < 0 else -1.0
            if max(enter - x, 0.0) < range_to_turn < leave - x:
                turning_depth = z + _depth_change(range_to_turn, s, c, g, slowness)
                low, high = min(low, turning_depth), max(high, turning_depth)
            if high >= top and low <= base:
                return True
        x, z, s = x + arc_range, border, s_end
        if is_at_boundary(knots, plane, layer, z, s, bounce_count, bounces):
            if bounce_count == bounces.number:
                return False
            bounce_count += 1
            s = -s
        elif s > 0 or (s == 0 and down):
            layer = min(layer + 1, knots.size - 2) if z == knots[layer + 1] else layer
        else:
            layer = max(layer - 1, 0) if z == knots[layer] else layer
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def is_at_boundary(
    knots: Floats, plane: float, layer: int, depth: float, sine: float, bounce_count: int, bounces: Bounces
) -> bool:
    """Return True if a ray that has crossed a layer is at a boundary that it cannot pass.

    Below the reflecting plane there is water for rays that it does not reflect, over deeper terrain.
    """
    if sine > 0:
        bottom_next = bounce_count < bounces.number and (bounce_count % 2 == 0) != bounces.first_up
        below = layer + 1
        return depth == knots[below] and (below + 1 == knots.size or (bottom_next and depth == plane))
    return sine < 0 and layer == 0 and depth == knots[0]


@njit(cache=True, nogil=True, error_model="numpy")
def ray_depths_along_range(
    water: SoundSpeedLayers, source_depth: float, slowness: Floats, sines: Floats, bounces: Bounces, start: Floats,
    stop: Floats, depths: Floats,
) -> None:  # fmt: skip
    """Write the depths of rays at k evenly spaced distances.

    Args:
        water: The water column.
        source_depth: Depth of the sonar [m].
        slowness: Horizontal slowness of the rays [s/m], (n,).
        sines: Sines of the launch angles, + down [1], (n,).
        bounces: Reflections of the rays before they end.
        start: Horizontal distance of the first depth [m], (n,).
        stop: Horizontal distance of the last depth [m], (n,).
        depths: Result [m], NaN beyond a ray's end, (n, k).
    """
    (knots, speeds, plane), count = water, depths.shape[1]
    for n in range(sines.size):
        x, z, s, bounce_count, row = 0.0, source_depth, sines[n], 0, 0
        layer = _layer(knots, z, s, speeds)
        p = slowness[n]
        for _ in range(MAX_ARCS):
            if row == count:
                break
            if s == 0:
                layer = _layer(knots, z, s, speeds)
            g = (speeds[layer + 1] - speeds[layer]) / (knots[layer + 1] - knots[layer])
            c = speeds[layer] + g * (z - knots[layer])
            down = s > 0 or (s == 0 and g < 0)
            arc_range, border, s_end = _arc_end(z, s, c, g, p, knots[layer], knots[layer + 1], down)
            while row < count:
                distance = start[n] + (stop[n] - start[n]) * row / max(count - 1, 1)
                if distance > x + arc_range:
                    break
                depths[n, row] = z + _depth_change(distance - x, s, c, g, p)
                row += 1
            x, z, s = x + arc_range, border, s_end
            if is_at_boundary(knots, plane, layer, z, s, bounce_count, bounces):
                if bounce_count == bounces.number:
                    break
                bounce_count += 1
                s = -s
            elif s > 0 or (s == 0 and down):
                layer = min(layer + 1, knots.size - 2) if z == knots[layer + 1] else layer
            else:
                layer = max(layer - 1, 0) if z == knots[layer] else layer
        for row_beyond in range(row, count):
            depths[n, row_beyond] = np.nan


@njit(inline="always")
def _arc_end(
    z: float, s: float, c: float, g: float, p: float, above: float, below: float, down: bool
) -> tuple[float, float, float]:
    """Range [m] to the end of a ray's arc in one layer, depth [m] and sine (+ down) there; infinite if horizontal."""
    # z, s, c: depth, sine and speed at the start; g: gradient; p: slowness; above, below: depths of the layer's ends
    border = below if down else above
    versine = 1 - p * (c + g * (border - z))  # 1 - cos, negative beyond a turning point
    if versine >= 0:
        s_end = math.sqrt(versine * (2 - versine))
        sine_sum = abs(s) + s_end
        if sine_sum == 0:
            return math.inf, z, 0.0
        return p * (2 * c + g * (border - z)) * abs(border - z) / sine_sum, border, s_end if down else -s_end
    # The ray turns in this layer, and leaves it on the side of entry.
    entry_depth = above if down else below
    versine = max(1 - p * (c + g * (entry_depth - z)), 0.0)
    s_end = -math.sqrt(versine * (2 - versine)) if down else math.sqrt(versine * (2 - versine))
    return (s - s_end) / (g * p), entry_depth, s_end


@njit(inline="always")
def _depth_change(x: float, s: float, c: float, g: float, p: float) -> float:
    """Change of depth of a ray over a range x within one layer [m]; arguments as of `_arc_end`."""
    q = x * (2 * s - g * p * x) / p
    return q / (c + math.sqrt(max(c * c + g * q, 0.0)))


@njit(inline="always")
def _layer(knots: Floats, depth: float, sine: float, speeds: Floats) -> int:
    """Layer that a ray enters from a depth: on a knot, the one that it points to, or is refracted into."""
    layer = 0
    while layer < knots.size - 2 and depth >= knots[layer + 1]:
        layer += 1
    if layer == 0 or depth > knots[layer] or sine > 0:
        return layer
    is_refracted_up = speeds[layer + 1] >= speeds[layer] and speeds[layer] > speeds[layer - 1]
    return layer - 1 if sine < 0 or is_refracted_up else layer
