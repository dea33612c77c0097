"""Rays of one lane that turns, to many points of one depth. Plain numbers and arrays only.

A lane is cut into pieces where the distance is monotone; on each, a point has one ray or none.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._finish_kernel import (
    AT_END,
    B_FAR,
    B_PINNED,
    B_SLOPE,
    B_V,
    DELAY,
    FOLD,
    FOLD_BEND,
    FOLD_SHARE,
    SIN_LAUNCH,
    SLOWNESS,
    approach,
    describe,
    finish,
)
from insonify.propagation._lane_kernel import (
    EDGE,
    IS_FOLD,
    LEVEL,
    bend_of_fold,
    monotone_pieces,
    reach,
    root,
)
from insonify.propagation._route_kernel import HALF_TURNS, ROUTE, TOP

Floats = NDArray[np.float64]

MOST = 8  # rays of one family to one point; those with the fewest turns are kept
GUESSES = 17  # rays of a piece from which those to many points are guessed
ROUNDING = 2e-13  # of a distance, at the end of a branch


@njit(cache=True, nogil=True, error_model="numpy")
def lane_rays(
    lane: Floats, fast: float, launch: float, arrival: float, low: float, high: float, work: Any, out: Any
) -> tuple[float, float]:
    """Rays of a lane that turns, to points of one depth.

    Args:
        lane: The lane.
        fast: Highest turning speed [m/s].
        launch: Sign of the launch angle, + down.
        arrival: Sign of the angle of arrival.
        low: Distance of the nearest point [m].
        high: Distance of the farthest point [m].
        work: See `direct_rays`.
        out: See `direct_rays`.

    Returns:
        Bounds of the lane's distances [m].
    """
    edges, slow = work[3], lane[ROUTE, TOP]
    end = math.sqrt((fast - slow) / slow * ((fast + slow) / slow))
    pieces = monotone_pieces(end, high, lane, edges)
    x_left = reach(LEVEL, lane)[0]
    x_end = reach(end, lane)[0]
    least, most = min(x_left, x_end), max(x_left, x_end)
    for piece in range(pieces):
        x_right = reach(edges[EDGE, piece + 1], lane)[0]
        if min(x_left, x_right) <= high * (1 + ROUNDING) and max(x_left, x_right) >= low * (1 - ROUNDING):
            piece_rays(lane, piece, x_left, x_right, launch, arrival, work, out)
        least, most = min(least, x_right), max(most, x_right)
        x_left = x_right
    return least, most


@njit(cache=True, nogil=True, error_model="numpy")
def piece_rays(
    lane: Floats, piece: int, x_left: float, x_right: float, launch: float, arrival: float, work: Any, out: Any
) -> None:
    """Rays of one monotone piece of a lane.

    Args:
        lane: The lane.
        piece: Which piece.
        x_left: Distance at its lower end [m].
        x_right: Distance at its upper end [m].
        launch: See `lane_rays`.
        arrival: See `lane_rays`.
        work: See `direct_rays`.
        out: See `direct_rays`.
    """
    here, ranges, rays, count = out
    block, pick, guesses, edges = work
    a, b, falls = edges[EDGE, piece], edges[EDGE, piece + 1], x_right < x_left
    close, away = min(x_left, x_right), max(x_left, x_right)
    found = 0
    for i in range(here[0], here[1]):
        distance, slack = ranges[i], ROUNDING * (ranges[i] + 1)
        if distance < close - slack or distance > away + slack or count[i] >= MOST:
            continue
        at_close, at_away = distance <= close + slack, distance >= away - slack
        block[B_FAR, found], block[B_PINNED, found] = distance, (1.0 if at_close or at_away else 0.0)
        block[B_V, found] = b if at_close == falls else a
        pick[found] = i
        found += 1
    if found == 0:
        return
    if found >= GUESSES:
        guess(lane, block, found, a, b, falls, guesses)
        approach(lane, block, found, a, b, False)
    for i in range(found):
        if block[B_PINNED, i] == 0:
            block[B_V, i] = root(block[B_FAR, i], a, b, falls, lane)
    finish(lane, block, found)
    turns = int(lane[ROUTE, HALF_TURNS] + lane[ROUTE, HALF_TURNS + 1]) // 2
    for i in range(found):
        k = pick[i]
        describe(lane, block, i, launch, arrival, turns, rays, k, count[k])
        for inner in range(piece, piece + 2):
            if edges[IS_FOLD, inner] > 0:
                mark_fold(rays[k, count[k]], block[B_FAR, i], edges[EDGE, inner], block[B_SLOPE, i], lane)
        if not (rays[k, count[k], AT_END] == 1 and known(rays[k], count[k])):
            count[k] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def guess(lane: Floats, block: Floats, found: int, a: float, b: float, falls: bool, guesses: Floats) -> None:
    """Guesses v for many points from a few rays of a piece, by Hermite's cubics of v over distance.

    Args:
        lane: The lane.
        block: The rays; B_V changes where it is not pinned.
        found: How many.
        a: Least v.
        b: Greatest v.
        falls: Whether distance falls with v.
        guesses: Room, (3, GUESSES).
    """
    for k in range(GUESSES):
        part = k / (GUESSES - 1.0)
        part = part * part * (3 - 2 * part)  # closer at both ends, where a fold may be
        v = max(a, b + (a - b) * part if falls else a + (b - a) * part)
        x, slope = reach(v, lane)
        guesses[0, k], guesses[1, k], guesses[2, k] = x, v, 1 / slope
    for i in range(found):
        if block[B_PINNED, i] != 0:
            continue
        distance = block[B_FAR, i]
        lower, upper = 0, GUESSES - 1
        while upper - lower > 1:
            middle = (lower + upper) // 2
            if guesses[0, middle] <= distance:
                lower = middle
            else:
                upper = middle
        width, v0, v1 = guesses[0, upper] - guesses[0, lower], guesses[1, lower], guesses[1, upper]
        t = (distance - guesses[0, lower]) / width
        u = 1 - t
        v = v0 * u * u * (1 + 2 * t) + v1 * t * t * (1 + 2 * u)
        v += width * t * u * (guesses[2, lower] * u - guesses[2, upper] * t)
        inside = min(v0, v1) <= v <= max(v0, v1)
        block[B_V, i] = v if inside else v0 + (v1 - v0) * t


@njit(cache=True, nogil=True, error_model="numpy")
def mark_fold(row: Floats, distance: float, v: float, tube: float, lane: Floats) -> None:
    """Notes a fold that bounds the ray's branch, if it is nearer than the one noted before.

    Nearer as diffraction sees it: by FOLD / FOLD_BEND^(1/3).

    Args:
        row: The ray, changed.
        distance: Of its point [m].
        v: Of the fold.
        tube: dX/dp of the ray [m^2/s].
        lane: The lane.
    """
    offset = distance - reach(v, lane)[0]
    bend = abs(bend_of_fold(v, lane))
    if abs(offset) ** 3 * row[FOLD_BEND] < abs(row[FOLD]) ** 3 * bend:
        row[FOLD], row[FOLD_BEND] = offset, bend
        row[FOLD_SHARE] = 1.0 if tube > 0 else -1.0


@njit(cache=True, nogil=True, error_model="numpy")
def known(rows: Floats, count: int) -> bool:
    """Whether the ray in row `count` joins two branches and was found on the other one already."""
    for k in range(count):
        if (
            rows[k, AT_END] == 1
            and abs(rows[k, SIN_LAUNCH] - rows[count, SIN_LAUNCH]) < 1e-5
            and abs(rows[k, SLOWNESS] - rows[count, SLOWNESS]) < 1e-10 * rows[count, SLOWNESS]
            and abs(rows[k, DELAY] - rows[count, DELAY]) < 1e-12 * (1 + rows[count, DELAY])
        ):
            return True
    return False
