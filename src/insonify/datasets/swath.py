"""Positions on the seabed that a sonar records along its track."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.datasets.distributions import SwathArea
from insonify.scenario.platform_poses import platforms
from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]
TRIES = 200
"""Positions drawn in search of one apart from all others, before the search is given up."""
OUTER_TENTH = 0.1
"""Part of the swath that is left free at its outer edge, where shadows would be cut [1]."""
STEEPEST = np.radians(45)
"""Steepest grazing angle of a position [rad]; nearer to the track, beams are weak and shadows short."""


class PlacementError(ValueError):
    """No position in the swath is free, or there is no swath."""


@dataclass(frozen=True, slots=True)
class RecordedSwath:
    """Ground that a sonar records: along its track, and across it in the sectors of its sides."""

    position: Floats
    """Reference point of the platform at each ping, north and east [m], shape (pings, 2)."""
    heading: Floats
    """Heading at each ping [rad], shape (pings,)."""
    near: float
    """Least horizontal distance [m]."""
    far: float
    """Largest horizontal distance [m]."""
    sectors: tuple[tuple[float, float], ...]
    """Bearing from the bow and half width of the sector of each side [rad]."""

    def point_at(self, uniforms: Floats, along: tuple[float, float]) -> tuple[float, float]:
        """Position that belongs to four uniform numbers, uniform over the area.

        Args:
            uniforms: Numbers above 0 and below 1, shape (4,).
            along: From and to, of the track's length [1].

        Returns:
            North and east [m].
        """
        ping = (along[0] + uniforms[0] * (along[1] - along[0])) * (len(self.heading) - 1)
        heading = float(np.interp(ping, np.arange(len(self.heading)), self.heading))
        origin = [float(np.interp(ping, np.arange(len(self.heading)), column)) for column in self.position.T]
        bearing, half = self.sectors[min(int(uniforms[2] * len(self.sectors)), len(self.sectors) - 1)]
        if half > 0:  # area grows with range
            distance = float(np.sqrt(self.near**2 + uniforms[1] * (self.far**2 - self.near**2)))
        else:
            distance = self.near + float(uniforms[1]) * (self.far - self.near)
        turn = heading + bearing + (2 * float(uniforms[3]) - 1) * half
        return origin[0] + distance * float(np.cos(turn)), origin[1] + distance * float(np.sin(turn))


def swath_of(scenario: Scenario, area: SwathArea) -> RecordedSwath:
    """The swath of a scenario, or the part of it that an area allows.

    Args:
        scenario: The scenario.
        area: The part.

    Raises:
        PlacementError: The recording window does not reach the seabed, or the area lies outside of it.
    """
    poses = platforms(scenario).transmitter_poses
    altitude = scenario.seabed.depth - float(np.median(poses.position[:, 2]))
    start, stop = (scenario.water.sound_speed / 2 * time for time in scenario.track.window)
    if stop <= altitude:
        raise PlacementError(f"the swath is empty: the window ends at a slant range of {stop:.3g} m, and the seabed is "
                             f"{altitude:.3g} m below the sonar. Give track.window a later stop")  # fmt: skip
    near = max(float(np.sqrt(max(start**2 - altitude**2, 0.0))), altitude / float(np.tan(STEEPEST)))
    far = float(np.sqrt(stop**2 - altitude**2))
    low, high = area.across or (near, near + (1 - OUTER_TENTH) * (far - near))
    if low >= high or low > far or high > far:
        raise PlacementError(f"across {low:.3g} to {high:.3g} m lies outside of the swath, which reaches from "
                             f"{near:.3g} to {far:.3g} m. Give others, or track.window a later stop")  # fmt: skip
    sectors = tuple(
        (side.mounting.bearing, _half_sector(side.steers))
        for side, number in zip(scenario.sonar.side_sonars, dict.fromkeys(scenario.sonar.channel_sides), strict=True)
        if area.side == "both" or number == {"port": -1, "starboard": 1}[area.side]
    )
    if not sectors:
        raise PlacementError(f"the sonar has no {area.side} side. Write side: both, or name one that sonar.sides has")
    return RecordedSwath(poses.position[:, :2], np.unwrap(poses.heading), low, high, sectors)


def _half_sector(steers: tuple[float, ...]) -> float:
    """Half the sector of a fan of beams [rad]; 0 of one beam."""
    return float(np.ptp(steers)) / 2 if len(steers) > 1 else 0.0


def free_position(
    swath: RecordedSwath, area: SwathArea, tries: Floats, taken: list[tuple[float, float]]
) -> tuple[float, float]:  # fmt: skip
    """First position of several that is apart from those taken.

    Args:
        swath: The swath.
        area: Part of it, and the least distance.
        tries: Uniform numbers of each position that is tried, shape (t, 4).
        taken: Positions that are taken [m].

    Raises:
        PlacementError: None is.
    """
    for uniforms in tries:
        position = swath.point_at(uniforms, area.along)
        if all(np.hypot(position[0] - north, position[1] - east) >= area.apart for north, east in taken):
            return position
    raise PlacementError(f"no position is {area.apart:g} m apart from the {len(taken)} others, after {len(tries)} "
                         "tries. Give a smaller distance, a larger area or fewer targets")  # fmt: skip
