"""The sea as a mirror broken into facets: sound goes where a slope can send it.

At high frequency the surface near the mirror direction, and seen from below near the
vertical, is a crowd of small tilted mirrors. What is scattered from one direction into
another is the share of the surface that has the one slope this takes.
"""

import math
from dataclasses import dataclass

import numpy as np

from insonify.scattering.facet_geometry import SHALLOWEST, half_direction_change, illumination
from insonify.scattering.law import Floats, checked_angles
from insonify.validity import require_number, require_numbers, warn_outside


def cox_munk_slopes(wind_speed: float, *, slick: bool = False) -> tuple[float, float]:
    """Variance of the sea's slope along the wind and across it, as the sun's glitter shows it.

    Args:
        wind_speed: Wind 12.5 m above the sea [m/s].
        slick: Whether a film of oil has smoothed the short waves.

    Returns:
        Variance of slope upwind and crosswind [1].

    Source: Cox & Munk (1954), J. Opt. Soc. Am. 44, 838; coefficients from secondary sources.
    With a slick the paper's total, 0.008 + 0.00156 U, is shared equally here.
    Valid: 1 to 14 m/s. Light sees every ripple: sound below a few hundred kHz sees less slope.
    """
    wind_speed = require_number("wind_speed", wind_speed, "m/s", 0.0, example="7")
    warn_outside("Cox & Munk (1954) slopes", "wind speed", wind_speed, 1.0, 14.0, "m/s")
    if slick:
        half = (0.008 + 1.56e-3 * wind_speed) / 2
        return half, half
    return 3.16e-3 * wind_speed, 0.003 + 1.92e-3 * wind_speed


def apl_slope_variance(wind_speed: float) -> float:
    """Variance of the sea's slope, both directions together, that sound of 10 to 100 kHz sees [1].

    Args:
        wind_speed: Wind 10 m above the sea [m/s].

    Source: APL-UW TR 9407 (1994), section II, 0.0046 ln(2.1 U^2); 0.0034 below 1 m/s, where the
    two meet. One public version prints 0.034, which would not.
    """
    return 4.6e-3 * math.log(2.1 * wind_speed**2) if wind_speed >= 1 else 0.0034


def facet_shadowing_excess(grazing: Floats, slope_variance: Floats | float) -> Floats:
    """By how much the facets that face the sound would catch more than arrives, were none in shadow.

    Args:
        grazing: Grazing angle, above 0 to pi/2 [rad], any shape.
        slope_variance: Of the slope along the sound's bearing [1], broadcast.

    Returns:
        Smith's Lambda [1], broadcast shape; the share of that catch which is not in shadow is 1 / (1 + Lambda).

    Source: Smith (1967), IEEE Trans. Antennas Propag. 15, 668 (paper not at hand; derived here from the balance of
    energy: what is lit must catch what arrives). Valid: Gaussian slopes. That the steepest
    facets are in shadow as often as the flat ones is an approximation.
    """
    from scipy.special import erfcx

    # Not the tangent, which rounding at the vertical may turn over.
    steepness = np.maximum(np.sin(grazing), SHALLOWEST) / np.maximum(np.abs(np.cos(grazing)), SHALLOWEST)
    v = np.minimum(steepness / np.sqrt(2 * np.asarray(slope_variance, dtype=float)), 25.0)  # nothing is left beyond
    return np.asarray(0.5 * np.exp(-(v**2)) * (1 / (v * math.sqrt(math.pi)) - erfcx(v)))


@dataclass(frozen=True, slots=True)
class SurfaceFacets:
    """A perfectly reflecting sea of Gaussian slopes, in the limit of high frequency.

    Facets in shadow from either side are left out. So it sends out all it receives while the surface is seen from
    above a few times its rms slope, and less below that: there some sound meets the surface twice, and the second
    bounce is not followed.

    Source: Kirchhoff's approximation at high frequency, sigma = (Delta / Delta_z)^4 p(slope) / 4,
    as used by Dahl (1999), J. Acoust. Soc. Am. 105, 2155 (derived independently; form of the
    paper not checked), times the smaller of both directions' shares in Smith's `facet_shadowing_excess`: symmetric, exact
    straight back, and no more energy leaves than arrives at any angle. In backscatter above twice the rms slope it
    is the facet term of APL-UW TR 9407 (1994).
    Valid: 2 k times rms height times sin(grazing) well above 1, slopes below about 0.3.
    """

    along: float
    """Variance of slope in the wind's direction [1]."""
    across: float
    """Variance of slope across the wind [1]; the same as `along` for a sea without direction."""

    def __post_init__(self) -> None:
        """Refuse slopes that are none."""
        for name in ("along", "across"):
            value = require_number(
                f"SurfaceFacets.{name}", getattr(self, name), "", 0.0, exclude_low=True, example="0.02"
            )
            object.__setattr__(self, name, value)

    @classmethod
    def isotropic(cls, mean_square_slope: float) -> "SurfaceFacets":
        """A sea without direction, from the variance of its slope in both directions together [1]."""
        slopes = require_number("mean_square_slope", mean_square_slope, "", 0.0, exclude_low=True, example="0.02")
        return cls(slopes / 2, slopes / 2)

    def cross_section(
        self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats, heading: Floats | float = 0.0
    ) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Of the sound that arrives, from the mean surface [rad], any shape.
            grazing_out: Of the sound that leaves, likewise [rad], broadcast.
            azimuth: Between the two: 0 forward, pi back [rad], broadcast.
            heading: Direction in which the arriving sound travels, from that of the wind, on
                the side on which azimuth counts [rad], broadcast; matters only where the two
                variances differ.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction is behind the surface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        heading = require_numbers("heading", heading, "rad")
        across, along = half_direction_change(grazing_in, grazing_out, azimuth)
        # Grazing both ways no slope would do; the floor keeps the ratio finite there, and `illumination` makes it 0.
        tilt = across / np.maximum(along, SHALLOWEST)
        bearing = self._bearing(grazing_in, grazing_out, azimuth) + np.asarray(heading)
        exponent = tilt**2 * (np.cos(bearing) ** 2 / self.along + np.sin(bearing) ** 2 / self.across) / 2
        density = np.exp(-np.minimum(exponent, 700.0)) / (2 * math.pi * math.sqrt(self.along * self.across))
        shadowed = np.maximum(
            self._excess(grazing_in, np.asarray(heading)), self._excess(grazing_out, np.asarray(heading) + azimuth)
        )
        return np.asarray((1 + tilt**2) ** 2 / 4 * density * illumination(grazing_in, grazing_out) / (1 + shadowed))

    def _excess(self, grazing: Floats, bearing: Floats) -> Floats:
        """Smith's Lambda in a direction of travel, its bearing counted from the wind's [1]."""
        variance = self.along * np.cos(bearing) ** 2 + self.across * np.sin(bearing) ** 2
        return facet_shadowing_excess(grazing, variance)

    @staticmethod
    def _bearing(grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Direction of the change of direction in the plane, from the arriving sound's [rad]."""
        forward = np.cos(grazing_out) * np.cos(azimuth) - np.cos(grazing_in)
        return np.asarray(np.arctan2(np.cos(grazing_out) * np.sin(azimuth), forward))
