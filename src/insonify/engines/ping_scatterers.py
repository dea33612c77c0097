"""Scatterers in reach of one ping, as blocks that are generated only when they are requested.

The scatterers are those of the whole seabed and surface in three dimensions (or, in a slice, of one line of them under
the beam, each point with its part of the beam's footprint) and of every target. For coherent pressure the points are
random and fixed to the world; for an expectation they are quadrature points, without speckle.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.engines._resolution_kernel import MAX_CELL_LENGTH_RATIO
from insonify.engines.beam_importance import BeamImportance
from insonify.engines.boundary_echoes import boundary_echo_families, transmitter_point
from insonify.engines.engine_caches import EngineCaches
from insonify.engines.face_images import face_images
from insonify.engines.face_reflection import faces_in_reach
from insonify.engines.glint_spread import GlintSpread, glint_spread
from insonify.engines.parts import SCATTERERS_PER_BLOCK, cut_into_blocks
from insonify.engines.quadrature_points import Columns, QuadraturePoints
from insonify.engines.resolution import (
    SPARSE_LIMIT,
    Resolution,
    fill_fraction,
    max_path_length,
    receivable_range,
    tiles_in_view,
    track_sound_speed,
)
from insonify.engines.targets import received_targets, target_points
from insonify.engines.volume import VolumeScatterers
from insonify.propagation.families import families_reaching
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel, ReachableRange
from insonify.recent_results import Identity
from insonify.scene.drawn_tiles import DrawnTiles
from insonify.scene.scatterers import Boundary, Law, Scatterers
from insonify.scene.scene import Scene
from insonify.scene.seabed_scatterers import seabed_scatterers
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.two_way_beam import two_way_footprint, two_way_width
from insonify.units import amplitude_ratio

QUADRATURE_ELONGATION = 2.0
"""Largest side of the square that one quadrature point represents, re the length of a cell on the seabed [1]."""
QUADRATURE_SEED = 0
"""Seed of the positions of quadrature points in their cells: the same for every scenario seed."""

Block = Callable[[], Scatterers]


@dataclass(frozen=True)
class PingScatterers:
    """Scatterers of the scene in reach of one ping."""

    scene: Scene
    path_settings: PathSettings
    seed: int
    ping_geometry: PingGeometry
    rays: PropagationModel
    quadrature: bool
    """True: quadrature points for an expectation. False: random scatterers fixed to the world."""
    caches: EngineCaches = field(default_factory=EngineCaches)
    """Results of the last pings."""

    @cached_property
    def resolution(self) -> Resolution:
        """Resolution cells of the ping."""
        return resolution_of(self.scene, self.path_settings, self.ping_geometry, quadrature=self.quadrature)

    def blocks(self) -> list[Block]:
        """Blocks of every scatterer in reach of this ping, in a fixed order."""
        seabed, surface = self.scene.seabed, self.scene.surface
        blocks: list[Block] = []
        contributions = self.path_settings.contributions
        if "target" in contributions:
            blocks += self._targets()
        if "seabed" in contributions:
            bed_speed = float(self.scene.water.sound_speed_at(seabed.depth))
            bed_law = seabed.law(self.ping_geometry.frequency, bed_speed)
            blocks += [] if bed_law is None else self._boundary("seabed", seabed.depth, bed_law)
        if "surface" in contributions:
            surface_law = surface.law(self.ping_geometry.frequency, float(self.scene.water.sound_speed_at(0.0)))
            blocks += [] if surface_law is None else self._boundary("surface", 0.0, surface_law)
        if "water" in contributions and self.scene.water.scatters:
            suspended = VolumeScatterers(self.scene, self.path_settings, self.seed, self.ping_geometry, self.resolution)
            blocks += suspended.blocks(quadrature=self.quadrature)
        two_platforms = self.ping_geometry.receive_track_extent is not None
        if boundary_echo_families(self.path_settings, two_platforms=two_platforms):
            blocks.append(partial(transmitter_point, self.ping_geometry))
        return blocks

    def _boundary(self, boundary: Boundary, depth: float, law: Law) -> list[Block]:
        """Blocks of the scatterers of a boundary at a mean depth [m]."""
        families = families_reaching(boundary, self.path_settings.followed_families)
        if not families:
            return []
        if self.path_settings.geometry == "slice":
            return self._slice_points(boundary, depth, law, families)
        # rings have the resolution of one position; two positions use cells of the scatterer grid
        is_polar = self.quadrature and self.ping_geometry.receive_track_extent is None
        return (self._polar_points if is_polar else self._grid_points)(boundary, depth, law, families)

    def _grid_points(self, boundary: Boundary, depth: float, law: Law, families: tuple[str, ...]) -> list[Block]:
        """Jittered cells of all tiles in reach of window and beams."""
        scatterer_grid = self.scene.seabed.scatterer_grid
        floor = float(amplitude_ratio(self.path_settings.beam_cutoff_db))
        images = face_images(self.scene, self.path_settings, self.ping_geometry, boundary)
        # without random phases, squares much longer than a range cell would show as ripple
        cells = replace(self.resolution, elongation=QUADRATURE_ELONGATION) if self.quadrature else self.resolution
        tiles, density = tiles_in_view(
            self.ping_geometry, scatterer_grid, depth, self.rays, families, cells, floor, rise=self.rise(boundary),
            widest=max_path_length(self.ping_geometry, self.scene.water.max_sound_speed), glints=self.glints,
            images=images,
        )  # fmt: skip
        if not len(density):
            return []
        if self.quadrature:
            density = np.ones_like(density)
        farthest = max(self._window_range(boundary, depth, families).farthest, 1.0)
        beam_importance = BeamImportance(
            self.ping_geometry, depth, self.rays, families, scatterer_grid, farthest,
            self.path_settings.importance_sampling, self.glints, images,
        )  # fmt: skip
        ping_density = density
        if (
            not self.quadrature and self.ping_geometry.pulse.receiver.synthetic_aperture is None
        ):  # its pings are received as one
            ping_density = fill_fraction(self.ping_geometry, scatterer_grid, depth, self.resolution, tiles, density)
        bounds, drawn_tiles = beam_importance.bounds(tiles, ping_density), self._drawn_tiles(boundary)

        def block_scatterers(rows: slice) -> Scatterers:
            kept = beam_importance.kept_scatterers(tiles.take(rows), bounds.take(rows), drawn_tiles, density[rows])
            if self.quadrature:
                phase = np.ones(len(kept.area), complex)
                return self._points_on_boundary(boundary, depth, law, kept.position[:, :2], kept.area, phase, kept.key)
            return self._textured(Scatterers(boundary, boundary, law, *kept))

        return [partial(block_scatterers, rows) for rows in cut_into_blocks(beam_importance.expected(bounds))]

    def _drawn_tiles(self, boundary: Boundary) -> DrawnTiles:
        """Scatterers of the tiles of a boundary, drawn in earlier pings or when they are requested."""
        if self.quadrature:  # positions alone
            return self.caches.drawn_tiles.get((boundary, True), partial(DrawnTiles, boundary, QUADRATURE_SEED))
        terrain = self.terrain if boundary == "seabed" else None
        return self.caches.drawn_tiles.get((boundary, False), partial(DrawnTiles, boundary, self.seed, terrain))

    def _polar_points(self, boundary: Boundary, depth: float, law: Law, families: tuple[str, ...]) -> list[Block]:
        """Quadrature points in cells of equal slant range and azimuth about the sonar."""
        window_range = self._window_range(boundary, depth, families)
        if window_range.farthest < 0:
            return []
        quadrature_points = QuadraturePoints(
            self.scene, self.ping_geometry, self.rays, depth, families, window_range, self.resolution,
            self.rise(boundary), float(amplitude_ratio(self.path_settings.beam_cutoff_db)),
            self.path_settings.importance_sampling, self.caches.layouts,
            self.path_settings.edge_diffraction == "knife-edge",
            face_images(self.scene, self.path_settings, self.ping_geometry, boundary),
        )  # fmt: skip

        def block_scatterers(columns: Callable[[], Columns]) -> Scatterers:
            position, area, key = columns()
            return self._points_on_boundary(boundary, depth, law, position, area, np.ones(len(area), complex), key)

        return [partial(block_scatterers, columns) for columns in quadrature_points.blocks(cut_into_blocks)]

    def _slice_points(self, boundary: Boundary, depth: float, law: Law, families: tuple[str, ...]) -> list[Block]:
        """Cells along the beam's plane, a few to each cell of slant range, as fine as the farthest one needs."""
        window_range = self._window_range(boundary, depth, families)
        if window_range.farthest < 0:
            return []
        pitch = self.resolution.slant_resolution / self.resolution.scatterers_per_cell
        first, last = int(window_range.nearest / pitch), int(np.ceil(window_range.farthest / pitch))
        forward = np.array(
            [np.cos(self.ping_geometry.first_beam_bearing), np.sin(self.ping_geometry.first_beam_bearing)]
        )
        origin = self.ping_geometry.transmit_position[:2]
        # A position in a slice is a distance along one line of the scatterer grid: another line has other scatterers.
        scatterer_grid = self.scene.seabed.scatterer_grid
        along, across = np.round(scatterer_grid.from_world(origin) * 100).astype(int)
        bearing = float(np.mod(self.ping_geometry.first_beam_bearing - scatterer_grid.heading, 2 * np.pi))
        line_number = round(bearing * 1e6) * 2 + (boundary == "surface")

        def block_scatterers(start: int, stop: int) -> Scatterers:
            cell = np.arange(start, stop)
            uniform = random_keys.uniforms(self.seed, random_keys.SLICE, cell, along, across, line_number)
            shift = 0.5 if self.quadrature else uniform[:, 0]
            position = origin + ((cell + shift) * pitch)[:, None] * forward
            key = np.uint64(random_keys.SLICE << 59 | int(boundary == "surface") << 58) | cell.astype(np.uint64)
            area = np.full(len(cell), pitch)
            phase = np.exp(2j * np.pi * uniform[:, 1])
            return self._points_on_boundary(boundary, depth, law, position, area, phase, key)

        starts = range(first, last, SCATTERERS_PER_BLOCK)
        return [partial(block_scatterers, s, min(s + SCATTERERS_PER_BLOCK, last)) for s in starts]

    @property
    def glints(self) -> GlintSpread | None:
        """Angular spread of legs by a moving surface; None: it is still."""
        return glint_spread(self.scene, self.ping_geometry.frequency)

    @property
    def terrain(self) -> SeabedTerrain | None:
        """Terrain of the seabed; None for a flat seabed."""
        return self.scene.seabed.terrain

    def _window_range(self, boundary: Boundary, depth: float, families: tuple[str, ...]) -> ReachableRange:
        """Distances of a boundary that are received."""
        return receivable_range(self.ping_geometry, depth, self.rays, families, rise=self.rise(boundary))

    def rise(self, boundary: Boundary) -> float:
        """Largest deviation of a boundary from its mean depth [m]."""
        if boundary != "seabed" or self.terrain is None:
            return 0.0
        return max(self.terrain.depth - self.terrain.span[0], self.terrain.span[1] - self.terrain.depth)

    def _points_on_boundary(
        self, boundary: Boundary, depth: float, law: Law, position: NDArray[np.float64], area: NDArray[np.float64],
        phase: NDArray[np.complex128], key: NDArray[np.uint64],
    ) -> Scatterers:  # fmt: skip
        """Points of a boundary at new positions (n, 2) [m]: on the terrain of the seabed, or on a plane."""
        if boundary == "seabed" and self.terrain is not None:
            terrain = self.terrain.relief.sample(position[:, 0], position[:, 1])
            return self._textured(seabed_scatterers(depth, terrain, law, position, area, phase, key))
        return self._textured(_on_boundary(boundary, depth, law, position, area, phase, key))

    def _textured(self, points: Scatterers) -> Scatterers:
        """Points of a boundary, with areas multiplied by the seabed's texture."""
        seabed = self.scene.seabed
        if points.boundary != "seabed" or seabed.texture is None:
            return points
        return replace(points, area=points.area * seabed.texture_factor(points.position))

    def _targets(self) -> list[Block]:
        """Blocks of the points of all targets."""
        blocks: list[Block] = []
        received = self.caches.received_targets.get(
            Identity(self.ping_geometry),
            partial(received_targets, self.scene, self.path_settings, self.ping_geometry, self.rays),
        )
        for points in target_points(
            self.scene, self.path_settings, self.seed, self.ping_geometry, self.resolution.slant_resolution,
            quadrature=self.quadrature, rays=self.rays, resolution=self.resolution, received=received,
        ):  # fmt: skip
            size = (
                SCATTERERS_PER_BLOCK if points.has_random_phase else max(len(points), 1)
            )  # what interferes stays together
            blocks += [partial(points.take, slice(s, s + size)) for s in range(0, len(points), size)]
        return blocks


def ping_scatterers(
    scene: Scene, path_settings: PathSettings, seed: int, ping_geometry: PingGeometry, rays: PropagationModel, *,
    quadrature: bool = False, caches: EngineCaches | None = None,
) -> PingScatterers:  # fmt: skip
    """Scatterers of the scene in reach of one ping, with the finest resolution that processing can attain."""
    if faces_in_reach(scene, path_settings, ping_geometry):  # by way of a face, echoes of near ground arrive late
        ping_geometry = replace(ping_geometry, window=(0.0, ping_geometry.window[1]))
    return PingScatterers(scene, path_settings, seed, ping_geometry, rays, quadrature, caches or EngineCaches())


def resolution_of(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, *, quadrature: bool = False
) -> Resolution:
    """Resolution cells of one ping: the finest that processing of the recording can attain.

    Sparse points of an expectation have cells of half the recorded pulse, as a sweep without a matched filter is.
    """
    # A pulse longer than the scene is deep would blur the legs' spreading, grazing angles and shadows.
    shallowest, deepest = ping_geometry.track_depths
    height = max(0.1, min(shallowest, scene.seabed.depth - deepest))
    speed = track_sound_speed(scene, ping_geometry)
    pulse = ping_geometry.pulse.finest_resolution(speed)
    if quadrature and path_settings.scatterers_per_cell < SPARSE_LIMIT:
        pulse = max(pulse, speed / 4 * ping_geometry.pulse.resolution_time)
    slant = min(pulse, MAX_CELL_LENGTH_RATIO * height)
    width = two_way_width(
        ping_geometry.transmit_beams, ping_geometry.full_aperture_beams or ping_geometry.receive_beams
    )
    sound_speed = min(ping_geometry.sound_speed, ping_geometry.receive_sound_speed)
    if speed != sound_speed:
        width = round(width * speed / sound_speed, ndigits=9)
    if ping_geometry.pulse.receiver.synthetic_aperture is not None:
        width = min(width, speed / ping_geometry.frequency / 2 / ping_geometry.pulse.receiver.synthetic_aperture)
    return Resolution(slant, width, path_settings.scatterers_per_cell, pulse)


def slice_footprint(ping_geometry: PingGeometry, within: float = np.pi) -> float:
    """Energy width of the two-way beam of a slice [rad], within an azimuth from its axis [rad]."""
    return float(two_way_footprint(ping_geometry.transmit_beams, ping_geometry.receive_beams, within=within)[0])


def _on_boundary(
    boundary: Boundary, depth: float, law: Law, horizontal: NDArray[np.float64], area: NDArray[np.float64],
    phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Points of a flat boundary, facing the water."""
    position, normal = np.empty((len(horizontal), 3)), np.zeros((len(horizontal), 3))
    position[:, :2], position[:, 2] = horizontal, depth
    normal[:, 2] = -1.0 if boundary == "seabed" else 1.0
    return Scatterers(boundary, boundary, law, position, normal, area, phase, key)
