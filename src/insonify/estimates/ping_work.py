"""Work of one ping: scatterers, legs, pairs and transforms, counted without drawing any, and priced.

The seabed in reach is divided into rings and sectors; where the gain exceeds the cutoff, the density of scatterers is
summed. Targets are counted by the area of their faces, at a few pings, where beams and window reach them; faces turned
away are reached but scatter nothing back.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insonify.engines import polar_grid
from insonify.engines.beam_importance import BEARINGS, BeamImportance
from insonify.engines.face_images import face_images
from insonify.engines.glint_spread import glint_spread
from insonify.engines.hull_reflection import hull_families
from insonify.engines.memory_budget import legs_per_point
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.resolution import receivable_range
from insonify.engines.targets import solid_pieces, target_count
from insonify.engines.volume import VolumeScatterers
from insonify.estimates import unit_costs
from insonify.estimates.boundary_points import BoundaryPoints, points_on_boundary
from insonify.estimates.diffraction_work import diffraction_seconds_on_seabed, diffraction_seconds_on_targets
from insonify.estimates.facet_work import facet_work
from insonify.estimates.terrain_work import distinct, tiles_in_reach, tiles_under_radials, tiles_under_rings
from insonify.estimates.wave_work import wave_leg_seconds
from insonify.propagation.families import (
    DIRECT,
    bottom_bounces,
    families_reaching,
    image_depth,
    surface_bounces,
)
from insonify.propagation.glints import MIN_COHERENT_FACTOR, glint_surface
from insonify.propagation.image_sources import StraightRays
from insonify.scattering.lambert import Lambert
from insonify.scenario.density_warnings import scattering_boundaries
from insonify.scene.scatterers import Boundary
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.scene.target import PointTarget
from insonify.simulator import Simulator
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.two_way_beam import two_way_width
from insonify.synthesis.direction_grid import WIDTH, direction_grid
from insonify.synthesis.label_accumulator import POINTS
from insonify.synthesis.time_grid import OVERSAMPLING
from insonify.synthesis.waveform_basis import waveform_basis

Floats = NDArray[np.float64]

STATIONS = 12
"""Distances, and depths, at which pairs of legs to points in the water are counted [1]."""
TARGET_PINGS, TARGET_LOOKS = 9, 300
"""Most pings at which targets are counted, and counts of single targets from which on there are fewer pings [1]."""
LARGEST = 20
"""Targets that are counted for their size, and as many of the others [1]."""


@dataclass(frozen=True, slots=True)
class PingWork:
    """Work of one ping, or of some part of it."""

    points: float = 0.0
    """Scatterers [1]."""
    seconds: float = 0.0
    """Processor time [s]."""
    tiles: float = 0.0
    """Tiles of the boundaries [1]."""
    pieces: tuple[float, ...] = ()
    """Pieces that each body is cut into, once for all pings [1]."""
    facets: float = 0.0
    """Memory of the facets of smooth targets during the whole ping [bytes]."""
    facet_block: float = 0.0
    """Memory of the work on some facets at a time, in place of a block of other scatterers [bytes]."""
    terrain_tiles: float = 0.0
    """Tiles of the seabed's height map, synthesised once [1]."""

    def __add__(self, other: "PingWork") -> "PingWork":
        """Both together."""
        return PingWork(
            self.points + other.points, self.seconds + other.seconds, self.tiles + other.tiles,
            self.pieces + other.pieces, max(self.facets, other.facets), max(self.facet_block, other.facet_block),
            self.terrain_tiles + other.terrain_tiles,
        )  # fmt: skip


def ping_work(simulator: Simulator, *, labels: bool = False) -> PingWork:
    """Work of the first ping of a run, all sides; that on targets is the mean of a few pings.

    Args:
        simulator: A prepared scenario.
        labels: True if its samples are labelled too.
    """
    total = sum((_side_work(simulator, side) for side in simulator.ping_geometries(0)), PingWork())
    total += _on_targets(simulator)
    total = replace(total, terrain_tiles=min(total.terrain_tiles, tiles_in_reach(simulator)))  # sides overlap
    if labels:
        more = label_work(simulator)
        total = replace(
            total, seconds=total.seconds + more.seconds, tiles=max(total.tiles, more.tiles),
            terrain_tiles=max(total.terrain_tiles, more.terrain_tiles),
        )  # fmt: skip
    return total


def label_work(simulator: Simulator) -> PingWork:
    """Work of the labels of one ping: those of an expectation of its own, and a position for each pair."""
    scenario = simulator.scenario
    fewer = min(scenario.paths.scatterers_per_cell, POINTS)
    paths = scenario.paths.unchecked_copy(scatterers_per_cell=fewer, engine="eigenrays")
    # unchecked: an expectation's work is counted, though sub-bands and the like are for pressures
    expected = replace(simulator, scenario=scenario.unchecked_copy(field="incoherent", paths=paths), tracer=None)
    total, names, has_pair_curves = _on_targets(expected, label=True), simulator.label_names, False
    for side in simulator.ping_geometries(0):
        fast = _label_swath(simulator, side)
        total += _boundaries(expected, side, label=True, seabed=fast is None) + _water(expected, side, label=True)
        total, has_pair_curves = total + (fast or PingWork()), has_pair_curves or fast is None
    # in fast reverberation pairs share the curve of the object
    curves = (len(names.objects) + len(names.pairs) * has_pair_curves) * scenario.sonar.channel_count
    return replace(
        total,
        seconds=total.seconds + curves * transform_seconds(simulator, expected=True),
        pieces=(),
        facets=0.0,
        facet_block=0.0,
    )


def transform_seconds(simulator: Simulator, *, expected: bool, shapes: int = 1) -> float:
    """Processor time from cells to a time series in one channel [s].

    Args:
        simulator: A prepared scenario.
        expected: True if the series is an expected intensity.
        shapes: Waveforms that it is a sum of.
    """
    cells = simulator.grid.padded_samples
    return float(unit_costs.SECONDS_PER_CELL[expected] * cells * np.log2(cells) * (1 + shapes) / 2)


def _side_work(simulator: Simulator, ping_geometry: PingGeometry) -> PingWork:
    """Work of one side of the sonar at one ping, but for targets."""
    scenario = simulator.scenario
    expected, shapes = scenario.field == "incoherent", waveform_count(ping_geometry)
    beams = scenario.sonar.beam_count
    slow = expected and simulator.tracer is None and _fast_reverberation_steps(simulator, ping_geometry) is None
    start = unit_costs.PING_SECONDS + unit_costs.EXPECTED_SECONDS * slow
    start += unit_costs.ELEMENTS_SECONDS * (ping_geometry.elements is not None)
    if expected and simulator.tracer is None:
        cells = 2 * OVERSAMPLING * simulator.grid.sample_count
        start += _expected_rows(simulator, ping_geometry) * beams * cells * unit_costs.SECONDS_PER_ROW_PRODUCT
    grid = direction_grid(ping_geometry) if ping_geometry.sub_bands else None
    if grid is None:
        start += beams * transform_seconds(simulator, expected=expected, shapes=shapes)
    else:
        start += (grid.row_count * shapes + beams) * transform_seconds(simulator, expected=expected, shapes=0)
        phasors = len(grid.points.position) * (grid.row_count + beams) * simulator.grid.padded_samples
        start += unit_costs.SECONDS_PER_PHASOR * phasors
    fixed = PingWork(seconds=start)
    if scenario.paths.geometry == "slice":
        return fixed + _slice(simulator, ping_geometry)
    if simulator.tracer is not None:
        rays = float(scenario.paths.rays)
        tiles = distinct(rays, tiles_in_reach(simulator))
        return fixed + PingWork(rays, rays * unit_costs.SECONDS_PER_RAY, terrain_tiles=tiles)
    return fixed + _boundaries(simulator, ping_geometry) + _water(simulator, ping_geometry)


def _slice(simulator: Simulator, ping_geometry: PingGeometry) -> PingWork:
    """Points along the one line of each boundary, and their pairs."""
    scenario = simulator.scenario
    seen = ping_scatterers(
        simulator.engine.scene, scenario.paths, scenario.seed, ping_geometry, simulator.engine.rays,
        quadrature=scenario.field == "incoherent",
    )  # fmt: skip
    total = PingWork(seconds=unit_costs.SECONDS_PER_SLICE_PING)
    for boundary, boundary_depth, kept, law in scattering_boundaries(scenario):
        reach = receivable_range(ping_geometry, boundary_depth, simulator.engine.rays, kept, rise=seen.rise(boundary))
        spacing = seen.resolution.slant_resolution / seen.resolution.scatterers_per_cell
        points = max(reach.farthest - reach.nearest, 0.0) / spacing
        each = sum(_legs(simulator, ping_geometry, name) for name in kept)
        each += len(kept) ** 2 * _pair_seconds(simulator, ping_geometry, law, boundary)
        total += PingWork(points, points * each)
    return total


def _boundaries(
    simulator: Simulator, ping_geometry: PingGeometry, *, label: bool = False, seabed: bool = True
) -> PingWork:
    """Scatterers of the seabed, unless it is counted apart, and of the surface."""
    scenario, total, terrain_tiles = simulator.scenario, PingWork(), 0.0
    seen = ping_scatterers(
        simulator.engine.scene, scenario.paths, scenario.seed, ping_geometry, simulator.engine.rays,
        quadrature=scenario.field == "incoherent",
    )  # fmt: skip
    steps = None if label else _fast_reverberation_steps(simulator, ping_geometry)
    for boundary, boundary_depth, kept, law in scattering_boundaries(scenario):
        if boundary == "seabed" and not seabed:
            continue
        if boundary == "seabed" and steps is not None:
            total += PingWork(steps, _swath_seconds(steps, len(kept)))
            terrain_tiles = _tiles_under_radials(simulator, ping_geometry)
            continue
        found = points_on_boundary(
            seen.ping_geometry, boundary_depth, simulator.engine.rays, kept, seen.resolution, scenario,
            seen.rise(boundary), face_images(scenario.scene, scenario.paths, ping_geometry, boundary),
        )  # fmt: skip
        points, position = found.number, found.distance
        terrain_tiles = max(terrain_tiles, _tiles_under_legs(simulator, ping_geometry, found))
        legs, pairs = _leg_and_pair_work(simulator, ping_geometry, boundary, kept, found)
        more, fold = _off_hull_and_faces(simulator, ping_geometry, boundary, kept, points, position)
        legs, pairs = legs + more, pairs * fold
        each = _pair_seconds(simulator, ping_geometry, law, boundary, label=label)
        relief = len(scenario.seabed.relief) if boundary == "seabed" else 0
        count = float(points.sum())
        if boundary == "seabed":
            legs += diffraction_seconds_on_seabed(simulator, ping_geometry, kept, points, position)
        seconds = legs + pairs * each + count * unit_costs.SECONDS_PER_TERRAIN_POINT * relief
        total += PingWork(count, seconds, found.tiles)
    return replace(total, terrain_tiles=terrain_tiles)


def _tiles_under_legs(simulator: Simulator, ping_geometry: PingGeometry, found: BoundaryPoints) -> float:
    """Tiles of the height map under the legs to the points of a boundary [1]."""
    terrain = simulator.engine.scene.seabed.terrain
    if terrain is None or not found.radius.size:
        return 0.0
    beam_width = two_way_width(ping_geometry.transmit_beams, ping_geometry.receive_beams)
    separation = float(np.linalg.norm(ping_geometry.transmit_position - ping_geometry.receive_position))
    return tiles_under_rings(
        terrain, found.on_ring, found.radius, found.in_beam, _farthest(simulator, ping_geometry) + separation,
        min(beam_width, polar_grid.MAX_CELL_WIDTH) / 3,
    )  # fmt: skip


def _farthest(simulator: Simulator, ping_geometry: PingGeometry) -> float:
    """Distance that the window reaches [m]."""
    return float(simulator.scenario.water.max_sound_speed * ping_geometry.recorded_delays[1] / 2)


def _tiles_under_radials(simulator: Simulator, ping_geometry: PingGeometry) -> float:
    """Tiles of the height map under the lines of the fast reverberation [1]."""
    terrain, reverberation = simulator.engine.scene.seabed.terrain, simulator.fast_reverberation(ping_geometry)
    if terrain is None or reverberation is None:
        return 0.0
    return tiles_under_radials(terrain, reverberation.plan.radials)


def _off_hull_and_faces(
    simulator: Simulator, ping_geometry: PingGeometry, boundary: Boundary, kept: tuple[str, ...], points: Floats,
    distance: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Processor time of legs off a hull and smooth faces to a boundary's points [s], and the factor on their pairs."""
    scenario, count = simulator.scenario, max(float(points.sum()), 1e-300)
    seconds, fold = 0.0, 1.0
    if ping_geometry.hull is not None:
        under = hull_families(kept) if boundary == "seabed" else ()
        fold *= ((len(kept) + len(under)) / len(kept)) ** 2
        each = unit_costs.SECONDS_PER_HULL_FACTOR * (len(kept) + len(under))
        seconds += count * (each + sum(_legs(simulator, ping_geometry, name) for name in under))
    images = face_images(scenario.scene, scenario.paths, ping_geometry, boundary)
    if not images or not distance.any():
        return seconds, fold
    depth = scenario.seabed.depth if boundary == "seabed" else 0.0
    importance = BeamImportance(
        ping_geometry, depth, simulator.engine.rays, kept, scenario.seabed.scatterer_grid, float(distance.max()),
        scenario.paths.importance_sampling, glint_spread(scenario.scene, ping_geometry.frequency), images,
    )  # fmt: skip
    position = importance.ring_positions(distance)
    kept_part = importance.keep_probability_of(importance.gain_at(position)).reshape(-1, BEARINGS)
    off_faces = np.zeros(len(position))
    for face_image in images:
        off_faces[face_image.lights(position, depth, np.zeros(len(position)))] += len(face_image.families)
    weight = points[:, None] * kept_part / np.maximum(kept_part.sum(axis=1, keepdims=True), 1e-300)
    off_faces = off_faces.reshape(weight.shape)
    each = unit_costs.SECONDS_PER_FACE_LEG + _legs(simulator, ping_geometry, DIRECT)
    seconds += float((weight * off_faces).sum()) * each
    return seconds, fold * float((weight * (1 + off_faces / len(kept)) ** 2).sum()) / count


def _swath_seconds(steps: float, families: int) -> float:
    """Processor time of fast reverberation for a number of steps and families of legs [s]."""
    price = unit_costs.SECONDS_PER_STEP + families * unit_costs.SECONDS_PER_STEP_LEG
    return unit_costs.SECONDS_PER_FAST_REVERBERATION + steps * price


def _label_swath(simulator: Simulator, ping_geometry: PingGeometry) -> PingWork | None:
    """Work of labels on the seabed by the fast path, of one side; None where they do not take it."""
    scenario = simulator.scenario
    kept = families_reaching("seabed", scenario.paths.followed_families)
    if (
        "seabed" not in scenario.paths.contributions
        or not kept
        or not simulator.incoherent_accumulator(ping_geometry).is_short_pulse
    ):
        return None
    labels = simulator.label_reverberation(ping_geometry)
    if labels is None:
        return None
    steps = float(labels.plan.sample_count)
    seconds = unit_costs.LABEL_SWATH_SECONDS + steps * len(kept) * unit_costs.SECONDS_PER_LABEL_STEP_LEG
    return PingWork(steps, seconds + (0.0 if simulator.shares_reverberation else _swath_seconds(steps, len(kept))))


def _water(simulator: Simulator, ping_geometry: PingGeometry, *, label: bool = False) -> PingWork:
    """Points in the water."""
    scenario = simulator.scenario
    if "water" not in scenario.paths.contributions or not scenario.water.scatters:
        return PingWork()
    seen = ping_scatterers(
        simulator.engine.scene, scenario.paths, scenario.seed, ping_geometry, simulator.engine.rays,
        quadrature=scenario.field == "incoherent",
    )  # fmt: skip
    suspended = VolumeScatterers(simulator.engine.scene, scenario.paths, scenario.seed, ping_geometry, seen.resolution)
    count, kept = suspended.count(quadrature=scenario.field == "incoherent"), scenario.paths.followed_families
    pair = _pair_seconds(simulator, ping_geometry, boundary="water", label=label)
    distance, depth = _in_the_water(simulator, ping_geometry)
    pairs = _pairs_received(simulator, ping_geometry, kept, distance, depth)
    pairs = pairs * _pairs_of_glints(simulator, ping_geometry, "water", kept, distance, depth)
    near = 1 / np.maximum(
        distance**2 + (depth - ping_geometry.transmit_position[2]) ** 2, 1.0
    )  # cells widen with the range
    pair_count = float(np.average(pairs[pairs > 0], weights=(distance * near)[pairs > 0])) if pairs.any() else 0.0
    each = sum(_legs(simulator, ping_geometry, name) for name in kept) + pair_count * pair
    each += _off_waves_apart(simulator, ping_geometry, kept)
    return PingWork(count, count * (each + unit_costs.SECONDS_PER_TERRAIN_POINT * len(scenario.seabed.relief)))


def _in_the_water(simulator: Simulator, ping_geometry: PingGeometry) -> tuple[Floats, Floats]:
    """Horizontal distances and depths of positions all over the water that the window reaches [m], shape (n,) each."""
    farthest, part = _farthest(simulator, ping_geometry), (np.arange(STATIONS) + 0.5) / STATIONS
    distance, depth = np.meshgrid(farthest * part, simulator.scenario.seabed.depth * part)
    return distance.ravel(), depth.ravel()


def _pairs_received(
    simulator: Simulator, ping_geometry: PingGeometry, kept: tuple[str, ...], distance: Floats, depth: Floats
) -> Floats:  # fmt: skip
    """Number of pairs of straight legs to positions at a distance and depth [m] within the window, (n,)."""
    lengths, bed = [], simulator.scenario.seabed.depth
    for end in (ping_geometry.transmit_position, ping_geometry.receive_position):
        images = np.array([image_depth(name, float(end[2]), bed) for name in kept])
        lengths.append(np.hypot(distance, depth - images[:, None]))
    both = lengths[0][:, None] + lengths[1]
    first, last = (ping_geometry.sound_speed * delay for delay in ping_geometry.recorded_delays)
    return np.asarray(((both >= first) & (both <= last)).sum(axis=(0, 1)), float)


def _pairs_of_glints(
    simulator: Simulator, ping_geometry: PingGeometry, boundary: Boundary, kept: tuple[str, ...], distance: Floats,
    depth: Floats,
) -> Floats:  # fmt: skip
    """Pairs of random scatterers with glints for each pair of families [1], shape (n,); 1 for an expectation.

    Legs off a rough surface have glints, and a coherent part unless it is negligible at their grazing angle.
    """
    scene, frequency = simulator.engine.scene, ping_geometry.frequency
    if simulator.scenario.field != "coherent" or not scene.is_rough(kept) or scene.surface.reflection == "explicit":
        return np.ones(len(distance))
    legs = np.full(len(distance), float(legs_per_point(scene, simulator.scenario.paths, boundary, drawn=True)))
    glints = legs - len(kept)
    waves = glint_surface(scene, simulator.scenario.seed, frequency).waves
    if waves is not None:
        height = float(ping_geometry.transmit_position[2]) + depth
        phase_per_height = 4 * np.pi * frequency / ping_geometry.sound_speed * height / np.hypot(distance, height)
        coherent_factor = np.exp(-(phase_per_height**2) * float(waves.variance[-1]) / 2)
        legs -= np.where(coherent_factor > MIN_COHERENT_FACTOR, 0, sum(surface_bounces(name) > 0 for name in kept))
    return np.asarray((legs**2 - glints) / len(kept) ** 2)  # no pairs of one glint with itself


def _leg_and_pair_work(
    simulator: Simulator, ping_geometry: PingGeometry, boundary: Boundary, kept: tuple[str, ...], found: BoundaryPoints
) -> tuple[float, float]:
    """Processor time of the legs to scatterers at some distances [s], and the number of pairs evaluated there."""
    points, position = found.number, found.distance
    off_waves = float(points @ _off_waves(simulator, ping_geometry, kept, boundary, found))
    drawn = boundary == "seabed" and simulator.scenario.field == "coherent"
    known = simulator.engine.family_keep_probabilities(ping_geometry, position) if drawn else None
    boundary_depth = simulator.scenario.seabed.depth if boundary == "seabed" else 0.0
    glints = _pairs_of_glints(
        simulator, ping_geometry, boundary, kept, position, np.full(len(position), boundary_depth)
    )
    if known is None:
        pairs = np.full(len(position), len(kept) ** 2.0)
        if ping_geometry.receive_track_extent is None:
            pairs = _pairs_received(simulator, ping_geometry, kept, position, np.full(len(position), boundary_depth))
        count = float(points.sum())
        straight = count * sum(_legs(simulator, ping_geometry, name) for name in kept)
        return off_waves + straight, float(points @ (pairs * glints))
    families, share = known
    followed, fitted = ((points * part).sum(axis=1) for part in ((share > 0).any(axis=1), share.max(axis=1)))
    seconds = sum(
        _legs(simulator, ping_geometry, name, fitted=float(part)) * float(count)
        for name, count, part in zip(families, followed, fitted / np.maximum(followed, 1e-300), strict=True)
    )
    return off_waves + seconds, float((points * glints * share).sum())


def _off_waves(
    simulator: Simulator, ping_geometry: PingGeometry, kept: tuple[str, ...], boundary: Boundary, found: BoundaryPoints
) -> Floats:
    """Processor time of the legs off explicit waves to one scatterer of a boundary [s], shape of their distances."""
    families = sum(surface_bounces(name) > 0 for name in kept)
    if simulator.scenario.surface.reflection != "explicit" or not families or not found.number.size:
        return np.zeros(len(found.number))
    depth = simulator.scenario.seabed.depth if boundary == "seabed" else 0.0
    distance = np.where(found.distance > 0, found.distance, _farthest(simulator, ping_geometry) / 2)
    each = wave_leg_seconds(simulator, float(ping_geometry.transmit_position[2]), depth, distance, found.cell)
    return each * families * (1 if ping_geometry.is_monostatic else 2)


def _off_waves_apart(simulator: Simulator, ping_geometry: PingGeometry, kept: tuple[str, ...]) -> float:
    """Processor time of the legs off explicit waves to one of some points apart, half as far as the window reaches."""
    middle = BoundaryPoints(np.ones(1), np.zeros(1), 0.0, np.full(1, np.inf))
    return float(_off_waves(simulator, ping_geometry, kept, "seabed", middle)[0])


def _legs(simulator: Simulator, ping_geometry: PingGeometry, family: str, *, fitted: float = 1.0) -> float:
    """A core's time for the legs of one family to a scatterer from all ends [s], a part of them off fitted planes."""
    scenario = simulator.scenario
    each = unit_costs.SECONDS_PER_LEG
    if not isinstance(simulator.engine.rays, StraightRays):
        each += unit_costs.SECONDS_PER_REFRACTED_LEG
    if simulator.engine.delay_field is not None:
        each += unit_costs.SECONDS_PER_DELAY
    if scenario.seabed.relief and bottom_bounces(family):
        each += unit_costs.SECONDS_PER_FIT * fitted
    if surface_bounces(family) and scenario.surface.reflection == "explicit":
        if scenario.water.profile is not None and scenario.water.layered:
            knots = len(scenario.water.profile.depth)
            each += unit_costs.SECONDS_PER_REFRACTED_WAVE_LEG + knots * unit_costs.SECONDS_PER_WAVE_LEG_KNOT
    elif scenario.field == "coherent" and scenario.scene.is_rough((family,)):
        each += unit_costs.SECONDS_PER_GLINT
    return each * (1 if ping_geometry.is_monostatic else 2)


def _on_targets(simulator: Simulator, *, label: bool = False) -> PingWork:
    """Points on targets in one ping, all sides: means of a few pings."""
    scenario = simulator.scenario
    if "target" not in scenario.paths.contributions or not scenario.targets or scenario.paths.geometry == "slice":
        return PingWork()
    kept, scene, total, seconds = scenario.paths.followed_families, simulator.engine.scene, 0.0, 0.0
    parts = _counted_targets(scene)
    looks = int(np.clip(TARGET_LOOKS // sum(len(part.targets) for part, _ in parts), 2, TARGET_PINGS))
    pings = sorted(set(np.linspace(0, scenario.track.ping_count - 1, looks).round().astype(int).tolist()))
    pieces: list[float] = []
    fullest: tuple[float, PingGeometry | None] = (0.0, None)
    sides = simulator.ping_geometries(pings[0])
    prices = [_pair_seconds(simulator, side, label=label) for side in sides] * len(pings)
    looked_at = [side for ping in pings for side in simulator.ping_geometries(ping)]
    for ping_geometry, pair_seconds in zip(looked_at, prices, strict=True):
        seen = ping_scatterers(scene, scenario.paths, scenario.seed, ping_geometry, simulator.engine.rays,
                               quadrature=scenario.field == "incoherent")  # fmt: skip
        pieces = pieces or [
            one for part, each in parts for one in solid_pieces(part, ping_geometry, seen.resolution) * round(each)
        ]
        drawn = seen.resolution if scenario.field == "coherent" or label else None  # labels take as few points
        slant, rays = seen.resolution.slant_resolution, simulator.engine.rays
        counts = [
            each * np.array(target_count(part, scenario.paths, ping_geometry, slant, rays, drawn))
            for part, each in parts
        ]
        points, facing = np.sum(counts, axis=0).tolist()
        total += points
        fullest = max(fullest, (points, ping_geometry), key=lambda one: one[0])
        seconds += points * sum(_legs(simulator, ping_geometry, name) for name in kept)
        seconds += points * _off_waves_apart(simulator, ping_geometry, kept)
        seconds += points * diffraction_seconds_on_targets(simulator, ping_geometry, kept)
        seconds += facing * len(kept) ** 2 * pair_seconds
    most, fullest_geometry = fullest
    if fullest_geometry is None:
        return PingWork(pieces=tuple(pieces))
    # pings that reach fewer points reach fewer facets
    facets, split, held, block = facet_work(simulator, fullest_geometry)
    part = total / len(pings) / most
    return PingWork(total / len(pings) + facets * part, seconds / len(pings) + split * part, pieces=tuple(pieces),
                facets=held, facet_block=block)  # fmt: skip


def _counted_targets(scene: Scene) -> list[tuple[Scene, float]]:
    """Scenes with the largest targets and with some of the others, and the number of targets that each stands for."""
    if len(scene.targets) <= 2 * LARGEST:
        return [(scene, 1.0)]
    area = [0.0 if isinstance(one, PointTarget) else float(world_triangles(one, scene.seabed).area.sum())
            for one in scene.targets]  # fmt: skip
    order = np.argsort(area)[::-1]
    others = order[LARGEST:]
    sample = others[np.linspace(0, len(others) - 1, LARGEST).round().astype(int)]
    return [
        (scene.unchecked_copy(targets=tuple(scene.targets[row] for row in rows)), each)
        for rows, each in ((order[:LARGEST], 1.0), (sample, len(others) / LARGEST))
    ]


def _fast_reverberation_steps(simulator: Simulator, ping_geometry: PingGeometry) -> float | None:
    """Steps along the lines of the seabed by which one side is received fast reverberation; None where it is not."""
    if simulator.scenario.field == "coherent" or not simulator.incoherent_accumulator(ping_geometry).is_short_pulse:
        return None
    reverberation = simulator.fast_reverberation(ping_geometry)
    return None if reverberation is None else float(reverberation.plan.sample_count)


def waveform_count(ping_geometry: PingGeometry) -> int:
    """Waveforms that the sound of each channel, or of each row of a direction grid, is a sum of."""
    basis = waveform_basis(ping_geometry)
    return len(basis.band) * len(basis.doppler)


def _expected_pair_seconds(
    simulator: Simulator, ping_geometry: PingGeometry, section: float, boundary: Boundary
) -> float:
    """Processor time for the expectation of one pair of families in all channels of one side [s]."""
    scenario = simulator.scenario
    channels = 1 if _expected_rows(simulator, ping_geometry) else scenario.sonar.beam_count
    if not ping_geometry.is_monostatic:
        return unit_costs.SECONDS_PER_PAIR_APART * channels + (
            unit_costs.SECONDS_PER_SURFACE_SECTION if section and boundary == "surface" else section
        )
    kept = len(families_reaching(boundary, scenario.paths.followed_families))
    legs = legs_per_point(simulator.engine.scene, scenario.paths, boundary, drawn=boundary == "water")
    glints = (legs**2 - kept**2) / kept**2
    pair, beam = np.add(unit_costs.SECONDS_PER_EXPECTED_PAIR, np.multiply(glints, unit_costs.SECONDS_PER_GLINT_PAIR))
    return float(section + pair + beam * channels)


def _expected_rows(simulator: Simulator, ping_geometry: PingGeometry) -> int:
    """Rows of directions of an expectation, on which pairs are deposited once for all beams; 0: none."""
    directions = simulator.incoherent_accumulator(ping_geometry).directions
    return 0 if directions is None else directions.beam_powers.shape[1]


def _pair_seconds(
    simulator: Simulator, ping_geometry: PingGeometry, law: object = None, boundary: Boundary = "target", *,
    label: bool = False,
) -> float:  # fmt: skip
    """Processor time for one pair of legs in all channels of one side [s], by a law; None: one without angles."""
    beams = simulator.scenario.sonar.beam_count
    section = 0.0 if law is None or isinstance(law, Lambert) else unit_costs.SECONDS_PER_SECTION
    if label:
        on_rows = ping_geometry.is_monostatic and simulator.label_accumulator(ping_geometry).directions is not None
        channels = 1 if on_rows else beams
        return section + (unit_costs.SECONDS_PER_PAIR + unit_costs.SECONDS_PER_LABEL) * channels
    if simulator.scenario.field == "incoherent":
        return _expected_pair_seconds(simulator, ping_geometry, section, boundary)
    on_rows = direction_grid(ping_geometry) is not None
    if ping_geometry.is_static and ping_geometry.elements is None and not (ping_geometry.sub_bands or on_rows):
        return section + unit_costs.SECONDS_PER_PAIR * beams
    # beams are evaluated anew for each sub-band, elements for all of them together
    passes = 1 if ping_geometry.elements is not None else max(1, len(ping_geometry.sub_bands))
    shapes = unit_costs.SECONDS_PER_WAVEFORM * (waveform_count(ping_geometry) / passes - 1)
    deposits = WIDTH if on_rows else beams
    return section + passes * (unit_costs.SECONDS_PER_PAIR + (unit_costs.SECONDS_PER_ELEMENT + shapes) * deposits)
