"""Tracks: position and attitude of the platform at every ping, true and as logged by its navigation system."""

from typing import Annotated

from pydantic import Field

from insonify.sonar.track.motion import Motion, RandomRotation, RandomTranslation
from insonify.sonar.track.navigation import NavigationTrack
from insonify.sonar.track.navigation_errors import AngleError, NavigationErrors, PositionError, logged_poses
from insonify.sonar.track.ping_schedule import MAX_PINGS, MAX_WINDOW
from insonify.sonar.track.poses import Poses
from insonify.sonar.track.simple_tracks import LineTrack, StaticTrack
from insonify.sonar.track.true_poses import true_poses
from insonify.sonar.track.waypoints import WaypointTrack

Track = Annotated[StaticTrack | LineTrack | WaypointTrack | NavigationTrack, Field(discriminator="kind")]

__all__ = [
    "MAX_PINGS",
    "MAX_WINDOW",
    "AngleError",
    "LineTrack",
    "Motion",
    "NavigationErrors",
    "NavigationTrack",
    "Poses",
    "PositionError",
    "RandomRotation",
    "RandomTranslation",
    "StaticTrack",
    "Track",
    "WaypointTrack",
    "logged_poses",
    "true_poses",
]
