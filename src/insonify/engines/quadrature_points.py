"""Quadrature points of a boundary for one ping: selection of the polar grid's points by gain, and their positions.

Points keep their positions about the sonar from ping to ping, as long as its depth and attitude do not change: they are
computed about the origin, cached, and moved along. The cache depends on its key alone, so results are bit-identical.

The keep probability follows the two-way gain re the largest gain at the same distance. Where a target stands in the
direction of largest gain, its shadow leaves only low gains: at the ranges of its shadow the points are kept as if the
beams were `SHADOW_GAIN_FACTOR` stronger.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import polar_grid
from insonify.engines.beam_importance import BeamImportance
from insonify.engines.face_images import FaceImage
from insonify.engines.glint_spread import glint_spread
from insonify.engines.resolution import Resolution
from insonify.engines.target_shadows import shadow_sector
from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.propagation.propagation_model import PropagationModel, ReachableRange
from insonify.recent_results import RecentResults
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scene import Scene
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
Columns = tuple[Floats, Floats, NDArray[np.uint64]]
"""North and east [m], (n, 2); area that each point represents [m^2], (n,); scatterer id, (n,)."""

SHADOW_GAIN_FACTOR = 16.0
"""Factor on the gain at the ranges of the shadow of a target in the direction of largest gain [1]."""
EDGE_STRIPS = 16
"""Number of strips into which cells are divided across, in and about shadows of targets."""
SOFT_EDGE_STRIPS = 8
"""Number of strips on a flat seabed with diffraction at edges, where the field has no step."""
SPARSE_EDGE_STRIPS = 4
"""Number of strips for sparse points."""
EDGE_WIDTHS = 1.0
"""Margin of bearing on either side of such a shadow, re the width of the two-way beam [1]."""
MIN_SHADOWED_GAIN = 0.2
"""`BeamImportance.gain_at` a target above which cells in and about its shadow are divided [1]."""
MAX_CACHED_POINTS = 250_000
"""Number of points of one layout up to which they are cached for the next ping."""
MAX_CACHED_LAYOUTS = 8
"""Number of layouts (attitudes, depths and sides of the sonar) whose points are cached."""
RINGS_PER_PIECE = polar_grid.RINGS_PER_TILE / polar_grid.PIECES_PER_TILE
"""Number of rings of a piece."""
POSITION_DECIMALS = 9
"""Decimals of the positions of both ends re their middle [m], so that all pings of a translated sonar share a key."""


@dataclass(frozen=True)
class QuadratureLayout:
    """Quadrature points about one attitude of the sonar, at the origin."""

    cells: polar_grid.PolarGrid
    tiles: NDArray[np.int64]
    beam_importance: BeamImportance
    _kept: dict[tuple[int, int], Columns] = field(default_factory=dict)

    @cached_property
    def gain(self) -> Floats:
        """`PolarGrid.gains` of all tiles [1], shape (tiles, PIECES_PER_TILE, SECTORS_PER_TILE)."""
        return self.cells.gains(self.tiles, self.beam_importance)

    @cached_property
    def keep_probability(self) -> Floats:
        """Keep probability in all tiles without shadows of targets [1], (tiles, PIECES_PER_TILE, SECTORS_PER_TILE)."""
        return self.cells.keep_probabilities(self.tiles, self.gain, self.beam_importance)

    def points(self, keep_probability: Floats, rows: slice) -> Columns:
        """The points of some tiles; those of `keep_probability` are kept for the next ping.

        Args:
            keep_probability: Keep probability of the cells of all tiles [1].
            rows: Rows of the tiles.
        """
        key = rows.start, rows.stop
        if (
            keep_probability is not self.keep_probability
            or self.keep_probability.sum() * RINGS_PER_PIECE > MAX_CACHED_POINTS
        ):
            return self.cells.points(self.tiles[rows], keep_probability[rows])
        if key not in self._kept:
            self._kept[key] = self.cells.points(self.tiles[rows], keep_probability[rows])
        return self._kept[key]


@dataclass(frozen=True, slots=True)
class QuadraturePoints:
    """Quadrature points of one boundary in reach of one ping."""

    scene: Scene
    ping_geometry: PingGeometry
    rays: PropagationModel
    depth: float
    """Depth of the boundary [m]."""
    families: tuple[str, ...]
    """Families that reach it."""
    window_range: ReachableRange
    """Distances received in the window."""
    resolution: Resolution
    rise: float
    """Largest deviation of the boundary from its mean depth [m]."""
    floor: float
    """Two-way pressure gain below which tiles are left out [1]."""
    importance_sampling: bool
    """True: of points of low gain only some are kept, with larger areas."""
    layouts: RecentResults[QuadratureLayout]
    soft: bool = True
    """True: sound is diffracted at the edges of targets."""
    images: tuple[FaceImage, ...] = ()
    """Images of the sonar in faces."""

    def blocks(self, cut: Callable[[Floats], list[slice]]) -> list[Callable[[], Columns]]:
        """Blocks of the points, computed when they are called.

        Args:
            cut: Function that divides tiles into blocks, given the expected number of points of each.
        """
        layout, middle = self.layouts.get(self._key, self._layout), self.ping_geometry.midpoint
        gain_factor = self._shadow_gain_factor(layout)
        keep_probability = (
            layout.keep_probability
            if gain_factor is None
            else layout.cells.keep_probabilities(layout.tiles, layout.gain, layout.beam_importance, gain_factor)
        )

        def points_of_tiles(rows: slice) -> Columns:
            position, area, key = layout.points(keep_probability, rows)
            return position + middle, area, key

        shaded = self._tiles_near_shadows(layout)
        if not shaded.any():
            return [partial(points_of_tiles, rows) for rows in cut(keep_probability.sum(axis=(1, 2)) * RINGS_PER_PIECE)]

        def cells_of(tiles: NDArray[np.int64], strips: int) -> Columns:
            position, area, key = layout.cells.points(layout.tiles[tiles], keep_probability[tiles], strips)
            return position + middle, area, key

        blocks: list[Callable[[], Columns]] = []
        fine = SOFT_EDGE_STRIPS if self.soft and self.rise == 0 else EDGE_STRIPS
        fine = SPARSE_EDGE_STRIPS if self.resolution.sparse else fine
        for tiles, strips in ((np.flatnonzero(~shaded), 1), (np.flatnonzero(shaded), fine)):
            count = keep_probability[tiles].sum(axis=(1, 2)) * RINGS_PER_PIECE * strips
            blocks += [partial(cells_of, tiles[rows], strips) for rows in cut(count)]
        return blocks

    def _tiles_near_shadows(self, layout: QuadratureLayout) -> NDArray[np.bool_]:
        """True for tiles in and about shadows of targets that the beams reach, see `MIN_SHADOWED_GAIN`, (tiles,)."""
        shaded, cylinders, soft = np.zeros(len(layout.tiles), bool), bounding_cylinders(self.scene), self.soft
        if not len(cylinders) or self.depth <= 0:
            return shaded
        offset = cylinders[:, :2] - self.ping_geometry.midpoint
        faced = np.flatnonzero(layout.beam_importance.gain_at(offset, cylinders[:, 2]) >= MIN_SHADOWED_GAIN)
        for row in faced:
            targets = self.scene, self.rays, self.ping_geometry, self.families, int(row), self.window_range.farthest
            zone = shadow_sector(*targets, soft=soft)
            shaded |= layout.cells.in_zone(layout.tiles, zone, EDGE_WIDTHS * self.resolution.beam_width)
        return shaded

    @property
    def _at_origin(self) -> PingGeometry:
        """The sonar, at the origin."""
        north, east = self.ping_geometry.midpoint
        ends = (self.ping_geometry.transmit_position, self.ping_geometry.receive_position)
        out, back = (np.round(position - [north, east, 0.0], POSITION_DECIMALS) for position in ends)
        return replace(self.ping_geometry, transmit_position=out, receive_position=back)

    @property
    def _key(self) -> Any:
        """Key of a layout: all that it depends on, except what is constant in a scenario."""
        geometry = self._at_origin
        beams = (self.ping_geometry.transmit_beams, self.ping_geometry.bounding_receive_beams)
        return (
            self.depth, self.families, self.window_range, self.resolution, self.rise, self.floor,
            self.importance_sampling,
            geometry.transmit_position.tobytes(), geometry.receive_position.tobytes(), geometry.boresight.tobytes(),
            geometry.first_beam_bearing,
            *(part.tobytes() for beam in beams for part in (beam.axes, beam.steer, beam.scale)), geometry.channel_count,
            *(part for face_image in self.images for part in face_image.about(self.ping_geometry.midpoint).key),
        )  # fmt: skip

    def _layout(self) -> QuadratureLayout:
        """Layout of the points, without the cache."""
        geometry, scatterer_grid = self._at_origin, ScattererGrid()
        cells = polar_grid.PolarGrid(geometry, self.depth, self.window_range, self.resolution, rise=self.rise)
        glints = glint_spread(self.scene, geometry.frequency)
        images = tuple(face_image.about(self.ping_geometry.midpoint) for face_image in self.images)
        tiles = cells.tiles_above_floor(self.rays, self.families, self.floor, glints, images)
        farthest = max(self.window_range.farthest, 1.0)
        beam_importance = BeamImportance(
            geometry, self.depth, self.rays, self.families, scatterer_grid, farthest, self.importance_sampling, glints,
            images,
        )  # fmt: skip
        return QuadratureLayout(cells, tiles, beam_importance)

    def _shadow_gain_factor(self, layout: QuadratureLayout) -> Floats | None:
        """Factor on the gain in each piece of each row of tiles [1], shape (rows, PIECES_PER_TILE); None: 1."""
        first, last = layout.cells.rows
        gain_factor = np.ones((last + 1 - first, polar_grid.PIECES_PER_TILE))
        circles = bounding_cylinders(self.scene)
        if not len(circles) or not self.importance_sampling:
            return None
        offset = circles[:, :2] - self.ping_geometry.midpoint
        faced = layout.beam_importance.gain_at(offset, circles[:, 2]) >= 1
        edges = (
            (first + np.arange(gain_factor.size + 1) / polar_grid.PIECES_PER_TILE)
            * polar_grid.RINGS_PER_TILE
            * layout.cells.slant
        )
        for (north, east), (_, _, radius, top, base) in zip(offset[faced], circles[faced], strict=True):
            shadow_start, shadow_end = self._shadow(float(np.hypot(north, east)), radius, min(top, base))
            gain_factor.reshape(-1)[(edges[1:] >= shadow_start) & (edges[:-1] <= shadow_end)] = SHADOW_GAIN_FACTOR
        return None if (gain_factor == 1).all() else gain_factor

    def _shadow(self, distance: float, radius: float, top: float) -> tuple[float, float]:
        """Slant ranges of the mean seabed from a target to the end of its shadow [m].

        Args:
            distance: Horizontal distance of the target's axis [m].
            radius: Radius of its bounding cylinder [m].
            top: Depth of its top [m].
        """
        height = self.window_range.vertical_distance
        shallowest = min(self.ping_geometry.transmit_position[2], self.ping_geometry.receive_position[2])
        below = min(top, self.depth) - shallowest
        back = distance + radius
        end = back * height / below if below > 0 else np.inf
        return float(np.hypot(max(distance - radius, 0.0), min(below, height))), float(np.hypot(end, height))
