"""The small-slope approximation: one formula from the specular direction to the lowest grazing angle.

It tends to Kirchhoff's approximation where the relief is high against the wavelength and to perturbation
theory where it is low, without a choice between the two.
"""

from dataclasses import KW_ONLY, dataclass

import numpy as np

from insonify.model import Hertz, MetresPerSecond
from insonify.scattering.albedo import symmetric_cap
from insonify.scattering.kirchhoff import kirchhoff_integral_of_pair
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.perturbation import grating_strength
from insonify.scattering.roughness import check_sediment_law, warn_of_steep_slopes
from insonify.scattering.scattering_geometry import scattering_geometry
from insonify.scattering.sediments import Sediment


@dataclass(frozen=True, slots=True)
class SmallSlope:
    """Scattering by a sediment's rough surface, first order in its slopes.

    Example:
        >>> surface = SmallSlope(Sediment.named("medium sand"), frequency=100e3)
        >>> grazing = np.radians([10, 30, 60])
        >>> (10 * np.log10(surface.cross_section(grazing, grazing, np.pi))).round().tolist()
        [-34.0, -22.0, -20.0]
    """

    sediment: Sediment
    """Sediment below the water."""
    frequency: Hertz
    """Frequency [Hz]."""
    _: KW_ONLY
    sound_speed: MetresPerSecond = 1500.0
    """Sound speed in the water [m/s]."""

    def __post_init__(self) -> None:
        """Refuse invalid values; warn outside the measured band and of steep slopes."""
        warn_of_steep_slopes(self.sediment, check_sediment_law(self))

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the interface. Where the relief
            is so rough that the albedo would exceed 1, it is reduced by the symmetric cap.

        Source: Gragg, Wurmser & Gauss (2001), J. Acoust. Soc. Am. 110, 2878, for a fluid sediment with a power-law
        relief, in the notation of Jackson & Richardson (2007), High-Frequency Seafloor Acoustics.
        Valid: small slopes, no shadows (above about 5 degrees); relief of 10 to 100 kHz. Rough rock, and rock and
        gravel above 100 kHz, are too steep for it: the strength is too low above 20 degrees, by 10 dB and more
        for rough rock. This is warned about; apl_bottom_strength_db is more accurate for them in backscatter.
        """
        uncapped = UncappedSmallSlope(self.sediment, self.frequency, self.sound_speed)
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        cap = symmetric_cap(uncapped, np.sin(grazing_in), np.sin(grazing_out))
        return np.asarray(cap * uncapped.cross_section(grazing_in, grazing_out, azimuth))


@dataclass(frozen=True, slots=True)
class UncappedSmallSlope:
    """Small-slope formula without the cap."""

    sediment: Sediment
    """Sediment below the water."""
    frequency: float
    """Frequency [Hz]."""
    sound_speed: float
    """Sound speed in the water [m/s]."""

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section [1] of angles [rad], as :meth:`SmallSlope.cross_section`."""
        d = scattering_geometry(grazing_in, grazing_out, azimuth)
        k = 2 * np.pi * self.frequency / self.sound_speed
        integral = kirchhoff_integral_of_pair(self.sediment, k, d)
        shape = integral / (32 * np.pi * d.transverse2 * d.vertical**2)
        return d.where_illuminated(grating_strength(self.sediment, d) * shape)
