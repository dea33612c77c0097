"""Quadrature points of a boundary for the expected intensity: rings of slant range, sectors of azimuth.

An expectation needs no random scatterers, only a quadrature over the seabed. Cells of equal slant range and azimuth
follow the sonar's resolution. In each, the point is shifted by the golden ratio times the number of the cell across, so
that points are evenly spaced along any strip along or across the beam. Four points a cell then give the accuracy of
hundreds of random points.

Where the gain is low, few of the points are kept, with larger areas: those of the lowest priorities, which are evenly
spread too, so that mean and evenness are preserved.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _polar_grid_kernel as kernel
from insonify.engines.beam_importance import BeamImportance
from insonify.engines.face_images import FaceImage
from insonify.engines.glint_spread import GlintSpread
from insonify.engines.resolution import Resolution, two_way_gain_bound
from insonify.engines.target_shadows import ShadowSector
from insonify.propagation.propagation_model import PropagationModel, ReachableRange
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

GOLDEN = kernel.GOLDEN
RINGS_PER_TILE = 32
"""Number of rings of a tile."""
SECTORS_PER_TILE = 4
"""Number of sectors of a tile: few, because a narrow beam covers only a part of a wide tile."""
PIECES_PER_TILE = 4
"""Number of pieces into which the rings of a tile are divided; a piece has one keep probability in each sector."""
STRIP_BIT = 59
"""First bit of a key that holds the number of strips per cell, less one."""
GAIN_MARGIN = 3.5
"""Factor on the gain that determines keep probabilities, more than for random scatterers [1]."""
SPARSE_GAIN_MARGIN = 1.0
"""Gain margin of sparse points [1]."""
NARROW_CELL = 1.5
"""Cells are left out where the horizontal distance, re the slant range, is less than one over this [1]."""
MIN_WIDTH_FRACTION = 0.1
"""Least fraction of the narrow cells right below the sonar that is kept [1]."""
MAX_CELL_WIDTH = 0.02
"""A cell is never wider than this, however wide the beam, so that shadows keep their edges [rad]."""


class PolarGrid:
    """Cells of equal slant range and azimuth about the sonar of one ping, on one flat boundary."""

    def __init__(
        self, ping_geometry: PingGeometry, depth: float, window_range: ReachableRange, resolution: Resolution, *,
        rise: float = 0.0,
    ) -> None:  # fmt: skip
        """Set the sizes of the cells, and the tiles in reach.

        Args:
            ping_geometry: The sonar.
            depth: Depth of the boundary [m].
            window_range: Distances received in the window.
            resolution: Resolution cells of the sonar.
            rise: Largest height of the boundary above or below its depth [m].
        """
        self.ping_geometry, self.depth, self.rise = ping_geometry, depth, rise
        self.height = window_range.vertical_distance
        # sparse: rings as far apart as a pulse is long cause no ripple, and rings a little closer do
        root = float(np.sqrt(resolution.scatterers_per_cell))
        along, across = (1.0, resolution.scatterers_per_cell) if resolution.sparse else (root, root)
        self.gain_margin = SPARSE_GAIN_MARGIN if resolution.sparse else GAIN_MARGIN
        self.slant: float = resolution.slant_resolution / along
        # below the sonar the gain is the largest in all sectors: sparse points there would all be kept
        self.nearest_gain = window_range.vertical_distance + self.slant / 2 if resolution.sparse else 0.0
        sectors = (
            np.ceil(2 * np.pi * across / min(resolution.beam_width, MAX_CELL_WIDTH) / RINGS_PER_TILE) * RINGS_PER_TILE
        )
        self.azimuth = 2 * np.pi / float(sectors)
        first = int(np.hypot(window_range.nearest, window_range.vertical_distance) / self.slant) // RINGS_PER_TILE
        last = int(np.hypot(window_range.farthest, window_range.vertical_distance) / self.slant) // RINGS_PER_TILE
        self.rows = first, last
        rows, columns = np.mgrid[first : last + 1, 0 : int(sectors) // SECTORS_PER_TILE]
        self.tiles = np.stack([rows.ravel(), columns.ravel()], axis=-1)

    def tiles_above_floor(
        self, rays: PropagationModel, families: tuple[str, ...], floor: float, glints: GlintSpread | None = None,
        images: tuple[FaceImage, ...] = (),
    ) -> NDArray[np.int64]:  # fmt: skip
        """Tiles in which the two-way pressure gain may exceed a floor, rows of (ring, sector), shape (n, 2).

        Args:
            rays: Propagation model of the scene.
            families: Families that reach the boundary.
            floor: Two-way pressure gain [1].
            glints: Spread of the directions of legs by a moving surface; None: it does not move.
            images: Images of the sonar in faces.
        """

        def within_beams(tiles: NDArray[np.int64], across: int) -> NDArray[np.int64]:
            ring, sector = tiles.T
            near, far = (self._horizontal_distance((ring + side) * RINGS_PER_TILE * self.slant) for side in (0, 1))
            middle, width = (near + far) / 2, across * self.azimuth
            centre = self._position(middle, (sector + 0.5) * width)
            half_diagonal = np.hypot((far - near) / 2, far * width / 2)
            bound = two_way_gain_bound(
                centre, half_diagonal, self.ping_geometry, self.depth, rays, families, rise=self.rise, glints=glints,
                images=images,
            )  # fmt: skip
            return np.asarray(tiles[(bound >= floor) & (far > 0)])

        factor = RINGS_PER_TILE // SECTORS_PER_TILE
        wide_tiles = within_beams(self.tiles[self.tiles[:, 1] % factor == 0] // (1, factor), RINGS_PER_TILE)
        strip_sectors = (wide_tiles[:, 1, None] * factor + np.arange(factor)).ravel()
        strips = np.stack([np.repeat(wide_tiles[:, 0], factor), strip_sectors], -1)
        return within_beams(strips, SECTORS_PER_TILE)

    def gains(self, tiles: NDArray[np.int64], beam_importance: BeamImportance) -> Floats:
        """Gain in the pieces of some tiles, as `BeamImportance.gain_at` with a margin; larger of both ends of a piece.

        Shape (tiles, PIECES_PER_TILE, SECTORS_PER_TILE) [1].

        Args:
            tiles: Rows of (ring, sector), shape (tiles, 2).
            beam_importance: Two-way gain on the boundary.
        """
        position = np.empty((len(tiles) * (PIECES_PER_TILE + 1) * SECTORS_PER_TILE, 2))
        kernel.piece_edges(
            tiles, (RINGS_PER_TILE, PIECES_PER_TILE, SECTORS_PER_TILE), self.slant, self.height, self.nearest_gain,
            self.azimuth, self._origin, position,
        )  # fmt: skip
        gain = beam_importance.gain_at(position).reshape(-1, PIECES_PER_TILE + 1, SECTORS_PER_TILE)
        return np.asarray(self.gain_margin * np.maximum(gain[:, 1:], gain[:, :-1]))

    def keep_probabilities(
        self, tiles: NDArray[np.int64], gain: Floats, beam_importance: BeamImportance, gain_factor: Floats | None = None
    ) -> Floats:
        """Keep probability of the cells of some tiles [1], shape (tiles, PIECES_PER_TILE, SECTORS_PER_TILE).

        Args:
            tiles: Rows of (ring, sector), shape (tiles, 2).
            gain: From `gains`.
            beam_importance: Two-way gain on the boundary.
            gain_factor: Factor on the gain in each piece of each row of tiles [1], shape (rows, PIECES_PER_TILE);
                None: 1.
        """
        if gain_factor is not None:
            gain = gain * gain_factor[tiles[:, 0] - self.rows[0]][..., None]
        return beam_importance.keep_probability_of(gain) * (
            self._width_fraction(tiles) if beam_importance.importance_sampling else 1.0
        )

    def _width_fraction(self, tiles: NDArray[np.int64]) -> Floats:
        """Width of cells re that of a beam, the same below the sonar as abeam [1], (tiles, PIECES_PER_TILE, 1)."""
        outer = (tiles[:, :1] * PIECES_PER_TILE + np.arange(1, PIECES_PER_TILE + 1)) * (
            RINGS_PER_TILE / PIECES_PER_TILE * self.slant
        )
        return np.asarray(
            np.clip(NARROW_CELL * self._horizontal_distance(outer) / np.maximum(outer, 1e-9), MIN_WIDTH_FRACTION, 1.0)
        )[..., None]

    def in_zone(self, tiles: NDArray[np.int64], zone: ShadowSector, margin: float) -> NDArray[np.bool_]:
        """True for tiles that overlap a target's shadow sector or the margin about it, shape (tiles,).

        Args:
            tiles: Rows of (ring, sector), shape (tiles, 2).
            zone: Shadow sector of the target about the sonar.
            margin: Margin of bearing on either side of it [rad].
        """
        near, far = (self._horizontal_distance((tiles[:, 0] + side) * RINGS_PER_TILE * self.slant) for side in (0, 1))
        width = SECTORS_PER_TILE * self.azimuth
        bearing_offset = np.mod(self._origin[2] + (tiles[:, 1] + 0.5) * width - zone.bearing + np.pi, 2 * np.pi) - np.pi
        is_in_sector = np.abs(bearing_offset) < zone.half_width + margin + width / 2
        return np.asarray((far > zone.near) & (near < zone.far) & is_in_sector)

    def points(
        self, tiles: NDArray[np.int64], keep_probability: Floats | None = None, strips: int = 1
    ) -> tuple[Floats, Floats, NDArray[np.uint64]]:
        """North and east [m] (n, 2), area [m^2] and key of the points of some tiles, but none above the boundary.

        Args:
            tiles: Rows of (ring, sector), shape (tiles, 2).
            keep_probability: Result of `keep_probabilities`; None: all points are kept.
            strips: Number of narrower cells into which each cell is divided across.
        """
        keep = np.ones((len(tiles), 1, SECTORS_PER_TILE)) if keep_probability is None else keep_probability
        keep, count = (
            np.repeat(keep, strips, axis=2), len(tiles) * RINGS_PER_TILE * SECTORS_PER_TILE * strips,
        )  # fmt: skip
        position, area, key = np.empty((count, 2)), np.empty(count), np.empty(count, np.uint64)
        across = self.azimuth / strips
        n = kernel.kept_points(
            tiles, keep, RINGS_PER_TILE, self.slant, self.height, across, self._origin, position, area,
            key,
        )  # fmt: skip
        return position[:n], area[:n], key[:n] + np.uint64(strips - 1 << STRIP_BIT)

    @property
    def _origin(self) -> tuple[float, float, float]:
        """North and east of the sonar [m], and the bearing of the first sector [rad].

        That is half a turn off boresight, where no seam matters.
        """
        north, east = self.ping_geometry.midpoint
        return (
            float(north),
            float(east),
            float(np.arctan2(self.ping_geometry.boresight[1], self.ping_geometry.boresight[0]) + np.pi),
        )

    def _horizontal_distance(self, slant: NDArray[np.floating[Any]]) -> Floats:
        """Horizontal distance at a slant range [m]."""
        return np.asarray(np.sqrt(np.maximum(slant**2 - self.height**2, 0.0)))

    def _position(self, distance: Floats, azimuth: Floats) -> Floats:
        """North and east of positions at a horizontal distance [m] and an azimuth re the first sector [rad]: [m]."""
        north, east, first = self._origin
        offset = np.stack([np.cos(first + azimuth), np.sin(first + azimuth)], axis=-1) * distance[..., None]
        return np.asarray(np.array([north, east]) + offset)
