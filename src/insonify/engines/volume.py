"""Volume scatterers: density of points in the water by the sonar's resolution, and those in reach of one ping.

A resolution cell is as long as the pulse, as wide as the finest beam, and as tall as that beam or the scattering layer.
For coherent pressure a cell has points of the water's own lattice, at a scale that follows from the whole track. For an
expectation, points lie on even shells about the sonar: on a sphere equal heights hold equal areas (Archimedes), so
that a cell of slant range R, azimuth and depth is R dR d(azimuth) dz large. Where the two-way gain is low, few of them
are kept, with larger volumes, as on the boundaries (`engines.polar_grid`).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insonify.engines._keep_probability_kernel import keep_probabilities
from insonify.engines._volume_points_kernel import ShellGrid, StraightPaths, thin_points, tile_points, two_way_gains
from insonify.engines.beam_importance import BEAM_EDGE_DB, LINEAR_BELOW, MIN_GAIN
from insonify.engines.face_images import face_images
from insonify.engines.parts import cut_into_blocks
from insonify.engines.polar_grid import GAIN_MARGIN, SPARSE_GAIN_MARGIN
from insonify.engines.resolution import Resolution
from insonify.propagation.families import bottom_bounces, bounce_sequence, image_depth
from insonify.propagation.path_settings import PathSettings
from insonify.scene.scatterer_grid import BASE_PITCH
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.volume_scatterers import (
    CELLS,
    LAYERS,
    QUASIRANDOM_STEPS,
    WaterBlocks,
    layer_scatterers,
    max_water_depth,
    patch_scatterers,
    water_scatterers,
)
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.track_extent import distance_to_segments
from insonify.sonar.two_way_beam import two_way_height
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

CUBES_PER_BLOCK = 64
"""Number of cubes of water that are drawn together."""
MAX_CUBES = 1_600_000
"""Largest number of cubes of one ping, 64 points each."""
COUNTED = 20_000
"""Number of cubes of one scale from which those of one ping are estimated, to 1 % [1]."""
MAX_TILES = 1_600_000
"""Largest number of tiles of quadrature points, `SHELLS_PER_TILE` points each at most."""
MIN_RANGE = 1.0
"""Slant range below which cells get no smaller [m]."""
SHELLS_PER_TILE = 64
"""Number of shells of a tile of quadrature points, which is one sector wide and one stratum thick."""
SECTORS_PER_GROUP = 16
"""Number of sectors of a group, which is tested against the beams before its tiles are."""
POINTS_PER_CELL_SIDE = 1.5
"""Number of quadrature points in a resolution cell along range, and across the beam, at `USUAL_PER_CELL` scatterers."""
USUAL_PER_CELL = 5.0
"""Number of scatterers in a resolution cell to which that refers [1]."""
MIN_STRATA = 8.0
"""Least number of strata of quadrature points in a layer."""
WIDEST_SECTOR = 0.05
"""Largest width of a sector of quadrature points [rad]."""
MIN_KEEP_PROBABILITY = 1 / 32
"""Smallest keep probability of quadrature points [1]."""
MAX_COUNTED_ROWS = 24
"""Largest number of rows of tiles from which those of a ping are estimated, near rows each by itself [1]."""
COUNTED_TILES = 300
"""Number of tiles of such a row, drawn at random, from whose points those of the row are estimated [1]."""
MAX_TRAVEL_TIME_RATIO = 1.1
"""Largest travel time of a refracted path re that of the straight one [1]."""
MIN_CELLS_PER_PATCH = 6.0
"""Least number of cells along the shortest side of a scattering patch."""


@dataclass(frozen=True, slots=True)
class VolumeScatterers:
    """Volume scatterers in reach of one ping."""

    scene: Scene
    path_settings: PathSettings
    seed: int
    ping_geometry: PingGeometry
    resolution: Resolution

    def blocks(self, *, quadrature: bool) -> Iterator[Callable[[], Scatterers]]:
        """All points in the water that this ping can receive, in blocks of a fixed order.

        Args:
            quadrature: True: quadrature points for an expectation. False: random ones fixed to the world.

        Raises:
            ValueError: There would be more than `MAX_CUBES` cubes or `MAX_TILES` tiles.
        """
        water, seabed = self.scene.water, self.scene.seabed
        if len(self._layers):
            if quadrature:
                tiles, keep_probability = self._tiles()
                for rows in cut_into_blocks(keep_probability * SHELLS_PER_TILE):
                    yield partial(self._tile_scatterers, tiles[rows], keep_probability[rows])
            else:
                cubes = self.cubes()
                for start in range(0, len(cubes.scale), CUBES_PER_BLOCK):
                    batch = cubes.take(slice(start, start + CUBES_PER_BLOCK))
                    yield partial(water_scatterers, water, seabed, batch, self.seed)
        yield from self._patches(quadrature=quadrature)

    def count(self, *, quadrature: bool) -> float:
        """Approximate number of points in the layers of the water, counted without drawing any.

        Args:
            quadrature: See `blocks`.
        """
        if not len(self._layers):
            return 0.0
        try:
            if quadrature:
                return self._count_even_points()
            return sum(float(weight * len(cubes.scale)) for weight, cubes in self._scales(COUNTED)) * CELLS**3
        except ValueError:
            return float("inf")

    def _patches(self, *, quadrature: bool) -> Iterator[Callable[[], Scatterers]]:
        """Points of the scattering patches that this ping can receive, in blocks."""
        for patch in self.scene.water.patches:
            middle, radius = np.array([patch.position]), np.array([float(np.linalg.norm(patch.size)) / 2])
            if not self._receivable(middle, radius)[0]:
                continue
            nearest = self._min_track_distance(middle, radius, middle[:, 2], middle[:, 2])
            pitch = float(np.cbrt(self._cell_volume(nearest, np.array([patch.size[2]])))[0])
            pitch = min(pitch, min(patch.size) / MIN_CELLS_PER_PATCH) / (2 if quadrature else 1)
            points = patch_scatterers(patch, self.scene.seabed, self.seed, pitch, quadrature=quadrature)
            size = CUBES_PER_BLOCK * CELLS**3
            for start in range(0, len(points), size):
                yield partial(points.take, slice(start, start + size))

    @property
    def _layers(self) -> Floats:
        """Upper and lower side [m] and s_v [1/m] of the layers that scatter, (layers, 3)."""
        return self.scene.water.layers(max_water_depth(self.scene.seabed))

    def cubes(self) -> WaterBlocks:
        """Cubes of random points that this ping can receive, each at the scale that the whole track requests."""
        return WaterBlocks(*map(np.concatenate, zip(*(cubes for _, cubes in self._scales()), strict=True)))

    def _scales(self, counted: int | None = None) -> Iterator[tuple[float, WaterBlocks]]:
        """Number of cubes that each cube of a scale represents [1], and these cubes, scale by scale.

        Args:
            counted: Largest number of cubes that are divided further, at random; None: all are.
        """
        ping_geometry, scatterer_grid = self.ping_geometry, self.scene.seabed.scatterer_grid
        farthest = self._farthest
        grid_position = scatterer_grid.from_world(ping_geometry.transmit_position[:2])
        scale = 3 * max(0, int(np.ceil(np.log2(max(farthest, 1.0) / (CELLS * BASE_PITCH)))))
        side = CELLS * BASE_PITCH * 2.0 ** (scale // 3)
        first, last = (np.floor((grid_position + sign * farthest) / side).astype(np.int64) for sign in (-1, 1))
        stop = int(np.ceil(max_water_depth(self.scene.seabed) / side))
        grid = np.mgrid[first[0] : last[0] + 1, first[1] : last[1] + 1, 0:stop].reshape(3, -1)
        cubes = WaterBlocks(np.full(grid.shape[1], scale), *grid)
        weight, total, draw = 1.0, 0.0, np.random.default_rng(self.seed)
        while len(cubes.scale):
            cubes, fine = self._refine(cubes)
            yield weight, cubes.take(fine)
            total += weight * int(fine.sum())
            cubes = cubes.take(~fine).split()
            if total + weight * len(cubes.scale) > MAX_CUBES:
                raise ValueError(TOO_MANY)
            if counted is not None and len(cubes.scale) > counted:
                weight *= len(cubes.scale) / counted
                cubes = cubes.take(draw.choice(len(cubes.scale), counted, replace=False))

    def _refine(self, cubes: WaterBlocks) -> tuple[WaterBlocks, NDArray[np.bool_]]:
        """Cubes in reach, and True for those that are fine enough, (n,)."""
        scatterer_grid, layers = self.scene.seabed.scatterer_grid, self._layers
        bottom = max_water_depth(self.scene.seabed)
        length, width, height = CELLS * cubes.pitch
        top, low = cubes.down * height, np.minimum((cubes.down + 1) * height, bottom)
        overlaps = (layers[:, 0] < low[:, None]) & (layers[:, 1] > top[:, None])
        thin = np.where(overlaps, layers[:, 1] - layers[:, 0], np.inf).min(axis=1)
        centre = np.column_stack([scatterer_grid.to_world((cubes.along + 0.5) * length, (cubes.across + 0.5) * width),
                                  (top + low) / 2])  # fmt: skip
        flat = np.hypot(length, width) / 2
        in_reach = overlaps.any(axis=1)
        in_reach[in_reach] = self._receivable(centre[in_reach], np.hypot(flat, (low - top) / 2)[in_reach])
        nearest = self._min_track_distance(centre, flat, top, low)
        fine = (cubes.cell <= self._cell_volume(nearest, thin) / self.resolution.scatterers_per_cell) | (
            cubes.scale == 0
        )
        return cubes.take(in_reach), fine[in_reach]

    def _cell_volume(self, distance: Floats, thickness: Floats) -> Floats:
        """Volume of a resolution cell [m^3] at slant ranges [m], in layers so thick [m]."""
        away = np.maximum(distance, MIN_RANGE)
        tall = np.minimum(away * self._beam_height, thickness)
        return np.asarray(self.resolution.slant_resolution * away * self.resolution.beam_width * tall)

    def _min_track_distance(self, centre: Floats, radius: Floats, top: Floats, low: Floats) -> Floats:
        """Least distance between some bodies of water and either end of the sonar on its whole track [m], (n,)."""
        geometry, horizontal = self.ping_geometry, np.full(len(centre), np.inf)
        for extent, position in zip(
            geometry.track_extents, (geometry.transmit_position, geometry.receive_position), strict=False
        ):
            runs = extent.nearest_segments(position[:2], self._farthest + float(radius.max(initial=0)) * 4)
            np.minimum(
                horizontal, distance_to_segments(centre[:, :2], runs) - radius - extent.polyline_error, out=horizontal
            )
        horizontal, depth = np.maximum(horizontal, 0), geometry.platform_positions[:, 2]
        up = np.maximum.reduce([top - depth.max(), depth.min() - low, np.zeros(len(top))])
        return np.asarray(np.hypot(horizontal, up) - np.linalg.norm(self.ping_geometry.lever_arms, axis=1).max())

    def _receivable(self, centre: Floats, radius: Floats) -> NDArray[np.bool_]:
        """Return True if window and beams let some balls of water be received by any pair of families, (n,)."""
        floor = float(amplitude_ratio(self.path_settings.beam_cutoff_db))
        return self._gain_bound(centre, radius, floor) >= floor

    def _gain_bound(self, centre: Floats, radius: Floats, sufficient: float) -> Floats:
        """Upper bound of the two-way pressure gain in some balls of water, by any pair of families [1], (n,).

        Args:
            centre: Centres of the balls [m], (n, 3).
            radius: Their radii [m], (n,).
            sufficient: Bound from which on no further family is evaluated [1].
        """
        geometry, water, path_settings = self.ping_geometry, self.scene.water, self.path_settings
        ends = [
            (geometry.transmit_position, geometry.transmit_beams),
            (geometry.receive_position, geometry.bounding_receive_beams),
        ]
        if geometry.same_beams and geometry.is_monostatic:
            ends.pop()
        times = 3 - len(ends)
        closest, farthest = np.full((len(ends), len(centre)), np.inf), np.zeros((len(ends), len(centre)))
        for family in path_settings.followed_families:
            for row, (position, _) in enumerate(ends):
                length, around, _ = self._rays(family, position, centre, radius)
                np.minimum(closest[row], length - around, out=closest[row])
                np.maximum(farthest[row], length + around, out=farthest[row])
        earliest, latest_recorded = geometry.recorded_delays
        latest = times * farthest.sum(axis=0) / water.min_sound_speed
        in_time = times * closest.sum(axis=0) / water.max_sound_speed <= latest_recorded
        received = in_time & (latest * (MAX_TRAVEL_TIME_RATIO if water.layered else 1.0) >= earliest)
        rows, gain, bound = np.flatnonzero(received), np.zeros((len(ends), len(centre))), np.zeros(len(centre))
        sources = [(family, ends) for family in path_settings.followed_families]
        for face_image in face_images(self.scene, path_settings, geometry, "water"):
            pair = (face_image.sonar.transmit_position, face_image.sonar.transmit_beams), (
                face_image.sonar.receive_position, face_image.sonar.bounding_receive_beams)  # fmt: skip
            sources += [(family, list(pair[: len(ends)])) for family in face_image.families]
        for family, family_ends in sources:
            for row, (position, beams) in enumerate(family_ends):
                length, around, ray = self._rays(family, position, centre[rows], radius[rows])
                margin = np.where(around < length, np.arcsin(np.minimum(1, around / length)), np.pi)
                for direction, angle_margin in self._refracted_directions(ray / length[:, None]):
                    gain[row, rows] = np.maximum(gain[row, rows], beams.bound(direction, margin + angle_margin))
            bound[rows] = np.prod(gain[:, rows], axis=0) ** times
            rows = rows[bound[rows] < sufficient]  # others need no further family
        return bound

    def _rays(
        self, family: str, position: Floats, centre: Floats, radius: Floats
    ) -> tuple[Floats, Floats, Floats]:  # fmt: skip
        """Straight rays of one family to some balls of water.

        Returns:
            Lengths of the rays [m], (n,); radii of the balls, enlarged by what relief may displace the rays [m], (n,);
            vectors along the rays at the sonar [m], (n, 3).
        """
        ray = centre - [*position[:2], image_depth(family, float(position[2]), self.scene.seabed.depth)]
        length = np.maximum(np.linalg.norm(ray, axis=1), 1e-9)
        ray[:, 2] *= (-1) ** len(bounce_sequence(family))
        return length, radius + self._relief_height * 2 * bottom_bounces(family), ray

    def _refracted_directions(self, ray: Floats) -> Iterator[tuple[Floats, float]]:
        """Departure cones of refracted rays, given straight directions (n, 3): axes (n, 3), half angle [rad]."""
        water = self.scene.water
        if not water.layered:
            yield ray, 0.0
            return
        bend = float(
            np.arccos(water.min_sound_speed / water.max_sound_speed)
        )  # no ray that passes both speeds turns by more
        azimuth, elevation = np.arctan2(ray[:, 1], ray[:, 0]), np.arcsin(np.clip(ray[:, 2], -1, 1))
        for turn in np.linspace(-bend, bend, 5):
            up = np.clip(elevation + turn, -np.pi / 2, np.pi / 2)
            yield np.column_stack([np.cos(up) * np.cos(azimuth), np.cos(up) * np.sin(azimuth), np.sin(up)]), bend / 4

    def _tiles(self) -> tuple[Floats, Floats]:
        """Tiles of quadrature points in reach, (n, 5), and the largest keep probability in each [1], (n,).

        Columns: index of the row, index of the sector, upper side [m], thickness [m], gain from which on all points are
        kept [1].
        """
        total, tiles, keep_probability = 0, [np.zeros((0, 5))], [np.zeros(0)]
        for row in range(self._row_count):
            for layer in self._layers:
                in_reach, probability = self._tiles_of_row(row, layer)
                tiles.append(in_reach)
                keep_probability.append(probability)
                total += len(in_reach)
                if total > MAX_TILES:
                    raise ValueError(TOO_MANY)
        return np.concatenate(tiles), np.concatenate(keep_probability)

    def _count_even_points(self) -> float:
        """Approximate number of quadrature points that are kept, from rows that become sparser with distance."""
        edges = np.unique((self._row_count * np.linspace(0, 1, MAX_COUNTED_ROWS + 1) ** 2).astype(int))
        tiles, points, draw = 0.0, 0.0, np.random.default_rng(self.seed)
        for first, last in pairwise(edges.tolist()):
            for layer in self._layers:
                in_reach, keep_probability = self._tiles_of_row((first + last) // 2, layer)
                tiles += (last - first) * len(in_reach)
                counted = draw.permutation(len(in_reach))[:COUNTED_TILES]
                kept, _, _ = self._tile_points(in_reach[counted], keep_probability[counted])
                points += (last - first) * len(kept) * len(in_reach) / max(1, len(counted))
            if tiles > MAX_TILES:
                raise ValueError(TOO_MANY)
        return points

    @property
    def _row_count(self) -> int:
        """Number of rows of tiles, `SHELLS_PER_TILE` shells each."""
        return int(np.ceil(self._farthest / self._steps[0])) // SHELLS_PER_TILE + 1

    def _keep_probability(self, gain: Floats, full_gain: Floats) -> Floats:
        """Keep probability of quadrature points by their gains, and the gains from which on all are kept [1], (n,)."""
        probability = np.ones(len(gain))
        if self.path_settings.importance_sampling:
            keep_probabilities(gain / full_gain, LINEAR_BELOW, MIN_KEEP_PROBABILITY, probability)
        return probability

    def _tiles_of_row(self, row: int, layer: Floats) -> tuple[Floats, Floats]:
        """Tiles of one layer in one row that are received, and their keep probabilities, see `_tiles`.

        Groups of sectors are tested first.

        Args:
            row: Index of the row, from the sonar outwards.
            layer: Upper and lower side [m], s_v [1/m].
        """
        inner, outer = (float(edge * SHELLS_PER_TILE * self._steps[0]) for edge in (row, row + 1))
        upper, lower, _ = layer
        step = min((lower - upper) / MIN_STRATA, (inner + outer) / 2 * min(self._beam_height / 3, 0.25))
        count = int(np.ceil((lower - upper) / step))
        thick = (lower - upper) / count
        source = float(self.ping_geometry.transmit_position[2])
        strata = upper + np.arange(count) * (lower - upper) / count
        strata = strata[(strata < source + outer) & (strata + thick > source - outer)]
        groups_around = round(2 * np.pi / self._steps[1]) // SECTORS_PER_GROUP

        def largest_gain(sector: Integers, top: Floats, group_size: int, sufficient: float) -> Floats:
            angle = group_size * self._steps[1]
            up = top + thick / 2 - self.ping_geometry.transmit_position[2]
            nearest, farthest = (np.sqrt(np.maximum(reach**2 - up**2, 0)) for reach in (inner, outer))
            horizontal = (nearest + farthest) / 2
            centre = np.column_stack(
                [self._point(horizontal, np.asarray((sector + 0.5) * angle, float)), top + thick / 2]
            )
            beyond = np.maximum(np.abs(up) - outer, 0)
            radius = np.sqrt(((farthest - nearest) / 2 + farthest * angle / 2) ** 2 + (thick / 2) ** 2) + beyond
            return self._gain_bound(centre, radius, sufficient)

        floor = float(amplitude_ratio(self.path_settings.beam_cutoff_db))
        group, top = (part.ravel() for part in np.meshgrid(np.arange(groups_around), strata))
        in_reach = largest_gain(group, top, SECTORS_PER_GROUP, floor) >= floor
        sector = (group[in_reach, None] * SECTORS_PER_GROUP + np.arange(SECTORS_PER_GROUP)).ravel()
        top = top[in_reach].repeat(SECTORS_PER_GROUP)
        gain = largest_gain(sector, top, 1, np.inf)
        in_reach = gain >= floor
        sector, top, gain = sector[in_reach], top[in_reach], gain[in_reach]
        margin = SPARSE_GAIN_MARGIN if self.resolution.sparse else GAIN_MARGIN
        full_gain = max(float(gain.max(initial=0)), MIN_GAIN) * float(amplitude_ratio(BEAM_EDGE_DB)) / margin
        tiles = np.column_stack(np.broadcast_arrays(float(row), sector, top, thick, full_gain))
        return tiles, self._keep_probability(gain, tiles[:, 4])

    def _tile_scatterers(self, tiles: Floats, keep_probability: Floats) -> Scatterers:
        """The quadrature points of some tiles that are kept.

        Args:
            tiles: See `_tiles`, (n, 5).
            keep_probability: Largest in each [1], (n,).
        """
        position, volume, number = self._tile_points(tiles, keep_probability)
        return layer_scatterers(
            self.scene.water, self.scene.seabed, position, volume, np.ones(len(position), complex), LAYERS | number
        )

    def _tile_points(self, tiles: Floats, keep_probability: Floats) -> tuple[Floats, Floats, NDArray[np.uint64]]:
        """Positions [m] (n, 3), volumes [m^3] and keys of the quadrature points of some tiles that are kept.

        Args:
            tiles: See `_tiles`, (n, 5).
            keep_probability: Largest in each [1], (n,).
        """
        geometry, count = self.ping_geometry, len(tiles) * SHELLS_PER_TILE
        position, volume, number = np.empty((count, 3)), np.empty(count), np.empty(count, np.uint64)
        tile, priority = np.empty(count, np.int64), np.empty(count)
        source = np.asarray(geometry.transmit_position, float)
        grid = ShellGrid(SHELLS_PER_TILE, *self._steps, self._first_bearing, source, QUASIRANDOM_STEPS)
        n = tile_points(tiles, keep_probability, grid, position, volume, number, tile, priority)
        probability = keep_probability[tile[:n]]
        paths = self._straight_paths
        if len(paths.vertical_sign):
            gain = np.empty(n)
            beams = geometry.transmit_beams.kernel_majorants, geometry.bounding_receive_beams.kernel_majorants
            two_way_gains(position[:n], paths, *beams, gain)
            probability = np.minimum(probability, self._keep_probability(gain, tiles[tile[:n], 4]))
        n = thin_points(probability, position, volume, number, priority)
        return position[:n], volume[:n], number[:n]

    @property
    def _straight_paths(self) -> StraightPaths:
        """Paths for the two-way gain of single points: none with refraction or faces, or where all points are kept."""
        geometry, bed = self.ping_geometry, self.scene.seabed.depth
        families = self.path_settings.followed_families
        if self.scene.water.layered or face_images(self.scene, self.path_settings, geometry, "water"):
            families = ()
        families = families if self.path_settings.importance_sampling else ()
        ends = np.array([geometry.transmit_position, geometry.receive_position], float)
        depth = np.array([[image_depth(name, float(end[2]), bed) for name in families] for end in ends])
        vertical_sign = np.array([(-1.0) ** len(bounce_sequence(name)) for name in families])
        rise = np.array([2.0 * self._relief_height * bottom_bounces(name) for name in families])
        same_ends = geometry.same_beams and geometry.is_monostatic
        return StraightPaths(ends[:, :2].copy(), depth.reshape(2, -1), vertical_sign, rise, same_ends)

    def _point(self, distance: Floats, azimuth: Floats) -> Floats:
        """North and east at a distance [m] and an azimuth re half a turn from boresight [rad]: [m], (n, 2)."""
        bearing = self._first_bearing + azimuth
        offset = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1) * distance[..., None]
        return np.asarray(self.ping_geometry.transmit_position[:2] + offset)

    @property
    def _first_bearing(self) -> float:
        """Bearing of the first sector, half a turn from boresight [rad]."""
        return float(np.arctan2(self.ping_geometry.boresight[1], self.ping_geometry.boresight[0]) + np.pi)

    @property
    def _steps(self) -> tuple[float, float]:
        """Steps of quadrature points in slant range [m] and azimuth [rad]; a turn is a whole number of groups."""
        finer = float(np.cbrt(self.resolution.scatterers_per_cell / USUAL_PER_CELL)) * POINTS_PER_CELL_SIDE
        narrowest = min(self.resolution.beam_width / finer, WIDEST_SECTOR)
        sectors = np.ceil(2 * np.pi / narrowest / SECTORS_PER_GROUP) * SECTORS_PER_GROUP
        return self.resolution.slant_resolution / finer, 2 * np.pi / float(sectors)

    @property
    def _farthest(self) -> float:
        """Largest distance from which echoes are received [m]."""
        end_distance = float(np.linalg.norm(self.ping_geometry.transmit_position - self.ping_geometry.receive_position))
        return self.scene.water.max_sound_speed * max(self.ping_geometry.recorded_delays[1], 0.0) / 2 + end_distance

    @property
    def _beam_height(self) -> float:
        """Height of the finest two-way beam [rad]."""
        return two_way_height(
            self.ping_geometry.transmit_beams,
            self.ping_geometry.full_aperture_beams or self.ping_geometry.receive_beams,
        )

    @property
    def _relief_height(self) -> float:
        """Largest height of the seabed above its mean depth, or depth below it [m]."""
        terrain = self.scene.seabed.terrain
        return 0.0 if terrain is None else max(terrain.depth - terrain.span[0], terrain.span[1] - terrain.depth)


TOO_MANY = (
    "water.volume_strength_db: the beams cover so much water so finely that it would take more than a hundred million "
    "points. Shorten track.window, take a longer pulse or a wider beam, raise paths.beam_cutoff_db, lower "
    "paths.scatterers_per_cell, or give rows that leave clear water clear, such as [[0 m, -70], [5 m, null]]."
)
