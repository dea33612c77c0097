"""Horizontal distance of the rays of one ray branch. Plain numbers and arrays only.

A ray branch is a layer sequence with a span of turning speeds. Its rays have the parameter
v = tan(grazing angle at the fastest visited node), in which the distance X at the point's depth is regular both for a
ray that passes that node horizontally (v = 0) and for one that turns at a kink of the profile. With
k_i = 1 - (c_i / c_m)^2 and t_i = sqrt(v^2 + k_i) at node i, c_m the speed at the fastest,

    X(v) = sum h_j / (t_j + t_j+1) + sum n (c_m / |g|) t_entry,     h_j = passages (c_j + c_j+1) dz / c_m,

over the slabs crossed and over n half turns, t_entry that of the node at which they begin: the layer formulas of
Officer (1958, Introduction to the theory of sound transmission, not verified) without one difference of nearly equal
numbers, finite for vanishing gradient. The first sum falls and the second grows with v, and each part of their
derivatives is monotone: over an interval of v all are bounded by their values at its ends.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._layer_sequence_kernel import ENTRY, FIRST, KAPPA, LAST, LAYER_SEQUENCE, RADII, STRETCH, TOP

Floats = NDArray[np.float64]

HORIZONTAL = 1e-100  # v of a ray that is horizontal at its fastest node: its cube and the inverse of that are finite
EDGE, IS_FOLD = 0, 1  # rows of the ends of segments: v; 1 if it is a fold, else 0
_HALVINGS = 12  # of a ray branch, at most, in the search for folds (decision 14)


@njit(cache=True, nogil=True, error_model="numpy")
def ray_distance(v: float, ray_branch: Floats) -> tuple[float, float]:
    """Horizontal distance of a ray [m] and its derivative by v [m].

    Args:
        v: Parameter of the ray, at least `HORIZONTAL`.
        ray_branch: The ray branch, see `_layer_sequence_kernel`.
    """
    first, last = int(ray_branch[LAYER_SEQUENCE, FIRST]), int(ray_branch[LAYER_SEQUENCE, LAST])
    vv = v * v
    before = math.sqrt(vv + ray_branch[KAPPA, first])
    distance, dx_dv_over_v = 0.0, 0.0
    for j in range(first, last):
        after = math.sqrt(vv + ray_branch[KAPPA, j + 1])
        product = before * after
        term = ray_branch[STRETCH, j] / (product * (before + after))
        distance += term * product
        dx_dv_over_v -= term
        before = after
    for side in range(2):
        radii = ray_branch[LAYER_SEQUENCE, RADII + side]
        if radii > 0:
            t = math.sqrt(vv + ray_branch[KAPPA, int(ray_branch[LAYER_SEQUENCE, ENTRY + side])])
            distance += radii * t
            dx_dv_over_v += radii / t
    return distance, v * dx_dv_over_v


@njit(cache=True, nogil=True, error_model="numpy")
def distance_derivatives(v: float, ray_branch: Floats) -> tuple[float, float, float, float, float, float]:
    """Parts of X and of dX/dv = rise - fall + v (rise_far - fall_far) [m]; all but the first two fall as v grows.

    Args:
        v: Parameter of the ray.
        ray_branch: The ray branch.

    Returns:
        Distance in turning slabs (grows with v), rise (constant), distance in crossed slabs, fall, rise_far, fall_far.
        The last two belong to slabs that do not touch a node of the highest speed, rise and fall to those that do.
    """
    first, last = int(ray_branch[LAYER_SEQUENCE, FIRST]), int(ray_branch[LAYER_SEQUENCE, LAST])
    vv = v * v
    turned, rise, crossed, fall, rise_far, fall_far = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    before = math.sqrt(vv + ray_branch[KAPPA, first])
    for j in range(first, last):
        after = math.sqrt(vv + ray_branch[KAPPA, j + 1])
        term = ray_branch[STRETCH, j] / (before + after)
        crossed += term
        if ray_branch[KAPPA, j] == 0 or ray_branch[KAPPA, j + 1] == 0:
            fall += term / (after if ray_branch[KAPPA, j] == 0 else before)
        else:
            fall_far += term / (before * after)
        before = after
    for side in range(2):
        radii = ray_branch[LAYER_SEQUENCE, RADII + side]
        if radii > 0:
            kappa = ray_branch[KAPPA, int(ray_branch[LAYER_SEQUENCE, ENTRY + side])]
            t = math.sqrt(vv + kappa)
            turned += radii * t
            if kappa == 0:
                rise += radii
            else:
                rise_far += radii / t
    return turned, rise, crossed, fall, rise_far, fall_far


@njit(cache=True, nogil=True, error_model="numpy")
def curvature_at_fold(v: float, ray_branch: Floats) -> float:
    """Second derivative of distance by horizontal slowness where the first vanishes [m^3/s^2].

    Args:
        v: Parameter of the fold.
        ray_branch: The ray branch.
    """
    first, last = int(ray_branch[LAYER_SEQUENCE, FIRST]), int(ray_branch[LAYER_SEQUENCE, LAST])
    vv = v * v
    before = math.sqrt(vv + ray_branch[KAPPA, first])
    x_vv_over_vv = 0.0
    for j in range(first, last):
        after = math.sqrt(vv + ray_branch[KAPPA, j + 1])
        product = before * after
        term = ray_branch[STRETCH, j] / (product * (before + after))
        x_vv_over_vv += term * (1 / (before * before) + 1 / (after * after) + 1 / product)
        before = after
    for side in range(2):
        radii = ray_branch[LAYER_SEQUENCE, RADII + side]
        if radii > 0:
            t = math.sqrt(vv + ray_branch[KAPPA, int(ray_branch[LAYER_SEQUENCE, ENTRY + side])])
            x_vv_over_vv -= radii / (t * t * t)
    # the second derivative of X by v is v^2 x_vv_over_vv, and dp/dv = -v / (top (1 + v^2)^(3/2)).
    return x_vv_over_vv * (ray_branch[LAYER_SEQUENCE, TOP] * (1 + vv) ** 1.5) ** 2


@njit(cache=True, nogil=True, error_model="numpy")
def monotone_segments(max_v: float, high: float, ray_branch: Floats, edges: Floats) -> int:
    """Cut the rays of a ray branch where the distance is extreme (the folds of caustics).

    Halves the ray branch until bounds show each part to be monotone, or the part is 1/4096 of it.

    Args:
        max_v: Largest v of the ray branch.
        high: Farthest distance of interest [m].
        ray_branch: The ray branch.
        edges: Result: `EDGE` and `IS_FOLD` of the ends of the segments, from `HORIZONTAL` to `max_v`, (2, capacity).

    Returns:
        Number of segments; 0 if all rays of the ray branch go beyond `high`, by the same bounds.
    """
    segment_count, left, width = 0, 0, 1 << _HALVINGS  # of the part, in even steps of sqrt(v): finer towards v = 0
    a, at_a, at_end = HORIZONTAL, distance_derivatives(HORIZONTAL, ray_branch), distance_derivatives(max_v, ray_branch)
    if at_end[2] + at_a[0] > high:
        return 0
    edges[EDGE, 0], edges[IS_FOLD, 0] = HORIZONTAL, 0.0
    while left < 1 << _HALVINGS:
        b = max_v * ((left + width) / (1 << _HALVINGS)) ** 2
        at_b = at_end if left + width == 1 << _HALVINGS else distance_derivatives(b, ray_branch)
        lower_bound = at_a[1] - at_a[3] + a * at_a[4] - b * at_a[5]
        upper_bound = at_b[1] - at_b[3] + b * at_b[4] - a * at_b[5]
        if not (lower_bound > 0 or upper_bound < 0) and width > 1:
            width >>= 1
            continue
        dx_dv_a = at_a[1] - at_a[3] + a * (at_a[4] - at_a[5])
        dx_dv_b = at_b[1] - at_b[3] + b * (at_b[4] - at_b[5])
        if dx_dv_a * dx_dv_b < 0 and segment_count + 2 < edges.shape[1]:
            segment_count += 1
            edges[EDGE, segment_count] = distance_extremum(a, b, dx_dv_a, ray_branch)
            edges[IS_FOLD, segment_count] = 1.0
        a, at_a = b, at_b
        left += width
        while width < 1 << _HALVINGS and left % (2 * width) == 0:
            width *= 2
    edges[EDGE, segment_count + 1], edges[IS_FOLD, segment_count + 1] = max_v, 0.0
    return segment_count + 1


@njit(cache=True, nogil=True, error_model="numpy")
def logarithmic_midpoint(a: float, b: float) -> float:
    """Midpoint of two numbers, logarithmic where they differ much."""
    return 0.5 * (a + b) if a > 1e-3 * b or b < 1e-90 else math.sqrt(a * b)


@njit(cache=True, nogil=True, error_model="numpy")
def distance_extremum(a: float, b: float, dx_dv_a: float, ray_branch: Floats) -> float:
    """Parameter v between a and b of extreme distance, to rounding.

    Regula falsi with the Illinois rule (Dowell & Jarratt 1971, BIT 11, 168, not verified), with occasional halvings.

    Args:
        a: Least v.
        b: Greatest v.
        dx_dv_a: dX/dv at a [m]; that at b has the other sign.
        ray_branch: The ray branch.
    """
    at_a, at_b = dx_dv_a, ray_distance(b, ray_branch)[1]
    for k in range(200):
        v = b - at_b * (b - a) / (at_b - at_a)
        if k % 4 == 3 or not (a < v < b):
            v = logarithmic_midpoint(a, b)
        if v <= a or v >= b or b - a <= 2e-16 * b:
            break
        dx_dv = ray_distance(v, ray_branch)[1]
        if (dx_dv > 0) == (dx_dv_a > 0):
            a, at_a, at_b = v, dx_dv, 0.5 * at_b
        else:
            b, at_b, at_a = v, dx_dv, 0.5 * at_a
        if dx_dv == 0:
            return v
    return 0.5 * (a + b)


@njit(cache=True, nogil=True, error_model="numpy")
def ray_to_distance(distance: float, a: float, b: float, is_falling: bool, ray_branch: Floats) -> float:
    """Parameter v between a and b of the ray to a given distance, to rounding, on a monotone segment.

    Newton steps while they stay inside and shrink, halvings otherwise.

    Args:
        distance: Horizontal distance [m].
        a: Least v.
        b: Greatest v.
        is_falling: True if distance falls with v.
        ray_branch: The ray branch.
    """
    v, last_step = 0.5 * (a + b), b - a
    for _ in range(400):
        x, dx_dv = ray_distance(v, ray_branch)
        error = distance - x
        if (error > 0) == is_falling:
            b = v
        else:
            a = v
        step = error / dx_dv
        if abs(step) <= 4e-16 * v or abs(error) <= 1e-15 * distance or b - a <= 4e-16 * b:
            break
        next_v = v + step
        if not (a < next_v < b) or abs(step) > 0.5 * abs(last_step):
            next_v = logarithmic_midpoint(a, b)
        last_step, v = next_v - v, next_v
    return v
