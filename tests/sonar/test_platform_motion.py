"""Claims about how a platform goes on during a ping."""

import numpy as np
import pytest

from insonify.frames import pose_rotation
from insonify.sonar.platform_motion import PlatformMotion, track_motion
from insonify.sonar.track import LineTrack, NavigationTrack, WaypointTrack, true_poses


def after(track, window):
    """Course of ping 0 of a track."""
    later = tuple(true_poses(track, seed=2, after=t) for t in (window / 2, window))
    return track_motion(true_poses(track, seed=2), later).at(0, window)


def test_a_platform_at_rest_is_recognised():
    """Nothing moves without speed; anything does with some."""
    assert after(LineTrack(start=(0, 0, 5), speed=0.0), 0.2).is_static
    assert not after(LineTrack(start=(0, 0, 5), speed=0.1), 0.2).is_static


def test_a_straight_line_is_reproduced_exactly():
    """Velocity as planned, no acceleration, for lever arms too."""
    way = after(LineTrack(start=(0, 0, 5), speed=4.0, heading=np.radians(60)), 0.2)
    first, velocity, acceleration = way.kinematics(np.array([[1.0, 2.0, 0.3]]))
    np.testing.assert_allclose(velocity, [[2.0, 4 * np.sin(np.radians(60)), 0]], atol=1e-9)
    np.testing.assert_allclose(acceleration, 0, atol=1e-8)
    np.testing.assert_allclose(first[0, 2], 5.3)
    assert way.max_displacement(np.zeros((1, 3))) == pytest.approx(0.8)


def test_an_arm_on_a_turning_platform_is_carried_round():
    """Yaw rate w, arm r: velocity w r across, acceleration w^2 r inwards; the parabola is good to (w T)^2 / 10."""
    rate, window, arm = 0.5, 0.2, 2.0
    yaw = rate * window * np.array([0, 0.5, 1])
    turning = PlatformMotion(window, np.zeros((3, 3)), np.array([pose_rotation(h, 0.0, 0.0) for h in yaw]))
    _, velocity, acceleration = turning.kinematics(np.array([[arm, 0, 0]]))
    np.testing.assert_allclose(velocity, [[0, rate * arm, 0]], atol=rate * arm * 1e-2)
    np.testing.assert_allclose(acceleration, [[-(rate**2) * arm, 0, 0]], atol=rate**2 * arm * 0.1)


def test_what_a_turned_platform_receives_is_turned_the_other_way():
    """At the window's end, heading 5.73 deg more: a target in the north is seen where one 5.73 deg to port was."""
    turning = PlatformMotion(0.2, np.zeros((3, 3)), np.array([pose_rotation(h, 0.0, 0.0) for h in (0, 0.05, 0.1)]))
    seen = turning.to_initial_attitude(np.array([[1.0, 0, 0]]), np.array([0.2]))
    np.testing.assert_allclose(seen, [[np.cos(0.1), -np.sin(0.1), 0]], atol=1e-12)
    np.testing.assert_allclose(turning.to_initial_attitude(np.eye(3), np.zeros(3)), np.eye(3), atol=1e-12)


def test_a_wave_bends_the_parabola_by_a_thousandth():
    """Heave of rms a, period P over a window T: what the parabola leaves is at most a sqrt(2) (2 pi T / P)^3 / 125.

    That is the cubic term, t (t - T/2) (t - T) / 6, at its largest; with 0.3 m, 6 s and 0.25 s: 0.06 mm of 44 mm.
    """
    track = LineTrack(start=(0, 0, 5), speed=0.0, motion={"heave": {"rms": 0.3, "period": 6.0}})
    bar = 0.3 * np.sqrt(2) * (2 * np.pi * 0.25 / 6) ** 3 / 125
    way = after(track, 0.25)
    first, velocity, acceleration = way.kinematics(np.zeros((1, 3)))
    for t in (0.0625, 0.1875):
        guess = first + velocity * t + acceleration / 2 * t**2
        known = true_poses(track, seed=2, after=t).position[:1]
        assert np.abs(guess - known).max() < bar < 2e-3 * way.max_displacement(np.zeros((1, 3)))


def test_a_path_goes_straight_on_from_its_end(tmp_path):
    """The last ping of a path or a log ends beyond it, at the same speed."""
    legs = WaypointTrack(waypoints=((0, 0, 5), (10, 0, 5)), speed=2.0, interval=1.0)
    last = true_poses(legs, after=0.5).position[-1]
    np.testing.assert_allclose(last, [11.0, 0, 5])
    log = tmp_path / "log.csv"
    log.write_text(
        "time,north,east,depth,heading [deg],pitch [deg],roll [deg]\n0,0,0,5,0,0,0\n1,2,0,5,0,0,0\n2,4,0,5,0,0,0\n"
    )
    track = NavigationTrack(file=str(log), interval=1.0)
    np.testing.assert_allclose(true_poses(track, after=0.5).position[-1], [5.0, 0, 5])
