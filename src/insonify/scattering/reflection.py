"""Reflection coefficient of a flat seabed, and its reduction by roughness.

Fast sediment (sand) reflects almost everything below its critical angle, with a phase that changes from
pi at grazing incidence to 0 at the critical angle. Rock also supports shear waves, and may transmit
sound where its compressional wave alone would not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scattering._reflection_kernel import LEAST_ROOT, LEAST_SINE, reflect_off_fluid
from insonify.scattering.sediments import Sediment, checked_sediment
from insonify.validity import require_grazing_angle, require_number, require_numbers, require_sound_speed

Complexes = NDArray[np.complex128]


def reflection_coefficient(sediment: Sediment, grazing: ArrayLike) -> Complexes:
    """Pressure reflection coefficient of a flat, uniform sediment [1].

    Args:
        sediment: Sediment below the water.
        grazing: Angle from the plane of the seabed, 0 to pi/2 [rad], any shape.

    Returns:
        Complex ratio of pressures [1], shape of grazing, for the time factor
        exp(+j 2 pi f t): -1 at grazing 0. It does not depend on frequency.

    Source: Rayleigh's coefficient of a lossy fluid, APL-UW TR 9407 (1994), eqs. 29-33,
    conjugated from the report's exp(-i omega t).
    Valid: a half space smooth to a fraction of the wavelength, without layers or shear.

    Example:
        >>> sand = Sediment.named("medium sand")
        >>> np.abs(reflection_coefficient(sand, np.radians([10, 40, 90]))).round(2).tolist()
        [0.96, 0.53, 0.37]
    """
    return reflection_coefficient_at_sine(checked_sediment(sediment), np.sin(require_grazing_angle("grazing", grazing)))


def reflection_coefficient_at_sine(sediment: Sediment, sine: ArrayLike) -> Complexes:
    """`reflection_coefficient` [1] from the sine of the grazing angle [1], any shape, unchecked."""
    sine = np.asarray(sine, dtype=float)
    coefficient = np.empty(sine.shape, complex)
    reflect_off_fluid(sine.ravel(), sediment.density_ratio, _kappa2_minus_1(sediment), coefficient.reshape(-1))
    return coefficient


@reflect_off_fluid.stand_in
def _reflect_off_fluid(
    sine: NDArray[np.float64], density_ratio: float, kappa2_minus_1: complex, coefficient: Complexes
) -> None:
    """Reflection coefficients of a fluid sediment, as from the kernel `reflect_off_fluid`."""
    sine = np.maximum(sine, LEAST_SINE)
    vertical, load = _root(kappa2_minus_1, sine), density_ratio * sine
    with np.errstate(invalid="ignore"):  # a gap stays a gap
        coefficient[:] = np.conj((load - vertical) / (load + vertical))


def vertical_wavenumber(sediment: Sediment, sine: ArrayLike) -> Complexes:
    """Vertical wavenumber in the sediment over the wavenumber in the water.

    Args:
        sediment: Sediment below the water.
        sine: Sine of the grazing angle in the water [1], any shape.

    Returns:
        P = sqrt(kappa^2 - cos^2) [1], shape of `sine`, for the papers' time factor exp(-i omega t): the imaginary
        part is positive, so that the wave in the sediment decays downwards.

    Source: APL-UW TR 9407 (1994), eqs. 31-33.
    """
    return _root(_kappa2_minus_1(sediment), np.asarray(sine, dtype=float))


def _kappa2_minus_1(sediment: Sediment) -> complex:
    """kappa^2 - 1, with kappa the wavenumber in the sediment over that in the water [1]."""
    return complex(((1 + 1j * sediment.loss) / sediment.speed_ratio) ** 2 - 1)


def _root(kappa2_minus_1: complex, sine: NDArray[np.float64]) -> Complexes:
    """Root of kappa^2 - 1 plus the square of a sine, with an imaginary part of 0 or more [1], shape of `sine`."""
    real, imaginary = kappa2_minus_1.real + sine**2, kappa2_minus_1.imag
    # the root by real numbers: the library's complex one takes five times as long
    larger = np.maximum(np.sqrt((np.sqrt(real**2 + imaginary**2) + np.abs(real)) / 2), LEAST_ROOT)
    smaller, is_real_larger = imaginary / (2 * larger), real >= 0
    root = np.empty(real.shape, complex)
    root.real, root.imag = np.where(is_real_larger, larger, smaller), np.where(is_real_larger, smaller, larger)
    return root


@dataclass(frozen=True, slots=True)
class ElasticSolid:
    """Rock as a uniform solid that supports compressional and shear waves.

    Example:
        >>> granite = ElasticSolid(density_ratio=2.6, speed_ratio=3.7, shear_ratio=2.2)
        >>> f"{abs(elastic_reflection_coefficient(granite, np.pi / 2)):.2f}"
        '0.81'
    """

    density_ratio: float
    """Density over that of the water above [1]."""
    speed_ratio: float
    """Speed of the compressional wave over the sound speed of the water [1]."""
    shear_ratio: float
    """Speed of the shear wave over the sound speed of the water [1]."""
    loss: float = 0.0
    """Loss parameter of the compressional wave, |Im k / Re k| [1]."""
    shear_loss: float = 0.0
    """Loss parameter of the shear wave [1]."""

    def __post_init__(self) -> None:
        """Refuse a solid without positive stiffness."""
        for field in ("density_ratio", "speed_ratio", "shear_ratio", "loss", "shear_loss"):
            exclude_0 = not field.endswith("loss")
            object.__setattr__(
                self,
                field,
                require_number(f"ElasticSolid.{field}", getattr(self, field), "", 0.0, exclude_low=exclude_0),
            )
        limit = math.sqrt(3) / 2 * self.speed_ratio
        if self.shear_ratio >= limit:
            raise ValueError(
                f"ElasticSolid.shear_ratio is {self.shear_ratio:g} for a speed_ratio of {self.speed_ratio:g}; a solid "
                f"with positive stiffness has less than sqrt(3)/2 of it. Give a shear_ratio below {limit:.3g}"
            )


def elastic_reflection_coefficient(solid: ElasticSolid, grazing: ArrayLike) -> Complexes:
    """Pressure reflection coefficient of flat rock [1].

    Args:
        solid: Rock below the water.
        grazing: Angle from the plane of the seabed, 0 to pi/2 [rad], any shape.

    Returns:
        Complex ratio of pressures [1], shape of grazing, for the time factor exp(+j 2 pi f t).

    Source: plane waves at a fluid-solid boundary, Brekhovskikh & Lysanov (2003), Fundamentals of Ocean Acoustics,
    section 4.2 (section number not verified), conjugated from exp(-i omega t). Checked against the boundary
    conditions themselves.
    Valid: a smooth half space without layers; the shear wave in sand and mud is slow enough to be left out.

    Example:
        >>> granite = ElasticSolid(density_ratio=2.6, speed_ratio=3.7, shear_ratio=2.2)
        >>> np.abs(elastic_reflection_coefficient(granite, np.radians([30, 90]))).round(2).tolist()
        [1.0, 0.81]
    """
    if not isinstance(solid, ElasticSolid):
        raise ValueError(f"solid is {solid!r}; give an ElasticSolid, or use reflection_coefficient for a sediment")
    sine = np.maximum(np.sin(require_grazing_angle("grazing", grazing)), LEAST_SINE)
    compression = solid.speed_ratio / (1 + 1j * solid.loss)
    shear = solid.shear_ratio / (1 + 1j * solid.shear_loss)
    # 1 - cos^2 from the sine itself: for a wave as fast as the water's it would cancel at grazing 0.
    compression_down = np.sqrt(compression**-2 - 1 + sine**2 + 0j)
    shear_down = np.sqrt(shear**-2 - 1 + sine**2 + 0j)
    cosine2_2t = (2 * shear**2 * (1 - sine**2) - 1) ** 2
    # Impedances of the compressional wave, times cos^2 2t, and of the shear wave, times sin^2 2t, t the shear wave's
    # grazing angle. Multiplied out, so that a wave along the boundary causes no division by zero.
    load = solid.density_ratio * sine
    downwards = compression_down * shear_down
    impedance = load * (cosine2_2t * shear_down + (1 - cosine2_2t) * compression_down)
    with np.errstate(invalid="ignore"):  # a gap stays a gap
        return np.asarray(np.conj((impedance - downwards) / (impedance + downwards)))


def coherent_reflection_factor(
    frequency: ArrayLike, rms_height: ArrayLike, grazing: ArrayLike, *, sound_speed: ArrayLike = 1500.0
) -> NDArray[np.float64]:
    """Mean pressure reflected specularly by a rough boundary over that by a flat one [1].

    Args:
        frequency: Frequency [Hz], any shape.
        rms_height: Rms height of the roughness that the geometry does not resolve [m], broadcast.
        grazing: Grazing angle, from the mean plane [rad], broadcast.
        sound_speed: Sound speed in the water [m/s], broadcast.

    Returns:
        Factor on the flat boundary's pressure reflection coefficient, 0 to 1 [1], broadcast shape. The remaining
        energy is scattered; a law that includes it must not be added to the full reflection.

    Source: Eckart (1953), J. Acoust. Soc. Am. 25, 566: exp(-2 k^2 h^2 sin^2) of Gaussian heights; equation number
    not checked. Valid: gentle slopes, no shadows (grazing above the slopes).

    Example:
        >>> coherent_reflection_factor(100e3, rms_height=[0.0, 0.005, 0.01], grazing=np.radians(20)).round(2).tolist()
        [1.0, 0.36, 0.02]
    """
    speed = require_sound_speed("sound_speed", sound_speed)
    wavenumber = 2 * np.pi * require_numbers("frequency", frequency, "Hz", 0.0) / speed
    height, angle = require_numbers("rms_height", rms_height, "m", 0.0), require_grazing_angle("grazing", grazing)
    return np.asarray(np.exp(-2 * (wavenumber * height * np.sin(angle)) ** 2))
