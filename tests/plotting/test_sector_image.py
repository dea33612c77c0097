"""Sector images: the side that points down, bearings outside the edge, and names on the near side of echoes."""

import numpy as np
import pytest
from matplotlib.text import Text

import insonify
from insonify.plotting import labels, style
from insonify.plotting.recording_levels import RecordingLevels
from insonify.plotting.sector_image import looks_down, name_targets, sector, sector_image, write_title
from insonify.plotting.target_view import TargetView
from oracles.scenes import nominal, point

SLANT = np.linspace(5.0, 40.0, 71)
STEER = np.radians(np.linspace(-60, 60, 25))


def drawn(down, seen=()):
    """Axes of an even sector with names of targets."""
    with style.plot_style():
        figure = style.new_figure(9, 7)
        axes = figure.subplots()
        sector(axes, SLANT, STEER, np.zeros((25, 71)), (-1.0, 0.0), down=down)
        name_targets(axes, list(seen), SLANT, STEER)
        figure.draw_without_rendering()
    return axes


def on_page(axes, text: Text):
    """Middle of a text in the coordinates of the axes [m]."""
    box = text.get_window_extent()
    return axes.transData.inverted().transform(((box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2))


def looking(tilt_deg, target=None):
    """Levels of seven even beams of a sonar at a depth of 11 m whose mounting is tilted."""
    steer = np.radians(np.linspace(-30, 30, 7))
    scenario = nominal(
        targets=[] if target is None else [target], receive={"steer": tuple(steer)},
        sonar={"mounting": {"bearing": 0.0, "tilt": np.radians(tilt_deg)}}, track={"window": (0.004, 0.03)},
    )  # fmt: skip
    time = np.linspace(0.004, 0.03, 90)
    return RecordingLevels(np.zeros((1, 7, 90)), time, steer, scenario, "fan")


@pytest.mark.parametrize("down", [False, True])
def test_bearings_are_beyond_the_outer_edge_at_their_angles(down):
    """The middle of each label is on the ray of its bearing, outside the last range, and upright along the edge."""
    axes = drawn(down)
    texts = [text for text in axes.texts if text.get_text().endswith("°")]
    assert [text.get_text() for text in texts] == ["-30°", "0°", "+30°"]
    for text in texts:
        right, along = on_page(axes, text)
        angle = float(text.get_text()[:-1])
        assert np.degrees(np.arctan2(right, along)) == pytest.approx(angle, abs=0.5)
        assert SLANT[-1] < np.hypot(right, along) < 1.07 * SLANT[-1]
        assert (text.get_rotation() + 180) % 360 - 180 == pytest.approx(angle if down else -angle)


@pytest.mark.parametrize("down", [False, True])
def test_bearings_are_clear_of_the_numbers_and_the_title(down):
    """No label of a bearing overlaps a number of the axis or the title, whichever side it is on."""
    axes = drawn(down)
    with style.plot_style():
        write_title(axes, "a title over the sector")
        axes.figure.draw_without_rendering()
    bearings = [text.get_window_extent() for text in axes.texts]
    others = [text.get_window_extent() for text in (*axes.get_xticklabels(), *axes.get_yticklabels(), axes.title)]
    assert not any(box.overlaps(other) for box in bearings for other in others)


@pytest.mark.parametrize("down", [False, True])
def test_a_name_is_nearer_to_the_sonar_than_its_target(down):
    """The text ends a few points before the near side, on the page towards the sonar."""
    axes = drawn(down, [TargetView("pipe", 32.0, 0.0, 8.0, 31.5)])
    (name,) = [text for text in axes.texts if text.get_text() == "pipe"]
    box = name.get_window_extent()
    nearest, farthest = sorted(axes.transData.inverted().transform([(box.x0, box.y0), (box.x0, box.y1)])[:, 1])
    assert 29.5 < nearest < farthest < 31.5


def test_a_name_stays_in_the_sector():
    """A target that reaches from below the sonar into the sector has its name where the sector begins."""
    axes = drawn(False, [TargetView("quay", 20.0, 0.2, 30.0, 1.0)])
    (name,) = [text for text in axes.texts if text.get_text() == "quay"]
    assert name.xy == pytest.approx((5 * np.sin(0.2), 5 * np.cos(0.2)))


@pytest.mark.parametrize(("tilt", "down"), [(-90, False), (0, False), (45, False), (46, True), (90, True)])
def test_a_boresight_more_down_than_ahead_points_down_the_page(tilt, down):
    """Above a tilt of 45 degrees range increases down the page, and the axis states it; starboard stays right."""
    sound = looking(tilt)
    assert looks_down(sound.scenario) is down
    axes = sector_image(sound, 0).axes[0]
    assert axes.yaxis_inverted() == down and not axes.xaxis_inverted()
    assert axes.get_ylabel() == ("below the sonar, along boresight [m]" if down else "along boresight [m]")


def test_without_a_scenario_boresight_points_up():
    """Nothing is known of the mounting."""
    assert not looks_down(None)


@pytest.mark.parametrize("tilt", [10, 90])
def test_everything_written_is_on_the_page(tilt):
    """Title, numbers, bearings and names of axes end within the figure."""
    with style.plot_style():
        figure = sector_image(looking(tilt, point(1.0, 3.0, 19.0, label="buoy")), 0)
        figure.draw_without_rendering()
    written, page = figure.get_tightbbox(), figure.get_size_inches()
    assert np.all(written.min >= 0) and np.all(written.max <= page)


@pytest.mark.parametrize(("tilt", "down"), [(10, False), (90, True)])
def test_labels_of_a_fan_are_drawn_the_same_way_up(tilt, down, tmp_path, monkeypatch):
    """Levels and labels, beside or above each other: both as the sector image."""
    figures = []
    monkeypatch.setattr(style, "save_figure", lambda figure, path: figures.append(figure) or path)
    scenario = looking(tilt, point(1.0, 3.0, 19.0)).scenario.with_("paths.contributions", ["target"])
    masks = insonify.labels(scenario)
    labels(insonify.simulate(scenario), masks, tmp_path / "labels.png")
    left, right = figures[0].axes[:2]
    assert left.yaxis_inverted() == right.yaxis_inverted() == down
    assert left.get_ylabel() == right.get_ylabel()
