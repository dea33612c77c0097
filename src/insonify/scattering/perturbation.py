"""First-order perturbation: a rough bed as a sum of gratings.

Of all the waves in the relief, only the one with the right length turns sound from one direction into another
(Bragg's condition). It holds far from the mirror direction, where that wave is short and low.
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
    """Scattering by the one grating of the relief that matches both directions.

    Energy is not conserved: towards the mirror direction the matching wave becomes infinitely long, and a power-law
    relief has infinite heights there. No cap is applied; use SmallSlope or Jackson where that matters.
    """

    sediment: Sediment
    """What lies below the water."""
    frequency: Hertz
    """Frequency [Hz]."""
    _: KW_ONLY
    sound_speed: MetresPerSecond = 1500.0
    """In the water [m/s]."""

    def __post_init__(self) -> None:
        """Refuse what is no sound; warn outside the band in which relief was measured."""
        check_sediment_law(self)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Of the sound that arrives, from the plane of the interface [rad], any shape.
            grazing_out: Of the sound that leaves, likewise [rad], broadcast.
            azimuth: Between the two: 0 forward, pi back [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction is behind the interface.

        Source: k^4 |A|^2 W(K), Jackson (1993), APL-UW TR 9305; Williams & Jackson (1998), J. Acoust. Soc. Am. 103,
        169 (equations from a public implementation); in backscatter the perturbation term of APL-UW TR 9407 (1994),
        eqs. 41-52. Valid: relief low against the wavelength, away from the mirror direction, 10 to 100 kHz.
        """
        d = scattering_geometry(grazing_in, grazing_out, azimuth)
        k = 2 * np.pi * self.frequency / self.sound_speed
        spectrum = roughness_spectrum(self.sediment, 2 * k * np.sqrt(d.transverse2))
        return d.where_illuminated(k**4 * grating_strength(self.sediment, d) * spectrum)


def grating_strength(sediment: Sediment, d: ScatteringGeometry) -> Floats:
    """How strongly a fluid sediment's corrugation couples two directions, |A|^2 [1].

    Args:
        sediment: What lies below the water.
        d: The pair of directions.

    Source: as :meth:`Perturbation.cross_section`, with both transmission coefficients multiplied out so that nothing
    cancels at low grazing angles: 1 + R = 2 rho sin / (rho sin + P), 1 - R = 2 P / (rho sin + P).
    """
    rho = sediment.density_ratio
    kappa2 = ((1 + 1j * sediment.loss) / sediment.speed_ratio) ** 2
    p_in, p_out = vertical_wavenumber(sediment, d.sine_in), vertical_wavenumber(sediment, d.sine_out)
    contrast = rho**2 * (d.along - 1) + rho * (kappa2 - d.along) - (rho - 1) * p_in * p_out
    return np.asarray(4 * transmission(sediment, d) * np.abs(contrast) ** 2)


def transmission(sediment: Sediment, d: ScatteringGeometry) -> Floats:
    """Share of sound that enters the sediment on one way and returns on the other [1].

    Args:
        sediment: What lies below the water.
        d: The pair of directions.

    Returns:
        |1 + R_in|^2 |1 + R_out|^2 / (16 rho^4).
    """
    rho = sediment.density_ratio
    share_in, share_out = (
        (sine / np.abs(rho * sine + vertical_wavenumber(sediment, sine))) ** 2 for sine in (d.sine_in, d.sine_out)
    )
    return np.asarray(share_in * share_out)
