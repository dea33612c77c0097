"""Tracks: where the platform is, and how it leans, at every ping; and what its navigation system says of that."""

from typing import Annotated

from pydantic import Field

from insonify.sonar.track.fixed import LineTrack, StaticTrack
from insonify.sonar.track.logged import AngleError, LoggedNavigation, PlaceError, logged_poses
from insonify.sonar.track.motion import Drift, Motion, Swing
from insonify.sonar.track.navigation import NavigationTrack
from insonify.sonar.track.pinging import LONGEST_WINDOW, MOST_PINGS
from insonify.sonar.track.poses import Poses
from insonify.sonar.track.voyage import poses
from insonify.sonar.track.waypoints import WaypointTrack

Track = Annotated[StaticTrack | LineTrack | WaypointTrack | NavigationTrack, Field(discriminator="kind")]

__all__ = [
    "LONGEST_WINDOW",
    "MOST_PINGS",
    "AngleError",
    "Drift",
    "LineTrack",
    "LoggedNavigation",
    "Motion",
    "NavigationTrack",
    "PlaceError",
    "Poses",
    "StaticTrack",
    "Swing",
    "Track",
    "WaypointTrack",
    "logged_poses",
    "poses",
]
