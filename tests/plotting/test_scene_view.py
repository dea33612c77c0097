"""The picture of a scenario shows where the sonar looks, what it passes, and the bed on which all of that lies."""

import numpy as np
import pytest

from insonify.plotting import scene_view, style
from insonify.plotting.scene_view import section
from insonify.plotting.seabed_map import draw_seabed_map, frame, middle_bearing, swaths
from insonify.scenario.scenario import Scenario
from insonify.sonar.track import true_poses
from oracles.scenes import nominal, point

SPEED = 1500.0


def sidescan(**changes):
    """A ship heading north-east, both sides, 6 m above a level bed; a box 20 m to starboard of its track."""
    ahead, aside = np.array([1, 1]) / np.sqrt(2), np.array([-1, 1]) / np.sqrt(2)
    box = {"shape": "box", "label": "crate", "position": tuple(8 * ahead + 20 * aside), "size": (2.0, 2.0, 1.0)}
    array = {"kind": "planar", "width": 0.5, "height": 0.02}
    return Scenario.model_validate({
        "targets": [box, point(*(4 * ahead - 15 * aside), 9.0)], "seabed": {"depth": 12.0},
        "sonar": {"source_level_db": 220, "pulse": {"kind": "cw", "frequency": 100e3, "duration": 1e-4},
                  "transmit": array, "receive": array, "mounting": {"bearing": np.pi / 2, "tilt": 0.3},
                  "sides": ["port", "starboard"]},
        "track": {"kind": "line", "start": (0.0, 0.0, 6.0), "heading": np.pi / 4, "speed": 2.0, "pings": 9,
                  "interval": 1.0, "window": (0.01, 0.04)},
        **changes,
    })  # fmt: skip


def test_the_swath_lies_abeam_between_the_ground_ranges_of_the_window():
    """Strips from sqrt((c t / 2)^2 - H^2) to the same of the window's end, to either side of the course."""
    scenario = sidescan()
    track = true_poses(scenario.track, seed=scenario.seed)
    near, far = (np.sqrt((SPEED * t / 2) ** 2 - 36) for t in (0.01, 0.04))
    for side, ring in swaths(scenario, track):
        abeam = np.array([-1, 1]) / np.sqrt(2) * side
        across = ring @ abeam
        np.testing.assert_allclose(across[:9], near, atol=1e-6)
        np.testing.assert_allclose(across[9:], far, atol=1e-6)
        along = ring @ np.array([1, 1]) / np.sqrt(2)
        np.testing.assert_allclose(np.sort(along)[[0, -1]], [0, 16], atol=1e-6)


def test_one_ping_looks_into_a_sector():
    """A static sonar that looks east: a ring of points about that bearing, as wide as its beam at half power."""
    scenario = nominal(track={"window": (0.1, 0.2)})
    ((side, ring),) = swaths(scenario, true_poses(scenario.track))
    assert side == 0
    bearing = np.arctan2(ring[:, 1], ring[:, 0])
    assert bearing.mean() == pytest.approx(np.pi / 2, abs=1e-6)
    # two equal lines of 100 wavelengths: half power where sinc^4 is 1/2
    assert np.ptp(bearing) == pytest.approx(2 * 0.319 * 0.015 / 1.5, rel=0.02)


def test_the_map_takes_in_swath_track_and_targets():
    """Every outline lies inside of the frame, which is no narrower than high."""
    scenario = sidescan()
    track = true_poses(scenario.track, seed=scenario.seed)
    low, high = frame(scenario)
    corners = np.concatenate([ring for _, ring in swaths(scenario, track)])
    assert (corners > low).all() and (corners < high).all()
    assert high[1] - low[1] >= high[0] - low[0]
    axes = style.new_figure().add_subplot()
    draw_seabed_map(axes, scenario, near=True)
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert {"port swath", "starboard swath", "track"} <= set(named)
    assert any("flat bed, 12 m deep" in text.get_text() for text in axes.texts)


def test_the_section_shows_targets_at_their_distance_from_the_track():
    """The crate stands 20 m to starboard from 11 to 12 m of depth; the point 15 m to port, 9 m deep."""
    axes = style.new_figure().add_subplot()
    section(axes, sidescan())
    (crate,) = (patch.get_path().get_extents() for patch in axes.patches)
    assert crate.height == pytest.approx(1.0) and (crate.x0 + crate.x1) / 2 == pytest.approx(20, abs=0.1)
    assert crate.y0 == pytest.approx(11.0)
    (mark,) = (line for line in axes.lines if line.get_marker() == "+")
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == pytest.approx((-15, 9), abs=0.1)
    low, high = axes.get_ylim()
    assert low > 12 and high < 0
    assert axes.get_xlabel().startswith("port  |  starboard") and axes.get_ylabel() == "depth [m]"


def test_layered_water_is_stated():
    """The beam is drawn straight, and the title reports it where sound does not go straight."""
    axes = style.new_figure().add_subplot()
    section(axes, sidescan(water={"profile": [[0.0, 1500.0], [12.0, 1480.0]]}))
    assert "without refraction" in axes.get_title()
    assert middle_bearing(sidescan().sonar.side_sonars[1], true_poses(sidescan().track), 0) == pytest.approx(
        3 * np.pi / 4
    )


def test_the_picture_is_written_for_relief_with_solids(tmp_path):
    """Fractal ground with a leaning cylinder on it."""
    drum = {"shape": "cylinder", "label": "drum", "position": (5.0, 10.0), "diameter": 0.6, "length": 0.9, "pitch": 0.3}
    relief = {"kind": "power-law", "hurst": 0.8, "rms": 0.05}
    scenario = sidescan(targets=[drum], seabed={"depth": 12.0, "relief": relief})
    assert scene_view.scene(scenario, tmp_path / "scene.png").stat().st_size > 10_000
