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
from insonify.engines.boundary_echoes import boundary_echo_families
from insonify.engines.face_reflection import reflecting_faces
from insonify.engines.fast_reverberation import _walk_kernel as kernel
from insonify.engines.fast_reverberation._radial_terrain_kernel import CELLS
from insonify.engines.fast_reverberation.fast_relief_reflections import reflect_at_fitted_planes
from insonify.engines.fast_reverberation.flat_seabed_legs import zone_climbs
from insonify.engines.fast_reverberation.radial_window import TerrainWindow, radials_crossing_targets, terrain_window
from insonify.engines.fast_reverberation.refraction_table import RaysFromDepth, refraction_table
from insonify.engines.fast_reverberation.reverberation_plan import (
    RadialLines,
    ReverberationPlan,
    absorption_db,
    absorption_exponent,
    bounce_tables,
    plan_reverberation,
    sizes_of_lists,
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
from insonify.scattering.compiled_law import CompiledLaw, compiled_once
from insonify.scene.scatterers import BOUNDARY_ECHO
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
"""Displacement of the sonar within which a check that no beam reaches a target is not repeated [m]."""


class _Scratch(local):
    """Working arrays of one thread, reused because the first access to new memory takes longer than the evaluation."""

    def __init__(self) -> None:
        self._arrays: dict[str, NDArray[Any]] = {}

    def array(self, name: str, shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        """Array of a shape, with undefined contents; a name always has the same data type."""
        size = prod(shape)
        if name not in self._arrays or self._arrays[name].size < size:
            self._arrays[name] = np.empty(size + size // 4, dtype)
        return self._arrays[name][:size].reshape(shape)


_SCRATCH = _Scratch()


@dataclass(frozen=True, eq=False)
class PreparedReverberation:
    """Tables of all pings at one depth, in one attitude, with the same beams and recording window."""

    plan: ReverberationPlan
    heading: float
    """Heading of the frame of the radials [rad]."""
    farthest: float
    """Largest horizontal distance from which echoes are received [m]."""
    remaining_path_settings: PathSettings
    """Path settings without the seabed."""
    path_settings_without_targets: PathSettings
    """Path settings without seabed and targets."""
    last_check: list[tuple[Floats, bool]] = field(default_factory=list)
    """North and east at which beams were last checked [m]; True: no beam reaches a target within `RECHECK_DISTANCE`."""


@dataclass(frozen=True)
class FastReverberation:
    """Fast reverberation of one ping.

    Example:
        >>> from insonify.simulator import build_simulator
        >>> ripples = {"kind": "ripples", "wavelength": "2 m", "height": "10 cm"}
        >>> scenario = insonify.load_scenario("sidescan.yaml").with_({"field": "incoherent", "seabed.relief": ripples})
        >>> simulator = build_simulator(scenario)
        >>> reverberation = simulator.fast_reverberation(simulator.ping_geometry(40))
        >>> reverberation.plan.families, reverberation.remaining_path_settings.contributions  # the rest
        (('D', 'S'), ('target', 'boundary echo'))
    """

    scene: Scene
    rays: PropagationModel
    """Propagation model of the scene."""
    path_settings: PathSettings
    ping_geometry: PingGeometry
    prepared: PreparedReverberation
    radial_sets: list[RadialSet]
    """Radials of the ping: those of the plan that no target shades, and narrower ones in place of the others."""
    window: TerrainWindow
    """Window of the seabed's map that the radials cross."""

    @property
    def plan(self) -> ReverberationPlan:
        """The reverberation plan."""
        return self.prepared.plan

    @cached_property
    def remaining_path_settings(self) -> PathSettings:
        """The path settings without the seabed and, if no beam reaches any target, without targets."""
        reaches_target = "target" in self.path_settings.contributions and self._may_reach_target()
        return self.prepared.remaining_path_settings if reaches_target else self.prepared.path_settings_without_targets

    def _may_reach_target(self) -> bool:
        """Return True if the two-way gain may reach the beam cutoff at any target, or if a target casts no shadow."""
        scene = self.scene
        if len(scene.targets) > len(scene.occluders):
            return True
        if not scene.occluders:
            return False
        origin = self.ping_geometry.transmit_position[:2]
        for position, is_clear in self.prepared.last_check:
            distance = math.dist(origin, position)
            if is_clear and distance <= RECHECK_DISTANCE:
                return False
            if not is_clear and distance <= RECHECK_DISTANCE / 4:
                return self._may_reach_target_within(0.0)
        is_clear = not self._may_reach_target_within(RECHECK_DISTANCE)
        self.prepared.last_check[:] = [(origin, is_clear)]
        return not is_clear and self._may_reach_target_within(0.0)

    def _may_reach_target_within(self, displacement: float) -> bool:
        """Return True if the two-way gain may reach the cutoff at a target within a displacement of the sonar [m]."""
        bounding_cylinders = self.plan.bounding_cylinders[:, :3]
        top, base = _target_depth_limits(self.scene)
        cutoff_gain = float(amplitude_ratio(self.path_settings.beam_cutoff_db))
        bound = two_way_gain_bound(
            bounding_cylinders[:, :2], bounding_cylinders[:, 2] + displacement, self.ping_geometry, (top + base) / 2,
            self.rays, self.path_settings.followed_families, rise=(base - top) / 2,
        )  # fmt: skip
        return bool((bound >= cutoff_gain).any())

    def accumulate(
        self, map_function: Mapper, accumulate_samples: Callable[[ReverberationSamples], Any], *, labelled: bool = False
    ) -> list[Any]:
        """Evaluate the seabed, one set of radials after the other.

        Args:
            map_function: A function like `map`, by which missing tiles of the terrain are drawn.
            accumulate_samples: Function of the samples of each set, in arrays that the next set overwrites.
            labelled: True: the samples have `Origins`.

        Returns:
            Results of `accumulate_samples`.
        """
        terrain, window = self.scene.seabed.terrain, self.window
        if terrain is None:
            nodes, tile_row = empty_terrain_map()
            tiles = MapTiles(1.0, tile_row, nodes, is_flat=True)
            return [accumulate_samples(self._samples(radial_set, tiles, labelled)) for radial_set in self.radial_sets]
        heightmap = terrain_map(terrain)
        tile_row = np.zeros((window.side, window.side), np.uint32)
        with heightmap.reading(window.corner + window.crossed, map_function) as rows:
            tile_row[tuple(window.crossed.T)] = rows
            tiles = MapTiles(heightmap.cell, tile_row, heightmap.nodes, is_flat=False)
            return [accumulate_samples(self._samples(radial_set, tiles, labelled)) for radial_set in self.radial_sets]

    def _samples(self, radial_set: RadialSet, tiles: MapTiles, labelled: bool) -> ReverberationSamples:
        """Samples of some radials, with their legs and the weight of each sample of each pair of families."""
        seabed, ping_geometry, plan = self.scene.seabed, self.ping_geometry, self.plan
        frame = RadialFrame(*self.window.start, self.prepared.heading, plan.step)
        channel = IsovelocityChannel(
            float(ping_geometry.transmit_position[2]), seabed.depth, ping_geometry.sound_speed,
            ping_geometry.wavelength, (seabed.depth, seabed.depth) if seabed.terrain is None else seabed.terrain.span,
        )  # fmt: skip
        legs, pairs, interference_ranges = _allocate(radial_set, plan)
        range_count = kernel.walk_radials(
            frame, channel, radial_set, tiles, plan.table, legs, pairs, interference_ranges
        )
        terrain = seabed.terrain
        if terrain is not None and terrain.span[0] < terrain.span[1]:
            reflect_at_fitted_planes(self.rays, terrain, ping_geometry, plan, radial_set, legs)
        unlit = unlit_rows(plan, legs, pairs) if labelled else None
        positions: Callable[[], Floats] = partial(sample_positions, ping_geometry, radial_set, legs)
        positions = cache(positions) if labelled else positions
        shaded = self._apply_target_shadows(radial_set, legs, positions()) if radial_set.passes_target.any() else None
        if seabed.texture is not None:
            factor = self._texture(radial_set.radials, legs).astype(np.float32)
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
            pairs.weight, interference_ranges[:range_count], origins,
        )  # fmt: skip

    def _texture(self, radials: Floats, legs: RadialLegs) -> Floats:
        """Factor of the seabed's texture on the cross section at the samples of some radials [1], shape (n,)."""
        bearing = np.arctan2(radials[:, column.SINE], radials[:, column.COSINE]) + self.prepared.heading
        bearing = np.repeat(bearing, np.diff(legs.radial_offsets))
        direction = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        origin = self.ping_geometry.transmit_position[:2]
        return self.scene.seabed.texture_factor(origin + legs.range_depth[0, : len(bearing), None] * direction)

    def _apply_law(
        self, transmit_direction: NDArray[np.float32], receive_direction: NDArray[np.float32],
        normal: NDArray[np.float32], rows: NDArray[np.int32], weight: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """Multiply the areas that samples of one pair represent by the law's cross section per area.

        Args:
            transmit_direction: Direction of the transmit leg at all samples, away from the sonar [1], (3, n).
            receive_direction: The same of the receive leg, opposite to that of the scattered sound [1], (3, n).
            normal: Unit normals into the water at all samples, (3, n).
            rows: Indices of the samples of the pair, (m,).
            weight: Area of each sample of the pair [m^2], changed in place, (m,).
        """
        directions = _SCRATCH.array("law directions", (9 * DIRECTIONS_PER_BATCH,), np.float32)
        values = _SCRATCH.array("law", (DIRECTIONS_PER_BATCH,), np.float32)
        for begin in range(0, len(rows), DIRECTIONS_PER_BATCH):
            batch = rows[begin : begin + DIRECTIONS_PER_BATCH]
            incident, scattered, normals = directions[: 9 * len(batch)].reshape(3, 3, len(batch))
            kernel.gather_directions(transmit_direction, receive_direction, normal, batch, incident, scattered, normals)
            self.plan.law.fill(incident, scattered, normals, values[: len(batch)])
            weight[begin : begin + DIRECTIONS_PER_BATCH] *= values[: len(batch)]

    def _apply_target_shadows(self, radial_set: RadialSet, legs: RadialLegs, positions: Floats) -> ShadedSamples | None:
        """Multiply leg amplitudes on radials that cross a target by their visibility; return these legs, if any.

        Args:
            radial_set: The radials.
            legs: Legs to their samples, of which those beyond the nearest target are changed in place.
            positions: North, east, depth of the samples [m], shape (3, n).
        """
        position = self.ping_geometry.transmit_position
        north, east, radius = self.plan.bounding_cylinders[:, :3].T
        nearest = (np.hypot(north - position[0], east - position[1]) - radius).min()
        passes = np.repeat(radial_set.passes_target, np.diff(legs.radial_offsets))
        row = np.flatnonzero(passes & (legs.range_depth[0, : len(passes)] > nearest))
        if not len(row):
            return None
        points, normals = (
            np.ascontiguousarray(columns.take(row, axis=1).T, float) for columns in (positions, legs.normal)
        )
        edge_diffraction = self.path_settings.edge_diffraction
        shaded = shaded_legs(self.rays, self.ping_geometry, self.plan, edge_diffraction, points, normals)
        legs.amplitude[:, row] *= shaded.visibility
        return ShadedSamples(row, shaded)


def _allocate(radial_set: RadialSet, plan: ReverberationPlan) -> tuple[RadialLegs, PairSamples, NDArray[np.int64]]:
    """Arrays to be filled: legs to samples, samples of pairs, and interference ranges."""
    f, p, is_complete = len(plan.families), len(plan.allocation.pair), radial_set.radials is plan.radials
    points, size, range_count = (
        plan.sample_sizes if is_complete else sizes_of_lists(radial_set.lists, radial_set.list_rows)
    )
    legs = RadialLegs(
        np.empty(len(radial_set.radials) + 1, np.int64), _SCRATCH.array("point", (2, points), np.float64),
        _SCRATCH.array("normal", (3, points), np.float32), _SCRATCH.array("delay", (f, points), np.float64),
        _SCRATCH.array("amplitude", (f, points), np.complex64), _SCRATCH.array("departure", (f, 3, points), np.float32),
        _SCRATCH.array("arrival", (f, 3, points), np.float32),
    )  # fmt: skip
    pairs = PairSamples(
        _SCRATCH.array("rows", (p, size), np.int32),
        _SCRATCH.array("weight", (p, size), np.float32),
        np.empty(p, np.int64),
    )
    return legs, pairs, _SCRATCH.array("interference", (range_count, 2), np.int64)


def prepare_fast_reverberation(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, rays: PropagationModel
) -> FastReverberation | None:
    """Prepare fast reverberation of one ping; None where the scene does not meet its conditions.

    Conditions: straight rays, or refracted ones of a `refraction_table`; `geometry: 3d`; transmitter and receiver at
    one position, one receive channel, no hull; no reflections by faces of targets; boundaries that reflect specularly
    only; a seabed that scatters by a compiled law, lies wholly below the sonar, and fits the terrain cache.

    Args:
        scene: The scene.
        path_settings: Path settings.
        ping_geometry: The sonar at this ping.
        rays: Propagation model of the scene.

    Example:
        >>> from insonify.simulator import build_simulator
        >>> ripples = {"kind": "ripples", "wavelength": "2 m", "height": "10 cm"}
        >>> scenario = insonify.load_scenario("sidescan.yaml").with_({"field": "incoherent", "seabed.relief": ripples})
        >>> simulator = build_simulator(scenario)
        >>> engine, geometry = simulator.engine, simulator.ping_geometry(40)
        >>> prepare_fast_reverberation(engine.scene, scenario.paths, geometry, engine.rays).plan.families
        ('D', 'S')
        >>> in_slice = insonify.PathSettings(geometry="slice")
        >>> print(prepare_fast_reverberation(engine.scene, in_slice, geometry, engine.rays))
        None
    """
    if not ping_geometry.is_monostatic or ping_geometry.hull is not None:
        return None
    if reflecting_faces(scene, path_settings, ping_geometry.frequency):
        return None
    # a sonar at the same depth and attitude has the same objects at the next ping
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
    radial_sets = _radial_sets(rays, path_settings, ping_geometry, prepared)
    window = terrain_window(scene.seabed.terrain, ping_geometry, prepared.plan.step, radial_sets, prepared.farthest)
    if window is None:
        return None
    return FastReverberation(scene, rays, path_settings, ping_geometry, prepared, radial_sets, window)


def _radial_sets(
    rays: PropagationModel, path_settings: PathSettings, ping_geometry: PingGeometry, prepared: PreparedReverberation
) -> list[RadialSet]:
    """Radials of one ping: those of its plan, and narrow ones in place of those that targets shade."""
    plan = prepared.plan
    passing = radials_crossing_targets(plan, ping_geometry, prepared.heading, path_settings.edge_diffraction)
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
    """Tables for a ping and those like it; None where the scene does not meet the conditions."""
    seabed, terrain = scene.seabed, scene.seabed.terrain
    law = seabed.law(ping_geometry.frequency, float(scene.water.sound_speed_at(seabed.depth)))
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
    cutoff_gain = float(amplitude_ratio(path_settings.beam_cutoff_db))
    refraction = _refraction(rays, ping_geometry, families, window_range.farthest)
    if refraction is None:
        return None
    climbs = None
    if refraction.nodes.size:
        images = np.array([image_depth(name, source, seabed.depth) for name in families])
        climbs = partial(zone_climbs, refraction, images, ping_geometry.sound_speed, seabed.depth)
    heading = 0.0 if terrain is None else terrain.relief.resolved.scatterer_grid.heading
    boundary = ViewedBoundary(seabed.depth, families, rise, climbs)
    radials = radials_in_view(ping_geometry, boundary, window_range, sampling, cutoff_gain, heading)
    lines = RadialLines(radials, step, heading)
    compiled = law if isinstance(law, CompiledLaw) else compiled_once(law)
    plan = plan_reverberation(rays, ping_geometry, families, compiled, lines, rise, refraction)
    has_echoes = boundary_echo_families(path_settings, two_platforms=ping_geometry.receive_track_extent is not None)
    unused = () if has_echoes else (BOUNDARY_ECHO,)
    remaining, without_targets = (
        _reduced_path_settings(path_settings, scene, (*unused, *further)) for further in ((), ("target",))
    )
    return PreparedReverberation(plan, heading, window_range.farthest, remaining, without_targets)


_TABLES: RecentResults[RefractionTable | None] = RecentResults(8)


def _refraction(
    rays: StraightRays | RefractedRays, ping_geometry: PingGeometry, families: tuple[str, ...], farthest: float
) -> RefractionTable | None:
    """Refraction table, cached for all pings at one depth; None where rays of a family cannot be interpolated."""
    if isinstance(rays, StraightRays):
        return STRAIGHT
    frequency, source = ping_geometry.frequency, float(ping_geometry.transmit_position[2])
    if not rays.uses_tables(frequency):
        return None
    absorption = absorption_exponent(absorption_db(rays.scene.water, frequency))
    rays_from_sonar = RaysFromDepth(rays, source, ping_geometry.sound_speed, absorption)
    return _TABLES.get(
        (Identity(rays), source, families, frequency, farthest),
        lambda: refraction_table(
            rays_from_sonar, families, bounce_tables(families)[2], ping_geometry.wavelength, farthest
        ),
    )


@lru_cache(maxsize=16)
def _reduced_path_settings(path_settings: PathSettings, scene: Scene, further: tuple[str, ...]) -> PathSettings:
    """The path settings without the seabed, surface and water where they do not scatter, and further contributions."""
    omitted = ["seabed", *further]
    omitted += ["surface"] if scene.surface.scattering is None else []
    omitted += [] if scene.water.scatters else ["water"]
    remaining = tuple(contribution for contribution in path_settings.contributions if contribution not in omitted)
    return path_settings.unchecked_copy(contributions=remaining)


@lru_cache(maxsize=8)
def _target_depth_limits(scene: Scene) -> tuple[float, float]:
    """Depths of the highest top and of the deepest base of all targets that cast shadows [m]."""
    surfaces = [world_triangles(solid, scene.seabed) for solid in scene.solids]
    tops = [*scene.bodies[:, 6], *(float(surface.low[2]) for surface in surfaces)]
    bases = [*scene.bodies[:, 7], *(float(surface.high[2]) for surface in surfaces)]
    return float(min(tops)), float(max(bases))
