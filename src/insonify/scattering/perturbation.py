"""First-order perturbation theory: a rough seabed as a sum of sinusoidal gratings.

Of all spectral components of the relief, only one scatters sound from a given direction into another
(Bragg's condition). The theory holds far from the specular direction, where this component is short and low.
"""

from dataclasses import KW_ONLY, dataclass

import numpy as np

from insonify.model import Hertz, MetresPerSecond
from insonify.scattering.law import Floats
from insonify.scattering.reflection import vertical_wavenumber
from insonify.scattering.roughness import check_sediment_law, roughness_spectrum
from insonify.scattering.scattering_geometry import ScatteringGeometry, scattering_geometry
from insonify.scattering.sediments import Sediment


@dataclass(frozen=True, slots=True)
class Perturbation:
    """Scattering by the spectral component of the relief that satisfies Bragg's condition.

    Energy is not conserved: towards the specular direction the Bragg component becomes infinitely long, where a
    power-law relief has infinite heights. No cap is applied; use SmallSlope or Jackson where that matters.

    Example:
        >>> seabed = Perturbation(Sediment.named("medium sand"), frequency=30e3)
        >>> grazing = np.radians(20)
        >>> f"{10 * np.log10(seabed.cross_section(grazing, grazing, np.pi)):.0f} dB"
        '-29 dB'
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

        Source: k^4 |A|^2 W(K), Jackson (1993), APL-UW TR 9305; Williams & Jackson (1998), J. Acoust. Soc. Am. 103,
        169 (equations from a public implementation); in backscatter the perturbation term of APL-UW TR 9407 (1994),
        eqs. 41-52. Valid: relief low against the wavelength, away from the specular direction, 10 to 100 kHz.
        """
        d = scattering_geometry(grazing_in, grazing_out, azimuth)
        k = 2 * np.pi * self.frequency / self.sound_speed
        spectrum = roughness_spectrum(self.sediment, 2 * k * np.sqrt(d.transverse2))
        return d.where_illuminated(k**4 * grating_strength(self.sediment, d) * spectrum)


def grating_strength(sediment: Sediment, d: ScatteringGeometry) -> Floats:
    """Energy coupling of two directions by the relief of a fluid sediment, |A|^2 of `Perturbation.cross_section` [1].

    Source: as :meth:`Perturbation.cross_section`, with both transmission coefficients multiplied out so that nothing
    cancels at low grazing angles: 1 + R = 2 rho sin / (rho sin + P), 1 - R = 2 P / (rho sin + P).
    """
    rho = sediment.density_ratio
    kappa2 = ((1 + 1j * sediment.loss) / sediment.speed_ratio) ** 2
    p_in, p_out = vertical_wavenumber(sediment, d.sine_in), vertical_wavenumber(sediment, d.sine_out)
    contrast = rho**2 * (d.in_plane_product - 1) + rho * (kappa2 - d.in_plane_product) - (rho - 1) * p_in * p_out
    return np.asarray(4 * transmission(sediment, d) * np.abs(contrast) ** 2)


def transmission(sediment: Sediment, d: ScatteringGeometry) -> Floats:
    """Factor by which transmission through the interface, inwards and outwards, changes the scattered energy [1].

    Returns:
        |1 + R_in|^2 |1 + R_out|^2 / (16 rho^4), R the pressure reflection coefficients.
    """
    rho = sediment.density_ratio
    factor_in, factor_out = (
        (sine / np.abs(rho * sine + vertical_wavenumber(sediment, sine))) ** 2 for sine in (d.sine_in, d.sine_out)
    )
    return np.asarray(factor_in * factor_out)
