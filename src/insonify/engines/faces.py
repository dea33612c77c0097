"""The smooth faces of targets: curved patches of bodies in closed form, or flat triangles of meshes.

Faces answer in closed form for the directions at the middle of each piece, so pieces must be small beside the beam and
shallow along every ray beside the pulse, for all of a piece is heard at one delay. Patches keep phases to second order,
and are as large as third-order terms allow. On triangles the phase is linear: they are split until the wavefronts there
and back stay within a fraction of a radian of a plane.
"""

import warnings

import numpy as np
from numpy.typing import NDArray

from insonify.engines.patches import Sight, divided, outwards, terms, trimmed
from insonify.engines.target_sight import target_sight
from insonify.propagation.choice import PathChoice
from insonify.propagation.rays import Rays
from insonify.scattering.kirchhoff_facet import SmoothFace
from insonify.scattering.kirchhoff_patch import TERMS, SmoothPatch
from insonify.scene.panels import Panel, panels
from insonify.scene.scatterers import Scatterers, whole_target
from insonify.scene.scene import Scene
from insonify.scene.smooth_faces import above_ground, in_the_water, smooth_triangles
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid
from insonify.sonar.stance import Stance
from insonify.validity import PhysicsWarning

Floats = NDArray[np.float64]

BEND = 0.03
"""Most by which wavefronts may leave the plane of a triangle's middle, out and back together [rad]."""
CORNER = 0.6
"""A corner lies no farther from the middle of a triangle than this part of its longest side [1]."""
CUT = 1 / 6
"""Length to which an oblique cut by the bed or the surface is resolved [wavelengths]."""
MOST_FACETS = 300_000
"""Triangles of one target [1]."""


def smooth_facets(
    scene: Scene, solid: Solid, choice: PathChoice, stance: Stance, slant: float, rays: Rays | None = None
) -> Scatterers:
    """The smooth faces of a target that one ping may receive, piece by piece.

    Args:
        scene: The scene.
        solid: One of its targets, with smooth faces.
        choice: Paths followed, and the floor of the beams.
        stance: The sonar at this ping.
        slant: What it resolves along the slant range [m].
        rays: How sound travels in the scene; None: not known, and beams drop nothing.
    """
    sight = sight_of(scene, solid, choice, stance, slant, rays)
    closed = panels(solid, scene.seabed, stance.transmit_place)
    found, whole = _patches(scene, solid, closed, sight) if closed else _triangles(scene, solid, sight)
    if not whole:
        warnings.warn(
            f"target {solid.label}: its smooth faces would be split into more than {MOST_FACETS} facets, and are left "
            "coarser; their echo is not exact. Give a smaller target, a longer pulse, or leave smooth out.",
            PhysicsWarning, stacklevel=2,
        )  # fmt: skip
    return found


def sight_of(scene: Scene, solid: Solid, choice: PathChoice, stance: Stance, slant: float, rays: Rays | None) -> Sight:
    """The sonar as one target sees it: arguments as of `smooth_facets`."""
    surface = world_triangles(solid, scene.seabed)
    ends = stance.transmit_place, stance.receive_place
    distance = min(float(np.linalg.norm(np.clip(end, surface.low, surface.high) - end)) for end in ends)
    return target_sight(scene, choice, stance, slant, distance, rays)


def _patches(scene: Scene, solid: Solid, closed: list[Panel], sight: Sight) -> tuple[Scatterers, bool]:
    """A body in closed form as patches, and whether all are small enough."""
    assert solid.smooth is not None
    finest, complete = CUT * 2 * np.pi / sight.wavenumber, True
    columns = [(np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty((0, TERMS, 3)))]
    for panel in closed:
        pieces, enough = divided(panel, sight)
        complete &= enough
        pieces = trimmed(panel, pieces, in_the_water(scene.seabed), finest)
        d, rows, area = terms(panel, pieces)
        columns.append((d.place, outwards(d), area, rows))
    place, normal, area, rows = (np.concatenate(column) for column in zip(*columns, strict=True))
    count = len(area)
    return Scatterers(
        owner=solid.label, boundary="target", law=SmoothPatch(solid.smooth), position=place, normal=normal, area=area,
        phase=np.ones(count, complex), place=whole_target(solid.label, count), drawn=False,
        occluder=scene.occluders.index(solid), corners=rows, centre=_middle(scene, solid),
    ), complete  # fmt: skip


def _triangles(scene: Scene, solid: Solid, sight: Sight) -> tuple[Scatterers, bool]:
    """A mesh as flat facets, and whether all are small enough."""
    assert solid.smooth is not None
    corners, whole = split(towards(scene, solid, sight), sight)
    corners = above_ground(corners, scene.seabed)
    middle = corners.mean(axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.maximum(np.linalg.norm(across, axis=1), 1e-300)
    count = len(corners)
    return Scatterers(
        owner=solid.label, boundary="target", law=SmoothFace(solid.smooth), position=middle,
        normal=across / twice[:, None], area=twice / 2, phase=np.ones(count, complex),
        place=whole_target(solid.label, count), drawn=False, occluder=scene.occluders.index(solid),
        corners=corners - middle[:, None], centre=_middle(scene, solid),
    ), whole  # fmt: skip


def towards(scene: Scene, solid: Solid, sight: Sight) -> Floats:
    """Corners of the triangles of a smooth mesh that look at both ends [m], shape (t, 3, 3)."""
    corners = smooth_triangles(solid, scene.seabed)
    return corners[np.logical_and(*(_facing(corners, places, sight.aside) for places in sight.images))]


def _middle(scene: Scene, solid: Solid) -> Floats:
    """Middle of the extent of a target [m], shape (3,)."""
    surface = world_triangles(solid, scene.seabed)
    return np.asarray((surface.low + surface.high) / 2)


def split(corners: Floats, sight: Sight) -> tuple[Floats, bool]:
    """Triangles halved across a side until they are small enough; those that cannot be received are dropped.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        sight: The sonar.

    Returns:
        Triangles of the same surface, and whether all are small enough.
    """
    done = []
    held = 0
    while len(corners):
        small, corners, longest = by_size(corners, sight)
        done.append(small)
        held += len(small)
        if held + 2 * len(corners) > MOST_FACETS:
            return np.concatenate([*done, corners]), False
        corners = halved(corners, longest)
    return np.concatenate(done) if done else corners, True


def by_size(corners: Floats, sight: Sight) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Triangles that can be received: small ones, large ones, and the side across which each large one is halved."""
    corners = corners[_may_reach(corners, sight)]
    sides = np.roll(corners, -1, axis=1) - corners
    size = _size(corners, sides, sight)
    large = size.max(axis=1) > 1
    return corners[~large], corners[large], size.argmax(axis=1)[large]


def halved(corners: Floats, side: NDArray[np.int64]) -> Floats:
    """Triangles halved across one side each, (t,), shape (2 t, 3, 3)."""
    order = (side[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(corners, order[:, :, None], axis=1), 1, 0)
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _may_reach(corners: Floats, sight: Sight) -> NDArray[np.bool_]:
    """True for triangles within the window and above the floor of the beams, shape (t,)."""
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1, initial=0.0)
    return sight.reaches(middle, radius)


def _size(corners: Floats, sides: Floats, sight: Sight) -> Floats:
    """Sides of triangles as parts of what they may be [1], shape (t, 3)."""
    middle = corners.mean(axis=1)
    length = np.linalg.norm(sides, axis=2)
    nearness, along, turned = np.zeros(len(middle)), np.zeros(length.shape), np.zeros(length.shape)
    for places in sight.images:
        closest = np.full(len(middle), np.inf)
        for place in places:
            ray = middle - place
            away = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
            ray = ray / away[:, None]
            deep = np.einsum("tsk,tk->ts", sides, ray)
            along = np.maximum(along, np.abs(deep))
            for lobe in sight.lobes:
                turn = np.abs(sides @ lobe.axis - deep * (ray @ lobe.axis)[:, None]) / away[:, None]
                turned = np.maximum(turned, turn / lobe.width)
            closest = np.minimum(closest, away)
        nearness += 1 / closest
    # the path to a corner is longer by half the square of its distance over the way's length
    flat = np.sqrt(2 * BEND / (sight.wavenumber * CORNER**2 * np.maximum(nearness, 1e-300)))
    return np.maximum.reduce([length / flat[:, None], turned, along / sight.depth, length / sight.largest])


def _facing(corners: Floats, places: Floats, aside: float) -> NDArray[np.bool_]:
    """Which triangles look at any of some places, or away by a sine of no more than `aside`, shape (t,)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    seen = np.zeros(len(corners), bool)
    for place in places:
        ray = place - corners.mean(axis=1)
        seen |= np.einsum("tk,tk->t", ray, normal) > -aside * np.linalg.norm(ray, axis=1)
    return seen
