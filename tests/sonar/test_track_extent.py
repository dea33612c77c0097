"""Claims about the track extent: a short stand-in that bounds distances as the whole track does."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from insonify.sonar import LineTrack, StaticTrack, WaypointTrack, true_poses
from insonify.sonar.track_extent import distance_to_segments, simplified_polyline, track_extent
from oracles.scenes import nominal

LOOP = {"waypoints": ((0, 0, 8), (60, 0, 9), (60, 40, 9), (0, 40, 9)), "speed": 2, "turn_radius": 15, "interval": 0.5,
        "window": (0, 0.2)}  # fmt: skip
SONAR = nominal().sonar


def test_a_straight_track_is_its_ends():
    """No corner and no wander, however many pings; a platform that stays is one place."""
    line = true_poses(LineTrack(start=(1, 2, 9), heading=0.7, speed=1.5, pings=400, window=(0, 0.2)))
    found = track_extent(SONAR, line)
    np.testing.assert_array_equal(found.corners, line.position[[0, -1], :2])
    assert found.polyline_error == 0 and found.depths == (9, 9)
    still = track_extent(SONAR, true_poses(StaticTrack(position=(1, 2, 9))))
    np.testing.assert_array_equal(still.corners, [[1, 2]] * 2)


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=1, max_size=8))
def test_distances_from_the_survey_bound_those_from_the_track(places):
    """Nearest and farthest ping are never nearer or farther than polyline and wander have it, nor much less so."""
    track = true_poses(WaypointTrack(**LOOP))
    found = track_extent(SONAR, track)
    place = np.array(places)
    away = np.linalg.norm(place[:, None] - track.position[:, :2], axis=-1)
    nearest = distance_to_segments(place, np.stack([found.corners[:-1], found.corners[1:]], axis=1))
    farthest = np.linalg.norm(place[:, None] - found.hull_corners, axis=-1).max(axis=1)
    step = 1.0  # pings are this far apart: between two of them the polyline may come nearer
    assert np.all(nearest - found.polyline_error <= away.min(axis=1) + 1e-9)
    assert np.all(nearest >= away.min(axis=1) - found.polyline_error - step)
    assert np.all(farthest + found.polyline_error >= away.max(axis=1) - 1e-9)
    assert len(found.corners) < 20 and 0 < found.polyline_error <= 1.0


def test_runs_left_out_are_never_the_nearest():
    """Of points within reach of one ping, the runs near that ping give the same nearest distance as all runs."""
    rng = np.random.default_rng(4)
    corners, _ = simplified_polyline(np.cumsum(rng.normal(size=(400, 2)), axis=0) * 3)
    found = track_extent(SONAR, true_poses(WaypointTrack(**LOOP)))
    found = type(found)(corners, corners, 0.5, (5.0, 5.0))
    for _ in range(20):
        here, reach = corners[rng.integers(len(corners))], rng.uniform(1, 30)
        turn, out = rng.uniform(0, 2 * np.pi, 50), rng.uniform(0, reach, 50)
        place = here + np.stack([np.cos(turn), np.sin(turn)], axis=-1) * out[:, None]
        every = distance_to_segments(place, np.stack([corners[:-1], corners[1:]], axis=1))
        np.testing.assert_array_equal(distance_to_segments(place, found.nearest_segments(here, reach)), every)
        plain = distance_to_segments(place, np.stack([corners[:-1], corners[1:]], axis=1), each=True).min(axis=1)
        np.testing.assert_allclose(every, plain, rtol=1e-12, atol=1e-12)


def test_depths_are_those_of_both_ends():
    """With their lever arms, and with all motion; of the ends that are requested about."""
    moved = LineTrack(start=(0, 0, 9), speed=1, pings=200, window=(0, 0.2), motion={"roll": {"rms": 0.05, "period": 5}})
    ends = {"offset": (0, 2, 1)}, {"offset": (0, 0, -1)}
    for sent, received in (ends, ends[::-1]):
        low, high = track_extent(nominal(transmit=sent, receive=received).sonar, true_poses(moved)).depths
        assert 8.0 <= low < 8.1 and 10.05 < high < 10.4
    low, high = track_extent(nominal(transmit=ends[0]).sonar, true_poses(moved), ends=("transmit",)).depths
    assert 9.6 < low < 9.95 and 10.05 < high < 10.4
