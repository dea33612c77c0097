"""Numbers of the nominal scene: range of the box's echo, and its level above the seabed."""

import numpy as np
import xarray as xr

from insonify.paper.checked_numbers import CheckedNumber
from insonify.processing.recording_level import recorded_level
from insonify.scenario.scenario import Scenario
from insonify.scene.target import Box

AROUND, BEFORE = 2.0, (30.0, 5.0)
"""Length of the search window around the near face, and start and end of the seabed before it [m]."""


def numbers(recording: xr.Dataset, scenario: Scenario) -> list[CheckedNumber]:
    """Compare the measured echo of the box with its position in the scenario.

    Args:
        recording: One ping of the nominal scene.
        scenario: Scenario with one box on the seabed, abeam.
    """
    (box,) = (target for target in scenario.targets if isinstance(target, Box))
    level = recorded_level(recording).values[0, 0]
    slant = np.asarray(recording["slant_range"].values, float)
    sonar = np.asarray(recording["position"].values[0], float)
    face = np.array([box.position[0], box.position[1] - box.size[1] / 2, scenario.seabed.depth - box.size[2] / 2])
    distance = float(np.linalg.norm(face - sonar))
    pulse = scenario.water.sound_speed * scenario.sonar.pulse.duration / 2
    near = np.abs(slant - distance) < AROUND / 2
    bed = (slant > distance - BEFORE[0]) & (slant < distance - BEFORE[1])
    strongest = float(slant[near][level[near].argmax()])
    above = float(level[near].max() - np.median(level[bed]))
    where = "slant range of the middle of its near face, and half the pulse"
    name = "box: slant range of its strongest direct echo"
    return [
        CheckedNumber(name, strongest, "m", distance + pulse / 2, pulse, where),
        CheckedNumber("box: strongest direct echo above the bed before it", above, "dB"),
    ]
