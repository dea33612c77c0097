"""Gain of beams for legs whose directions are spread by a moving surface: arithmetic of `engines.glint_spread`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamMajorants, array_cosines, cosine_bounds, largest_beam

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


class GlintDeviations(NamedTuple):
    """Deviations of the glints of n neighbourhoods from the departure off a calm surface."""

    tilt: Floats
    """See `glint_spread.LegSpread`, shape (n,)."""
    turn: Floats
    """See `glint_spread.LegSpread`, shape (n,)."""
    slopes: Floats
    """See `glint_spread.GlintSpread`."""
    reach: float
    """Standard deviations that count."""


@njit(cache=True, nogil=True, error_model="numpy")
def pattern_with_spread(table: Floats, unspread: float, per_unit: float, x: float, spread: float) -> float:
    """Pattern at distance x from its axis, in the fourth-power mean over directions spread by so much.

    Args:
        table: Of `glint_spread.spread_gain_tables`.
        unspread: Envelope of the pattern there without any spread [1].
        per_unit: Rows of the beam's own table per unit of direction cosine [1].
        x: Distance from the axis in direction cosine [1].
        spread: Standard deviation of the direction cosine [1].
    """
    if table.shape[0] == 0 or spread <= 0.0:
        return unspread
    index = min(x * (per_unit / ROWS_PER_SPREAD_ROW), table.shape[1] - 1.0)
    row = min(int(index), table.shape[1] - 2)
    part, times = index - row, spread * (per_unit / MIN_SPREAD_ROWS)
    if times <= 1.0:
        return unspread + times * (table[0, row] + part * (table[0, row + 1] - table[0, row]) - unspread)
    octave = min(math.log2(times), table.shape[0] - 1.0)
    i = min(int(octave), table.shape[0] - 2)
    low = table[i, row] + part * (table[i, row + 1] - table[i, row])
    high = table[i + 1, row] + part * (table[i + 1, row + 1] - table[i + 1, row])
    return low + (octave - i) * (high - low)


@njit(cache=True, nogil=True, error_model="numpy")
def cosine_spreads(
    ray_north: float, ray_east: float, down: float, tilt: float, turn: float, slopes: Floats, axes: Floats
) -> tuple[float, float]:
    """Standard deviations of a departing glint's cosines to the right and down of an array [1].

    Args:
        ray_north: North of the horizontal direction to the far end of the leg [1].
        ray_east: East of it [1].
        down: Downward component of the departure [1].
        tilt: See `glint_spread.LegSpread`.
        turn: See `glint_spread.LegSpread`.
        slopes: See `glint_spread.GlintSpread`.
        axes: Boresight, right and down of the array in the world, as rows, shape (3, 3).
    """
    horizontal = math.sqrt(max(1.0 - down * down, 0.0))
    along = ray_north * ray_north * slopes[0] + 2 * ray_north * ray_east * slopes[1] + ray_east * ray_east * slopes[2]
    across = slopes[0] + slopes[2] - along
    up, right = tilt * math.sqrt(max(along, 0.0)), turn * math.sqrt(max(across, 0.0))
    u = up * (-down * (ray_north * axes[1, 0] + ray_east * axes[1, 1]) + horizontal * axes[1, 2])
    v = up * (-down * (ray_north * axes[2, 0] + ray_east * axes[2, 1]) + horizontal * axes[2, 2])
    s = right * (ray_north * axes[1, 1] - ray_east * axes[1, 0])
    t = right * (ray_north * axes[2, 1] - ray_east * axes[2, 0])
    return math.sqrt(u * u + s * s), math.sqrt(v * v + t * t)


@njit(cache=True, nogil=True, error_model="numpy")
def glint_bounds(
    direction: Floats, margin: Floats, horizontal: Floats, spread: GlintDeviations, beams: BeamMajorants,
    out: Floats,
) -> None:  # fmt: skip
    """Bound of every beam's magnitude within some deviations of the glints of n neighbourhoods, into out (n,).

    Args:
        direction: Unit vectors of departure off a calm surface, shape (n, 3).
        margin: How far from them rays to the neighbourhood can leave [rad], shape (n,).
        horizontal: Horizontal directions to the neighbourhoods [1], shape (n, 2).
        spread: Deviations of the glints.
        beams: The beams.
        out: Result.
    """
    tilt, turn = spread.tilt, spread.turn
    for n in range(direction.shape[0]):
        cos_margin, sin_margin = math.cos(min(margin[n], math.pi)), math.sin(min(margin[n], math.pi))
        w, u, v = array_cosines(beams.axes, direction[n, 0], direction[n, 1], direction[n, 2])
        su, sv = cosine_spreads(
            horizontal[n, 0], horizontal[n, 1], direction[n, 2], tilt[n], turn[n], spread.slopes,
            beams.axes,
        )  # fmt: skip
        su, sv = spread.reach * su, spread.reach * sv
        _, w = cosine_bounds(w, cos_margin, sin_margin)
        u0, u1 = cosine_bounds(u, cos_margin, sin_margin)
        v0, v1 = cosine_bounds(v, cos_margin, sin_margin)
        w = min(w + max(su, sv), 1.0) + 1e-12
        out[n] = largest_beam(beams, w, (u0 - su, u1 + su), (v0 - sv, v1 + sv))
