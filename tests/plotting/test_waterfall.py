"""Claims about the waterfall of a sidescan: port left, starboard right, the latest ping on top, distances in metres."""

import numpy as np
import pytest

from insonify import plotting, simulate
from insonify.cli import main
from insonify.plotting.recording_levels import recording_levels
from insonify.plotting.sidescan import has_sides, sidescan, sidescan_image, sidescan_waterfall
from oracles.scenes import nominal, point


@pytest.fixture(scope="module")
def survey():
    """Four pings north; a point to the north-east that comes abeam at the last one."""
    scenario = nominal(
        sonar={"sides": ["port", "starboard"]}, targets=[point(3.0, 60, 15)], line={"length": 0.3},
        paths={"contributions": ["target"], "max_reflections": 0},
    )  # fmt: skip
    track = {"kind": "line", "start": (0, 0, 11), "speed": 2, "pings": 4, "interval": 0.5, "window": (0, 0.1)}
    return simulate(type(scenario)(**scenario.model_dump(mode="json", exclude={"track"}), track=track))


def test_starboard_is_to_the_right_and_later_pings_are_above(survey):
    """The halves lie on either side of the track; the last ping, in which the target is strongest, is the top row."""
    axes = sidescan_waterfall(survey, recording_levels(survey), gain="none").axes[0]
    port, starboard = axes.images
    assert port.get_extent()[:2] == pytest.approx((-74.97, 0)) and starboard.get_extent()[1] == pytest.approx(74.97)
    assert starboard.get_extent()[2:] == pytest.approx((-0.5, 3.5)) and starboard.origin == "lower"
    level = np.nan_to_num(starboard.get_array().filled(-999), neginf=-999)
    assert np.argmax(level.max(axis=1)) == 3
    assert not np.isfinite(port.get_array().filled(np.nan)).any()
    assert axes.get_xlabel() == "port  |  starboard,  slant range [m]" and axes.get_ylabel() == "distance run [m]"


def test_on_the_ground_the_axis_is_labelled_so(survey):
    """Distance across the track; altitude from the scenario and the log."""
    image = sidescan_image(survey, recording_levels(survey), ground=True, gain="tvg40")
    np.testing.assert_allclose(image.altitude, 9)
    axes = sidescan(image).axes[0]
    assert axes.get_xlabel() == "port  |  starboard,  distance across the track [m]"


def test_a_platform_that_stays_is_drawn_over_pings():
    """No distance was run."""
    quick = {"paths": {"contributions": ["target"]}, "targets": [point(0, 60, 15)]}
    still = simulate(nominal(track={"window": (0.07, 0.09), "pings": 3}, **quick))
    assert not has_sides(still)
    assert sidescan_waterfall(still, recording_levels(still)).axes[0].get_ylabel() == "ping"


def test_a_recording_with_sides_is_drawn_as_one_picture(survey, tmp_path):
    """One panel for both sides; one ping alone is a trace for each, called by its side."""
    path = plotting.recording(survey, tmp_path / "survey.png")
    assert path.read_bytes().startswith(b"\x89PNG")
    assert recording_levels(survey).named(ping=2, channel=0).endswith("ping 2, port, beam 0 steered +0.00 deg")
    plotting.recording(survey, tmp_path / "ping.png", ping=3)


def test_a_part_of_a_survey_states_how_much_of_it_is_there(survey):
    """Three of four pings; a survey that is whole reports nothing."""
    part = survey.copy(deep=True)
    part["pressure"][2] = np.nan
    assert recording_levels(part).named().endswith("3 of 4 pings") and "of 4" not in recording_levels(survey).named()
    assert "3 of 4" not in recording_levels(part).named(ping=1)


def test_an_unknown_gain_is_refused_with_the_nearest(tmp_path, capsys):
    """Before anything is read."""
    assert main(["show", "none.zarr", "-o", str(tmp_path / "a.png"), "--gain", "tvg"]) == 2
    assert "--gain tvg: there is no such choice. Did you mean tvg" in capsys.readouterr().err
    assert main(["show", "none.zarr", "-o", str(tmp_path / "a.png"), "--ping", "1", "--ground"]) == 2
    assert "make an image of many pings" in capsys.readouterr().err
