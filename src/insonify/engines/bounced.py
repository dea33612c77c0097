"""Bottom bounces over relief: legs off the planes that the bed comes to where they bounce.

Straight rays go off the fitted planes exactly, and are walked over the ground segment by segment, each from its own
image. Bent rays keep their shadows and their refraction, and are moved by what the same planes, taken from where the
bent ray bounces, change in straight ones.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines.skyline import SEABED, Sighted, Skylines, over_ground, sighted, steepness
from insonify.propagation._course_kernel import Course
from insonify.propagation.families import bounces
from insonify.propagation.glints import face, points_of, rows_of
from insonify.propagation.launches import StraightLaunches
from insonify.propagation.local_planes import level_course, local_course, zone
from insonify.records.legs import Legs, Status
from insonify.scene.bed import Bed
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

Floats = NDArray[np.floating[Any]]

FAINT = 3e-4
"""Pressure that roughness leaves, 70 dB less than before, below which a leg is not followed [1]."""


def over_relief(
    legs: Legs, scatterers: Scatterers, place: NDArray[np.float64], skylines: Skylines, scene: Scene, *,
    soft: bool = False, wanted: NDArray[np.bool_] | None = None,
) -> Legs:  # fmt: skip
    """Legs as relief leaves them: moved to the planes that they bounce off, dimmed by roughness, hidden by ground.

    Args:
        legs: Legs over the mean plane, which nobody else holds: their columns are written over.
        scatterers: The points that they reach.
        place: North, east, depth of the sonar's end [m], shape (3,).
        skylines: What the ground hides from there.
        scene: The scene; its bed has relief.
        soft: As of `over_ground`; legs off local planes end at once behind ground.
        wanted: Which bounced legs are asked for, shape (f, n); others over straight rays are silent. None: all.

    Returns:
        The same rows. A bed whose relief has no height leaves everything as it is, bit for bit.
    """
    low, high = skylines.bed.span
    bounced = [row for row, family in enumerate(legs.families) if "B" in family] if high > low else []
    if not bounced:
        return over_ground(legs, scatterers, place, skylines, soft=soft)
    if not isinstance(skylines.launches, StraightLaunches):
        shaded = over_ground(legs, scatterers, place, skylines, soft=soft)
        return _moved(shaded, bounced, legs, scatterers, place, skylines, scene)
    seen = sighted(skylines, place, scatterers.position)
    plain = [row for row in range(len(legs.families)) if row not in bounced]
    made = replace(legs, visibility=legs.visibility.astype(complex)) if soft else legs
    if plain:
        first = legs.first(len(plain)) if plain == list(range(len(plain))) else rows_of(legs, plain)
        lit = over_ground(first, scatterers, place, skylines, soft=soft, seen=seen)
        for name in ("status", "occluder", "visibility"):
            getattr(made, name)[plain] = getattr(lit, name)
    for row in bounced:
        if wanted is None or wanted[row].all():
            _bounce(made, row, seen, scatterers, place, skylines, scene, soft=soft)
            continue
        some = np.flatnonzero(wanted[row])
        part, points = points_of(made, row, some), scatterers.take(some)
        _bounce(part, 0, sighted(skylines, place, points.position), points, place, skylines, scene, soft=soft)
        made.boundary[row] = 0.0
        for name in _PUT:
            getattr(made, name)[row, some] = getattr(part, name)[0]
    return made


def _bounce(
    legs: Legs, row: int, seen: Sighted, scatterers: Scatterers, place: NDArray[np.float64], skylines: Skylines,
    scene: Scene, *, soft: bool,
) -> None:  # fmt: skip
    """Write one row of legs anew, off local planes; what is too faint for that is silent."""
    way, silent = _followed(legs, row, place, scatterers.position, skylines)
    if not silent.all():
        _put(legs, row, way, seen, scatterers, place, skylines, scene, soft=soft)
    legs.boundary[row][silent] = 0.0


def _followed(
    legs: Legs, row: int, place: NDArray[np.float64], points: NDArray[np.float64], skylines: Skylines
) -> tuple[Course, NDArray[np.bool_]]:
    """Ways of one family off local planes, and which of them are too faint for that, shape (n,).

    Those keep to the mean plane, where roughness is judged.
    """
    family, bed, wavelength = legs.families[row], skylines.bed, skylines.wavelength
    if not _may_be_faint(family, legs.length[row], np.abs(legs.departure[row, :, 2]), skylines):
        return local_course(family, place, points, bed, wavelength), np.zeros(len(points), bool)
    way = level_course(family, place, points, bed.depth)
    silent = left_in_step(family, way, bed, wavelength) < FAINT
    if not silent.all():
        local = local_course(family, place, points[~silent], bed, wavelength)
        for name in ("length", "departure", "arrival", "there"):
            getattr(way, name)[~silent] = getattr(local, name)
        for name in ("bounce", "part", "sine", "left"):
            getattr(way, name)[:, ~silent] = getattr(local, name)
    return way, silent


def _may_be_faint(family: str, length: NDArray[np.float64], sine: NDArray[np.float64], skylines: Skylines) -> bool:
    """Whether roughness may leave next to nothing of any of some legs: by the widest zone and the steepest bounce."""
    if not len(length):
        return False
    widest = np.sqrt(skylines.wavelength * length.max()) / np.sqrt(max(float(sine.min()), 1e-9))
    once = float(skylines.bed.smoothness(sine.max(), skylines.wavelength, widest))
    return once ** family.count("B") < FAINT


def _put(
    legs: Legs, row: int, way: Course, seen: Sighted, scatterers: Scatterers, place: NDArray[np.float64],
    skylines: Skylines, scene: Scene, *, soft: bool,
) -> None:  # fmt: skip
    """Write one row of straight legs anew."""
    family = legs.families[row]
    legs.absorption[row] = legs.absorption[row] ** (way.length / legs.length[row])
    legs.delay[row] = way.length / scene.water.sound_speed
    legs.length[row], legs.spreading[row] = way.length, 1 / way.length
    legs.departure[row], legs.arrival[row] = way.departure, way.arrival
    legs.boundary[row] = mirrored(family, way, skylines.bed, skylines.wavelength, scene)
    # a side that looked away from the level mirror's ray may look at this one
    away = legs.status[row] == Status.FACING_AWAY
    legs.status[row][away], legs.visibility[row][away] = Status.CLEAR, 1.0
    face(legs, row, scatterers.normal)
    clear = clear_of_ground(way, place, scatterers, skylines, seen)
    hidden = ~clear & (legs.status[row] == Status.CLEAR)
    legs.status[row][hidden], legs.occluder[row][hidden], legs.visibility[row][hidden] = Status.OCCLUDED, SEABED, 0.0
    if soft:  # what the ground alone leaves of those that targets cut
        cut = legs.status[row] == Status.OCCLUDED
        legs.visibility[row][cut] = clear[cut]


def mirrored(family: str, way: Course, bed: Bed, wavelength: float, scene: Scene) -> NDArray[np.complex128]:
    """Product of what all mirrors of a family leave of the coherent sound, with its phase [1], shape (n,).

    Each bottom bounce has the bed's own coefficient at its grazing angle with the fitted plane, times
    exp(-2 k^2 h^2 sin^2), h the roughness between the zone's wave and the sound's, see `Bed.smoothness`. What it loses
    is not mirrored; it is in the scattering law, which has no coherent part.

    Args:
        family: Name of the family.
        way: Its ways.
        bed: The ground.
        wavelength: Of the sound [m].
        scene: The scene.
    """
    product = left_in_step(family, way, bed, wavelength).astype(complex)
    for k, letter in enumerate(bounces(family)):
        product *= (scene.surface if letter == "S" else scene.seabed).mirror(np.arcsin(way.sine[k]))
    return product


def left_in_step(family: str, way: Course, bed: Bed, wavelength: float) -> NDArray[np.float64]:
    """What roughness leaves of the coherent sound after all bottom bounces of a family [1], shape (n,).

    Args:
        family: Name of the family.
        way: Its ways.
        bed: The ground.
        wavelength: Of the sound [m].
    """
    product = np.ones(len(way.length))
    for k, letter in enumerate(bounces(family)):
        if letter == "B":
            length, width = zone(way, k, wavelength)
            axis = np.maximum(2 * np.sqrt(length * width), 1e-6)
            product *= bed.smoothness(way.sine[k], wavelength, axis, left=way.left[k])
    return product


def clear_of_ground(
    way: Course, place: NDArray[np.float64], scatterers: Scatterers, skylines: Skylines, seen: Sighted
) -> NDArray[np.bool_]:
    """Whether ways off local planes are there, and meet no ground but the mirrors' own, shape (n,).

    They are walked in the vertical plane through sonar and point: planes that tilt across it bend the way by less
    than a cell of the ground.

    Args:
        way: The ways.
        place: North, east, depth of the sonar's end [m], shape (3,).
        scatterers: The points.
        skylines: The ground about that end.
        seen: Of `sighted` the points.
    """
    distance, once = seen.distance, 1 / np.maximum(seen.distance, 1e-9)
    north, east = (scatterers.position[:, :2] - place[:2]).T * once
    count, n = way.part.shape
    nodes, spared = np.empty((count + 2, n, 2)), np.zeros((count + 2, n))
    nodes[0], nodes[-1, :, 0], nodes[-1, :, 1] = (0.0, place[2]), distance, scatterers.position[:, 2]
    for k in range(count):
        nodes[k + 1, :, 0] = np.clip(
            (way.bounce[k, :, 0] - place[0]) * north + (way.bounce[k, :, 1] - place[1]) * east, 0.0, distance
        )
        nodes[k + 1, :, 1] = way.bounce[k, :, 2]
        spared[k + 1] = zone(way, k, skylines.wavelength)[0]
    return way.there & skylines.clear_courses(seen.groups, nodes, spared, ground=scatterers.boundary == "seabed")


def _moved(
    legs: Legs, bounced: list[int], plain: Legs, scatterers: Scatterers, place: NDArray[np.float64],
    skylines: Skylines, scene: Scene,
) -> Legs:  # fmt: skip
    """Bent legs over the mean plane, moved by what local planes change in straight ones.

    To first order a plane that stands h higher under a bounce shortens a leg by 2 h sin(grazing), whatever the water:
    the straight way's change is scaled by the ratio of the sines.
    """
    made = replace(legs, **{name: getattr(legs, name).copy() for name in _CHANGED})
    north, east = (scatterers.position[:, :2] - place[:2]).T
    distance, speed = np.hypot(north, east), float(scene.water.speed_at(skylines.bed.depth))
    for row in bounced:
        family = made.families[row]
        launch = steepness(family, plain.departure[row, :, 2])
        met = np.array([np.clip(at, 0.0, distance) for at in skylines.launches.bounces(family, launch)])
        level = level_course(family, place, scatterers.position, skylines.bed.depth)
        local = local_course(family, place, scatterers.position, skylines.bed, skylines.wavelength, met=met)
        tangent = skylines.launches.at_bed(launch)
        sine = tangent / np.hypot(1, tangent)
        straight = level.sine[bounces(family).index("B")]
        with np.errstate(invalid="ignore"):
            excess = (local.length - level.length) * sine / np.maximum(straight, 1e-9)
        there = (made.status[row] <= Status.OCCLUDED) & local.there & np.isfinite(excess)
        excess = np.where(there, excess, 0.0)
        made.delay[row] += excess / speed
        made.absorption[row] **= 1 + excess / made.length[row]
        made.spreading[row] *= made.length[row] / (made.length[row] + excess)
        made.length[row] += excess
        for column, now, was in ((made.departure, local.departure, level.departure),
                                 (made.arrival, local.arrival, level.arrival)):  # fmt: skip
            turned = column[row] + np.where(there[:, None], now - was, 0.0)
            column[row] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        face(made, row, scatterers.normal)
    return made


_PUT = (
    "absorption", "delay", "length", "spreading", "departure", "arrival", "boundary", "status", "visibility", "grazing",
    "occluder",
)  # fmt: skip
_CHANGED = (
    "delay", "length", "spreading", "absorption", "departure", "arrival", "grazing", "status", "visibility",
)  # fmt: skip
