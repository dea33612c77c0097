"""Bistatic scattering by the sea surface: facets attenuated by bubbles, and the bubbles themselves."""

from dataclasses import dataclass

import numpy as np

from insonify.scattering.bubbles import Bubbles
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.surface_facets import SurfaceFacets, apl_slope_variance
from insonify.validity import require_number


@dataclass(frozen=True, slots=True)
class SurfaceScattering:
    """Specular facets of given slopes above a layer of bubbles.

    For slopes from a wave spectrum or from measured sun glitter. Scattering by ripples, which
    dominates at 20 to 60 degrees in light wind, is left out; `AplSurface` includes it.

    Source: the sum of `SurfaceFacets` and `Bubbles`, the facets attenuated by half of `bubble_loss_db` on each leg.

    Example:
        >>> sea = SurfaceScattering.at_wind(10.0, frequency=30e3)
        >>> grazing = np.radians([90, 10])
        >>> (10 * np.log10(sea.cross_section(grazing, grazing, np.pi))).round().tolist()
        [4.0, -28.0]
    """

    facets: SurfaceFacets
    """Facets with the variance of their slopes."""
    bubbles: Bubbles
    """Layer of bubbles at a wind speed and a frequency."""

    @classmethod
    def at_wind(cls, wind_speed: float, frequency: float) -> "SurfaceScattering":
        """Sea surface of a wind speed [m/s, at 10 m] at a frequency [Hz]."""
        wind_speed = require_number("wind_speed", wind_speed, "m/s", 0.0, example="7")
        return cls(SurfaceFacets.isotropic(apl_slope_variance(wind_speed)), Bubbles(wind_speed, frequency))

    def cross_section(
        self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats, heading: Floats | float = 0.0
    ) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the mean surface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.
            heading: Direction of the incident sound relative to the wind [rad], broadcast, see `SurfaceFacets`.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the surface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        facets = self.facets.cross_section(grazing_in, grazing_out, azimuth, heading)
        transmission = self.bubbles.transmission(grazing_in) * self.bubbles.transmission(grazing_out)
        return np.asarray(facets * transmission + self.bubbles.cross_section(grazing_in, grazing_out, azimuth))
