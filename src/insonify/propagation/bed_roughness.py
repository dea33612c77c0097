"""Roughness of the seabed at a bottom bounce: static waves of the sediment's spectrum, and of its relief.

Waves shorter than the Fresnel zone count; longer ones tilt the plane of the reflection. Over relief, waves shorter than
its cutoff wavelength have the sediment's spectrum and longer ones the relief's; over a flat seabed all have the
sediment's.
A glint deflects sound by small angles: its waves together change the horizontal wavenumber by at most a third of the
wavenumber of the sound or, where that is larger, the cutoff wavenumber of the relief. Sound that changes by more is
scattered as the sediment's law describes: a bounce loses that energy.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import bounce_sequence
from insonify.propagation.local_planes import flat_bounces, fresnel_zone
from insonify.propagation.wind_waves import QUANTILE_COUNT, SLOPE_CUT, WAVENUMBER_COUNT, WindWaves, row_guide
from insonify.scattering.albedo import albedo
from insonify.scattering.reflection import reflection_coefficient_at_sine
from insonify.scattering.roughness import band_variance
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import UncappedSmallSlope
from insonify.scene.seabed import Seabed
from insonify.scene.seabed_law import SedimentLaw, sediment
from insonify.scene.seabed_terrain import SeabedTerrain

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class BedRoughness:
    """Roughness of one seabed for sound of one frequency."""

    wavelength: float
    """Wavelength of the sound [m]."""
    depth: float
    """Depth of the mean plane [m]."""
    waves: WindWaves
    """Waves of all lengths down to the sound's, without motion, the same in all directions."""
    max_wavenumber: float
    """Largest change of the horizontal wavenumber of the sound by a glint [rad/m]."""
    scattered_fraction: Floats
    """Energy scattered by the law with a change above `max_wavenumber`, re the reflected energy [1], (SINE_COUNT,).

    At even steps of the sine of the grazing angle from 0 to 1.
    """
    is_zone_limited: bool
    """True if only waves shorter than the Fresnel zone count; False over a surveyed grid, whose relief has no waves."""

    def mean_quanta(self, phase: Floats, sine: Floats, long_variance: Floats) -> tuple[Floats, Floats]:
        """Mean number of quanta of one bounce [1], and fraction of the reflected energy that the law scatters [1].

        The coherent leg has exp(-4 Gamma^2) of the reflected energy, with the phase variance 4 Gamma^2 by the
        waves between the Fresnel zone and the wavelength of the sound. The scattering law takes its fraction, at most
        the rest, and glints carry the remainder: of the energy of coherent leg and glints, exp(-quanta) is coherent.

        Args:
            phase: Phase per height, 2 k sin(grazing) [rad/m], shape (n,).
            sine: Sine of the grazing angle at the seabed [1], shape (n,).
            long_variance: Variance of the waves longer than the Fresnel zone [m^2], shape (n,).
        """
        quanta = phase**2 * (self.waves.variance[-1] - long_variance)
        scattered = np.interp(sine, np.linspace(0, 1, SINE_COUNT), self.scattered_fraction)
        scattered = np.minimum(scattered, -np.expm1(-quanta))
        return np.maximum(quanta + np.log1p(-scattered), 0.0), scattered

    @property
    def slope(self) -> float:
        """Rms slope along one axis of the waves up to `max_wavenumber` [1]."""
        return math.sqrt(float(np.interp(self.max_wavenumber, self.waves.wavenumber, self.waves.slope_moments[0])))

    def longer_waves(self, family: str, source_depth: float, length: Floats, sine: Floats) -> tuple[Floats, Floats]:
        """Variance of height [m^2] and of slope along one axis [1] of waves longer than the Fresnel zone, shape (n,).

        Longer: with a half wavelength above the geometric mean of the half axes of the zone.

        Args:
            family: Name of a family whose first bottom bounce counts.
            source_depth: Depth of the end at which the legs begin [m].
            length: Length of the legs [m], shape (n,).
            sine: Sine of the grazing angle of the legs at the seabed [1], shape (n,).
        """
        if not self.is_zone_limited:
            return np.zeros(len(sine)), np.zeros(len(sine))
        paths = flat_bounces(family, source_depth, length, sine, self.depth)
        along, across = fresnel_zone(paths, bounce_sequence(family).index("B"), self.wavelength)
        log_zone = np.log(math.pi / np.maximum(np.sqrt(along * across), 1e-6))
        log_wavenumber = np.log(self.waves.wavenumber)
        height, slope = (
            np.interp(log_zone, log_wavenumber, column) for column in (self.waves.variance, self.waves.slope_moments[0])
        )
        return height, slope


def bed_roughness(seabed: Seabed, frequency: float, sound_speed: float) -> BedRoughness | None:
    """Roughness of a seabed at its bounces; None where its `reflecting_interface` is smooth.

    Args:
        seabed: The seabed, with a sediment's scattering law unless it is smooth.
        frequency: Frequency of the sound [Hz].
        sound_speed: Sound speed in the water above it [m/s].
    """
    if seabed.reflecting_interface == "smooth":
        return None
    assert isinstance(seabed.scattering, SedimentLaw)  # guaranteed by the seabed
    terrain, scatters = seabed.terrain, seabed.scattering.law != "sediment-volume"
    if terrain is not None and terrain.span[0] == terrain.span[1]:
        terrain = None
    return _roughness_of_material(
        sediment(seabed.scattering.sediment), sound_speed / frequency, seabed.depth, terrain, scatters=scatters
    )


@lru_cache(maxsize=8)
def _roughness_of_material(
    material: Sediment, wavelength: float, depth: float, terrain: SeabedTerrain | None, *, scatters: bool
) -> BedRoughness:
    """Roughness of a material: its spectrum above the cutoff wavenumber of relief, the spectrum of the relief below.

    Args:
        material: Sediment of the seabed.
        wavelength: Wavelength of the sound [m].
        depth: Depth of the mean plane [m].
        terrain: Terrain of the seabed; None for a flat one.
        scatters: True if the interface scatters, so that its law takes energy.
    """
    wavenumber = 2 * math.pi / wavelength
    cutoff = MIN_WAVENUMBER if terrain is None else terrain.relief.cutoff.wavenumber
    max_change = min(max(wavenumber / SLOPE_CUT, 1.01 * cutoff), wavenumber)
    has_waves = terrain is not None and terrain.relief.is_waves
    low = min(MIN_WAVENUMBER, 0.5 * cutoff) if has_waves else cutoff
    k = np.geomspace(low, max(wavenumber, 1.01 * low), WAVENUMBER_COUNT)
    variance = np.asarray(band_variance(material, cutoff, np.maximum(k, cutoff)))
    if terrain is not None and has_waves:
        resolved = np.minimum(k, cutoff)
        variance = variance + terrain.relief.band_variance(np.array(low), cutoff)
        variance -= terrain.relief.band_variance(resolved, cutoff)
    fraction = _scattered_fraction(material, wavelength, max_change / wavenumber) if scatters else np.zeros(SINE_COUNT)
    return BedRoughness(
        wavelength, depth, static_waves(k, variance), max_change, fraction, terrain is None or has_waves
    )


def _scattered_fraction(material: Sediment, wavelength: float, min_change: float) -> Floats:
    """Energy that a sediment's interface scatters widely, re the reflected energy, at most 1 [1], shape (SINE_COUNT,).

    Args:
        material: Sediment of the seabed.
        wavelength: Wavelength of the sound [m].
        min_change: Least change of the horizontal wavenumber that counts, re the wavenumber of the sound [1].
    """
    sine = np.linspace(0, 1, SINE_COUNT)
    sine[0] = 0.1 * sine[1]
    law = UncappedSmallSlope(material, 1.0, wavelength)
    scattered = albedo(law, np.arcsin(sine), points=40, min_change=min_change)
    reflected = np.abs(reflection_coefficient_at_sine(material, sine)) ** 2
    return np.minimum(scattered / np.maximum(reflected, 1e-12), 1.0)


SINE_COUNT = 65
"""Number of sines of the grazing angle, evenly spaced from 0 to 1, at which the law's fraction is computed."""
MIN_WAVENUMBER = 2 * math.pi / 1000.0
"""Wavenumber of the longest waves that count, of 1 km [rad/m]."""


def static_waves(wavenumber: Floats, variance: Floats) -> WindWaves:
    """Tables of isotropic waves that are constant in time.

    Args:
        wavenumber: Increasing wavenumbers in equal ratios [rad/m], shape (m,).
        variance: Variance of the height by waves below each wavenumber [m^2], shape (m,).
    """
    per_axis = np.diff(variance) * wavenumber[1:] * wavenumber[:-1] / 2
    slope, zeros = np.concatenate(([0.0], np.cumsum(per_axis))), np.zeros_like(variance)
    directions = np.tile(np.linspace(-math.pi, math.pi, QUANTILE_COUNT), (2, 1))
    moments = np.stack([slope, slope, zeros, zeros])
    return WindWaves(wavenumber, variance, zeros, directions, moments, row_guide(variance))
