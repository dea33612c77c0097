"""Scatterers of tiles that are kept for the next ping: bounded, shared by threads, and never another tile's."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from insonify import random_keys
from insonify.scene import drawn_tiles
from insonify.scene.drawn_tiles import DrawnTiles
from insonify.scene.scatterer_grid import BASE_PITCH, TILE, ScattererGrid, Tiles, draw_cells
from insonify.scene.seabed import Seabed
from oracles.jittered_points import jittered_points

SEED = 3


def tiles_of(numbers, scale=2):
    """Tiles in a row, by their numbers."""
    numbers = np.asarray(numbers, np.int64)
    return Tiles(np.full(len(numbers), scale), numbers % 7 - 3, numbers)


@pytest.fixture
def drawn(monkeypatch):
    """Number of the tile and first rank of each draw, in order."""
    requested = []

    def draw(tiles, seed, stream, begin, end):
        requested.extend(zip(tiles.across.tolist(), begin.tolist(), strict=True))
        return draw_cells(tiles, seed, stream, begin, end)

    monkeypatch.setattr(drawn_tiles, "draw_cells", draw)
    return requested


def assert_own_scatterers(cache, numbers, size):
    """Cells of the first scatterers of some tiles, as drawn afresh."""
    tiles, size = tiles_of(numbers), np.asarray(size, np.int64)
    with cache.reading(tiles, size) as (rows, start):
        found = np.concatenate([rows.cell[a : a + n] for a, n in zip(start.tolist(), size.tolist(), strict=True)])
    expected = draw_cells(tiles, cache.seed, cache.stream, np.zeros_like(size), size)
    np.testing.assert_array_equal(found, expected.cell)


def test_tiles_are_drawn_once_and_fewer_of_their_scatterers_are_there_too(drawn):
    """Five tiles, then fewer scatterers of four of them; of one with more requested, one is missing; of one, none."""
    cache = DrawnTiles("seabed", SEED)
    assert_own_scatterers(cache, [3, 9, 0, 5, 7], [5, 1, 16, 64, 2])
    drawn.clear()
    assert_own_scatterers(cache, [9, 0, 5, 7, 8], [1, 4, 64, 1, 0])
    assert drawn == []
    assert_own_scatterers(cache, [3, 9], [6, 1])
    assert drawn == [(3, 5)]


@pytest.mark.parametrize("room", [30, 1000])
def test_memory_for_few_changes_no_result(room):
    """Random tiles of random sizes, more at a time than there is room for: always the tile's own."""
    cache, rng = DrawnTiles("seabed", SEED, None, room, 4 * room), np.random.default_rng(1)
    for _ in range(60):
        assert_own_scatterers(cache, rng.choice(400, 20, replace=False), rng.integers(0, 12, 20))


def test_recently_read_tiles_are_kept_longest(drawn):
    """Requested in each of many rounds, one tile is drawn once; those of the first round are deleted."""
    cache = DrawnTiles("seabed", SEED, None, 100, 400)
    for number in range(1, 40):
        assert_own_scatterers(cache, [0, 2 * number, 2 * number + 1], [10, 10, 10])
    assert drawn.count((0, 0)) == 1
    assert_own_scatterers(cache, [2], [10])
    assert drawn.count((2, 0)) == 2


def test_many_tiles_are_all_found(drawn):
    """The table grows past its first 4096 slots: 20 000 tiles, none drawn twice."""
    cache, numbers = DrawnTiles("seabed", SEED), np.random.default_rng(2).permutation(20_000)
    for part in np.split(numbers, 10):
        assert_own_scatterers(cache, part, np.ones(len(part)))
    assert_own_scatterers(cache, numbers, np.ones(len(numbers)))
    assert len(drawn) == len(numbers)


def test_threads_share_what_is_drawn():
    """Eight threads requesting some of few tiles, with memory for a quarter of them: each gets its own."""
    cache, rng = DrawnTiles("seabed", SEED, None, 200, 800), np.random.default_rng(3)
    requested = [(rng.choice(80, 6, replace=False), rng.integers(1, 20, 6)) for _ in range(400)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda one: assert_own_scatterers(cache, *one), requested))


def test_memory_is_used_again_but_not_while_it_is_read():
    """Of two halves; rows that are read stay as they are, whatever others request."""
    cache, memory = DrawnTiles("seabed", SEED, None, 100, 400), set()
    for number in range(40):
        with cache.reading(tiles_of([number, number + 1]), np.array([40, 40])) as (rows, _):
            memory.add(rows.cell.ctypes.data)
    assert len(memory) == 2
    with cache.reading(tiles_of([77]), np.array([90])) as (rows, start):
        before = rows.cell[start[0] : start[0] + 90].copy()
        for number in range(40):
            assert_own_scatterers(cache, [number], [90])
        np.testing.assert_array_equal(rows.cell[start[0] : start[0] + 90], before)


def test_memory_grows_where_little_is_found_again(drawn):
    """A ping of twice what both halves hold, again and again: soon nothing is drawn any more; up to the limit."""
    cache, numbers = DrawnTiles("seabed", SEED, None, 100, 1 << 20), np.arange(40)
    for _ in range(8):
        for part in np.split(numbers, 8):
            assert_own_scatterers(cache, part, np.full(len(part), 10))
    drawn.clear()
    for part in np.split(numbers, 8):
        assert_own_scatterers(cache, part, np.full(len(part), 10))
    assert drawn == []


def test_another_process_begins_with_nothing(drawn):
    """Pickled, only what is drawn and the bounds go along."""
    cache = DrawnTiles("surface", 12, None, 50, 12345)
    assert_own_scatterers(cache, [1], [4])
    other = pickle.loads(pickle.dumps(cache))
    assert_own_scatterers(other, [1], [4])
    assert (other.boundary, other.seed, other.max_bytes) == ("surface", 12, 12345)
    assert other.stream == random_keys.SURFACE and drawn == [(1, 0), (1, 0)]


def test_of_a_tile_that_grows_only_what_is_missing_is_drawn(drawn):
    """4, then 16, then 64 scatterers of a tile: 64 in all, from whichever half those before are in."""
    cache = DrawnTiles("seabed", SEED, None, 80, 320)
    for size in (4, 16, 64):
        assert_own_scatterers(cache, [5], [size])
    assert [first for _, first in drawn] == [0, 4, 16]


@pytest.mark.parametrize("heading", [0.0, 0.9])
def test_terrain_is_that_at_the_scatterers(heading):
    """Height and gradient to the north and the east, of a turned grid too, at the positions of `jittered_points`."""
    lattice = ScattererGrid(origin=(300.0, -80.0), heading=heading)
    relief = {"kind": "power-law", "hurst": 0.8, "rms": 0.2}
    seabed = Seabed(depth=20.0, relief=relief, seed=1, cutoff_wavelength=0.5, scatterer_grid=lattice)
    terrain = seabed.completed(1, 100e3, 1500.0).terrain
    tiles = Tiles(np.array([3, 4, 3]), np.array([1, -2, 5]), np.array([0, 3, -7]))
    cache = DrawnTiles("seabed", SEED, terrain)
    points = jittered_points(tiles, SEED, random_keys.SEABED)
    for size in ([20, 10, 0], [300, 200, 50], [1024, 10, 500]):
        with cache.reading(tiles, np.array(size)) as (rows, start):
            drawn_rows = start[points.tile] + points.rank
            kept = points.rank < np.array(size)[points.tile]
            found, cell = rows.terrain[drawn_rows[kept]], rows.cell[drawn_rows[kept]]
        some = points.take(kept)
        np.testing.assert_array_equal(cell, some.row % TILE * TILE + some.column % TILE)
        survey = terrain.relief.sample(*lattice.to_world(some.along, some.across).T)
        np.testing.assert_allclose(found[:, 0], survey.height, atol=1e-9)
        np.testing.assert_allclose(found[:, 1:], survey.slope, atol=1e-9)


def test_cells_and_positions_drawn_are_those_of_the_grid():
    """Any stretch of ranks, an empty one and all of them: cells and coordinates of `jittered_points`, by rank."""
    tiles = Tiles(np.array([0, 5, 2, 3]), np.array([-4, 1, 0, 9]), np.array([7, 7, -1, 0]))
    begin, end = np.array([0, 17, 256, 1000]), np.array([1024, 17, 300, 1001])
    found = draw_cells(tiles, SEED, random_keys.SEABED, begin, end)
    points = jittered_points(tiles, SEED, random_keys.SEABED)
    order = np.lexsort((points.rank, points.tile))
    expected = order[(points.rank[order] >= begin[points.tile[order]]) & (points.rank[order] < end[points.tile[order]])]
    np.testing.assert_array_equal([found.along, found.across], [points.along[expected], points.across[expected]])
    pitch = BASE_PITCH * 2.0 ** tiles.scale[points.tile[expected]]
    inside = np.floor(np.stack([found.along, found.across]) / pitch).astype(int) % TILE
    np.testing.assert_array_equal(found.cell, inside[0] * TILE + inside[1])
