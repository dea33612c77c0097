"""Motion of a platform from the start of a ping until its last echo has arrived.

Position and attitude at the start, the middle and the end of the window; what is fixed to the platform runs on the
parabola through its three positions. A wave that takes six seconds bends a parabola of a quarter of a second by a
thousandth of what it moves.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlatformMotion:
    """The platform during one ping."""

    window: float
    """Time from the first to the last of the three moments [s]."""
    position: Floats
    """Reference point at the three moments, north, east, down [m], shape (3, 3)."""
    rotation: Floats
    """Axes of the platform in the world, as columns, at the three moments [1], shape (3, 3, 3)."""

    @property
    def is_static(self) -> bool:
        """True where the platform neither moves nor turns."""
        return bool(np.ptp(self.position, axis=0).max() == 0 and np.ptp(self.rotation, axis=0).max() == 0)

    def kinematics(self, offset: Floats) -> tuple[Floats, Floats, Floats]:
        """Position, velocity and acceleration of points that are fixed to the platform.

        Args:
            offset: Their positions from the reference point: forward, starboard, down [m], shape (m, 3).

        Returns:
            Position at the start [m], velocity there [m/s] and acceleration [m/s^2], each of shape (m, 3).
        """
        moments = zip(self.position, self.rotation, strict=True)
        first, middle, last = (position + offset @ turned.T for position, turned in moments)
        return first, *_parabola(middle - first, last - first, self.window)

    def max_displacement(self, offset: Floats) -> float:
        """Approximate largest displacement of any point fixed to the platform from its initial position [m].

        Args:
            offset: Places from the reference point: forward, starboard, down [m], shape (m, 3).
        """
        _, velocity, acceleration = self.kinematics(offset)
        halves = [velocity * t + acceleration / 2 * t**2 for t in (self.window / 2, self.window)]
        return float(np.linalg.norm(halves, axis=-1).max())

    @property
    def is_rotating(self) -> bool:
        """True where the platform's attitude changes."""
        return bool((self.rotation[0] != self.rotation[1:]).any())

    def to_initial_attitude(self, direction: Floats, when: Floats) -> Floats:
        """Directions at the start of a ping that correspond to directions re the platform as it is turned later.

        Args:
            direction: Unit vectors in the world [1], shape (n, 3).
            when: Times after the start [s], shape (n,).

        Returns:
            Unit vectors, shape (n, 3).
        """
        if not self.is_rotating:
            return direction
        t = when[:, None]
        rate, bend = self.rotation_rates
        world = direction + t * (direction @ rate.T) + t**2 * (direction @ bend.T)
        return np.asarray(world / np.sqrt(np.einsum("ij,ij->i", world, world))[:, None])

    @property
    def rotation_rates(self) -> tuple[Floats, Floats]:
        """Changes of a direction by `turned`, for each second and for its square [1/s, 1/s^2], (3, 3) each."""
        first, middle, last = (turn.T for turn in self.rotation)  # world to body
        rate, bend = 4 * (middle - first) - (last - first), 2 * ((last - first) - 2 * (middle - first))
        return first.T @ rate / self.window, first.T @ bend / self.window**2


@dataclass(frozen=True, slots=True, eq=False)
class TrackMotion:
    """The platform during each of its pings."""

    position: Floats
    """See `PlatformMotion`, shape (pings, 3, 3)."""
    rotation: Floats
    """Likewise, shape (pings, 3, 3, 3)."""
    is_moving: NDArray[np.bool_]
    """True where the platform moves or turns during the ping, shape (pings,)."""

    def at(self, ping: int, window: float) -> PlatformMotion:
        """Motion of the platform from the start of one ping.

        Args:
            ping: Number of the ping.
            window: Length of the window [s].
        """
        return PlatformMotion(window, self.position[ping], self.rotation[ping])

    def max_displacement(self, offset: Floats) -> Floats:
        """Largest displacement of a point of the platform at the middle or the end of each ping [m], (pings,).

        Args:
            offset: Its position from the reference point: forward, starboard, down [m], shape (3,).
        """
        position = self.position + self.rotation @ offset if offset.any() else self.position
        moved = position[:, 1:] - position[:, :1]
        return np.asarray(np.sqrt(np.einsum("pmi,pmi->pm", moved, moved).max(axis=1)))


def track_motion(start_poses: Poses, window_poses: tuple[Poses, Poses]) -> TrackMotion:
    """Motion of the platform from the start of every ping.

    Args:
        start_poses: Poses at the start of each ping.
        window_poses: Poses half a window, and a whole window, after the start of each ping.
    """
    moments = (start_poses, *window_poses)
    position = np.stack([poses.position for poses in moments], axis=1)
    rotation = np.stack([poses.rotations for poses in moments], axis=1)
    moves = (position[:, 1:] != position[:, :1]).any(axis=(1, 2))
    return TrackMotion(position, rotation, moves | (rotation[:, 1:] != rotation[:, :1]).any(axis=(1, 2, 3)))


def _parabola(middle: Floats, last: Floats, window: float) -> tuple[Floats, Floats]:
    """Velocity at the start [m/s] and acceleration [m/s^2] of what has moved so far at the middle and the end [m]."""
    return (4 * middle - last) / window, 4 * (last - 2 * middle) / window**2
