"""Volume scattering in the sediment: grains, shells and layers below the seabed.

In mud, where the surface is smooth and transmission is high, this is nearly all of the echo.
"""

import math
from dataclasses import KW_ONLY, dataclass
from typing import Literal, get_args

import numpy as np

from insonify.model import Hertz, MetresPerSecond
from insonify.scattering.albedo import symmetric_cap
from insonify.scattering.law import Floats, checked_angles
from insonify.scattering.perturbation import transmission
from insonify.scattering.reflection import vertical_wavenumber
from insonify.scattering.roughness import check_sediment_law
from insonify.scattering.scattering_geometry import scattering_geometry
from insonify.scattering.sediments import Sediment

VolumeSpectrum = Literal["power-law", "isotropic"]
OUTER_WAVENUMBER = 1e-3
"""Outer scale of the power-law spectrum: its wavenumber over that of sound in the water [1]."""
STRONGEST = 0.1
"""Upper limit of the cross section of the power law [1]: towards the specular direction, below the critical
angle, single scattering would not conserve energy."""


@dataclass(frozen=True, slots=True)
class SedimentVolume:
    """Scattering by the volume of a sediment, with refraction and loss on both legs.

    Example:
        >>> mud = SedimentVolume(Sediment.named("silty clay"), frequency=100e3)
        >>> grazing = np.radians(30)
        >>> f"{10 * np.log10(mud.cross_section(grazing, grazing, np.pi)):.0f} dB"
        '-30 dB'
    """

    sediment: Sediment
    """Sediment below the water."""
    frequency: Hertz
    """Frequency [Hz]."""
    _: KW_ONLY
    sound_speed: MetresPerSecond = 1500.0
    """Sound speed in the water [m/s]."""
    volume_spectrum: VolumeSpectrum = "power-law"
    """Spectrum of the inhomogeneities: density that fluctuates with a power law of exponent 3 (Jackson), or a cross
    section per unit volume that is the same in all directions (TR 9407). Above the critical angle both have the same
    backscatter; below it the isotropic one is up to 2 dB higher in medium sand."""

    def __post_init__(self) -> None:
        """Refuse invalid values and a lossless sediment; warn outside the measured band."""
        check_sediment_law(self)
        check_sediment_volume("SedimentVolume", self.sediment, self.volume_spectrum)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the interface. Where a volume
            parameter is so large that the albedo would exceed 1, it is reduced by the symmetric cap.

        Source: single scattering below a flat fluid boundary, Jackson (1993), APL-UW TR 9305; Williams & Jackson
        (1998), J. Acoust. Soc. Am. 103, 169; the power law's outer scale and its limit of 0.1 as in Jackson (2000),
        APL-UW TM 2-00 (equations from a public implementation). The isotropic form is in backscatter the volume term
        of APL-UW TR 9407 (1994), eqs. 65-66.
        Valid: 10 to 100 kHz; the volume parameter varies by a factor of 10 in either direction.
        """
        uncapped = UncappedSedimentVolume(self.sediment, self.frequency, self.sound_speed, self.volume_spectrum)
        grazing_in, grazing_out, azimuth = checked_angles(grazing_in, grazing_out, azimuth)
        cap = symmetric_cap(uncapped, np.sin(grazing_in), np.sin(grazing_out))
        return np.asarray(cap * uncapped.cross_section(grazing_in, grazing_out, azimuth))


@dataclass(frozen=True, slots=True)
class UncappedSedimentVolume:
    """Volume scattering without the cap."""

    sediment: Sediment
    """Sediment below the water."""
    frequency: float
    """Frequency [Hz]."""
    sound_speed: float
    """Sound speed in the water [m/s]."""
    volume_spectrum: VolumeSpectrum
    """Spectrum of the inhomogeneities in the sediment."""

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section [1] of angles [rad], as :meth:`SedimentVolume.cross_section`."""
        d = scattering_geometry(grazing_in, grazing_out, azimuth)
        if self.sediment.volume_parameter == 0:
            return np.zeros(d.is_illuminated.shape)
        p_in, p_out = (vertical_wavenumber(self.sediment, sine) for sine in (d.sine_in, d.sine_out))
        rho, decay = self.sediment.density_ratio, (p_in + p_out).imag  # decay rate of pressure over k, both legs
        isotropic = 8 * rho**2 * transmission(self.sediment, d) * isotropic_strength(self.sediment) / decay
        if self.volume_spectrum == "isotropic":
            return d.where_illuminated(isotropic)
        kappa = (1 + 1j * self.sediment.loss) / self.sediment.speed_ratio
        contrast = np.abs(kappa**2 - d.in_plane_product + p_in * p_out) ** 2  # of density, at constant sound speed
        change2 = 4 * d.transverse2 + (p_in + p_out).real ** 2 + OUTER_WAVENUMBER**2
        # Scaled so that both spectra agree in backscatter above the critical angle, where the change is 2 |kappa|.
        power_law = isotropic * 2 * self.sediment.speed_ratio * contrast / change2**1.5
        return d.where_illuminated(power_law / (1 + power_law / STRONGEST))


def check_sediment_volume(law: str, sediment: Sediment, volume_spectrum: str) -> None:
    """Refuse an unknown spectrum of inhomogeneities, and a scattering sediment without loss.

    Args:
        law: Name of the law, for the error message.
        sediment: Sediment below the water.
        volume_spectrum: Spectrum of the inhomogeneities in the sediment.
    """
    if volume_spectrum not in get_args(VolumeSpectrum):
        raise ValueError(f"{law}.volume_spectrum is {volume_spectrum!r}; give 'power-law' or 'isotropic'")
    if sediment.loss == 0 and sediment.volume_parameter > 0:
        raise ValueError(
            f"{law}.sediment has loss 0; sound would return from any depth. Give a loss above 0, such as 0.01"
        )


def isotropic_strength(sediment: Sediment) -> float:
    """Volume scattering cross section per unit volume and solid angle [1/m] over the wavenumber in the water [rad/m].

    Returns:
        Volume parameter sigma_2 [1/dB] times the sediment's attenuation [dB/m] over the wavenumber [1].

    Source: APL-UW TR 9407 (1994), eqs. 65-66 (equation numbers from a public transcription).
    """
    attenuation = 20 * sediment.loss / (sediment.speed_ratio * math.log(10))
    return sediment.volume_parameter * attenuation
