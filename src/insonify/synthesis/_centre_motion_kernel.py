"""Motion of the centre of an array during a ping. Plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.platform_motion import parabola

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def fill_kinematics(
    position: Floats, rotation: Floats, window: float, arm: Floats, velocity: Floats, acceleration: Floats
) -> float:
    """Fill the motion of one point of a platform, as `PlatformMotion.kinematics` does.

    Args:
        position: `PlatformMotion.position` [m], (3, 3).
        rotation: `PlatformMotion.rotation` [1], (3, 3, 3).
        window: `PlatformMotion.window` [s].
        arm: Position of the point on the platform: forward, starboard, down [m], (3,).
        velocity: Result, velocity at the start [m/s], (3,).
        acceleration: Result [m/s^2], (3,).

    Returns:
        Speed at the start [m/s].
    """
    path, square = np.empty(3), 0.0
    for axis in range(3):
        for moment in range(3):
            row = rotation[moment, axis]
            path[moment] = position[moment, axis] + (arm[0] * row[0] + arm[1] * row[1] + arm[2] * row[2])
        velocity[axis], acceleration[axis] = parabola(path[1] - path[0], path[2] - path[0], window)
        square += velocity[axis] * velocity[axis]
    return math.sqrt(square)
