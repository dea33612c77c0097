"""Echoes to a moving sonar: the recording is the sum over its arrivals, each with the pulse at its Doppler factor."""

import pytest

from insonify.scenario.template import load_template
from oracles.direct_sum import direct_sum_error

LINE = {"kind": "line", "length": "1 m", "elements": 8}
TRACK = {"kind": "line", "start": [0, 0, 12], "heading": 0, "speed": 2.0, "pings": 8, "interval": 0.1,
         "window": [0.0, 0.042]}  # fmt: skip
ELEMENTS = {"sonar.sides": None, "sonar.receive": LINE, "sonar.receiver.record": "elements"}
TURNING = {"roll": {"rms": "2 deg", "period": 4.0}, "heave": {"rms": "10 cm", "period": 4.0},
           "yaw": {"rms": "2 deg", "period": 6.0}}  # fmt: skip
SIDESCAN = {"field": "coherent", "track": TRACK, "targets": [], "sonar.receiver.sub_bands": 1}


@pytest.mark.parametrize(
    ("changes", "channels"),
    [
        ({}, (1,)),
        (ELEMENTS, (0, 7)),
        (ELEMENTS | {"track": TRACK | {"motion": TURNING}}, (0, 7)),
        ({"track": TRACK | {"motion": {"roll": TURNING["roll"]}}}, (0,)),
    ],
    ids=["beams", "elements", "elements that turn and heave", "rolling"],
)
def test_side_lobes_have_the_doppler_factor_of_their_direction(changes, channels):
    """Waveforms are evaluated for each arrival: the rms difference is 2e-6 of that of the sum; seen: 8e-7.

    Echoes from far ahead and far behind come by side lobes. With the waveform of the farthest direction in the beams
    down to -45 dB in place of their own, elements have an error of 8e-5. The sum begins before the echo from below.
    """
    scenario = load_template("sidescan").with_(SIDESCAN | changes)
    assert direct_sum_error(scenario, 6, channels, 0.020) < 2e-6
