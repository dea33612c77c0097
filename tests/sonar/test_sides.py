"""Claims about the two sides of a sidescan: each receives its own side, and they are mirror images."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.simulator import arrivals, build_simulator, levels, simulate
from insonify.sonar import Sonar
from oracles.scenes import PULSE, nominal, point

SIDES = {"sides": ["port", "starboard"]}
QUIET = {"paths": {"contributions": ["target"], "max_reflections": 0}}


def strongest_echo(scenario):
    """Largest magnitude on each channel."""
    return np.abs(simulate(scenario, pings=[0]).pressure.values[0]).max(axis=-1)


@pytest.mark.parametrize(("heading", "north", "east"), [(0, 0, 1), (90, -1, 0), (200, np.sin(np.radians(20)),
                                                                               -np.cos(np.radians(20)))])  # fmt: skip
def test_what_lies_to_starboard_is_received_to_starboard(heading, north, east):
    """Heading north, starboard is east: a target there is on the starboard channel alone, and 180 deg round on port."""
    for side, row in ((1, 1), (-1, 0)):
        target = point(60 * north * side, 60 * east * side, 15)
        track = {"window": (0.07, 0.1), "heading": np.radians(heading)}
        received = strongest_echo(nominal(sonar=SIDES, targets=[target], track=track, **QUIET))
        assert received[row] > 1e6 and received[1 - row] == 0


def test_sides_are_labelled_in_the_order_requested():
    """Port is -1, starboard 1; a sonar without sides has 0."""
    quick = {"track": {"window": (0.08, 0.081)}, **QUIET}
    both = simulate(nominal(sonar={"sides": ["starboard", "port"]}, **quick))
    assert list(both.side.values) == [1, -1]
    assert list(simulate(nominal(**quick)).side.values) == [0]
    fan = Sonar(
        source_level_db=200, pulse=PULSE, transmit={"kind": "line", "length": 1},
        receive={"kind": "line", "length": 1, "steer": [0.1, 0.2]}, **SIDES,
    )  # fmt: skip
    assert fan.channel_count == 4 and fan.channel_sides == (-1, -1, 1, 1)
    np.testing.assert_allclose(fan.steers, [-0.1, -0.2, 0.1, 0.2])


def test_a_level_bed_sounds_the_same_on_both_sides():
    """The expected intensity of a flat bed is mirror symmetric, with lever arms, steer and tilt mirrored too."""
    end = {"kind": "planar", "width": 1.0, "height": 0.05, "offset": (0.3, 0.8, 0.2)}
    sonar = {**SIDES, "transmit": end, "receive": {**end, "steer": 0.2}, "mounting": {"bearing": 1.4, "tilt": 0.3}}
    received = simulate(nominal(sonar=sonar, field="incoherent", track={"window": (0.02, 0.1), "heading": 0.7}))
    port, starboard = received.intensity.values[0]
    # the even points are placed about each boresight, and so not mirrored: 0.05 dB is what their ripple leaves
    smooth = np.ones(50) / 50
    ratio = np.convolve(port, smooth, "valid") / np.convolve(starboard, smooth, "valid")
    assert np.abs(10 * np.log10(ratio)).max() < 0.05


def test_a_mirrored_target_sounds_the_same_on_the_other_side():
    """A point to port of a mirrored sonar gives the port channel what its image gives the starboard channel."""
    end = {"kind": "line", "length": 1.0, "offset": (0.3, 0.8, 0.2)}
    sonar = {**SIDES, "transmit": end, "receive": {**end, "steer": [0.02, -0.05]}, "mounting": {"bearing": 1.4}}
    track = {"window": (0.05, 0.12)}
    received = [
        simulate(nominal(sonar=sonar, targets=[point(12, side * 60, 15)], track=track, **QUIET)).pressure.values[0]
        for side in (-1, 1)
    ]
    np.testing.assert_allclose(received[0][:2], received[1][2:], rtol=1e-4, atol=1e-2)


def test_one_side_is_the_sonar_as_mounted():
    """`sides: [starboard]` has the bits of a sonar without sides; the second channel of both does too."""
    track = {"window": (0.1, 0.102)}
    alone, one, both = (
        simulate(nominal(sonar=sonar, track=track)).pressure.values[0]
        for sonar in ({}, {"sides": ["starboard"]}, SIDES)
    )
    np.testing.assert_array_equal(one, alone)
    np.testing.assert_array_equal(both[1], alone[0])


def test_channels_of_levels_and_arrivals_belong_to_their_sides():
    """The target's paths and its level are found on its own side only."""
    scenario = nominal(sonar=SIDES, targets=[point(0, 60, 15)], track={"window": (0.07, 0.09)}, **QUIET)
    here = [build_simulator(scenario).ping_geometry(0, channel=channel) for channel in (0, 1)]
    np.testing.assert_allclose(here[0].boresight, -here[1].boresight, atol=1e-12)
    strong = [float(levels(scenario, channel=channel).level_db.max()) for channel in (0, 1)]
    assert strong[0] == -np.inf and strong[1] > 100
    assert len(arrivals(scenario, channel=1)) == 1
    with pytest.raises(ValueError, match="channel is 2; the sonar has channels 0 to 1"):
        arrivals(scenario, channel=2)


@pytest.mark.parametrize(
    ("wrong", "advice"),
    [
        ({"sides": []}, "[] is no choice of sides"),
        ({"sides": ["port", "port"]}, "is no choice of sides. Write [port, starboard]"),
        ({**SIDES, "mounting": {"bearing": -1.5}}, "mounting.bearing: -85.9437 deg is not to starboard of the bow"),
        ({**SIDES, "mounting": {"bearing": 0}}, "mounting.bearing: 0 deg is not to starboard of the bow"),
    ],
)
def test_sides_that_cannot_be_are_refused_with_advice(wrong, advice):
    """What to write instead."""
    with pytest.raises(ValidationError) as run_refusal:
        nominal(sonar=wrong)
    assert advice in str(run_refusal.value)


def test_a_slice_has_no_sides():
    """One vertical plane, one beam."""
    with pytest.raises(ValidationError, match="slice has one beam, but the sonar has 2 on its sides"):
        nominal(sonar=SIDES, paths={"geometry": "slice"})
