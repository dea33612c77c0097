"""The sea surface in any direction: facets seen through bubbles, and the bubbles' own echo."""

from dataclasses import dataclass

import numpy as np

from insonify.scattering.bubbles import Bubbles
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.surface_facets import SurfaceFacets, apl_slope_variance
from insonify.validity import require_number


@dataclass(frozen=True, slots=True)
class SurfaceScattering:
    """Tilted mirrors of known slopes behind a veil of bubbles.

    For slopes of one's own, from a wave spectrum or from the sun's glitter. The ripples that
    rule at 20 to 60 degrees in light wind are left out; `AplSurface` has them.

    Source: the sum of `SurfaceFacets` and `Bubbles`, the facets dimmed by half of
    `bubble_loss_db` on each way.
    """

    facets: SurfaceFacets
    """The slopes."""
    bubbles: Bubbles
    """The veil, which knows the wind and the frequency."""

    @classmethod
    def at_wind(cls, wind_speed: float, frequency: float) -> "SurfaceScattering":
        """The sea that a wind [m/s, at 10 m] raises, for sound of a frequency [Hz]."""
        wind_speed = require_number("wind_speed", wind_speed, "m/s", 0.0, example="7")
        return cls(SurfaceFacets.isotropic(apl_slope_variance(wind_speed)), Bubbles(wind_speed, frequency))

    def cross_section(
        self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats, heading: Floats | float = 0.0
    ) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Of the sound that arrives, from the mean surface [rad], any shape.
            grazing_out: Of the sound that leaves, likewise [rad], broadcast.
            azimuth: Between the two: 0 forward, pi back [rad], broadcast.
            heading: Of the arriving sound, from the wind's [rad], broadcast, see `SurfaceFacets`.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction is behind the surface.
        """
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        mirrors = self.facets.cross_section(grazing_in, grazing_out, azimuth, heading)
        veil = self.bubbles.transmission(grazing_in) * self.bubbles.transmission(grazing_out)
        return np.asarray(mirrors * veil + self.bubbles.cross_section(grazing_in, grazing_out, azimuth))
