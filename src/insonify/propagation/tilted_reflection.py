"""Legs by one plane for each surface bounce, tilted and raised as a swell is at the flat surface's bounce point.

The plane follows the wave at the point and time at which a ray reaches the surface, as in the paper.
A swell so steep that a path has several bounce points is refused with the scenario, see `scenario.swell_errors`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.wave_spectrum import angular_frequency
from insonify.propagation.displaced_bounce import UnfoldedPaths, unfold_paths
from insonify.propagation.families import bounce_sequence, surface_bounces
from insonify.propagation.glints import SonarEnd, bounce_times, leg_rows, update_grazing
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]


def tilted_legs(legs: Legs, scene: Scene, scatterers: Scatterers, sonar_end: SonarEnd) -> tuple[Legs, Legs]:
    """Legs reflected by tilted planes.

    Args:
        legs: Legs reflected by a flat surface, f families to n points.
        scene: The scene, with a swell.
        scatterers: Ends of the legs.
        sonar_end: End of the sonar at which the legs begin, and its time.

    Returns:
        Transmit legs and receive legs.
    """
    surface_rows = [row for row, family in enumerate(legs.families) if surface_bounces(family)]
    if not surface_rows:
        return legs, legs
    transmit, receive = (leg_rows(legs, list(range(len(legs.families)))) for _ in range(2))
    for row in surface_rows:
        paths = unfold_paths(legs.families[row], sonar_end.position, scatterers.position, scene.seabed.depth)
        times = bounce_times(paths, legs.delay[row], scene, scatterers, sonar_end)
        for tilted, time in zip((transmit, receive), times, strict=True):
            _reflect_in_tilted_planes(tilted, row, paths, scene, scatterers, sonar_end, time)
    return transmit, receive


def _reflect_in_tilted_planes(
    legs: Legs, row: int, paths: UnfoldedPaths, scene: Scene, scatterers: Scatterers, sonar_end: SonarEnd, time: Floats
) -> None:
    """Change one row of legs to those from the sonar's image in its planes, one after the other, in place."""
    family, bed = legs.families[row], scene.seabed.depth
    speed = float(scene.water.sound_speed_at(sonar_end.position[2]))
    plane_point, normal = tilted_planes(scene, paths.flat_bounce_points(), time)
    vertical = np.array([0.0, 0.0, 1.0])
    image, normals, bounce = np.broadcast_to(sonar_end.position, scatterers.position.shape), [], 0
    for letter in bounce_sequence(family):
        at, axis = (plane_point[bounce], normal[bounce]) if letter == "S" else (np.array([0.0, 0.0, bed]), vertical)
        bounce += letter == "S"
        normals.append(axis)
        image = image - 2 * np.sum((image - at) * axis, axis=-1, keepdims=True) * axis
    path = scatterers.position - image
    length = np.maximum(np.linalg.norm(path, axis=1), 1e-6)
    arrival = path / length[:, None]
    departure = arrival
    for axis in reversed(normals):
        departure = departure - 2 * np.sum(departure * axis, axis=-1, keepdims=True) * axis
    # Evaluated as a change of the flat surface's leg, so that refraction is preserved.
    horizontal = np.concatenate(
        [paths.horizontal_distance[:, None] * paths.horizontal_direction, np.zeros((len(length), 1))], axis=1
    )
    down = paths.vertical_travel * (-1.0 if paths.starts_upward else 1.0)
    departure_z, arrival_z = down, -down if paths.reverses_vertically else down
    excess = length - paths.length
    legs.delay[row] += excess / speed
    legs.spreading[row] *= paths.length / length
    legs.absorption[row] *= legs.absorption[row] ** (excess / paths.length)
    legs.length[row] += excess
    for column, direction, z in ((legs.departure, departure, departure_z), (legs.arrival, arrival, arrival_z)):
        flat_direction = (horizontal + np.stack([0 * z, 0 * z, z], axis=1)) / paths.length[:, None]
        changed = column[row] + direction - flat_direction
        column[row] = changed / np.linalg.norm(changed, axis=1, keepdims=True)
    update_grazing(legs, row, scatterers.normal)


def tilted_planes(scene: Scene, points: Floats, time: Floats) -> tuple[Floats, Floats]:
    """A point of the surface, and its unit normal into the water, at some positions and times.

    Args:
        scene: The scene, with a swell.
        points: North and east [m], shape (..., 2).
        time: Time after the start of the track [s], shape (...).

    Returns:
        North, east, depth of the surface [m], and its normal [1], both of shape (..., 3).
    """
    swell = scene.surface.swell
    assert swell is not None  # guaranteed by the surface
    k = 2 * math.pi / swell.length
    omega = float(angular_frequency(k, water_depth=scene.seabed.depth))
    ahead = np.array([math.cos(scene.surface.wave_direction), math.sin(scene.surface.wave_direction)])
    phase = k * ((points - np.array(scene.seabed.scatterer_grid.origin)) @ ahead) - omega * time
    elevation, slope = swell.height / 2 * np.cos(phase), -k * swell.height / 2 * np.sin(phase)
    point = np.concatenate([points, -elevation[..., None]], axis=-1)
    # Depth + elevation is constant on the surface: its gradient is the normal.
    normal = np.concatenate([slope[..., None] * ahead, np.ones((*slope.shape, 1))], axis=-1)
    return point, normal / np.linalg.norm(normal, axis=-1, keepdims=True)
