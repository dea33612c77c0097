"""Albedo of a scattering law, the fraction of the incident energy that a patch scatters, and a cap on it at 1.

A passive interface scatters no more energy than it receives, but an approximation may. Where the albedo of a law
exceeds 1, the cross section is divided by it, with one factor for both directions of a pair, so that
reciprocity is kept.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.caller_warning import warn_caller
from insonify.scattering.law import Floats, ScatteringLaw
from insonify.validity import PhysicsWarning, require_grazing_angle

NEAREST_SPECULAR = 1e-6
"""Radius about the specular direction, in horizontal direction cosines, that the integral leaves out [1]."""
CAP_NODES = 65
"""Number of sines of the grazing angle, evenly spaced from 0 to 1, at which the albedo is computed."""
MARGIN = 1.003
"""Safety factor on the albedo, for the interpolation between nodes [1]."""


def albedo(
    law: ScatteringLaw, grazing_in: ArrayLike, *, points: int = 64, min_change: float = NEAREST_SPECULAR
) -> Floats:
    """Fraction of the incident energy that a patch scatters into the hemisphere above it.

    Args:
        law: Scattering law of the patch.
        grazing_in: Grazing angle of the incident sound, above 0 to pi/2 [rad], any shape.
        points: Number of quadrature points in each of two dimensions.
        min_change: Least change of the horizontal direction cosines that counts [1]: 0.3 leaves out a lobe about the
            specular direction.

    Returns:
        Integral of the cross section over the hemisphere, over the sine of the grazing angle [1], shape of grazing_in.

    Example:
        >>> f"{albedo(Lambert(strength_db=10 * np.log10(1 / np.pi)), np.radians(30)):.2f}"
        '1.00'
        >>> f"{albedo(Jackson(Sediment.named('medium sand'), 100e3), np.radians(30)):.2f}"
        '0.54'
    """
    angles = require_grazing_angle("grazing_in", grazing_in, gaps=False)
    if np.any(angles == 0):
        raise ValueError("grazing_in is 0; no sound reaches a patch along its own plane. Give angles above 0")
    if isinstance(points, bool) or not isinstance(points, int) or points < 2:
        raise ValueError(f"points is {points!r}; give a whole number, 2 or more, such as 64")
    return np.array([_albedo_at(law, float(a), points, min_change) for a in angles.ravel()]).reshape(angles.shape)


def _albedo_at(law: ScatteringLaw, grazing: float, points: int, min_change: float) -> float:
    # Polar coordinates about the specular direction, the radius in equal ratios: the peak there may be very narrow.
    nodes, weights = _gauss_legendre(points)
    polar, polar_weight = 0.5 * np.pi * (nodes + 1)[:, None], np.pi * weights[:, None]  # twice: for both halves
    cosine = np.cos(grazing)
    max_radius = -cosine * np.cos(polar) + np.sqrt(1 - (cosine * np.sin(polar)) ** 2)
    log_ratio = np.log(np.maximum(max_radius, max(2 * NEAREST_SPECULAR, min_change)) / min_change)
    radius = min_change * np.exp(0.5 * log_ratio * (nodes + 1))
    x, y = cosine + radius * np.cos(polar), radius * np.sin(polar)
    sine = np.sqrt(np.maximum(1 - x**2 - y**2, 1e-12))
    sigma = law.cross_section(np.asarray(grazing), np.arcsin(np.minimum(sine, 1)), np.arctan2(y, x))
    return float(np.sum(sigma / sine * radius**2 * 0.5 * log_ratio * weights * polar_weight) / np.sin(grazing))


@lru_cache(maxsize=8)
def _gauss_legendre(points: int) -> tuple[Floats, Floats]:
    """Nodes and weights of a Gauss-Legendre quadrature from -1 to 1; kept: they take as long as an albedo."""
    return np.polynomial.legendre.leggauss(points)


def albedo_cap_nodes(law: ScatteringLaw) -> NDArray[np.float64]:
    """Factors that reduce a law's albedo to 1 where it exceeds 1.

    Args:
        law: Hashable scattering law without a cap.

    Returns:
        Factors, at most 1, at sines of the grazing angle evenly spaced from 0 to 1 [1], shape (`CAP_NODES`,).
    """
    return np.asarray(_albedo_cap_nodes(law))  # type: ignore[arg-type]  # laws are frozen, hence hashable


@lru_cache(maxsize=256)
def _albedo_cap_nodes(law: Any) -> NDArray[np.float64]:
    sines = np.linspace(0, 1, CAP_NODES)
    sines[0] = 0.1 * sines[1]  # no sound reaches a patch at grazing 0
    return np.asarray(1 / np.maximum(1.0, MARGIN * albedo(law, np.arcsin(sines), points=40)))


def warn_above_one(law: ScatteringLaw) -> None:
    """Warn if a law scatters more energy than arrives at one of eight grazing angles: no passive boundary does.

    Args:
        law: Any scattering law.
    """
    angles = np.radians([2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0])
    albedos = albedo(law, angles, points=40)
    highest = int(np.argmax(albedos))
    if albedos[highest] > MARGIN:
        warn_caller(
            f"{type(law).__name__} scatters {albedos[highest]:.3g} times the energy that arrives at a grazing angle of "
            f"{np.degrees(angles[highest]):.0f} degrees, and a passive boundary all of it at most. Lower it",
            PhysicsWarning,
        )


def symmetric_cap(law: ScatteringLaw, sine_in: Floats, sine_out: Floats) -> Floats:
    """Reciprocal factor that keeps the albedo of a law at 1 or below.

    Args:
        law: Hashable scattering law without its cap.
        sine_in: Sine of the grazing angle of the incident sound [1], any shape.
        sine_out: Sine of the grazing angle of the scattered sound [1], broadcast.

    Returns:
        The smaller of the factors of both directions, at most 1 [1], broadcast shape; symmetric in the two. With it
        the albedo of each direction is at most 1, since each term is reduced at least by the factor of that direction.
    """
    nodes = albedo_cap_nodes(law)
    if nodes.min() == 1:
        return np.ones(np.broadcast_shapes(np.shape(sine_in), np.shape(sine_out)))
    node_sines = np.linspace(0, 1, CAP_NODES)
    return np.asarray(np.minimum(np.interp(sine_in, node_sines, nodes), np.interp(sine_out, node_sines, nodes)))
