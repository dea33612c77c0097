"""Texture: spatial variation of the seabed's scattering strength, which makes echoes K-distributed.

A normal field on a lattice is mapped by quantiles to a gamma distribution of mean one. It multiplies the scattering
cross section of each patch of the seabed, for all angles and paths. The mean intensity does not change; where the sonar
resolves the texture, the variance of the intensity is larger than that of speckle.
"""

from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from insonify import random_keys
from insonify.model import Metres, Model
from insonify.scene._normal_field_kernel import interpolate_exp_table, normal_field
from insonify.scene.scatterer_grid import ScattererGrid

Floats = NDArray[np.float64]

MAX_DEVIATION = 8.0
"""Largest normal number in the table of the map from normal to gamma [standard deviations]."""
ENTRIES_PER_DEVIATION = 256.0
"""Entries of that table per standard deviation [1]."""
HERMITE_ORDERS = 24
"""Hermite orders of the map that its correlation is summed over [1]."""


class Texture(Model):
    """Scattering strength relative to its mean: a gamma field of mean one, fixed to the terrain.

    Example:
        >>> texture = Texture(k_shape=2.0, correlation_length="5 m")
        >>> north = np.arange(0.0, 20e3, 10.0)
        >>> factor = texture.at(north, np.zeros_like(north), seed=1, scatterer_grid=ScattererGrid())
        >>> f"mean {factor.mean():.1f}, variance {factor.var():.1f}"
        'mean 1.0, variance 0.5'
    """

    k_shape: Annotated[float, Field(ge=0.1, le=1000)]
    """Shape parameter nu of the gamma distribution, whose variance is 1 / nu [1]."""
    correlation_length: Annotated[Metres, Field(ge=0.01, le=10_000)]
    """Distance at which the correlation of the texture has fallen to 1/e [m]."""

    def at(self, north: Floats, east: Floats, *, seed: int, scatterer_grid: ScattererGrid) -> Floats:
        """Factor on the scattering strength at positions [1]; mean one, variance 1 / shape.

        A position and seed have one value, which moves with the world if its scatterer grid moves with it.

        Args:
            north: Northing of the positions [m], shape (n,).
            east: Easting of the positions [m], shape (n,).
            seed: Seed of the seabed.
            scatterer_grid: Frame of the seabed.

        Returns:
            Factors, shape (n,).

        Source: Jakeman & Pusey (1976), IEEE Trans. Antennas Propag. 24, 806-814, for K-distributed amplitudes; that
        they are speckle on a gamma texture: Ward (1981), Electron. Lett. 17, 561-563 (both not verified).
        """
        lattice_position = scatterer_grid.from_world(np.stack([north, east], axis=-1)) / self.pitch
        out = np.empty(len(lattice_position))
        normal_field(np.ascontiguousarray(lattice_position[:, 0]), np.ascontiguousarray(lattice_position[:, 1]),
                     *random_keys.stream_key(seed, random_keys.TEXTURE), out)  # fmt: skip
        interpolate_exp_table(out, -MAX_DEVIATION, ENTRIES_PER_DEVIATION, _log_quantiles(self.k_shape))
        return out

    @property
    def pitch(self) -> float:
        """Spacing of the nodes of the normal field [m].

        Its own correlation is nearly exp(-3 r^2 / (4 pitch^2)): along the lattice that of a cubic spline with itself.
        """
        return self.correlation_length / _correlation_pitches(self.k_shape)

    def correlation(self, distance: ArrayLike) -> Floats:
        """Correlation of the texture along the lattice, mean over its shifts [1], shape of `distance`.

        Args:
            distance: Distance of two positions [m], any shape; the correlation along a diagonal is lower by up to
                0.002.
        """
        return _correlation(self.k_shape, np.asarray(distance, float) / self.pitch)


def _correlation(shape: float, distance: Floats) -> Floats:
    """Correlation of the texture at positions `distance` pitches apart along the lattice [1], shape of `distance`.

    Source: Mehler's expansion: a function with Hermite coefficients a_n keeps sum a_n^2 n! rho^n of its variance.
    """
    from scipy.interpolate import BSpline

    autocorrelation = BSpline.basis_element(np.arange(-4.0, 5.0), extrapolate=False)  # of the cubic spline
    normal = np.nan_to_num(autocorrelation(np.clip(np.abs(distance), 0, 4))) / float(autocorrelation(0.0))
    return np.asarray(np.polynomial.polynomial.polyval(normal, np.array([0.0, *_order_variances(shape)])))


@lru_cache(maxsize=16)
def _correlation_pitches(shape: float) -> float:
    """Distance at which the correlation of the texture falls to 1/e [pitches]."""
    distance = np.linspace(0, 4, 4001)
    return float(np.interp(-np.exp(-1.0), -_correlation(shape, distance), distance))


@lru_cache(maxsize=16)
def _order_variances(shape: float) -> tuple[float, ...]:
    """Fraction of the texture's variance in each Hermite order of the normal field, from order 1 on [1]."""
    x = np.linspace(-MAX_DEVIATION, MAX_DEVIATION, int(2 * MAX_DEVIATION * ENTRIES_PER_DEVIATION) + 1)
    gamma = np.exp(_log_quantiles(shape)) * np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi) / ENTRIES_PER_DEVIATION
    previous, current = np.zeros_like(x), np.ones_like(x)  # of unit mean square: He_n / sqrt(n!)
    variances = []
    for n in range(HERMITE_ORDERS):
        previous, current = current, (x * current - np.sqrt(n) * previous) / np.sqrt(n + 1)
        variances.append(float(np.sum(gamma * current) ** 2))
    return tuple(np.array(variances) / sum(variances))


@lru_cache(maxsize=16)
def _log_quantiles(shape: float) -> Floats:
    """Logarithm of the gamma quantile at each entry of a normal number [1]."""
    from scipy.special import gammainccinv, gammaincinv, gammaln, log_ndtr, ndtr

    x = np.linspace(-MAX_DEVIATION, MAX_DEVIATION, int(2 * MAX_DEVIATION * ENTRIES_PER_DEVIATION) + 1)
    with np.errstate(divide="ignore"):
        central = np.log(np.where(x < 0, gammaincinv(shape, ndtr(x)), gammainccinv(shape, ndtr(-x))) / shape)
    # far down the lower tail P = t^nu / Gamma(nu + 1)
    tail = (log_ndtr(x) + gammaln(shape + 1)) / shape - np.log(shape)
    table = np.maximum(np.where(tail < -50, tail, central), -700.0)
    table.flags.writeable = False  # shared by all pings
    return table
