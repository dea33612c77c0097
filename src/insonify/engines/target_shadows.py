"""Distances over which targets may cast shadows on the seabed, by rays to its mean plane."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.propagation.propagation_model import PropagationModel
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

PROBES = 48
"""Number of positions behind a target at which rays are tested for occlusion."""


class ShadowSector(NamedTuple):
    """Azimuths and horizontal distances from the transmitter at which one target may cast a shadow on the seabed."""

    bearing: float
    """Bearing of its middle [rad]."""
    half_width: float
    """Half of its angular width [rad]."""
    near: float
    """Nearest horizontal distance [m]."""
    far: float
    """Farthest horizontal distance [m]."""


def shadow_sector(
    scene: Scene, rays: PropagationModel, ping_geometry: PingGeometry, families: tuple[str, ...], row: int,
    farthest: float, *, soft: bool,
) -> ShadowSector:  # fmt: skip
    """Shadow sector of one target; all bearings and distances where the sonar is above or inside it.

    Args:
        scene: The scene.
        rays: Rays of the scene's water.
        ping_geometry: The sonar at one ping.
        families: Families of legs that are followed.
        row: Row of the target among the scene's occluders.
        farthest: Largest horizontal distance of the seabed [m].
        soft: True if sound is diffracted at the edges of the target: the shadow has a penumbra.
    """
    position, (north, east, radius, *_) = ping_geometry.transmit_position, bounding_cylinders(scene)[row]
    target_distance = float(np.hypot(north - position[0], east - position[1]))
    bearing = np.arctan2(east - position[1], north - position[0])
    if target_distance <= radius:
        return ShadowSector(float(bearing), np.pi, 0.0, farthest)
    half, nearest = float(np.arcsin(radius / target_distance)), target_distance - radius
    distance = nearest + np.maximum(farthest - nearest, 0.0) * np.linspace(0, 1, PROBES) ** 2
    points, up = np.full((PROBES, 3), scene.seabed.depth), np.zeros((PROBES, 3))
    points[:, 0], points[:, 1] = position[0] + distance * np.cos(bearing), position[1] + distance * np.sin(bearing)
    up[:, 2] = -1.0
    law = scene.seabed.law(ping_geometry.frequency, float(scene.water.sound_speed_at(scene.seabed.depth)))
    if law is None:
        return ShadowSector(float(bearing), half, nearest, farthest)
    probes = Scatterers(
        "seabed", "seabed", law, points, up, np.ones(PROBES), np.ones(PROBES, complex), np.zeros(PROBES, np.uint64)
    )
    legs = rays.legs(position, probes, families, ping_geometry.frequency)
    hidden = np.flatnonzero((legs.occluder == row).any(axis=0))
    last = int(hidden[-1]) if len(hidden) else 0
    if last == PROBES - 1:
        return ShadowSector(float(bearing), half, nearest, farthest)
    shadow_end = float(distance[min(last + 1, PROBES - 1)])
    terrain, sine = scene.seabed.terrain, float(legs.grazing_sine[0, last])
    lower = 0.0 if terrain is None else terrain.span[1] - scene.seabed.depth
    if soft:
        lower += np.sqrt(ping_geometry.wavelength * shadow_end) / 2  # about the penumbra of an edge half way
    tangent = sine / np.sqrt(1 - sine**2) if abs(sine) < 1 else 0.0
    return ShadowSector(float(bearing), half, nearest, min(farthest, shadow_end + lower / max(tangent, 1e-3)))
