"""Gain of beams for legs whose directions are spread by a moving surface: arithmetic of `engines.glint_spread`."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.beam_kernels import cosine_bounds, distance_to_interval, element_gain, interpolate_majorant

Floats = NDArray[np.float64]

MIXTURE_DEVIATIONS = (0.5, 1.32)
"""Standard deviations of the two normal halves of a distribution of slopes, over that of the whole [1]: few slopes in
the middle and many far out, as sums of few waves have them."""
ROWS_PER_SPREAD_ROW = 4
"""Rows of a beam's table for each row of a spread one."""
MIN_SPREAD_ROWS = 8.0
"""Least spread that is tabulated, in rows of the beam's table: a quarter of a lobe."""
MAX_SPREAD = 0.7
"""Greatest spread that is tabulated, at least [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def pattern_with_spread(table: Floats, plain: float, per_unit: float, x: float, spread: float) -> float:
    """Pattern at distance x from its axis, in the fourth mean over directions spread by so much.

    Args:
        table: Of `glint_spread.spread_patterns`.
        plain: Envelope of the pattern there without any spread [1].
        per_unit: Rows of the beam's own table per unit of direction cosine [1].
        x: Distance from the axis in direction cosine [1].
        spread: Standard deviation of the direction cosine [1].
    """
    if table.shape[0] == 0 or spread <= 0.0:
        return plain
    place = min(x * (per_unit / ROWS_PER_SPREAD_ROW), table.shape[1] - 1.0)
    row = min(int(place), table.shape[1] - 2)
    part, times = place - row, spread * (per_unit / MIN_SPREAD_ROWS)
    if times <= 1.0:
        return plain + times * (table[0, row] + part * (table[0, row + 1] - table[0, row]) - plain)
    octave = min(math.log2(times), table.shape[0] - 1.0)
    i = min(int(octave), table.shape[0] - 2)
    low = table[i, row] + part * (table[i, row + 1] - table[i, row])
    high = table[i + 1, row] + part * (table[i + 1, row + 1] - table[i + 1, row])
    return low + (octave - i) * (high - low)


@njit(cache=True, nogil=True, error_model="numpy")
def cosine_spreads(
    ahead: float, aside: float, down: float, tilt: float, turn: float, slopes: Floats, axes: Floats
) -> tuple[float, float]:
    """Standard deviations of a departing glint's cosines to the right and down of an array [1].

    Args:
        ahead: North of the horizontal direction to the far end of the leg [1].
        aside: East of it [1].
        down: Downward component of the departure [1].
        tilt: See `glint_spread.LegSpread`.
        turn: See `glint_spread.LegSpread`.
        slopes: See `glint_spread.GlintSpread`.
        axes: Boresight, right and down of the array in the world, as rows, shape (3, 3).
    """
    level = math.sqrt(max(1.0 - down * down, 0.0))
    along = ahead * ahead * slopes[0] + 2 * ahead * aside * slopes[1] + aside * aside * slopes[2]
    across = slopes[0] + slopes[2] - along
    up, right = tilt * math.sqrt(max(along, 0.0)), turn * math.sqrt(max(across, 0.0))
    u = up * (-down * (ahead * axes[1, 0] + aside * axes[1, 1]) + level * axes[1, 2])
    v = up * (-down * (ahead * axes[2, 0] + aside * axes[2, 1]) + level * axes[2, 2])
    s = right * (ahead * axes[1, 1] - aside * axes[1, 0])
    t = right * (ahead * axes[2, 1] - aside * axes[2, 0])
    return math.sqrt(u * u + s * s), math.sqrt(v * v + t * t)


@njit(cache=True, nogil=True, error_model="numpy")
def glint_bounds(
    direction: Floats, margin: Floats, ahead: Floats, tilt: Floats, turn: Floats, slopes: Floats, reach: float,
    axes: Floats, steer: Floats, scale: Floats, majorants: tuple[Floats, Floats, Floats, Floats], per_unit: Floats,
    element: int, out: Floats,
) -> None:  # fmt: skip
    """Bound of every beam's magnitude within some deviations of the glints of n neighbourhoods, into out (n,).

    Args:
        direction: Unit vectors of departure off a calm surface, shape (n, 3).
        margin: How far from them rays to the neighbourhood can leave [rad], shape (n,).
        ahead: Horizontal directions to the neighbourhoods [1], shape (n, 2).
        tilt: See `glint_spread.LegSpread`, shape (n,).
        turn: See `glint_spread.LegSpread`, shape (n,).
        slopes: See `glint_spread.GlintSpread`.
        reach: Standard deviations that count.
        axes: Columns of `Beams`, as are all the rest.
        steer: Cosines of the steered axes.
        scale: One over the element's directivity there.
        majorants: Largest magnitudes outwards of four patterns.
        per_unit: Rows per unit of each.
        element: Code of the element.
        out: Result.
    """
    across, down, long, tall = majorants
    for n in range(direction.shape[0]):
        cos_margin, sin_margin = math.cos(min(margin[n], math.pi)), math.sin(min(margin[n], math.pi))
        north, east, depth = direction[n, 0], direction[n, 1], direction[n, 2]
        su, sv = cosine_spreads(ahead[n, 0], ahead[n, 1], depth, tilt[n], turn[n], slopes, axes)
        su, sv = reach * su, reach * sv
        _, w = cosine_bounds(north * axes[0, 0] + east * axes[0, 1] + depth * axes[0, 2], cos_margin, sin_margin)
        u0, u1 = cosine_bounds(north * axes[1, 0] + east * axes[1, 1] + depth * axes[1, 2], cos_margin, sin_margin)
        v0, v1 = cosine_bounds(north * axes[2, 0] + east * axes[2, 1] + depth * axes[2, 2], cos_margin, sin_margin)
        one = element_gain(element, min(w + max(su, sv), 1.0) + 1e-12)
        one *= interpolate_majorant(long, per_unit[2], distance_to_interval(u0 - su, u1 + su, 0.0))
        one *= interpolate_majorant(tall, per_unit[3], distance_to_interval(v0 - sv, v1 + sv, 0.0))
        largest = 0.0
        for channel in range(steer.shape[0]):
            beam = interpolate_majorant(across, per_unit[0], distance_to_interval(u0 - su, u1 + su, steer[channel, 0]))
            beam *= interpolate_majorant(down, per_unit[1], distance_to_interval(v0 - sv, v1 + sv, steer[channel, 1]))
            largest = max(largest, beam * scale[channel])
        out[n] = largest * one
