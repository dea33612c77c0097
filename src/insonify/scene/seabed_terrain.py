"""The seabed as it lies: how deep at a position, how steep, and how smooth to sound that bounces off it.

Depth is that of the mean plane less the height of the terrain. Results are cached: positions that belong to the
lattice come back in every ping.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scene.heightmap_cache import CELLS, HeightmapCache, HeightmapTiles
from insonify.scene.heightmap_synthesis import HeightmapSynthesizer
from insonify.scene.scatterer_terrain_cache import ScattererTerrainCache
from insonify.scene.terrain.composite_relief import CompositeRelief

Floats = NDArray[np.float64]
Places = Callable[[NDArray[np.int64], NDArray[np.int64]], tuple[Floats, Floats]]

TILE_CELLS = CELLS
"""Cells along the side of one piece of the map."""
CELLS_PER_WAVELENGTH = 8
"""Cells of the map along the shortest wave of the terrain."""
MIN_CELL_SIZE = 0.02
"""Smallest cell of the map [m]: ground finer than four of them tilts facets, but throws no shadows."""
MAX_CELL_SIZE = 0.5
"""Largest [m]: edges of shadows are no sharper."""
_MAX_CACHE_BYTES = 192 << 20  # bytes of points


@dataclass(frozen=True, eq=False)
class SeabedTerrain:
    """The relief of one seabed under one seed."""

    depth: float
    """Of the mean plane, from which heights are counted [m]."""
    relief: CompositeRelief
    """Heights above that plane, and what they leave to the scattering law."""
    _points: dict[int, ScattererTerrainCache] = field(default_factory=dict, repr=False)
    _pages: HeightmapCache = field(default_factory=HeightmapCache, repr=False)

    @cached_property
    def span(self) -> tuple[float, float]:
        """Shallowest and deepest ground [m]."""
        low, high = self.relief.span
        return self.depth - high, self.depth - low

    def depth_at(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Depth of the terrain [m] at positions [m], broadcast shape; NaN where it is unknown."""
        return np.asarray(self.depth - self.relief.height(north, east))

    def sample_tiles(
        self, seed: int, key: NDArray[np.int64], size: NDArray[np.int64], positions: Places
    ) -> tuple[Floats, NDArray[np.int64]]:
        """Ground at points of tiles that come again under the same keys.

        Args:
            seed: Under which they were drawn.
            key: Names of the tiles, each once, shape (tiles,); the same key must mean the same points.
            size: How many of its points are wanted of each, the first of them, shape (tiles,).
            positions: Gives the grid coordinates [m] of the points of some tiles, one after the other: given which
                tiles, and which of their points is the first that is wanted.

        Returns:
            Height [m] and gradient to the north and the east [1] of points, shape (any, 3), and where among them each
            tile begins, shape (tiles,).
        """
        terrain = self.relief.resolved

        def made(rows: NDArray[np.int64], known: NDArray[np.int64]) -> Floats:
            return terrain.gradient_rows_in_world(terrain.sample_in_grid_axes(*positions(rows, known)))

        held = self._points.get(seed) or self._points.setdefault(seed, ScattererTerrainCache(_MAX_CACHE_BYTES))
        return held.rows_of(key, size, made)

    @cached_property
    def heightmap_cell_size(self) -> float:
        """Side of a cell of the map [m]."""
        return float(np.clip(self.relief.shortest_wavelength / CELLS_PER_WAVELENGTH, MIN_CELL_SIZE, MAX_CELL_SIZE))

    @cached_property
    def heightmap_synthesizer(self) -> HeightmapSynthesizer:
        """Synthesiser of the map that kernels read."""
        return HeightmapSynthesizer(self.relief.resolved, self.heightmap_cell_size)

    def read_heightmap(self, own: Floats, evaluate: Callable[[HeightmapTiles, NDArray[np.bool_]], bool]) -> None:
        """Let a kernel read the map until it has all the pieces that it comes to.

        Args:
            own: Places on the lattice about which it is likely to read [m], shape (n, 2).
            evaluate: See `HeightmapCache.serve_kernel`.
        """
        self._pages.serve_kernel(
            self.heightmap_cell_size, own.min(axis=0), own.max(axis=0), self.heightmap_synthesizer.heights, evaluate
        )

    def roughness_reflection_factor(
        self, sine: Floats, wavelength: float, fresnel_length: Floats, *,
        residual_variance: Floats | float | None = None,
    ) -> Floats:  # fmt: skip
        """Factor of roughness on the coherent sound of one bounce, exp(-2 k^2 h^2 sin^2) [1].

        Args:
            sine: Sine of the grazing angle at the mean plane [1], any shape.
            wavelength: Of the sound [m].
            fresnel_length: Length of the Fresnel zone on the seabed [m], shape of `sine`.
            residual_variance: Mean square of the resolved ground about the plane fitted to it in the zone [m^2], shape
                of `sine`.

        Returns:
            Pressure ratio [1]. h is the rms height of all waves of the relief, on either side of the split, between
            the zone's length and the sound's: longer ones tilt the mirror; shorter ones do not disturb it. Of ground
            that is no sum of waves, such as a surveyed grid, `residual_variance` takes the place of the resolved ones;
            without it such ground has no share.

        Source: Rayleigh's roughness as in APL-UW TR 9407 (1994); the band so that no wave counts twice.
        """
        k = 2 * np.pi / wavelength
        low = np.minimum(2 * np.pi / fresnel_length, k)
        if residual_variance is not None and not self.relief.is_waves:
            below = self.relief.band_variance(np.clip(self.relief.cutoff.wavenumber, low, k), k)
            return np.asarray(np.exp(-2 * k**2 * (below + residual_variance) * sine**2))
        return np.asarray(np.exp(-2 * k**2 * self.relief.band_variance(low, k) * sine**2))
