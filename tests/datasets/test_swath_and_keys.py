"""Keys of a scenario in brackets, and positions that are uniform over the swath."""

import numpy as np
import pytest
from scipy import stats

from datasets.small_dataset import write_small
from insonify.datasets.distributions import SwathArea
from insonify.datasets.drawn_scene import uniforms
from insonify.datasets.swath import PlacementError, free_position, swath_of
from insonify.datasets.varied_keys import UnknownItemError, varied_keys
from insonify.scenario.load import load_scenario


@pytest.fixture
def scenario(tmp_path):
    """A sidescan sonar 6 m above the seabed that runs north, with two targets."""
    write_small(tmp_path)
    base = load_scenario(tmp_path / "scene.yaml")
    second = {"shape": "box", "label": "crate", "position": [1, 9], "size": [1, 1, 1]}
    return base.with_("targets", [*base.targets, second])


@pytest.mark.parametrize(
    ("key", "paths"),
    [
        ("surface.wind_speed", ["surface.wind_speed"]),
        ("targets[crate].heading", ["targets.1.heading"]),
        ("targets[0].heading", ["targets.0.heading"]),
        ("targets.0.heading", ["targets.0.heading"]),
        ("targets[*].burial", ["targets.0.burial", "targets.1.burial"]),
        ("seabed.relief[0].rms", ["seabed.relief.0.rms"]),
        ("track.start[2]", ["track.start.2"]),
    ],
)
def test_keys_become_paths(scenario, key, paths):
    """A label, a number or all items select from a list; the rest is the path of `Scenario.with_`."""
    assert [one.path for one in varied_keys(scenario, key)] == paths
    assert len({one.key for one in varied_keys(scenario, key)}) == len(paths)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("targets[crat].heading", "did you mean 'crate'"),
        ("targets[7].heading", "there are 2 items"),
        ("surface[0].wind_speed", "there is none"),
        ("targets[crate.heading", "is no key"),
        ("targets[zzz].heading", "labels are pipe, crate"),
    ],
)
def test_items_that_are_not_there_are_named(scenario, key, message):
    """The nearest label, or what there is."""
    with pytest.raises(UnknownItemError, match=message.replace("[", r"\[")):
        varied_keys(scenario, key)


def test_positions_are_uniform_over_the_swath(scenario):
    """Along and across a straight track by Kolmogorov-Smirnov at 0.1 %, 2000 positions, all to starboard and seen."""
    area = SwathArea(across=(7, 14), along=(0.25, 0.75))
    swath = swath_of(scenario, area)
    points = np.array([swath.point_at(u, area.along) for u in uniforms(7, "position", np.arange(2000))])
    length = 2.0 * 0.2 * 11
    assert stats.kstest(points[:, 0], stats.uniform(0.25 * length, 0.5 * length).cdf).pvalue > 1e-3
    assert stats.kstest(points[:, 1], stats.uniform(7, 7).cdf).pvalue > 1e-3


def test_default_positions_are_recorded(scenario):
    """Slant ranges of all positions lie within the window, as does the shadow behind them."""
    area = SwathArea()
    swath = swath_of(scenario, area)
    points = np.array([swath.point_at(u, area.along) for u in uniforms(7, "position", np.arange(500))])
    slant = np.hypot(points[:, 1], 6.0)
    start, stop = (750 * time for time in scenario.track.window)
    assert slant.min() > start and slant.max() < stop
    assert points[:, 0].min() > 0 and points[:, 0].max() < 4.6


def test_both_sides_and_one(scenario):
    """A sonar with sides has positions on both, alike; one side has its own only."""
    two = scenario.with_("sonar.sides", ["port", "starboard"])
    for side, share in (("both", 0.5), ("port", 1.0), ("starboard", 0.0)):
        area = SwathArea(side=side)
        swath = swath_of(two, area)
        port = np.mean([swath.point_at(u, area.along)[1] < 0 for u in uniforms(7, "position", np.arange(1000))])
        assert port == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / 1000))
    with pytest.raises(PlacementError, match="no port side"):
        swath_of(scenario.with_("sonar.sides", ["starboard"]), SwathArea(side="port"))


def test_a_fan_of_beams_has_a_sector(scenario):
    """Positions ahead of a forward-looking sonar lie within its sector, uniform over its area: in range squared."""
    changes = {"sonar.mounting.bearing": "0 deg", "sonar.receive.steer": [-0.5, 0.0, 0.5]}
    area = SwathArea(along=(0, 0))
    swath = swath_of(scenario.with_(changes), area)
    points = np.array([swath.point_at(u, area.along) for u in uniforms(7, "position", np.arange(2000))])
    bearing, distance = np.arctan2(points[:, 1], points[:, 0]), np.hypot(*points.T)
    assert stats.kstest(bearing, stats.uniform(-0.5, 1.0).cdf).pvalue > 1e-3
    squares = stats.uniform(swath.near**2, swath.far**2 - swath.near**2)
    assert stats.kstest(distance**2, squares.cdf).pvalue > 1e-3


def test_places_are_apart(scenario):
    """Positions keep their distance to all that are taken, or are refused with the remedy."""
    area = SwathArea(apart=1.5)
    swath, taken = swath_of(scenario, area), []
    for number in range(4):
        taken.append(free_position(swath, area, uniforms(7, f"thing {number}", 0, np.arange(200)), taken))
    apart = np.linalg.norm(np.array(taken)[:, None] - np.array(taken), axis=-1) + 10 * np.eye(4)
    assert apart.min() >= 1.5
    with pytest.raises(PlacementError, match="fewer targets"):
        free_position(swath, SwathArea(apart=900), uniforms(7, "thing", 0, np.arange(5)), taken)
