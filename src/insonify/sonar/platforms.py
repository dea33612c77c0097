"""Platforms of the two ends of a sonar: one for both, or one for each.

A pair of platforms is bistatic: the receiver keeps the transmitter's clock, its poses are those of the same moments.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.platform_motion import PlatformMotion, TrackMotion, track_motion
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Platforms:
    """Platforms of transmitter and receiver, at every ping."""

    transmitter_poses: Poses
    """True poses of the transmitter's platform at the start of each ping."""
    own_receiver_poses: Poses | None = None
    """Those of the receiver's at the same moments; None: both ends ride the same platform."""
    transmitter_window_poses: tuple[Poses, Poses] | None = None
    """Of the transmitter's at the middle and at the end of the window of every ping; None: stop and hop."""
    receiver_window_poses: tuple[Poses, Poses] | None = None
    """Window poses of the receiver's platform, in the same form."""

    @property
    def is_bistatic(self) -> bool:
        """True where the receiver has a platform of its own."""
        return self.own_receiver_poses is not None

    @property
    def receiver_poses(self) -> Poses:
        """Poses of the receiver's platform."""
        return self.transmitter_poses if self.own_receiver_poses is None else self.own_receiver_poses

    @property
    def end_poses(self) -> tuple[Poses, Poses]:
        """Poses of the transmitter's platform, and of the receiver's."""
        return self.transmitter_poses, self.receiver_poses

    @cached_property
    def positions(self) -> Floats:
        """Places of every platform at all pings [m], shape (n, 3)."""
        if self.own_receiver_poses is None:
            return self.transmitter_poses.position
        return np.concatenate([self.transmitter_poses.position, self.own_receiver_poses.position])

    @property
    def max_separation(self) -> float:
        """Greatest distance between the platforms at any ping [m]."""
        return float(np.linalg.norm(self.transmitter_poses.position - self.receiver_poses.position, axis=1).max())

    @property
    def window_poses(self) -> tuple[tuple[Poses, ...], tuple[Poses, ...]]:
        """Poses of each platform at the start, middle and end of every window; of stop and hop, at the start alone."""
        first = (self.transmitter_poses, *(self.transmitter_window_poses or ()))
        return first, first if self.own_receiver_poses is None else (
            self.own_receiver_poses,
            *(self.receiver_window_poses or ()),
        )

    def ping_motions(self, ping: int, window: float) -> tuple[PlatformMotion | None, PlatformMotion | None]:
        """Motion of each platform from the start of a ping; None for both where neither moves.

        Args:
            ping: Number of the ping.
            window: Length of the window [s].
        """
        if self.track_motions is None:
            return None, None
        first, other = self.track_motions
        if not (first.is_moving[ping] or other.is_moving[ping]):
            return None, None
        poses = first.at(ping, window)
        return poses, poses if other is first else other.at(ping, window)

    def single_ping(self, ping: int) -> "Platforms":
        """The platforms at one ping alone, as its number 0.

        Args:
            ping: Number of the ping.
        """
        row = slice(ping, ping + 1)
        own, first, other = self.own_receiver_poses, self.transmitter_window_poses, self.receiver_window_poses
        return Platforms(
            self.transmitter_poses.take(row), None if own is None else own.take(row),
            None if first is None else (first[0].take(row), first[1].take(row)),
            None if other is None else (other[0].take(row), other[1].take(row)),
        )  # fmt: skip

    def turned(self, angle: float) -> "Platforms":
        """The transmitter's platform with other headings; its receiver rides on it.

        Args:
            angle: Angle to starboard that is added to every heading [rad].
        """
        first, *later = (
            replace(poses, heading=poses.heading + angle)
            for poses in (self.transmitter_poses, *(self.transmitter_window_poses or ()))
        )
        return Platforms(first, None, (later[0], later[1]) if later else None)

    @cached_property
    def track_motions(self) -> tuple[TrackMotion, TrackMotion] | None:
        """Motion of each platform from the start of every ping; None where they stop and hop."""
        if self.transmitter_window_poses is None:
            return None
        first = track_motion(self.transmitter_poses, self.transmitter_window_poses)
        if self.own_receiver_poses is None or self.receiver_window_poses is None:
            return first, first
        return first, track_motion(self.own_receiver_poses, self.receiver_window_poses)
