"""Cubic patches through a grid of soundings: exact where they can be, smooth where they join, and gone in holes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scene.terrain._hermite_kernel import hermite, node_slopes

ROWS, COLUMNS = 9, 7


def surface(height):
    """A reader of the patches through some heights: (height, slope along rows, along columns) at fractional places."""
    along_rows, along_columns = np.empty_like(height), np.empty_like(height)
    node_slopes(height, along_rows, along_columns)

    def read(row, column):
        row, column = np.broadcast_arrays(np.asarray(row, float), np.asarray(column, float))
        out = np.empty((row.size, 3))
        hermite(height, along_rows, along_columns, row.ravel().copy(), column.ravel().copy(), out)
        return out.T.reshape(3, *row.shape)

    return read


def random_heights(seed=1, holes=0):
    """Heights of a grid, some of them unknown."""
    rng = np.random.default_rng(seed)
    height = rng.normal(size=(ROWS, COLUMNS))
    height.ravel()[rng.permutation(height.size)[:holes]] = np.nan
    return height


def inside(count=400, seed=2):
    """Fractional places within the grid."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0, ROWS - 1, count), rng.uniform(0, COLUMNS - 1, count)


def test_soundings_are_reproduced_exactly():
    """The surface goes through every node."""
    height = random_heights()
    row, column = np.mgrid[:ROWS, :COLUMNS]
    np.testing.assert_allclose(surface(height)(row, column)[0], height, atol=1e-14)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5))
def test_a_plane_is_a_plane(level, rise, tilt):
    """Heights and slopes of a tilted plane come back everywhere, the edges included."""
    row, column = np.mgrid[:ROWS, :COLUMNS].astype(float)
    read = surface(level + rise * row + tilt * column)
    r, c = inside()
    found = read(r, c)
    np.testing.assert_allclose(found[0], level + rise * r + tilt * c, atol=1e-12)
    np.testing.assert_allclose(found[1], rise, atol=1e-12)
    np.testing.assert_allclose(found[2], tilt, atol=1e-12)


def test_a_parabola_is_reproduced_exactly_away_from_the_edges():
    """Central differences are the slopes of a parabola, and cubics hold it: exact but in the outermost cells."""
    row = np.mgrid[:ROWS, :COLUMNS][0].astype(float)
    read = surface(0.3 * row**2 - row)
    r, c = inside()
    r = 1 + r * (ROWS - 3) / (ROWS - 1)
    found = read(r, c)
    np.testing.assert_allclose(found[0], 0.3 * r**2 - r, atol=1e-12)
    np.testing.assert_allclose(found[1], 0.6 * r - 1, atol=1e-12)


def test_slopes_are_the_derivatives_of_the_height():
    """Central differences of the surface itself."""
    read, step = surface(random_heights()), 1e-6
    r, c = inside()
    r, c = np.clip(r, 0.01, ROWS - 1.01), np.clip(c, 0.01, COLUMNS - 1.01)
    away = (np.abs(r - np.rint(r)) > 1e-3) & (np.abs(c - np.rint(c)) > 1e-3)
    r, c = r[away], c[away]
    _, down, right = read(r, c)
    np.testing.assert_allclose(down, (read(r + step, c)[0] - read(r - step, c)[0]) / (2 * step), atol=1e-7)
    np.testing.assert_allclose(right, (read(r, c + step)[0] - read(r, c - step)[0]) / (2 * step), atol=1e-7)


@pytest.mark.parametrize("axis", [0, 1])
def test_neighbouring_patches_share_height_and_gradient(axis):
    """Just before and just beyond a line of nodes: no step and no crease, in any of the three."""
    read = surface(random_heights())
    along = np.linspace(0.1, (COLUMNS if axis == 0 else ROWS) - 1.1, 50)
    for line in range(1, (ROWS if axis == 0 else COLUMNS) - 1):
        sides = [np.full(50, line + side * 1e-9) for side in (-1, 1)]
        one, other = (read(s, along) if axis == 0 else read(along, s) for s in sides)
        np.testing.assert_allclose(one, other, atol=1e-7)


def test_a_cell_with_a_hole_at_a_corner_is_a_hole():
    """Nothing is invented: NaN where one of the four soundings is missing, and numbers everywhere else."""
    height = random_heights(holes=6)
    r, c = inside(2000)
    i, j = r.astype(int), c.astype(int)
    known = ~np.isnan(height[i, j] + height[i + 1, j] + height[i, j + 1] + height[i + 1, j + 1])
    found = surface(height)(r, c)
    np.testing.assert_array_equal(np.isnan(found[0]), ~known)
    assert np.isfinite(found[:, known]).all()


@pytest.mark.parametrize(("row", "column"), [(-0.01, 1), (ROWS - 0.99, 1), (1, -0.01), (1, COLUMNS - 0.99)])
def test_nothing_is_extrapolated(row, column):
    """Beyond the last sounding the height is unknown."""
    assert np.isnan(surface(random_heights())(row, column)).all()


def test_turning_the_grid_turns_the_surface():
    """Rows and columns exchanged: the same heights, the slopes exchanged."""
    height = random_heights()
    r, c = inside()
    one, other = surface(height)(r, c), surface(np.ascontiguousarray(height.T))(c, r)
    np.testing.assert_allclose(one, other[[0, 2, 1]], atol=1e-13)


def test_no_patch_overshoots_its_cell_by_much():
    """A cubic between bounded nodes stays within a quarter of their spread beyond them."""
    height = random_heights(5)
    found = surface(height)(*inside(5000))[0]
    spread = np.ptp(height)
    assert height.min() - spread / 4 < found.min() and found.max() < height.max() + spread / 4
