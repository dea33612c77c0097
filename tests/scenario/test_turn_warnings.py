"""Claims about tracks with turns: the loss of level to one side is reported with its size beforehand."""

import warnings

import numpy as np
import pytest

from insonify import simulate
from insonify.scenario.turn_warnings import turn_loss_db, turn_warnings
from oracles.scenes import nominal

STOP = 0.1
ARRAY = {"kind": "planar", "width": 1.0, "height": 0.02}


def survey(radius, **track):
    """East, then north: a quarter turn to the left between two straight lines, both sides, a flat bed."""
    waypoints = [(0, 0, 12), (0, 40, 12), (40, 40, 12)]
    path = {"kind": "waypoints", "waypoints": waypoints, "speed": 2.0, "turn_radius": radius, "interval": 0.5,
            "window": (0.0, STOP)}  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        still = nominal(
            field="incoherent", line={**ARRAY, "length": None},
            paths={"max_reflections": 0, "contributions": ["seabed"]},
            sonar={"sides": ["port", "starboard"], "mounting": {"bearing": np.pi / 2, "tilt": 0.3}},
        )  # fmt: skip
        return still.with_("track", path | track)


def wavelength(scenario):
    """Of its sound [m]."""
    return scenario.water.sound_speed / scenario.sonar.pulse.frequency


def test_the_reported_loss_is_what_the_recording_has():
    """At the end of the window, mean of both sides in dB, against the straight line; and the outer side is darker."""
    radius = 16.0
    scenario = survey(radius)
    (message,) = turn_warnings(scenario, wavelength(scenario))
    expected = turn_loss_db(2.0 / radius * STOP, (0.886 * wavelength(scenario),) * 2)
    assert (
        f"about {expected:.0f} dB weaker" in message and "on the outside" in message and "one side is darker" in message
    )
    turning = round(40 - radius + np.pi / 4 * radius)  # the middle of the arc, a ping to the metre
    recorded = simulate(scenario, pings=[5, turning])["intensity"]
    late = 10 * np.log10(recorded.isel(time=recorded["time"] > 0.97 * STOP).mean("time").values)
    lost = late[0] - late[1]
    assert lost.mean() == pytest.approx(expected, rel=0.25)
    port, starboard = lost  # a turn to the left: starboard is outside
    assert starboard > port + 2


def test_a_platform_that_stops_and_hops_loses_nothing():
    """Nor does one that runs straight, or turns slowly: nothing is reported, and both sides are alike."""
    hopping = survey(10.0, stop_and_hop=True)
    assert turn_warnings(hopping, wavelength(hopping)) == []
    level = simulate(hopping, pings=[5, 40])["intensity"].mean("time").values
    np.testing.assert_allclose(level[0], level[1], rtol=0.02)
    slow = survey(35.0, speed=0.5)
    assert turn_warnings(slow, wavelength(slow)) == []


def test_a_loss_of_side_lobes_is_not_reported_to_the_decibel():
    """Beyond 10 dB a Gaussian beam does not apply, and the words have a bound instead."""
    scenario = survey(8.0)
    (message,) = turn_warnings(scenario, wavelength(scenario))
    assert "10 dB and more weaker" in message


def test_two_beams_a_width_apart_lose_six_decibels():
    """Closed form, for Gaussian beams; a wide one forgives."""
    assert turn_loss_db(0.01, (0.01, 0.01)) == pytest.approx(6.02, abs=0.01)
    assert turn_loss_db(0.01, (0.01, np.pi)) < 1e-3
