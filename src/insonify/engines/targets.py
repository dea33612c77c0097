"""The targets as points: how finely their faces are drawn, by what the sonar can tell apart on its whole track.

Cells follow from the closest approach of the whole track and from the slowest water that it swims in, never from one
ping's distance or from the speed of sound at its depth, so that a place on a target has the same phase in every ping.
"""

from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from insonify.engines.faces import smooth_facets
from insonify.engines.sampling import survey_speed
from insonify.propagation.choice import PathChoice
from insonify.scene.box import box_scatterers, box_section
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.seabed import Seabed
from insonify.scene.solid import body_triangles, ground_depth, resting, solid_scatterers, world_triangles
from insonify.scene.solid_section import solid_section
from insonify.scene.target import Box, PointTarget, Solid
from insonify.sonar.footprint import two_way_footprint
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]

FACE_CELLS = 3.0
"""Cells of a target's face per range resolution, in each direction."""
FRINGE_CELLS = 8.0
"""Cells up a target's face per fringe between its direct and its bottom path."""
FRINGE_POINTS = 20_000
"""Points of a solid up to which its cells are made small for the sake of fringes [1]."""
LEEWAY = 0.02
"""Angle beside a body that is looked at too, before a beam is called deaf to it [rad]."""
LATER = 0.95
"""Least time of a bent path, as a part of the straight one's [1]."""


def target_points(
    scene: Scene, choice: PathChoice, seed: int, stance: Stance, slant: float, *, even: bool
) -> list[Scatterers]:
    """The points of all targets that one ping can hear, target by target.

    Args:
        scene: The scene.
        choice: Whether the whole scene is asked for, or a slice.
        seed: Seed of the scenario.
        stance: The sonar at this ping.
        slant: What it resolves along the slant range [m].
        even: Points laid out evenly for an expectation, or drawn ones.
    """
    if choice.geometry == "slice":
        solids = iter(_solid_sections(scene, seed, stance, slant, even=even))
    else:
        pitches = tuple(_solid_pitch(scene, solid, stance, slant) for solid in scene.solids)
        solids = iter(_drawn_solids(scene.solids, scene.seabed, seed, pitches, len(scene.boxes), even))
    found = []
    for target in scene.targets:
        if isinstance(target, PointTarget):
            found.append(point_scatterer(target))
            continue
        if isinstance(target, Box) and target.upright:
            points = _box_points(scene, choice, seed, stance, slant, target, even=even)
            near = choice.geometry == "slice" or not _deaf(points.position, stance)
        else:
            points, near = next(solids), _may_be_heard(target, scene, stance)
            if choice.geometry != "slice":
                near = near and not _deaf(world_triangles(target, scene.seabed).corners.reshape(-1, 3), stance)
        if near:
            found.append(points)
        if target.smooth and near and len(points):
            found.append(smooth_facets(scene, target, choice.followed, stance, slant))
    return found


def target_count(scene: Scene, stance: Stance, slant: float) -> float:
    """Points on the targets of a scene as one ping meets them, about; none is drawn, and none left out as out of reach.

    Args:
        scene: The scene.
        stance: The sonar.
        slant: What it resolves along the slant range [m].
    """
    count = 0.0
    for target in scene.targets:
        if isinstance(target, PointTarget):
            count += 1
        elif isinstance(target, Box) and target.upright:
            pitch = min(slant, *target.size) / FACE_CELLS
            length, width, height = target.size
            up = height / _rise(scene, target, stance, pitch)
            count += (2 * (length + width) * up + length * width / pitch) / pitch
        else:
            count += float(body_triangles(target).area.sum()) / _solid_pitch(scene, target, stance, slant) ** 2
    return count


@lru_cache(maxsize=4)
def _drawn_solids(
    solids: tuple[Solid, ...], seabed: Seabed, seed: int, pitches: tuple[float, ...], before: int, even: bool
) -> tuple[Scatterers, ...]:
    """The points of all solids of a scene: every ping wants the same."""
    return tuple(
        solid_scatterers(solid, seabed, seed, pitch, before + row, even=even)
        for row, (solid, pitch) in enumerate(zip(solids, pitches, strict=True))
    )


def _solid_sections(
    scene: Scene, seed: int, stance: Stance, slant: float, *, even: bool
) -> tuple[Scatterers, ...]:  # fmt: skip
    """The points of all solids of a scene that a slice meets, each standing for the part that the beam covers."""
    here, made = stance.transmit_place, []
    for row, solid in enumerate(scene.solids, len(scene.boxes)):
        distance = float(np.linalg.norm(np.array(solid.position) - here[:2]))
        pitch = _rise(scene, solid, stance, min(slant, *_extent(scene, solid)) / FACE_CELLS)
        made.append(
            solid_section(solid, scene.seabed, seed, pitch, row, here, stance.bearing,
                          partial(_covered, stance, distance=distance), even=even)
        )  # fmt: skip
    return tuple(made)


def _extent(scene: Scene, solid: Solid) -> Floats:
    """Length of a solid's extent along each axis of the world [m], shape (3,)."""
    surface = world_triangles(solid, scene.seabed)
    return surface.high - surface.low


def _solid_pitch(scene: Scene, solid: Solid, stance: Stance, slant: float) -> float:
    """Side of a solid's cells [m]: fringes are resolved while that is cheap; drawn points average over the others."""
    pitch = slant / FACE_CELLS
    cheap = float(np.sqrt(body_triangles(solid).area.sum() / FRINGE_POINTS))
    return min(pitch, max(_rise(scene, solid, stance, pitch), cheap))


def _rise(scene: Scene, target: Solid, stance: Stance, pitch: float) -> float:
    """Height of cells on upright faces [m]: direct and bottom paths make fringes up a face, each of some points."""
    nearest = float(np.linalg.norm(np.array(target.position) - stance.track[:, :2], axis=1).min())
    highest = max(scene.seabed.depth - stance.survey_depths[0], 0.1)
    wavelength = survey_speed(scene, stance) / stance.frequency
    fringe = wavelength * max(nearest, 1.0) / highest
    return max(min(pitch, fringe / FRINGE_CELLS), wavelength / 4)


def _box_points(
    scene: Scene, choice: PathChoice, seed: int, stance: Stance, slant: float, box: Box, *, even: bool
) -> Scatterers:
    """The points of an upright box, or of the part of it that a slice meets."""
    pitch = min(slant, *box.size) / FACE_CELLS
    rise = _rise(scene, box, stance, pitch)
    occluder = scene.boxes.index(box)
    whole = box_scatterers(box, scene.depth_under(box), seed, pitch, occluder, rise=rise, even=even)
    if scene.seabed.relief:
        place = whole.position
        whole = whole.take(place[:, 2] < ground_depth(scene.seabed, place[:, :2]))
    if choice.geometry != "slice":
        return whole
    here = stance.transmit_place
    distance = float(np.linalg.norm(np.array(box.position) - here[:2]))
    return box_section(whole, box, here, stance.bearing, lambda width: _covered(stance, width, distance))


def _covered(stance: Stance, width: float, distance: float) -> float:
    """How much of a width [m], centred on the axis at a distance [m], the two-way beam covers [m]."""
    half = float(np.arctan2(width / 2, max(distance, 1e-6)))
    return distance * float(two_way_footprint(stance.transmit_beams, stance.receive_beams, within=half)[0])


def _may_be_heard(solid: Solid, scene: Scene, stance: Stance) -> bool:
    """Whether a solid is near enough for its first echo to fall into the window; others cost nothing."""
    surface = world_triangles(solid, scene.seabed)
    middle: NDArray[np.float64] = resting(solid, scene.seabed)[1]
    radius = float(np.linalg.norm(surface.high - surface.low)) / 2
    way = sum(float(np.linalg.norm(middle - end)) - radius for end in (stance.transmit_place, stance.receive_place))
    return way * LATER / stance.sound_speed <= stance.heard_delays[1]


def _deaf(places: Floats, stance: Stance) -> bool:
    """Whether no beam sends, or none hears, anything towards a body, however the paths rise or fall.

    A sidescan's side is deaf to what lies behind its baffle; its other side is not.

    Args:
        places: Of the body, shape (n, 3) [m].
        stance: The sonar.
    """
    if not len(places):
        return False
    middle = (places.min(axis=0) + places.max(axis=0))[:2] / 2
    radius = float(np.linalg.norm(np.ptp(places[:, :2], axis=0))) / 2
    for here, beams in (
        (stance.transmit_place, stance.transmit_beams), (stance.receive_place, stance.receive_beams)
    ):  # fmt: skip
        offset = middle - here[:2]
        away = float(np.linalg.norm(offset))
        if away <= 2 * radius:
            continue
        half = float(np.arcsin(radius / away)) + LEEWAY
        bearing = np.arctan2(offset[1], offset[0]) + np.linspace(-half, half, 9)
        climb = np.linspace(-np.pi / 2, np.pi / 2, 181)[:, None]
        level = np.broadcast_to(np.sin(climb), (181, 9))
        way = np.stack([np.cos(climb) * np.cos(bearing), np.cos(climb) * np.sin(bearing), level], axis=-1)
        if not beams.gain(way).any():
            return True
    return False
