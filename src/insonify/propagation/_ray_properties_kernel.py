"""Blocks of rays of one ray branch: Newton steps to the points, and ray properties. Plain numbers and arrays only.

Rays of a block go through the slabs together, so that loops over rays are vectorised. Time and length of a slab have
closed forms, finite for vanishing gradient, for horizontal rays and at turning points (arcs: Officer 1958, not
verified; rearranged so that nothing nearly equal is subtracted). With c1, c2 the speeds at its nodes, s1, s2 the sines
of the grazing angles there, g the gradient, dz the thickness and p the horizontal slowness:

    t = w atanh(g w) / (g w),  w = dz (c1 + c2) (1 + s1 s2) / ((s1 + s2) (c1^2 + c2^2 s1^2)),
    length = 2 dz / (s1 + s2) atan(y) / y,  y = p g dz / (s1 + s2).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._layer_sequence_kernel import (
    DEPTH,
    ENTRY,
    FIRST,
    GRADIENT,
    HALF_TURNS,
    KAPPA,
    LAST,
    LAYER_SEQUENCE,
    PASSAGES,
    POINT,
    RADII,
    SOURCE,
    SPEED,
    STRETCH,
    TOP,
)

Floats = NDArray[np.float64]

# Columns of a ray.
DELAY = 0  # one-way travel time [s]
SIN_LAUNCH = 1  # sine of the launch angle, + down [1]
SIN_ARRIVAL = 2  # sine of the angle of travel at the point, + down [1]
SLOWNESS = 3  # horizontal slowness p = cos(launch) / c(source), constant along the ray [s/m]
AMPLITUDE = 4  # pressure by ray-tube spreading re that at 1 m, at most `MAX_AMPLITUDE` [1]
LENGTH = 5  # path length [m]
CAUSTICS = 6  # number of caustics touched: each advances the phase by 90 degrees, a factor 1j for exp(+j 2 pi f t)
TURNS = 7  # number of turning points
AT_END = 8  # 1 where the point lies at the end of the ray's branch (or at its join with the next), else 0
FOLD = 9  # range of the point less that of the fold (dX/dp = 0) that ends the ray's branch [m]; inf: it ends at none
FOLD_CURVATURE = 10  # |d2X/dp2| at that fold, X the range at the point's depth [m^3/s^2]; 1 where there is none
FOLD_SIDE = 11  # +1: the ray has touched the caustic of that fold; -1: its partner, which has not; 0: no fold
COLUMNS = 12


class RaySolutions(NamedTuple):
    """Rays of one family to n points."""

    rays: Floats
    """Columns of the rays of each point, by launch angle, upward first; `ray_count` of them, (n, MAX_RAYS, COLUMNS)."""
    ray_count: NDArray[np.int64]
    """Number of rays to each point, (n,)."""
    status: NDArray[np.uint8]
    """`LegStatus`: CLEAR, or the reason for no ray: SHADOW (no ray of the family gets there), TURNED (its rays turn
    before the bounce or before the depth), BEYOND_CRITICAL (in a gap between rays that turn at a kink of the profile
    and rays that pass it), (n,)."""


BLOCK = 256  # rays that are computed together
GUESS, AT_BRANCH_END, SOLVED = 0.0, 1.0, 2.0  # states of a ray's parameter v


class RayBlock(NamedTuple):
    """Rays of one ray branch to points of one depth, arrays of shape (BLOCK,)."""

    distance: Floats
    """Distance of the point [m]."""
    v: Floats
    """Parameter of the ray, see `_ray_branch_kernel` [1]."""
    state: Floats
    """`GUESS`, `AT_BRANCH_END` (v is known, that of an end of the branch) or `SOLVED`."""
    reach: Floats
    """X, the distance of the ray at the depth of the point [m]; X / p after `complete_rays`."""
    derivative: Floats
    """dX/dv [m]; dX/dp [m^2/s] after `complete_rays`."""
    sine: Floats
    """Sine of the grazing angle at the fastest node [1]."""
    cosine: Floats
    """Cosine of the grazing angle at the fastest node [1]."""
    sine_before: Floats
    """Sine of the grazing angle at the last node passed [1]; divided by `cosine` in `ray_distances`."""
    delay: Floats
    """One-way travel time [s]."""
    length: Floats
    """Path length [m]."""
    factor: Floats
    """Work array: w [s] or dz / (s1 + s2) [m] of a slab; sine or tangent of the angle at the start of a turn [1]."""
    ratio: Floats
    """Work array: argument, then result of `atanh_ratios` [1]."""


MAX_AMPLITUDE = 1e6  # pressure re that at 1 m where the ray tube has no width (chosen) [1]
_SMALL, _MODERATE = 0.05**2, 0.3**2  # squares for which a few, or more, terms of a series give all digits


@njit(cache=True, nogil=True, error_model="numpy")
def empty_ray_block() -> RayBlock:
    """Block of rays without values."""
    rows = np.empty((12, BLOCK))
    return RayBlock(
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8], rows[9], rows[10], rows[11]
    )


@njit(cache=True, nogil=True, error_model="numpy")
def atanh_ratios(u: Floats, count: int, sign: float) -> None:
    """atanh(u) / u (sign 1) or arctan(u) / u (sign -1), in place of u.

    Args:
        u: Arguments [1], for atanh below 1 in magnitude; changed, (count or more,).
        count: Number of arguments.
        sign: 1 for atanh, -1 for arctan.
    """
    max_square = 0.0
    for i in range(count):
        max_square = max(max_square, u[i] * u[i])
    if max_square < _SMALL:
        for i in range(count):
            q = sign * u[i] * u[i]
            u[i] = 1 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * (1 / 11)))))
    elif max_square < _MODERATE:
        for i in range(count):
            q = sign * u[i] * u[i]
            series = 1 / 19 + q * (1 / 21 + q * (1 / 23 + q * (1 / 25 + q * (1 / 27 + q * (1 / 29)))))
            series = 1 / 11 + q * (1 / 13 + q * (1 / 15 + q * (1 / 17 + q * series)))
            u[i] = 1 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * series))))
    else:
        for i in range(count):
            if abs(u[i]) > 1e-8:
                u[i] = (0.5 * math.log1p(2 * u[i] / (1 - u[i])) if sign > 0 else math.atan(u[i])) / u[i]
            else:
                u[i] = 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def ray_distances(ray_branch: Floats, block: RayBlock, count: int) -> None:
    """Distances `reach` of the first rays of a block, and their `derivative`, see `_ray_branch_kernel.ray_distance`.

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
    """
    v, reach, derivative, sine_before = block.v, block.reach, block.derivative, block.sine_before
    first, last = int(ray_branch[LAYER_SEQUENCE, FIRST]), int(ray_branch[LAYER_SEQUENCE, LAST])
    kappa = ray_branch[KAPPA, first]
    for i in range(count):
        sine_before[i] = math.sqrt(v[i] * v[i] + kappa)
        reach[i] = derivative[i] = 0.0
    for j in range(first, last):
        kappa, stretch = ray_branch[KAPPA, j + 1], ray_branch[STRETCH, j]
        for i in range(count):
            sine_after = math.sqrt(v[i] * v[i] + kappa)
            product = sine_before[i] * sine_after
            term = stretch / (product * (sine_before[i] + sine_after))
            reach[i] += term * product
            derivative[i] -= term
            sine_before[i] = sine_after
    for side in range(2):
        radii = ray_branch[LAYER_SEQUENCE, RADII + side]
        if radii > 0:
            kappa = ray_branch[KAPPA, int(ray_branch[LAYER_SEQUENCE, ENTRY + side])]
            for i in range(count):
                t = math.sqrt(v[i] * v[i] + kappa)
                reach[i] += radii * t
                derivative[i] += radii / t
    for i in range(count):
        derivative[i] *= v[i]


@njit(cache=True, nogil=True, error_model="numpy")
def newton_steps(ray_branch: Floats, block: RayBlock, count: int, a: float, b: float, direct: bool) -> None:
    """A few Newton steps of all rays of a block; the `state` of one that converges becomes `SOLVED`.

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
        a: Least v.
        b: Greatest v.
        direct: True for a ray branch without turns: then 1/X is nearly linear in v, and the steps are made on it.
    """
    distance, v, state, reach, derivative = block.distance, block.v, block.state, block.reach, block.derivative
    tolerance = 3e-6 if direct else 1e-8  # of v: the remaining error is its square, or near a fold somewhat more
    for _ in range(6):
        ray_distances(ray_branch, block, count)
        unsolved_count = 0
        for i in range(count):
            scale = reach[i] / distance[i] if direct else 1.0
            step = scale * (distance[i] - reach[i]) / derivative[i]
            is_guess = state[i] == GUESS
            has_converged = abs(step) <= tolerance * v[i]
            v[i] = min(b, max(a, v[i] + step)) if is_guess else v[i]
            state[i] = SOLVED if is_guess and has_converged else state[i]
            unsolved_count += 1 if is_guess and not has_converged else 0
        if unsolved_count == 0:
            break


@njit(cache=True, nogil=True, error_model="numpy")
def complete_rays(ray_branch: Floats, block: RayBlock, count: int) -> None:
    """Time, length and ray tube of rays of known v; `reach` becomes X / p, `derivative` dX/dp.

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
    """
    _, v, _, reach, derivative, sine, cosine, sine_before, delay, length, factor, ratio = block
    first, last = int(ray_branch[LAYER_SEQUENCE, FIRST]), int(ray_branch[LAYER_SEQUENCE, LAST])
    top_speed = ray_branch[LAYER_SEQUENCE, TOP]
    kappa = ray_branch[KAPPA, first]
    for i in range(count):
        cosine[i] = 1 / math.sqrt(1 + v[i] * v[i])
        sine[i] = v[i] * cosine[i] if v[i] < 1e100 else 1.0
        sine_before[i] = math.sqrt(sine[i] * sine[i] + cosine[i] * cosine[i] * kappa)
        reach[i] = derivative[i] = delay[i] = length[i] = 0.0
    for j in range(first, last):
        c1, c2, g, n = ray_branch[SPEED, j], ray_branch[SPEED, j + 1], ray_branch[GRADIENT, j], ray_branch[PASSAGES, j]
        dz, kappa = ray_branch[DEPTH, j + 1] - ray_branch[DEPTH, j], ray_branch[KAPPA, j + 1]
        for i in range(count):
            sine_after = math.sqrt(sine[i] * sine[i] + cosine[i] * cosine[i] * kappa)
            product, per = sine_before[i] * sine_after, dz / (sine_before[i] + sine_after)
            term = (c1 + c2) * per
            reach[i] += n * term
            derivative[i] += n * term / product
            factor[i] = term * (1 + product) / (c1 * c1 + c2 * c2 * sine_before[i] * sine_before[i])
            ratio[i] = g * factor[i]
            sine_before[i] = sine_after
        if g == 0:
            for i in range(count):
                delay[i] += n * factor[i]
                length[i] += n * dz / sine_before[i]
            continue
        atanh_ratios(ratio, count, 1.0)
        for i in range(count):
            delay[i] += n * factor[i] * ratio[i]
        # The sum of the sines from w: dz / (s1 + s2) again, as the sines are overwritten.
        kappa = ray_branch[KAPPA, j]
        for i in range(count):
            upper = math.sqrt(sine[i] * sine[i] + cosine[i] * cosine[i] * kappa)
            factor[i] = dz / (upper + sine_before[i])
            ratio[i] = g / top_speed * cosine[i] * factor[i]
        atanh_ratios(ratio, count, -1.0)
        for i in range(count):
            length[i] += 2 * n * factor[i] * ratio[i]
    for side in range(2):
        if ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] > 0:
            add_turns(ray_branch, block, count, side)


@njit(cache=True, nogil=True, error_model="numpy")
def add_turns(ray_branch: Floats, block: RayBlock, count: int, side: int) -> None:
    """Add the turns to the sums of `complete_rays`: half a turn is X = s / (p |g|), t = atanh(s) / |g|.

    s is the sine of the grazing angle at the node at which the ray enters the slab, g the gradient of the slab.

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
        side: The turns above (0) or below (1).
    """
    _, _, _, reach, derivative, sine, cosine, _, delay, length, factor, ratio = block
    entry_node, top_speed = int(ray_branch[LAYER_SEQUENCE, ENTRY + side]), ray_branch[LAYER_SEQUENCE, TOP]
    per = ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] / abs(ray_branch[GRADIENT, entry_node - 1 + side])
    kappa = ray_branch[KAPPA, entry_node]
    for i in range(count):
        factor[i] = math.sqrt(sine[i] * sine[i] + cosine[i] * cosine[i] * kappa)
        ratio[i] = factor[i]
        p = cosine[i] / top_speed
        reach[i] += per * factor[i] / (p * p)
        derivative[i] -= per / (p * p * factor[i])
    atanh_ratios(ratio, count, 1.0)
    speed_ratio = top_speed / ray_branch[SPEED, entry_node]
    for i in range(count):
        delay[i] += per * factor[i] * ratio[i]
        factor[i] *= speed_ratio / cosine[i]  # tangent of the angle at the near node
        ratio[i] = factor[i]
    atanh_ratios(ratio, count, -1.0)
    for i in range(count):
        length[i] += per * factor[i] * ratio[i] * top_speed / cosine[i]


@njit(cache=True, nogil=True, error_model="numpy")
def write_ray_properties(
    ray_branch: Floats, block: RayBlock, i: int, launch_sign: float, arrival_sign: float, turns: int, rays: Floats,
    k: int, n: int,
) -> None:  # fmt: skip
    """Write one ray of a completed block, after one more Newton step.

    The delay is corrected by Fermat's principle, T(R) = T + p e + e^2 / (2 dX/dp) with e = R - X, to the third order
    in e. dX/dp grows along a ray from +0 until it turns, and restarts from minus infinity at a turn: its one passage
    through 0 between two turns, or after the last, is a caustic.

    Args:
        ray_branch: The ray branch.
        block: The rays.
        i: Index of the ray.
        launch_sign: Sign of the launch angle, +1 down.
        arrival_sign: Sign of the angle of travel at the point, +1 down.
        turns: Number of turns of the ray branch.
        rays: Result: columns of the rays, (points, MAX_RAYS, COLUMNS).
        k: Index of the point.
        n: Row among the point's rays.
    """
    top_speed = ray_branch[LAYER_SEQUENCE, TOP]
    at_source, at_point = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    k0, kr, c0 = ray_branch[KAPPA, at_source], ray_branch[KAPPA, at_point], ray_branch[SPEED, at_source]
    cr = ray_branch[SPEED, at_point]
    v, sine, cosine, dx_dp = block.v[i], block.sine[i], block.cosine[i], block.derivative[i]
    s0, sr = math.sqrt(sine * sine + cosine * cosine * k0), math.sqrt(sine * sine + cosine * cosine * kr)
    # area: squared spreading distance [m^2], the inverse square of the amplitude
    area = block.reach[i] * abs(s0 * sr * dx_dp) / (c0 * cr)
    rays[k, n, AMPLITUDE] = min(MAX_AMPLITUDE, 1 / math.sqrt(area)) if area > 0 else MAX_AMPLITUDE
    p = cosine / top_speed
    error = block.distance[i] - p * block.reach[i]
    step = -error * top_speed / (dx_dp * v * cosine * cosine * cosine)
    rays[k, n, DELAY] = block.delay[i]
    rays[k, n, LENGTH] = block.length[i] + error * p * cr
    if error != 0 and abs(step) < 0.1 * v:
        rays[k, n, DELAY] += p * error + 0.5 * error * error / dx_dp
        cosine = 1 / math.sqrt(1 + (v + step) * (v + step))
        sine = (v + step) * cosine
        s0, sr = math.sqrt(sine * sine + cosine * cosine * k0), math.sqrt(sine * sine + cosine * cosine * kr)
    rays[k, n, SLOWNESS] = cosine / top_speed
    rays[k, n, SIN_LAUNCH], rays[k, n, SIN_ARRIVAL] = launch_sign * s0, arrival_sign * sr
    rays[k, n, TURNS] = turns
    rays[k, n, CAUSTICS] = 0 if turns == 0 else turns - 1 + (1 if dx_dp > 0 else 0)
    rays[k, n, AT_END] = 1.0 if block.state[i] == AT_BRANCH_END else 0.0
    rays[k, n, FOLD], rays[k, n, FOLD_CURVATURE], rays[k, n, FOLD_SIDE] = math.inf, 1.0, 0.0
