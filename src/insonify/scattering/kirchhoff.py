"""Kirchhoff's approximation: a rough seabed as specular facets.

It holds near the specular direction, where the echo comes from facets whose tilt reflects one direction into the
other. Far from the specular direction there are no such facets, and the prediction is far too high or too low.
"""

from dataclasses import KW_ONLY, dataclass

import numpy as np

from insonify.model import Hertz, MetresPerSecond
from insonify.scattering.law import Floats
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.roughness import check_sediment_law, hurst_exponent, kirchhoff_integral, structure_constant
from insonify.scattering.scattering_geometry import ScatteringGeometry, scattering_geometry
from insonify.scattering.sediments import Sediment


@dataclass(frozen=True, slots=True)
class Kirchhoff:
    """Scattering by randomly tilted facets, each with the sediment's reflection coefficient at its own angle.

    The integral over the relief is exact (within the approximation of high frequencies). Energy is not conserved:
    at low grazing angles the albedo may exceed 1 (1.45 at 5 degrees, medium sand, 100 kHz), because
    shadowing and multiple reflection are left out. No cap is applied; use SmallSlope or Jackson where that matters.

    Example:
        >>> seabed = Kirchhoff(Sediment.named("medium sand"), frequency=30e3)
        >>> f"{10 * np.log10(seabed.cross_section(np.pi / 2, np.pi / 2, np.pi)):.0f} dB"
        '-3 dB'
    """

    sediment: Sediment
    """Sediment below the water."""
    frequency: Hertz
    """Frequency [Hz]."""
    _: KW_ONLY
    sound_speed: MetresPerSecond = 1500.0
    """Sound speed in the water [m/s]."""

    def __post_init__(self) -> None:
        """Refuse invalid values; warn outside the band in which relief was measured."""
        check_sediment_law(self)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the interface.

        Source: Jackson, Winebrenner & Ishimaru (1986), J. Acoust. Soc. Am. 79, 1410, bistatic as in Jackson (1993),
        APL-UW TR 9305 and Williams & Jackson (1998), J. Acoust. Soc. Am. 103, 169 (equations from a public
        implementation). Valid: within some 30 degrees of the specular direction; relief of 10 to 100 kHz.
        """
        d = scattering_geometry(grazing_in, grazing_out, azimuth)
        reflection2 = np.abs(reflection_coefficient(self.sediment, np.arcsin(d.facet_grazing_sine))) ** 2
        steepness = d.facet_grazing_sine**4 / (d.vertical**2 * d.transverse2)
        wavenumber = 2 * np.pi * self.frequency / self.sound_speed
        return d.where_illuminated(
            reflection2 / (8 * np.pi) * steepness * kirchhoff_integral_of_pair(self.sediment, wavenumber, d)
        )


def kirchhoff_integral_of_pair(sediment: Sediment, wavenumber: float, d: ScatteringGeometry) -> Floats:
    """Kirchhoff integral I(q) of a pair of directions over a sediment's relief [1].

    Args:
        sediment: Sediment below the water.
        wavenumber: Acoustic wavenumber in the water [rad/m].
        d: Geometry of the pair of directions.

    Source: as :meth:`Kirchhoff.cross_section`; q = C^2 (2 k vertical)^2 (2 k transverse)^(-2 alpha) / 2, C^2 the
    structure constant, vertical and transverse half the change of direction.
    """
    alpha = hurst_exponent(sediment)
    four_k2 = (2 * wavenumber) ** 2
    q = 0.5 * structure_constant(sediment) * four_k2 ** (1 - alpha) * d.vertical**2 * d.transverse2**-alpha
    return kirchhoff_integral(alpha)(q)
