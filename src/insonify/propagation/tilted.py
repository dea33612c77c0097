"""Legs off one plane for each bounce, tilted and raised as a swell is where the mirror's bounce point lies.

The paper's moving surface: its plane mirror follows the wave at the point where a ray meets it, at that time.
A swell so curved that a path has several bounce points is refused with the scenario, see `scenario.swell_faults`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.wave_spectrum import angular_frequency
from insonify.propagation.bent import Unfolded, unfolded
from insonify.propagation.families import bounces
from insonify.propagation.glints import End, bounce_times, face, rows_of
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]


def tilted_legs(legs: Legs, scene: Scene, scatterers: Scatterers, end: End) -> tuple[Legs, Legs]:
    """The legs off tilted planes.

    Args:
        legs: Legs off a level mirror, f families to n points.
        scene: The scene, with a swell.
        scatterers: The points that they reach.
        end: The end of the sonar that they begin at, and when.

    Returns:
        The legs as they are on the way out, and as they are on the way back.
    """
    touched = [row for row, family in enumerate(legs.families) if "S" in bounces(family)]
    if not touched:
        return legs, legs
    out, back = (rows_of(legs, list(range(len(legs.families)))) for _ in range(2))
    for row in touched:
        lines = unfolded(legs.families[row], end.place, scatterers.position, scene.seabed.depth)
        times = bounce_times(lines, legs.delay[row], scene, scatterers, end)
        for way, time in zip((out, back), times, strict=True):
            _tilt(way, row, lines, scene, scatterers, end, time)
    return out, back


def _tilt(legs: Legs, row: int, lines: Unfolded, scene: Scene, scatterers: Scatterers, end: End, time: Floats) -> None:
    """Reflect one row's sonar in the planes that it meets, one after the other."""
    family, bed = legs.families[row], scene.seabed.depth
    speed = float(scene.water.speed_at(end.place[2]))
    on, normal = planes(scene, lines.mirror_points(), time)
    level = np.array([0.0, 0.0, 1.0])
    image, facings, met = np.broadcast_to(end.place, scatterers.position.shape), [], 0
    for letter in bounces(family):
        at, facing = (on[met], normal[met]) if letter == "S" else (np.array([0.0, 0.0, bed]), level)
        met += letter == "S"
        facings.append(facing)
        image = image - 2 * np.sum((image - at) * facing, axis=-1, keepdims=True) * facing
    way = scatterers.position - image
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-6)
    arrival = way / length[:, None]
    departure = arrival
    for facing in reversed(facings):
        departure = departure - 2 * np.sum(departure * facing, axis=-1, keepdims=True) * facing
    # Told as a change of the level mirror's leg, so that refraction keeps its share.
    straight = np.concatenate([lines.distance[:, None] * lines.ahead, np.zeros((len(length), 1))], axis=1)
    down = lines.climb * (-1.0 if lines.upward else 1.0)
    there_z, here_z = down, -down if lines.odd else down
    excess = length - lines.length
    legs.delay[row] += excess / speed
    legs.spreading[row] *= lines.length / length
    legs.absorption[row] *= legs.absorption[row] ** (excess / lines.length)
    legs.length[row] += excess
    for column, now, z in ((legs.departure, departure, there_z), (legs.arrival, arrival, here_z)):
        mirror = (straight + np.stack([0 * z, 0 * z, z], axis=1)) / lines.length[:, None]
        turned = column[row] + now - mirror
        column[row] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    face(legs, row, scatterers.normal)


def planes(scene: Scene, points: Floats, time: Floats) -> tuple[Floats, Floats]:
    """A point of the surface, and its unit normal into the water, at some places and times.

    Args:
        scene: The scene, with a swell.
        points: North and east [m], shape (..., 2).
        time: After the start of the track [s], shape (...).

    Returns:
        North, east, depth of the surface [m], and its normal [1], both of shape (..., 3).
    """
    swell = scene.surface.swell
    assert swell is not None  # the surface has checked
    k = 2 * math.pi / swell.length
    omega = float(angular_frequency(k, water_depth=scene.seabed.depth))
    ahead = np.array([math.cos(scene.surface.waves_to), math.sin(scene.surface.waves_to)])
    turned = k * ((points - np.array(scene.seabed.lattice.origin)) @ ahead) - omega * time
    high, steep = swell.height / 2 * np.cos(turned), -k * swell.height / 2 * np.sin(turned)
    on = np.concatenate([points, -high[..., None]], axis=-1)
    # Depth + elevation is constant on the surface: its gradient is the normal.
    normal = np.concatenate([steep[..., None] * ahead, np.ones((*steep.shape, 1))], axis=-1)
    return on, normal / np.linalg.norm(normal, axis=-1, keepdims=True)
