"""Claims about axes: every sign a navigator would check with their hands."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.frames import array_axes, direction, mounting_rotation, pose_rotation

NORTH, EAST, DOWN = np.eye(3)
BOW, STARBOARD, KEEL = np.eye(3)
angles = st.floats(-np.pi, np.pi)
slopes = st.floats(-1.5, 1.5)


def assert_same(a, b):
    """Two sets of axes agree to rounding."""
    np.testing.assert_allclose(a, b, atol=1e-12)


def test_a_level_ship_heading_north_has_the_worlds_axes():
    """No turn at all: bow north, starboard east, keel down."""
    assert_same(pose_rotation(0, 0, 0), np.eye(3))


def test_heading_90_deg_points_the_bow_east():
    """A compass turns clockwise: heading east, starboard is south."""
    pose = pose_rotation(np.pi / 2)
    assert_same(pose @ BOW, EAST)
    assert_same(pose @ STARBOARD, -NORTH)


def test_pitch_lifts_the_bow():
    """Positive pitch: the bow points to smaller depth."""
    assert (pose_rotation(0, 0.1, 0) @ BOW)[2] == pytest.approx(-np.sin(0.1))


def test_roll_sinks_the_starboard_side():
    """Positive roll: starboard points to greater depth, and the bow does not move."""
    pose = pose_rotation(0, 0, 0.1)
    assert (pose @ STARBOARD)[2] == pytest.approx(np.sin(0.1))
    assert_same(pose @ BOW, BOW)


@given(angles, slopes, angles)
def test_a_pose_is_three_turns_in_the_navigators_order(heading, pitch, roll):
    """Roll about the bow, then pitch about the level starboard axis, then heading about the vertical."""

    def turn(axis, angle):  # Rodrigues' formula, which shares nothing with the code under test
        cross = np.cross(np.eye(3), axis)
        return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross

    assert_same(pose_rotation(heading, pitch, roll), turn(DOWN, heading) @ turn(EAST, pitch) @ turn(NORTH, roll))


@given(angles, slopes, angles)
def test_frames_are_right_handed_and_keep_lengths(heading, pitch, roll):
    """Both rotations are orthogonal with determinant +1."""
    for rotation in (pose_rotation(heading, pitch, roll), mounting_rotation(heading, pitch)):
        assert_same(rotation @ rotation.T, np.eye(3))
        assert np.linalg.det(rotation) == pytest.approx(1)


def test_an_array_facing_starboard_has_the_stern_on_its_right():
    """Bearing 90 deg clockwise from the bow, level: boresight starboard, right astern, down to the keel."""
    boresight, right, down = mounting_rotation(np.pi / 2, 0)
    assert_same(boresight, STARBOARD)
    assert_same(right, -BOW)
    assert_same(down, KEEL)


def test_tilt_turns_the_boresight_down():
    """Tilted by 90 deg, the array looks at the keel and its down axis at the stern."""
    boresight, right, down = mounting_rotation(0, np.pi / 2)
    assert_same(boresight, KEEL)
    assert_same(right, STARBOARD)
    assert_same(down, -BOW)


@given(angles, slopes)
def test_down_is_boresight_cross_right(bearing, tilt):
    """The array's third axis completes a right-handed set."""
    boresight, right, down = mounting_rotation(bearing, tilt)
    assert_same(np.cross(boresight, right), down)


def test_an_echo_from_the_right_has_a_positive_right_cosine():
    """A ship heading east with an array to starboard receives a target in the west of south on its right, and below."""
    axes = array_axes(pose_rotation(np.pi / 2), mounting_rotation(np.pi / 2))
    w, u, v = axes @ direction(np.radians(190), np.radians(20))
    assert w > 0
    assert u == pytest.approx(np.cos(np.radians(20)) * np.sin(np.radians(10)))
    assert v == pytest.approx(np.sin(np.radians(20)))


def test_a_direction_down_has_positive_depth():
    """Elevation is positive down; bearing 90 deg is east."""
    assert_same(direction(np.pi / 2, 0), EAST)
    assert_same(direction(0, np.pi / 2), DOWN)


def test_a_track_of_poses_turns_all_at_once():
    """Arrays of angles give the stack of the single rotations."""
    heading, roll = np.linspace(0, 3, 4), np.linspace(-0.1, 0.1, 4)
    stack = pose_rotation(heading, 0.05, roll)
    assert stack.shape == (4, 3, 3)
    assert_same(stack[2], pose_rotation(heading[2], 0.05, roll[2]))
    assert array_axes(stack, mounting_rotation(1.0, 0.2)).shape == (4, 3, 3)
