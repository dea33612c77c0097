"""Claims about corners of a profile that gather rays."""

import numpy as np
import pytest

from insonify.ocean import SoundSpeedProfile
from insonify.ocean.profile_corners import MAX_CORNERS, profile_corners


def found(depth, speed, source, farthest=300.0):
    """Depths of the corners that are reported."""
    return [kink.depth for kink in profile_corners(SoundSpeedProfile(depth, speed), source, farthest)]


def test_a_thermocline_above_still_water_turns_rays_from_a_known_range_on():
    """Rays up from h below a gradient g turn at h cot a + c tan a / g from the source: nearest 2 sqrt(h c / g)."""
    (kink,) = profile_corners(SoundSpeedProfile([0, 8, 20], [1550, 1490, 1490]), 11.0, 300.0)
    assert kink.depth == 8.0 and kink.gradient_jump == pytest.approx(7.5)
    assert kink.caustic_range == pytest.approx(2 * np.sqrt(3 * 1490 / 7.5), rel=1e-3)
    assert found([0, 8, 20], [1550, 1490, 1490], 11.0, farthest=40.0) == []


def test_a_gradient_that_bends_rays_back_faster_gathers_them_and_one_that_lets_go_does_not():
    """Range has a maximum at the corner only where the ray beyond turns sooner."""
    assert found([0, 5, 20], [1520, 1505, 1490], 11.0) == [5.0]
    assert found([0, 5, 20], [1495, 1505, 1490], 11.0) == []
    assert found([0, 5, 20], [1506, 1505, 1490], 11.0) == []


def test_both_sides_of_the_source_are_searched():
    """A channel turns rays above and below."""
    assert found([0, 5, 15, 20], [1510, 1500, 1500, 1510], 10.0) == [5.0, 15.0]


def test_a_corner_in_slower_water_is_never_grazed():
    """The paper's summer thermocline, received from inside it: above it rays get free, below they steepen."""
    assert found([0, 8, 14, 20], [1510, 1510, 1490, 1490], 11.0) == []


def test_rounding_takes_the_corner_away():
    """What remains are steps below the threshold."""
    sharp = SoundSpeedProfile([0, 5, 20], [1520, 1505, 1490])
    assert list(profile_corners(sharp.smoothed(1.0), 11.0, 300.0)) == []


def test_weak_corners_pass():
    """Half a metre per second per metre more is what any cast has."""
    assert found([0, 5, 20], [1507.4, 1505, 1505], 11.0) == []


def test_of_a_rough_cast_the_sharpest_corners_are_reported():
    """Ten thousand rows with noise have thousands of corners: the sharpest are enough, nearest first."""
    depth = np.linspace(0, 20, 2001)
    speed = 1500 - 10 * np.tanh((depth - 9) / 2) + 0.005 * np.random.default_rng(1).standard_normal(depth.size)
    corners = list(profile_corners(SoundSpeedProfile(depth, speed), 11.0, 300.0))
    assert 1 < len(corners) <= 2 * MAX_CORNERS
    above = [kink.depth for kink in corners if kink.depth < 11]
    assert above == sorted(above, reverse=True)


def test_knots_that_only_the_last_bits_part_divide_by_nothing():
    """Seen from a source, two depths closer than rounding are one."""
    assert list(profile_corners(SoundSpeedProfile([0, 1e-300, 20], [1500, 1400, 1490]), 11.0, 300.0)) == []
