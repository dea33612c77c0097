"""Beams of a fan that have a target in their main lobe: elsewhere its echoes are those of sidelobes.

A strong target exceeds the seabed in the sidelobes of all beams, at its range. Such samples are highlights in the
labels of a recording; an annotation of them would be an arc over the whole sector instead of an object.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import image_depth
from insonify.scenario.scenario import Scenario
from insonify.scene.solid import world_triangles
from insonify.scene.target import PointTarget, Target
from insonify.simulator import Simulator
from insonify.sonar.ping_geometry import PingGeometry
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

MAIN_LOBE_DB = -12.0
"""Gain of a receive beam down to which its main lobe reaches: just above the first sidelobe, -13.3 dB, of a uniform
aperture [dB]."""


def beams_at_targets(simulator: Simulator, ping: int, families: Sequence[str]) -> dict[str, NDArray[np.bool_]]:
    """Channels that have each target in the main lobe of their receive beam, by its label, shape (channels,) each.

    Args:
        simulator: Simulator of the scenario with its targets.
        ping: Number of the ping.
        families: Families of receive legs: by way of the surface a target appears nearer to the boresight. The bed
            is taken as flat. Vertical patterns do not count.
    """
    scenario, sides = simulator.scenario, simulator.ping_geometries(ping)
    points = {target.label: _corners(target, scenario) for target in scenario.targets}
    return {
        label: np.concatenate(
            [_in_main_lobe(_seen_from(side, position, families, scenario.seabed.depth), side) for side in sides]
        )
        for label, position in points.items()
    }


def _corners(target: Target, scenario: Scenario) -> Floats:
    """Corners of a target's submerged surface: north, east, depth [m], shape (n, 3)."""
    if isinstance(target, PointTarget):
        return np.array([target.position], float)
    return world_triangles(target, scenario.scene.seabed).corners.reshape(-1, 3)


def _seen_from(geometry: PingGeometry, points: Floats, families: Sequence[str], water_depth: float) -> Floats:
    """Cosines to the right of the array of the directions to points ahead of it by some families [1], shape (any,)."""
    ahead, right, _ = geometry.receive_beams.axes
    north, east, depth = geometry.receive_position.tolist()
    cosines = []
    for family in families:
        offset = points - np.array([north, east, image_depth(family, depth, water_depth)])
        offset = offset[offset @ ahead > 0]
        cosines.append(offset @ right / np.linalg.norm(offset, axis=1))
    return np.concatenate([np.empty(0), *cosines])


def _in_main_lobe(across: Floats, geometry: PingGeometry) -> NDArray[np.bool_]:
    """Channels of one side with any bearing between some cosines to the right in their main lobe, shape (channels,)."""
    if not across.size:
        return np.zeros(geometry.channel_count, bool)
    beams = geometry.receive_beams
    nearest, below = np.clip(beams.steer[:, 0], across.min(), across.max()), beams.steer[:, 1]
    ahead = np.sqrt(np.maximum(1 - nearest**2 - below**2, 0.0))
    gain = np.diagonal(beams.gain(np.column_stack([ahead, nearest, below]) @ beams.axes))
    return np.asarray(np.abs(gain) >= amplitude_ratio(MAIN_LOBE_DB))
