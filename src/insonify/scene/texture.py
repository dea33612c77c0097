"""Texture: seabed that scatters more here and less there, so that its echoes are K-distributed and not Rayleigh.

A normal field on a lattice is mapped, quantile by quantile, to a gamma distribution of mean one. It multiplies the
strength of each patch of the seabed, whatever the angle and the path: the mean level stays, and where the sonar
resolves the texture, intensities spread more than speckle alone lets them.
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

FARTHEST = 8.0
"""Standard deviations up to which the map from normal to gamma is tabled [1]."""
PER_UNIT = 256.0
"""Entries of that table per standard deviation [1]."""
ORDERS = 24
"""Hermite orders of the map that its correlation is summed over [1]."""


class Texture(Model):
    """Strength of the terrain about its mean: a gamma field of mean one, tied to the terrain."""

    k_shape: Annotated[float, Field(ge=0.1, le=1000)]
    """Shape of the gamma distribution, nu [1]: the smaller, the patchier; variance 1 / nu."""
    correlation_length: Annotated[Metres, Field(ge=0.01, le=10_000)]
    """Distance at which the correlation of the texture has fallen to 1/e [m]."""

    def at(self, north: Floats, east: Floats, *, seed: int, scatterer_grid: ScattererGrid) -> Floats:
        """Factor on the scattering strength at positions [1]; mean one, variance 1 / shape.

        A position and seed have one value, which moves with the world if its scatterer grid moves with it.

        Args:
            north: Northing of the positions [m], shape (n,).
            east: Likewise [m], shape (n,).
            seed: Of the seabed.
            scatterer_grid: Frame of the seabed.

        Returns:
            Factors, shape (n,).

        Source: Jakeman & Pusey (1976), IEEE Trans. Antennas Propag. 24, 806-814, for K-distributed amplitudes; that
        they are speckle on a gamma texture: Ward (1981), Electron. Lett. 17, 561-563 (both from memory).
        """
        own = scatterer_grid.from_world(np.stack([north, east], axis=-1)) / self.pitch
        out = np.empty(len(own))
        normal_field(np.ascontiguousarray(own[:, 0]), np.ascontiguousarray(own[:, 1]),
                     *random_keys.stream_key(seed, random_keys.TEXTURE), out)  # fmt: skip
        interpolate_exp_table(out, -FARTHEST, PER_UNIT, _log_quantiles(self.k_shape))
        return out

    @property
    def pitch(self) -> float:
        """Spacing of the nodes of the normal field [m].

        Its own correlation is nearly exp(-3 r^2 / (4 pitch^2)): along the lattice that of a cubic spline with itself.
        """
        return self.correlation_length / _pitches(self.k_shape)

    def correlation(self, distance: ArrayLike) -> Floats:
        """Correlation of the texture at positions so far apart along the lattice [m], mean over its shifts [1].

        Args:
            distance: Any shape; along a diagonal it is lower by 0.002 at most.
        """
        return _correlation(self.k_shape, np.asarray(distance, float) / self.pitch)


def _correlation(shape: float, distance: Floats) -> Floats:
    """Correlation of the texture at positions `distance` pitches apart along the lattice [1], shape of `distance`.

    Source: Mehler's expansion: a function with Hermite coefficients a_n keeps sum a_n^2 n! rho^n of its variance.
    """
    from scipy.interpolate import BSpline

    itself = BSpline.basis_element(np.arange(-4.0, 5.0), extrapolate=False)  # a cubic one against itself
    normal = np.nan_to_num(itself(np.clip(np.abs(distance), 0, 4))) / float(itself(0.0))
    return np.asarray(np.polynomial.polynomial.polyval(normal, np.array([0.0, *_shares(shape)])))


@lru_cache(maxsize=16)
def _pitches(shape: float) -> float:
    """Pitches after which the correlation of the texture has fallen to 1/e [1]."""
    distance = np.linspace(0, 4, 4001)
    return float(np.interp(-np.exp(-1.0), -_correlation(shape, distance), distance))


@lru_cache(maxsize=16)
def _shares(shape: float) -> tuple[float, ...]:
    """Part of the texture's variance in each Hermite order of the normal field, from the first on [1]."""
    x = np.linspace(-FARTHEST, FARTHEST, int(2 * FARTHEST * PER_UNIT) + 1)
    gamma = np.exp(_log_quantiles(shape)) * np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi) / PER_UNIT
    before, now = np.zeros_like(x), np.ones_like(x)  # of unit mean square: He_n / sqrt(n!)
    variances = []
    for n in range(ORDERS):
        before, now = now, (x * now - np.sqrt(n) * before) / np.sqrt(n + 1)
        variances.append(float(np.sum(gamma * now) ** 2))
    return tuple(np.array(variances) / sum(variances))


@lru_cache(maxsize=16)
def _log_quantiles(shape: float) -> Floats:
    """Logarithm of the gamma quantile at each entry of a normal number [1]."""
    from scipy.special import gammainccinv, gammaincinv, gammaln, log_ndtr, ndtr

    x = np.linspace(-FARTHEST, FARTHEST, int(2 * FARTHEST * PER_UNIT) + 1)
    with np.errstate(divide="ignore"):
        plain = np.log(np.where(x < 0, gammaincinv(shape, ndtr(x)), gammainccinv(shape, ndtr(-x))) / shape)
    # far down the lower tail P = t^nu / Gamma(nu + 1)
    tail = (log_ndtr(x) + gammaln(shape + 1)) / shape - np.log(shape)
    table = np.maximum(np.where(tail < -50, tail, plain), -700.0)
    table.flags.writeable = False  # shared by all pings
    return table
