"""Platforms of transmitter and receiver of a sonar: one for both, or one for each.

With two platforms the sonar is bistatic; both have the same clock, and their poses are simultaneous.
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
    separate_receiver_poses: Poses | None = None
    """True poses of a separate platform of the receiver, at the same times; None: one platform carries both ends."""
    transmitter_window_poses: tuple[Poses, Poses] | None = None
    """Poses of the transmitter's platform at the middle and the end of the window of every ping; None: stop and hop."""
    receiver_window_poses: tuple[Poses, Poses] | None = None
    """Poses of the receiver's separate platform at the middle and the end of every window; None: stop and hop."""

    @property
    def is_bistatic(self) -> bool:
        """True if the receiver has a platform of its own."""
        return self.separate_receiver_poses is not None

    @property
    def receiver_poses(self) -> Poses:
        """Poses of the receiver's platform."""
        return self.transmitter_poses if self.separate_receiver_poses is None else self.separate_receiver_poses

    @property
    def transmitter_and_receiver_poses(self) -> tuple[Poses, Poses]:
        """Poses of the transmitter's platform, and of the receiver's, at the start of each ping."""
        return self.transmitter_poses, self.receiver_poses

    @cached_property
    def positions(self) -> Floats:
        """Positions of the transmitter's platform at all pings, then of a separate receiver's [m], shape (n, 3)."""
        if self.separate_receiver_poses is None:
            return self.transmitter_poses.position
        return np.concatenate([self.transmitter_poses.position, self.separate_receiver_poses.position])

    @property
    def max_separation(self) -> float:
        """Greatest distance between the platforms at the start of any ping [m]; 0 for one platform."""
        return float(np.linalg.norm(self.transmitter_poses.position - self.receiver_poses.position, axis=1).max())

    @property
    def window_poses(self) -> tuple[tuple[Poses, ...], tuple[Poses, ...]]:
        """Poses of each platform at the start, middle and end of every window; for stop and hop at the start alone."""
        transmitter = (self.transmitter_poses, *(self.transmitter_window_poses or ()))
        return transmitter, transmitter if self.separate_receiver_poses is None else (
            self.separate_receiver_poses,
            *(self.receiver_window_poses or ()),
        )

    def ping_motions(self, ping: int, window: float) -> tuple[PlatformMotion | None, PlatformMotion | None]:
        """Motions of both platforms (transmitter, receiver) from the start of a ping; None for both if neither moves.

        Args:
            ping: Number of the ping.
            window: Length of the window [s].
        """
        if self.track_motions is None:
            return None, None
        transmitter, receiver = self.track_motions
        if not (transmitter.is_moving[ping] or receiver.is_moving[ping]):
            return None, None
        motion = transmitter.at(ping, window)
        return motion, motion if receiver is transmitter else receiver.at(ping, window)

    def single_ping(self, ping: int) -> "Platforms":
        """Platforms at one ping alone, which becomes ping number 0.

        Args:
            ping: Number of the ping.
        """
        row = slice(ping, ping + 1)
        separate, transmitter_window, receiver_window = (
            self.separate_receiver_poses,
            self.transmitter_window_poses,
            self.receiver_window_poses,
        )
        return Platforms(
            self.transmitter_poses.take(row), None if separate is None else separate.take(row),
            None if transmitter_window is None else (transmitter_window[0].take(row), transmitter_window[1].take(row)),
            None if receiver_window is None else (receiver_window[0].take(row), receiver_window[1].take(row)),
        )  # fmt: skip

    def turned(self, angle: float) -> "Platforms":
        """Copy with every heading changed by one angle, for monostatic sonars: a separate receiver is left out.

        Args:
            angle: Change of heading, positive to starboard [rad].
        """
        first, *later = (
            replace(poses, heading=poses.heading + angle)
            for poses in (self.transmitter_poses, *(self.transmitter_window_poses or ()))
        )
        return Platforms(first, None, (later[0], later[1]) if later else None)

    @cached_property
    def track_motions(self) -> tuple[TrackMotion, TrackMotion] | None:
        """Motion of the transmitter's and the receiver's platform from the start of every ping; None for stop and hop.

        One platform, or a separate one whose window poses are not given, has the transmitter's motion.
        """
        if self.transmitter_window_poses is None:
            return None
        transmitter = track_motion(self.transmitter_poses, self.transmitter_window_poses)
        if self.separate_receiver_poses is None or self.receiver_window_poses is None:
            return transmitter, transmitter
        return transmitter, track_motion(self.separate_receiver_poses, self.receiver_window_poses)
