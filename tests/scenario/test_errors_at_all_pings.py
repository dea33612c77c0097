"""Errors that depend on the sonar's depth are found on its whole track, not on the first ping alone."""

import warnings

import numpy as np
import pytest
from pydantic import ValidationError

import insonify
from insonify.scenario.scenario import Scenario
from insonify.sonar.ping_geometry import array_depths
from insonify.sonar.track import true_poses
from insonify.validity import PhysicsWarning

LINE = {"kind": "line", "length": 1.5}
PULSE = {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3}
CORNERS = [[0.0, 1510.0], [4.0, 1510.0], [8.0, 1490.0], [20.0, 1490.0]]


def diving(start, stop, *, receive=LINE, water=None, **more):
    """A sonar that goes down along 20 m of track."""
    return Scenario(
        sonar={"source_level_db": 220, "pulse": PULSE, "transmit": LINE, "receive": receive},
        water=water or {"profile": CORNERS, "noise_level_db": None},
        track={"kind": "waypoints", "waypoints": [(0, 0, start), (20, 0, stop)], "speed": 2.0, "interval": 1.0,
               "window": (0.0, 0.24)},
        **more,
    )  # fmt: skip


def cautions_of(start, stop):
    """Warnings of the profile."""
    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always")
        diving(start, stop)
    return [str(one.message) for one in message if one.category is PhysicsWarning]


def test_a_corner_that_only_the_last_pings_reach_is_reported():
    """Seen from 2 m the corner at 8 m gathers no rays; from 11 m it does, the first ping's depth or the last's."""
    assert not any("8 m" in word for word in cautions_of(2.0, 2.1))
    for start, stop in ((11.0, 2.0), (2.0, 11.0)):
        assert any("8 m" in word for word in cautions_of(start, stop))


def test_a_beam_that_is_insensitive_at_the_last_ping_only_is_refused():
    """Elements of 6 cm are insensitive where sin = wavelength / 6 cm: with the sound speed at the end of the track."""
    water = {"profile": [[0.0, 1500.0], [20.0, 1480.0]], "noise_level_db": None}
    plain = diving(5.0, 15.0, water=water)
    slowest = float(plain.water.sound_speed_at(array_depths(plain.sonar, true_poses(plain.track, seed=1))[-1]))
    row = LINE | {"elements": 25, "element": "piston", "steer": (float(np.arcsin(slowest / 100e3 / 0.06)),)}
    with pytest.raises(ValidationError, match=r"receive.steer"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        diving(5.0, 15.0, water=water, receive=row)


def test_no_pings_are_a_recording_without_pings():
    """Nothing is requested, nothing is received, and the axes are those of any recording."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scenario = diving(5.0, 6.0)
    for field in ("coherent", "incoherent"):
        found = insonify.simulate(scenario.model_copy(update={"field": field}), pings=[])
        sound = found["pressure" if field == "coherent" else "intensity"]
        assert sound.dims == ("ping", "channel", "time") and sound.shape[0] == 0
        assert sound.shape[1] == 1 and sound.shape[2] == found.time.size > 0
