"""Claims about the sonar as a whole: which beams pair up, and where its arrays stand."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.frames import pose_rotation
from insonify.sonar import (
    LineArray,
    Mounting,
    PlanarArray,
    PointTransducer,
    Pulse,
    Receiver,
    Sonar,
    array_position,
    array_rotation,
    beams,
)

TONE = Pulse(frequency="100 kHz", duration="0.2 ms")


def sonar(transmit, receive, **more) -> Sonar:
    """A sonar of which only the arrays matter."""
    return Sonar(source_level_db="220 dB", pulse=TONE, transmit=transmit, receive=receive, **more)


def test_the_papers_sonar_can_be_written_down():
    """100 kHz, 0.2 ms tapered tone, two 1.5 m lines to starboard, 220 dB: words and numbers state the same."""
    words = Sonar.model_validate(
        {
            "source_level_db": "220 dB",
            "pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.2 ms", "taper": "tukey"},
            "transmit": {"kind": "line", "length": "150 cm"},
            "receive": {"kind": "line", "length": "1.5 m", "steer": "0 deg"},
            "mounting": {"bearing": "90 deg"},
        }
    )
    assert words == sonar(LineArray(length=1.5), LineArray(length=1.5, steer=0.0))
    assert Sonar.model_validate(words.model_dump()) == words
    assert words.channel_count == 1


@pytest.mark.parametrize(
    ("transmit", "receive", "steers"),
    [
        (None, ("-5 deg", "0 deg", "5 deg"), (-5, 0, 5)),
        ("3 deg", ("-5 deg", "5 deg"), (-5, 5)),
        (("1 deg", "2 deg"), "7 deg", (1, 2)),
        (("1 deg", "2 deg"), ("3 deg", "4 deg"), (3, 4)),
        (None, None, (0,)),
    ],
)
def test_channels_are_pairs_of_beams(transmit, receive, steers):
    """Lists of steer angles pair up; a single angle serves all; none on transmit follows the receiver."""
    one = sonar(LineArray(length=1.5, steer=transmit), LineArray(length=1.5, steer=receive))
    assert one.channel_count == len(steers)
    np.testing.assert_allclose(np.degrees(one.steers), steers)
    sent, received = one.arrays
    if transmit is None:
        assert sent.steers == received.steers


def test_an_unsteered_transmit_line_follows_a_panel_looking_down():
    """The line's cone holds the panel's steered direction, so both have unit gain there."""
    panel = PlanarArray(width=0.5, height=0.2, steer=("20 deg", "-30 deg"), steer_down="25 deg")
    sent, received = sonar(LineArray(length=1.0), panel).arrays
    right, down = np.array(received.steers).T
    axis = np.stack([np.cos(down) * np.cos(right), np.cos(down) * np.sin(right), np.sin(down)], axis=-1)
    np.testing.assert_allclose(np.diag(beams(sent, 100e3, 1500).gain(axis)), 1, atol=1e-9)
    follower, _ = sonar(PlanarArray(width=1, height=1), panel).arrays
    assert follower.steers == received.steers


def test_a_point_cannot_be_steered():
    """It stays one beam beside any number of receive beams."""
    sent, received = sonar(PointTransducer(), LineArray(length=1, steer=(0.1, 0.2))).arrays
    assert (len(sent.steers), len(received.steers)) == (1, 2)


@pytest.mark.parametrize(
    ("build", "advice"),
    [
        (lambda: sonar(LineArray(length=1, steer=(0, 0.1)), LineArray(length=1, steer=(0, 0.1, 0.2))), "pair up"),
        (
            lambda: sonar(LineArray(length=1), LineArray(length=1), receiver=Receiver(bandwidth="160 kHz")),
            "under 160 kHz",
        ),
        (lambda: LineArray(length=1, steer="90 deg"), "less than 90 deg"),
        (lambda: LineArray(length=1, steer=()), "at least one"),
        (lambda: LineArray(length=0), "length: 0 m is out of range (above 0, to 100 m)"),
        (lambda: LineArray(length=1, elements=0), "elements: 0 is out of range (1 to 10000)"),
        (
            lambda: PlanarArray(width=1, height=1, steer_down="95 deg"),
            "steer_down: 95 deg is out of range (above -90, below 90",
        ),
        (lambda: Mounting(tilt="100 deg"), "tilt: 100 deg is out of range (-90 to 90 deg)"),
        (
            lambda: sonar({"kind": "lin", "length": 1}, LineArray(length=1)),
            "'lin' is not known here (one of line, planar, point",
        ),
    ],
)
def test_an_impossible_sonar_is_refused_with_advice(build, advice):
    """What, the value, the limit, the fix."""
    with pytest.raises(ValidationError) as run_refusal:
        build()
    assert advice in str(run_refusal.value)


def test_a_starboard_array_looks_to_starboard():
    """Heading east, a sidescan's starboard side looks south, its right is aft: west; tilted, it looks down too."""
    one = sonar(LineArray(length=1), LineArray(length=1), mounting=Mounting(bearing="90 deg", tilt="30 deg"))
    axes = array_rotation(one, pose_rotation(np.pi / 2))
    tilt = np.radians(30)
    expected = [[-np.cos(tilt), 0, np.sin(tilt)], [0, -1, 0], [np.sin(tilt), 0, np.cos(tilt)]]
    np.testing.assert_allclose(axes, expected, atol=1e-15)


def test_a_lever_arm_turns_with_the_platform():
    """Two metres ahead and one below the reference point of a platform heading east: east and deeper."""
    array = LineArray(length=1, offset=("2 m", 0, "1 m"))
    place = array_position(array, np.array([10.0, 20.0, 5.0]), pose_rotation(np.pi / 2))
    np.testing.assert_allclose(place, [10, 22, 6], atol=1e-12)
