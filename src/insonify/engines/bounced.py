"""Bottom bounces over relief: legs off the planes that the bed comes to where they bounce.

Straight rays go off the fitted planes exactly, and are walked over the ground segment by segment, each from its own
image. Bent rays keep their shadows and their refraction, and are moved by what the same planes, taken from where the
bent ray bounces, change in straight ones.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines._bounce_kernel import lay_nodes, put_ways
from insonify.engines.skyline import Skylines, over_ground, sighted, steepness
from insonify.propagation._course_kernel import Course
from insonify.propagation.families import bounces
from insonify.propagation.glints import face, rows_of
from insonify.propagation.launches import StraightLaunches
from insonify.propagation.local_planes import Bounces, level_bounces, level_course, local_course, zone
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
    made = _plain(legs, bounced, scatterers, place, skylines, soft=soft)
    for row in bounced:
        some = np.flatnonzero(wanted[row]) if wanted is not None else np.arange(len(scatterers))
        followed = some[~_silent(made, row, some, place, skylines)]
        made.boundary[row] = 0.0
        if len(followed):
            _bounce(made, row, followed, scatterers, place, skylines, scene, soft=soft)
    return made


def _plain(
    legs: Legs, bounced: list[int], scatterers: Scatterers, place: NDArray[np.float64], skylines: Skylines, *,
    soft: bool,
) -> Legs:  # fmt: skip
    """The legs with their rows without bottom bounces as the ground leaves them, the others as they are."""
    made = replace(legs, visibility=np.empty(legs.delay.shape, complex)) if soft else legs
    made.visibility[bounced] = legs.visibility[bounced]
    plain = [row for row in range(len(legs.families)) if row not in bounced]
    if plain:
        ahead = plain == list(range(len(plain)))
        first = legs.first(len(plain)) if ahead else rows_of(legs, plain)
        lit = over_ground(first, scatterers, place, skylines, soft=soft)
        for name in ("status", "occluder", "visibility"):
            getattr(made, name)[slice(len(plain)) if ahead else plain] = getattr(lit, name)
    return made


def _silent(
    legs: Legs, row: int, some: NDArray[np.int64], place: NDArray[np.float64], skylines: Skylines
) -> NDArray[np.bool_]:
    """Which of some legs of one family are too faint to be followed, judged on the mean plane, shape of `some`."""
    family, bed, wavelength = legs.families[row], skylines.bed, skylines.wavelength
    length, sine = legs.length[row, some], np.abs(legs.departure[row, some, 2])
    if not _may_be_faint(family, length, sine, skylines):
        return np.zeros(len(some), bool)
    way = level_bounces(family, float(place[2]), length, sine, bed.depth)
    return left_in_step(family, way, bed, wavelength) < FAINT


def _bounce(
    legs: Legs, row: int, some: NDArray[np.int64], scatterers: Scatterers, place: NDArray[np.float64],
    skylines: Skylines, scene: Scene, *, soft: bool,
) -> None:  # fmt: skip
    """Write some straight legs of one family anew, off local planes."""
    family, points = legs.families[row], scatterers.position[some]
    way = local_course(family, place, points, skylines.bed, skylines.wavelength)
    left = mirrored(family, way, skylines.bed, skylines.wavelength, scene)
    per_metre = np.log(legs.absorption[row, some[0]]) / legs.length[row, some[0]]
    taken = np.exp(per_metre * way.length)
    clear = clear_of_ground(way, place, points, skylines, ground=scatterers.boundary == "seabed")
    put_ways(
        some, way, left, taken, clear, scatterers.normal, 1 / scene.water.sound_speed, soft,
        *(getattr(legs, name)[row] for name in _PUT),
    )  # fmt: skip


def _may_be_faint(family: str, length: NDArray[np.float64], sine: NDArray[np.float64], skylines: Skylines) -> bool:
    """Whether roughness may leave next to nothing of any of some legs: by the widest zone and the steepest bounce."""
    if not len(length):
        return False
    widest = np.sqrt(skylines.wavelength * length.max()) / np.sqrt(max(float(sine.min()), 1e-9))
    once = float(skylines.bed.smoothness(sine.max(), skylines.wavelength, widest))
    return once ** family.count("B") < FAINT


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
    left = left_in_step(family, way, bed, wavelength)
    coefficient = 1 + 0j
    product: NDArray[np.complex128] | complex = 1.0
    for k, letter in enumerate(bounces(family)):
        if letter == "B":
            product = product * scene.seabed.mirror_at(way.sine[k])
        else:
            coefficient *= complex(scene.surface.mirror(np.zeros(1))[0])  # alike at any angle
    return np.asarray(left * coefficient * product)


def left_in_step(family: str, way: Course | Bounces, bed: Bed, wavelength: float) -> NDArray[np.float64]:
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
    way: Course, place: NDArray[np.float64], points: NDArray[np.float64], skylines: Skylines, *, ground: bool
) -> NDArray[np.bool_]:
    """Whether ways off local planes are there, and meet no ground but the mirrors' own, shape (n,).

    They are walked in the vertical plane through sonar and point: planes that tilt across it bend the way by less
    than a cell of the ground.

    Args:
        way: The ways.
        place: North, east, depth of the sonar's end [m], shape (3,).
        points: The same of the points [m], shape (n, 3).
        skylines: The ground about that end.
        ground: Whether the points lie on it.
    """
    seen = sighted(skylines, place, points)
    count, n = way.part.shape
    nodes, spared = np.empty((count + 2, n, 2)), np.empty((count + 2, n))
    lay_nodes(way, place, points, seen.distance, skylines.wavelength, nodes, spared)
    return way.there & skylines.clear_courses(seen.groups, nodes, spared, ground=ground)


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
    "delay", "length", "spreading", "absorption", "boundary", "departure", "arrival", "grazing", "status", "occluder",
    "visibility",
)  # fmt: skip
"""Columns in the order of `put_ways`."""
_CHANGED = (
    "delay", "length", "spreading", "absorption", "departure", "arrival", "grazing", "status", "visibility",
)  # fmt: skip
