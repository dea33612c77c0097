"""Even points of a boundary for the expected intensity: rings of slant range, sectors of azimuth, about the sonar.

An expectation needs no scatterers, only a quadrature over the ground. Cells of equal slant range and azimuth follow
what a sonar resolves; in each the point is shifted by the golden ratio times the number of the cell across, so that
any strip along or across the beam meets its points at even distances. Four points a cell then give what hundreds
thrown at random do.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.sampling import Resolution, beam_bound
from insonify.propagation.rays import Rays, Reach
from insonify.scene.scatterers import even_place
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]

GOLDEN = 0.6180339887498949
TILE = 32
"""Rings of a tile."""
ACROSS = 4
"""Sectors of a tile: few, for most tiles that a narrow beam is near lie beside it."""
TILES_PER_BLOCK = 32
"""Tiles that are drawn together."""
WIDEST_CELL = 0.02
"""A cell is never wider than this, however wide the beam, so that shadows keep their edges [rad]."""


class Rings:
    """The cells about one stance on one flat boundary."""

    def __init__(
        self, stance: Stance, depth: float, reach: Reach, resolution: Resolution, *, rise: float = 0.0
    ) -> None:
        """Lay out the cells.

        Args:
            stance: The sonar.
            depth: Depth of the boundary [m].
            reach: Distances heard in the window.
            resolution: What the sonar can tell apart.
            rise: How far the boundary may stand above or lie below its depth [m].
        """
        self.stance, self.depth, self.height, self.rise = stance, depth, reach.height, rise
        across = np.sqrt(resolution.per_cell)
        self.slant = resolution.slant / across
        sectors = np.ceil(2 * np.pi * across / min(resolution.width, WIDEST_CELL) / TILE) * TILE
        self.azimuth = 2 * np.pi / float(sectors)
        first = int(np.hypot(reach.nearest, reach.height) / self.slant) // TILE
        last = int(np.hypot(reach.farthest, reach.height) / self.slant) // TILE
        rows, columns = np.mgrid[first : last + 1, 0 : int(sectors) // ACROSS]
        self.tiles = np.stack([rows.ravel(), columns.ravel()], axis=-1)

    def in_view(self, rays: Rays, families: tuple[str, ...], floor: float) -> NDArray[np.int64]:
        """Tiles that the two-way beam reaches above a floor [1], rows of (ring, sector), shape (n, 2)."""

        def seen(tiles: NDArray[np.int64], across: int) -> NDArray[np.int64]:
            ring, sector = tiles.T
            near, far = (self._ground((ring + side) * TILE * self.slant) for side in (0, 1))
            middle, width = (near + far) / 2, across * self.azimuth
            centre = self._place(middle, (sector + 0.5) * width)
            half_diagonal = np.hypot((far - near) / 2, far * width / 2)
            bound = beam_bound(centre, half_diagonal, self.stance, self.depth, rays, families, rise=self.rise)
            return np.asarray(tiles[(bound >= floor) & (far > 0)])

        beside = TILE // ACROSS
        wide = seen(self.tiles[self.tiles[:, 1] % beside == 0] // (1, beside), TILE)
        strips = np.stack([np.repeat(wide[:, 0], beside), (wide[:, 1, None] * beside + np.arange(beside)).ravel()], -1)
        return seen(strips, ACROSS)

    def points(self, tiles: NDArray[np.int64]) -> tuple[Floats, Floats, NDArray[np.uint64]]:
        """North and east [m] (n, 2), area [m^2] and key of the cells of some tiles, but none above the boundary."""
        out, across = np.arange(TILE)[:, None], np.arange(ACROSS)
        ring = (tiles[:, 0, None, None] * TILE + out + 0 * across).ravel()
        sector = (tiles[:, 1, None, None] * ACROSS + 0 * out + across).ravel()
        inner, outer = (np.maximum((ring + side) * self.slant, self.height) for side in (0, 1))
        there = outer > inner
        ring, sector, inner, outer = ring[there], sector[there], inner[there], outer[there]
        slant = inner + (outer - inner) * np.mod((sector + 0.5) * GOLDEN, 1)
        azimuth = (sector + np.mod((ring + 0.5) * GOLDEN, 1)) * self.azimuth
        area = (outer**2 - inner**2) / 2 * self.azimuth
        return self._place(self._ground(slant), azimuth), area, even_place(ring, sector)

    def _ground(self, slant: Floats) -> Floats:
        """Horizontal distance at a slant range [m]."""
        return np.asarray(np.sqrt(np.maximum(slant**2 - self.height**2, 0.0)))

    def _place(self, distance: Floats, azimuth: Floats) -> Floats:
        """North and east [m], azimuth counted from half a turn off boresight, where no seam matters."""
        bearing = np.arctan2(self.stance.boresight[1], self.stance.boresight[0]) + np.pi + azimuth
        offset = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1) * distance[..., None]
        return np.asarray(self.stance.middle + offset)
