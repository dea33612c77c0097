"""Jackson's seabed: scattering by the rough surface plus scattering by the sediment volume.

The default law of a seabed. Grain size alone can drive it; the surface dominates in sand, the volume in mud.
"""

from dataclasses import KW_ONLY, dataclass

import numpy as np

from insonify.model import Hertz, MetresPerSecond
from insonify.scattering.albedo import symmetric_cap
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.roughness import check_sediment_law, warn_of_steep_slopes
from insonify.scattering.sediment_volume import UncappedSedimentVolume, VolumeSpectrum, check_sediment_volume
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import UncappedSmallSlope


@dataclass(frozen=True, slots=True)
class Jackson:
    """Scattering by a sediment: small-slope surface plus volume.

    Example:
        >>> seabed = Jackson(Sediment.named("medium sand"), frequency=100e3)
        >>> grazing = np.radians([10, 30, 60])
        >>> (10 * np.log10(seabed.cross_section(grazing, grazing, np.pi))).round().tolist()
        [-33.0, -22.0, -19.0]
    """

    sediment: Sediment
    """Sediment below the water."""
    frequency: Hertz
    """Frequency [Hz]."""
    _: KW_ONLY
    sound_speed: MetresPerSecond = 1500.0
    """Sound speed in the water [m/s]."""
    volume_spectrum: VolumeSpectrum = "power-law"
    """Spectrum of the inhomogeneities in the sediment, as in SedimentVolume."""

    def __post_init__(self) -> None:
        """Refuse invalid values; warn outside the measured band and of steep slopes."""
        warn_of_steep_slopes(self.sediment, check_sediment_law(self))
        check_sediment_volume("Jackson", self.sediment, self.volume_spectrum)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the interface. Where the albedo
            of both parts together would exceed 1, they are reduced by the symmetric cap.

        Source: the structure of Jackson (1993), APL-UW TR 9305 and Williams & Jackson (1998), J. Acoust. Soc. Am.
        103, 169, with the surface as in SmallSlope and the volume as in SedimentVolume.
        Valid: as its two parts; the relief was measured for 10 to 100 kHz.
        """
        uncapped = UncappedJackson(self.sediment, self.frequency, self.sound_speed, self.volume_spectrum)
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        cap = symmetric_cap(uncapped, np.sin(grazing_in), np.sin(grazing_out))
        return np.asarray(cap * uncapped.cross_section(grazing_in, grazing_out, azimuth))


@dataclass(frozen=True, slots=True)
class UncappedJackson:
    """Sum of surface and volume scattering without the cap."""

    sediment: Sediment
    """Sediment below the water."""
    frequency: float
    """Frequency [Hz]."""
    sound_speed: float
    """Sound speed in the water [m/s]."""
    volume_spectrum: VolumeSpectrum
    """Spectrum of the inhomogeneities in the sediment."""

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section [1] of angles [rad], as :meth:`Jackson.cross_section`."""
        surface = UncappedSmallSlope(self.sediment, self.frequency, self.sound_speed)
        volume = UncappedSedimentVolume(self.sediment, self.frequency, self.sound_speed, self.volume_spectrum)
        return surface.cross_section(grazing_in, grazing_out, azimuth) + volume.cross_section(
            grazing_in, grazing_out, azimuth
        )
