"""Scattering by specular facets of the sea surface.

At high frequency the surface reflects as small tilted facets near the specular direction, which includes
backscatter near the vertical. The cross section of a pair of directions is proportional to the probability density
of the slope that reflects one into the other.
"""

import math
from dataclasses import dataclass

import numpy as np

from insonify.scattering.facet_geometry import SHALLOWEST, half_direction_change, illumination
from insonify.scattering.law import Floats, checked_angles
from insonify.validity import require_number, require_numbers


def apl_slope_variance(wind_speed: float) -> float:
    """Effective variance of the sea's slope for sound of 10 to 100 kHz, both directions together [1].

    Args:
        wind_speed: Wind 10 m above the sea [m/s].

    Source: APL-UW TR 9407 (1994), section II, 0.0046 ln(2.1 U^2); 0.0034 below 1 m/s, where the
    two agree. One public version prints 0.034, which would not be continuous.
    """
    return 4.6e-3 * math.log(2.1 * wind_speed**2) if wind_speed >= 1 else 0.0034


def facet_shadowing_excess(grazing: Floats, slope_variance: Floats | float) -> Floats:
    """Smith's shadowing function Lambda: energy on all facets facing the sound, unshadowed, over the incident, minus 1.

    Args:
        grazing: Grazing angle, above 0 to pi/2 [rad], any shape.
        slope_variance: Variance of the slope along the sound's bearing [1], broadcast.

    Returns:
        Lambda [1], broadcast shape; the illuminated fraction of the facing facets is 1 / (1 + Lambda).

    Source: Smith (1967), IEEE Trans. Antennas Propag. 15, 668 (not verified; derived here from conservation of
    energy: the illuminated facets receive the incident energy). Valid: Gaussian slopes; the fraction in
    shadow is assumed independent of the slope of a facet.
    """
    from scipy.special import erfcx

    # Not the tangent, whose sign rounding at the vertical may change.
    steepness = np.maximum(np.sin(grazing), SHALLOWEST) / np.maximum(np.abs(np.cos(grazing)), SHALLOWEST)
    # The function vanishes beyond 25.
    v = np.minimum(steepness / np.sqrt(2 * np.asarray(slope_variance, dtype=float)), 25.0)
    return np.asarray(0.5 * np.exp(-(v**2)) * (1 / (v * math.sqrt(math.pi)) - erfcx(v)))


@dataclass(frozen=True, slots=True)
class SurfaceFacets:
    """Perfectly reflecting sea surface of Gaussian slopes, in the limit of high frequency.

    Facets in shadow in either direction are left out. All energy is scattered at grazing angles above a few times
    the rms slope, and less below: there some sound is reflected twice by the surface, and the second
    reflection is left out.

    Source: Kirchhoff's approximation at high frequency, sigma = (Delta / Delta_z)^4 p(slope) / 4,
    as used by Dahl (1999), J. Acoust. Soc. Am. 105, 2155 (derived independently; form of the
    paper not checked), times the smaller of both directions' illuminated fractions by Smith's `facet_shadowing_excess`:
    symmetric, exact in backscatter, and with an albedo of at most 1 at any angle. In backscatter above twice the rms
    slope it is the facet term of APL-UW TR 9407 (1994).
    Valid: 2 k times rms height times sin(grazing) well above 1, slopes below about 0.3.

    Example:
        >>> sea = SurfaceFacets.isotropic(mean_square_slope=0.04)
        >>> grazing = np.radians([90, 75, 60])
        >>> (10 * np.log10(sea.cross_section(grazing, grazing, np.pi))).round().tolist()
        [3.0, -4.0, -31.0]
    """

    along: float
    """Variance of slope in the wind's direction [1]."""
    across: float
    """Variance of slope across the wind [1]; equal to `along` for an isotropic sea."""

    def __post_init__(self) -> None:
        """Refuse variances that are not above 0."""
        for name in ("along", "across"):
            value = require_number(
                f"SurfaceFacets.{name}", getattr(self, name), "", 0.0, exclude_low=True, example="0.02"
            )
            object.__setattr__(self, name, value)

    @classmethod
    def isotropic(cls, mean_square_slope: float) -> "SurfaceFacets":
        """Isotropic sea surface of a given variance of slope, both directions together [1]."""
        slopes = require_number("mean_square_slope", mean_square_slope, "", 0.0, exclude_low=True, example="0.02")
        return cls(slopes / 2, slopes / 2)

    def cross_section(
        self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats, heading: Floats | float = 0.0
    ) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the mean surface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.
            heading: Direction of travel of the incident sound relative to the wind, positive in the
                sense of the azimuth [rad], broadcast; it matters only where the two variances differ.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the surface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        heading = require_numbers("heading", heading, "rad")
        in_plane, normal = half_direction_change(grazing_in, grazing_out, azimuth)
        # Where both directions graze, no slope fits: the floor keeps the ratio finite, `illumination` makes it 0.
        tilt = in_plane / np.maximum(normal, SHALLOWEST)
        bearing = self._bearing(grazing_in, grazing_out, azimuth) + np.asarray(heading)
        exponent = tilt**2 * (np.cos(bearing) ** 2 / self.along + np.sin(bearing) ** 2 / self.across) / 2
        density = np.exp(-np.minimum(exponent, 700.0)) / (2 * math.pi * math.sqrt(self.along * self.across))
        excess = np.maximum(
            self._excess(grazing_in, np.asarray(heading)), self._excess(grazing_out, np.asarray(heading) + azimuth)
        )
        return np.asarray((1 + tilt**2) ** 2 / 4 * density * illumination(grazing_in, grazing_out) / (1 + excess))

    def _excess(self, grazing: Floats, bearing: Floats) -> Floats:
        """Smith's Lambda in a direction of travel, its bearing relative to the wind [1]."""
        variance = self.along * np.cos(bearing) ** 2 + self.across * np.sin(bearing) ** 2
        return facet_shadowing_excess(grazing, variance)

    @staticmethod
    def _bearing(grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bearing of the change of direction in the plane, relative to the incident sound [rad]."""
        forward = np.cos(grazing_out) * np.cos(azimuth) - np.cos(grazing_in)
        return np.asarray(np.arctan2(np.cos(grazing_out) * np.sin(azimuth), forward))
