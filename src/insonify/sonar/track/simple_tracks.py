"""Tracks of a platform that does not move, and of one that moves straight ahead."""

from typing import Literal

import numpy as np
from pydantic import Field

from insonify.model import MetresPerSecond
from insonify.sonar.track.ping_schedule import FixedHeading, FixedTilt, PingCount, PingSchedule, Position, ping_times
from insonify.sonar.track.poses import Poses


class StaticTrack(PingSchedule, FixedTilt, FixedHeading):
    """A platform that does not move.

    Example:
        >>> track = StaticTrack(position=(0, 0, "5 m"), heading="90 deg", interval="0.5 s", pings=3)
        >>> true_poses(track).time.tolist()
        [0.0, 0.5, 1.0]
    """

    kind: Literal["static"] = "static"
    position: Position
    """Position of the platform's reference point: north, east, depth [m]."""
    pings: PingCount = 1
    """Number of pings [1]."""

    @property
    def ping_count(self) -> int:
        """Number of pings."""
        return self.pings

    def planned_poses(self, after: float = 0.0) -> Poses:
        """Poses without the platform's motion, some time [s] after the start of each ping."""
        time = ping_times(self.pings, self.interval) + after
        position = np.tile(np.asarray(self.position, dtype=float), (self.pings, 1))
        return Poses(time, position, *(np.full(self.pings, angle) for angle in (self.heading, self.pitch, self.roll)))


class LineTrack(PingSchedule, FixedTilt, FixedHeading):
    """A platform that runs straight ahead at constant depth and speed.

    Example:
        >>> track = LineTrack(start=(0, 0, 5), heading="90 deg", speed="2 m/s", interval="0.5 s", pings=101)
        >>> true_poses(track).position[-1].round(3).tolist()
        [0.0, 100.0, 5.0]
    """

    kind: Literal["line"] = "line"
    start: Position
    """Position of the reference point at the first ping: north, east, depth [m]."""
    speed: MetresPerSecond = Field(ge=0, le=100)
    """Speed along the heading [m/s]."""
    pings: PingCount = 1
    """Number of pings [1]."""

    @property
    def ping_count(self) -> int:
        """Number of pings."""
        return self.pings

    def planned_poses(self, after: float = 0.0) -> Poses:
        """Poses without the platform's motion, some time [s] after the start of each ping."""
        time = ping_times(self.pings, self.interval) + after
        direction = np.array([np.cos(self.heading), np.sin(self.heading), 0.0])
        position = np.asarray(self.start) + self.speed * time[:, None] * direction
        return Poses(time, position, *(np.full(self.pings, angle) for angle in (self.heading, self.pitch, self.roll)))
