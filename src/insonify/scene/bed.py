"""The seabed as it lies: how deep at a place, how steep, and how smooth to sound that bounces off it.

Depth is that of the mean plane less the height of the ground. What was asked is kept: places that belong to the
lattice come back in every ping.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scene.held import Held
from insonify.scene.pages import CELLS, Paged, Pages
from insonify.scene.pen import Pen
from insonify.scene.terrain.ground import Ground
from insonify.scene.terrain.kept import Kept

Floats = NDArray[np.float64]
Places = Callable[[NDArray[np.int64], NDArray[np.int64]], tuple[Floats, Floats]]

MAP_CELLS = CELLS
"""Cells along the side of one piece of the map."""
CELLS_PER_WAVE = 8
"""Cells of the map along the shortest wave of the ground."""
FINEST_CELL = 0.02
"""Smallest cell of the map [m]: ground finer than four of them tilts facets, but throws no shadows."""
WIDEST_CELL = 0.5
"""Largest [m]: edges of shadows are no sharper."""
_MOST_KEPT = 192 << 20  # bytes of points
_MOST_MAPS = 64 << 20  # of single pieces of the map; kernels read pages of their own


@dataclass(frozen=True, eq=False)
class Bed:
    """The relief of one seabed under one seed."""

    depth: float
    """Of the mean plane, from which heights are counted [m]."""
    ground: Ground
    """Heights above that plane, and what they leave to the scattering law."""
    _points: dict[int, Held] = field(default_factory=dict, repr=False)
    _maps: Kept = field(default_factory=lambda: Kept(_MOST_MAPS), repr=False)
    _pages: Paged = field(default_factory=Paged, repr=False)

    @cached_property
    def span(self) -> tuple[float, float]:
        """Shallowest and deepest ground [m]."""
        low, high = self.ground.span
        return self.depth - high, self.depth - low

    def depth_at(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Depth of the ground [m] at places [m], broadcast shape; NaN where nobody knows it."""
        return np.asarray(self.depth - self.ground.height(north, east))

    def survey_points(
        self, seed: int, key: NDArray[np.int64], size: NDArray[np.int64], places: Places
    ) -> tuple[Floats, NDArray[np.int64]]:
        """Ground at points of tiles that come again under the same keys.

        Args:
            seed: Under which they were drawn.
            key: Names of the tiles, each once, shape (tiles,); the same key must mean the same points.
            size: How many of its points are wanted of each, the first of them, shape (tiles,).
            places: Gives the lattice coordinates [m] of the points of some tiles, one after the other: given which
                tiles, and which of their points is the first that is wanted.

        Returns:
            Height [m] and gradient to the north and the east [1] of points, shape (any, 3), and where among them each
            tile begins, shape (tiles,).
        """
        terrain = self.ground.terrain

        def made(rows: NDArray[np.int64], known: NDArray[np.int64]) -> Floats:
            return terrain.rows_in_world(terrain.own_survey(*places(rows, known)))

        held = self._points.get(seed) or self._points.setdefault(seed, Held(_MOST_KEPT))
        return held.rows_of(key, size, made)

    @cached_property
    def map_cell(self) -> float:
        """Side of a cell of the map [m]."""
        return float(np.clip(self.ground.finest / CELLS_PER_WAVE, FINEST_CELL, WIDEST_CELL))

    @cached_property
    def pen(self) -> Pen:
        """What draws the map that kernels read."""
        return Pen(self.ground.terrain, self.map_cell)

    def map_piece(self, along: int, across: int) -> NDArray[np.floating]:
        """Heights on a square of the lattice frame, for shadows [m]; single precision, 10 um at 100 m.

        Args:
            along: Number of the piece along the lattice's first axis [1].
            across: Along its second axis [1].

        Returns:
            Heights on nodes a `map_cell` apart, shape (65, 65): the last row and column are the next piece's first.
        """
        return self._maps.get((along, across), lambda: self._drawn(along, across))

    def _drawn(self, along: int, across: int) -> NDArray[np.floating]:
        """The same, drawn anew."""
        cells = np.arange(MAP_CELLS + 1)
        a, b = ((number * MAP_CELLS + cells) * self.map_cell for number in (along, across))
        return self.ground.terrain.own_survey(a[:, None], b[None, :]).height.astype(np.float32)

    def asked(self, own: Floats, ask: Callable[[Pages, NDArray[np.bool_]], bool]) -> None:
        """Let a kernel read the map until it has all the pieces that it comes to.

        Args:
            own: Places on the lattice about which it is likely to read [m], shape (n, 2).
            ask: As of `Paged.answer`.
        """
        self._pages.answer(self.map_cell, own.min(axis=0), own.max(axis=0), self.pen.heights, ask)

    def smoothness(
        self, sine: Floats, wavelength: float, zone: Floats, *, left: Floats | float | None = None
    ) -> Floats:
        """What roughness leaves of the coherent sound of one bounce, exp(-2 k^2 h^2 sin^2) [1].

        Args:
            sine: Sine of the grazing angle at the mean plane [1], any shape.
            wavelength: Of the sound [m].
            zone: Length of the Fresnel zone on the bed [m], shape of `sine`.
            left: Mean square of the resolved ground about the plane fitted to it in the zone [m^2], shape of `sine`.

        Returns:
            Pressure ratio [1]. h is the rms height of all waves of the relief, on either side of the split, between
            the zone's length and the sound's: longer ones tilt the mirror; shorter ones do not disturb it. Of ground
            that is no sum of waves, such as a surveyed grid, `left` takes the place of the resolved ones; without it
            such ground has no share.

        Source: Rayleigh's roughness as in APL-UW TR 9407 (1994); the band so that no wave counts twice.
        """
        k = 2 * np.pi / wavelength
        low = np.minimum(2 * np.pi / zone, k)
        if left is not None and not self.ground.is_waves:
            below = self.ground.band_variance(np.clip(self.ground.split.wavenumber, low, k), k)
            return np.asarray(np.exp(-2 * k**2 * (below + left) * sine**2))
        return np.asarray(np.exp(-2 * k**2 * self.ground.band_variance(low, k) * sine**2))
