"""The voyage: a track's planned path and the motion about it, as the true poses of every ping."""

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
    """Every true pose of a track.

    Args:
        track: The track.
        seed: Seed of the scenario, for its motion. A track without motion does not use it.
        after: How long after the start of each ping [s]; a path goes straight on from its end.

    Returns:
        One row per ping. Surge and sway are horizontal, along the planned heading.
    """
    plan = track.planned_poses(after)
    if track.motion.is_still:
        return plan
    moved = displacement(track.motion, plan.time, seed)
    c, s = np.cos(plan.heading), np.sin(plan.heading)
    surge, sway = moved["surge"], moved["sway"]
    offset = np.stack([c * surge - s * sway, s * surge + c * sway, moved["heave"]], axis=-1)
    return replace(
        plan, position=plan.position + offset, heading=plan.heading + moved["yaw"], pitch=plan.pitch + moved["pitch"],
        roll=plan.roll + moved["roll"],
    )  # fmt: skip
