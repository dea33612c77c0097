"""Paths through waypoints and the pings on them: geometry, not sonar."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from insonify.sonar.track.ping_schedule import MAX_PINGS, checked_ping_count, max_ping_count, ping_times
from insonify.sonar.track.waypoint_path import TurnRadiusError, rounded_path

SQUARE = np.array([[0, 0, 5], [100, 0, 5], [100, 100, 5], [0, 100, 5]], float)


def test_a_rounded_corner_is_shorter_by_its_closed_form():
    """Each right-angled corner of radius r saves (2 - pi/2) r."""
    for radius in (0.0, 5.0, 20.0):
        path = rounded_path(SQUARE, radius)
        assert path.length.sum() == pytest.approx(300 - 2 * (2 - np.pi / 2) * radius)
        assert path.turn.sum() == pytest.approx(np.pi if radius else 0.0)


def test_an_arc_stays_a_radius_from_its_centre():
    """Points of a turn lie on a circle about the place a radius inside both legs."""
    path = rounded_path(SQUARE, 20.0)
    run = 80 + np.linspace(0, 20 * np.pi / 2, 50)
    place, _ = path.at(run)
    np.testing.assert_allclose(np.hypot(place[:, 0] - 80, place[:, 1] - 20), 20, atol=1e-9)


@given(st.floats(0, 40), st.integers(0, 2**31))
def test_distance_run_is_distance_gone(radius, seed):
    """Between two close points of a path the distance is the one run, on legs and in turns."""
    corners = SQUARE + np.random.default_rng(seed).uniform(-5, 5, SQUARE.shape)
    path = rounded_path(corners, radius)
    run = np.linspace(0, path.length.sum(), 4001)
    place, _ = path.at(run)
    gone = np.linalg.norm(np.diff(place, axis=0), axis=1)
    step = run[1] - run[0]
    assert np.all(gone <= step * (1 + 1e-9))
    assert np.median(gone) == pytest.approx(step, rel=1e-6)


@given(st.floats(1, 40), st.integers(0, 2**31))
def test_the_course_is_where_the_path_goes(radius, seed):
    """Away from sharp corners the course is the direction of the next small step."""
    corners = SQUARE + np.random.default_rng(seed).uniform(-5, 5, SQUARE.shape)
    path = rounded_path(corners, radius)
    run = np.linspace(0, path.length.sum() - 0.02, 500)
    (place, course), (ahead, _) = path.at(run), path.at(run + 0.01)
    found = np.arctan2(ahead[:, 1] - place[:, 1], ahead[:, 0] - place[:, 0])
    assert np.abs(np.angle(np.exp(1j * (found - course)))).max() < 0.01 / radius + 1e-6


def test_depth_changes_evenly():
    """A descending leg is a straight line in space, and its length is that of the line."""
    path = rounded_path(np.array([[0, 0, 5], [30, 40, 55]], float), 0.0)
    assert path.length.sum() == pytest.approx(np.hypot(50, 50))
    place, course = path.at(np.array([0.0, path.length.sum() / 2, path.length.sum()]))
    np.testing.assert_allclose(place, [[0, 0, 5], [15, 20, 30], [30, 40, 55]], atol=1e-9)
    np.testing.assert_allclose(course, np.arctan2(40, 30))


def test_a_turn_without_room_is_refused_with_what_it_needs():
    """Two right angles 100 m apart hold radii up to 50 m; the error carries the numbers that advice needs."""
    rounded_path(SQUARE, 50.0)
    with pytest.raises(TurnRadiusError) as caught:
        rounded_path(SQUARE, 60.0)
    assert caught.value.required > caught.value.length == pytest.approx(100)
    assert abs(caught.value.angle) == pytest.approx(np.pi / 2)


def test_turning_the_scene_turns_the_path():
    """A rotated polygon has the rotated path."""
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    run = np.linspace(0, 250, 100)
    (here, course), (there, turned) = rounded_path(SQUARE, 15).at(run), rounded_path(SQUARE @ turn.T, 15).at(run)
    np.testing.assert_allclose(there, here @ turn.T, atol=1e-9)
    np.testing.assert_allclose(np.exp(1j * turned), np.exp(1j * (course + angle)), atol=1e-12)


@given(st.integers(1, 5000), st.floats(1e-3, 10))
def test_a_path_of_whole_intervals_has_a_ping_at_both_ends(count, interval):
    """N pings fit into n - 1 intervals whatever the rounding, and one fewer into a little less."""
    longest = ping_times(count, interval)[-1]
    assert max_ping_count(longest, interval) == count
    assume(count > 1)
    assert max_ping_count(longest - 0.01 * interval, interval) == count - 1


def test_pings_requested_must_fit():
    """Left out, all that fit; fewer may be requested; more are refused with what they would run beyond."""
    assert checked_ping_count(None, 12, "pings", end="the end") == 12
    assert checked_ping_count(5, 12, "pings", end="the end") == 5
    with pytest.raises(ValueError, match="13 pings run beyond the end, and nothing is extrapolated"):
        checked_ping_count(13, 12, "pings", end="the end")
    with pytest.raises(ValueError, match=f"{MAX_PINGS} is the most"):
        checked_ping_count(None, MAX_PINGS + 1, "pings", end="the end")
