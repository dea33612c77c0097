"""Claims about profiles whose corners are rounded."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import SoundSpeedProfile
from insonify.ocean.profile_smoothing import STEP
from oracles.few_of import few_of

SUMMER = SoundSpeedProfile([0.0, 8.0, 14.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0])
lengths = st.floats(1e-3, 50)


@st.composite
def profiles(draw):
    """Casts of 2 to 8 knots, a millimetre to ten metres apart."""
    gaps = draw(st.lists(st.floats(1e-3, 10), min_size=1, max_size=7))
    speeds = draw(st.lists(st.floats(1400, 1600), min_size=len(gaps) + 1, max_size=len(gaps) + 1))
    return SoundSpeedProfile(np.concatenate([[0], np.cumsum(gaps)]), speeds)


@given(profiles(), lengths)
def test_rounding_keeps_the_ends_and_stays_within_the_speeds_that_were_there(profile, length):
    """Nothing faster or slower appears, the surface and the bed keep their speed, depths still increase."""
    smooth = profile.smoothed(length)
    assert smooth.speed.min() >= profile.speed.min() - 1e-9 and smooth.speed.max() <= profile.speed.max() + 1e-9
    for end in (0, -1):
        assert (smooth.depth[end], smooth.speed[end]) == (profile.depth[end], profile.speed[end])


@given(lengths)
def test_far_from_every_corner_nothing_changes(length):
    """Beyond half of the length from a knot the speed is the old one, to the last figures."""
    z = np.linspace(0, 20, 401)
    far = np.abs(z[:, None] - SUMMER.depth[1:-1]).min(axis=1) >= length / 2
    np.testing.assert_allclose(SUMMER.smoothed(length).at(z[far]), SUMMER.at(z[far]), rtol=0, atol=1e-9)


@pytest.mark.parametrize("length", [0.2, 1.0, 3.0])
def test_a_rounded_corner_is_the_parabola_of_its_docstring(length):
    """It lies jump length / 8 from the corner, and adds jump length^2 / 24 to the integral of speed."""
    profile = SoundSpeedProfile([0.0, 8.0, 14.0], [1510.0, 1510.0, 1490.0])
    smooth, jump = profile.smoothed(length), -20 / 6
    assert smooth.at(8.0) - profile.at(8.0) == pytest.approx(jump * length / 8, rel=1e-3)
    # straight pieces over a parabola are 1 / pieces^2 of it too large, half a percent for 14 pieces
    added = np.trapezoid(smooth.speed, smooth.depth) - np.trapezoid(profile.speed, profile.depth)
    assert added == pytest.approx(jump * length**2 / 24, rel=0.02)


def test_the_gradient_goes_over_in_small_steps():
    """Where it jumped by 3.3 1/s it now takes steps of a quarter."""
    smooth = SUMMER.smoothed(1.0)
    slopes = np.diff(smooth.speed) / np.diff(smooth.depth)
    assert np.abs(np.diff(slopes)).max() < STEP + 1e-9
    assert np.diff(smooth.depth)[1:-1].min() < 0.1 and smooth.depth.size == 32


def test_layers_that_only_fell_still_only_fall():
    """Rounding makes no channel for sound that was not there."""
    fall = SoundSpeedProfile([0.0, 3.0, 4.0, 9.0, 20.0], [1520.0, 1518.0, 1500.0, 1495.0, 1494.0])
    for length in (0.5, 5.0, 40.0):
        assert np.all(np.diff(fall.smoothed(length).speed) <= 0)


def test_a_straight_line_has_no_corner():
    """Two knots, or three on one line, are what they were."""
    line = SoundSpeedProfile([0.0, 10.0, 30.0], [1500.0, 1505.0, 1515.0])
    assert line.smoothed(2.0) == line
    two = SoundSpeedProfile([0.0, 30.0], [1500.0, 1515.0])
    assert two.smoothed(2.0) == two


@pytest.mark.parametrize("length", [0, -1, np.nan, np.inf, 1e6, "1 m", None])
def test_an_impossible_length_is_refused(length):
    """With what to give instead."""
    with pytest.raises(ValueError, match=r"smoothing is .*above 0, to 1000, such as 1"):
        SUMMER.smoothed(length)


def test_corners_that_stand_close_are_rounded_together():
    """Rows a tenth of a metre apart, rounded over one: every depth has the mean of the metre about it."""
    depth = np.linspace(0, 20, 201)
    cast = SoundSpeedProfile(depth, 1500 - 10 * np.tanh((depth - 9) / 2) + 0.05 * (-1.0) ** np.arange(201))
    smooth = cast.smoothed(1.0)
    for z in (0.3, 7.03, 9.55, 19.9):
        half = min(0.5, z, 20 - z)
        fine = np.linspace(z - half, z + half, 20001)
        mean = np.trapezoid(cast.at(fine), fine) / (2 * half)
        assert smooth.at(z) == pytest.approx(mean, abs=5e-3)  # straight pieces between means
    assert np.abs(np.diff(cast.gradient(depth))).max() > 1.9
    assert np.abs(np.diff(np.diff(smooth.speed) / np.diff(smooth.depth)))[1:-1].max() < 2 * STEP
    assert smooth.depth.size < 700


@few_of((0, 1), "rows", [50, 1000, 10_000])
def test_many_rows_make_no_layer_of_nothing(rows):
    """Where roundings touch, no layer a few last bits thick is left, whose gradient would be noise."""
    depth = np.linspace(0, 20, rows)
    for length in (1.0, 0.4, 20 / (rows - 1), 1e-3):
        smooth = SoundSpeedProfile(depth, 1500 - 10 * np.tanh((depth - 9) / 2)).smoothed(length)
        assert np.diff(smooth.depth).min() > 1e-6
        assert np.abs(np.diff(smooth.speed) / np.diff(smooth.depth)).max() < 5.01


def test_a_lone_corner_and_crowded_ones_are_rounded_alike():
    """Where a corner of nothing stands beside it, the parabola is the same."""
    lone = SoundSpeedProfile([0.0, 8.0, 20.0], [1510.0, 1510.0, 1490.0]).smoothed(2.0)
    crowded = SoundSpeedProfile([0.0, 7.7, 8.0, 20.0], [1510.0, 1510.0, 1510.0, 1490.0]).smoothed(2.0)
    z = np.linspace(0, 20, 2001)
    np.testing.assert_allclose(crowded.at(z), lone.at(z), rtol=0, atol=1e-2)  # pieces begin elsewhere
