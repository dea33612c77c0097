"""Kernels of a refracted path from one end of a leg to a point of an uneven surface: travel time and its derivatives.

Travel times are given as lengths: times the sound speed c0 at the mean surface, which is also that above it. A path
rises throughout, or falls to a bottom bounce and rises from there; rays that turn are left out. A depth is unfolded at
the bottom where the path has a bottom bounce. The sums over layers are those of `_ray_properties_kernel`. A spreading
distance is the inverse of the pressure amplitude re that at 1 m [m].
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._explicit_surface_kernel import LEAST_HEIGHT, PathDerivatives, SurfaceDerivatives

Floats = NDArray[np.float64]

LEAST_V = 1e-7
"""`RefractedPath.v` of the ray that counts as the farthest [1]."""
STEPS = 40
"""Largest number of Newton steps to a ray [1]."""
CLOSE = 1e-7
"""Newton step of `RefractedPath.v`, relative, at which a ray has converged whose travel time is used [1]."""


class SurfaceWater(NamedTuple):
    """Water of m knots between a surface and the bottom; without knots, water of one sound speed."""

    depth: Floats
    """Depths of the knots from 0 to the deepest point [m], (m,)."""
    speed: Floats
    """Sound speed at the knots [m/s], (m,)."""
    slowness: float
    """Slowness of sound in water of one speed [s/m]."""
    bed: float
    """Depth of the plane that reflects at the bottom [m]."""
    bottom_before: bool
    """True if a path from the start of a leg to the surface has a bottom bounce."""
    bottom_after: bool
    """True if a path from the surface to the end of a leg has a bottom bounce."""
    last: Floats
    """Work array: `RefractedPath.v` [1] of the last rays from the start and the end of a leg, 0 for none, (2,)."""


class RefractedPath(NamedTuple):
    """One ray from one end of a leg to a height of the surface."""

    v: float
    """Tangent of the grazing angle at the highest speed on the path [1]."""
    top_speed: float
    """Highest sound speed on the path [m/s]."""
    upper: float
    """Depth of the point of the surface [m]."""
    end: float
    """Depth of the end, not unfolded [m]."""
    slowness: float
    """Horizontal slowness p [s/m]."""
    r_per_p: float
    """Horizontal distance of the ray over its slowness [m^2/s]."""
    dr_dp: float
    """Derivative of the horizontal distance by the slowness [m^2/s]."""
    exists: bool
    """False where no ray gets as far as requested: the values are those of the farthest ray."""


@njit(cache=True, nogil=True, error_model="numpy")
def speed_at(z: float, water: SurfaceWater) -> float:
    """Sound speed at a depth [m/s]: above the mean surface that at it, below the last knot that at it."""
    depth, speed = water.depth, water.speed
    if z <= depth[0]:
        return float(speed[0])
    for j in range(depth.size - 1):
        if z <= depth[j + 1]:
            return float(speed[j] + (speed[j + 1] - speed[j]) * (z - depth[j]) / (depth[j + 1] - depth[j]))
    return float(speed[-1])


@njit(cache=True, nogil=True, error_model="numpy")
def _layer_sums(
    v: float, top_speed: float, upper: float, lower: float, water: SurfaceWater, with_time: bool
) -> tuple[float, float, float, float]:
    """Sums over the layers between two depths: `RefractedPath.r_per_p`, `dr_dp`; with_time: time [s], length [m]."""
    # w1, w2: sines of the grazing angle at the upper and lower depth of a layer, with sound speeds c1, c2
    square, cosine2, per_top = v * v, 1 / (1 + v * v), 1 / top_speed
    p = math.sqrt(cosine2) * per_top
    x = s = t = length = 0.0
    depth, speed = water.depth, water.speed
    high, c1, w1 = upper, 0.0, -1.0
    for j in range(-1, depth.size - 1):
        low = depth[j + 1]
        if low <= high:
            continue
        if w1 < 0:
            c1 = speed_at(high, water)
            w1 = math.sqrt((square + (1 - c1 * per_top) * (1 + c1 * per_top)) * cosine2)
        c2 = speed[j + 1]
        if low > lower:
            c2 = speed[0] if j < 0 else c2 + (speed[j] - c2) * (low - lower) / (low - depth[j])
            low = lower
        w2 = math.sqrt((square + (1 - c2 * per_top) * (1 + c2 * per_top)) * cosine2)
        per = (low - high) / (w1 + w2)
        term = (c1 + c2) * per
        x += term
        s += term / (w1 * w2)
        if with_time:
            slow = term * (1 + w1 * w2) / (c1 * c1 + c2 * c2 * w1 * w1)
            g = (c2 - c1) / (low - high)
            a, b = g * slow, g * p * per
            t += slow * (math.atanh(a) / a if abs(a) > 1e-4 else 1 + a * a / 3)
            length += 2 * per * (math.atan(b) / b if abs(b) > 1e-4 else 1 - b * b / 3)
        high, c1, w1 = low, c2, w2
        if low >= lower:
            break
    return x, s, t, length


@njit(cache=True, nogil=True, error_model="numpy")
def _path_sums(
    v: float, top_speed: float, upper: float, end: float, bottom: bool, water: SurfaceWater, with_time: bool
) -> tuple[float, float, float, float]:
    """Sums of `_layer_sums` over one path, which with a bottom bounce crosses the water below its end twice."""
    x, s, t, length = _layer_sums(v, top_speed, upper, end, water, with_time)
    if bottom:
        x2, s2, t2, length2 = _layer_sums(v, top_speed, end, water.bed, water, with_time)
        x, s, t, length = x + 2 * x2, s + 2 * s2, t + 2 * t2, length + 2 * length2
    return x, s, t, length


@njit(cache=True, nogil=True, error_model="numpy")
def refracted_path(
    distance: float, height: float, unfolded_depth: float, bottom: bool, water: SurfaceWater, guess: float, close: float
) -> RefractedPath:
    """Ray from one end of a leg to a point of the surface, by Newton's method.

    Args:
        distance: Horizontal distance from the end to the point [m].
        height: Height of the point above the mean surface [m].
        unfolded_depth: Depth of the end, that of its image in the bottom for a path with a bottom bounce [m].
        bottom: True for a path with a bottom bounce.
        water: The water.
        guess: Approximate `RefractedPath.v`; 0 for none.
        close: Relative Newton step of v at convergence; its square is the order of the error that remains [1].
    """
    end = 2 * water.bed - unfolded_depth if bottom else unfolded_depth
    upper, lowest = min(-height, end - LEAST_HEIGHT), water.bed if bottom else end
    top_speed = max(speed_at(upper, water), speed_at(lowest, water))
    for j in range(water.depth.size):
        if upper < water.depth[j] < lowest:
            top_speed = max(top_speed, water.speed[j])
    v = guess if guess > 0 else max((unfolded_depth - upper) / max(distance, 1e-9), LEAST_V)
    exists, x, s = True, 1.0, 1.0
    for _ in range(STEPS):
        x, s, _, _ = _path_sums(v, top_speed, upper, end, bottom, water, False)
        cosine = 1 / math.sqrt(1 + v * v)
        reached = cosine / top_speed * x
        # 1 / reached is nearly linear in v
        step = reached / max(distance, 1e-9) * (distance - reached) * top_speed / (-s * v * cosine * cosine * cosine)
        if v == LEAST_V and step <= 0:
            exists = reached >= distance * (1 - 1e-9)
            break
        v = min(max(v + step, LEAST_V if v < 1e-5 else v / 8), 1e9)
        if abs(step) <= close * v:
            break
    return RefractedPath(v, top_speed, upper, end, 1 / (math.sqrt(1 + v * v) * top_speed), x, s, exists)


@njit(cache=True, nogil=True, error_model="numpy")
def time_and_length(ray: RefractedPath, distance: float, bottom: bool, water: SurfaceWater) -> tuple[float, float]:
    """Travel time [s] and length [m] of a ray to a horizontal distance [m]."""
    x, s, time, length = _path_sums(ray.v, ray.top_speed, ray.upper, ray.end, bottom, water, True)
    error = distance - ray.slowness * x  # of the ray; by Fermat, dT/dr = p, to second order
    return time + ray.slowness * error + 0.5 * error * error / s, length


@njit(cache=True, nogil=True, error_model="numpy")
def refracted_derivatives(
    offset_north: float, offset_east: float, unfolded_depth: float, side: int, sea: SurfaceDerivatives,
    water: SurfaceWater,
) -> PathDerivatives:  # fmt: skip
    """Derivatives of a path's travel time, as a length, as its point moves over the surface; as `end_to_surface_path`.

    The length itself is that of the straight line, and the last value is q times it. A point without a ray has a
    cosine of -1. With T the travel time to a distance r and a height h: dT/dr = p, dT/dh = q with q^2 = 1 / c^2 - p^2,
    and p is constant along a ray.

    side: 0 for the start of a leg, 1 for its end: index in `SurfaceWater.last`, the first guess, which changes.
    """
    height, north1, east1, north2, both, east2 = sea
    distance = math.hypot(offset_north, offset_east)
    bottom = water.bottom_after if side else water.bottom_before
    ray = refracted_path(distance, height, unfolded_depth, bottom, water, water.last[side], 3e-5)
    water.last[side] = ray.v if ray.exists else 0.0
    reference = water.speed[0]
    # second derivatives of the travel time: rr by distance, tt across, rh by distance and height, hh by height
    p, rr, tt = reference * ray.slowness, reference / ray.dr_dp, reference / ray.r_per_p
    surface_depth = max(-height, 0.0)
    index, index1 = reference / speed_at(surface_depth, water), 0.0
    if surface_depth > 0:
        index1 = (index - reference / speed_at(surface_depth + 1e-3, water)) / 1e-3
    q = math.sqrt(max(index * index - p * p, 1e-12))
    un, ue = (offset_north / distance, offset_east / distance) if distance > 1e-9 else (1.0, 0.0)
    rh, hh = -p / q * rr, (p / q) ** 2 * rr + index * index1 / q
    hnn = tt + (rr - tt) * un * un + 2 * rh * un * north1 + hh * north1 * north1 + q * north2
    hne = (rr - tt) * un * ue + rh * (un * east1 + ue * north1) + hh * north1 * east1 + q * both
    hee = tt + (rr - tt) * ue * ue + 2 * rh * ue * east1 + hh * east1 * east1 + q * east2
    length = math.hypot(distance, unfolded_depth + height)
    cosine = q - p * (un * north1 + ue * east1) if ray.exists else -1.0
    return length, p * un + q * north1, p * ue + q * east1, hnn, hne, hee, q, cosine, q * length


@njit(cache=True, nogil=True, error_model="numpy")
def mean_slowness(unfolded_depth: float, bottom: bool, water: SurfaceWater) -> float:
    """Travel time per length of a vertical path from an end to the mean surface, to first order that of a ray [s/m]."""
    end = 2 * water.bed - unfolded_depth if bottom else unfolded_depth
    _, _, time, _ = _path_sums(1e9, water.speed[0], 0.0, end, bottom, water, True)
    return time / unfolded_depth


@njit(cache=True, nogil=True, error_model="numpy")
def greatest_distance(unfolded_depth: float, bottom: bool, water: SurfaceWater) -> float:
    """Horizontal distance of the farthest point of the mean surface that a ray reaches [m]; infinite in a duct."""
    ray = refracted_path(1e7, 0.0, unfolded_depth, bottom, water, 0.0, CLOSE)
    return math.inf if ray.exists else ray.slowness * ray.r_per_p


@njit(cache=True, nogil=True, error_model="numpy")
def calm_bounce(
    distance: float, start_depth: float, end_depth: float, water: SurfaceWater
) -> tuple[float, RefractedPath, RefractedPath]:
    """Horizontal distance from a leg's start to its reflection by a calm surface [m]; rays from start and end to it.

    Args:
        distance: Horizontal distance between both ends of the leg [m].
        start_depth: Unfolded depth of the start [m].
        end_depth: Unfolded depth of the end [m].
        water: The water.
    """
    low, high = 0.0, distance
    x = distance * start_depth / (start_depth + end_depth)
    first = refracted_path(x, 0.0, start_depth, water.bottom_before, water, 0.0, CLOSE)
    second = refracted_path(distance - x, 0.0, end_depth, water.bottom_after, water, 0.0, CLOSE)
    for _ in range(STEPS):
        excess = first.slowness - second.slowness if first.exists == second.exists else 1.0 if second.exists else -1.0
        step = -excess / (1 / first.dr_dp + 1 / second.dr_dp)
        if abs(step) < 1e-9 and first.exists and second.exists:
            break
        low, high = (low, x) if excess > 0 else (x, high)
        newton = x + step
        x = newton if low < newton < high and first.exists and second.exists else (low + high) / 2
        first = refracted_path(x, 0.0, start_depth, water.bottom_before, water, 0.0, CLOSE)
        second = refracted_path(distance - x, 0.0, end_depth, water.bottom_after, water, 0.0, CLOSE)
    return x, first, second


@njit(cache=True, nogil=True, error_model="numpy")
def bounce_range_for_slope_in_layers(
    slope: float, distance: float, start_depth: float, end_depth: float, water: SurfaceWater
) -> float:
    """Horizontal distance of the point of the mean surface that reflects a leg if it has a slope [m].

    As `_stationary_point_kernel.bounce_range_for_slope`; limited to distances that rays from both ends reach.
    """
    reach = 2 * (start_depth + end_depth)
    low = max(-reach, distance - greatest_distance(end_depth, water.bottom_after, water) * (1 - 1e-6))
    high = min(distance + reach, greatest_distance(start_depth, water.bottom_before, water) * (1 - 1e-6))
    for _ in range(16):  # to some millimetres
        x = (low + high) / 2
        first = refracted_path(abs(x), 0.0, start_depth, water.bottom_before, water, 0.0, 1e-4)
        second = refracted_path(abs(distance - x), 0.0, end_depth, water.bottom_after, water, 0.0, 1e-4)
        p1, p2 = water.speed[0] * first.slowness, water.speed[0] * second.slowness
        g1 = math.atan2(math.sqrt(max(1 - p1 * p1, 0.0)), math.copysign(p1, x))
        g2 = math.atan2(math.sqrt(max(1 - p2 * p2, 0.0)), math.copysign(p2, distance - x))
        if g1 - g2 > 2 * math.atan(slope):
            low = x
        else:
            high = x
    return (low + high) / 2


@njit(cache=True, nogil=True, error_model="numpy")
def bounce_rays(start: Floats, ends: Floats, points: Floats, water: SurfaceWater, rays: Floats, calm: Floats) -> None:
    """Rays to the bounce points of n legs with k points each, and rays reflected by a calm surface.

    Args:
        start: North, east and unfolded depth of the start [m], (3,).
        ends: North, east and unfolded depth of the ends [m], (n, 3).
        points: Bounce points, see `_stationary_point_kernel.COLUMNS`, (n, k, COLUMNS); changed: columns 3 and 4 become
            travel times times c0 [m].
        water: The water.
        rays: Filled with the product of both spreading distances [m^2], length [m], and slownesses before and after
            the bounce times c0 [1], (n, k, 4).
        calm: Filled with spreading distance [m], length [m], slowness times c0 [1], and travel time times c0 [m] of the
            rays by a calm surface, all 0 where none arrives, (n, 4).
    """
    reference = water.speed[0]
    c1 = speed_at(2 * water.bed - start[2] if water.bottom_before else start[2], water)
    for n in range(ends.shape[0]):
        end = ends[n]
        c2 = speed_at(2 * water.bed - end[2] if water.bottom_after else end[2], water)
        horizontal_distance = math.hypot(end[0] - start[0], end[1] - start[1])
        x, first, second = calm_bounce(horizontal_distance, start[2], end[2], water)
        if first.exists and second.exists:
            p = (first.slowness + second.slowness) / 2
            tube = (first.r_per_p + second.r_per_p) * (first.dr_dp + second.dr_dp)
            sines = math.sqrt(max(1 - (p * c1) ** 2, 0.0) * max(1 - (p * c2) ** 2, 0.0))
            before = time_and_length(first, x, water.bottom_before, water)
            after = time_and_length(second, horizontal_distance - x, water.bottom_after, water)
            calm[n, 0] = math.sqrt(tube * sines / (c1 * c2))
            calm[n, 1], calm[n, 2] = before[1] + after[1], reference * p
            calm[n, 3] = reference * (before[0] + after[0])
        else:
            calm[n] = 0.0
        for k in range(points.shape[1]):
            north, east, height = points[n, k, 0], points[n, k, 1], points[n, k, 2]
            cs = speed_at(max(-height, 0.0), water)
            product, length = 1.0, 0.0
            for side in range(2):
                position = start if side == 0 else end
                bottom, c = (water.bottom_before, c1) if side == 0 else (water.bottom_after, c2)
                distance = math.hypot(north - position[0], east - position[1])
                ray = refracted_path(distance, height, position[2], bottom, water, 0.0, CLOSE)
                p, time_length = ray.slowness, time_and_length(ray, distance, bottom, water)
                sines = math.sqrt(max(1 - (p * c) ** 2, 0.0) * max(1 - (p * cs) ** 2, 0.0))
                product *= math.sqrt(ray.r_per_p * ray.dr_dp * sines / (c * cs))
                length += time_length[1]
                points[n, k, 3 + side] = reference * time_length[0]
                rays[n, k, 2 + side] = reference * p
            rays[n, k, 0], rays[n, k, 1] = product, length


@njit(cache=True, nogil=True, error_model="numpy")
def rays_down(distance: Floats, depth: Floats, source_depth: float, water: SurfaceWater, rays: Floats) -> None:
    """Rays from a position down to n points below it.

    Args:
        distance: Horizontal distances [m], (n,).
        depth: Depths of the points, greater than that of the position [m], (n,).
        source_depth: Depth of the position [m].
        water: The water.
        rays: Filled with slowness times c0, p c0 [1]; distance over it, r / (p c0) [m]; derivative of the distance,
            dr/dp / c0 [m]; travel time times c0 [m]; length [m]; spreading distance [m]; NaN where no ray arrives,
            (n, 6).
    """
    reference, c1 = water.speed[0], speed_at(source_depth, water)
    for n in range(distance.size):
        ray = refracted_path(distance[n], -source_depth, depth[n], False, water, 0.0, CLOSE)
        if not ray.exists:
            rays[n] = math.nan
            continue
        p, c2 = ray.slowness, speed_at(depth[n], water)
        time, length = time_and_length(ray, distance[n], False, water)
        sines = math.sqrt(max(1 - (p * c1) ** 2, 0.0) * max(1 - (p * c2) ** 2, 0.0))
        rays[n, 0], rays[n, 1], rays[n, 2] = reference * p, ray.r_per_p / reference, ray.dr_dp / reference
        rays[n, 3], rays[n, 4] = reference * time, length
        rays[n, 5] = math.sqrt(ray.r_per_p * ray.dr_dp * sines / (c1 * c2))
