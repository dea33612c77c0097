"""Work of diffraction around targets, counted by the targets that stand within some Fresnel zones of each leg.

Seabed is sampled on rings about the sonar, targets at their middles. Direct legs that pass high above a target are left
out; all others pass it as seen from above.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.memory_budget import legs_per_point
from insonify.estimates import unit_costs
from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.propagation.families import DIRECT
from insonify.propagation.knife_edge import RIPPLES, ROUGH_RIPPLES
from insonify.propagation.knife_edge_kernel import FAR
from insonify.propagation.silhouette import COLUMNS, MIN_COLUMNS
from insonify.simulator import Simulator
from insonify.sonar.ping_geometry import PingGeometry
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

DIRECTIONS = 360
"""Directions in which the seabed near targets is counted [1]."""


def diffraction_seconds_on_seabed(
    simulator: Simulator, ping_geometry: PingGeometry, families: tuple[str, ...], points: Floats, distance: Floats
) -> float:
    """Processor time of diffraction of the legs to the seabed [s].

    Args:
        simulator: A prepared scenario.
        ping_geometry: One side of the sonar at one ping.
        families: Families of the legs.
        points: Scatterers at each distance [1], shape (n,).
        distance: Horizontal distances [m], shape (n,).
    """
    if not _diffracts(simulator) or not distance.any():
        return 0.0
    start, azimuth = ping_geometry.transmit_position, np.linspace(0, 2 * np.pi, DIRECTIONS, endpoint=False)
    offset = distance[:, None, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    depth = np.full((*offset.shape[:2], 1), simulator.scenario.seabed.depth)
    position = np.concatenate([start[:2] + offset, depth], axis=-1).reshape(-1, 3)
    direction = (position - start) / np.linalg.norm(position - start, axis=1, keepdims=True)
    ends = ping_geometry.transmit_beams, ping_geometry.receive_beams
    gain = np.prod([np.abs(end.gain(direction)).max(axis=0) for end in ends], axis=0)
    within = gain >= amplitude_ratio(simulator.scenario.paths.beam_cutoff_db) * gain.max()
    seconds = np.zeros(len(position))
    legs = legs_per_point(simulator.engine.scene, simulator.scenario.paths, "seabed", drawn=True)
    seconds[within] = _seconds_per_point(simulator, ping_geometry, families, position[within], legs)
    share = seconds.reshape(-1, DIRECTIONS).sum(axis=1) / np.maximum(within.reshape(-1, DIRECTIONS).sum(axis=1), 1)
    return float(points @ share)


def diffraction_seconds_on_targets(
    simulator: Simulator, ping_geometry: PingGeometry, families: tuple[str, ...]
) -> float:
    """Mean processor time of diffraction of all legs to a point of a target around the other targets [s].

    Args:
        simulator: A prepared scenario.
        ping_geometry: One side of the sonar at one ping.
        families: Families of the legs.
    """
    scene = simulator.engine.scene
    if not _diffracts(simulator) or len(scene.occluders) < 2:
        return 0.0
    north, east, _, top, base = bounding_cylinders(scene).T
    middle = np.stack([north, east, (top + base) / 2], axis=-1)
    legs = legs_per_point(scene, simulator.scenario.paths, "target", drawn=True)
    return float(_seconds_per_point(simulator, ping_geometry, families, middle, legs, own=True).mean())


def _diffracts(simulator: Simulator) -> bool:
    """Return True if the scene has targets around which sound is diffracted."""
    return simulator.scenario.paths.edge_diffraction != "none" and bool(simulator.engine.scene.occluders)


def _seconds_per_point(
    simulator: Simulator, ping_geometry: PingGeometry, families: tuple[str, ...], position: Floats, legs: int, *,
    own: bool = False,
) -> Floats:  # fmt: skip
    """Processor time of diffraction of all legs to each position [s], shape (n,).

    Args:
        simulator: A prepared scenario.
        ping_geometry: One side of the sonar at one ping.
        families: Families of the legs.
        position: North, east, depth of the ends of the legs [m], shape (n, 3).
        legs: Legs to each, glints of rough boundaries included [1].
        own: True where each position is the middle of a target, around which its legs are not diffracted.
    """
    scene, rough = simulator.engine.scene, simulator.engine.approximate_edges
    wavelength, boxes = ping_geometry.sound_speed / ping_geometry.frequency, len(scene.boxes)
    start = ping_geometry.transmit_position
    reach = np.maximum(np.linalg.norm(position[:, :2] - start[:2], axis=1), 1e-9)
    direction = (position[:, :2] - start[:2]) / reach[:, None]
    direct = sum(name == DIRECT for name in families)
    seconds, by_boxes = np.zeros(len(position)), np.zeros(len(position), bool)
    for row, (north, east, radius, top, _) in enumerate(bounding_cylinders(scene).tolist()):
        along = (north - start[0]) * direction[:, 0] + (east - start[1]) * direction[:, 1]
        lateral_offset = np.abs((east - start[1]) * direction[:, 0] - (north - start[0]) * direction[:, 1])
        beyond = reach - along
        number = ROUGH_RIPPLES if rough else FAR if row < boxes else RIPPLES
        product = np.maximum(along, wavelength) * np.maximum(beyond, wavelength)
        clearance = number * np.sqrt(wavelength / 2 * product / np.maximum(reach, wavelength))
        near = (np.minimum(along, beyond) > -radius) & (lateral_offset <= radius + clearance)
        if own:
            near[row] = False
        if row < boxes:
            by_boxes |= near
            continue
        low = start[2] + (position[:, 2] - start[2]) * along / reach >= top - clearance
        width = np.sqrt(wavelength) / 2
        columns = float(np.clip(np.ceil(2 * radius / width), MIN_COLUMNS, COLUMNS)) if rough else COLUMNS
        around = near * (legs - direct) + (near & low) * direct
        seconds += around * columns * unit_costs.SECONDS_PER_DIFFRACTING_COLUMN
    by_each = boxes * legs * unit_costs.SECONDS_PER_DIFFRACTING_BOX
    return (seconds + by_boxes * by_each) * (1 if ping_geometry.is_monostatic else 2)
