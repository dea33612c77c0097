"""The smooth faces of targets: curved patches of bodies in closed form, or flat triangles of meshes.

The closed form holds for the directions at the middle of each piece, so pieces must be small beside the beam and, along
every ray, shallow beside the pulse, because all of a piece is received at one delay. Patches keep phases to second
order, and are as large as third-order terms allow. On triangles the phase is linear: they are split until incident and
scattered wavefronts stay within a fraction of a radian of a plane. Sides of patches and corners of triangles have
delays of their own where a pulse is short.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.engines.patch_subdivision import (
    SHALLOW,
    TargetInsonification,
    clip_to_water,
    outward_normals,
    patch_terms,
    pulse_sides,
    subdivide,
)
from insonify.engines.target_culling import facing
from insonify.engines.target_insonification import target_insonification
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.records.legs import Legs
from insonify.scattering.kirchhoff_facet import KirchhoffFacet
from insonify.scattering.kirchhoff_patch import TERMS, KirchhoffPatch, side_offset
from insonify.scene.panels import Panel, panels
from insonify.scene.scatterers import Scatterers, whole_target_id
from insonify.scene.scene import Scene
from insonify.scene.smooth_faces import clip_at_seabed, smooth_triangles, water_clearance
from insonify.scene.solid import world_triangles
from insonify.scene.target import Solid, whole_solid
from insonify.sonar.ping_geometry import PingGeometry
from insonify.validity import PhysicsWarning

Floats = NDArray[np.float64]

MAX_WAVEFRONT_PHASE = 0.03
"""Largest phase between incident and scattered wavefronts together and their planes at a triangle's middle [rad]."""
CORNER_DISTANCE = 0.6
"""Largest distance of a corner from the middle of a triangle, re its longest side [1]."""
DEEPER = 1.6
"""Extent along a ray of a triangle, which has six delays, re that of a patch, which has two along each side [1]."""
CUT_RESOLUTION = 1 / 6
"""Length to which an oblique cut by the seabed or the surface is resolved [wavelengths]."""
MAX_FACETS = 300_000
"""Largest number of triangles of one target [1]."""


def smooth_facets(
    scene: Scene, solid: Solid, path_settings: PathSettings, ping_geometry: PingGeometry, slant: float,
    rays: PropagationModel | None = None,
) -> Scatterers:  # fmt: skip
    """The smooth faces of a target that one ping may receive, piece by piece.

    Args:
        scene: The scene.
        solid: One of its targets, with smooth faces.
        path_settings: Path settings.
        ping_geometry: The sonar at this ping.
        slant: Resolution along the slant range [m].
        rays: Propagation model of the scene; None: unknown, and no piece is dropped by its beam gain.
    """
    insonification = solid_insonification(scene, solid, path_settings, ping_geometry, slant, rays)
    closed = panels(solid, scene.seabed, ping_geometry.transmit_position)
    facets, whole = (
        _patches(scene, solid, closed, insonification) if closed else _triangles(scene, solid, insonification)
    )
    if not whole:
        warn_caller(
            f"target {solid.label}: its smooth faces would be split into more than {MAX_FACETS} facets, and are left "
            "coarser; their echo is not exact. Give a smaller target, a longer pulse, or leave "
            "face_reflection_coefficient out.",
            PhysicsWarning,
        )  # fmt: skip
    return facets


def joined_facets(parts: list[Scatterers]) -> Scatterers:
    """Facets of the parts of one mesh as one coherent group.

    Args:
        parts: Facets from `smooth_facets` of each part, at least one.
    """
    if len(parts) == 1:
        return parts[0]
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("position", "normal", "area", "phase", "scatterer_id", "corners")
    }
    reflection = [np.full(len(part), part.law.reflection) for part in parts if isinstance(part.law, KirchhoffFacet)]
    return replace(parts[0], law=KirchhoffFacet(), relative_reflection=np.concatenate(reflection), **columns)


def legs_at_sides(transmit_legs: Legs, receive_legs: Legs, scatterers: Scatterers, scene: Scene) -> tuple[Legs, Legs]:
    """Transmit and receive legs to smooth patches and facets, with the delays of those sides that rows stand for.

    Args:
        transmit_legs: Legs from the transmitter to the centres of n patches or facets.
        receive_legs: Legs from the receiver to them.
        scatterers: The patches or facets; legs to other scatterers are returned unchanged.
        scene: The scene.
    """
    if scatterers.corners is None or scatterers.has_random_phase:
        return transmit_legs, receive_legs
    offset = side_offset(scatterers.corners) if isinstance(scatterers.law, KirchhoffPatch) else scatterers.corners[:, 3]
    delay_offset = offset / scene.water.sound_speed_at(scatterers.position[:, 2])[:, None]

    def at_sides(legs: Legs) -> Legs:
        return replace(legs, delay=legs.delay + np.einsum("fnk,nk->fn", legs.arrival, delay_offset))

    sent = at_sides(transmit_legs)
    return sent, (sent if receive_legs is transmit_legs else at_sides(receive_legs))


def solid_insonification(
    scene: Scene, solid: Solid, path_settings: PathSettings, ping_geometry: PingGeometry, slant: float,
    rays: PropagationModel | None,
) -> TargetInsonification:  # fmt: skip
    """Insonification of a solid by one ping; arguments are those of `smooth_facets`."""
    surface = world_triangles(solid, scene.seabed)
    ends = ping_geometry.transmit_position, ping_geometry.receive_position
    distance = min(float(np.linalg.norm(np.clip(end, surface.low, surface.high) - end)) for end in ends)
    return target_insonification(scene, path_settings, ping_geometry, slant, distance, rays)


def _patches(
    scene: Scene, solid: Solid, closed: list[Panel], insonification: TargetInsonification
) -> tuple[Scatterers, bool]:
    """A body in closed form as patches; True if all are small enough."""
    assert solid.face_reflection_coefficient is not None
    finest, complete = CUT_RESOLUTION * 2 * np.pi / insonification.wavenumber, True
    columns = [(np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty((0, TERMS, 3)))]
    for panel in closed:
        pieces, enough = subdivide(panel, insonification)
        complete &= enough
        pieces = clip_to_water(panel, pieces, water_clearance(scene.seabed), finest)
        row, side = pulse_sides(panel, pieces, insonification)
        d, rows, area = patch_terms(panel, pieces.take(row), side)
        columns.append((d.position, outward_normals(d), area, rows))
    position, normal, area, rows = (np.concatenate(column) for column in zip(*columns, strict=True))
    count = len(area)
    return Scatterers(
        object=solid.label, boundary="target", law=KirchhoffPatch(solid.face_reflection_coefficient), position=position,
        normal=normal, area=area, phase=np.ones(count, complex), scatterer_id=whole_target_id(solid.label, count),
        has_random_phase=False, occluder=scene.occluders.index(solid), corners=rows, centre=_middle(scene, solid),
    ), complete  # fmt: skip


def _triangles(scene: Scene, solid: Solid, insonification: TargetInsonification) -> tuple[Scatterers, bool]:
    """A mesh as flat facets; True if all are small enough."""
    assert solid.face_reflection_coefficient is not None
    corners, whole = split_triangles(towards(scene, solid, insonification), insonification)
    corners = clip_at_seabed(corners, scene.seabed)
    corners, node = delay_nodes(corners, deep=are_deep(scene, solid, insonification))
    middle = corners.mean(axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.maximum(np.linalg.norm(across, axis=1), 1e-300)
    count, own = len(corners), corners - middle[:, None]
    nodes = np.stack([np.zeros((count, 3)), own[:, 0], (own[:, 0] + own[:, 1]) / 2], axis=1)
    own = np.concatenate([own, np.take_along_axis(nodes, node[:, None, None], axis=1)], axis=1)
    return Scatterers(
        object=solid.label, boundary="target", law=KirchhoffFacet(solid.face_reflection_coefficient), position=middle,
        normal=across / twice[:, None], area=twice / 2, phase=np.ones(count, complex),
        scatterer_id=whole_target_id(solid.label, count), has_random_phase=False,
        occluder=scene.occluders.index(whole_solid(solid)), corners=own,
        centre=_middle(scene, solid),
    ), whole  # fmt: skip


def delay_nodes(corners: Floats, *, deep: bool) -> tuple[Floats, NDArray[np.int64]]:
    """Triangles once for each node whose delay a part of their echo has; once if all are shallow.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        deep: From `are_deep`.

    Returns:
        Corners, shape (n, 3, 3), and the node of each row: 0 none, 1 the first corner, 2 the middle of the first side,
        shape (n,).
    """
    if not deep:
        return corners, np.zeros(len(corners), np.int64)
    turned = [np.roll(corners, -turn, axis=1) for turn in range(3)] * 2
    return np.concatenate(turned), np.repeat([1, 2], 3 * len(corners))


def are_deep(scene: Scene, solid: Solid, insonification: TargetInsonification) -> bool:
    """Return True if facets of a mesh may be so large that the envelope of the pulse changes within their delays.

    It is the same for all parts of a mesh: facets with one delay beside others with three give false echoes at common
    sides.
    """
    surface, middle = world_triangles(whole_solid(solid), scene.seabed), _middle(scene, solid)
    sides = np.asarray(surface.corners) - np.roll(surface.corners, -1, axis=1)
    nearness = sum(1 / max(float(np.linalg.norm(images - middle, axis=1).min()), 1e-6)
                   for images in insonification.images)  # fmt: skip
    longest = min(float(np.linalg.norm(sides, axis=2).max(initial=0.0)), float(_flat_side(nearness, insonification)))
    return longest > 2 * SHALLOW * insonification.max_range_extent


def towards(scene: Scene, solid: Solid, insonification: TargetInsonification) -> Floats:
    """Corners of the triangles of a smooth mesh that face both ends [m], shape (t, 3, 3)."""
    corners = smooth_triangles(solid, scene.seabed)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    images, max_deviation = insonification.images, insonification.max_deviation
    return corners[facing(corners.mean(axis=1), normal, images, max_deviation=max_deviation)]


def _middle(scene: Scene, solid: Solid) -> Floats:
    """Middle of the extent of a target [m], shape (3,)."""
    surface = world_triangles(whole_solid(solid), scene.seabed)
    return np.asarray((surface.low + surface.high) / 2)


def split_triangles(corners: Floats, insonification: TargetInsonification) -> tuple[Floats, bool]:
    """Triangles with halved sides until they are small enough; those that cannot be received are dropped.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        insonification: The sonar.

    Returns:
        Triangles of the same surface; True if all are small enough.
    """
    done = []
    held = 0
    while len(corners):
        small, corners, is_long = by_size(corners, insonification)
        done.append(small)
        held += len(small)
        if held + 2 * len(corners) > MAX_FACETS:
            return np.concatenate([*done, corners]), False
        corners = halved(corners, is_long)
    return np.concatenate(done) if done else corners, True


def by_size(corners: Floats, insonification: TargetInsonification) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Triangles that can be received: small ones, large ones, and the sides of these that are to be halved, (t, 3)."""
    corners = corners[_receivable(corners, insonification)]
    is_long = _relative_sides(corners, insonification) > 1
    large = is_long.any(axis=1)
    return corners[~large], corners[large], is_long[large]


def halved(corners: Floats, is_long: NDArray[np.bool_]) -> Floats:
    """Triangles divided at the middles of their long sides, so that neighbours have all their corners in common.

    Args:
        corners: Corners, shape (t, 3, 3).
        is_long: True for sides that are halved, one or more of each triangle; a side follows its corner, shape (t, 3).
    """
    parts, count = [], is_long.sum(axis=1)
    for sides, first in ((1, is_long), (2, np.roll(~is_long, 1, axis=1)), (3, is_long)):
        rows = np.flatnonzero(count == sides)
        order = (first[rows].argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners[rows], order[:, :, None], axis=1), 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        if sides == 1:
            pieces = [(a, ab, c), (ab, b, c)]
        elif sides == 2:
            across = (np.linalg.norm(a - bc, axis=1) <= np.linalg.norm(ab - c, axis=1))[:, None]
            pieces = [(ab, b, bc), (a, ab, np.where(across, bc, c)), (np.where(across, a, ab), bc, c)]
        else:
            pieces = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        parts += [np.stack(piece, axis=1) for piece in pieces]
    return np.concatenate(parts)


def _receivable(corners: Floats, insonification: TargetInsonification) -> NDArray[np.bool_]:
    """True for triangles within the window and the beam cutoff, shape (t,)."""
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1, initial=0.0)
    return insonification.reaches(middle, radius)


def _relative_sides(corners: Floats, insonification: TargetInsonification) -> Floats:
    """Sides of triangles re the largest permitted at their middles [1], shape (t, 3): for both neighbours the same."""
    others = np.roll(corners, -1, axis=1)
    middle, sides = (corners + others) / 2, others - corners
    length = np.linalg.norm(sides, axis=2)
    nearness, along, turned = np.zeros(length.shape), np.zeros(length.shape), np.zeros(length.shape)
    for images in insonification.images:
        closest = np.full(length.shape, np.inf)
        for position in images:
            ray = middle - position
            away = np.maximum(np.linalg.norm(ray, axis=2), 1e-6)
            ray = ray / away[..., None]
            deep = np.einsum("tsk,tsk->ts", sides, ray)
            along = np.maximum(along, np.abs(deep))
            for lobe in insonification.lobes:
                turn = np.abs(sides @ lobe.axis - deep * (ray @ lobe.axis)) / away
                turned = np.maximum(turned, turn / lobe.width)
            closest = np.minimum(closest, away)
        nearness += 1 / closest
    flat = _flat_side(nearness, insonification)
    return np.maximum.reduce(
        [
            length / flat,
            turned,
            along / (DEEPER * insonification.max_range_extent),
            length / insonification.max_side,
        ]
    )


def _flat_side(nearness: Any, insonification: TargetInsonification) -> Any:
    """Side of a facet within which wavefronts are flat enough [m], by the sum of both curvatures [1/m]."""
    # the path to a corner is longer by half the square of its distance over the path's length
    bend = insonification.wavenumber * CORNER_DISTANCE**2 * np.maximum(nearness, 1e-300)
    return np.sqrt(2 * MAX_WAVEFRONT_PHASE / bend)
