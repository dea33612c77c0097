"""Claims about motion and logged navigation: the given statistics, the same in every run, both recorded."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.frames import pose_rotation
from insonify.sonar import LineTrack, Motion, NavigationErrors, logged_poses, true_poses
from insonify.sonar.track.motion import RandomTranslation, displacement

HERE = (0.0, 0.0, 10.0)


def line(**changes):
    """Ten minutes to the north-east, a ping every 0.5 s."""
    return LineTrack(**{
        "start": HERE, "heading": "45 deg", "speed": 1.0, "pings": 1200, "interval": 0.5, "window": (0, 0.2),
    } | changes)  # fmt: skip


def test_motion_has_the_rms_that_was_requested():
    """Over 600 s of 60 seeds the mean square is the one requested within 3 %: 3 standard errors of the ensemble."""
    motion = Motion(heave=RandomTranslation(rms="0.2 m", period="6 s"))
    time = np.arange(0, 600, 0.5)
    square = [np.mean(displacement(motion, time, seed)["heave"] ** 2) for seed in range(60)]
    np.testing.assert_allclose(np.mean(square), 0.04, rtol=0.03)


def test_motion_has_the_spectrum_that_was_requested():
    """Energy below a frequency, over 40 seeds of an hour, is that of the table: a triangle from 0.1 to 0.3 Hz."""
    motion = Motion(roll={"rms": "2 deg", "spectrum": [[0.1, 0], [0.2, 1], [0.3, 0]]})
    step, count = 0.5, 7200
    power = np.zeros(count // 2 + 1)
    for seed in range(40):
        roll = displacement(motion, np.arange(count) * step, seed)["roll"]
        power += np.abs(np.fft.rfft(roll * np.hanning(count))) ** 2
    frequency = np.fft.rfftfreq(count, step)
    share = np.cumsum(power) / power.sum()
    for f, below in ((0.1, 0.0), (0.15, 0.125), (0.2, 0.5), (0.25, 0.875), (0.3, 1.0)):
        assert np.interp(f, frequency, share) == pytest.approx(below, abs=0.01)


def test_a_bell_lies_about_its_period():
    """Half of the energy is faster than the period, a quarter faster or slower than the spread has it, within 40 %."""
    share = np.linspace(0.001, 0.999, 999)
    for spread in (0.05, 0.15, 0.3):
        frequency = RandomTranslation(rms=1, period=8, bandwidth=spread).frequencies(share)
        low, middle, high = np.interp([0.25, 0.5, 0.75], share, frequency) * 8
        assert middle == pytest.approx(1, abs=1e-3)
        assert high * low == pytest.approx(1, abs=1e-3)  # the same on both sides, in octaves
        assert (high - low) / 2 == pytest.approx(spread / 2, rel=0.4)


def test_surge_and_sway_lie_along_and_across_the_heading():
    """On a north-east course surge moves north and east alike, sway to the south-east; heave is down."""
    along = true_poses(line(motion={"surge": {"rms": 1, "period": 8}}), seed=3).position - true_poses(line()).position
    across = true_poses(line(motion={"sway": {"rms": 1, "period": 8}}), seed=3).position - true_poses(line()).position
    up = true_poses(line(motion={"heave": {"rms": 1, "period": 8}}), seed=3).position - true_poses(line()).position
    np.testing.assert_allclose(along[:, 0], along[:, 1], atol=1e-9)
    np.testing.assert_allclose(across[:, 0], -across[:, 1], atol=1e-9)
    assert np.abs(along[:, :2]).max() > 0.5 and np.abs(across[:, :2]).max() > 0.5
    assert np.abs(up[:, :2]).max() < 1e-9 and np.abs(up[:, 2]).max() > 0.5


def test_motion_belongs_to_the_seed_and_the_time():
    """The same seed the same poses, another seed others; a longer track begins as the shorter one does."""
    settings = {"motion": {"yaw": {"rms": "1 deg", "period": 9}, "pitch": {"rms": "1 deg", "period": 5}}}
    one, again, other = (true_poses(line(**settings), seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.heading, again.heading)
    assert np.abs(one.heading - other.heading).max() > 0.01
    longer = true_poses(line(pings=2400, **settings), seed=1)
    np.testing.assert_array_equal(longer.heading[:1200], one.heading)
    assert abs(np.corrcoef(one.heading, one.pitch)[0, 1]) < 0.2  # freedoms are drawn apart


def test_what_a_platform_carries_moves_with_it():
    """A lever arm keeps its length, and turns with the platform."""
    rows = true_poses(line(motion={"roll": {"rms": "10 deg", "period": 7}}), seed=5)
    arm = rows.offset_positions((1.0, 2.0, 3.0)) - rows.position
    np.testing.assert_allclose(np.linalg.norm(arm, axis=1), np.sqrt(14), rtol=1e-12)
    np.testing.assert_allclose(arm[7], rows.rotation(7) @ [1, 2, 3], rtol=1e-12)
    assert pose_rotation(rows.heading, rows.pitch, rows.roll).shape == (1200, 3, 3)


def test_a_log_without_errors_is_the_truth():
    """Bit for bit."""
    true = true_poses(line())
    log = logged_poses(NavigationErrors(), true, 1)
    np.testing.assert_array_equal(log.position, true.position)
    np.testing.assert_array_equal(log.attitude, true.attitude)


def test_a_logs_errors_are_offset_drift_and_noise():
    """The straight line through the error is the offset and the drift; what is left has the noise's rms (N = 1200)."""
    errors = NavigationErrors(
        north={"offset": "2 m", "drift": "0.01 m/s", "noise": "0.5 m"}, heading={"drift": "3.6 deg/h"}
    )
    true = true_poses(line())
    log = logged_poses(errors, true, 9)
    error = log.position - true.position
    slope, offset = np.polyfit(true.time, error[:, 0], 1)
    assert slope == pytest.approx(0.01, abs=3e-4) and offset == pytest.approx(2, abs=0.1)
    assert np.std(error[:, 0] - slope * true.time - offset) == pytest.approx(0.5, rel=0.07)
    assert np.abs(error[:, 1:]).max() == 0
    np.testing.assert_allclose(np.degrees(log.heading - true.heading), true.time / 1000, atol=1e-12)


def test_noise_with_a_memory_decorrelates_in_that_time():
    """Neighbours that are a memory apart correlate by 1/e; the rms stays as requested (mean of 40 seeds)."""
    true = true_poses(line(pings=4000))
    errors = NavigationErrors(east={"noise": "1 m", "correlation_time": "5 s"})
    noise = np.array([(logged_poses(errors, true, seed).position - true.position)[:, 1] for seed in range(40)])
    assert np.mean(noise**2) == pytest.approx(1, abs=0.05)
    assert np.mean(noise[:, 10:] * noise[:, :-10]) == pytest.approx(np.exp(-1), abs=0.04)


@pytest.mark.parametrize(
    ("wrong", "advice"),
    [
        ({"rms": 1}, "needs either a period or a spectrum"),
        ({"rms": 1, "period": 5, "spectrum": [[0.1, 1], [0.2, 1]]}, "has a period and a spectrum"),
        ({"rms": 1, "spectrum": [[0.1, 1]]}, "1 rows are no spectrum"),
        ({"rms": 1, "spectrum": [[0.2, 1], [0.1, 1]]}, "spectrum.1.0: 0.1 Hz is not above the row before"),
        ({"rms": 1, "spectrum": [[0.1, 1], [0.2, -1]]}, "spectrum.1.1: -1 is negative"),
        ({"rms": 1, "spectrum": [[0.1, 0], [0.2, 0]]}, "every density is 0"),
        ({"rms": -1, "period": 5}, "rms: -1 m is out of range (0 to 100 m)"),
    ],
)
def test_a_motion_that_cannot_be_is_refused_with_advice(wrong, advice):
    """Where, and the fix."""
    with pytest.raises(ValidationError) as run_refusal:
        Motion(heave=wrong)
    assert advice in str(run_refusal.value)
