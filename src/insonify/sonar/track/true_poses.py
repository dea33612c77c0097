"""True poses of every ping: the planned path of a track and the platform's motion about it."""

from dataclasses import replace

import numpy as np

from insonify.sonar.track.motion import displacement
from insonify.sonar.track.navigation import NavigationTrack
from insonify.sonar.track.poses import Poses
from insonify.sonar.track.simple_tracks import LineTrack, StaticTrack
from insonify.sonar.track.waypoints import WaypointTrack


def true_poses(
    track: StaticTrack | LineTrack | WaypointTrack | NavigationTrack, *, seed: int = 1, after: float = 0.0
) -> Poses:  # fmt: skip
    """True poses of a track at all pings.

    Args:
        track: The track.
        seed: Seed of the scenario, for the random motion.
        after: Time after the start of each ping [s]; beyond its end a path continues straight.

    Returns:
        One row per ping. Surge and sway are horizontal, along the planned heading and across it.

    Example:
        >>> track = LineTrack(start=(0, 0, 5), heading="90 deg", speed="2 m/s", interval="0.5 s", pings=3)
        >>> true_poses(track).position.round(3).tolist()
        [[0.0, 0.0, 5.0], [0.0, 1.0, 5.0], [0.0, 2.0, 5.0]]
    """
    plan = track.planned_poses(after)
    if track.motion.is_still:
        return plan
    motion = displacement(track.motion, plan.time, seed)
    c, s = np.cos(plan.heading), np.sin(plan.heading)
    surge, sway = motion["surge"], motion["sway"]
    offset = np.stack([c * surge - s * sway, s * surge + c * sway, motion["heave"]], axis=-1)
    return replace(
        plan, position=plan.position + offset, heading=plan.heading + motion["yaw"], pitch=plan.pitch + motion["pitch"],
        roll=plan.roll + motion["roll"],
    )  # fmt: skip
