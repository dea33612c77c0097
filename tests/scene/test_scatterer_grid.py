"""The lattice of drawn scatterers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify import random_keys
from insonify.scene.scatterer_grid import BASE_PITCH, PARTS, SIDE, TILE, ScattererGrid, Tiles
from insonify.scene.scatterers import grid_scatterer_id
from oracles.jittered_points import jittered_points


def tiles(*rows):
    """Tiles from (level, along, across)."""
    return Tiles(*np.array(rows, dtype=np.int64).reshape(-1, 3).T)


@given(st.integers(0, 8), st.integers(-2000, 2000), st.integers(-2000, 2000))
def test_each_cell_holds_one_point_and_the_tile_its_area(level, along, across):
    """One scatterer in each of 32 x 32 cells, each standing for its cell."""
    cell = jittered_points(tiles((level, along, across)), 1, random_keys.SEABED)
    pitch = BASE_PITCH * 2**level
    number = np.floor(np.stack([cell.along, cell.across]) / pitch).astype(np.int64)
    np.testing.assert_array_equal(number, [cell.row, cell.column])
    i, j = np.indices((TILE, TILE)).reshape(2, -1)
    put = np.lexsort(number[::-1])
    np.testing.assert_array_equal(number[:, put], np.stack([along * TILE + i, across * TILE + j]))
    assert cell.area.sum() == pytest.approx((TILE * pitch) ** 2)
    np.testing.assert_array_equal(cell.scatterer_id, grid_scatterer_id(random_keys.SEABED, level, *number))


def test_a_tile_is_the_same_alone_and_in_company():
    """Draws know nothing of order or neighbours."""
    many = jittered_points(tiles((2, 3, 4), (1, -5, 6), (0, 0, 0)), 7, random_keys.SEABED)
    alone = jittered_points(tiles((1, -5, 6)), 7, random_keys.SEABED)
    middle = slice(TILE**2, 2 * TILE**2)
    for name in ("along", "across", "area", "phase", "scatterer_id", "priority", "rank"):
        np.testing.assert_array_equal(getattr(many, name)[middle], getattr(alone, name))
    np.testing.assert_array_equal(many.tile, np.repeat([0, 1, 2], TILE**2))


def test_seabed_surface_levels_and_seeds_have_scatterers_of_their_own():
    """No phase of one is a phase of another at the same cell."""
    base = jittered_points(tiles((2, 3, 4)), 7, random_keys.SEABED)
    for other in (jittered_points(tiles((2, 3, 4)), 8, random_keys.SEABED),
                  jittered_points(tiles((2, 3, 4)), 7, random_keys.SURFACE),
                  jittered_points(tiles((1, 3, 4)), 7, random_keys.SEABED)):  # fmt: skip
        assert not np.any(base.phase == other.phase)


def test_points_are_uniform_in_their_cells_and_their_phases_on_the_circle():
    """Means of 16 384 draws: places 1/2 +- 0.01, phasors and their squares 0 +- 0.03."""
    cell = jittered_points(tiles(*((3, n, 2 * n) for n in range(16))), 1, random_keys.SEABED)
    for coordinate in (cell.along, cell.across):
        assert np.mean(coordinate / 0.08 % 1) == pytest.approx(0.5, abs=0.01)
    assert abs(cell.phase.mean()) < 0.03 and abs((cell.phase**2).mean()) < 0.03


@given(st.integers(0, 8), st.integers(-2000, 2000), st.integers(-2000, 2000), st.integers(0, 4))
def test_the_first_of_a_tile_are_an_even_lattice(level, along, across, power):
    """Of the first 4^k one lies in each of 4^k squares of the tile; half of the next lattice lies on diagonals."""
    cell = jittered_points(tiles((level, along, across)), 1, random_keys.SEABED)
    assert sorted(cell.rank) == list(range(TILE**2))
    np.testing.assert_array_equal(np.floor(cell.priority * TILE**2), cell.rank)
    side = TILE >> power
    first = cell.rank < 4**power
    assert len(set(zip(cell.row[first] // side, cell.column[first] // side, strict=True))) == 4**power
    two = np.argsort(cell.rank)[:2]
    half = TILE // 2
    assert np.all(np.diff(cell.row[two] // half) != 0) and np.all(np.diff(cell.column[two] // half) != 0)


def test_those_of_least_priority_are_drawn_alone_as_in_company():
    """Each part of a tile by its own bound: just those below it, with the same places, phases and keys."""
    some = tiles((2, 3, 4), (1, -5, 6))
    most = np.random.default_rng(1).uniform(-0.1, 1.1, (2, PARTS, PARTS))
    every, few = jittered_points(some, 7, random_keys.SEABED), jittered_points(some, 7, random_keys.SEABED, most)
    bound = most[every.tile, every.row % TILE // SIDE, every.column % TILE // SIDE]
    expected = every.take(every.priority < bound)
    for name in ("along", "across", "area", "phase", "scatterer_id", "priority", "rank", "tile"):
        np.testing.assert_array_equal(getattr(few, name), getattr(expected, name))


def test_every_cell_comes_first_as_often_as_any_other():
    """Rank of each of 1024 cells over 1000 tiles: mean 511.5 +- 5 standard errors of 9.3."""
    number = np.arange(1000)
    cell = jittered_points(Tiles(np.full(1000, 3), number % 67, number // 67), 1, random_keys.SEABED)
    total = np.zeros((TILE, TILE))
    np.add.at(total, (cell.row % TILE, cell.column % TILE), cell.rank)
    assert np.abs(total / 1000 - 511.5).max() < 5 * np.sqrt((1024**2 - 1) / 12 / 1000)


@given(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(-6.28, 6.28))
def test_to_the_scene_and_back_is_where_it_was(north, east, heading):
    """Grid to world and world to grid undo one another; distances stay."""
    lattice = ScattererGrid(origin=(north, east), heading=heading)
    along, across = np.array([0.0, 30.0, -4.0]), np.array([10.0, -3.0, 500.0])
    world = lattice.to_world(along, across)
    np.testing.assert_allclose(lattice.from_world(world), np.stack([along, across], axis=-1), atol=1e-8)
    np.testing.assert_allclose(np.hypot(*(world - [north, east]).T), np.hypot(along, across), atol=1e-8)


def test_a_split_tile_is_covered_by_its_four_parts():
    """Four tiles of the finer level, same ground."""
    whole = tiles((3, -2, 5))
    parts = whole.split()
    np.testing.assert_array_equal(parts.scale, 2)
    assert (TILE * parts.pitch**2 * TILE).sum() == pytest.approx(float(((TILE * whole.pitch) ** 2)[0]))
    np.testing.assert_allclose(parts.centre.mean(axis=0), whole.centre[0])
    assert len({tuple(row) for row in parts.centre}) == 4
