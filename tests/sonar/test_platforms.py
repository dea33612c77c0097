"""Claims about what carries a sonar's two ends: one platform or two, their distance, and how they go on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scenario.platform_poses import platforms, receiver_seed
from insonify.sonar.platforms import Platforms
from insonify.sonar.sonar import Mounting, Sonar, array_rotation, channel_positions, receiver_rotation
from insonify.sonar.track import LineTrack, StaticTrack, true_poses
from insonify.sonar.track_extent import track_extent
from oracles.arrays import elements_scenario, line_of

WINDOW = 0.2
FINITE = st.floats(-100, 100)


def carried(track, other=None):
    """Platforms of one track or two, moving."""
    moments = [[true_poses(one, seed=2, after=t) for t in (0, WINDOW / 2, WINDOW)] for one in (track, other) if one]
    later = [tuple(some[1:]) for some in moments]
    if other is None:
        return Platforms(moments[0][0], transmitter_window_poses=later[0])
    return Platforms(moments[0][0], moments[1][0], *later)


def line(**values):
    """A line track of five pings."""
    return LineTrack(**({"start": (0, 0, 5), "speed": 2.0, "pings": 5, "interval": 1.0} | values))


def test_one_platform_carries_both_ends():
    """No distance between them, one set of places, the same course for both."""
    one = carried(line())
    assert not one.is_bistatic and one.max_separation == 0 and one.receiver_poses is one.transmitter_poses
    assert one.positions.shape == (5, 3)
    first, other = one.ping_motions(1, WINDOW)
    assert first is other
    np.testing.assert_allclose(first.kinematics(np.zeros((1, 3)))[1], [[2.0, 0, 0]], atol=1e-9)


@given(st.floats(0, 6), st.floats(0, 6), st.floats(-3, 3), st.floats(-3, 3))
def test_the_distance_is_the_greatest_at_any_ping(speed, other, heading, turn):
    """Two straight tracks: distance squared is a parabola in time, greatest at the first ping or the last."""
    pair = carried(line(speed=speed, heading=heading), line(start=(30, -4, 9), speed=other, heading=turn))
    way = np.array([30, -4, 4]) + np.arange(5)[:, None] * (
        other * np.array([np.cos(turn), np.sin(turn), 0]) - speed * np.array([np.cos(heading), np.sin(heading), 0])
    )
    assert pair.max_separation == pytest.approx(max(np.linalg.norm(way[[0, -1]], axis=1)), rel=1e-9)
    assert pair.positions.shape == (10, 3) and pair.is_bistatic


@pytest.mark.parametrize(("speed", "other"), [(0.0, 3.0), (3.0, 0.0), (2.0, 3.0)])
def test_where_one_end_moves_both_have_a_course(speed, other):
    """A ship past a moored receiver, or the other way about: each goes on at its own speed."""
    pair = carried(line(speed=speed), line(speed=other))
    for way, fast in zip(pair.ping_motions(0, WINDOW), (speed, other), strict=True):
        np.testing.assert_allclose(way.kinematics(np.zeros((1, 3)))[1], [[fast, 0, 0]], atol=1e-9)


def test_where_none_moves_there_is_no_course():
    """Two moorings; and stop and hop, which has no later moments at all."""
    still = carried(line(speed=0.0), line(start=(3, 0, 5), speed=0.0))
    assert still.ping_motions(0, WINDOW) == (None, None)
    hops = Platforms(true_poses(line()), true_poses(line(start=(3, 0, 5))))
    assert hops.ping_motions(0, WINDOW) == (None, None)
    assert [len(moments) for moments in hops.window_poses] == [1, 1]


def test_a_receiver_leans_with_its_own_sea():
    """Two platforms of one scenario roll at random, each for itself; the scenario's own seed is not the receiver's."""
    motion = {"roll": {"rms": 0.1, "period": 5.0}}
    track = {"pings": 400, "interval": 0.7, "motion": motion}
    scenario = elements_scenario([], track=track, receiver_track={
        "kind": "line", "start": (10, 0, 6), "speed": 3.0, "motion": motion, "stop_and_hop": False})  # fmt: skip
    both = platforms(scenario)
    assert receiver_seed(scenario) != scenario.seed
    # 280 s hold some 56 periods of 5 s: unlike within 3 / sqrt(56)
    assert abs(np.corrcoef(both.transmitter_poses.roll, both.receiver_poses.roll)[0, 1]) < 0.4
    assert np.std(both.receiver_poses.roll) == pytest.approx(0.1, rel=0.3)
    assert len(both.window_poses[0]) == 3  # moving


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_both_readings_are_reported_how_the_sonar_goes_on(field):
    """Of a sonar that stops and hops, each has the pose at the start of each ping alone."""
    scenario = elements_scenario([]).unchecked_copy(field=field)  # intensities of elements would be refused
    assert platforms(scenario).transmitter_window_poses is not None
    hopping = scenario.track.model_copy(update={"stop_and_hop": True})
    assert platforms(scenario.unchecked_copy(track=hopping)).transmitter_window_poses is None


def faced(**values):
    """A sonar of a point and a line of four."""
    settings = {"source_level_db": 200, "pulse": {"kind": "cw", "frequency": 1e5, "duration": 1e-4},
            "transmit": {"kind": "point"}, "receive": line_of(), "receiver": {"record": "elements"}}  # fmt: skip
    return Sonar(**settings, **values)


@given(st.floats(-3, 3), st.floats(-1.5, 1.5))
def test_a_receiver_faces_as_its_own_mounting_states_or_as_the_transmitter(bearing, tilt):
    """Axes of the receive array: those of a sonar that is mounted so altogether."""
    here = {"bearing": bearing, "tilt": tilt}
    own = faced(mounting={"bearing": 1.0}, receive_mounting=here)
    body = np.eye(3)
    np.testing.assert_allclose(receiver_rotation(own, body), array_rotation(faced(mounting=here), body), atol=1e-12)
    np.testing.assert_allclose(array_rotation(own, body), array_rotation(faced(mounting={"bearing": 1.0}), body))
    np.testing.assert_allclose(channel_positions(own), channel_positions(faced(mounting=here)), atol=1e-12)
    common = faced(mounting=here)
    np.testing.assert_array_equal(receiver_rotation(common, body), array_rotation(common, body))
    assert own.receive_mounting == Mounting(**here)


@given(FINITE, FINITE, FINITE, st.floats(-1, 1), st.floats(-1, 1))
def test_an_arm_is_as_deep_as_its_place_states(forward, starboard, down, pitch, roll):
    """Depth of something carried, by its row of the rotation and by the whole rotation: the same."""
    here = true_poses(StaticTrack(position=(1, 2, 30)))
    leans = type(here)(here.time, here.position, here.heading + 0.4, here.pitch + pitch, here.roll + roll)
    arm = forward, starboard, down
    np.testing.assert_allclose(leans.offset_depths(arm), leans.offset_positions(arm)[:, 2], atol=1e-9)


def test_each_end_has_its_own_depths():
    """An array 2 m below the reference point, the other 1 m above, on a platform that pitches: each its own range."""
    sonar = faced().model_copy()
    arms = {"transmit": {"kind": "point", "offset": (0, 0, 2)}, "receive": {**line_of(), "offset": (0, 0, -1)}}
    sonar = Sonar.model_validate(sonar.model_dump() | arms)
    here = true_poses(line())
    assert track_extent(sonar, here).depths == pytest.approx((4, 7))
    assert track_extent(sonar, here, ends=("transmit",)).depths == pytest.approx((7, 7))
    assert track_extent(sonar, here, ends=("receive",)).depths == pytest.approx((4, 4))
