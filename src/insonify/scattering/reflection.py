"""What a flat seabed sends back like a mirror.

Fast sediment (sand) reflects almost everything below its critical angle, but turns the
wave's phase on the way: from a full reversal at grazing to nothing at the critical angle.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scattering.sediments import Sediment


def reflection_coefficient(sediment: Sediment, grazing: ArrayLike) -> NDArray[np.complex128]:
    """Pressure that a flat, uniform sediment reflects, per unit incident pressure.

    Args:
        sediment: The medium below the water.
        grazing: Angle from the plane of the seabed, 0 to pi/2 [rad], any shape.

    Returns:
        Complex ratio of pressures [1], shape of grazing, for the time factor
        exp(+j 2 pi f t): -1 at grazing 0. It is the same at every frequency.

    Source: Rayleigh's coefficient of a lossy fluid, APL-UW TR 9407 (1994), eqs. 29-33,
    conjugated from the report's exp(-i omega t).
    Valid: a half space smooth to a fraction of the wavelength, without layers or shear.
    """
    angle = np.asarray(grazing, dtype=float)
    wavenumber = (1 + 1j * sediment.loss) / sediment.speed_ratio
    # Root with positive imaginary part: in exp(-i omega t) the wave in the sediment decays downwards.
    vertical = np.sqrt(wavenumber**2 - np.cos(angle) ** 2 + 0j)
    from_above = sediment.density_ratio * np.sin(angle)
    return np.asarray(np.conj((from_above - vertical) / (from_above + vertical)))
