"""Objects out of reach of every ping get a warning."""

import warnings
from typing import Any

import pytest

from insonify.scenario.scenario import Scenario
from insonify.validity import PhysicsWarning

REACH = 30.0
"""Slant range that comes back within the window of `a_survey` [m]."""


def a_survey(**changes: Any) -> Scenario:
    """A small survey of a level bed 8 m below the sonar, received for 40 ms at 1500 m/s: 30 m."""
    described: dict[str, Any] = {
        "water": {"sound_speed": 1500.0},
        "seabed": {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27}},
        "sonar": {
            "source_level_db": 220, "pulse": {"kind": "cw", "frequency": 100e3, "duration": 1e-4},
            "transmit": {"kind": "planar", "width": 1, "height": 0.02},
            "receive": {"kind": "planar", "width": 1, "height": 0.02},
        },
        "track": {"kind": "line", "start": [0, 0, 12], "speed": 2, "pings": 3, "interval": 0.15, "window": [0, 0.04]},
    }  # fmt: skip
    return Scenario(**(described | changes))


def messages(**changes: Any) -> list[str]:
    """Warnings of a scenario with some changes."""
    with warnings.catch_warnings(record=True) as message:
        warnings.simplefilter("always", PhysicsWarning)
        a_survey(**changes)
    return [str(word.message) for word in message]


def test_a_survey_that_receives_its_bed_and_targets_is_silent() -> None:
    """A bed and a box within 30 m of the track need no word."""
    box = {"shape": "box", "position": [0, 20], "size": [2, 1, 1]}
    assert messages(targets=[box]) == []


@pytest.mark.parametrize(("depth", "words"), [(12 + REACH - 0.1, 0), (12 + REACH + 0.1, 1)])
def test_a_bed_is_missed_from_the_range_on_that_the_window_ends_at(depth: float, words: int) -> None:
    """Straight down, sound comes back from c t / 2 = 30 m at the end of the window."""
    message = messages(seabed={"depth": depth, "scattering": {"law": "lambert", "strength_db": -27}})
    assert len(message) == words
    assert all("none of its echoes is received" in word for word in message)


@pytest.mark.parametrize(("depth", "words"), [(12 + REACH + 0.05, 0), (12 + REACH + 1.0, 1)])
def test_a_bed_of_low_relief_is_missed_where_its_highest_place_is(depth: float, words: int) -> None:
    """Ripples of 0.4 m from trough to crest: the bed is missed where all of it is more than 30 m below the sonar."""
    relief = {"kind": "ripples", "wavelength": 2.0, "height": 0.4}
    message = messages(seabed={"depth": depth, "relief": relief, "scattering": {"law": "lambert", "strength_db": -27}})
    assert sum("none of its echoes is received" in word for word in message) == words


@pytest.mark.parametrize(("east", "words"), [(REACH + 2.4, 0), (REACH + 2.6, 1)])
def test_a_target_is_missed_where_its_nearest_end_is(east: float, words: int) -> None:
    """A log of 5 m that lies along east: 2.5 m from its middle to its end, and 30 m are received."""
    log = {"shape": "cylinder", "label": "log", "position": [0, east], "length": 5, "diameter": 0.1,
           "heading": "90 deg"}  # fmt: skip
    message = [word for word in messages(targets=[log]) if "target log" in word]
    assert len(message) == words


def test_a_target_in_the_wrong_place_is_named_with_its_distance() -> None:
    """A point 4 km to the east of a track along north is never received; its own words report it."""
    message = messages(
        targets=[{"shape": "point", "label": "buoy", "position": [0, 4000, 15], "target_strength_db": -10}]
    )
    assert len(message) == 1
    assert "target buoy: it lies 4000 m or more" in message[0]


SCHOOL = {"label": "school", "size": [4, 4, 2], "volume_strength_db": -40}


@pytest.mark.parametrize(("east", "words"), [(REACH + 2.9, 0), (REACH + 3.1, 1)])
def test_a_patch_of_water_out_of_reach_is_named(east: float, words: int) -> None:
    """A school beside the track, at its depth, of 3 m from its middle to a corner: 30 m of water are received."""
    message = messages(water={"sound_speed": 1500.0, "patches": [{**SCHOOL, "position": [0, east, 12]}]})
    assert len(message) == words
    assert all("school lies 30.1 m or more from the track" in word for word in message)


@pytest.mark.parametrize(("depth", "words"), [(19.9, 0), (20.0, 1), (60.0, 1)])
def test_a_layer_below_the_bed_is_named(depth: float, words: int) -> None:
    """Of three rows the last one, where it begins at or below the bed at 20 m; clear water is nothing to miss."""
    rows = [[0, -80], [5, None], [depth, -60]]
    message = messages(water={"sound_speed": 1500.0, "volume_strength_db": rows})
    assert len(message) == words
    assert all(f"the layer from {depth:g} m down lies below the seabed, which is at 20 m" in word for word in message)
    assert messages(water={"sound_speed": 1500.0, "volume_strength_db": [[0, -80], [depth, None]]}) == []
