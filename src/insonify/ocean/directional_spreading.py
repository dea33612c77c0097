"""Directional spreading: distribution of the waves of one wavelength over directions.

A photograph of the sea does not distinguish a wave from the one that travels in the opposite direction, so that a
spectrum from photographs is two-sided. A moving sea needs a one-sided distribution,
in which most waves travel downwind.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from insonify.ocean.elfouhaily import RIPPLE_SPEED, Elfouhaily, phase_speed
from insonify.ocean.wave_spectrum import Floats
from insonify.validity import require_number, require_numbers


class DirectionalSpreading(Protocol):
    """Distribution of the waves of one wavenumber over directions."""

    def density(self, angle: ArrayLike, wavenumber: ArrayLike) -> Floats:
        """Fraction of the variance per angle from the mean direction [1/rad].

        Args:
            angle: Direction of travel relative to the mean direction, -pi to pi [rad], any shape.
            wavenumber: Wavenumber [rad/m], broadcast.

        Returns:
            Density [1/rad], broadcast shape; its integral over all angles is 1.
        """
        ...

    def quantile(self, probability: ArrayLike, wavenumber: ArrayLike) -> Floats:
        """Angle below which a given fraction of the variance lies [rad].

        Args:
            probability: Fraction of the variance, 0 to 1 [1], any shape.
            wavenumber: Wavenumber [rad/m], broadcast.

        Returns:
            Angle from the mean direction, -pi to pi [rad], broadcast shape.
        """
        ...


@dataclass(frozen=True, slots=True)
class CosinePowerSpreading:
    """Spreading cos^(2s) of half the angle, the same for every wavelength.

    Source: Longuet-Higgins, Cartwright & Smith (1963), Ocean Wave Spectra, 111-136, for the
    form; Mitsuyasu et al. (1975), J. Phys. Oceanogr. 5, 750, found s about 10 at the peak.

    Example:
        >>> quartile = CosinePowerSpreading(exponent=10.0).quantile(0.75, wavenumber=0.1)
        >>> f"half of the energy within {np.degrees(quartile):.0f} deg of the mean direction"
        'half of the energy within 17 deg of the mean direction'
    """

    exponent: float = 10.0
    """Exponent s: 0 isotropic, 10 the dominant waves of a wind sea, 100 a swell [1]."""

    def __post_init__(self) -> None:
        """Refuse a negative exponent."""
        exponent = require_number("CosinePowerSpreading.exponent", self.exponent, "", 0.0, example="10 (0: isotropic)")
        object.__setattr__(self, "exponent", exponent)

    def density(self, angle: ArrayLike, wavenumber: ArrayLike) -> Floats:
        """Fraction of the variance per angle [1/rad], see `DirectionalSpreading`."""
        k = require_numbers("wavenumber", wavenumber, "rad/m", 0.0)
        return _cosine_density(angle, np.full(k.shape, self.exponent))

    def quantile(self, probability: ArrayLike, wavenumber: ArrayLike) -> Floats:
        """Angle below which a fraction of the variance lies [rad], see `DirectionalSpreading`."""
        k = require_numbers("wavenumber", wavenumber, "rad/m", 0.0)
        return _cosine_quantile(probability, np.full(k.shape, self.exponent))


@dataclass(frozen=True, slots=True)
class ElfouhailySpreading:
    """Spreading of a wind sea: narrow at the peak, wide for short waves, narrow again for ripples.

    The published spreading is two-sided, 1 + tanh(x) cos 2 phi. The one-sided spreading here is
    cos^(2s) of half the angle with s = 1 + 2 x / ln 2: averaged with the opposite
    direction it has the published ratio of upwind to crosswind waves at every wavenumber.

    Source: Elfouhaily et al. (1997), eq. 49 and the lines about it, x = ln2/4 + 4 (c/cp)^2.5 +
    0.13 (u*/cm) (cm/c)^2.5 (from secondary sources); the one-sided form is derived here.

    Example:
        >>> sea = Elfouhaily(wind_speed=10.0)
        >>> ElfouhailySpreading(sea).anisotropy([sea.peak, 10.0, 370.0]).round(1).tolist()  # long waves to ripples
        [1.0, 0.2, 0.4]
    """

    sea: Elfouhaily
    """Wave spectrum to which the spreading belongs."""

    def density(self, angle: ArrayLike, wavenumber: ArrayLike) -> Floats:
        """Fraction of the variance per angle [1/rad], see `DirectionalSpreading`."""
        return _cosine_density(angle, self._exponent(wavenumber))

    def quantile(self, probability: ArrayLike, wavenumber: ArrayLike) -> Floats:
        """Angle below which a fraction of the variance lies [rad], see `DirectionalSpreading`."""
        return _cosine_quantile(probability, self._exponent(wavenumber))

    def anisotropy(self, wavenumber: ArrayLike) -> Floats:
        """Upwind minus crosswind waves, over their sum: the Delta of the published spreading [1].

        Args:
            wavenumber: Wavenumber [rad/m], any shape.
        """
        return np.asarray(np.tanh(self._narrowness(wavenumber)))

    def _narrowness(self, wavenumber: ArrayLike) -> Floats:
        """Argument x of the tanh in the published spreading [1]."""
        c = phase_speed(wavenumber)
        peak_speed = self.sea.wind_speed / self.sea.inverse_age
        ripples = 0.13 * self.sea.friction_velocity / RIPPLE_SPEED * (RIPPLE_SPEED / c) ** 2.5
        return np.asarray(math.log(2) / 4 + 4 * (c / peak_speed) ** 2.5 + ripples)

    def _exponent(self, wavenumber: ArrayLike) -> Floats:
        """Exponent s of the one-sided spreading [1]."""
        return np.asarray(1 + 2 * self._narrowness(wavenumber) / math.log(2))


def _cosine_density(angle: ArrayLike, s: ArrayLike) -> Floats:
    """Normalised cos^(2s)(angle / 2) [1/rad]."""
    from scipy.special import gammaln

    s = np.asarray(s, dtype=float)
    norm = np.exp(gammaln(s + 1) - gammaln(s + 0.5)) / (2 * math.sqrt(math.pi))
    return np.asarray(norm * np.abs(np.cos(require_numbers("angle", angle, "rad") / 2)) ** (2 * s))


def _cosine_quantile(probability: ArrayLike, s: ArrayLike) -> Floats:
    """Quantile of the angle [rad]: sin^2(angle / 2) has a beta distribution of 1/2 and s + 1/2."""
    from scipy.special import betaincinv

    signed = 2 * require_numbers("probability", probability, "", 0.0, 1.0) - 1
    return np.asarray(np.sign(signed) * 2 * np.arcsin(np.sqrt(betaincinv(0.5, np.asarray(s) + 0.5, np.abs(signed)))))
