"""Errors of poses that leave the water, or put an array into a target."""

import numpy as np

from insonify.scenario.element_errors import elements_out_of_water
from insonify.scenario.scenario import Scenario
from insonify.scenario.scenario_errors import MIN_POINT_DISTANCE
from insonify.scenario.track_errors import PLATFORM, RECEIVER, array_positions
from insonify.scene.scene import Scene, inside_body
from insonify.scene.solid import seabed_depth_at
from insonify.scene.target import PointTarget
from insonify.sonar.platforms import Platforms


def require_in_water(scenario: Scenario, scene: Scene, platforms: Platforms) -> None:
    """Refuse a pose whose arrays are not in the water.

    Args:
        scenario: What is simulated.
        scene: Its scene.
        platforms: The platforms at one ping.

    Raises:
        ValueError: An array is above the sea surface, below the seabed, in a target or at a point target.
    """
    for name, position in array_positions(scenario, platforms).items():
        if name in (PLATFORM, RECEIVER):
            continue
        depth, bed = float(position[0, 2]), float(seabed_depth_at(scene.seabed, position)[0])
        where = f"position puts {name} at {np.round(position[0], 3).tolist()} m (north, east, depth)"
        if depth <= 0:
            raise ValueError(f"{where}, at or above the sea surface. Depths are positive downwards; give a depth "
                             f"between 0 and {bed:.6g} m.")  # fmt: skip
        if depth >= bed:
            raise ValueError(f"{where}, at or below the seabed, which is at {bed:.6g} m there. Give a lesser depth.")
        for target in scene.targets:
            if isinstance(target, PointTarget):
                if np.linalg.norm(position[0] - np.array(target.position)) < MIN_POINT_DISTANCE:
                    raise ValueError(f"{where}, less than {MIN_POINT_DISTANCE:g} m from {target.label}, the distance "
                                     "that levels refer to. Keep farther away.")  # fmt: skip
            elif inside_body(target, scene.seabed, position)[0]:
                raise ValueError(f"{where}, inside {target.label}. Keep out of the target.")
    if scenario.sonar.receiver.record != "elements":
        return
    for side in scenario.sonar.side_sonars:
        for _, element, depth in elements_out_of_water(side, platforms.receiver_poses, scenario.seabed.depth):
            raise ValueError(f"attitude and position put element {element} of the receive array out of the water, at "
                             f"{depth:.4g} m. Give another depth or attitude.")  # fmt: skip
