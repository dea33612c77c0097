"""Kernels of `engines.glint_spread`: gain of beams for legs whose directions a rough boundary spreads."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamMajorants, array_cosines, cosine_bounds, largest_beam

Floats = NDArray[np.float64]

MIXTURE_DEVIATIONS = (0.5, 1.32)
"""Standard deviations of two normal distributions, re that of the slopes [1]: the slopes' density is the mean of both,
with a sharper peak and longer tails than a normal distribution."""
ROWS_PER_SPREAD_ROW = 4
"""Number of rows of a beam's table for each row of a table of spread gain."""
MIN_SPREAD_ROWS = 8.0
"""Least spread that is tabulated, in rows of the beam's table: a quarter of a lobe."""
MAX_SPREAD = 0.7
"""Greatest spread that is tabulated, at least [1]."""


class GlintStatistics(NamedTuple):
    """Statistics from which the departure directions of glints to n neighbourhoods spread."""

    elevation_change: Floats
    """Change of elevation per slope along the path, see `glint_spread.LegSpread` [rad], shape (n,)."""
    bearing_change: Floats
    """Change of bearing per slope across the path, see `glint_spread.LegSpread` [rad], shape (n,)."""
    slope_covariance: Floats
    """Covariance of the slopes: north-north, north-east, east-east [1], shape (3,)."""
    max_deviations: float
    """Number of standard deviations beyond which directions are neglected."""


@njit(cache=True, nogil=True, error_model="numpy")
def pattern_with_spread(table: Floats, unspread: float, per_unit: float, x: float, spread: float) -> float:
    """Fourth root of the mean fourth power of a pattern's majorant over directions spread about x from its axis.

    Args:
        table: That mean by spread and distance, from `glint_spread.spread_gain_tables`.
        unspread: The majorant at x [1].
        per_unit: Rows of the beam's own table per unit of direction cosine [1].
        x: Distance from the axis in direction cosine [1].
        spread: Standard deviation of the direction cosine, distributed as `MIXTURE_DEVIATIONS` [1].
    """
    if table.shape[0] == 0 or spread <= 0.0:
        return unspread
    index = min(x * (per_unit / ROWS_PER_SPREAD_ROW), table.shape[1] - 1.0)
    row = min(int(index), table.shape[1] - 2)
    fraction, times = index - row, spread * (per_unit / MIN_SPREAD_ROWS)
    if times <= 1.0:
        return unspread + times * (table[0, row] + fraction * (table[0, row + 1] - table[0, row]) - unspread)
    octave = min(math.log2(times), table.shape[0] - 1.0)
    i = min(int(octave), table.shape[0] - 2)
    low = table[i, row] + fraction * (table[i, row + 1] - table[i, row])
    high = table[i + 1, row] + fraction * (table[i + 1, row + 1] - table[i + 1, row])
    return low + (octave - i) * (high - low)


@njit(cache=True, nogil=True, error_model="numpy")
def cosine_spreads(
    ray_north: float, ray_east: float, down: float, elevation_change: float, bearing_change: float,
    slope_covariance: Floats, axes: Floats,
) -> tuple[float, float, float]:  # fmt: skip
    """Standard deviations of the direction cosines of departing glints along the axes of an array [1].

    Args:
        ray_north: North component of the horizontal unit vector to the far end of the leg [1].
        ray_east: East component [1].
        down: Downward component of the departure for a calm boundary [1].
        elevation_change: See `GlintStatistics` [rad].
        bearing_change: See `GlintStatistics` [rad].
        slope_covariance: See `GlintStatistics`, shape (3,).
        axes: Boresight, right and down of the array in the world, as rows, shape (3, 3).

    Returns:
        Deviations of the cosines to the right, down and to boresight.
    """
    horizontal = math.sqrt(max(1.0 - down * down, 0.0))
    north_north, mixed, east_east = slope_covariance[0], slope_covariance[1], slope_covariance[2]
    along = ray_north * ray_north * north_north + 2 * ray_north * ray_east * mixed + ray_east * ray_east * east_east
    across = north_north + east_east - along
    elevation = elevation_change * math.sqrt(max(along, 0.0))
    bearing = bearing_change * math.sqrt(max(across, 0.0))
    u = elevation * (-down * (ray_north * axes[1, 0] + ray_east * axes[1, 1]) + horizontal * axes[1, 2])
    v = elevation * (-down * (ray_north * axes[2, 0] + ray_east * axes[2, 1]) + horizontal * axes[2, 2])
    w = elevation * (-down * (ray_north * axes[0, 0] + ray_east * axes[0, 1]) + horizontal * axes[0, 2])
    s = bearing * (ray_north * axes[1, 1] - ray_east * axes[1, 0])
    t = bearing * (ray_north * axes[2, 1] - ray_east * axes[2, 0])
    r = bearing * (ray_north * axes[0, 1] - ray_east * axes[0, 0])
    return math.sqrt(u * u + s * s), math.sqrt(v * v + t * t), math.sqrt(w * w + r * r)


@njit(cache=True, nogil=True, error_model="numpy")
def glint_bounds(
    direction: Floats, margin: Floats, horizontal: Floats, statistics: GlintStatistics, beams: BeamMajorants,
    out: Floats,
) -> None:  # fmt: skip
    """Fill upper bounds of the pressure patterns of all beams at the glints to n neighbourhoods.

    Args:
        direction: Unit vectors of departure for a calm boundary, shape (n, 3).
        margin: Half angles of the cones in which rays to the neighbourhoods leave about them [rad], shape (n,).
        horizontal: Horizontal unit vectors to the neighbourhoods, shape (n, 2).
        statistics: Spread of the glints.
        beams: The beams.
        out: Result [1], shape (n,).
    """
    reach = statistics.max_deviations
    for n in range(direction.shape[0]):
        cos_margin, sin_margin = math.cos(min(margin[n], math.pi)), math.sin(min(margin[n], math.pi))
        w, u, v = array_cosines(beams.axes, direction[n, 0], direction[n, 1], direction[n, 2])
        su, sv, sw = cosine_spreads(
            horizontal[n, 0], horizontal[n, 1], direction[n, 2], statistics.elevation_change[n],
            statistics.bearing_change[n], statistics.slope_covariance, beams.axes,
        )  # fmt: skip
        su, sv = reach * su, reach * sv
        _, w = cosine_bounds(w, cos_margin, sin_margin)
        u0, u1 = cosine_bounds(u, cos_margin, sin_margin)
        v0, v1 = cosine_bounds(v, cos_margin, sin_margin)
        w = min(w + reach * sw, 1.0) + 1e-12
        out[n] = largest_beam(beams, w, (u0 - su, u1 + su), (v0 - sv, v1 + sv))
