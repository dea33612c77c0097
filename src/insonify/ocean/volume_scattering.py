"""Volume scattering of the water: plankton, fish, and bubbles.

Life is patchy; a layer's strength is the mean over many patches, and may change from day to day by +-10 dB. Volume
strength is the backscattering cross section per unit volume, s_v [1/m]; S_v = 10 log10 s_v [dB re 1/m].
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.units import intensity_ratio, level_db
from insonify.validity import require_number, require_numbers, warn_outside

Floats = NDArray[np.float64]

TYPICAL_STRENGTH_DB = {"dense": -60.0, "moderate": -70.0, "sparse": -80.0}
"""Volume scattering strength of coastal water at tens to hundreds of kilohertz [dB re 1/m].

Rules of thumb, not from one source; single layers have reached -46 dB in Puget Sound (28.5 kHz, 1967).
"""

ATMOSPHERE = 101325.0
"""Pressure of the air on the sea [Pa]."""
HEAT_RATIO = 1.4
"""Ratio of the specific heats of air [1]."""


@dataclass(frozen=True, slots=True)
class ScatteringLayer:
    """Layer of water with constant volume scattering strength.

    Example:
        >>> ScatteringLayer.named("moderate", top=10.0, bottom=30.0)
        ScatteringLayer(top=10.0, bottom=30.0, strength_db=-70.0)
    """

    top: float
    """Depth of the upper side [m]."""
    bottom: float
    """Depth of the lower side [m]."""
    strength_db: float
    """Volume scattering strength [dB re 1/m]."""

    def __post_init__(self) -> None:
        """Refuse layers whose top is not above the bottom, and strengths that are not numbers."""
        object.__setattr__(self, "strength_db", require_number("ScatteringLayer.strength_db", self.strength_db, "dB"))
        for name in ("top", "bottom"):
            value = getattr(self, name)
            if not (isinstance(value, float) and math.isinf(value)):  # a layer may be unlimited
                object.__setattr__(self, name, require_number(f"ScatteringLayer.{name}", value, "m"))
        if not self.top < self.bottom:
            raise ValueError(
                f"ScatteringLayer.top is {self.top} m, bottom {self.bottom} m; depth grows downward. Exchange them."
            )

    @classmethod
    def named(cls, name: str, top: float, bottom: float) -> Self:
        """Layer of typical strength.

        Args:
            name: One of `TYPICAL_STRENGTH_DB`.
            top: Depth of its upper side [m].
            bottom: Depth of its lower side [m].

        Raises:
            ValueError: The name is unknown; the nearest names are listed.
        """
        if name not in TYPICAL_STRENGTH_DB:
            near = get_close_matches(name.lower(), TYPICAL_STRENGTH_DB, n=3, cutoff=0.5) or list(TYPICAL_STRENGTH_DB)
            raise ValueError(f"{name!r} is not a named layer; the nearest are: {', '.join(near)}")
        return cls(top, bottom, TYPICAL_STRENGTH_DB[name])


def volume_strength_db(depth: ArrayLike, layers: Iterable[ScatteringLayer] | ScatteringLayer) -> Floats:
    """Volume scattering strength at depths [dB re 1/m]; overlapping layers add as powers.

    Args:
        depth: Depth [m], any shape.
        layers: Layers of the water, or a single one; each includes its top and excludes its bottom.

    Returns:
        Strength [dB re 1/m], same shape; -inf in clear water, NaN where no depth was given.

    Example:
        >>> layers = [ScatteringLayer(0.0, 20.0, -70.0), ScatteringLayer(10.0, 30.0, -70.0)]
        >>> volume_strength_db([5.0, 15.0, 25.0, 35.0], layers).round().tolist()
        [-70.0, -67.0, -70.0, -inf]
    """
    z = require_numbers("depth", depth, "m")
    total = np.where(np.isnan(z), np.nan, 0.0)
    for layer in [layers] if isinstance(layers, ScatteringLayer) else layers:
        total = total + np.where((z >= layer.top) & (z < layer.bottom), intensity_ratio(layer.strength_db), 0.0)
    return level_db(total)


def volume_backscattering_coefficient(number_density: ArrayLike, mean_backscatter: ArrayLike) -> Floats:
    """Volume backscattering coefficient of a number density of scatterers [1/m]: s_v = n <sigma_bs>.

    Args:
        number_density: Number of scatterers per volume [1/m^3], any shape.
        mean_backscatter: Mean backscattering cross section of one scatterer [m^2]: the mean of
            10^(TS/10), not of the target strength TS. Broadcast.

    Returns:
        Volume backscattering coefficient [1/m], broadcast shape of the arguments.

    Source: MacLennan, Fernandes & Dalen (2002), ICES J. Mar. Sci. 59, 365-369.
    Valid: single scattering, scatterers independent of one another; no shadowing within a school.

    Example:
        >>> fish = volume_backscattering_coefficient(number_density=0.1, mean_backscatter=10 ** (-40.0 / 10))
        >>> f"S_v = {10 * np.log10(fish):.0f} dB re 1/m"
        'S_v = -50 dB re 1/m'
    """
    return np.asarray(
        require_numbers("number_density", number_density, "1/m^3", 0.0)
        * require_numbers("mean_backscatter", mean_backscatter, "m^2", 0.0)
    )


def bubble_resonance_frequency(radius: ArrayLike, depth: ArrayLike = 0.0, *, density: ArrayLike = 1025.0) -> Floats:
    """Resonance frequency of an air bubble [Hz].

    Args:
        radius: Radius of the bubble [m], any shape.
        depth: Depth [m], broadcast.
        density: Density of the water [kg/m^3], broadcast.

    Returns:
        Resonance frequency [Hz], broadcast shape of the arguments.

    Source: Minnaert (1933), Phil. Mag. 16, 235-248: f a = sqrt(3 gamma P / rho) / (2 pi); near the
    surface about 3.25 m/s sqrt(1 + z / 10 m).
    Valid: 30 um to 3 mm; for smaller bubbles heat loss and surface tension matter, some per cent.

    Example:
        >>> (bubble_resonance_frequency(1e-3, depth=[0.0, 10.0]) / 1e3).round(1).tolist()  # kHz
        [3.2, 4.6]
    """
    a = require_numbers("radius", radius, "m", 0.0, exclude_low=True)
    warn_outside("Minnaert (1933) resonance", "radius", a, 30e-6, 3e-3, "m")
    return np.asarray(_resonance_product(depth, density) / a)


def resonant_bubble_radius(frequency: ArrayLike, depth: ArrayLike = 0.0, *, density: ArrayLike = 1025.0) -> Floats:
    """Radius of the air bubble that is resonant at a frequency [m].

    Args:
        frequency: Frequency of the sonar [Hz], any shape.
        depth: Depth [m], broadcast.
        density: Density of the water [kg/m^3], broadcast.

    Returns:
        Radius [m], broadcast shape of the arguments; source and validity as `bubble_resonance_frequency`.

    Example:
        >>> f"{1e6 * resonant_bubble_radius(100e3, depth=10.0):.0f} um"
        '46 um'
    """
    a = _resonance_product(depth, density) / require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True)
    warn_outside("Minnaert (1933) resonance", "radius", a, 30e-6, 3e-3, "m")
    return np.asarray(a)


def _resonance_product(depth: ArrayLike, density: ArrayLike) -> Floats:
    """Resonance frequency times radius [m/s]."""
    rho = require_numbers("density", density, "kg/m^3", 0.0, exclude_low=True)
    pressure = ATMOSPHERE + rho * 9.81 * require_numbers("depth", depth, "m", 0.0)
    return np.asarray(np.sqrt(3 * HEAT_RATIO * pressure / rho) / (2 * np.pi))
