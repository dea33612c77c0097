"""Claims about tracks through waypoints: constant speed, tangent arcs, corners where no radius is given."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.sonar import WaypointTrack, true_poses
from insonify.sonar.track.waypoint_path import rounded_path

SQUARE = ((0.0, 0.0, 5.0), (100.0, 0.0, 6.0), (100.0, 80.0, 6.0))


def track(**changes):
    """Two legs of 100 m and 80 m with a right turn between them."""
    return WaypointTrack(**{"waypoints": SQUARE, "speed": 2.0, "interval": 0.5, "window": (0, 0.2)} | changes)


def test_sharp_corners_are_run_at_constant_speed():
    """Along each leg pings are speed times interval apart, and the platform faces along the leg it is on."""
    rows = true_poses(track())
    leg = np.hypot(100, 1)
    assert len(rows) == track().ping_count == int((leg + 80) / 1.0) + 1
    first = rows.time * 2.0 < leg
    np.testing.assert_allclose(np.linalg.norm(np.diff(rows.position[first], axis=0), axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(rows.heading[first], 0)
    np.testing.assert_allclose(np.degrees(rows.heading[~first]), 90)
    np.testing.assert_allclose(rows.position[~first, 0], 100)


def test_a_turn_is_an_arc_that_touches_both_legs():
    """All places between the tangent points lie on the circle, and the path is shorter by 2 r tan(a/2) - r a."""
    radius = 10.0
    path = rounded_path(np.array(SQUARE), radius)
    run = np.linspace(0, path.length.sum(), 4001)
    place, course = path.at(run)
    arc = (course > 1e-6) & (course < np.pi / 2 - 1e-6)
    np.testing.assert_allclose(np.hypot(place[arc, 0] - 90, place[arc, 1] - 10), radius, rtol=1e-9)
    saved = 2 * radius * np.tan(np.pi / 4) - radius * np.pi / 2
    np.testing.assert_allclose(path.horizontal_length.sum(), 180 - saved, rtol=1e-12)


@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=2, max_size=6),
    st.floats(0.0, 2.0),
    st.floats(-np.pi, np.pi),
)
def test_the_path_is_smooth_and_moves_with_the_scene(steps, radius, turn):
    """Heading is the direction of motion, no step jumps, and a turned world has a turned path."""
    legs = np.array(steps) * 20 + np.array([40.0, 0.0])  # never a turn sharper than a right angle
    corners = np.column_stack([np.vstack([[0, 0], np.cumsum(legs, axis=0)]), np.linspace(5, 7, len(legs) + 1)])
    path = rounded_path(corners, radius)
    run = np.linspace(0, path.length.sum(), 3000)
    place, course = path.at(run)
    step = np.diff(place, axis=0)
    assert np.linalg.norm(step, axis=1).max() <= run[1] * (1 + 1e-9)
    if radius > 0.5:
        way = np.arctan2(step[:, 1], step[:, 0])
        error = np.angle(np.exp(1j * (way - (course[1:] + course[:-1]) / 2)))
        assert np.abs(error).max() < run[1] / radius
    c, s = np.cos(turn), np.sin(turn)
    there = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved, turned = rounded_path(corners @ there.T, radius).at(run)
    np.testing.assert_allclose(moved, place @ there.T, atol=1e-6)
    np.testing.assert_allclose(np.exp(1j * turned), np.exp(1j * (course + turn)), atol=1e-6)


def test_a_path_of_whole_intervals_ends_with_a_ping():
    """100 m at 2 m/s and a ping every 0.1 s: 501 pings, the last on the waypoint."""
    rows = true_poses(track(waypoints=((0, 0, 5), (0, 100, 5)), interval=0.1, window=(0, 0.05)))
    assert len(rows) == 501
    np.testing.assert_allclose(rows.position[-1], [0, 100, 5], atol=1e-9)


@pytest.mark.parametrize(
    ("wrong", "advice"),
    [
        ({"waypoints": ((0, 0, 5),)}, "waypoints: 1 of them is no path"),
        ({"waypoints": ((0, 0, 5), (0, 0, 6))}, "waypoints.1: waypoint 1 is at, or straight above or below"),
        ({"turn_radius": 100}, "waypoints.1: the turn of 90 deg at waypoint 1 and its neighbour take 100 m of a "
                               "run of 80 m. Write a turn_radius of 80 m"),
        ({"waypoints": ((0, 0, 5), (9, 0, 5), (0, 0, 5)), "turn_radius": 1},
         "waypoints.1: the path turns back on itself"),
        ({"pings": 500}, "pings: 500 pings run beyond the last waypoint"),
        ({"speed": 0}, "speed: 0 m/s is out of range (above 0, to 100 m/s)"),
        ({"turn_radius": -1}, "turn_radius: -1 m is out of range (0 to 1000000 m)"),
    ],
)  # fmt: skip
def test_a_path_that_cannot_be_run_is_refused_with_advice(wrong, advice):
    """Which waypoint, what it lacks, and the number that would do."""
    with pytest.raises(ValidationError) as run_refusal:
        track(**wrong)
    assert advice in str(run_refusal.value)


def test_the_largest_turn_that_is_advised_is_accepted():
    """The number in the advice is the limit itself."""
    assert track(turn_radius=80.0).ping_count > 100
