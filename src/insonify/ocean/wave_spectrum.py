"""How the height of the sea is shared out among its waves.

A wave spectrum says how much of the variance of the surface's height belongs to waves of
each wavenumber. Its moments are what a sonar meets: the significant height, the slopes
that tilt the sound, the vertical speed that shifts its frequency.

Heights are positive up here, as in every book on waves; the depth of the surface is minus
its height. The published spectra are those of deep water: a finite depth changes how fast
each wave runs, not how high it is.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import as_floats, require_number, require_numbers

Floats = NDArray[np.float64]

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
TENSION = 7.2e-5
"""Surface tension of sea water over its density, about; it matters for waves below 5 cm [m^3/s^2]."""
FINEST = 2e4
"""Wavenumber beyond which no sea has waves: viscosity takes them [rad/m]."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


class WaveSpectrum(Protocol):
    """Shares the variance of the surface's height among wavenumbers."""

    @property
    def peak(self) -> float:
        """Wavenumber of the dominant waves [rad/m]; below an eighth of it there is nothing."""
        ...

    def density(self, wavenumber: ArrayLike) -> Floats:
        """Variance of the height per wavenumber, all directions together [m^3].

        Args:
            wavenumber: Wavenumber, above 0 [rad/m], any shape.

        Returns:
            Density S(k) [m^3], shape of wavenumber; its integral over k > 0 is the variance [m^2].
        """
        ...


def angular_frequency(wavenumber: ArrayLike, *, water_depth: ArrayLike = np.inf) -> Floats:
    """How fast a wave of a given length swings: the dispersion of water waves [rad/s].

    Args:
        wavenumber: Wavenumber, 0 or more [rad/m], any shape.
        water_depth: Mean depth of the water [m], broadcast; infinite by default.

    Returns:
        Angular frequency [rad/s], broadcast shape.

    Source: Airy's linear theory with surface tension, omega^2 = (g k + T k^3) tanh(k D), as in
    Lamb (1932), Hydrodynamics, ch. IX (chapter quoted from memory).
    Valid: waves much lower than they are long, no current.
    """
    k = require_numbers("wavenumber", wavenumber, "rad/m", 0.0)
    # An infinitely deep sea answers for k = 0 too, where 0 times infinity would not be a number.
    given = as_floats(water_depth)
    bottomless = given is not None and np.isposinf(given)
    finite = water_depth if given is None else np.where(bottomless, 1.0, given)
    deep = require_numbers("water_depth", finite, "m", 0.0, exclude_low=True)
    shallowness = np.where(bottomless, 1.0, np.tanh(k * deep))
    return np.asarray(np.sqrt((GRAVITY * k + TENSION * k**3) * shallowness))


def height_variance(spectrum: WaveSpectrum, *, longest_wavelength: float = 0.0, shortest_wavelength: float = FINEST) -> float:
    """Variance of the surface's height [m^2].

    Args:
        spectrum: Of the sea.
        longest_wavelength: Wavenumber of the longest_wavelength waves counted [rad/m].
        shortest_wavelength: Wavenumber of the shortest_wavelength waves counted [rad/m].

    Returns:
        Integral of S(k) over that band [m^2].
    """
    k, dk = _band(spectrum, longest_wavelength, shortest_wavelength)
    return float(np.sum(spectrum.density(k) * dk))


def significant_height(spectrum: WaveSpectrum) -> float:
    """Height from trough to crest that an old hand would report: four times the rms height [m].

    Args:
        spectrum: Of the sea.

    Source: Longuet-Higgins (1952), J. Mar. Res. 11, 245: 4.004 rms heights is the mean of the
    highest third of narrow-band waves; the factor is rounded to 4 by convention.
    """
    return 4 * height_variance(spectrum) ** 0.5


def mean_square_slope(spectrum: WaveSpectrum, shortest_wavelength: float, *, longest_wavelength: float = 0.0) -> float:
    """Variance of the surface's slope, both directions together [1].

    Args:
        spectrum: Of the sea.
        shortest_wavelength: Wavenumber of the shortest_wavelength waves counted [rad/m]. There is no default: a
            saturated spectrum has slope in every octave, and sound of wavenumber k sees
            waves up to about k/3 to k as slope, shorter ones as roughness.
        longest_wavelength: Wavenumber of the longest_wavelength waves counted [rad/m]; set it to where resolved
            waves end, and what is returned is the slope left to statistics.

    Returns:
        Integral of k^2 S(k) over that band [1].
    """
    k, dk = _band(spectrum, longest_wavelength, shortest_wavelength)
    return float(np.sum(k**2 * spectrum.density(k) * dk))


def vertical_speed_rms(spectrum: WaveSpectrum, shortest_wavelength: float, *, water_depth: float = np.inf) -> float:
    """Rms speed at which the surface rises and falls [m/s].

    Args:
        spectrum: Of the sea.
        shortest_wavelength: Wavenumber of the shortest_wavelength waves counted [rad/m].
        water_depth: Mean depth of the water [m].

    Returns:
        Root of the integral of omega^2 S(k) [m/s].
    """
    k, dk = _band(spectrum, 0.0, shortest_wavelength)
    omega = angular_frequency(k, water_depth=water_depth)
    return float(np.sum(omega**2 * spectrum.density(k) * dk) ** 0.5)


def _band(spectrum: WaveSpectrum, longest_wavelength: float, shortest_wavelength: float) -> tuple[Floats, Floats]:
    """Wavenumbers and their weights for an integral over a band, by Gauss in each sixth of an e-fold."""
    low = max(require_number("longest_wavelength", longest_wavelength, "rad/m", 0.0), spectrum.peak / 8)
    endless = isinstance(shortest_wavelength, float) and shortest_wavelength == np.inf
    high = FINEST if endless else min(require_number("shortest_wavelength", shortest_wavelength, "rad/m", 0.0, above=True), FINEST)
    if not low < high:
        return np.ones(1), np.zeros(1)
    panels = int(np.ceil(6 * np.log(high / low)))
    edges = np.linspace(np.log(low), np.log(high), panels + 1)
    centre, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    k = np.exp(centre[:, None] + half[:, None] * _NODES).ravel()
    return k, (half[:, None] * _WEIGHTS).ravel() * k
