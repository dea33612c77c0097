"""Wave spectra of the sea surface and their moments.

A wave spectrum is the variance of the surface's height per wavenumber. Its moments matter to a sonar: the significant
height, the slopes that change the direction of reflection, and the vertical speed that causes Doppler shift.

Heights are positive up here, as in the literature on waves; the depth of the surface is minus its height. The published
spectra are those of deep water: a finite depth changes the phase speed of each wave, not its height.
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
"""Surface tension of sea water over its density, approximately; it matters for waves below 5 cm [m^3/s^2]."""
MAX_WAVENUMBER = 2e4
"""Wavenumber beyond which viscosity leaves no waves [rad/m]."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


class WaveSpectrum(Protocol):
    """Variance of the surface's height per wavenumber.

    Example:
        >>> seas: list[WaveSpectrum] = [PiersonMoskowitz(10.0), Jonswap(10.0, fetch=50e3), Elfouhaily(10.0)]
        >>> [f"dominant waves {2 * np.pi / sea.peak:.0f} m long" for sea in seas]
        ['dominant waves 88 m long', 'dominant waves 38 m long', 'dominant waves 91 m long']
    """

    @property
    def peak(self) -> float:
        """Wavenumber of the dominant waves [rad/m]; the density is negligible below an eighth of it."""
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
    """Angular frequency of waves from the dispersion relation [rad/s].

    Args:
        wavenumber: Wavenumber, 0 or more [rad/m], any shape.
        water_depth: Mean depth of the water [m], broadcast; infinite by default.

    Returns:
        Angular frequency [rad/s], broadcast shape.

    Source: Airy's linear theory with surface tension, omega^2 = (g k + T k^3) tanh(k D), as in
    Lamb (1932), Hydrodynamics, ch. IX (chapter not verified).
    Valid: waves much lower than they are long, no current.

    Example:
        >>> f"period of a 100 m wave: {2 * np.pi / angular_frequency(2 * np.pi / 100.0):.1f} s"
        'period of a 100 m wave: 8.0 s'
    """
    k = require_numbers("wavenumber", wavenumber, "rad/m", 0.0)
    # Infinite depth is a case of its own: k = 0 times infinity would not be a number.
    depth = as_floats(water_depth)
    is_infinite = depth is not None and np.isposinf(depth)
    finite = water_depth if depth is None else np.where(is_infinite, 1.0, depth)
    checked = require_numbers("water_depth", finite, "m", 0.0, exclude_low=True)
    depth_factor = np.where(is_infinite, 1.0, np.tanh(k * checked))
    return np.asarray(np.sqrt((GRAVITY * k + TENSION * k**3) * depth_factor))


def height_variance(
    spectrum: WaveSpectrum, *, min_wavenumber: float = 0.0, max_wavenumber: float = MAX_WAVENUMBER
) -> float:
    """Variance of the surface's height [m^2].

    Args:
        spectrum: Wave spectrum of the sea.
        min_wavenumber: Lower end of the band of wavenumbers [rad/m].
        max_wavenumber: Upper end of the band of wavenumbers [rad/m].

    Returns:
        Integral of S(k) over the band [m^2].
    """
    k, dk = _band(spectrum, min_wavenumber, max_wavenumber)
    return float(np.sum(spectrum.density(k) * dk))


def significant_height(spectrum: WaveSpectrum) -> float:
    """Significant wave height, trough to crest: four times the rms height [m].

    Args:
        spectrum: Wave spectrum of the sea.

    Source: Longuet-Higgins (1952), J. Mar. Res. 11, 245: 4.004 rms heights is the mean of the
    highest third of narrow-band waves; the factor is rounded to 4 by convention.

    Example:
        >>> f"{significant_height(PiersonMoskowitz(wind_speed=15.0)):.1f} m"
        '5.1 m'
    """
    return 4 * height_variance(spectrum) ** 0.5


def mean_square_slope(spectrum: WaveSpectrum, max_wavenumber: float, *, min_wavenumber: float = 0.0) -> float:
    """Variance of the surface's slope, both directions together [1].

    Args:
        spectrum: Wave spectrum of the sea.
        max_wavenumber: Upper end of the band of wavenumbers [rad/m]. There is no default: a
            saturated spectrum has slope in every octave; for sound of wavenumber k,
            waves up to about k/3 to k act as slope, shorter ones as roughness.
        min_wavenumber: Lower end of the band of wavenumbers [rad/m]: the largest resolved one gives the slope variance
            that is left to statistics.

    Returns:
        Integral of k^2 S(k) over the band [1].

    Example:
        >>> f"{mean_square_slope(Elfouhaily(wind_speed=10.0), max_wavenumber=np.inf):.2f}"
        '0.06'
    """
    k, dk = _band(spectrum, min_wavenumber, max_wavenumber)
    return float(np.sum(k**2 * spectrum.density(k) * dk))


def vertical_speed_rms(spectrum: WaveSpectrum, max_wavenumber: float, *, water_depth: float = np.inf) -> float:
    """Rms speed at which the surface rises and falls [m/s].

    Args:
        spectrum: Wave spectrum of the sea.
        max_wavenumber: Upper end of the band of wavenumbers [rad/m].
        water_depth: Mean depth of the water [m].

    Returns:
        Root of the integral of omega^2 S(k) [m/s].
    """
    k, dk = _band(spectrum, 0.0, max_wavenumber)
    omega = angular_frequency(k, water_depth=water_depth)
    return float(np.sum(omega**2 * spectrum.density(k) * dk) ** 0.5)


def _band(spectrum: WaveSpectrum, min_wavenumber: float, max_wavenumber: float) -> tuple[Floats, Floats]:
    """Wavenumbers and weights [rad/m] for an integral over a band, Gauss-Legendre in each sixth of an e-fold."""
    low = max(require_number("min_wavenumber", min_wavenumber, "rad/m", 0.0), spectrum.peak / 8)
    if isinstance(max_wavenumber, float) and max_wavenumber == np.inf:
        high = MAX_WAVENUMBER
    else:
        high = min(require_number("max_wavenumber", max_wavenumber, "rad/m", 0.0, exclude_low=True), MAX_WAVENUMBER)
    if not low < high:
        return np.ones(1), np.zeros(1)
    panels = int(np.ceil(6 * np.log(high / low)))
    edges = np.linspace(np.log(low), np.log(high), panels + 1)
    centre, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    k = np.exp(centre[:, None] + half[:, None] * _NODES).ravel()
    return k, (half[:, None] * _WEIGHTS).ravel() * k
