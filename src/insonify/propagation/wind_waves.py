"""Wind waves as tables: distribution of the height variance over wavenumber, direction and frequency.

From the tables random waves are drawn in proportion to the surface's variance. Built once for each wind.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.directional_spreading import ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.wave_spectrum import angular_frequency

Floats = NDArray[np.float64]

WAVENUMBER_COUNT, DIRECTION_TABLE_COUNT, QUANTILE_COUNT = 1024, 48, 65
"""Number of wavenumbers of the tables, of those with quantiles of direction, and of these quantiles."""
GUIDE_STEPS = 4096
"""Number of steps of the guide table to the rows."""
SLOPE_CUT = 3.0
"""Wavenumber of the sound over that of the shortest waves that tilt the surface for it [1]."""


class WindWaves(NamedTuple):
    """Sea surface as tables, in the frame of its wind: first axis along the waves, second to the right of it."""

    wavenumber: Floats
    """Wavenumbers, increasing in equal ratios [rad/m], shape (m,)."""
    variance: Floats
    """Variance of the height below each wavenumber [m^2], shape (m,)."""
    frequency: Floats
    """Angular frequency of the waves of each wavenumber [rad/s], shape (m,)."""
    direction_quantiles: Floats
    """Direction re the first axis at t equal steps of probability 0..1, for d wavenumbers in equal ratios over the same
    span [rad], shape (d, t)."""
    slope_moments: Floats
    """Moments of the waves below each wavenumber, shape (4, m).

    Variance of the slope along and across the wind [1], of the vertical speed [m^2/s^2], and minus the mean of slope
    along the wind times that speed [m/s], positive for downwind waves.
    """
    row_guide: NDArray[np.int32]
    """Guide to the last row of `variance` that is not above a value v, shape (GUIDE_STEPS + 1,).

    That row lies between entries i + 1 and i, where i = floor(`GUIDE_STEPS` sqrt(1 - v / total variance)).
    """


@lru_cache(maxsize=8)
def wind_waves(wind_speed: float, max_wavenumber: float, min_wavenumber: float = 0.0) -> WindWaves:
    """Tables of the wind waves of an open sea.

    Args:
        wind_speed: Wind speed at 10 m height [m/s].
        max_wavenumber: Wavenumber of the shortest waves that are included [rad/m].
        min_wavenumber: Wavenumber of the longest waves that are included [rad/m].

    Source: spectrum and directions of Elfouhaily et al. (1997), see `insonify.ocean`.
    """
    sea = Elfouhaily(wind_speed)
    spreading = ElfouhailySpreading(sea)
    lowest_wavenumber = max(sea.peak / 8, min_wavenumber)
    k = np.geomspace(lowest_wavenumber, max(max_wavenumber, 2 * sea.peak, 1.01 * lowest_wavenumber), WAVENUMBER_COUNT)
    wavenumbers = np.geomspace(k[0], k[-1], DIRECTION_TABLE_COUNT)
    probability = np.linspace(0, 1, QUANTILE_COUNT)
    quantiles = np.stack(
        [spreading.quantile(probability, np.full(QUANTILE_COUNT, wavenumber)) for wavenumber in wavenumbers]
    )
    step_direction = np.stack(
        [
            spreading.quantile((probability[1:] + probability[:-1]) / 2, np.full(QUANTILE_COUNT - 1, wavenumber))
            for wavenumber in wavenumbers
        ]
    )
    mean_cosine, mean_square_cosine = (
        np.interp(np.log(k), np.log(wavenumbers), column.mean(axis=1))
        for column in (np.cos(step_direction), np.cos(step_direction) ** 2)
    )
    density, omega = sea.density(k), angular_frequency(k)
    columns = (k**2 * mean_square_cosine, k**2 * (1 - mean_square_cosine), omega**2, k * omega * mean_cosine)
    slope_moments = np.stack([_cumulative_integral(k, density * column) for column in columns])
    variance = _cumulative_integral(k, density)
    return WindWaves(k, variance, omega, quantiles, slope_moments, row_guide(variance))


def row_guide(variance: Floats) -> NDArray[np.int32]:
    """Guide to the rows of an increasing variance, see `WindWaves.row_guide`."""
    remaining_variance = variance[-1] * (1 - (np.arange(GUIDE_STEPS + 1) / GUIDE_STEPS) ** 2)
    row = np.searchsorted(variance, remaining_variance, side="right") - 1
    return np.clip(row, 0, len(variance) - 2).astype(np.int32)


def shortest_wavenumber(frequency: float, sound_speed: float) -> float:
    """Wavenumber of the shortest waves that tilt the surface for sound [rad/m].

    Args:
        frequency: Frequency of the sound [Hz].
        sound_speed: Sound speed at the surface [m/s].
    """
    return 2 * math.pi * frequency / sound_speed / SLOPE_CUT


def _cumulative_integral(k: Floats, density: Floats) -> Floats:
    """Integral of a density over wavenumber up to each k; trapezoids in log k follow power laws."""
    per_log = density * k
    return np.concatenate(([0.0], np.cumsum((per_log[1:] + per_log[:-1]) / 2 * np.diff(np.log(k)))))
