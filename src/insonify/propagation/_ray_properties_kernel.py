"""Blocks of rays of one ray branch: Newton steps to the points, and ray properties. Plain numbers and arrays only.

Rays of a block go through the slabs together, so that loops over rays are vectorised. Time, length and ray
tube of a slab in closed form, finite for vanishing gradient, for horizontal rays and at turning points (Officer 1958
the arcs, from memory; the atanh and arctan forms are rearranged so that nothing nearly equal is subtracted):

    t = w atanh(g w) / (g w),  w = dz (c1 + c2) (1 + s1 s2) / ((s1 + s2) (c1^2 + c2^2 s1^2)),
    length = 2 dz / (s1 + s2) atan(y) / y,  y = p g dz / (s1 + s2).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._layer_sequence_kernel import (
    BEND,
    DEPTH,
    FIRST,
    GRADIENT,
    HALF_TURNS,
    KAPPA,
    LAST,
    LAYER_SEQUENCE,
    NEAR,
    PASSAGES,
    POINT,
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
AMPLITUDE = 4  # pressure by ray-tube spreading re 1 m, unlimited but for 1e6 [1]
LENGTH = 5  # path length [m]
CAUSTICS = 6  # number of caustics touched: each advances the phase by 90 degrees, a factor 1j for exp(+j 2 pi f t)
TURNS = 7  # turning points
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


# Rows of a block of rays.
B_FAR = 0  # distance of the point [m]
B_V = 1  # v of the ray, see `_ray_branch_kernel`
B_PINNED = 2  # 0: v is a guess; 1: v is known, at an end of the branch; 2: v is known
B_X = 3  # its distance [m]; X / p during completion
B_SLOPE = 4  # dX/dv; dX/dp [m^2/s] after completion
B_SINE = 5  # at the fastest node
B_COSINE = 6
B_BEFORE = 7  # sine at the last node passed; t while Newton's steps are made
B_DELAY = 8
B_LENGTH = 9
B_SLOW = 10  # time at the slab's speed, and its ratio to the real one
B_RATIO = 11
BLOCK_ROWS = 12
BLOCK = 256

MAX_AMPLITUDE = 1e6  # amplitude where the ray tube has no width
_SMALL, _MODERATE = 0.05**2, 0.3**2  # squares for which a few, or more, terms of a series give all digits


@njit(cache=True, nogil=True, error_model="numpy")
def atanh_ratios(block: Floats, row: int, count: int, sign: float) -> None:
    """atanh(u) / u (sign 1) or arctan(u) / u (sign -1), in place of u.

    Args:
        block: Array with the arguments, below 1.
        row: Row of the arguments.
        count: Number of arguments.
        sign: Selects the function.
    """
    max_square = 0.0
    for i in range(count):
        max_square = max(max_square, block[row, i] * block[row, i])
    if max_square < _SMALL:
        for i in range(count):
            q = sign * block[row, i] * block[row, i]
            block[row, i] = 1 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * (1 / 11)))))
    elif max_square < _MODERATE:
        for i in range(count):
            q = sign * block[row, i] * block[row, i]
            series = 1 / 19 + q * (1 / 21 + q * (1 / 23 + q * (1 / 25 + q * (1 / 27 + q * (1 / 29)))))
            series = 1 / 11 + q * (1 / 13 + q * (1 / 15 + q * (1 / 17 + q * series)))
            block[row, i] = 1 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * series))))
    else:
        for i in range(count):
            if abs(block[row, i]) > 1e-8:
                block[row, i] = (
                    0.5 * math.log1p(2 * block[row, i] / (1 - block[row, i])) if sign > 0 else math.atan(block[row, i])
                ) / block[row, i]
            else:
                block[row, i] = 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def ray_distances(ray_branch: Floats, block: Floats, count: int) -> None:
    """Distances B_X and slopes B_SLOPE of the first rays of a block; sums as in `_ray_branch_kernel.ray_distance`.

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
    """
    first, last = int(ray_branch[LAYER_SEQUENCE, FIRST]), int(ray_branch[LAYER_SEQUENCE, LAST])
    kappa = ray_branch[KAPPA, first]
    for i in range(count):
        block[B_BEFORE, i] = math.sqrt(block[B_V, i] * block[B_V, i] + kappa)
        block[B_X, i] = block[B_SLOPE, i] = 0.0
    for j in range(first, last):
        kappa, stretch = ray_branch[KAPPA, j + 1], ray_branch[STRETCH, j]
        for i in range(count):
            after = math.sqrt(block[B_V, i] * block[B_V, i] + kappa)
            both = block[B_BEFORE, i] * after
            part = stretch / (both * (block[B_BEFORE, i] + after))
            block[B_X, i] += part * both
            block[B_SLOPE, i] -= part
            block[B_BEFORE, i] = after
    for side in range(2):
        bend = ray_branch[LAYER_SEQUENCE, BEND + side]
        if bend > 0:
            kappa = ray_branch[KAPPA, int(ray_branch[LAYER_SEQUENCE, NEAR + side])]
            for i in range(count):
                t = math.sqrt(block[B_V, i] * block[B_V, i] + kappa)
                block[B_X, i] += bend * t
                block[B_SLOPE, i] += bend / t
    for i in range(count):
        block[B_SLOPE, i] *= block[B_V, i]


@njit(cache=True, nogil=True, error_model="numpy")
def newton_steps(ray_branch: Floats, block: Floats, count: int, a: float, b: float, direct: bool) -> None:
    """A few Newton steps of all rays of a block; B_PINNED of a converged ray becomes 2 (1 stays).

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
        a: Least v.
        b: Greatest v.
        direct: True for a ray branch without turns: then 1/X is nearly linear in v, and the steps are made on it.
    """
    tolerance = 3e-6 if direct else 1e-8  # of v: the remaining error is its square, or near a fold somewhat more
    for _ in range(6):
        ray_distances(ray_branch, block, count)
        moving = 0
        for i in range(count):
            scale = block[B_X, i] / block[B_FAR, i] if direct else 1.0
            step = scale * (block[B_FAR, i] - block[B_X, i]) / block[B_SLOPE, i]
            free = block[B_PINNED, i] == 0
            arrived = abs(step) <= tolerance * block[B_V, i]
            block[B_V, i] = min(b, max(a, block[B_V, i] + step)) if free else block[B_V, i]
            block[B_PINNED, i] = 2.0 if free and arrived else block[B_PINNED, i]
            moving += 1 if free and not arrived else 0
        if moving == 0:
            break


@njit(cache=True, nogil=True, error_model="numpy")
def complete_rays(ray_branch: Floats, block: Floats, count: int) -> None:
    """Time, length and ray tube of rays of known v: B_DELAY, B_LENGTH, B_X = X / p, B_SLOPE = dX/dp.

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
    """
    first, last = int(ray_branch[LAYER_SEQUENCE, FIRST]), int(ray_branch[LAYER_SEQUENCE, LAST])
    top = ray_branch[LAYER_SEQUENCE, TOP]
    kappa = ray_branch[KAPPA, first]
    for i in range(count):
        block[B_COSINE, i] = 1 / math.sqrt(1 + block[B_V, i] * block[B_V, i])
        block[B_SINE, i] = block[B_V, i] * block[B_COSINE, i] if block[B_V, i] < 1e100 else 1.0
        block[B_BEFORE, i] = math.sqrt(
            block[B_SINE, i] * block[B_SINE, i] + block[B_COSINE, i] * block[B_COSINE, i] * kappa
        )
        block[B_X, i] = block[B_SLOPE, i] = block[B_DELAY, i] = block[B_LENGTH, i] = 0.0
    for j in range(first, last):
        c1, c2, g, n = ray_branch[SPEED, j], ray_branch[SPEED, j + 1], ray_branch[GRADIENT, j], ray_branch[PASSAGES, j]
        dz, kappa = ray_branch[DEPTH, j + 1] - ray_branch[DEPTH, j], ray_branch[KAPPA, j + 1]
        for i in range(count):
            after = math.sqrt(block[B_SINE, i] * block[B_SINE, i] + block[B_COSINE, i] * block[B_COSINE, i] * kappa)
            both, per = block[B_BEFORE, i] * after, dz / (block[B_BEFORE, i] + after)
            part = (c1 + c2) * per
            block[B_X, i] += n * part
            block[B_SLOPE, i] += n * part / both
            block[B_SLOW, i] = part * (1 + both) / (c1 * c1 + c2 * c2 * block[B_BEFORE, i] * block[B_BEFORE, i])
            block[B_RATIO, i] = g * block[B_SLOW, i]
            block[B_BEFORE, i] = after
        if g == 0:
            for i in range(count):
                block[B_DELAY, i] += n * block[B_SLOW, i]
                block[B_LENGTH, i] += n * dz / block[B_BEFORE, i]
            continue
        atanh_ratios(block, B_RATIO, count, 1.0)
        for i in range(count):
            block[B_DELAY, i] += n * block[B_SLOW, i] * block[B_RATIO, i]
        # The sum of the sines from w: dz / (s1 + s2) again, as the sines are overwritten.
        kappa = ray_branch[KAPPA, j]
        for i in range(count):
            upper = math.sqrt(block[B_SINE, i] * block[B_SINE, i] + block[B_COSINE, i] * block[B_COSINE, i] * kappa)
            block[B_SLOW, i] = dz / (upper + block[B_BEFORE, i])
            block[B_RATIO, i] = g / top * block[B_COSINE, i] * block[B_SLOW, i]
        atanh_ratios(block, B_RATIO, count, -1.0)
        for i in range(count):
            block[B_LENGTH, i] += 2 * n * block[B_SLOW, i] * block[B_RATIO, i]
    for side in range(2):
        if ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] > 0:
            add_turns(ray_branch, block, count, side)


@njit(cache=True, nogil=True, error_model="numpy")
def add_turns(ray_branch: Floats, block: Floats, count: int, side: int) -> None:
    """Add the turns to the sums of `complete_rays`: half a turn is X = s / (p |g|), t = atanh(s) / |g|.

    Args:
        ray_branch: The ray branch.
        block: The rays, changed.
        count: Number of rays.
        side: The turns above (0) or below (1).
    """
    near_node, top = int(ray_branch[LAYER_SEQUENCE, NEAR + side]), ray_branch[LAYER_SEQUENCE, TOP]
    per = ray_branch[LAYER_SEQUENCE, HALF_TURNS + side] / abs(ray_branch[GRADIENT, near_node - 1 + side])
    kappa = ray_branch[KAPPA, near_node]
    for i in range(count):
        block[B_SLOW, i] = math.sqrt(
            block[B_SINE, i] * block[B_SINE, i] + block[B_COSINE, i] * block[B_COSINE, i] * kappa
        )
        block[B_RATIO, i] = block[B_SLOW, i]
        p = block[B_COSINE, i] / top
        block[B_X, i] += per * block[B_SLOW, i] / (p * p)
        block[B_SLOPE, i] -= per / (p * p * block[B_SLOW, i])
    atanh_ratios(block, B_RATIO, count, 1.0)
    share = top / ray_branch[SPEED, near_node]
    for i in range(count):
        block[B_DELAY, i] += per * block[B_SLOW, i] * block[B_RATIO, i]
        block[B_SLOW, i] *= share / block[B_COSINE, i]  # tangent of the angle at the near node
        block[B_RATIO, i] = block[B_SLOW, i]
    atanh_ratios(block, B_RATIO, count, -1.0)
    for i in range(count):
        block[B_LENGTH, i] += per * block[B_SLOW, i] * block[B_RATIO, i] * top / block[B_COSINE, i]


@njit(cache=True, nogil=True, error_model="numpy")
def write_ray_properties(
    ray_branch: Floats, block: Floats, i: int, launch_sign: float, arrival_sign: float, turns: int, rays: Floats,
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
        launch_sign: Sign of the launch angle, + down.
        arrival_sign: Sign of the angle of arrival.
        turns: Number of turns of the ray branch.
        rays: Result: (points, most, COLUMNS).
        k: Index of the point.
        n: Row among the point's rays.
    """
    top = ray_branch[LAYER_SEQUENCE, TOP]
    at_source, at_point = int(ray_branch[LAYER_SEQUENCE, SOURCE]), int(ray_branch[LAYER_SEQUENCE, POINT])
    k0, kr, c0 = ray_branch[KAPPA, at_source], ray_branch[KAPPA, at_point], ray_branch[SPEED, at_source]
    cr = ray_branch[SPEED, at_point]
    v, sine, cosine, tube = block[B_V, i], block[B_SINE, i], block[B_COSINE, i], block[B_SLOPE, i]
    s0, sr = math.sqrt(sine * sine + cosine * cosine * k0), math.sqrt(sine * sine + cosine * cosine * kr)
    width = block[B_X, i] * abs(s0 * sr * tube) / (c0 * cr)
    rays[k, n, AMPLITUDE] = min(MAX_AMPLITUDE, 1 / math.sqrt(width)) if width > 0 else MAX_AMPLITUDE
    p = cosine / top
    error = block[B_FAR, i] - p * block[B_X, i]
    step = -error * top / (tube * v * cosine * cosine * cosine)
    rays[k, n, DELAY] = block[B_DELAY, i]
    rays[k, n, LENGTH] = block[B_LENGTH, i] + error * p * cr
    if error != 0 and abs(step) < 0.1 * v:
        rays[k, n, DELAY] += p * error + 0.5 * error * error / tube
        cosine = 1 / math.sqrt(1 + (v + step) * (v + step))
        sine = (v + step) * cosine
        s0, sr = math.sqrt(sine * sine + cosine * cosine * k0), math.sqrt(sine * sine + cosine * cosine * kr)
    rays[k, n, SLOWNESS] = cosine / top
    rays[k, n, SIN_LAUNCH], rays[k, n, SIN_ARRIVAL] = launch_sign * s0, arrival_sign * sr
    rays[k, n, TURNS] = turns
    rays[k, n, CAUSTICS] = 0 if turns == 0 else turns - 1 + (1 if tube > 0 else 0)
    rays[k, n, AT_END] = 1.0 if block[B_PINNED, i] == 1 else 0.0
    rays[k, n, FOLD], rays[k, n, FOLD_CURVATURE], rays[k, n, FOLD_SIDE] = math.inf, 1.0, 0.0
