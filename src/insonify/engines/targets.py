"""Targets as points, as dense as the sonar's resolution over its whole track requires.

Cells follow from the closest approach of the whole track and from the slowest water at the target, never from one
ping's distance or the sound speed at its depth, so that a position on a target has the same phase in every ping.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._resolution_kernel import MAX_ELONGATION
from insonify.engines.drawn_bodies import DrawnBodies
from insonify.engines.face_images import face_images
from insonify.engines.face_reflection import reflecting_faces
from insonify.engines.facet_subdivision import joined_facets, smooth_facets, solid_insonification
from insonify.engines.glint_spread import glint_spread
from insonify.engines.patch_subdivision import TargetInsonification
from insonify.engines.resolution import Resolution, track_sound_speed, two_way_gain_bound
from insonify.engines.target_culling import (
    MAX_UNCULLED,
    POINTS_PER_SPHERE,
    cull_points,
    facing,
    facing_both_ends,
    rows_in_reach,
)
from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.propagation.families import DIRECT, families_reaching
from insonify.propagation.image_sources import StraightRays
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.scene.box import ReachTest, box_body, box_cells, box_scatterers, box_section
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, point_scatterer, seabed_depth_under
from insonify.scene.seabed import Seabed
from insonify.scene.solid import cell_side, seabed_depth_at, solid_scatterers, surface_area, world_triangles
from insonify.scene.solid_section import solid_section
from insonify.scene.surface_cells import MAX_PIECE_SIDE, estimated_piece_count, even_points
from insonify.scene.target import Box, PointTarget, Solid, solids_of_one_law, whole_solid
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.two_way_beam import two_way_footprint
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

FACE_CELLS = 3.0
"""Number of cells of a target's face per range resolution, in each direction."""
FRINGE_CELLS = 8.0
"""Number of cells up a target's face per interference fringe of its direct and its bottom path."""
FRINGE_POINTS = 20_000
"""Number of points of a solid up to which its cells resolve these fringes [1]."""
REACH_SAMPLE_POINTS = 10_000
"""Number of points from which the fraction of a large target that one ping can receive is estimated [1]."""
SPARSE_POINTS = 5_000
"""Number of sparse points below which a body keeps all [1]."""
MIN_DISTANCE = 0.1
"""Distance to a body below which resolution cells on it get no narrower [m]."""
LEEWAY = 0.02
"""Angle added to the extent of a body before its gain is compared with the beam cutoff [rad]."""
MIN_TRAVEL_TIME_RATIO = 0.95
"""Least time of a refracted path, as a part of the straight one's [1]."""


def target_points(
    scene: Scene, path_settings: PathSettings, seed: int, ping_geometry: PingGeometry, slant: float, *,
    quadrature: bool, rays: PropagationModel | None = None, resolution: Resolution | None = None,
    received: Sequence[bool] | None = None,
) -> list[Scatterers]:  # fmt: skip
    """The points of all targets that one ping can receive, target by target.

    Args:
        scene: The scene.
        path_settings: Path settings: all of the scene, or a slice.
        seed: Seed of the scenario.
        ping_geometry: The sonar at this ping.
        slant: Resolution along the slant range [m].
        quadrature: True: quadrature points for an expectation. False: random ones.
        rays: Propagation model of the scene; None: targets below the beam cutoff are not dropped.
        resolution: Resolution cells, which limit the number of points on targets of many random or sparse points; None:
            all points.
        received: From `received_targets`; None: evaluated.
    """
    fully = quadrature and not (resolution is not None and resolution.sparse)
    cells = None if fully or path_settings.geometry == "slice" else resolution
    blocks = []
    is_direct = _follows_direct_paths_alone(scene, path_settings, ping_geometry, rays)
    received = received or received_targets(scene, path_settings, ping_geometry, rays)
    for target in [candidate for candidate, is_received in zip(scene.targets, received, strict=True) if is_received]:
        if isinstance(target, PointTarget):
            blocks.append(point_scatterer(target))
            continue
        is_slice = path_settings.geometry == "slice"
        smooth: list[Scatterers] = []
        for faces in solids_of_one_law(target):
            insonification = partial(solid_insonification, scene, faces, path_settings, ping_geometry, slant, rays)
            points = (
                _section(scene, seed, ping_geometry, slant, faces, quadrature=quadrature)
                if is_slice
                else _points_of(scene, seed, ping_geometry, slant, faces, cells, insonification, quadrature=quadrature)
            )
            blocks.append(facing_both_ends(points, ping_geometry) if is_direct else points)
            if faces.face_reflection_coefficient and len(points):
                smooth.append(smooth_facets(scene, faces, path_settings, ping_geometry, slant, rays))
        blocks += [joined_facets(smooth)] if smooth else []
    return blocks


def _follows_direct_paths_alone(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, rays: PropagationModel | None
) -> bool:
    """True where all legs to targets are direct and straight; edges change only their visibility."""
    is_direct = path_settings.followed_families == (DIRECT,)
    is_plain = ping_geometry.hull is None and not reflecting_faces(scene, path_settings, ping_geometry.frequency)
    return is_direct and is_plain and isinstance(rays, StraightRays)


def received_targets(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, rays: PropagationModel | None = None
) -> tuple[bool, ...]:
    """True for each target of which an echo may be within beams and window of a ping.

    Args:
        scene: The scene.
        path_settings: Path settings: all of the scene, or a slice.
        ping_geometry: The sonar at this ping.
        rays: See `target_points`.
    """
    return tuple(
        isinstance(target, PointTarget)
        or (
            _may_fall_in_window(target, scene, ping_geometry)
            and (path_settings.geometry == "slice" or _within_beams(scene, target, path_settings, ping_geometry, rays))
        )
        for target in scene.targets
    )


class TargetPointCount(NamedTuple):
    """Approximate number of points on targets in reach of one ping."""

    reached: float
    """Number of points to which legs are followed [1]."""
    facing: float
    """Number of these on faces towards the sonar: others scatter nothing back [1]."""


def target_count(
    scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry, slant: float,
    rays: PropagationModel | None = None, resolution: Resolution | None = None,
) -> TargetPointCount:  # fmt: skip
    """Approximate number of points on targets that one ping can receive, from the area of faces, without drawing any.

    Args:
        scene: The scene.
        path_settings: Path settings.
        ping_geometry: The sonar.
        slant: Resolution along the slant range [m].
        rays: See `target_points`.
        resolution: See `target_points`.
    """
    points_reached = facing = 0.0
    for target in scene.targets:
        if isinstance(target, PointTarget):
            points_reached, facing = points_reached + 1, facing + 1
            continue
        surface = world_triangles(target, scene.seabed)
        if not (
            _may_fall_in_window(target, scene, ping_geometry)
            and _within_beams(scene, target, path_settings, ping_geometry, rays)
        ):
            continue
        middle, down = surface.corners.mean(axis=1), surface.corners[..., 2]
        low, high = down.min(axis=1), down.max(axis=1)
        fraction_in_water = np.clip(
            (seabed_depth_at(scene.seabed, middle[:, :2]) - low) / np.maximum(high - low, 1e-9), 0, 1
        )
        points = (
            np.nan_to_num(fraction_in_water) * surface.area / _cells(scene, target, ping_geometry, slant, resolution)
        )
        towards = float(points[np.sum((ping_geometry.transmit_position - middle) * surface.normal, axis=1) > 0].sum())
        if path_settings.geometry != "slice" and points.sum() > MAX_UNCULLED:
            fraction = _fraction_in_reach(
                target,
                scene,
                solid_insonification(scene, target, path_settings, ping_geometry, slant, rays),
                float(points.sum()),
            )
            points_reached = points_reached + float(points.sum()) * fraction
            facing = facing + min(towards, float(points.sum()) * fraction)
            continue
        points_reached, facing = points_reached + float(points.sum()), facing + towards
    if _follows_direct_paths_alone(scene, path_settings, ping_geometry, rays):
        points_reached = facing
    return TargetPointCount(points_reached, facing)


def _fraction_in_reach(target: Solid, scene: Scene, insonification: TargetInsonification, points: float) -> float:
    """Fraction of a target's points in reach of one ping [1], estimated from a sample of them."""
    position, normal = _coarse(target, scene.seabed)
    if not len(position):
        return 0.0
    # runs as far across as those of all its points, which lie along narrow strips
    run = int(np.clip(2 * POINTS_PER_SPHERE * len(position) / points, 1, POINTS_PER_SPHERE))
    return len(rows_in_reach(position, normal, insonification, run)) / len(position)


@lru_cache(maxsize=512)
def _coarse(target: Solid, seabed: Seabed) -> tuple[Floats, Floats]:
    """Positions of some points all over a target [m], and unit normals there, each of shape (n, 3)."""
    surface = world_triangles(target, seabed)
    if isinstance(target, Box) and target.is_upright:
        side = float(np.sqrt(surface.area.sum() / REACH_SAMPLE_POINTS))
        points = box_scatterers(target, seabed_depth_under(target, seabed), 0, side, 0, quadrature=True)
        return points.position, points.normal
    position, normal = even_points(surface, REACH_SAMPLE_POINTS)
    in_water = position[:, 2] < seabed_depth_at(seabed, position[:, :2])
    return position[in_water], normal[in_water]


def solid_pieces(scene: Scene, ping_geometry: PingGeometry, resolution: Resolution) -> list[float]:
    """Approximate number of pieces into which each solid is divided before points are placed on it [1]."""
    pieces = []
    for solid in scene.solids:
        longest = MAX_PIECE_SIDE * _solid_pitch(scene, solid, ping_geometry, resolution.slant_resolution, resolution)
        pieces.append(estimated_piece_count(world_triangles(solid, scene.seabed).corners, longest))
    return pieces


def _cells(
    scene: Scene, target: Solid, ping_geometry: PingGeometry, slant: float, resolution: Resolution | None
) -> Floats:
    """Area of the cell that each point of a body represents, on each of its triangles [m^2], shape (t,)."""
    surface = world_triangles(target, scene.seabed)
    if isinstance(target, Box) and target.is_upright:
        pitch, rise = _box_cells(scene, target, ping_geometry, slant, resolution)
        is_horizontal = np.abs(surface.normal[:, 2]) > np.abs(surface.normal[:, :2]).max(axis=1)
        return pitch * np.where(is_horizontal, pitch, min(pitch, rise))
    side = cell_side(float(surface.area.sum()), _solid_pitch(scene, target, ping_geometry, slant, resolution))
    return np.full(len(surface.faces), side**2)


_KEPT = DrawnBodies()


def _points_of(
    scene: Scene, seed: int, ping_geometry: PingGeometry, slant: float, target: Solid, cells: Resolution | None,
    insonification: Callable[[], TargetInsonification], *, quadrature: bool,
) -> Scatterers:  # fmt: skip
    """Points of a body that one ping can receive; all of them where they are few.

    Args:
        scene: The scene.
        seed: Seed of the scenario.
        ping_geometry: The sonar at this ping.
        slant: Resolution along the slant range [m].
        target: The body.
        cells: Resolution cells that limit the number of points; None: no limit.
        insonification: Function that returns the insonification of the body.
        quadrature: True: quadrature points for an expectation. False: random ones.
    """
    row = scene.occluders.index(whole_solid(target))
    if isinstance(target, Box) and target.is_upright:
        pitch, rise = _box_cells(scene, target, ping_geometry, slant, cells)
        key = target, scene.seabed, scene.seabed_depth_under(target), seed, pitch, rise, row, quadrature
        if box_cells(target, scene.seabed_depth_under(target), pitch, rise) > MAX_UNCULLED:
            insonified = insonification()
            points = _box_points(*key, reaches=insonified.reaches)
            images, max_deviation = insonified.point_images, insonified.max_deviation
            return points.take(facing(points.position, points.normal, images, max_deviation=max_deviation))
        return _KEPT.get(key, partial(_box_points, *key))
    pitch = _solid_pitch(scene, target, ping_geometry, slant, cells)
    draw = partial(solid_scatterers, target, scene.seabed, seed, pitch, row, quadrature=quadrature)
    points = _KEPT.get((target, scene.seabed, seed, pitch, row, quadrature), draw)
    return cull_points(points, insonification()) if len(points) > MAX_UNCULLED else points


def _box_points(
    box: Box, seabed: Seabed, base: float, seed: int, pitch: float, rise: float, occluder: int, quadrature: bool,
    reaches: ReachTest | None = None,
) -> Scatterers:  # fmt: skip
    """Points of an upright box above the seabed, of the parts of its faces that are in reach."""
    points = box_scatterers(box, base, seed, pitch, occluder, rise=rise, quadrature=quadrature, test=reaches)
    if not seabed.relief:
        return points
    position = points.position
    return points.take(position[:, 2] < seabed_depth_at(seabed, position[:, :2]))


def _section(
    scene: Scene, seed: int, ping_geometry: PingGeometry, slant: float, target: Solid, *, quadrature: bool
) -> Scatterers:
    """Points of a body in a slice, each with the area that the beam covers."""
    sonar_position, row = ping_geometry.transmit_position, scene.occluders.index(whole_solid(target))
    distance = float(np.linalg.norm(np.array(target.position) - sonar_position[:2]))
    covered = partial(_covered_width, ping_geometry, distance=distance)
    if isinstance(target, Box) and target.is_upright:
        pitch, rise = _box_cells(scene, target, ping_geometry, slant, None)
        key = target, scene.seabed, scene.seabed_depth_under(target), seed, pitch, rise, row, quadrature
        return box_section(
            _KEPT.get(key, partial(_box_points, *key)),
            target,
            sonar_position,
            ping_geometry.first_beam_bearing,
            covered,
        )
    pitch = _cell_height(scene, target, ping_geometry, min(slant, *_extent(scene, target)) / FACE_CELLS)
    return solid_section(
        target, scene.seabed, seed, pitch, row, sonar_position, ping_geometry.first_beam_bearing, covered,
        quadrature=quadrature,
    )  # fmt: skip


def _extent(scene: Scene, solid: Solid) -> Floats:
    """Length of a solid's extent along each axis of the world [m], shape (3,)."""
    surface = world_triangles(solid, scene.seabed)
    return surface.high - surface.low


def _solid_pitch(
    scene: Scene, solid: Solid, ping_geometry: PingGeometry, slant: float, resolution: Resolution | None
) -> float:
    """Side of a solid's cells [m]: interference fringes are resolved by up to `FRINGE_POINTS` points.

    More random points are not placed than fill the resolution cells; they average over the fringes.
    """
    pitch = slant / FACE_CELLS
    cheap = float(np.sqrt(surface_area(solid, scene.seabed) / _max_fringe_points(resolution)))
    if cheap > pitch and resolution is not None:
        return max(pitch, min(cheap, _resolution_square(scene, solid, ping_geometry, resolution)))
    return min(pitch, max(_cell_height(scene, solid, ping_geometry, pitch), cheap))


def _box_cells(
    scene: Scene, box: Box, ping_geometry: PingGeometry, slant: float, resolution: Resolution | None
) -> tuple[float, float]:  # fmt: skip
    """Side of an upright box's cells, and their height on upright faces [m]; see `_solid_pitch`."""
    length, width, height = size = _wet_size(scene, box)
    pitch = min(slant, *size) / FACE_CELLS
    rise = _cell_height(scene, box, ping_geometry, pitch)
    if resolution is None:
        return pitch, rise
    horizontal, upright = 2 * length * width, 2 * (length + width) * height
    if horizontal / pitch**2 + upright / (pitch * rise) <= _max_fringe_points(resolution):
        return pitch, rise
    cheap = float(np.sqrt((horizontal + upright) / _max_fringe_points(resolution)))
    if cheap > pitch:
        pitch = max(
            pitch, min(cheap, _resolution_square(scene, box, ping_geometry, resolution), min(size) / FACE_CELLS)
        )
    return pitch, min(pitch, max(rise, cheap))


def _wet_size(scene: Scene, box: Box) -> tuple[float, float, float]:
    """Length, width, and height under water of an upright box [m]."""
    top, base = box_body(box, scene.seabed_depth_under(box))[6:]
    return *box.size[:2], float(base - top)


def _max_fringe_points(resolution: Resolution | None) -> int:
    """Number of points of a solid up to which its cells resolve interference fringes [1]."""
    return SPARSE_POINTS if resolution is not None and resolution.sparse else FRINGE_POINTS


def _resolution_square(scene: Scene, solid: Solid, ping_geometry: PingGeometry, resolution: Resolution) -> float:
    """Side of the square that one of the points that fill a resolution cell represents on a body [m].

    On a face parallel to the line of sight the cell is as long as the range cell and as wide as the beam; on
    others it is larger.
    """
    surface = world_triangles(solid, scene.seabed)
    middle, radius = (surface.high + surface.low) / 2, float(np.linalg.norm(surface.high - surface.low)) / 2
    nearest = float(np.linalg.norm(middle - ping_geometry.platform_positions, axis=1).min()) - radius
    area = (
        resolution.slant_resolution
        * resolution.beam_width
        * max(nearest, MIN_DISTANCE)
        / resolution.scatterers_per_cell
    )
    return min(float(np.sqrt(area)), MAX_ELONGATION * resolution.slant_resolution)


def _cell_height(scene: Scene, target: Solid, ping_geometry: PingGeometry, pitch: float) -> float:
    """Height of cells on upright faces [m]: several to each interference fringe of direct and bottom paths."""
    nearest = float(np.linalg.norm(np.array(target.position) - ping_geometry.platform_positions[:, :2], axis=1).min())
    highest = max(scene.seabed.depth - ping_geometry.track_depths[0], 0.1)
    wavelength = track_sound_speed(scene, ping_geometry) / ping_geometry.frequency
    fringe = wavelength * max(nearest, 1.0) / highest
    return max(min(pitch, fringe / FRINGE_CELLS), wavelength / 4)


def _covered_width(ping_geometry: PingGeometry, width: float, distance: float) -> float:
    """Part of a width [m], centred on the axis at a distance [m], that the two-way beam covers [m]."""
    half = float(np.arctan2(width / 2, max(distance, 1e-6)))
    return distance * float(
        two_way_footprint(ping_geometry.transmit_beams, ping_geometry.receive_beams, within=half)[0]
    )


def _may_fall_in_window(solid: Solid, scene: Scene, ping_geometry: PingGeometry) -> bool:
    """Return True if the first echo of a solid may fall into the window."""
    surface = world_triangles(solid, scene.seabed)
    middle = (surface.low + surface.high) / 2
    radius = float(np.linalg.norm(surface.high - surface.low)) / 2
    path_length = sum(
        float(np.linalg.norm(middle - end)) - radius
        for end in (ping_geometry.transmit_position, ping_geometry.receive_position)
    )
    return path_length * MIN_TRAVEL_TIME_RATIO / ping_geometry.sound_speed <= ping_geometry.recorded_delays[1]


def _within_beams(
    scene: Scene, target: Solid, path_settings: PathSettings, ping_geometry: PingGeometry, rays: PropagationModel | None
) -> bool:
    """Return True if beams may receive a target; with a propagation model, above the beam cutoff."""
    if rays is not None:
        return not _below_beam_floor(scene, target, path_settings, ping_geometry, rays)
    by_face = bool(face_images(scene, path_settings, ping_geometry, "target"))
    return by_face or not _outside_beams(scene, target, ping_geometry)


def _below_beam_floor(
    scene: Scene, target: Solid, path_settings: PathSettings, ping_geometry: PingGeometry, rays: PropagationModel
) -> bool:
    """Return True if the two-way gain to a target is below the beam cutoff by any pair of families.

    A sidescan receives a target in side lobes alone for most of the time in which it passes it.
    """
    terrain, (north, east, radius, top, base) = (
        scene.seabed.terrain,
        bounding_cylinders(scene)[scene.occluders.index(target)],
    )
    rise = (base - top) / 2 + (0.0 if terrain is None else (terrain.span[1] - terrain.span[0]) / 2)
    bound = two_way_gain_bound(
        np.array([[north, east]]), np.array([radius]), ping_geometry, (top + base) / 2, rays,
        families_reaching("target", path_settings.followed_families), rise=rise, glints=glint_spread(scene,
        ping_geometry.frequency), images=face_images(scene, path_settings, ping_geometry, "target"),
    )  # fmt: skip
    return float(bound[0]) < float(amplitude_ratio(path_settings.beam_cutoff_db))


def _outside_beams(scene: Scene, target: Solid, ping_geometry: PingGeometry) -> bool:
    """Return True if all transmit or all receive patterns vanish towards a body, at any elevation.

    One side of a sidescan sonar does not receive from behind its baffle; its other side does.
    """
    north, east, radius, *_ = bounding_cylinders(scene)[scene.occluders.index(target)]
    middle = np.array([north, east])
    for end_position, beams in (
        (ping_geometry.transmit_position, ping_geometry.transmit_beams), (ping_geometry.receive_position,
        ping_geometry.bounding_receive_beams)
    ):  # fmt: skip
        offset = middle - end_position[:2]
        away = float(np.linalg.norm(offset))
        if away <= 2 * radius:
            continue
        half = float(np.arcsin(radius / away)) + LEEWAY
        bearing = np.arctan2(offset[1], offset[0]) + np.linspace(-half, half, 9)
        climb = np.linspace(-np.pi / 2, np.pi / 2, 181)[:, None]
        sine = np.broadcast_to(np.sin(climb), (181, 9))
        direction = np.stack([np.cos(climb) * np.cos(bearing), np.cos(climb) * np.sin(bearing), sine], axis=-1)
        if not beams.gain(direction).any():
            return True
    return False
