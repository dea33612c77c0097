"""The veil of bubbles that breaking waves leave under the surface.

It takes sound twice on the way to the surface and back, and sends some of it home. At low
grazing angles the echo of the sea is that of its bubbles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from insonify.scattering.facet_geometry import SHALLOWEST, half_direction_change, illumination
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.tr9407 import warn_of_frequency
from insonify.validity import require_grazing_angle, require_number, require_numbers, warn_outside

LAW = "APL-UW TR 9407 (1994) surface bubbles"
DAMPING_BY_RADIATION = 0.0136
"""Share of a resonant bubble's damping that is sound, delta_r [1]."""
WINDIEST = 11.0
"""Wind above which the veil thickens by a power law [m/s]."""
MAX_LOSS_DB = 15.0
"""Loss that no bounce exceeds: past it the formula is far from any measurement [dB]."""


def bubble_loss_db(wind_speed: ArrayLike, frequency: ArrayLike, grazing: ArrayLike) -> Floats:
    """Energy that bubbles take from one bounce off the surface, way in and way out together [dB].

    Args:
        wind_speed: Wind 10 m above the sea [m/s], any shape.
        frequency: Frequency [Hz], broadcast.
        grazing: Grazing angle, 0 to pi/2 [rad], broadcast.

    Returns:
        Loss, 0 or more [dB], broadcast shape; at most 15 dB, a cap of this project.

    Source: APL-UW TR 9407 (1994), section II, eqs. 28a and b, read in secondary sources that
    reproduce its figure. Valid: 10 to 100 kHz; wind to 20 m/s (the figure's range is smaller).
    """
    u, f, angle = _checked(wind_speed, frequency, grazing)
    return np.asarray(np.minimum(_loss_db(u, f, angle), MAX_LOSS_DB))


def _loss_db(u: ArrayLike, f: ArrayLike, angle: ArrayLike) -> Floats:
    """The report's formula as printed, without cap [dB]."""
    u, f = np.asarray(u, dtype=float), np.asarray(f, dtype=float)
    windy = np.maximum(u, 6.0)
    # exp(1.2 (U - 6)): a version with exp(U - 6) is in print elsewhere and misses the report's own figure.
    light_wind = np.exp(1.2 * np.minimum(u - 6.0, 0.0))
    return np.asarray(1.26e-3 * windy**1.57 * (f / 1e3) ** 0.85 * light_wind / np.maximum(np.sin(angle), SHALLOWEST))


def bubble_extinction(wind_speed: ArrayLike, frequency: ArrayLike) -> Floats:
    """Optical depth of the veil of bubbles, straight up, beta_v [1].

    Args:
        wind_speed: Wind 10 m above the sea [m/s], any shape.
        frequency: Frequency [Hz], broadcast.

    Returns:
        Depth [1], broadcast shape: sound that crosses it once keeps exp(-beta_v) of its energy.

    Source: APL-UW TR 9407 (1994), section II, eqs. 1-16, read in a secondary source.
    """
    u, f = np.asarray(wind_speed, dtype=float), np.asarray(frequency, dtype=float) / 1e3
    gale = np.maximum(u / WINDIEST, 1.0) ** 3.5
    return np.asarray(10 ** (-5.2577 + 0.4701 * np.minimum(u, WINDIEST)) * (f / 25) ** 0.85 * gale)


@dataclass(frozen=True, slots=True)
class Bubbles:
    """The veil's own echo, in any direction, the surface above it being a mirror.

    Sound reaches a bubble straight or by way of the surface, and leaves it likewise. Straight
    back, the two mixed ways are one way run in two senses, and their pressures add: twice
    the energy, in a narrow cone.

    Source: APL-UW TR 9407 (1994), section II, in backscatter; the bistatic form and the cone are
    derived here from the same four ways through an even veil. Valid: 10 to 100 kHz.
    """

    wind_speed: float
    """Wind 10 m above the sea [m/s]."""
    frequency: float
    """Frequency [Hz]."""
    cone: float = 0.02
    """Half width of the cone of enhanced backscatter, about wavelength over 4 pi veil depths [rad]."""

    def __post_init__(self) -> None:
        """Refuse what has no bubbles."""
        object.__setattr__(
            self, "wind_speed", require_number("Bubbles.wind_speed", self.wind_speed, "m/s", 0.0, example="7")
        )
        tone = require_number("Bubbles.frequency", self.frequency, "Hz", 0.0, exclude_low=True, example="100e3")
        object.__setattr__(self, "frequency", tone)
        object.__setattr__(
            self, "cone", require_number("Bubbles.cone", self.cone, "rad", 0.0, exclude_low=True, example="0.02")
        )
        _checked(self.wind_speed, self.frequency, 0.0)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Of the sound that arrives, from the mean surface [rad], any shape.
            grazing_out: Of the sound that leaves, likewise [rad], broadcast.
            azimuth: Between the two: 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction is behind the surface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        depth = bubble_extinction(self.wind_speed, self.frequency)
        way_in, way_out = (depth / np.maximum(np.sin(g), SHALLOWEST) for g in (grazing_in, grazing_out))
        both, apart = way_in + way_out, np.abs(way_in - way_out)
        straight = -np.expm1(-2 * both) / both
        # The difference of two exponentials over their distance, without cancellation where they meet.
        ratio = np.where(apart > 1e-8, -np.expm1(-2 * apart) / np.maximum(apart, 1e-8), 2.0)
        mixed = self._enhancement(grazing_in, grazing_out, azimuth) * np.exp(-2 * np.minimum(way_in, way_out)) * ratio
        damping = 0.0255 * (self.frequency / 1e3) ** (1 / 3)
        strength = depth * DAMPING_BY_RADIATION / (4 * math.pi * damping)
        return np.asarray(strength * (straight + mixed) * illumination(grazing_in, grazing_out))

    def transmission(self, grazing: Floats) -> Floats:
        """Share of the energy that passes the veil one way, half the decibels of `bubble_loss_db` [1].

        Args:
            grazing: Grazing angle [rad], any shape. There is no cap here: what the veil hides is hidden.
        """
        return np.asarray(10 ** (-np.minimum(_loss_db(self.wind_speed, self.frequency, grazing) / 20, 150.0)))

    def _enhancement(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Two straight back, one elsewhere [1]."""
        # Half the sum of the directions in and out is zero straight back: turn the azimuth and flip the normal part.
        across, _ = half_direction_change(grazing_in, grazing_out, np.asarray(azimuth) - math.pi)
        normal = (np.sin(grazing_in) - np.sin(grazing_out)) / 2
        off_axis = 2 * np.hypot(across, normal)
        return np.asarray(1 + np.exp(-np.minimum((off_axis / self.cone) ** 2, 700.0)))


def _checked(wind_speed: ArrayLike, frequency: ArrayLike, grazing: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """The three as arrays; refused where they mean nothing, warned of where the law was not measured."""
    u = require_numbers("wind_speed", wind_speed, "m/s", 0.0, allow_nan=False, example="7")
    f = require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True, allow_nan=False, example="100e3")
    angle = require_grazing_angle("grazing", grazing, gaps=False)
    warn_of_frequency(f)
    warn_outside(LAW, "wind speed", u, 0.0, 20.0, "m/s")
    return u, f, angle
