"""Cells of a surface: equal shares of its area, each with one point, whatever its triangles look like."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scene import triangle_surfaces
from insonify.scene.surface_cells import (
    MANY_PIECES,
    MAX_PIECE_SIDE,
    MAX_PIECES,
    bisect_triangles,
    estimated_piece_count,
    halved_piece_count,
    surface_cells,
)

SHAPES = {
    "sphere": triangle_surfaces.sphere(1.0),
    "block": triangle_surfaces.block(2.0, 1.0, 0.5),
    "pipe": triangle_surfaces.tube(3.0, 0.6, 0.05),
    "cone": triangle_surfaces.frustum(0.7, 1.0, 0.0),
    "sliver": triangle_surfaces.block(5.0, 0.01, 0.01),
}


def area_of(corners):
    """Area of triangles [m^2]."""
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


@pytest.mark.parametrize("name", SHAPES)
def test_halving_keeps_the_area_and_bounds_every_side(name):
    """Pieces add up to the surface, and none is longer than was requested."""
    surface = SHAPES[name]
    pieces = bisect_triangles(surface.corners, 0.11)
    sides = np.linalg.norm(np.roll(pieces, -1, axis=1) - pieces, axis=2)
    assert sides.max() <= 0.11
    assert area_of(pieces).sum() == pytest.approx(surface.area.sum(), rel=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_halving_keeps_the_plane_and_the_sense_of_every_face(name):
    """The normals of the pieces, weighted by area, add up to those of the surface: outside stays outside."""
    corners, pieces = SHAPES[name].corners, bisect_triangles(SHAPES[name].corners, 0.2)
    for part in (corners, pieces):
        part_normal = np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0])
        # A closed surface has no mean normal.
        np.testing.assert_allclose(part_normal.sum(axis=0), 0, atol=1e-9)
    outward = np.einsum("ij,ij->", np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0]), pieces[:, 0])
    assert outward / 6 == pytest.approx(SHAPES[name].volume, rel=1e-9)


def test_a_triangle_that_is_short_enough_is_left_alone():
    """Nothing is cut that need not be."""
    corners = triangle_surfaces.block(0.1, 0.1, 0.1).corners
    np.testing.assert_array_equal(bisect_triangles(corners, 1.0), corners)


@pytest.mark.parametrize("side", [0.3, 0.05])
@pytest.mark.parametrize("name", SHAPES)
def test_a_cell_is_no_larger_than_a_square_of_the_side_requested(name, side):
    """The number of cells is the area over that of the square, rounded up: never fewer."""
    area = SHAPES[name].area.sum()
    cells = surface_cells(SHAPES[name], side)
    assert len(cells) == int(np.ceil(area / side**2 * (1 - 1e-12)))
    assert area / len(cells) <= side**2 * (1 + 1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_every_point_lies_on_the_surface_with_its_normal_outwards(name):
    """A point of a piece lies in its plane: the shape's support towards the normal is reached there for convex ones."""
    cells = surface_cells(SHAPES[name], 0.1)
    place, normal = cells.points(np.random.default_rng(1).random((len(cells), 3)))
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-12)
    if name == "pipe":
        return  # hollow
    support = (SHAPES[name].vertices @ normal.T).max(axis=0)
    np.testing.assert_allclose(np.einsum("ij,ij->i", place, normal), support, atol=2e-3)


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.5))
@settings(max_examples=20, deadline=None)
def test_shares_are_equal_on_every_face(seed, side):
    """The number of points on each face of a block is its share of the area, to two points."""
    block = triangle_surfaces.block(2.0, 1.0, 0.5)
    cells = surface_cells(block, side)
    _, normal = cells.points(np.random.default_rng(seed).random((len(cells), 3)))
    axis, sign = np.argmax(np.abs(normal), axis=1), np.sign(normal).sum(axis=1)
    for which, area in enumerate((0.5, 1.0, 2.0)):
        for way in (-1, 1):
            count = np.sum((axis == which) & (sign == way))
            assert abs(count - area / 7.0 * len(cells)) <= 2


def test_the_two_sides_of_a_thin_plate_share_no_cell():
    """One cell never stands for the front and the back: a cell's points all look the same way, whatever the draw."""
    cells = surface_cells(triangle_surfaces.block(1.0, 1.0, 1e-3), 0.1)
    rng = np.random.default_rng(2)
    looks = np.array([np.sign(cells.points(rng.random((len(cells), 3)))[1][:, 2]) for _ in range(20)])
    mixed = np.mean(looks.min(axis=0) * looks.max(axis=0) < 0)
    assert mixed <= 2 / len(cells) + 1e-12  # only the cell across the seam of the row


def test_neighbours_in_the_row_are_neighbours_on_the_surface():
    """A cell of many small triangles is a patch: its points stay within a few sides of each other."""
    cells = surface_cells(triangle_surfaces.sphere(1.0), 0.1)
    rng = np.random.default_rng(3)
    draws = np.array([cells.points(rng.random((len(cells), 3)))[0] for _ in range(12)])
    spread = np.linalg.norm(draws - draws.mean(axis=0), axis=2).max(axis=0)
    assert np.median(spread) < 2 * 0.1 and np.percentile(spread, 95) < 8 * 0.1


def test_even_points_need_no_draw():
    """Placed evenly, the numbers do not matter; the mean of a smooth function comes nearer than a drawn one does."""
    cells = surface_cells(triangle_surfaces.sphere(2.0), 0.05)
    u = np.random.default_rng(4).random((2, len(cells), 3))
    first, again = (cells.points(draw, quadrature=True)[0] for draw in u)
    np.testing.assert_array_equal(first, again)
    # The mean of z^2 over a sphere of radius 1 is 1/3.
    assert np.mean(first[:, 2] ** 2) == pytest.approx(1 / 3, abs=2e-3)


def test_drawn_points_are_uniform_in_their_triangle():
    """Square-root warping (Turk 1990): the centroid of many points in one triangle is that of the triangle."""
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    cells = surface_cells(triangle_surfaces.Triangles(corners[0], np.array([[0, 1, 2]])), 2.0)
    assert len(cells) == 1
    rng = np.random.default_rng(5)
    place = np.array([cells.points(rng.random((1, 3)))[0][0] for _ in range(4000)])
    # Standard error of a coordinate: sqrt(1/18 / 4000) = 0.004.
    np.testing.assert_allclose(place.mean(axis=0), [1 / 3, 1 / 3, 0], atol=0.015)
    np.testing.assert_allclose(place[:, :2].var(axis=0), 1 / 18, rtol=0.15)


def test_pieces_are_at_most_a_cell_and_a_half_long():
    """So that a cell of a large face is compact."""
    cells = surface_cells(triangle_surfaces.block(3.0, 2.0, 1.0), 0.2)
    sides = np.linalg.norm(np.roll(cells.corners, -1, axis=1) - cells.corners, axis=2)
    assert sides.max() <= MAX_PIECE_SIDE * 0.2
    assert cells.ends[-1] == 1.0 and np.all(np.diff(cells.ends) >= 0)


@pytest.mark.parametrize("length", [9.0, 27.0])
def test_pieces_of_a_long_body_grow_with_its_length(length):
    """A pile of 96 slivers a side: no more than twice as many pieces as cells of its length, and given beforehand."""
    pile, longest = triangle_surfaces.cylinder(length, 0.6), 0.045
    assert halved_piece_count(pile.corners, longest) > 2 * MANY_PIECES
    pieces = bisect_triangles(pile.corners, longest)
    slivers = np.count_nonzero(np.ptp(pile.corners[..., 0], axis=1) > 0)
    assert len(pieces) < 2.1 * slivers * length / (longest - np.pi * 0.6 / 96) + 50_000
    assert len(pieces) == pytest.approx(estimated_piece_count(pile.corners, longest), rel=0.2)
    sides = np.linalg.norm(np.roll(pieces, -1, axis=1) - pieces, axis=2)
    assert sides.max() <= longest * (1 + 1e-9)
    assert area_of(pieces).sum() == pytest.approx(pile.area.sum(), rel=1e-12)
    across = np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0])
    assert np.einsum("ij,ij->", across, pieces[:, 0]) / 6 == pytest.approx(pile.volume, rel=1e-9)


def test_however_long_a_body_its_pieces_are_bounded():
    """A pipe of 2 km in cells of 1 cm: no more pieces than the most, and the whole of its area."""
    pipe = triangle_surfaces.cylinder(2000.0, 0.6)
    pieces = bisect_triangles(pipe.corners, 0.015)
    assert len(pieces) <= MAX_PIECES
    assert area_of(pieces).sum() == pytest.approx(pipe.area.sum(), rel=1e-9)
