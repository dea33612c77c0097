"""All points of an uneven surface with stationary path length: searched along a track, refined for each scatterer.

A leg runs from its start, at the sonar, by the surface to a scatterer; the sound travels either way. Scatterers that
lie close together share one search along the line (track) to their middle; from its results Newton's method converges
to the bounce points of each scatterer in a few steps. Plain numbers and arrays only.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._explicit_surface_kernel import (
    PathDerivatives,
    SurfaceDerivatives,
    end_to_surface_path,
    path_third_derivative,
    principal_curvatures,
    surface_derivatives,
    surface_derivatives_along,
)
from insonify.propagation.layered_surface_path_kernel import (
    SurfaceWater,
    bounce_range_for_slope_in_layers,
    mean_slowness,
    refracted_derivatives,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
SurfaceAndPaths = tuple[SurfaceDerivatives, PathDerivatives, PathDerivatives, float]

MOST_NODES = 20_000
"""Largest number of points of one track [1]."""
STEPS = 16
"""Largest number of Newton steps to a bounce point [1]."""
CLOSE = 1e-4
"""Newton step at which the iteration has converged [m]: the path length is then exact to a nanometre."""
FARTHEST = 3.0
"""Largest `shadow_depth` beyond a fold at which there is still a bounce [1]."""
COLUMNS = 14
"""Columns of a bounce point. Derivatives are those of the whole path's length as the point moves over the surface.

0-2: north, east, height [m]. 3, 4: path lengths from the start and from the scatterer [m], in layered water replaced
by travel times times the speed at the surface, see `bounce_rays`. 5: cosine of the angle of incidence times the length
of the normal that has 1 upwards [1], and 6: height over path length [1], both means of the two parts. 7, 8: second
derivatives along the axis where it is smaller in magnitude (weak), and along the other (strong) [1/m]. 9, 10: fourth
ones by the waves alone, along weak and strong axis [1/m^3]; 11: 0. A fold in whose shadow the scatterer lies has the
third derivative [1/m^2] in 9, and the first one [1] in 11, both along the weak axis. 12, 13: weak axis, north and east.
"""
NONE, THERE, LIT = 0, 1, 2
"""Results of `refine_bounce_point`: no bounce; a bounce; a fold on its bright side, with two bounces beside it."""


class SurfaceLeg(NamedTuple):
    """One leg by way of the surface; north and east are those from the sea's origin."""

    start: Floats
    """North, east and depth of the sonar [m], unfolded at the bottom if the leg has a bottom bounce there, (3,)."""
    end: Floats
    """North, east and depth of the scatterer [m], unfolded in the same way, (3,)."""
    time: float
    """Time at which the sound leaves the sonar on a transmit leg, the scatterer on a receive leg [s]."""
    slowness: float
    """Mean slowness of sound from there to the surface [s/m]."""
    is_transmit: bool
    """True if the sound comes from the start, False if it comes from the scatterer."""
    waves: Floats
    """Waves, as for `surface_derivatives`, (5, m)."""
    water: SurfaceWater
    """The water; without knots, of one sound speed."""


class BounceSearch(NamedTuple):
    """Extent and resolution of the search for bounce points."""

    max_slope: float
    """Greatest slope that the surface may have [1]."""
    step: float
    """Distance between points of the track, an eighth of the shortest wave; longest step of the refinement [m]."""
    cell_size: float
    """Side of the cells whose scatterers share a search [m]."""
    wavenumber: float
    """Wavenumber of the sound [rad/m]."""


class LegEnds(NamedTuple):
    """Scatterers at which the legs from one start end, in groups that share a search: n scatterers, g groups."""

    position: Floats
    """North, east and unfolded depth of each scatterer [m], (n, 3)."""
    time: Floats
    """`SurfaceLeg.time` of its leg [s], (n,)."""
    first: Integers
    """Index of each group's first entry of `order`, and n after the last, (g + 1,)."""
    order: Integers
    """Rows of the scatterers, group by group, (n,)."""
    group_position: Floats
    """Position for which each group is searched: the centre of its cell, depth unfolded [m], (g, 3)."""
    group_time: Floats
    """`SurfaceLeg.time` of the leg to that position [s], (g,)."""


class Cubic(NamedTuple):
    """Hermite's cubic from t = 0 to 1: values f0, f1 and derivatives d0, d1 by t at both, in the function's unit."""

    f0: float
    d0: float
    f1: float
    d1: float


@njit(cache=True, nogil=True, error_model="numpy")
def bounce_range_for_slope(slope: float, distance: float, start_depth: float, end_depth: float) -> float:
    """Horizontal distance from the start to the point of the mean surface that reflects a leg if it has a slope [m].

    With g1, g2 the grazing angles towards both ends, tan(g1 - g2) = tan 2e where tan e is the slope: a quadratic.

    slope: positive where the surface rises towards the scatterer [1]; distance: horizontal, from start to scatterer;
    start_depth, end_depth: those of start and scatterer, unfolded [m].
    """
    tangent = 2 * slope / (1 - slope * slope)
    linear = start_depth + end_depth + tangent * distance
    root = math.sqrt(max(linear * linear - 4 * tangent * start_depth * (distance - tangent * end_depth), 0.0))
    return 2 * start_depth * (distance - tangent * end_depth) / max(linear + root, 1e-12)


@njit(cache=True, nogil=True, error_model="numpy")
def surface_and_paths(north: float, east: float, leg: SurfaceLeg) -> SurfaceAndPaths:
    """Derivatives of the surface at one point when sound arrives there, and of the paths to start and to scatterer.

    The last result is that time of arrival [s], by the part of the leg that the sound travels first.
    """
    start, end = leg.start, leg.end
    # a: from the start; b: from the scatterer; d: from the one that the sound leaves
    an, ae, bn, be = north - start[0], east - start[1], north - end[0], east - end[1]
    dn, de, end_depth = (an, ae, start[2]) if leg.is_transmit else (bn, be, end[2])
    before = math.sqrt(dn * dn + de * de + end_depth * end_depth)
    slowness_per_metre = leg.slowness / before
    time = leg.time + leg.slowness * before
    sea = surface_derivatives(north, east, time, slowness_per_metre * dn, slowness_per_metre * de, leg.waves)
    water = leg.water
    if water.depth.size:
        path = refracted_derivatives(an, ae, start[2], 0, sea, water)
        return sea, path, refracted_derivatives(bn, be, end[2], 1, sea, water), time
    return sea, end_to_surface_path(an, ae, start[2], sea), end_to_surface_path(bn, be, end[2], sea), time


@njit(cache=True, nogil=True, error_model="numpy")
def _transverse_stationary_point(
    x: float, y: float, track_north: float, track_east: float, leg: SurfaceLeg, step: float
) -> tuple[float, float, float, float]:
    """One Newton step from a point beside the track to where the path length is stationary across the track.

    These stationary points form the ridge. x, y: ahead of the start along the track, and to the right of it [m].

    Returns:
        Distance of the ridge to the right of the track [m]; its derivative by x [1]; first [1] and second [1/m]
        derivative of the path length by x, along the ridge.
    """
    north, east = leg.start[0] + x * track_north - y * track_east, leg.start[1] + x * track_east + y * track_north
    _, start_path, end_path, _ = surface_and_paths(north, east, leg)
    gn, ge = start_path[1] + end_path[1], start_path[2] + end_path[2]
    hnn, hne, hee = start_path[3] + end_path[3], start_path[4] + end_path[4], start_path[5] + end_path[5]
    gx, gy = gn * track_north + ge * track_east, ge * track_north - gn * track_east
    hxx = hnn * track_north**2 + 2 * hne * track_north * track_east + hee * track_east**2
    hyy = hnn * track_east**2 - 2 * hne * track_north * track_east + hee * track_north**2
    hxy = (hee - hnn) * track_north * track_east + hne * (track_north**2 - track_east**2)
    # at least a fifth (chosen) of that of a flat surface: the waves may not reverse the step
    hyy_used = max(hyy, 0.2 * (1 / start_path[0] + 1 / end_path[0]))
    dy = min(max(-gy / hyy_used, -step), step)
    return y + dy, -hxy / hyy_used, gx + hxy * dy, hxx - hxy * hxy / hyy_used


@njit(cache=True, nogil=True, error_model="numpy")
def _cubic_value(cubic: Cubic, t: float) -> float:
    """Hermite's cubic at t, from 0 to 1."""
    f0, d0, f1, d1 = cubic
    s = 1 - t
    return s * s * (f0 * (1 + 2 * t) + d0 * t) + t * t * (f1 * (3 - 2 * t) - d1 * s)


@njit(cache=True, nogil=True, error_model="numpy")
def _bisected(cubic: Cubic, low: float, high: float) -> float:
    """Zero of the cubic between two positions at which it has opposite signs, to 1/8192 of their distance."""
    low_value = _cubic_value(cubic, low)
    for _ in range(12):
        middle = (low + high) / 2
        if (_cubic_value(cubic, middle) > 0) == (low_value > 0):
            low = middle
        else:
            high = middle
    return (low + high) / 2


@njit(cache=True, nogil=True, error_model="numpy")
def _monotone_intervals(cubic: Cubic, knots: Floats) -> int:
    """Fill knots with the positions from 0 to 1 between which a cubic is monotone, (4,); return number of intervals."""
    f0, d0, f1, d1 = cubic
    c0, c1, c2 = d0, 6 * (f1 - f0) - 4 * d0 - 2 * d1, 6 * (f0 - f1) + 3 * (d0 + d1)  # of the derivative
    knots[0], count = 0.0, 1
    discriminant = c1 * c1 - 4 * c0 * c2
    if discriminant > 0:
        q = -(c1 + math.copysign(math.sqrt(discriminant), c1)) / 2
        first = q / c2 if c2 != 0 else 2.0  # 2: outside
        second = c0 / q if q != 0 else 2.0
        for turn in (min(first, second), max(first, second)):
            if 0 < turn < 1:
                knots[count] = turn
                count += 1
    knots[count] = 1.0
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _rough_zeros(
    gradient: Cubic, pitch: float, gradient_spread: float, wavenumber: float, seeds: Floats, folds: Floats
) -> tuple[int, int]:
    """Approximate zeros of a gradient between two points of a track, and folds: extrema near which it is nearly zero.

    Args:
        gradient: Derivative of the path length along the ridge [1], from the first point to the second.
        pitch: Spacing of the points [m].
        gradient_spread: Largest difference of the gradient between scatterers that share the search [1].
        wavenumber: Wavenumber of the sound [rad/m].
        seeds: Filled with positions of zeros, from 0 to 1, and with both sides of folds within the spread, (12,).
        folds: Filled with positions of folds, (4,).

    Returns:
        Numbers of seeds and of folds.
    """
    knots, zero_count, fold_count = np.empty(4), 0, 0
    count = _monotone_intervals(gradient, knots)
    f0, d0, f1, d1 = gradient
    low = f0
    for k in range(count):
        high = _cubic_value(gradient, knots[k + 1])
        if (low > 0) != (high > 0):
            seeds[zero_count] = _bisected(gradient, knots[k], knots[k + 1])
            zero_count += 1
        low = high
        if k + 1 < count:
            t = knots[k + 1]
            second = max(abs((1 - 2 * t) * 6 * (f1 - f0) + (6 * t - 4) * d0 + (6 * t - 2) * d1), 1e-12)
            if abs(high) < gradient_spread:
                half_width = math.sqrt(2 * abs(high) / second)
                seeds[zero_count], seeds[zero_count + 1] = t - half_width, t + half_width
                zero_count += 2
            if abs(high) < gradient_spread + FARTHEST * (second / pitch**2 / (2 * wavenumber**2)) ** (1 / 3):
                folds[fold_count] = t
                fold_count += 1
    return zero_count, fold_count


@njit(cache=True, nogil=True, error_model="numpy")
def search_bounce_points(leg: SurfaceLeg, search: BounceSearch, seeds: Floats, folds: Floats) -> tuple[int, int]:
    """Approximate bounce points of one path: zeros along a track whose every point is stationary across the track.

    Args:
        leg: The leg.
        search: Extent and resolution.
        seeds: Filled with north and east of approximate bounce points [m], shape (2, capacity).
        folds: Filled with north and east of approximate folds [m], shape (2, capacity).

    Returns:
        Numbers of seeds and of folds.
    """
    start, end, step, wavenumber = leg.start, leg.end, search.step, search.wavenumber
    leg.water.last[:] = 0.0
    north, east = end[0] - start[0], end[1] - start[1]
    distance = math.hypot(north, east)
    track_n, track_e = (north / distance, east / distance) if distance > 1e-6 else (1.0, 0.0)
    # Somewhat beyond the largest slope, as far as the shadow of a fold with that slope reaches.
    sine = max((start[2] + end[2]) / math.hypot(distance, start[2] + end[2]), 1e-3)
    third = search.max_slope * (math.pi / 4 / step) ** 2  # of the height at most [1/m^2]: the shortest wave is 8 steps
    steep = search.max_slope + min(FARTHEST * (sine * third / wavenumber**2) ** (1 / 3) / (2 * sine), search.max_slope)
    if leg.water.depth.size:
        first_range = bounce_range_for_slope_in_layers(steep, distance, start[2], end[2], leg.water)
        second_range = bounce_range_for_slope_in_layers(-steep, distance, start[2], end[2], leg.water)
    else:
        first_range = bounce_range_for_slope(steep, distance, start[2], end[2])
        second_range = bounce_range_for_slope(-steep, distance, start[2], end[2])
    low, high = min(first_range, second_range) - step, max(first_range, second_range) + step
    nodes = min(max(int((high - low) / step) + 2, 3), MOST_NODES)
    pitch = (high - low) / (nodes - 1)
    y = y_slope = f0 = d0 = 0.0
    zeros, turns, count, fold_count = np.empty(12), np.empty(4), 0, 0
    for _ in range(6):  # Newton steps at the first point (chosen); one at each later point
        y, y_slope, f0, d0 = _transverse_stationary_point(low, y, track_n, track_e, leg, step)
    for node in range(1, nodes):
        x, y0, y_slope0 = low + node * pitch, y, y_slope
        y, y_slope, f1, d1 = _transverse_stationary_point(x, y + y_slope * pitch, track_n, track_e, leg, step)
        # change of the gradient as the scatterer moves by the size of the cell, and half as much again (chosen)
        r2 = math.sqrt((distance - x) ** 2 + end[2] ** 2)
        gradient_spread = 1.5 * search.cell_size * (end[2] / r2) ** 2 / r2
        gradient, ridge = Cubic(f0, d0 * pitch, f1, d1 * pitch), Cubic(y0, y_slope0 * pitch, y, y_slope * pitch)
        zero_count, turn_count = _rough_zeros(gradient, pitch, gradient_spread, wavenumber, zeros, turns)
        for k in range(zero_count + turn_count):
            t = zeros[k] if k < zero_count else turns[k - zero_count]
            along, across = x - pitch + t * pitch, _cubic_value(ridge, t)
            point = (start[0] + along * track_n - across * track_e, start[1] + along * track_e + across * track_n)
            if k < zero_count and count < seeds.shape[1]:
                seeds[0, count], seeds[1, count] = point
                count += 1
            elif k >= zero_count and fold_count < folds.shape[1]:
                folds[0, fold_count], folds[1, fold_count] = point
                fold_count += 1
        f0, d0 = f1, d1
    return count, fold_count


@njit(cache=True, nogil=True, error_model="numpy")
def refine_bounce_point(
    north: float, east: float, leg: SurfaceLeg, search: BounceSearch, is_fold: bool, point: Floats
) -> int:
    """Refine an approximate bounce point, or fold, by Newton's method.

    At a fold the path length is stationary along the strong axis, and has no second derivative along the weak one.

    Args:
        north: North coordinate of the approximate point [m].
        east: East coordinate of the approximate point [m].
        leg: The leg.
        search: Longest step and wavenumber.
        is_fold: True to search for a fold.
        point: Filled with the columns of the point, see `COLUMNS`.

    Returns:
        NONE, THERE or LIT. A fold counts as there if the scatterer lies in its shadow, up to `FARTHEST` deep.
    """
    moved, stride = math.inf, search.step
    leg.water.last[:] = 0.0  # the result depends on this search alone
    for _ in range(STEPS):
        sea, first, second, time = surface_and_paths(north, east, leg)
        gn, ge = first[1] + second[1], first[2] + second[2]
        weak, strong, un, ue = principal_curvatures(first[3] + second[3], first[4] + second[4], first[5] + second[5])
        gu, gv, third = un * gn + ue * ge, un * ge - ue * gn, 0.0
        if is_fold or moved < CLOSE:
            sea_third, fourth_along, fourth_across = surface_derivatives_along(north, east, time, un, ue, leg.waves)
            third = path_third_derivative(un, ue, first, sea, sea_third) + path_third_derivative(
                un, ue, second, sea, sea_third
            )
        if moved < CLOSE:
            point[0], point[1], point[2], point[3], point[4] = north, east, sea[0], first[0], second[0]
            point[5], point[6] = (first[7] + second[7]) / 2, (first[6] + second[6]) / 2
            point[7], point[8] = weak, strong
            point[9], point[10] = (first[6] + second[6]) * fourth_along, (first[6] + second[6]) * fourth_across
            point[11] = 0.0
            if is_fold:
                point[9], point[11] = third, gu
            point[12], point[13] = un, ue
            if min(first[7], second[7]) <= 0:
                return NONE  # from behind the wave
            if not is_fold:
                return THERE
            if gu * third <= 0:
                return LIT
            return THERE if shadow_depth(gu, third, search.wavenumber) < FARTHEST else NONE
        shift = weak / third if is_fold and third != 0 else gu / weak if weak != 0 else math.inf
        du, dv = -min(max(shift, -stride), stride), -min(max(gv / strong, -stride), stride)
        moved = math.hypot(du, dv)
        north, east = north + un * du - ue * dv, east + ue * du + un * dv
    return NONE


@njit(cache=True, nogil=True, error_model="numpy")
def shadow_depth(gradient: float, third: float, wavenumber: float) -> float:
    """Argument of Airy's function in the shadow of a fold, at first and third derivatives of the path length [1]."""
    return abs(gradient) * (2 * wavenumber**2 / max(abs(third), 1e-30)) ** (1 / 3)


@njit(cache=True, nogil=True, error_model="numpy")
def _insert_bounce(point: Floats, stationary_points: Floats, count: int, min_separation: float) -> int:
    """Insert a bounce point among those of one leg, in the order of the path length before it, unless it is there.

    If the array is full, the weakest is dropped. min_separation: horizontal distance below which two are the same [m].

    Returns:
        New number of bounce points.
    """
    weakest, least_strength = 0, math.inf
    for row in range(count):
        if math.hypot(stationary_points[row, 0] - point[0], stationary_points[row, 1] - point[1]) < min_separation:
            return count
        strength = _bounce_strength(stationary_points[row])
        if strength < least_strength:
            weakest, least_strength = row, strength
    if count == stationary_points.shape[0]:
        if _bounce_strength(point) <= least_strength:
            return count
        for row in range(weakest, count - 1):
            stationary_points[row] = stationary_points[row + 1]
        count -= 1
    row = count
    while row > 0 and stationary_points[row - 1, 3] > point[3]:
        stationary_points[row] = stationary_points[row - 1]
        row -= 1
    stationary_points[row] = point
    return count + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _bounce_strength(point: Floats) -> float:
    """Intensity of a bounce re a factor common to all of a leg, to rank them; roughly for a fold, by |third|^(2/3)."""
    weak = abs(point[7]) if point[11] == 0 else abs(point[9]) ** (2 / 3)
    return (point[5] / (point[3] * point[4])) ** 2 / max(weak * abs(point[8]), 1e-30)


@njit(cache=True, nogil=True, error_model="numpy")
def bounce_points(
    start: Floats, ends: LegEnds, is_transmit: bool, waves: Floats, water: SurfaceWater, search: BounceSearch,
    count: Integers, stationary_points: Floats,
) -> None:  # fmt: skip
    """All bounce points of the legs from one start to many scatterers, and the folds in whose shadow these lie.

    Args:
        start: North, east and unfolded depth of the start [m], shape (3,).
        ends: The n scatterers.
        is_transmit: True if the sound comes from the start.
        waves: Waves, as for `surface_derivatives`, shape (5, m).
        water: The water; without knots, of one sound speed.
        search: Extent and resolution.
        count: Filled with the number of bounce points of each leg, shape (n,).
        stationary_points: Filled with their columns, nearest to the start first, shape (n, capacity, COLUMNS).
    """
    seeds, folds = np.empty((2, 4 * stationary_points.shape[1])), np.empty((2, 4 * stationary_points.shape[1]))
    point, slowness = np.empty(COLUMNS), water.slowness
    for group in range(ends.first.size - 1):
        middle = ends.group_position[group]
        if water.depth.size:  # the same for all of the group, whose depths hardly differ
            slowness = mean_slowness(start[2], water.bottom_before, water) if is_transmit else (
                mean_slowness(middle[2], water.bottom_after, water)
            )  # fmt: skip
        shared = SurfaceLeg(start, middle, ends.group_time[group], slowness, is_transmit, waves, water)
        seed_count, fold_count = search_bounce_points(shared, search, seeds, folds)
        for k in range(ends.first[group], ends.first[group + 1]):
            n = ends.order[k]
            leg = SurfaceLeg(start, ends.position[n], ends.time[n], slowness, is_transmit, waves, water)
            count[n] = 0
            for seed in range(seed_count + fold_count):
                seed_point = seeds[:, seed] if seed < seed_count else folds[:, seed - seed_count]
                before = math.hypot(math.hypot(seed_point[0] - start[0], seed_point[1] - start[1]), start[2])
                after = math.hypot(math.hypot(seed_point[0] - middle[0], seed_point[1] - middle[1]), middle[2])
                fraction = before / (before + after)  # of the scatterer's displacement: that of a flat surface's bounce
                north = seed_point[0] + fraction * (leg.end[0] - middle[0])
                east = seed_point[1] + fraction * (leg.end[1] - middle[1])
                count[n] = _follow_bounce(
                    north, east, leg, search, seed >= seed_count, point, stationary_points[n], count[n]
                )


@njit(cache=True, nogil=True, error_model="numpy")
def _follow_bounce(
    north: float, east: float, leg: SurfaceLeg, search: BounceSearch, is_fold: bool, point: Floats,
    stationary_points: Floats, count: int,
) -> int:  # fmt: skip
    """Refine one approximate bounce point or fold, and insert the results; a fold on its bright side gives two.

    Returns:
        New number of bounce points.
    """
    min_separation = search.step / 100
    kind = refine_bounce_point(north, east, leg, search, is_fold, point)
    if kind == THERE:
        return _insert_bounce(point, stationary_points, count, min_separation)
    if kind == NONE:
        return count
    half_width = math.sqrt(2 * abs(point[11] / point[9]))
    if half_width > 2 * search.step:
        return count
    n, e, un, ue = point[0], point[1], half_width * point[12], half_width * point[13]
    for side in (-1.0, 1.0):
        if refine_bounce_point(n + side * un, e + side * ue, leg, search, False, point) == THERE:
            count = _insert_bounce(point, stationary_points, count, min_separation)
    return count
