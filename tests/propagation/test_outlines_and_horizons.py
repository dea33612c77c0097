"""What stands in the way: outlines of solids as seen from afar, and horizons that only grow."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation.horizon import horizon
from insonify.propagation.sight import ground_in_sight
from insonify.propagation.silhouette import COLUMNS, outline
from insonify.scene import shapes

SEEDS = st.integers(0, 2**31)
RANGES = np.arange(1.0, 81.0)


def ball(radius, middle):
    """Triangles of a ball in the world."""
    return shapes.sphere(2 * radius).corners + np.asarray(middle, float)


@pytest.mark.parametrize(("radius", "away"), [(1.0, 20.0), (0.5, 4.0), (2.0, 7.0)])
def test_a_ball_is_as_wide_as_its_tangents(radius, away):
    """Half its angle is asin(radius / distance), and so is that of its top above the level of its middle."""
    seen = outline(ball(radius, (away, 0.0, 10.0)), (0.0, 0.0, 10.0))
    half = np.arcsin(radius / away)
    assert seen.facing == pytest.approx(0.0, abs=1e-3)
    assert (seen.borders[-1] - seen.borders[0]) / 2 == pytest.approx(half, rel=5e-3)
    rises = np.arctan2(10.0 - seen.columns[:, 1], seen.columns[:, 0])
    assert rises.max() == pytest.approx(half, rel=5e-3)
    falls = np.arctan2(seen.columns[:, 3] - 10.0, seen.columns[:, 2])
    np.testing.assert_allclose(falls, rises, atol=0.01 * half)
    # the tangent cone is round: tan^2 of the rise is what the bearing leaves of it
    bearing = (seen.borders[1:] + seen.borders[:-1]) / 2
    inside = np.abs(bearing) < 0.9 * half
    expected = np.arcsin(np.sqrt(np.maximum(1 - (np.cos(half) / np.cos(bearing)) ** 2, 0)))
    np.testing.assert_allclose(rises[inside], expected[inside], rtol=0.03)


def test_an_upright_block_has_one_height():
    """Seen from above its top along its axis: the far upper edge, the near lower edge, and its faces' distances."""
    block = shapes.block(2.0, 1.0, 0.5).corners
    low = block.reshape(-1, 3).min(axis=0)
    moved = block - low + np.array([30.0, -0.5, 19.5])
    extent = moved.reshape(-1, 3).max(axis=0) - moved.reshape(-1, 3).min(axis=0)
    seen = outline(moved, (0.0, 0.0, 5.0))
    middle = COLUMNS // 2
    top_away, top, base_away, base, near, far = seen.columns[middle]
    assert (near, far) == (pytest.approx(30.0, abs=1e-2), pytest.approx(30.0 + extent[0], abs=1e-2))
    assert (top, base) == (pytest.approx(19.5), pytest.approx(19.5 + extent[2]))
    assert (top_away, base_away) == (pytest.approx(far, abs=1e-9), pytest.approx(near, abs=1e-9))


@settings(max_examples=20)
@given(SEEDS, st.floats(-3, 3), st.floats(0.2, 5))
def test_an_outline_turns_and_grows_with_the_world(seed, turn, size):
    """Turned about the place it faces elsewhere, grown it is farther and taller; its borders stay."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (12, 3, 3)) + np.array([9.0, 0.0, 0.0])
    c, s = np.cos(turn), np.sin(turn)
    here = outline(corners, (0.0, 0.0, 0.0))
    there = outline(size * corners @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T, (0.0, 0.0, 0.0))
    assert np.angle(np.exp(1j * (there.facing - here.facing - turn))) == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(there.borders, here.borders, atol=1e-12)
    np.testing.assert_allclose(there.columns[1:-1], size * here.columns[1:-1], rtol=1e-6, atol=1e-9)


@settings(max_examples=10)
@given(SEEDS)
def test_top_and_base_bound_what_a_column_holds(seed):
    """The highest top and the lowest base are those of the solid's corners, as seen from the place."""
    rng = np.random.default_rng(seed)
    corners = ball(1.0, (rng.uniform(5, 15), rng.uniform(-2, 2), rng.uniform(-3, 3)))
    seen = outline(corners, (0.0, 0.0, 0.0))
    top, base = seen.columns[:, 1] / seen.columns[:, 0], seen.columns[:, 3] / seen.columns[:, 2]
    assert np.all(top <= base + 1e-12) and np.all(seen.columns[:, 4] <= seen.columns[:, 5])
    steep = (corners[..., 2] / np.hypot(corners[..., 0], corners[..., 1])).ravel()
    # an edge is nearer in its middle than at its corners: by 1e-4 of the way at most, on triangles as small as these
    assert steep.min() <= top.min() + 1e-4 and steep.max() >= base.max() - 1e-4
    assert top.min() == pytest.approx(steep.min(), abs=4e-3) and base.max() == pytest.approx(steep.max(), abs=4e-3)
    assert np.all(np.diff(seen.borders) > 0)


def test_what_stands_around_the_place_has_no_outline():
    """From within, and from a place beside part of it, there is no one side to look at."""
    assert outline(ball(3.0, (0.0, 0.0, 10.0)), (0.0, 0.0, 10.0)) is None
    assert outline(ball(3.0, (2.9, 0.0, 10.0)), (0.0, 0.0, 10.0)) is None
    assert outline(ball(3.0, (3.1, 0.0, 10.0)), (0.0, 0.0, 10.0)) is not None


def ground(seed):
    """Launch angles to rough ground seen from above [rad]."""
    return np.arctan2(10 + np.random.default_rng(seed).normal(0, 1.0, RANGES.size), RANGES)


@given(SEEDS)
def test_only_the_order_of_angles_counts(seed):
    """Angle, sine, tangent or rank: the same cells are seen and the same cells cut."""
    launch = ground(seed)
    first = horizon(RANGES, launch)
    for other in (np.sin(launch), np.tan(launch), np.argsort(np.argsort(launch)).astype(float), launch**3 + 7):
        again = horizon(RANGES, other)
        np.testing.assert_array_equal(again.visible, first.visible)
        np.testing.assert_array_equal(again.cutter, first.cutter)


@given(SEEDS, st.integers(0, 78), st.floats(0.01, 0.5))
def test_ground_that_is_raised_shows_nothing_new_behind_it(seed, cell, rise):
    """A cell lifted towards the sonar hides at least what it hid; before it nothing changes; itself is seen sooner."""
    launch = ground(seed)
    raised = launch.copy()
    raised[cell] -= rise
    before, after = horizon(RANGES, launch), horizon(RANGES, raised)
    np.testing.assert_array_equal(after.visible[:cell], before.visible[:cell])
    assert not np.any(after.visible[cell + 1 :] & ~before.visible[cell + 1 :])
    assert after.visible[cell] or not before.visible[cell]


@given(SEEDS)
def test_a_cutter_is_nearer_higher_and_itself_seen(seed):
    """What cuts a cell stands before it, is on the horizon, and is seen; what is hidden may be dug away unnoticed."""
    launch = ground(seed)
    seen = horizon(RANGES, launch)
    hidden = np.flatnonzero(~seen.visible)
    cutter = seen.cutter[hidden]
    assert np.all(cutter < hidden) and np.all(seen.visible[cutter]) and np.all(launch[cutter] < launch[hidden])
    dug = launch.copy()
    dug[hidden] += np.random.default_rng(seed).uniform(0, 1, hidden.size)
    np.testing.assert_array_equal(horizon(RANGES, dug).visible, seen.visible)
    dug[hidden] = np.nan
    np.testing.assert_array_equal(horizon(RANGES, dug).visible, seen.visible)


@given(SEEDS, st.integers(1, 79))
def test_what_lies_beyond_plays_no_part(seed, cells):
    """The horizon of the first cells is the first cells of the horizon."""
    launch = ground(seed)
    whole, part = horizon(RANGES, launch), horizon(RANGES[:cells], launch[:cells])
    np.testing.assert_array_equal(part.visible, whole.visible[:cells])
    np.testing.assert_array_equal(part.cutter, whole.cutter[:cells])


@pytest.mark.parametrize("source", [4.0, 12.1, 17.1])
def test_a_wall_throws_the_shadow_of_similar_triangles(source):
    """A wall 2 m high at 40 m, on a level bed 20 m deep: dark to 40 h / (h - 2), h above the bed, then lit again."""
    reach = np.arange(1.0, 150.0)
    bed = np.full(reach.size, 20.0)
    bed[39] = 18.0
    water = SoundSpeedProfile([0.0, 20.0], [1500.0, 1500.0])
    seen = ground_in_sight(water, source_depth=source, ranges=reach, ground=bed, plane=20.0, families=("D", "S"))
    for family, height in (("D", 20 - source), ("S", 20 + source)):
        end = 40 * height / (height - 2)
        dark = (reach > 40) & (reach < end)
        np.testing.assert_array_equal(~seen[family].visible, dark)
        assert dark.sum() >= 2 and np.all(seen[family].cutter[dark] == 39)


def test_azimuths_in_one_call_are_those_of_their_own():
    """Two rows of ground, together and apart, by bent rays."""
    reach = np.arange(2.0, 90.0, 2.0)
    bed = 19.0 + 0.8 * np.cos(reach / np.array([[3.0], [7.0]]))
    water = SoundSpeedProfile([0.0, 21.0], [1510.0, 1495.0])
    asked = {"source_depth": 9.0, "ranges": reach, "plane": 20.0}
    together = ground_in_sight(water, ground=bed, **asked)
    for family, seen in together.items():
        for row in range(2):
            alone = ground_in_sight(water, ground=bed[row], **asked)[family]
            np.testing.assert_array_equal(seen.visible[row], alone.visible)
            np.testing.assert_array_equal(seen.cutter[row], alone.cutter)
