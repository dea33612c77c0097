"""The terrain of a scene: its reliefs, cut once by the split into terrain and roughness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain.bathymetry_grid import BathymetryGrid
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.relief import Relief, ReliefSum, TerrainSample
from insonify.scene.terrain.ripples import Ripples
from insonify.scene.terrain.roughness_cutoff import RoughnessCutoff
from insonify.scene.terrain.scour import Scour
from insonify.validity import require_numbers

Floats = NDArray[np.float64]
Kind = PowerLaw | Ripples | BathymetryGrid | Scour
_LAYERS = 4  # streams a relief may use


@dataclass(frozen=True, slots=True)
class CompositeRelief(Relief):
    """Terrain that can be walked on, and an account of the roughness that is not in it."""

    resolved: ReliefSum
    """The part coarser than the split."""
    components: tuple[Kind, ...]
    """Relief before it is cut."""
    cutoff: RoughnessCutoff
    """Wavelength that divides the two."""

    def __repr__(self) -> str:
        kinds = ", ".join(map(repr, self.components)) or "flat"
        return f"Ground: {kinds}; split at {self.cutoff.wavelength:g} m"

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient of the resolved ground, see `Relief.sample`."""
        return self.resolved.sample(north, east)

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest height of the resolved ground [m], see `Relief.span`."""
        return self.resolved.span

    @property
    def shortest_wavelength(self) -> float:
        """Shortest wave of the resolved ground [m]; the split where there is no ground."""
        waves = [
            self.cutoff.wavelength if isinstance(kind, PowerLaw)
            else max(2 * kind.cell, self.cutoff.wavelength) if isinstance(kind, BathymetryGrid)
            else 2 * kind.width if isinstance(kind, Scour)
            else kind.wavelength / 2
            for kind in self.components
            if not isinstance(kind, Ripples) or kind.wavenumber < self.cutoff.wavenumber
        ]  # fmt: skip
        return min(waves, default=self.cutoff.wavelength)

    @property
    def is_waves(self) -> bool:
        """True: the relief consists of waves, whose heights have a spectrum: no survey, no scour."""
        return all(isinstance(kind, PowerLaw | Ripples) for kind in self.components)

    def residual_spectrum(self, wavenumber: ArrayLike) -> Floats:
        """Spectrum of the fractal roughness that the terrain leaves to the scattering law [m^4].

        Args:
            wavenumber: Magnitude [rad/m], any shape.

        Returns:
            Spectrum of the relief, less the share that the terrain has of it; shape of the wavenumbers. Ripples below
            the split are lines, not a spectrum: they count in `residual_rms` only.
        """
        K = require_numbers("wavenumber", wavenumber, "rad/m", 0.0)
        left = np.zeros(K.shape)
        for kind in self.components:
            if isinstance(kind, PowerLaw):
                left += kind.spectrum(K) * (1 - kind.resolved_fraction(K, self.cutoff))
        return left

    @property
    def residual_rms(self) -> float:
        """Root mean square height of all that is finer than the terrain [m].

        It is what the coherent reflection of a facet loses by, exp(-2 k^2 h^2 sin^2). Where the mirror is
        not as large as the split's wavelength, take the band from its own wavenumber: `roughness_rms`.
        """
        # The cut is an octave wide: below and above it the integral is known.
        K = np.geomspace(self.cutoff.wavenumber / 100, 100 * self.cutoff.wavenumber, 2000)
        cut = np.trapezoid(2 * np.pi * K**2 * self.residual_spectrum(K), np.log(K))
        return float(np.hypot(np.sqrt(cut + self._unresolved_ripples()), self._fractal_rms(K[-1], np.inf)))

    def roughness_rms(self, low: float, high: float) -> float:
        """Root mean square height [m] between two wavenumbers [rad/m], resolved or not.

        It is the roughness that a mirror as large as 2 pi / low sees at an acoustic wavenumber `high`.
        """
        ripples = sum(kind.variance for kind in self._ripples() if low <= kind.wavenumber < high)
        return float(np.hypot(self._fractal_rms(low, high), np.sqrt(ripples)))

    def band_variance(self, low: Floats, high: float) -> Floats:
        """Mean square height of the relief, resolved or not, between wavenumbers [m^2].

        Args:
            low: Smaller wavenumbers [rad/m], any shape.
            high: Larger one [rad/m].
        """
        total = np.zeros(np.shape(low))
        for kind in self.components:
            if isinstance(kind, PowerLaw):
                whole, rest = (kind.variance_beyond(bound) for bound in (np.minimum(low, high), np.array(high)))
                total += whole - rest
            elif isinstance(kind, Ripples):
                total += np.where((low <= kind.wavenumber) & (kind.wavenumber < high), kind.variance, 0.0)
        return total

    def _ripples(self) -> tuple[Ripples, ...]:
        return tuple(kind for kind in self.components if isinstance(kind, Ripples))

    def _unresolved_ripples(self) -> float:
        """Mean square height of the ripples that are not ground [m^2]."""
        return sum(kind.variance for kind in self._ripples() if kind.wavenumber >= self.cutoff.wavenumber)

    def _fractal_rms(self, low: float, high: float) -> float:
        return float(np.sqrt(sum(k.band_variance(low, high) for k in self.components if isinstance(k, PowerLaw))))


def build_terrain(
    components: Sequence[Kind], *, seed: int, cutoff: RoughnessCutoff | None = None,
    scatterer_grid: ScattererGrid | None = None, mean_depth: float = 0.0,
) -> CompositeRelief:  # fmt: skip
    """The terrain that some reliefs make together.

    Args:
        components: Fractal reliefs and ripples, added; none of them for a flat seabed.
        seed: Seed of the scene, 0 to 2^64 - 1 [1].
        cutoff: Where ground ends and roughness begins; the default `RoughnessCutoff` if None.
        scatterer_grid: Frame in which everything is drawn; the world's if None.
        mean_depth: Depth of the plane from which the heights of a grid are counted [m].

    Returns:
        Terrain without end: any point can be evaluated at any time, in any order, bit-identically.
    """
    cutoff, scatterer_grid = cutoff or RoughnessCutoff(), scatterer_grid or ScattererGrid()
    parts: list[Relief] = []
    for row, kind in enumerate(components):
        layer = row * _LAYERS
        if isinstance(kind, PowerLaw):
            parts.append(kind.build_relief(seed=seed, layer=layer, cutoff=cutoff))
        elif isinstance(kind, BathymetryGrid):
            parts.append(kind.build_relief(cutoff=cutoff, mean_depth=mean_depth))
        elif isinstance(kind, Scour):
            parts.append(kind.build_relief(scatterer_grid))
        elif not isinstance(kind, Ripples):
            raise ValueError(f"kinds has {kind!r}; give reliefs, such as [PowerLaw(hurst=0.6, rms=0.05), Ripples()]")
        else:
            field = kind.build_relief(seed=seed, layer=layer, cutoff=cutoff, heading=scatterer_grid.heading)
            parts.extend([field] if field is not None else [])
    return CompositeRelief(ReliefSum(tuple(parts), scatterer_grid), tuple(components), cutoff)
