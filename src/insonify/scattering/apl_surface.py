"""Scattering by the sea surface: the APL-UW model of 1994.

Specular facets dominate near the vertical, ripples at intermediate and bubbles at low grazing angles; bubbles also
attenuate the other two. The report gives backscatter; the law here extends each of its terms to any pair of directions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from insonify.scattering.bubbles import Bubbles
from insonify.scattering.facet_geometry import SHALLOWEST, half_direction_change, illumination
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.surface_facets import SurfaceFacets, apl_slope_variance
from insonify.units import level_db
from insonify.validity import require_grazing_angle, require_number, require_numbers

LOWEST = math.radians(0.5)
"""Grazing angle below which the report extrapolates linearly in decibels [rad]."""
STEEPEST_RIPPLES = math.radians(85.0)
"""Grazing angle above which the report has no scattering by ripples [rad]."""


def apl_surface_strength_db(wind_speed: ArrayLike, frequency: ArrayLike, grazing: ArrayLike) -> Floats:
    """Backscattering strength of the sea surface [dB].

    Args:
        wind_speed: Wind 10 m above the sea [m/s], any shape.
        frequency: Frequency [Hz], broadcast.
        grazing: Grazing angle, 0 to pi/2 [rad], broadcast.

    Returns:
        Backscattering strength, 10 log10 of the cross section per unit area [dB], broadcast shape.

    Source: APL-UW TR 9407 (1994), section II, eqs. 1-16, read in secondary sources; where those
    differ the version that is continuous at 1 m/s is used. The report's own accuracy is 4 to 5 dB.
    Valid: 10 to 100 kHz, wind to about 20 m/s.

    Example:
        >>> apl_surface_strength_db(wind_speed=[3.0, 10.0], frequency=30e3, grazing=np.radians(20)).round().tolist()
        [-48.0, -23.0]
    """
    columns = np.broadcast_arrays(
        require_numbers("wind_speed", wind_speed, "m/s", 0.0, allow_nan=False, example="7"),
        require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True, allow_nan=False, example="100e3"),
        require_grazing_angle("grazing", grazing, gaps=False),
    )
    winds, frequencies, angles = (c.ravel() for c in columns)
    strength = np.empty(angles.shape)
    for wind, tone in {(float(w), float(f)) for w, f in zip(winds, frequencies, strict=True)}:
        same = (winds == wind) & (frequencies == tone)
        strength[same] = AplSurface(wind, tone).strength_db(angles[same])
    return strength.reshape(columns[0].shape)


@dataclass(frozen=True, slots=True)
class AplSurface:
    """Sea surface of a wind speed at one frequency: facets, ripples and bubbles.

    In backscatter above 0.5 degrees it is the report's strength to rounding.
    In other directions each term follows its mechanism: facets need their slope, ripples scatter by
    first-order perturbation of a spectrum K^-4, and each leg through the bubbles has half of their loss in decibels.

    Source: APL-UW TR 9407 (1994), section II, eqs. 1-16; the bistatic form is derived here.
    Valid: 10 to 100 kHz, wind to about 20 m/s; forward, near the specular direction, facets alone. The report fitted
    its terms to backscatter one by one: at 10 kHz from 10 m/s on, at steep angles, the albedo is up to 1.07.
    There is no cap, which would change the printed strength.

    Example:
        >>> sea = AplSurface(wind_speed=10.0, frequency=30e3)
        >>> sea.strength_db(np.radians([10, 30, 80])).round().tolist()
        [-28.0, -21.0, -1.0]
    """

    wind_speed: float
    """Wind 10 m above the sea [m/s]."""
    frequency: float
    """Frequency [Hz]."""
    bubbles: Bubbles = field(init=False, repr=False, compare=False)
    """Layer of bubbles under the surface."""

    def __post_init__(self) -> None:
        """Check wind and frequency, and warn about them once."""
        wind = require_number("AplSurface.wind_speed", self.wind_speed, "m/s", 0.0, example="7")
        tone = require_number("AplSurface.frequency", self.frequency, "Hz", 0.0, exclude_low=True, example="100e3")
        for name, value in (("wind_speed", wind), ("frequency", tone), ("bubbles", Bubbles(wind, tone))):
            object.__setattr__(self, name, value)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the mean surface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the surface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        bubbles, slopes = self.bubbles, apl_slope_variance(self.wind_speed)
        facets = SurfaceFacets.isotropic(slopes).cross_section(grazing_in, grazing_out, azimuth)
        in_plane, normal = half_direction_change(grazing_in, grazing_out, azimuth)
        # Grazing angle at which the same facet is seen along its normal: in backscatter, the report's own angle.
        equivalent = np.arctan2(normal, in_plane)
        weight = _facet_weight(equivalent, slopes)
        rough = weight * facets + (1 - weight) * self._ripples(grazing_in, grazing_out, in_plane, equivalent)
        transmission = bubbles.transmission(grazing_in) * bubbles.transmission(grazing_out)
        return np.asarray(rough * transmission + bubbles.cross_section(grazing_in, grazing_out, azimuth))

    def strength_db(self, grazing: ArrayLike) -> Floats:
        """Backscattering strength [dB] at grazing angles 0 to pi/2 [rad], any shape."""
        angle = require_grazing_angle("grazing", grazing)
        low, high = (self._backscatter_db(np.asarray(a)) for a in (LOWEST, 2 * LOWEST))
        line = low + (high - low) * (angle / LOWEST - 1)
        return np.asarray(np.where(angle < LOWEST, line, self._backscatter_db(np.maximum(angle, LOWEST))))

    def _backscatter_db(self, grazing: Floats) -> Floats:
        return level_db(self.cross_section(grazing, grazing, np.full_like(grazing, math.pi)))

    def _ripples(self, grazing_in: Floats, grazing_out: Floats, in_plane: Floats, equivalent: Floats) -> Floats:
        """Cross section of ripples as long as about the acoustic wavelength, by first-order perturbation [1]."""
        sines = np.sin(grazing_in) * np.sin(grazing_out) / np.maximum(in_plane, SHALLOWEST) ** 2
        valid = (equivalent <= STEEPEST_RIPPLES) * illumination(grazing_in, grazing_out)
        return np.asarray(valid * 1.3e-5 * self.wind_speed**2 * np.where(valid > 0, sines, 0.0) ** 2)


def _facet_weight(equivalent: Floats, slopes: float) -> Floats:
    """Weight of facets against ripples [1], 1 near the vertical; equivalent: as above [rad], slopes: variance [1]."""
    x = 1.5 * math.log(10) * slopes
    for _ in range(30):  # the square of the slope at which the glint is 15 dB below its peak; contracts by 2 slopes
        x = slopes * (1.5 * math.log(10) + 2 * math.log1p(x))
    transition = 90.0 - math.degrees(math.atan(math.sqrt(x)))
    return np.asarray(1 / (1 + np.exp(np.clip(0.524 * (transition - np.degrees(equivalent)), -700, 700))))
