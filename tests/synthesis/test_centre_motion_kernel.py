"""Claim about the compiled motion of an array's centre."""

import numpy as np
import pytest

from insonify.frames import pose_rotation
from insonify.sonar.platform_motion import PlatformMotion
from insonify.synthesis._centre_motion_kernel import fill_kinematics


@pytest.mark.parametrize("turn", [0.0, 0.1])
def test_motion_is_that_of_the_platform(turn):
    """Velocity, acceleration and speed of a point of a platform on a curve, which turns or not: 1e-12."""
    rotation = np.array([pose_rotation(0.4 + turn * k, 0.05, turn * k**2) for k in range(3)])
    motion = PlatformMotion(0.2, np.random.default_rng(1).normal(0, 5, (3, 3)), rotation)
    arm, velocity, acceleration = np.array([1.5, -0.4, 0.8]), np.empty(3), np.empty(3)
    speed = fill_kinematics(motion.position, motion.rotation, motion.window, arm, velocity, acceleration)
    _, (known_velocity,), (known_acceleration,) = motion.kinematics(arm[None])
    np.testing.assert_allclose(velocity, known_velocity, rtol=1e-12)
    np.testing.assert_allclose(acceleration, known_acceleration, rtol=1e-12)
    assert speed == pytest.approx(np.linalg.norm(known_velocity), rel=1e-12)
