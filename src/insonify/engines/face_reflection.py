"""Legs by way of large flat smooth faces of targets: F, from the image of the sonar's end in the plane of the face.

Horizontal boundaries are their own images in an upright face. So the legs of the image are those of the sonar by way of
the face, refracted, and reflected at both boundaries: F and the boundaries' letters, in whatever order the path
has them. A leaning face in water of one sound speed has the leg without further reflections. The finite size of a
face is that of a screen between image and point (`insonify.propagation.knife_edge`): by Babinet's principle it reflects
what the screen takes away.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT, bounce_sequence, image_depth
from insonify.propagation.knife_edge import SKY, screened_part
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.propagation.solid_shadows import occluders_of_paths
from insonify.records.legs import GlintPhasors, Legs, LegStatus
from insonify.scattering.kirchhoff_facet import KirchhoffFacet
from insonify.scattering.kirchhoff_patch import KirchhoffPatch
from insonify.scene.flat_faces import FlatFace, flat_faces
from insonify.scene.scatterers import BOUNDARY_ECHO, Scatterers
from insonify.scene.scene import Scene
from insonify.scene.target import Box, Plate
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Marks = NDArray[np.bool_]

RIPPLES = 12.0
"""Fresnel number beyond a face's edges from which on its reflection, below 0.02, is neglected [1]."""
NEAREST = 1e-6
"""Least distance in front of a face from which it reflects sound [m]."""
TRIM = 1e-6
"""Fraction of a path that is not tested before and behind the face and at its end, where it touches bodies [1]."""
LABEL_BITS = 24
"""Bits of the labels of random bounces, above which the number of a face is put."""


def face_families(path_settings: PathSettings) -> tuple[str, ...]:
    """Families of the image: those with fewer than `max_reflections` bounces, as the face adds one."""
    if not path_settings.face_reflections or path_settings.geometry == "slice":
        return ()
    limit = path_settings.max_reflections
    return tuple(name for name in path_settings.followed_families if len(bounce_sequence(name)) < limit)


def reflecting_faces(scene: Scene, path_settings: PathSettings, frequency: float) -> tuple[FlatFace, ...]:
    """Faces of targets that reflect sound to other scatterers, at one frequency [Hz]."""
    return flat_faces(scene, scene.water.max_sound_speed / frequency) if face_families(path_settings) else ()


def faces_in_reach(scene: Scene, path_settings: PathSettings, ping_geometry: PingGeometry) -> tuple[FlatFace, ...]:
    """Those of `reflecting_faces` by way of which echoes may be received within a ping's window."""
    faces = reflecting_faces(scene, path_settings, ping_geometry.frequency)
    return tuple(face for face in faces if is_in_reach(face, scene, ping_geometry))


def is_in_reach(face: FlatFace, scene: Scene, ping_geometry: PingGeometry) -> bool:
    """Return True if sound may come by way of a face before the window ends.

    Its path is no shorter than the distance from the transmitter to the face, and from there to the receiver.
    """
    shortest = sum(map(face.distance_from, (ping_geometry.transmit_position, ping_geometry.receive_position)))
    return shortest / scene.water.max_sound_speed <= ping_geometry.recorded_delays[1]


def face_family(name: str) -> str:
    """Name of the family by way of a face: F for D, FS for S."""
    return "F" + bounce_sequence(name)


def reflects_to(face: FlatFace, scatterers: Scatterers) -> bool:
    """True: a face reflects sound to scatterers; not to smooth faces, whose mutual echoes would count twice."""
    smooth = isinstance(scatterers.law, KirchhoffFacet | KirchhoffPatch)
    return scatterers.boundary != BOUNDARY_ECHO and not smooth and scatterers.occluder != face.occluder


def lit_points(
    face: FlatFace,
    position: Floats,
    points: Floats,
    wavelength: float,
    *,
    max_rise: float,
    radius: Floats | float = 0.0,
) -> Marks:
    """True for points that a reflection at a face may reach from a position, by its horizontal extent, shape (n,).

    Args:
        face: The face.
        position: North, east, depth [m], shape (3,).
        points: The points [m], shape (n, 3).
        wavelength: Wavelength of the sound [m].
        max_rise: Largest vertical distance that a path covers [m].
        radius: Radius of the neighbourhood of each point that may be reached instead of it [m], shape (n,).
    """
    before, after = float(face.signed_distance(position)), face.signed_distance(points)
    is_reached = after + radius > NEAREST
    if before <= NEAREST or not is_reached.any():
        return np.zeros(len(points), bool)
    total_distance = before + np.maximum(after, NEAREST)
    part = before / total_distance
    point_offset, sonar_offset = points @ face.axes[1], position @ face.axes[1]
    along = sonar_offset + part * (point_offset - sonar_offset)
    offset_length = np.hypot(total_distance, point_offset - sonar_offset)
    clearance = radius * (part + np.abs(point_offset - sonar_offset) / total_distance)
    clearance += (
        RIPPLES
        * np.sqrt(wavelength / 2 * (offset_length + max_rise) * part * (1 - part))
        * offset_length
        / total_distance
    )
    low, high = ((face.strips[:, 1] + side * face.strips[:, 5]) for side in (-1, 1))
    return np.asarray(is_reached & (along > low.min() - clearance) & (along < high.max() + clearance))


def legs_off_face(
    face: FlatFace, rays: PropagationModel, position: Floats, scatterers: Scatterers, families: tuple[str, ...],
    frequency: float,
) -> Legs:  # fmt: skip
    """Legs from the image of a position in a face, with their names in open water and the reflection by the face.

    Args:
        face: The face.
        rays: Propagation model of the scene; its relief hides none of these legs.
        position: North, east, depth of transmitter or receiver, in front of the face [m], shape (3,).
        scatterers: End points in front of the face, n of them.
        families: Families from `face_families`.
        frequency: Frequency of the sound [Hz].
    """
    scene, image = rays.scene, face.image(position)
    if not face.is_upright:
        families = (DIRECT,) if DIRECT in families and not scene.water.layered else ()
    legs = rays.open_water().legs(image, scatterers, families, frequency)
    factor = face.reflection * _size_factors(face, legs, image, scatterers.position, scene, frequency)
    visibility, status, occluder = legs.visibility.copy(), legs.status.copy(), legs.occluder.copy()
    if not _is_alone_and_convex(face, scene):
        for row, family in enumerate(legs.families):
            for nodes in _paths(face, family, position, scatterers.position, scene.seabed.depth):
                hit = occluders_of_paths(scene, nodes, with_boxes=True)
                cut = (hit >= 0) & (status[row] == LegStatus.CLEAR)
                visibility[row, cut], status[row, cut], occluder[row, cut] = 0, LegStatus.OCCLUDED, hit[cut]
    return replace(
        legs, visibility=visibility, status=status, occluder=occluder,
        reflection_coefficient=legs.reflection_coefficient * factor,
    )  # fmt: skip


def face_rows(legs: Legs, face: FlatFace, number: int, count: int, reached: Marks) -> Legs:
    """Legs of the image as legs of the sonar to all points: with F in their names, and departures at the sonar.

    Args:
        legs: Legs from `legs_off_face`, to some of n points.
        face: The face.
        number: Index of the face, by which rays of all faces are numbered.
        count: Number of all faces.
        reached: True for the points that they reach, shape (n,); the others have no such leg.
    """
    n, rows = len(reached), len(legs.families)
    columns: dict[str, Any] = {}
    unreflected = "delay", "spreading", "grazing_sine", "absorption", "reflection_coefficient", "visibility", "caustics"
    for name in unreflected:
        column = getattr(legs, name)
        columns[name] = np.zeros((rows, n), column.dtype)
        columns[name][:, reached] = column
    columns["length"], columns["status"] = np.ones((rows, n)), np.full((rows, n), LegStatus.SHADOW, np.uint8)
    columns["occluder"] = np.full((rows, n), -1, np.int16)
    for name in ("length", "status", "occluder"):
        columns[name][:, reached] = getattr(legs, name)
    mirror = np.eye(3) - 2 * np.outer(face.axes[0], face.axes[0])
    columns["departure"], columns["arrival"] = np.zeros((2, rows, n, 3)) + face.axes[0]
    columns["departure"][:, reached], columns["arrival"][:, reached] = legs.departure @ mirror, legs.arrival
    glints, caustic = legs.glints, legs.caustic
    if glints is not None:
        phasor = np.ones((rows, n), complex)
        phasor[:, reached] = glints.phasor
        label = tuple(value if value < 0 else value + ((number + 1) << LABEL_BITS) for value in glints.bounce_id)
        glints = GlintPhasors(label, phasor)
    if caustic is not None:
        caustic = np.ones((rows, n), complex)
        caustic[:, reached] = legs.caustic
    return Legs(
        families=tuple(map(face_family, legs.families)), branch=tuple(number + count * value for value in legs.branch),
        caustic=caustic, glints=glints, **columns,
    )  # fmt: skip


def _size_factors(
    face: FlatFace, legs: Legs, image: Floats, points: Floats, scene: Scene, frequency: float
) -> Complexes:
    """Pressure that a face of finite size reflects, re that of an unbounded one [1], shape (f, n).

    A leg with bounces crosses the plane of the face on one of its straight segments, each of which is unfolded. A face
    that ends at a boundary where this segment is reflected is continued by its image in the boundary. In another
    boundary it has its image, so that a face on the boundary has no edge, and one above it a gap of twice its height.
    """
    bed = scene.seabed.depth
    speed = float(scene.water.sound_speed_at(float(np.clip(image[2], 0.0, bed))))
    factor = np.zeros(legs.delay.shape, complex)
    for row, family in enumerate(legs.families):
        letters = bounce_sequence(family)
        for after in range(len(letters) + 1):
            start, ends = image.copy(), points.copy()
            start[2] = image_depth(letters[:after] or DIRECT, image[2], bed)
            ends[:, 2] = _unfolded(letters[after:], points[:, 2], bed)
            ray = (ends - start) @ face.axes.T
            if not letters and scene.water.layered:
                ray[:, 2] = _rise_behind_face(face, legs, row, image, points)
            ray /= np.maximum(np.linalg.norm(ray, axis=1, keepdims=True), 1e-12)
            adjacent = letters[max(after - 1, 0) : after + 1]
            strips = face.strips.copy()
            strips[face.at_surface & ("S" not in adjacent), 6] = -SKY
            gap_below = np.ones(len(strips), bool)
            if "B" not in adjacent:
                strips, gap_below = _with_bed_image(strips, face.gap)
            factor[row] += screened_part(
                strips, gap_below, (start @ face.axes.T, ends @ face.axes.T), ray, legs.length[row], speed / frequency
            )
    return np.where(np.isfinite(factor), factor, 0.0)


def _with_bed_image(strips: Floats, gap: Floats) -> tuple[Floats, Marks]:
    """Strips of a face with their images in the seabed, and True for those with a gap below, shapes (m, 8), (m,)."""
    above = (gap > 0) & np.isfinite(gap)
    image = strips[above]
    image[:, 6], image[:, 7] = image[:, 7] + 2 * gap[above], SKY
    return np.concatenate([strips, image]), np.concatenate([gap > 0, np.zeros(len(image), bool)])


def _unfolded(letters: str, depth: Floats, bed: float) -> Floats:
    """Depths at which a path would end if it were straight instead of reflected [m].

    Args:
        letters: Its reflections.
        depth: Depths at which it ends [m].
        bed: Depth of the seabed [m].
    """
    return image_depth(letters[::-1] or DIRECT, 0.0, bed) + (-1) ** len(letters) * depth


def _crossing_fraction(face: FlatFace, image: Floats, points: Floats) -> Floats:
    """Horizontal fraction of the path from an image to points before the plane of an upright face [1]."""
    before, after = -float(face.signed_distance(image)), face.signed_distance(points)
    return np.asarray(before / (before + after))


def _rise_behind_face(face: FlatFace, legs: Legs, row: int, image: Floats, points: Floats) -> Floats:
    """Increase of depth, over a whole direct leg, of the straight line from its crossing of the face to its point [m].

    A refracted ray is the cubic of its two ends and their slopes.
    """
    t, reach = _crossing_fraction(face, image, points), np.hypot(*(points - image)[:, :2].T)
    first, last = (
        reach * ray[:, 2] / np.maximum(np.hypot(ray[:, 0], ray[:, 1]), 1e-9)
        for ray in (legs.departure[row], legs.arrival[row])
    )
    rise = points[:, 2] - image[2]
    crossed = rise * t * t * (3 - 2 * t) + t * (1 - t) * ((1 - t) * first - t * last)
    return np.asarray((rise - crossed) / (1 - t))


def _is_alone_and_convex(face: FlatFace, scene: Scene) -> bool:
    """True where no body can occlude a reflection by the face: it is a side of the only body, a block."""
    return len(scene.occluders) == 1 and isinstance(scene.occluders[face.occluder], Box | Plate)


def _paths(face: FlatFace, family: str, position: Floats, points: Floats, bed: float) -> tuple[Floats, Floats]:
    """Nodes of paths before and behind a face [m], two arrays of shape (n, k, 3).

    Args:
        face: The face.
        family: Family of the image.
        position: North, east, depth of transmitter or receiver [m], shape (3,).
        points: Ends of the paths [m], shape (n, 3).
        bed: Depth of the seabed [m].
    """
    letters, image = bounce_sequence(family), face.image(position)
    climb = _unfolded(letters, points[:, 2], bed) - image[2]
    at, turns = _crossing_fraction(face, image, points), np.empty((len(letters), len(points)))
    travelled, depth = 0.0, float(image[2])
    for k, letter in enumerate(letters):
        goal = bed if letter == "B" else 0.0
        travelled, depth = travelled + abs(goal - depth), goal
        turns[k] = travelled / np.maximum(np.abs(climb), 1e-12)
    nodes = np.concatenate([np.zeros((1, len(points))), turns, np.ones((1, len(points)))])
    parts = []
    for low, high in ((0.0 * at, at * (1 - TRIM)), (at + TRIM * (1 - at), 0.0 * at + 1 - TRIM)):
        t = np.clip(nodes, low, high)
        point = image + t[..., None] * (points - image)
        if letters:
            unfolded = np.mod(image[2] + t * climb, 2 * bed)
            point[..., 2] = np.where(unfolded > bed, 2 * bed - unfolded, unfolded)
        point -= 2 * np.minimum(face.signed_distance(point), 0.0)[..., None] * face.axes[0]
        parts.append(np.ascontiguousarray(np.moveaxis(point, 0, 1)))
    return parts[0], parts[1]
