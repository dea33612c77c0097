"""Fractal relief: a power law of wavenumber between an outer scale and the cutoff.

The spectrum is W2(K) = w2 / (K^2 + K0^2)^(gamma/2), two-sided over the plane, its integral the mean
square height. Since 1/x^n is a sum of exponentials of x, it is a sum of Gaussians of all widths; one per
octave is enough (ripple below 0.2 dB), and each is one octave of lattice noise.
"""

import math
from functools import cache
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from insonify.model import Metres, Model, evaluated_once, field_error
from insonify.scattering.sediments import Sediment, checked_sediment
from insonify.scene.terrain.octaves import SPLINE_ENERGY, SPLINE_SLOPE_ENERGY, Octaves, spline_spectrum
from insonify.scene.terrain.roughness_cutoff import FINEST, RoughnessCutoff
from insonify.validity import require_numbers, warn_outside

Floats = NDArray[np.float64]

_OCTAVE_BIAS = 1 << 16  # keys of octaves are log2(pitch / 1 m), which may be negative, plus this
_MAX_WAVENUMBER = 8.0  # of resolved terrain [wavenumber of the cutoff]
_MAX_PITCH = 7.0  # octaves with pitch^2 K0^2 / 3 above this would add less than 0.2 dB at K = 0, and nothing above K0


class PowerLaw(Model):
    """Fractal relief, from a spectral exponent or a Hurst exponent, and a strength or an rms height.

    Source of the relations: the von Karman (Matern) family; gamma = 2 H + 2 and the structure constant as in
    APL-UW TR 9407 (1994), section IV. Measured seabeds have gamma 2.4 to 3.9.

    Example:
        >>> relief = PowerLaw(hurst=0.6, rms="10 cm", outer_scale="20 m")
        >>> f"exponent {relief.gamma:.1f}, rms height {100 * relief.band_variance() ** 0.5:.0f} cm"
        'exponent 3.2, rms height 10 cm'
    """

    kind: Literal["power-law"] = "power-law"
    exponent: Annotated[float, Field(ge=2.1, le=3.9)] | None = None
    """Spectral exponent gamma of the 2-D spectrum [1]."""
    hurst: Annotated[float, Field(ge=0.05, le=0.95)] | None = None
    """Hurst exponent, gamma / 2 - 1 [1]."""
    strength: Annotated[float, Field(gt=0, le=100)] | None = None
    """Spectral strength w2 [m^(4 - gamma)]."""
    rms: Annotated[Metres, Field(gt=0, le=1000)] | None = None
    """Root mean square height of all wavelengths together [m]."""
    outer_scale: Annotated[Metres, Field(ge=FINEST, le=1e9)] = 20.0
    """Wavelength beyond which the terrain does not get rougher, 2 pi / K0 [m]."""

    @model_validator(mode="after")
    def _check_spectrum_parameters(self) -> Self:
        for first, second in (("exponent", "hurst"), ("strength", "rms")):
            if (getattr(self, first) is None) == (getattr(self, second) is None):
                raise field_error(first, None, f"Give exactly one of {first} and {second}.")
        warn_outside("Power-law relief of a seabed (APL-UW TR 9407)", "spectral exponent", self.gamma, 2.4, 3.9, "")
        return self

    @classmethod
    def of_sediment(cls, sediment: Sediment, *, outer_scale: float = 20.0) -> "PowerLaw":
        """The relief that continues a sediment's own roughness to longer wavelengths.

        Args:
            sediment: Sediment, whose spectral exponent and strength are used.
            outer_scale: See the field [m]. Roughness measured at centimetres is too rough beyond
                tens of metres.

        Valid: with the cutoff of `RoughnessCutoff.of_sediment`, and Jackson's law on the facets, the terrain has the
        composite level of APL-UW TR 9407 within 2 dB from 5 to 40 degrees, where rms slopes stay below some 20 degrees:
        every sediment with a grain size up to 100 kHz, rock and stones up to 30 kHz. The full handbook turns from its
        composite level to an empirical one beyond slopes of 7 degrees: there coarse sand and gravel come out up to
        6 dB above it, rock 6 dB and rough rock 10 to 15 dB below (docs/explanation/relief-and-roughness.md).
        """
        checked_sediment(sediment)
        return cls(exponent=sediment.spectral_exponent, strength=sediment.spectral_strength, outer_scale=outer_scale)

    @property
    def gamma(self) -> float:
        """Spectral exponent [1]."""
        return self.exponent if self.exponent is not None else 2 * (self.hurst or 0.0) + 2

    @property
    def outer_wavenumber(self) -> float:
        """K0 [rad/m]."""
        return 2 * math.pi / self.outer_scale

    @property
    def w2(self) -> float:
        """Spectral strength [m^(4 - gamma)]; w2 = rms^2 (gamma - 2) K0^(gamma - 2) / (2 pi)."""
        if self.strength is not None:
            return self.strength
        return (self.rms or 0.0) ** 2 * (self.gamma - 2) * self.outer_wavenumber ** (self.gamma - 2) / (2 * math.pi)

    def spectrum(self, wavenumber: ArrayLike) -> Floats:
        """Two-sided 2-D height spectrum [m^4] at wavenumbers [rad/m], any shape; resolved and residual parts."""
        K = require_numbers("wavenumber", wavenumber, "rad/m", 0.0)
        return np.asarray(self.w2 * (K**2 + self.outer_wavenumber**2) ** (-self.gamma / 2))

    def band_variance(self, low: float = 0.0, high: float = math.inf) -> float:
        """Mean square height [m^2] between two wavenumbers [rad/m]; of all wavenumbers by default."""
        n, K0 = self.gamma / 2 - 1, self.outer_wavenumber
        return math.pi * self.w2 / n * ((low**2 + K0**2) ** -n - (high**2 + K0**2) ** -n)

    def variance_beyond(self, low: Floats) -> Floats:
        """Mean square height [m^2] of all waves beyond some wavenumbers [rad/m], any shape."""
        factor, square, exponent = self._variance_terms()
        return np.asarray(factor * (low**2 + square) ** exponent)

    @evaluated_once
    def _variance_terms(self) -> tuple[float, float, float]:
        """Factor, square of K0 and exponent of the variance beyond a wavenumber: constants, read in every ping."""
        n = self.gamma / 2 - 1
        return math.pi * self.w2 / n, self.outer_wavenumber**2, -n

    def slope_variance(self, high: float) -> float:
        """Mean square gradient, both directions together [1], of wavenumbers below `high` [rad/m]."""
        n, start = self.gamma / 2, self.outer_wavenumber**2
        stop = high**2 + start
        total = (stop ** (2 - n) - start ** (2 - n)) / (2 - n) - start * (stop ** (1 - n) - start ** (1 - n)) / (1 - n)
        return math.pi * self.w2 * total

    def build_relief(self, *, seed: int, layer: int, cutoff: RoughnessCutoff) -> Octaves:
        """Realisation of the resolved part as a sum of octaves.

        The pitches of the octaves are powers of two of a metre: a shorter cutoff wavelength adds detail to the same
        terrain. The finest octave is weighted so that the mean square slope is that of a sharp cut at the cutoff.

        Args:
            seed: Seed of the scene [1].
            layer: Number of this relief in the scene [1].
            cutoff: Cutoff wavelength of the terrain.
        """
        return self._octaves(cutoff.wavenumber, seed=seed, layer=layer)

    def resolved_fraction(self, wavenumber: ArrayLike, cutoff: RoughnessCutoff) -> Floats:
        """Fraction of the spectrum that is resolved [1], from 1 well below the cutoff's wavenumber to 0 well above.

        Args:
            wavenumber: Magnitude [rad/m], any shape.
            cutoff: Cutoff wavelength of the terrain. The transition is as wide as an octave, with the mean square slope
                of a sharp cutoff.
        """
        K = np.asarray(wavenumber, float)
        beyond = _MAX_WAVENUMBER * cutoff.wavenumber < K
        inside = np.where(beyond, cutoff.wavenumber, K)
        cut, full = (self._octaves(stop * cutoff.wavenumber, seed=0, layer=0) for stop in (1, 4 * _MAX_WAVENUMBER))
        return np.where(beyond, 0.0, np.minimum(cut.spectrum(inside) / full.spectrum(inside), 1.0))

    def _octaves(self, stop: float, *, seed: int, layer: int) -> Octaves:
        """Octaves from the outer scale down to a wavenumber [rad/m]."""
        target, K0 = self.slope_variance(stop), self.outer_wavenumber
        exponent = math.floor(0.5 * math.log2(3 * _MAX_PITCH / K0**2))
        octaves, amplitudes, slopes = [], [], 0.0
        while slopes < target * (1 - 1e-9):
            amplitude, pitch = self._amplitude(exponent), 2.0**exponent
            octave_slope = (amplitude / pitch) ** 2 * 2 * SPLINE_ENERGY * SPLINE_SLOPE_ENERGY
            fraction = min(1.0, (target - slopes) / octave_slope)
            octaves.append(exponent)
            amplitudes.append(amplitude * math.sqrt(fraction))
            slopes, exponent = slopes + fraction * octave_slope, exponent - 1
        pitches = 2.0 ** np.array(octaves, float)
        return Octaves(pitches, np.array(amplitudes), seed, layer, np.array(octaves, np.int64) + _OCTAVE_BIAS)

    def _amplitude(self, exponent: int) -> float:
        """Amplitude of the octave whose pitch is 2^exponent metres [m].

        From w2 (K^2 + K0^2)^(-n) = w2 / Gamma(n) times the integral over ln t of t^n exp(-t K0^2) exp(-t K^2),
        n = gamma / 2, as a sum over t = pitch^2 / 3 in steps of ln 4.
        """
        n, t = self.gamma / 2, 4.0**exponent / 3
        # splines differ from Gaussians: the sum must have the right power law and first term in K0^2
        correction = n * _spline_gamma(n) / _spline_gamma(n + 1)
        density = self.w2 / _spline_gamma(n) * math.log(4) * t**n * math.exp(-correction * t * self.outer_wavenumber**2)
        return 2 * math.pi * math.sqrt(density) / 2.0**exponent


@cache
def _spline_gamma(n: float) -> float:
    """Gamma(n) for splines in place of Gaussians: the integral over ln t of t^n S(sqrt(3 t)) [1]."""
    log_s = np.linspace(math.log(1e-4), math.log(60.0), 3001)
    s = np.exp(log_s)
    return float(2 * 3**-n * np.trapezoid(s ** (2 * n) * spline_spectrum(s), log_s))
