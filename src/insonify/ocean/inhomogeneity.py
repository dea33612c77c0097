"""Inhomogeneous water: random patches of warmer and colder water, and their effect on travel times.

The relative change mu of sound speed is a Gaussian random field whose correlation falls with distance r as
exp(-r^2 / l^2). The delay of a ray of length R changes by -(1 / c) times the integral of mu along it, of variance

    <mu^2> / c^2 times the double integral of exp(-(s - s')^2 / l^2)
        = <mu^2> l^2 / c^2 (sqrt(pi) x erf x + exp(-x^2) - 1),    x = R / l.

Over many patches that is sqrt(pi) <mu^2> l R / c^2: Phi^2 = sqrt(pi) k^2 <mu^2> l R for the phase.
"""

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from insonify.model import Metres, Model, Seconds

Floats = NDArray[np.float64]


class Inhomogeneity(Model):
    """Smooth random changes of the speed of sound, fixed in the water."""

    rms_index: Annotated[float, Field(ge=0, le=1e-2)]
    """Root mean square of the relative change of sound speed [1]: 1e-4 is 0.15 m/s, or 0.05 degC."""
    correlation_length: Annotated[Metres, Field(ge=0.1, le=1000)]
    """Correlation length (1/e) of the relative change [m]."""
    correlation_time: Annotated[Seconds, Field(gt=0, le=1e6)] | None = None
    """Correlation time (1/e) of the relative change at a fixed position [s]; None: constant in time."""


def delay_variance(path_length: ArrayLike, sound_speed: ArrayLike, inhomogeneity: Inhomogeneity) -> Floats:
    """Variance of the travel time along straight rays [s^2].

    Args:
        path_length: Length of each ray [m], any shape.
        sound_speed: Mean sound speed along each ray [m/s], broadcast.
        inhomogeneity: Random field of the relative change of sound speed.

    Returns:
        Variance [s^2], broadcast shape.

    Source: the double integral above, exact for straight rays. Its limit for path lengths >> correlation length is
    attributed to Chernov (1960), Wave Propagation in a Random Medium. Source: not verified.
    Valid: without diffraction, wavelength << correlation length, and `wave_parameter` below 1; beyond, about half of
    the variance is left.
    """
    from scipy.special import erf

    x = np.asarray(path_length, float) / inhomogeneity.correlation_length
    integral = np.sqrt(np.pi) * x * erf(x) + np.expm1(-(x**2))
    return np.asarray(
        (inhomogeneity.rms_index * inhomogeneity.correlation_length / np.asarray(sound_speed, float)) ** 2 * integral
    )


def wave_parameter(path_length: float, wavelength: float, inhomogeneity: Inhomogeneity) -> float:
    """Wave parameter 4 R / (k l^2), Fresnel zone over patch size [1]: above 1 patches focus and scatter.

    Args:
        path_length: Length of a ray [m].
        wavelength: Acoustic wavelength [m].
        inhomogeneity: Random field of the relative change of sound speed.
    """
    return 4 * path_length * wavelength / (2 * np.pi * inhomogeneity.correlation_length**2)
