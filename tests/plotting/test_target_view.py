"""Targets in pictures: their positions, the times of their echoes, and the strongest of them."""

import numpy as np
import pytest

from insonify.plotting.target_view import (
    echo_window,
    half_extent,
    middle,
    nearest_in_plane,
    strongest_target,
    targets_in_view,
)
from insonify.simulator import arrivals
from oracles.scenes import nominal, point

SPEED = 1500.0
PLACE = {"position": (3.0, 150.0)}


def sphere(**changes):
    """A ball on the bed, as the scenario describes it."""
    return {"shape": "sphere", "diameter": 1.0, **PLACE, **changes}


@pytest.mark.parametrize(
    ("target", "where"),
    [
        (point(3.0, 150.0, 12.0), (3.0, 150.0, 12.0)),
        ({"shape": "box", "size": (2, 1, 1), **PLACE}, (3.0, 150.0, 19.5)),
        ({"shape": "box", "size": (2, 1, 1), "base_depth": 15.0, **PLACE}, (3.0, 150.0, 14.5)),
        (sphere(), (3.0, 150.0, 19.5)),
        (sphere(base_depth=12.0), (3.0, 150.0, 11.5)),
        ({"shape": "cylinder", "length": 2.0, "diameter": 0.5, **PLACE}, (3.0, 150.0, 19.75)),
    ],
)
def test_the_middle_of_a_target_is_where_it_was_put(target, where):
    """North and east as written; depth half its height above its base."""
    scenario = nominal(targets=[target])
    np.testing.assert_allclose(middle(scenario.targets[0], scenario.scene), where, atol=1e-6)


@pytest.mark.parametrize(
    ("target", "half"),
    [
        (point(0, 150, 12.0), 0.0),
        ({"shape": "box", "size": (4, 3, 1), **PLACE}, 2.5),
        ({"shape": "box", "size": (4, 3, 1), "heading": 1.0, **PLACE}, 2.5),
        ({"shape": "plate", "length": 4, "width": 3, "thickness": 0.1, **PLACE}, 2.5),
    ],
)
def test_half_a_diagonal(target, half):
    """Pythagoras on the plan; a heading turns it and does not stretch it."""
    scenario = nominal(targets=[target])
    assert half_extent(scenario.targets[0], scenario.scene) == pytest.approx(half, rel=1e-9)


@pytest.mark.parametrize("families", [["D"], ["D", "S"], ["D", "S", "B", "SB", "BS"]])
def test_the_echo_window_holds_every_arrival_of_the_target(families):
    """First and last echo over all families followed, and nothing much more."""
    scenario = nominal(
        targets=[{"shape": "box", "size": (2, 1, 1), **PLACE}],
        paths={"families": families, "contributions": ["target"]}, track={"window": (0.19, 0.23)},
    )  # fmt: skip
    first, last = echo_window(scenario, 0, scenario.targets[0])
    delay = arrivals(scenario).delay
    pulse = scenario.sonar.pulse.duration
    assert first <= delay.min() and delay.max() + pulse <= last + 1e-9
    # A window may be longer by the box's own length, there and back, at each end.
    spare = 2 * (2 * half_extent(scenario.targets[0], scenario.scene) + 1.0) / SPEED
    assert (last - first) - (np.ptp(delay) + pulse) < spare


def test_a_point_is_received_at_twice_its_leg():
    """Slant range 150.24 m there and back, 200.32 ms: less and more by the pulse and the receiver's ringing."""
    scenario = nominal(targets=[point(0, 150, 19.5)], paths={"families": ["D"], "contributions": ["target"]})
    first, last = echo_window(scenario, 0, scenario.targets[0])
    arrived, pulse = 2 * np.hypot(150, 8.5) / SPEED, scenario.sonar.pulse.duration
    assert arrived - 1e-3 < first <= arrived and arrived + pulse <= last < arrived + pulse + 1e-3


def test_the_strongest_target_is_the_one_with_the_greatest_strength():
    """Two points beside each other: 20 dB decide."""
    pair = [point(0, 150, 19.5, label="weak"), point(0, 149, 19.5, strength=20, label="strong")]
    for targets, row in ((pair, 1), (pair[::-1], 0)):
        scenario = nominal(targets=targets, track={"window": (0.19, 0.21)})
        assert strongest_target(scenario, 0, [0]) == (row, 0)


def test_the_strongest_target_is_the_one_in_the_beam():
    """The same point ahead and off the beam: the beam decides, and so does the channel."""
    scenario = nominal(
        targets=[point(-20, 150, 19.5, label="left"), point(0, 150, 19.5, label="ahead")],
        receive={"steer": (0.0, float(np.arctan2(20, 150)))}, track={"window": (0.19, 0.21)},
    )  # fmt: skip
    row, channel = strongest_target(scenario, 0, [0, 1])
    assert (scenario.targets[row].label, channel) == ("ahead", 0)


def test_a_target_outside_the_window_is_not_the_strongest():
    """What arrives later than the recording is not received."""
    assert strongest_target(nominal(targets=[point(0, 190, 19.5)], track={"window": (0.0, 0.1)}), 0, [0]) is None


def test_bearings_are_counted_to_the_right_of_boresight():
    """The sonar looks east: what lies further south is to its right, what lies west is behind it."""
    scenario = nominal(
        targets=[point(-10, 150, 19.5, label="right"), point(10, 150, 19.5, label="left"), point(0, -5, 12, label="x")]
    )
    right, left, behind = targets_in_view(scenario, 0)
    assert right.bearing == pytest.approx(-left.bearing) and right.bearing > 0
    assert np.isnan(behind.bearing)
    assert right.slant == pytest.approx(np.linalg.norm([10, 150, 8.5]))


@pytest.mark.parametrize(
    ("target", "near"),
    [
        ({"shape": "box", "size": (16, 1, 1)}, np.hypot(31.5, 8)),
        ({"shape": "box", "size": (16, 1, 1), "heading": np.pi / 2}, np.hypot(24, 8)),
        ({"shape": "box", "size": (16, 1, 1), "heading": np.pi / 4}, np.hypot(32 - np.sqrt(0.5), 8)),
        ({"shape": "box", "size": (16, 90, 1)}, 8.0),
        ({"shape": "sphere", "diameter": 1.0}, np.hypot(32, 8.5) - 0.5),
        ({"shape": "cylinder", "length": 16.0, "diameter": 1.0}, np.hypot(32, 8.5) - 0.5),
        (point(0.0, 32.0, 19.5), np.hypot(32, 8.5)),
    ],
)
def test_the_near_side_is_that_at_the_bearing_of_the_middle(target, near):
    """32 m east of a sonar 9 m above the bed: Pythagoras to the nearest edge in the vertical plane of the bearing.

    Long bodies broadside, end-on, oblique and below the sonar; the radius nearer than the axis of a round one.
    """
    scenario = nominal(targets=[{"position": (0.0, 32.0), **target}], track={"window": (0.03, 0.06)})
    (view,) = targets_in_view(scenario, 0)
    assert view.near_side == pytest.approx(near, abs=1e-3)  # circles are polygons: 0.05 % of the radius


def test_a_surface_beside_the_plane_has_its_nearest_corner():
    """A concave body's middle may lie beside it: a triangle 3 to 5 m from the plane, its nearest corner 5 m away."""
    corners = np.array([[[4.0, 3.0, 0.0], [9.0, 3.0, 0.0], [9.0, 5.0, 0.0]]])
    assert nearest_in_plane(corners, np.array([0.0, 1.0, 0.0])) == pytest.approx(5.0)
    assert nearest_in_plane(corners - [0, 4, 0], np.array([0.0, 1.0, 0.0])) == pytest.approx(6.5)
