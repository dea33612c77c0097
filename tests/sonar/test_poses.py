"""Poses: rotations of a platform and what it carries, and true voyages about planned ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.sonar.track import LineTrack, Poses, StaticTrack, WaypointTrack, true_poses

angles = st.floats(-3, 3)
MOTION = {
    "roll": {"rms": 0.05, "period": 6.0}, "heave": {"rms": 0.2, "period": 5.0}, "sway": {"rms": 0.3, "period": 9.0},
}  # fmt: skip


def one(heading=0.0, pitch=0.0, roll=0.0, position=(0.0, 0.0, 0.0)):
    """One pose."""
    return Poses(np.zeros(1), np.array([position], float), np.array([heading]), np.array([pitch]), np.array([roll]))


@given(angles, angles, angles)
def test_a_platform_is_rigid(heading, pitch, roll):
    """Its axes are orthogonal, of unit length and right-handed."""
    axes = one(heading, pitch, roll).rotation(0)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)


@pytest.mark.parametrize(
    ("lean", "offset", "goes"),
    [
        ({"heading": np.pi / 2}, (1, 0, 0), (0, 1, 0)),  # heading east, the bow is east
        ({"heading": np.pi / 2}, (0, 1, 0), (-1, 0, 0)),  # and starboard is south
        ({"pitch": np.pi / 2}, (1, 0, 0), (0, 0, -1)),  # bow up
        ({"roll": np.pi / 2}, (0, 1, 0), (0, 0, 1)),  # starboard down
        ({"roll": np.pi / 2}, (0, 0, 1), (0, -1, 0)),  # and the keel to port
        ({}, (1, 2, 3), (1, 2, 3)),
    ],
)
def test_what_is_carried_goes_where_a_navigator_states(lean, offset, goes):
    """Signs of heading, pitch and roll, one at a time."""
    np.testing.assert_allclose(one(**lean).offset_positions(offset)[0], goes, atol=1e-12)


@given(angles, angles, angles, st.tuples(*[st.floats(-20, 20)] * 3))
def test_what_is_carried_keeps_its_distance(heading, pitch, roll, offset):
    """However the platform leans, a lever arm is as long as it is."""
    held = one(heading, pitch, roll, (5, -7, 3)).offset_positions(offset)[0] - [5, -7, 3]
    assert np.linalg.norm(held) == pytest.approx(np.linalg.norm(offset), abs=1e-9)


def test_all_pings_are_carried_at_once():
    """The same as one ping after the other by its own rotation."""
    rng = np.random.default_rng(1)
    many = Poses(np.arange(6.0), rng.normal(size=(6, 3)), *rng.uniform(-1, 1, (3, 6)))
    offset = (1.0, -2.0, 0.5)
    each = [many.position[p] + many.rotation(p) @ offset for p in range(6)]
    np.testing.assert_allclose(many.offset_positions(offset), each, atol=1e-12)
    np.testing.assert_array_equal(many.attitude[:, 0], many.heading)


def test_a_still_track_is_as_planned_to_the_bit():
    """Without motion there is nothing to draw, whatever the seed."""
    track = LineTrack(start=(1, 2, 3), speed=2.0, heading=0.5, pings=20)
    for seed in (1, 99):
        np.testing.assert_array_equal(true_poses(track, seed=seed).position, track.planned_poses().position)


@pytest.mark.parametrize(
    "track",
    [
        StaticTrack(position=(0, 0, 10), pings=400, motion=MOTION),
        LineTrack(start=(0, 0, 10), speed=2.0, heading=2.0, pings=400, motion=MOTION),
        WaypointTrack(waypoints=((0, 0, 10), (200, 30, 10)), speed=2.0, motion=MOTION),
    ],
)
def test_motion_is_about_the_plan(track):
    """Every kind of track takes its motion: the mean stays on the path, and only what was requested moves."""
    plan, true = track.planned_poses(), true_poses(track, seed=3)
    moved = true.position - plan.position
    c, s = np.cos(plan.heading), np.sin(plan.heading)
    ahead, aside = c * moved[:, 0] + s * moved[:, 1], -s * moved[:, 0] + c * moved[:, 1]
    np.testing.assert_allclose(ahead, 0, atol=1e-9)  # no surge was requested
    assert 0.15 < np.std(aside) < 0.5 and 0.1 < np.std(moved[:, 2]) < 0.35
    assert 0.03 < np.std(true.roll - plan.roll) < 0.08
    np.testing.assert_array_equal(true.heading, plan.heading)
    np.testing.assert_array_equal(true.pitch, plan.pitch)


def test_more_pings_do_not_move_the_first_ones():
    """A longer survey begins like a shorter one: motion belongs to the time, not to the number of pings."""
    short, long = (
        true_poses(LineTrack(start=(0, 0, 10), speed=1.0, pings=n, motion=MOTION), seed=5).position for n in (50, 500)
    )
    np.testing.assert_array_equal(long[:50], short)


def test_another_interval_samples_the_same_motion():
    """Every second ping of a survey at half the interval."""
    fine, coarse = (
        true_poses(StaticTrack(position=(0, 0, 10), pings=n, interval=step, window=(0, 0.1), motion=MOTION), seed=2)
        for n, step in ((201, 0.15), (101, 0.3))
    )
    np.testing.assert_allclose(fine.position[::2], coarse.position, atol=1e-12)
    np.testing.assert_allclose(fine.roll[::2], coarse.roll, atol=1e-12)
