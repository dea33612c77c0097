"""Depth, gradient and coherent reflection loss of the resolved terrain of a seabed.

Depth is that of the mean plane less the height of the terrain. Nodes are cached, since they
recur in every ping.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scene.heightmap_cache import CELLS, HeightmapCache, HeightmapTiles
from insonify.scene.heightmap_synthesis import HeightmapSynthesizer
from insonify.scene.terrain.composite_relief import CompositeRelief
from insonify.scene.terrain_lattice import TerrainLattice

Floats = NDArray[np.float64]

TILE_CELLS = CELLS
"""Number of cells along the side of one tile of the map."""
CELLS_PER_WAVELENGTH = 8
"""Number of cells of the map along the shortest wave of the terrain."""
MIN_CELL_SIZE = 0.02
"""Smallest cell of the map [m]: relief finer than four of them tilts facets, but casts no shadows."""
MAX_CELL_SIZE = 0.5
"""Largest cell of the map [m], which limits the sharpness of shadow edges."""


@dataclass(frozen=True, eq=False)
class SeabedTerrain:
    """Terrain of one seabed under one seed, with its caches."""

    depth: float
    """Depth of the mean plane, from which heights are counted [m]."""
    relief: CompositeRelief
    """Heights above that plane, and the roughness left to the scattering law."""
    _heightmap: HeightmapCache = field(default_factory=HeightmapCache, repr=False)

    @cached_property
    def span(self) -> tuple[float, float]:
        """Least and greatest depth of the terrain [m]; `relief.span` has heights."""
        low, high = self.relief.span
        return self.depth - high, self.depth - low

    def depth_at(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Depth of the terrain [m] at positions [m], broadcast shape; NaN where it is unknown."""
        return np.asarray(self.depth - self.relief.height(north, east))

    @cached_property
    def lattice(self) -> TerrainLattice:
        """Lattices of nodes on which specular points are searched."""
        return TerrainLattice(self.depth, self.relief, self.relief.shortest_wavelength)

    @cached_property
    def heightmap_cell_size(self) -> float:
        """Side of a cell of the map [m]."""
        return float(np.clip(self.relief.shortest_wavelength / CELLS_PER_WAVELENGTH, MIN_CELL_SIZE, MAX_CELL_SIZE))

    @cached_property
    def heightmap_synthesizer(self) -> HeightmapSynthesizer:
        """Synthesiser of the map that kernels read."""
        return HeightmapSynthesizer(self.relief.resolved, self.heightmap_cell_size)

    def read_heightmap(self, positions: Floats, evaluate: Callable[[HeightmapTiles, NDArray[np.bool_]], bool]) -> None:
        """Evaluate a kernel on the map of heights, synthesising the tiles that it needs.

        Args:
            positions: Positions in grid coordinates about which the kernel is likely to read [m], shape (n, 2).
            evaluate: Function that evaluates the remaining points, see `HeightmapCache.serve_kernel`.
        """
        self._heightmap.serve_kernel(
            self.heightmap_cell_size,
            positions.min(axis=0),
            positions.max(axis=0),
            self.heightmap_synthesizer.heights,
            evaluate,
        )

    def roughness_reflection_factor(
        self, sine: Floats, wavelength: float, fresnel_length: Floats, *,
        residual_variance: Floats | float | None = None,
    ) -> Floats:  # fmt: skip
        """Factor of roughness on the coherent sound of one bounce, exp(-2 k^2 h^2 sin^2) [1].

        Args:
            sine: Sine of the grazing angle at the mean plane [1], any shape.
            wavelength: Acoustic wavelength [m].
            fresnel_length: Length of the Fresnel zone on the seabed [m], shape of `sine`.
            residual_variance: Mean square of the resolved terrain about the plane fitted to it in the zone [m^2],
                shape of `sine`.

        Returns:
            Pressure ratio [1]. h is the rms height of all waves of the relief, on either side of the cutoff, between
            the zone's length and the acoustic wavelength: longer waves tilt the reflecting plane, shorter ones have no
            effect. Of relief without a spectrum, such as a surveyed grid, the resolved part of h^2 is
            `residual_variance`; without that argument it is 0.

        Source: Rayleigh roughness factor as in APL-UW TR 9407 (1994); the band is chosen so that no wave counts twice.
        """
        k = 2 * np.pi / wavelength
        low = np.minimum(2 * np.pi / fresnel_length, k)
        if residual_variance is not None and not self.relief.is_waves:
            below = self.relief.band_variance(np.clip(self.relief.cutoff.wavenumber, low, k), k)
            return np.asarray(np.exp(-2 * k**2 * (below + residual_variance) * sine**2))
        return np.asarray(np.exp(-2 * k**2 * self.relief.band_variance(low, k) * sine**2))
