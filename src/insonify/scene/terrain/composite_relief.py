"""The terrain of a scene: its reliefs, divided at the cutoff wavelength into resolved terrain and roughness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain.bathymetry_grid import BathymetryGrid
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.relief import Relief, ReliefSum, TerrainSample
from insonify.scene.terrain.ripples import Ripples
from insonify.scene.terrain.roughness_cutoff import RoughnessCutoff
from insonify.scene.terrain.scour import Scour

Floats = NDArray[np.float64]
Kind = PowerLaw | Ripples | BathymetryGrid | Scour
_LAYERS = 4  # number of random streams that a relief may use


@dataclass(frozen=True)
class CompositeRelief(Relief):
    """Resolved terrain, and the components from which the variance of the unresolved roughness follows.

    Example:
        >>> terrain = build_terrain([PowerLaw(hurst=0.6, rms="10 cm")], seed=1)
        >>> roughness = terrain.band_variance(terrain.cutoff.wavenumber, np.inf) ** 0.5
        >>> f"{100 * roughness:.1f} cm of wavelengths below {terrain.cutoff.wavelength} m left to the scattering law"
        '1.1 cm of wavelengths below 0.5 m left to the scattering law'
    """

    resolved: ReliefSum
    """Relief of wavelengths above the cutoff."""
    components: tuple[Kind, ...]
    """Reliefs of the scenario, at all wavelengths."""
    cutoff: RoughnessCutoff
    """Cutoff wavelength between resolved terrain and residual roughness."""

    def __repr__(self) -> str:
        kinds = ", ".join(map(repr, self.components)) or "flat"
        return f"CompositeRelief: {kinds}; resolved above {self.cutoff.wavelength:g} m"

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient of the resolved terrain, see `Relief.sample`."""
        return self.resolved.sample(north, east)

    def height(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Height of the resolved terrain, see `Relief.height`."""
        return self.resolved.height(north, east)

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest height of the resolved terrain [m], see `Relief.span`."""
        return self.resolved.span

    @cached_property
    def shortest_wavelength(self) -> float:
        """Shortest wavelength of the resolved terrain [m]; the cutoff wavelength where there is no relief."""
        waves = [
            self.cutoff.wavelength if isinstance(kind, PowerLaw)
            else max(2 * kind.cell, self.cutoff.wavelength) if isinstance(kind, BathymetryGrid)
            else 2 * kind.width if isinstance(kind, Scour)
            else kind.wavelength / 2
            for kind in self.components
            if not isinstance(kind, Ripples) or kind.wavenumber < self.cutoff.wavenumber
        ]  # fmt: skip
        return min(waves, default=self.cutoff.wavelength)

    @cached_property
    def is_waves(self) -> bool:
        """True: all components have a wavenumber spectrum (no bathymetry grid, no scour pit)."""
        return all(isinstance(kind, PowerLaw | Ripples) for kind in self.components)

    def band_variance(self, low: Floats, high: float) -> Floats:
        """Mean square height of the relief, resolved or not, between wavenumbers [m^2].

        Args:
            low: Lower wavenumbers [rad/m], any shape.
            high: Upper wavenumber [rad/m].
        """
        total = np.zeros(np.shape(low))
        for kind in self.components:
            if isinstance(kind, PowerLaw):
                total += kind.variance_beyond(np.minimum(low, high)) - _variance_beyond(kind, high)
            elif isinstance(kind, Ripples):
                total += np.where((low <= kind.wavenumber) & (kind.wavenumber < high), kind.variance, 0.0)
        return total


@lru_cache(maxsize=64)
def _variance_beyond(kind: PowerLaw, wavenumber: float) -> Floats:
    """Mean square height beyond one wavenumber [rad/m], the same in every ping [m^2]."""
    return kind.variance_beyond(np.array(wavenumber))


def build_terrain(
    components: Sequence[Kind], *, seed: int, cutoff: RoughnessCutoff | None = None,
    scatterer_grid: ScattererGrid | None = None, mean_depth: float = 0.0,
) -> CompositeRelief:  # fmt: skip
    """The terrain of the sum of some reliefs.

    Args:
        components: Reliefs, added; empty for a flat seabed.
        seed: Seed of the scene, 0 to 2^64 - 1 [1].
        cutoff: Cutoff wavelength between terrain and roughness; the default `RoughnessCutoff` if None.
        scatterer_grid: Frame in which the reliefs are defined; the scene's origin and north if None.
        mean_depth: Depth of the plane from which the heights of a grid are counted [m].

    Returns:
        Unbounded terrain: any point can be evaluated in any order, bit-identically.

    Example:
        >>> terrain = build_terrain([PowerLaw(hurst=0.6, rms="10 cm", outer_scale="20 m")], seed=1)
        >>> north, east = np.mgrid[0:500:1.0, 0:500:1.0]
        >>> f"rms height {100 * terrain.height(north, east).std():.0f} cm"
        'rms height 10 cm'
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
            raise ValueError(
                f"components has {kind!r}; give reliefs, such as [PowerLaw(hurst=0.6, rms=0.05), Ripples()]"
            )
        else:
            field = kind.build_relief(seed=seed, layer=layer, cutoff=cutoff, heading=scatterer_grid.heading)
            parts.extend([field] if field is not None else [])
    return CompositeRelief(ReliefSum(tuple(parts), scatterer_grid), tuple(components), cutoff)
