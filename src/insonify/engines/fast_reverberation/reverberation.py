"""Fast reverberation: the expected intensity of the seabed at one ping, evaluated along radials.

`engines.eigenray_engine` evaluates any block of scatterers; an expectation over a whole seabed needs the same few
quantities at every sample. Here each radial is evaluated in one pass (`_walk_kernel`), and all sample lists and tables
are cached for the next ping. `prepare_fast_reverberation` checks the conditions: one ray of each family to a point, a
monostatic sonar, one beam a side. The general engine evaluates all other scenes.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache, partial
from math import prod
from threading import local
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.face_reflection import reflecting_faces
from insonify.engines.fast_reverberation import _walk_kernel as kernel
from insonify.engines.fast_reverberation._radial_terrain_kernel import CELLS
from insonify.engines.fast_reverberation.fast_relief_reflections import bounce_off_relief
from insonify.engines.fast_reverberation.level_legs import zone_climbs
from insonify.engines.fast_reverberation.radial_window import TerrainWindow, radials_past_targets, terrain_window
from insonify.engines.fast_reverberation.refraction_table import RaysFromDepth, refraction_table
from insonify.engines.fast_reverberation.reverberation_plan import (
    RadialLines,
    ReverberationPlan,
    absorption_db,
    absorption_octaves,
    bounce_tables,
    plan_reverberation,
)
from insonify.engines.fast_reverberation.shadow_radials import shaded_legs, shadow_radials
from insonify.engines.fast_reverberation.swath_origins import (
    ShadedSamples,
    sample_origins,
    sample_positions,
    unlit_rows,
)
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.radial_tables import (
    STRAIGHT,
    IsovelocityChannel,
    MapTiles,
    PairSamples,
    RadialFrame,
    RadialLegs,
    RadialSet,
    RefractionTable,
)
from insonify.engines.radials import ViewedBoundary, radials_in_view
from insonify.engines.resolution import receivable_range, two_way_gain_bound
from insonify.propagation.families import families_reaching, image_depth
from insonify.propagation.image_sources import StraightRays
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.propagation.refracted_rays import RefractedRays
from insonify.recent_results import Identity, RecentResults
from insonify.records.reverberation_samples import ReverberationSamples
from insonify.scattering.compiled_law import CompiledLaw, compile_law
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Law
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.scene.terrain_map import CACHE_SIDE, empty_terrain_map, terrain_map
from insonify.sonar.ping_geometry import PingGeometry
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Mapper = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]

DIRECTIONS_PER_BATCH = 8192
"""Directions at which a law is evaluated in one call."""
MAX_RADIAL_STEP = 0.5
"""Longest step along a radial over a flat seabed [m]."""
RECHECK_DISTANCE = 4.0
"""Displacement of the sonar within which beam gains towards targets are not bounded again [m]."""


class _Scratch(local):
    """Working arrays of one thread, reused since first use of new memory takes longer than the evaluation."""

    def __init__(self) -> None:
        self._arrays: dict[str, NDArray[Any]] = {}

    def of(self, name: str, shape: tuple[int, ...], kind: Any) -> NDArray[Any]:
        """Array of a name, shape and data type, with undefined contents."""
        size = prod(shape)
        if name not in self._arrays or self._arrays[name].size < size:
            self._arrays[name] = np.empty(size + size // 4, kind)
        return self._arrays[name][:size].reshape(shape)


_SCRATCH = _Scratch()


@dataclass(frozen=True, eq=False)
class PreparedReverberation:
    """Tables of all pings between which the sonar only moves horizontally."""

    plan: ReverberationPlan
    heading: float
    """Heading of the frame of the radials [rad]."""
    farthest: float
    """Largest horizontal distance that is received [m]."""
    remaining_path_settings: PathSettings
    """Path settings without the seabed."""
    path_settings_without_targets: PathSettings
    """Path settings without seabed and targets."""
    last_check: list[tuple[Floats, bool]] = field(default_factory=list)
    """Last position at which beams were checked [m]; True: within `RECHECK_DISTANCE` of it no beam reaches a target."""


@dataclass(frozen=True)
class FastReverberation:
    """Fast reverberation of one ping."""

    scene: Scene
    rays: PropagationModel
    """Propagation model of the scene."""
    path_settings: PathSettings
    ping_geometry: PingGeometry
    known: PreparedReverberation
    parts: list[RadialSet]
    """Radials of the ping: those of the plan, and those in shadows of targets."""
    window: TerrainWindow
    """Window of the seabed's map that the radials cross."""

    @property
    def plan(self) -> ReverberationPlan:
        """The reverberation plan."""
        return self.known.plan

    @cached_property
    def remaining_path_settings(self) -> PathSettings:
        """The path settings without the seabed, and without targets that no beam reaches."""
        reaches_target = "target" in self.path_settings.contributions and self._near_a_target()
        return self.known.remaining_path_settings if reaches_target else self.known.path_settings_without_targets

    def _near_a_target(self) -> bool:
        """Return True if any beam's gain towards any target is above the cutoff, or there is a point target."""
        scene = self.scene
        if len(scene.targets) > len(scene.occluders):
            return True
        if not scene.occluders:
            return False
        origin = self.ping_geometry.transmit_position[:2]
        for position, is_clear in self.known.last_check:
            distance = math.dist(origin, position)
            if is_clear and distance <= RECHECK_DISTANCE:
                return False
            if not is_clear and distance <= RECHECK_DISTANCE / 4:
                return self._may_reach_target_from(0.0)
        is_clear = not self._may_reach_target_from(RECHECK_DISTANCE)
        self.known.last_check[:] = [(origin, is_clear)]
        return not is_clear and self._may_reach_target_from(0.0)

    def _may_reach_target_from(self, displacement: float) -> bool:
        """Return True if, within a displacement of the sonar [m], any beam may exceed the cutoff at any target."""
        bounding_cylinders = self.plan.bounding_cylinders[:, :3]
        top, base = _target_depths(self.scene)
        floor = float(amplitude_ratio(self.path_settings.beam_cutoff_db))
        bound = two_way_gain_bound(
            bounding_cylinders[:, :2], bounding_cylinders[:, 2] + displacement, self.ping_geometry, (top + base) / 2,
            self.rays,
            self.path_settings.followed_families, rise=(base - top) / 2,
        )  # fmt: skip
        return bool((bound >= floor).any())

    def accumulate(
        self, map_function: Mapper, accumulate_samples: Callable[[ReverberationSamples], Any], *, labelled: bool = False
    ) -> list[Any]:
        """Evaluate the seabed, part by part.

        Args:
            map_function: A function like `map`, which may use several threads.
            accumulate_samples: Function of the samples of each part, whose columns are overwritten afterwards.
            labelled: True: the result includes `Origins` of the samples.

        Returns:
            Results of `accumulate_samples`.
        """
        terrain, window = self.scene.seabed.terrain, self.window
        if terrain is None:
            nodes, tile_row = empty_terrain_map()
            tiles = MapTiles(1.0, tile_row, nodes, is_flat=True)
            return [accumulate_samples(self._walk(part, tiles, labelled)) for part in self.parts]
        heightmap = terrain_map(terrain)
        tile_row = np.zeros((window.side, window.side), np.uint32)
        with heightmap.reading(window.corner + window.crossed, map_function) as rows:
            tile_row[tuple(window.crossed.T)] = rows
            tiles = MapTiles(heightmap.cell, tile_row, heightmap.nodes, is_flat=False)
            return [accumulate_samples(self._walk(part, tiles, labelled)) for part in self.parts]

    def _walk(self, part: RadialSet, tiles: MapTiles, labelled: bool) -> ReverberationSamples:
        """Samples of some radials, with their legs and the weight of each pair of families."""
        seabed, ping_geometry, plan = self.scene.seabed, self.ping_geometry, self.plan
        frame = RadialFrame(*self.window.start, self.known.heading, plan.step)
        channel = IsovelocityChannel(
            float(ping_geometry.transmit_position[2]), seabed.depth, ping_geometry.sound_speed,
            ping_geometry.wavelength, (seabed.depth, seabed.depth) if seabed.terrain is None else seabed.terrain.span,
        )  # fmt: skip
        legs, pairs, interference_ranges = _columns(part, len(plan.families), len(plan.allocation.pair))
        ranges = kernel.walk_radials(frame, channel, part, tiles, plan.table, legs, pairs, interference_ranges)
        terrain = seabed.terrain
        if terrain is not None and terrain.span[0] < terrain.span[1]:
            bounce_off_relief(self.rays, terrain, ping_geometry, plan, part, legs)
        unlit = unlit_rows(plan, legs, pairs) if labelled else None
        positions = cache(partial(sample_positions, ping_geometry, part, legs))
        shaded = self._apply_target_shadows(part, legs, positions()) if part.passes_target.any() else None
        if seabed.texture is not None:
            factor = self._texture(part.radials, legs).astype(np.float32)
            for k, many in enumerate(pairs.sample_count):
                pairs.weight[k, :many] *= factor[pairs.rows[k, :many]]
        for k, (i, j) in enumerate(plan.allocation.pair if not plan.table.direction_factor.size else ()):
            count = pairs.sample_count[k]
            self._apply_law(
                legs.arrival[i], legs.arrival[j], legs.normal, pairs.rows[k, :count], pairs.weight[k, :count]
            )
        origins = None if unlit is None else sample_origins(plan, positions, legs, pairs, unlit, shaded)
        return ReverberationSamples(
            legs.delay, legs.amplitude, legs.departure, plan.allocation.pair, pairs.sample_count, pairs.rows,
            pairs.weight, interference_ranges[:ranges], origins,
        )  # fmt: skip

    def _texture(self, radials: Floats, legs: RadialLegs) -> Floats:
        """Factor of the seabed's texture on the area of the samples of some radials [1], shape (n,)."""
        bearing = np.arctan2(radials[:, column.SINE], radials[:, column.COSINE]) + self.known.heading
        bearing = np.repeat(bearing, np.diff(legs.radial_offsets))
        direction = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        origin = self.ping_geometry.transmit_position[:2]
        return self.scene.seabed.texture_factor(origin + legs.range_depth[0, : len(bearing), None] * direction)

    def _apply_law(
        self, incoming: NDArray[np.float32], outgoing: NDArray[np.float32], normal: NDArray[np.float32],
        rows: NDArray[np.int32], weight: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """Multiply the area that samples represent by the law's cross section for one pair.

        Args:
            incoming: Directions of travel of the transmit legs at all samples [1], (3, n).
            outgoing: Directions of travel of the receive legs at all samples, from the sonar [1], (3, n).
            normal: Unit normals at all samples, (3, n).
            rows: Samples of the pair, (m,).
            weight: Area of each sample of the pair [m^2], changed in place, (m,).
        """
        directions = _SCRATCH.of("law directions", (9 * DIRECTIONS_PER_BATCH,), np.float32)
        values = _SCRATCH.of("law", (DIRECTIONS_PER_BATCH,), np.float32)
        for begin in range(0, len(rows), DIRECTIONS_PER_BATCH):
            batch = rows[begin : begin + DIRECTIONS_PER_BATCH]
            incident, scattered, normals = directions[: 9 * len(batch)].reshape(3, 3, len(batch))
            kernel.gather_directions(incoming, outgoing, normal, batch, incident, scattered, normals)
            self.plan.law.fill(incident, scattered, normals, values[: len(batch)])
            weight[begin : begin + DIRECTIONS_PER_BATCH] *= values[: len(batch)]

    def _apply_target_shadows(self, part: RadialSet, legs: RadialLegs, positions: Floats) -> ShadedSamples | None:
        """Multiply legs on radials that pass a target by their visibility past targets; return these legs, if any.

        Args:
            part: The radials.
            legs: Legs to their samples, changed in place.
            positions: North, east, depth of the samples [m], shape (3, n).
        """
        position = self.ping_geometry.transmit_position
        north, east, radius = self.plan.bounding_cylinders[:, :3].T
        nearest = (np.hypot(north - position[0], east - position[1]) - radius).min()
        passes = np.repeat(part.passes_target, np.diff(legs.radial_offsets))
        row = np.flatnonzero(passes & (legs.range_depth[0, : len(passes)] > nearest))
        if not len(row):
            return None
        points, up = (np.ascontiguousarray(columns.take(row, axis=1).T, float) for columns in (positions, legs.normal))
        edges = self.path_settings.edge_diffraction
        shaded = shaded_legs(self.rays, self.ping_geometry, self.plan, edges, points, up)
        legs.amplitude[:, row] *= shaded.visibility
        return ShadedSamples(row, shaded)


def _columns(part: RadialSet, f: int, p: int) -> tuple[RadialLegs, PairSamples, NDArray[np.int64]]:
    """Columns to be filled: legs of f families to samples, samples of p pairs, and interference ranges."""
    lists, list_rows = part.lists, part.list_rows
    size = int((lists.pair_offsets[:, 1:] - lists.pair_offsets[:, :-1]).take(list_rows, axis=0).sum(axis=0).max())
    points, ranges = (
        int((offsets[1:] - offsets[:-1]).take(list_rows).sum())
        for offsets in (lists.list_offsets, lists.interference_offsets)
    )
    legs = RadialLegs(
        np.empty(len(part.radials) + 1, np.int64), _SCRATCH.of("point", (2, points), np.float64),
        _SCRATCH.of("normal", (3, points), np.float32), _SCRATCH.of("delay", (f, points), np.float64),
        _SCRATCH.of("amplitude", (f, points), np.complex64), _SCRATCH.of("departure", (f, 3, points), np.float32),
        _SCRATCH.of("arrival", (f, 3, points), np.float32),
    )  # fmt: skip
    pairs = PairSamples(
        _SCRATCH.of("rows", (p, size), np.int32), _SCRATCH.of("weight", (p, size), np.float32), np.empty(p, np.int64)
    )
    return legs, pairs, _SCRATCH.of("meeting", (ranges, 2), np.int64)


def prepare_fast_reverberation(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, rays: PropagationModel
) -> FastReverberation | None:
    """Prepare fast reverberation of one ping; None where the scene does not meet its conditions.

    Conditions: straight rays, or refracted ones of a `refraction_table`, a three-dimensional scene, both ends of the
    sonar at one position, one beam a side, a sea surface that reflects specularly only, and a seabed below the sonar.

    Args:
        scene: The scene.
        path_settings: Path settings.
        ping_geometry: The sonar at this ping.
        rays: Propagation model of the scene.
    """
    if not ping_geometry.is_monostatic or ping_geometry.hull is not None:
        return None
    if reflecting_faces(scene, path_settings, ping_geometry.frequency):
        return None
    # a sonar that only moves horizontally has the same objects at the next ping
    objects = (
        scene, path_settings, rays, ping_geometry.transmit_beams, ping_geometry.receive_beams,
        ping_geometry.track_extent, ping_geometry.pulse,
    )  # fmt: skip
    key = (
        *map(Identity, objects), float(ping_geometry.transmit_position[2]), ping_geometry.max_displacement,
        ping_geometry.window,
    )  # fmt: skip
    prepared = _PREPARED.get(key, lambda: _prepare(scene, path_settings, ping_geometry, rays))
    if prepared is None:
        return None
    parts = _radial_sets(rays, path_settings, ping_geometry, prepared)
    window = terrain_window(scene.seabed.terrain, ping_geometry, prepared.plan.step, parts, prepared.farthest)
    if window is None:
        return None
    return FastReverberation(scene, rays, path_settings, ping_geometry, prepared, parts, window)


def _radial_sets(
    rays: PropagationModel, path_settings: PathSettings, ping_geometry: PingGeometry, prepared: PreparedReverberation
) -> list[RadialSet]:
    """Radials of one ping: those of its plan, and narrow ones in place of those that targets shade."""
    plan = prepared.plan
    passing = radials_past_targets(plan, ping_geometry, prepared.heading, path_settings.edge_diffraction)
    passes = np.asarray(passing.any(axis=0), bool)
    complete = RadialSet(plan.radials, plan.lists, np.arange(len(passes)), passes)
    shaded = None
    if passes.any():
        shaded = shadow_radials(plan, rays, ping_geometry, path_settings, prepared.heading, passing)
    if shaded is None or not shaded.replaced.any():
        return [complete]
    unreplaced = np.flatnonzero(~shaded.replaced)
    lists = plan.sample_lists(shaded.radials, prepared.heading, shaded.keep_probability)
    return [
        RadialSet(plan.radials[unreplaced], plan.lists, unreplaced, passes[unreplaced]),
        RadialSet(shaded.radials, lists, np.arange(len(shaded.radials)), shaded.passes_target),
    ]


_PREPARED: RecentResults[PreparedReverberation | None] = RecentResults(8)


def _prepare(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, rays: PropagationModel
) -> PreparedReverberation | None:
    """Tables of a sonar that only moves horizontally; None where the scene does not meet the conditions."""
    seabed, terrain = scene.seabed, scene.seabed.terrain
    law = _compiled_law(seabed.law(ping_geometry.frequency, float(scene.water.sound_speed_at(seabed.depth))))
    families = families_reaching("seabed", path_settings.followed_families)
    if path_settings.geometry != "3d" or "seabed" not in path_settings.contributions:
        return None
    if scene.is_rough(families):
        return None
    if ping_geometry.channel_count != 1 or law is None or not families:
        return None
    if not isinstance(rays, StraightRays | RefractedRays):
        return None
    source, rise = float(ping_geometry.transmit_position[2]), 0.0
    if terrain is not None:
        if terrain.span[0] <= source:
            return None
        rise = max(terrain.depth - terrain.span[0], terrain.span[1] - terrain.depth)
    window_range = receivable_range(ping_geometry, seabed.depth, rays, families, rise=rise)
    sampling = ping_scatterers(scene, path_settings, 0, ping_geometry, rays, quadrature=True).resolution
    step = min(sampling.slant_resolution, MAX_RADIAL_STEP)
    if terrain is not None:
        step = terrain.heightmap_cell_size / int(np.ceil(terrain.heightmap_cell_size / sampling.slant_resolution))
        if 2 * window_range.farthest / (terrain.heightmap_cell_size * CELLS) > CACHE_SIDE - 4:
            return None
    floor = float(amplitude_ratio(path_settings.beam_cutoff_db))
    refraction = _refraction(rays, ping_geometry, families, window_range.farthest)
    if refraction is None:
        return None
    climbs = None
    if refraction.nodes.size:
        images = np.array([image_depth(name, source, seabed.depth) for name in families])
        climbs = partial(zone_climbs, refraction, images, ping_geometry.sound_speed, seabed.depth)
    heading = 0.0 if terrain is None else terrain.relief.resolved.scatterer_grid.heading
    boundary = ViewedBoundary(seabed.depth, families, rise, climbs)
    radials = radials_in_view(ping_geometry, boundary, window_range, sampling, floor, heading)
    lines = RadialLines(radials, step, heading)
    plan = plan_reverberation(rays, ping_geometry, families, law, lines, rise, refraction)
    return PreparedReverberation(
        plan, heading, window_range.farthest, _reduced_path_settings(path_settings, scene, ping_geometry.frequency, ()),
        _reduced_path_settings(path_settings, scene, ping_geometry.frequency, ("target",)),
    )  # fmt: skip


_TABLES: RecentResults[RefractionTable | None] = RecentResults(8)


def _refraction(
    rays: StraightRays | RefractedRays, ping_geometry: PingGeometry, families: tuple[str, ...], farthest: float
) -> RefractionTable | None:
    """Refraction table of a ping, cached for all with its depth; None where a family does not qualify for one."""
    if isinstance(rays, StraightRays):
        return STRAIGHT
    frequency, source = ping_geometry.frequency, float(ping_geometry.transmit_position[2])
    if not rays.uses_tables(frequency):
        return None
    absorption = absorption_octaves(absorption_db(rays.scene.water, frequency))
    end = RaysFromDepth(rays, source, ping_geometry.sound_speed, absorption)
    return _TABLES.get(
        (Identity(rays), source, families, frequency, farthest),
        lambda: refraction_table(end, families, bounce_tables(families)[2], ping_geometry.wavelength, farthest),
    )


@lru_cache(maxsize=16)
def _reduced_path_settings(
    path_settings: PathSettings, scene: Scene, frequency: float, further: tuple[str, ...]
) -> PathSettings:
    """The path settings without the seabed, contributions that do not scatter, and some further ones."""
    omitted = ["seabed", *further]
    omitted += ["surface"] if scene.surface.law(frequency) is None else []
    omitted += [] if scene.water.scatters else ["water"]
    remaining = tuple(contribution for contribution in path_settings.contributions if contribution not in omitted)
    return path_settings.unchecked_copy(contributions=remaining)


@lru_cache(maxsize=16)
def _compiled_lambert(law: Lambert) -> CompiledLaw:
    """Compiled form of Lambert's law, cached."""
    return compile_law(law)


def _compiled_law(law: Law | None) -> CompiledLaw | None:
    """The compiled form of a law; None: there is no law or no such form."""
    if isinstance(law, Lambert):
        return _compiled_lambert(law)
    return law if isinstance(law, CompiledLaw) else None


@lru_cache(maxsize=8)
def _target_depths(scene: Scene) -> tuple[float, float]:
    """Depths of the highest top and of the deepest base of all targets that cast shadows [m]."""
    surfaces = [world_triangles(solid, scene.seabed) for solid in scene.solids]
    tops = [*scene.bodies[:, 6], *(float(surface.low[2]) for surface in surfaces)]
    bases = [*scene.bodies[:, 7], *(float(surface.high[2]) for surface in surfaces)]
    return float(min(tops)), float(max(bases))
