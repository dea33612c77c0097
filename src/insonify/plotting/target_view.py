"""Targets of a scenario in one ping: range, bearing, times of their echoes, and the beam with the highest level."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import families_up_to, image_depth
from insonify.scenario.scenario import Scenario
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.scene.target import Box, PointTarget, Solid
from insonify.simulator import arrivals, build_simulator
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.arrival_weights import arrival_weights

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TargetView:
    """Range and bearing of a target relative to the receive array."""

    label: str
    slant: float
    """Distance from the receiver [m]."""
    bearing: float
    """Bearing to the right of boresight, as beams are steered [rad]; NaN behind the array."""
    half_extent: float
    """Half its horizontal diagonal [m]; 0 for a point."""
    near_side: float
    """Slant range of its nearest part at that bearing [m]; `slant` for a point."""


def strongest_target(scenario: Scenario, ping: int, channels: list[int]) -> tuple[int, int] | None:
    """Find the target with the highest energy over direct paths, and its channel.

    Args:
        scenario: Scenario of the recording.
        ping: Number of the ping.
        channels: Channels that are compared.

    Returns:
        Row of the target and number of the channel; None where no target has an echo in the window.
    """
    direct = scenario.paths.model_copy(update={"max_reflections": 0, "families": None, "contributions": ("target",)})
    only, simulator, beams = (
        scenario.model_copy(update={"paths": direct}),
        build_simulator(scenario),
        scenario.sonar.beam_count,
    )
    sides = {channel // beams: arrivals(only, ping, channel=channel) for channel in channels}
    highest, strongest = 0.0, None
    for channel in channels:
        paths, geometry = sides[channel // beams], simulator.ping_geometry(ping, channel=channel)
        energy = np.abs(arrival_weights(paths, geometry, channel % beams)) ** 2
        for row, target in enumerate(scenario.targets):
            target_energy = float(energy[paths.object == target.label].sum())
            if target_energy > highest:
                highest, strongest = target_energy, (row, channel)
    return strongest


def echo_window(scenario: Scenario, ping: int, target: Solid | PointTarget) -> tuple[float, float]:
    """Start of a target's first echo and end of its last [s].

    All families are evaluated to the far and the near side of the target by image sources.

    Args:
        scenario: Scenario of the recording.
        ping: Number of the ping.
        target: Target of the scenario.
    """
    geometry, floor = build_simulator(scenario).ping_geometry(ping), scenario.seabed.depth
    chosen = scenario.paths.families or families_up_to(scenario.paths.max_reflections)
    position, half = middle(target, scenario.scene), half_extent(target, scenario.scene)
    reach = np.zeros((2, len(chosen), 2))  # transmitter and receiver, family, near and far side [m]
    for end, source in enumerate((geometry.transmit_position, geometry.receive_position)):
        across = float(np.hypot(*(position - source)[:2]))
        for row, family in enumerate(chosen):
            down = position[2] - image_depth(family, float(source[2]), floor)
            reach[end, row] = np.hypot(np.maximum(across + np.array([-half, half]), 0), down)
    first, last = (of(reach, axis=(1, 2)).sum() / scenario.water.sound_speed for of in (np.min, np.max))
    return float(first + geometry.pulse.start), float(last + geometry.pulse.stop)


def middle(target: Solid | PointTarget, scene: Scene) -> Floats:
    """North, east, depth of the centre of a target's submerged part [m], shape (3,).

    Args:
        target: Target of the scene.
        scene: Scene with its seabed.
    """
    if isinstance(target, PointTarget):
        return np.array(target.position)
    surface = world_triangles(target, scene.seabed)
    return (surface.low + surface.high) / 2


def half_extent(target: Solid | PointTarget, scene: Scene) -> float:
    """Half the horizontal diagonal of a target [m]; 0 for a point.

    Args:
        target: Target of the scene.
        scene: Scene with its seabed.
    """
    if isinstance(target, PointTarget):
        return 0.0
    if isinstance(target, Box) and target.is_upright:
        return float(np.hypot(*target.size[:2])) / 2
    surface = world_triangles(target, scene.seabed)
    return float(np.hypot(*(surface.high - surface.low)[:2])) / 2


def targets_in_view(scenario: Scenario, ping: int) -> list[TargetView]:
    """Range and bearing of all targets relative to the receive array of one ping."""
    geometry: PingGeometry = build_simulator(scenario).ping_geometry(ping)
    ahead, right, down = geometry.receive_beams.axes
    views, scene = [], scenario.scene
    for target in scenario.targets:
        offset = middle(target, scene) - geometry.receive_position
        slant = float(np.linalg.norm(offset))
        bearing = float(np.arcsin(np.clip(offset @ right / slant, -1, 1))) if offset @ ahead > 0 else np.nan
        near = slant
        if not isinstance(target, PointTarget):
            corners = world_triangles(target, scene.seabed).corners - geometry.receive_position
            near = nearest_in_plane(corners, np.cross(offset / slant, down))
        views.append(TargetView(target.label, slant, bearing, half_extent(target, scene), near))
    return views


def nearest_in_plane(corners: Floats, normal: Floats) -> float:
    """Distance from the origin to the nearest part of a surface in a plane through the origin [m].

    Args:
        corners: Corners of its triangles [m], shape (t, 3, 3).
        normal: Normal of the plane [1], shape (3,).

    Returns:
        The distance; that of the nearest corner where the plane does not meet the surface.
    """
    side = corners @ normal
    cut = (side.min(axis=1) <= 0) & (side.max(axis=1) > 0)
    if not cut.any():
        return float(np.linalg.norm(corners, axis=-1).min())
    corners, side = corners[cut], side[cut]
    to_corners, to_side = np.roll(corners, -1, axis=1), np.roll(side, -1, axis=1)
    crossed = (side > 0) != (to_side > 0)  # two edges of each triangle
    part = (side[crossed] / (side - to_side)[crossed])[:, None]
    start, end = np.moveaxis((corners[crossed] + part * (to_corners - corners)[crossed]).reshape(-1, 2, 3), 1, 0)
    along = end - start
    nearest = -np.sum(start * along, axis=1) / np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
    return float(np.linalg.norm(start + np.clip(nearest, 0, 1)[:, None] * along, axis=1).min())
