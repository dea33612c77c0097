"""Claims about outlines of solids as seen from afar."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.propagation.silhouette import COLUMNS, outline
from insonify.scene import triangle_surfaces

SEEDS = st.integers(0, 2**31)


def ball(radius, middle):
    """Triangles of a ball in the world."""
    return triangle_surfaces.sphere(2 * radius).corners + np.asarray(middle, float)


@pytest.mark.parametrize(("radius", "away"), [(1.0, 20.0), (0.5, 4.0), (2.0, 7.0)])
def test_a_ball_is_as_wide_as_its_tangents(radius, away):
    """Half its angle is asin(radius / distance), and so is that of its top above the level of its middle."""
    seen = outline(ball(radius, (away, 0.0, 10.0)), (0.0, 0.0, 10.0))
    half = np.arcsin(radius / away)
    assert seen.centre_bearing == pytest.approx(0.0, abs=1e-3)
    assert (seen.border_bearings[-1] - seen.border_bearings[0]) / 2 == pytest.approx(half, rel=5e-3)
    rises = np.arctan2(10.0 - seen.columns[:, 1], seen.columns[:, 0])
    assert rises.max() == pytest.approx(half, rel=5e-3)
    falls = np.arctan2(seen.columns[:, 3] - 10.0, seen.columns[:, 2])
    np.testing.assert_allclose(falls, rises, atol=0.01 * half)
    # the tangent cone is round: tan^2 of the rise is what the bearing leaves of it
    bearing = (seen.border_bearings[1:] + seen.border_bearings[:-1]) / 2
    inside = np.abs(bearing) < 0.9 * half
    expected = np.arcsin(np.sqrt(np.maximum(1 - (np.cos(half) / np.cos(bearing)) ** 2, 0)))
    np.testing.assert_allclose(rises[inside], expected[inside], rtol=0.03)


def test_an_upright_block_has_one_height():
    """Seen from above its top along its axis: the far upper edge, the near lower edge, and its faces' distances."""
    block = triangle_surfaces.block(2.0, 1.0, 0.5).corners
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
def test_an_outline_turns_and_grows_with_the_scene(seed, turn, size):
    """Turned about the place it faces elsewhere, grown it is farther and taller; its borders stay."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-1, 1, (12, 3, 3)) + np.array([9.0, 0.0, 0.0])
    c, s = np.cos(turn), np.sin(turn)
    here = outline(corners, (0.0, 0.0, 0.0))
    there = outline(size * corners @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T, (0.0, 0.0, 0.0))
    assert np.angle(np.exp(1j * (there.centre_bearing - here.centre_bearing - turn))) == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(there.border_bearings, here.border_bearings, atol=1e-12)
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
    assert np.all(np.diff(seen.border_bearings) > 0)


def test_what_stands_around_the_place_has_no_outline():
    """From within, and from a place beside part of it, there is no one side to look at."""
    assert outline(ball(3.0, (0.0, 0.0, 10.0)), (0.0, 0.0, 10.0)) is None
    assert outline(ball(3.0, (2.9, 0.0, 10.0)), (0.0, 0.0, 10.0)) is None
    assert outline(ball(3.0, (3.1, 0.0, 10.0)), (0.0, 0.0, 10.0)) is not None
