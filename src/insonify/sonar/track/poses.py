"""Poses: position and attitude of the platform, one row per ping."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.frames import pose_rotation

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Poses:
    """Positions and attitudes of the platform, one row per ping.

    Example:
        >>> poses = true_poses(StaticTrack(position=(0, 0, 5), heading="90 deg"))
        >>> poses.offset_positions((2.0, 0.0, 0.5)).round(3).tolist()  # 2 m ahead, 0.5 m down
        [[0.0, 2.0, 5.5]]
    """

    time: Floats
    """Time of transmission since the first ping [s], shape (pings,)."""
    position: Floats
    """Reference point in north, east, down [m], shape (pings, 3)."""
    heading: Floats
    """Compass heading [rad], shape (pings,)."""
    pitch: Floats
    """Bow up, positive [rad], shape (pings,)."""
    roll: Floats
    """Starboard down, positive [rad], shape (pings,)."""

    def __post_init__(self) -> None:
        """Refuse columns of unequal length."""
        for name in ("position", "heading", "pitch", "roll"):
            rows = len(getattr(self, name))
            if rows != len(self.time):
                raise ValueError(f"Poses.{name} has {rows} rows; time has {len(self.time)}")

    def __len__(self) -> int:
        """Number of pings."""
        return len(self.time)

    def take(self, pings: slice) -> "Poses":
        """Poses of some of the pings.

        Args:
            pings: Numbers of the pings.
        """
        return Poses(
            self.time[pings], self.position[pings], self.heading[pings], self.pitch[pings], self.roll[pings]
        )  # fmt: skip

    @property
    def attitude(self) -> Floats:
        """Heading, pitch and roll [rad], shape (pings, 3)."""
        return np.stack([self.heading, self.pitch, self.roll], axis=-1)

    def rotation(self, ping: int) -> Floats:
        """Axes of the platform in the world at one ping.

        Args:
            ping: Number of the ping, from 0.

        Returns:
            Forward, starboard and down as columns in north, east, down [1], shape (3, 3).
        """
        return np.asarray(self.rotations[ping])

    @cached_property
    def rotations(self) -> Floats:
        """Rotation matrices of all pings [1], shape (pings, 3, 3), see `rotation`."""
        rotations = pose_rotation(self.heading, self.pitch, self.roll)
        rotations.flags.writeable = False  # every ping reads it
        return rotations

    def offset_depths(self, offset: tuple[float, float, float]) -> Floats:
        """Depth of a point that is fixed to the platform at every ping [m], shape (pings,).

        Args:
            offset: Position of the point from the reference point: forward, starboard, down [m].
        """
        if not any(offset):
            return np.asarray(self.position[:, 2])
        # The third row of the rotation from body to world, for every ping at once.
        cosine = np.cos(self.pitch)
        down = np.stack([-np.sin(self.pitch), cosine * np.sin(self.roll), cosine * np.cos(self.roll)], axis=-1)
        return np.asarray(self.position[:, 2] + down @ np.asarray(offset))

    def offset_positions(self, offset: tuple[float, float, float]) -> Floats:
        """Positions of a point that is fixed to the platform.

        Args:
            offset: Position of the point from the reference point: forward, starboard, down [m].

        Returns:
            North, east, down at every ping [m], shape (pings, 3).
        """
        if not any(offset):
            return self.position
        return np.asarray(self.position + self.rotations @ np.asarray(offset))
