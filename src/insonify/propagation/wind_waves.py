"""Wind waves as tables: distribution of the height variance over wavelength, direction and frequency.

Tables for drawing waves in proportion to their fraction of the surface's variance. Built once for each wind.
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

LENGTHS, DIRECTIONS, TURNS = 1024, 48, 65
"""Wavenumbers of the table; wavenumbers with direction tables; probabilities of a direction."""
GUIDES = 4096
"""Steps of the guide table to the rows."""
SLOPE_CUT = 3.0
"""Wavenumber of the sound over that of the shortest waves that count as slope [1]."""


class WindWaves(NamedTuple):
    """Sea surface as tables, in the frame of its wind: first axis along the waves, second to the right of it."""

    wavenumber: Floats
    """Wavenumbers, increasing in equal ratios [rad/m], shape (m,)."""
    variance: Floats
    """Variance of the height below each wavenumber [m^2], shape (m,)."""
    frequency: Floats
    """Angular frequency of each [rad/s], shape (m,)."""
    direction_quantiles: Floats
    """Direction re the wind's at equal steps of probability, for wavenumbers in equal ratios [rad], shape (d, t)."""
    slope_moments: Floats
    """Moments of the waves below each wavenumber, shape (4, m).

    Variance of the slope along and across the wind [1], of the vertical speed [m^2/s^2], and minus the mean of slope
    along the wind times that speed [m/s], positive for downwind waves.
    """
    row_guide: NDArray[np.int32]
    """Guide to the row of a variance fraction, shape (g + 1,).

    Entry i + 1 is a row not above it, entry i one not below, for i = floor(`GUIDES` times the root of the variance
    fraction beyond it).
    """


@lru_cache(maxsize=8)
def wind_waves(wind_speed: float, shortest: float, longest: float = 0.0) -> WindWaves:
    """Tables of the wind waves of an open sea.

    Args:
        wind_speed: Wind speed at 10 m height [m/s].
        shortest: Wavenumber of the shortest waves to include [rad/m].
        longest: Wavenumber of the longest waves to include [rad/m].

    Source: spectrum and directions of Elfouhaily et al. (1997), see `insonify.ocean`.
    """
    sea = Elfouhaily(wind_speed)
    spreading = ElfouhailySpreading(sea)
    low = max(sea.peak / 8, longest)
    k = np.geomspace(low, max(shortest, 2 * sea.peak, 1.01 * low), LENGTHS)
    wavenumbers = np.geomspace(k[0], k[-1], DIRECTIONS)
    chance = np.linspace(0, 1, TURNS)
    turn = np.stack([spreading.quantile(chance, np.full(TURNS, wavenumber)) for wavenumber in wavenumbers])
    middle = np.stack(
        [
            spreading.quantile((chance[1:] + chance[:-1]) / 2, np.full(TURNS - 1, wavenumber))
            for wavenumber in wavenumbers
        ]
    )
    mean_cosine, mean_square_cosine = (
        np.interp(np.log(k), np.log(wavenumbers), column.mean(axis=1))
        for column in (np.cos(middle), np.cos(middle) ** 2)
    )
    density, omega = sea.density(k), angular_frequency(k)
    columns = (k**2 * mean_square_cosine, k**2 * (1 - mean_square_cosine), omega**2, k * omega * mean_cosine)
    moment = np.stack([_running(k, density * column) for column in columns])
    variance = _running(k, density)
    return WindWaves(k, variance, omega, turn, moment, row_guide(variance))


def row_guide(variance: Floats) -> NDArray[np.int32]:
    """Guide to the rows of an increasing variance, see `WindWaves.row_guide`."""
    share = variance[-1] * (1 - (np.arange(GUIDES + 1) / GUIDES) ** 2)
    return np.clip(np.searchsorted(variance, share, side="right") - 1, 0, len(variance) - 2).astype(np.int32)


def shortest_wavenumber(frequency: float, sound_speed: float) -> float:
    """Wavenumber of the shortest waves that count as slope for sound [rad/m].

    Args:
        frequency: Frequency of the sound [Hz].
        sound_speed: Sound speed at the surface [m/s].
    """
    return 2 * math.pi * frequency / sound_speed / SLOPE_CUT


def _running(k: Floats, density: Floats) -> Floats:
    """Integral of a density over wavenumber up to each k; trapezoids in log k follow power laws."""
    per_log = density * k
    return np.concatenate(([0.0], np.cumsum((per_log[1:] + per_log[:-1]) / 2 * np.diff(np.log(k)))))
