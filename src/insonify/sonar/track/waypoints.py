"""A track through waypoints."""

from functools import lru_cache
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from insonify.model import Metres, MetresPerSecond, field_error
from insonify.sonar.track.ping_schedule import (
    FixedTilt,
    PingCount,
    PingSchedule,
    Position,
    checked_ping_count,
    max_ping_count,
    ping_times,
)
from insonify.sonar.track.poses import Poses
from insonify.sonar.track.waypoint_path import TurnRadiusError, WaypointPath, rounded_path

Floats = NDArray[np.float64]


class WaypointTrack(PingSchedule, FixedTilt):
    """A platform that moves from waypoint to waypoint at constant speed, heading along its path.

    Example:
        >>> track = WaypointTrack(waypoints=[(0, 0, 5), (100, 0, 5), (100, 50, 5)], speed="2 m/s", interval="1 s")
        >>> track.ping_count
        76
        >>> np.degrees(true_poses(track).heading[[0, -1]]).round().tolist()
        [0.0, 90.0]
    """

    kind: Literal["waypoints"] = "waypoints"
    waypoints: tuple[Position, ...]
    """Corners of the path: north, east, depth [m]; at least two."""
    speed: MetresPerSecond = Field(gt=0, le=100)
    """Speed along the path [m/s]."""
    turn_radius: Annotated[Metres, Field(ge=0, le=1e6)] = 0.0
    """Radius of the arcs that cut the corners [m]; 0: the platform turns on the spot, at the waypoint."""
    pings: PingCount | None = None
    """Number of pings [1]; None: as many as fit between first and last waypoint."""

    @model_validator(mode="after")
    def _check_track(self) -> Self:
        corners = self.waypoints
        if len(corners) < 2:
            raise field_error(
                "waypoints", f"{len(corners)}", "of them is no path. Give two or more of [north, east, depth]."
            )
        for row in range(1, len(corners)):
            if corners[row][:2] == corners[row - 1][:2]:
                raise field_error(
                    f"waypoints.{row}", None, f"waypoint {row} is at, or straight above or below, the one before it, "
                    "and a platform faces where it goes. Move it in north or east, or leave it out.",
                )  # fmt: skip
        try:
            path = self._path
        except TurnRadiusError as fault:
            raise field_error(f"waypoints.{fault.waypoint}", None, _turning_advice(fault, self.turn_radius)) from None
        end = f"the last waypoint, {path.length.sum() / self.speed:.4g} s after the first"
        checked_ping_count(self.pings, self._max_pings, "pings", end=end)
        return self

    @property
    def _path(self) -> WaypointPath:
        return _cached_path(self.waypoints, self.turn_radius)

    @property
    def _max_pings(self) -> int:
        return max_ping_count(float(self._path.length.sum()) / self.speed, self.interval)

    @property
    def ping_count(self) -> int:
        """Number of pings."""
        return self._max_pings if self.pings is None else self.pings

    def planned_poses(self, after: float = 0.0) -> Poses:
        """Poses without the platform's motion, some time [s] after the start of each ping."""
        time = ping_times(self.ping_count, self.interval) + after
        position, heading = self._path.at(self.speed * time)
        pitch, roll = (np.full(len(time), angle) for angle in (self.pitch, self.roll))
        return Poses(time, position, heading, pitch, roll)


@lru_cache(maxsize=64)
def _cached_path(waypoints: tuple[Position, ...], radius: float) -> WaypointPath:
    return rounded_path(np.array(waypoints, dtype=float), radius)


def _turning_advice(fault: TurnRadiusError, radius: float) -> str:
    angle = abs(np.degrees(fault.angle))
    if fault.required > 1e6:
        return (
            f"the path turns back on itself at waypoint {fault.waypoint} ({angle:.4g} deg), and no arc does. "
            "Put two waypoints there, two turning radii apart, or write turn_radius: 0 m."
        )
    largest = radius * fault.length / fault.required
    return (
        f"the turn of {angle:.4g} deg at waypoint {fault.waypoint} and its neighbour take {fault.required:.4g} m of "
        f"a run of {fault.length:.4g} m. Write a turn_radius of {largest:.4g} m or less, or move the waypoints apart."
    )
