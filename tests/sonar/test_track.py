"""Claims about tracks: where the platform is at every ping."""

import warnings

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.sonar import LineTrack, Poses, StaticTrack, true_poses
from insonify.sonar.track.ping_schedule import PingSchedule
from insonify.validity import PhysicsWarning

HERE = ("1 m", "2 m", "11 m")


def test_a_static_platform_stays():
    """Every ping from one place, at its own time."""
    rows = true_poses(StaticTrack(position=HERE, heading="30 deg", roll="2 deg", pings=3, interval="0.5 s"))
    assert len(rows) == 3
    np.testing.assert_allclose(rows.time, [0, 0.5, 1.0])
    np.testing.assert_allclose(rows.position, [[1, 2, 11]] * 3)
    np.testing.assert_allclose(rows.heading, np.radians(30))
    np.testing.assert_allclose(rows.roll, np.radians(2))


def test_a_line_runs_along_its_heading():
    """Heading east at 2 knots, the platform moves east only, by speed times time."""
    rows = true_poses(LineTrack(start=HERE, heading="90 deg", speed="2 kn", pings=4, interval=0.25))
    east = 2 + 2 * 1852 / 3600 * 0.25 * np.arange(4)
    np.testing.assert_allclose(rows.position, np.stack([np.ones(4), east, np.full(4, 11)], axis=-1), atol=1e-12)


def test_the_bow_points_where_the_platform_goes():
    """The first body axis is the direction between two pings, when the platform is level."""
    rows = true_poses(LineTrack(start=HERE, heading="200 deg", speed=1.5, pings=2))
    way = rows.position[1] - rows.position[0]
    np.testing.assert_allclose(rows.rotation(0)[:, 0], way / np.linalg.norm(way), atol=1e-12)


def test_pitch_and_roll_have_the_navigators_signs():
    """Bow up is shallower, starboard down is deeper."""
    rows = true_poses(StaticTrack(position=HERE, pitch="5 deg", roll="3 deg"))
    assert rows.rotation(0)[2, 0] < 0
    assert rows.rotation(0)[2, 1] > 0


@pytest.mark.parametrize(
    ("wrong", "advice"),
    [
        ({"pings": 0}, "an empty track"),
        ({"interval": 0}, "interval: 0 s is out of range (above 0, to 1000000 s)"),
        ({"window": (0.2, 0.1)}, "is not after the window's start"),
        ({"window": (0.1, "100 ms")}, "is not after the window's start"),
        ({"window": (-0.1, 0.1)}, "before the transmission"),
        ({"position": (0, 0)}, "position: value 3 is missing. Write a length in m there"),
        ({"position": (0, float("nan"), 0)}, "finite number"),
        ({"heading": "400 deg"}, "heading: 400 deg is out of range (-360 to 360 deg)"),
    ],
)
def test_an_impossible_track_is_refused_with_advice(wrong, advice):
    """What, the value, the limit, the fix."""
    with pytest.raises(ValidationError) as run_refusal:
        StaticTrack(**({"position": HERE} | wrong))
    assert advice in str(run_refusal.value)


def test_receiving_past_the_next_ping_is_a_warning():
    """Echoes of earlier pings are ignored, and the user is warned; a lone ping has no successor."""
    with pytest.warns(PhysicsWarning, match="earlier pings are ignored"):
        StaticTrack(position=HERE, pings=2, interval=0.2, window=(0, 0.24))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        StaticTrack(position=HERE, pings=1, interval=0.2, window=(0, 0.24))
        StaticTrack(position=HERE, pings=9, interval=0.3, window=(0, 0.24))


def test_columns_of_poses_have_a_row_per_ping():
    """A record is checked at the door."""
    with pytest.raises(ValueError, match="position has 1 rows; time has 2"):
        Poses(
            time=np.zeros(2),
            position=np.zeros((1, 3)),
            heading=np.zeros(2),
            pitch=np.zeros(2),
            roll=np.zeros(2),
        )


def test_a_schedule_of_pings_is_no_track():
    """The fields that all tracks share make no track: a kind of track has to define how many pings it has."""
    with pytest.raises(TypeError, match="ping_count"):
        PingSchedule()
