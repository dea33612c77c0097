"""Motion of a platform from the start of a ping until its last echo has arrived.

It consists of position and attitude at the start, the middle and the end of the window. A point fixed to the platform
moves on the parabola through its three positions. Over a window of 0.25 s, motion with a period of 6 s departs from
that parabola by less than a thousandth of the displacement.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.frames import pose_rotation
from insonify.jit import njit
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PlatformMotion:
    """The platform during one ping."""

    window: float
    """Time from the first to the last of the three moments: start, middle and end of the window [s]."""
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
            offset: Positions of the points from the reference point: forward, starboard, down [m], shape (m, 3).

        Returns:
            Position at the start [m], velocity there [m/s] and acceleration [m/s^2], each of shape (m, 3).
        """
        path = self.position[:, None] + offset @ self.rotation.transpose(0, 2, 1)
        middle, last = path[1:] - path[0]
        return path[0], *parabola.py_func(middle, last, self.window)

    def max_displacement(self, offset: Floats) -> float:
        """Approximate largest displacement of points fixed to the platform from their initial positions [m].

        Args:
            offset: Positions from the reference point: forward, starboard, down [m], shape (m, 3).
        """
        _, velocity, acceleration = self.kinematics(offset)
        displacements = [velocity * t + acceleration / 2 * t**2 for t in (self.window / 2, self.window)]
        return float(np.linalg.norm(displacements, axis=-1).max())

    @cached_property
    def is_rotating(self) -> bool:
        """True where the platform's attitude changes."""
        return bool((self.rotation[0] != self.rotation[1:]).any())

    def to_initial_attitude(self, direction: Floats, time: Floats) -> Floats:
        """Directions in the world that have, at the start of a ping, the same angles to the platform as others later.

        Args:
            direction: Unit vectors in the world at those later times [1], shape (n, 3).
            time: Times after the start [s], shape (n,).

        Returns:
            Unit vectors in the world at the start [1], shape (n, 3).
        """
        if not self.is_rotating:
            return direction
        t = time[:, None]
        linear, quadratic = self.rotation_rates
        world = direction + t * (direction @ linear.T) + t**2 * (direction @ quadratic.T)
        return np.asarray(world / np.sqrt(np.einsum("ij,ij->i", world, world))[:, None])

    @property
    def rotation_rates(self) -> tuple[Floats, Floats]:
        """Linear [1/s] and quadratic [1/s^2] coefficients of `to_initial_attitude` in time, shape (3, 3) each."""
        first, middle, last = (rotation.T for rotation in self.rotation)  # world to body
        linear, quadratic = 4 * (middle - first) - (last - first), 2 * ((last - first) - 2 * (middle - first))
        return first.T @ linear / self.window, first.T @ quadratic / self.window**2


@dataclass(frozen=True, slots=True, eq=False)
class TrackMotion:
    """The platform during each of its pings."""

    position: Floats
    """See `PlatformMotion.position`, shape (pings, 3, 3)."""
    rotation: Floats
    """See `PlatformMotion.rotation`, shape (pings, 3, 3, 3)."""
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
        """Largest displacement of a point of the platform by the middle or the end of each window [m], shape (pings,).

        Args:
            offset: Position of the point from the reference point: forward, starboard, down [m], shape (3,).
        """
        position = self.position + self.rotation @ offset if offset.any() else self.position
        displacement = position[:, 1:] - position[:, :1]
        return np.asarray(np.sqrt(np.einsum("pmi,pmi->pm", displacement, displacement).max(axis=1)))


def track_motion(start_poses: Poses, window_poses: tuple[Poses, Poses]) -> TrackMotion:
    """Motion of the platform from the start of every ping.

    Args:
        start_poses: Poses at the start of each ping.
        window_poses: Poses half a window, and a whole window, after the start of each ping.
    """
    moments = (start_poses, *window_poses)
    position = np.stack([poses.position for poses in moments], axis=1)
    later = (pose_rotation(poses.heading, poses.pitch, poses.roll) for poses in window_poses)  # kept once, not twice
    rotation = np.stack([start_poses.rotations, *later], axis=1)
    is_translating = (position[:, 1:] != position[:, :1]).any(axis=(1, 2))
    return TrackMotion(position, rotation, is_translating | (rotation[:, 1:] != rotation[:, :1]).any(axis=(1, 2, 3)))


@njit(cache=True, nogil=True, error_model="numpy")
def parabola(middle: Any, last: Any, window: float) -> tuple[Any, Any]:
    """Velocity at the start [m/s] and acceleration [m/s^2] of one coordinate, or by `py_func` of arrays of any shape.

    Args:
        middle: Displacement half a window after the start [m].
        last: Displacement a whole window after the start [m].
        window: Length of the window [s].
    """
    return (4 * middle - last) / window, 4 * (last - 2 * middle) / window**2
