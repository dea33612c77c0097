"""Claims about the picture of a forward-looking sonar: the fan where its echoes are, and cuts beside the pattern."""

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

from insonify.plotting.recording_levels import RecordingLevels
from insonify.plotting.sector_view import AROUND, BeamCut, sector_view
from insonify.plotting.target_view import TargetView

STEER = np.radians(np.linspace(-30, 30, 61))
TIME = np.linspace(0.010, 0.030, 201)
SLANT = TIME * 1500 / 2


def fan():
    """Sixty-one beams of one ping, even but for a bright cell 10 degrees to starboard and 15 m away."""
    level = np.full((1, len(STEER), len(TIME)), 60.0)
    level[0, 40, 100] = 110.0
    return RecordingLevels(level, TIME, STEER, None, "fan")


def cut():
    """A cut through that cell: the beam is 4 degrees wide, the echo 0.4 m long."""
    over = -3 * (np.degrees(STEER) - 10) ** 2 / 4
    return BeamCut("sphere", STEER, over, over - 0.5, SLANT, -75 * (SLANT - 15.0) ** 2, 40, 100)


def lined(figure, label):
    """The axes with such a label below them."""
    (found,) = [axes for axes in figure.findobj(lambda a: hasattr(a, "get_xlabel")) if axes.get_xlabel() == label]
    return found


def test_the_brightest_of_the_fan_is_to_the_right_and_ahead():
    """15 m away and 10 degrees to starboard: 2.6 m to the right, 14.8 m ahead; starboard is right of the page."""
    (mesh,) = sector_view(fan(), [], [], "fan").findobj(QuadMesh)[:1]
    corners, values = mesh.get_coordinates(), np.asarray(mesh.get_array())
    row, column = np.unravel_index(np.argmax(values), (len(corners) - 1, corners.shape[1] - 1))
    right, ahead = corners[row : row + 2, column : column + 2].mean(axis=(0, 1))
    assert right == pytest.approx(15 * np.sin(np.radians(10)), abs=0.1)
    assert ahead == pytest.approx(15 * np.cos(np.radians(10)), abs=0.1)


def test_cuts_are_drawn_beside_the_pattern_of_the_array():
    """Over bearing in degrees, both curves; the pattern half a decibel lower, as it was given."""
    figure = sector_view(fan(), [], [cut()], "fan")
    expected, received = lined(figure, "bearing [deg]").lines
    np.testing.assert_allclose(received.get_xdata(), np.degrees(STEER))
    np.testing.assert_allclose(received.get_ydata() - expected.get_ydata(), 0.5)
    assert received.get_xdata()[np.argmax(received.get_ydata())] == pytest.approx(10)


def test_a_cut_over_range_shows_the_point_and_little_else():
    """No sample is further from the point's than the stated distance; the peak is among them."""
    (line,) = lined(sector_view(fan(), [], [cut()], "fan"), "slant range [m]").lines
    x, y = line.get_data()
    assert np.abs(x - 15).max() < AROUND and x[np.argmax(y)] == pytest.approx(15)


def test_without_a_point_there_are_no_cuts():
    """The fan has the page to itself, and a narrower one."""
    alone, both = sector_view(fan(), [], [], "fan"), sector_view(fan(), [], [cut()], "fan")
    assert len(both.axes) - len(alone.axes) == 2 and alone.get_figwidth() < both.get_figwidth()


def test_targets_ahead_are_named():
    """By their label; one out of the sector or out of range is not."""
    seen = [
        TargetView("sphere", 15.0, np.radians(10), 0.3, 14.7),
        TargetView("astern", 15.0, np.radians(170), 0.3, 14.7),
        TargetView("far", 300.0, 0.0, 0.3, 299.7),
    ]
    words = [text.get_text() for axes in sector_view(fan(), seen, [], "fan").axes for text in axes.texts]
    assert "sphere" in words and "far" not in words and "astern" not in words
