"""Points of tiles that are held for the next ping: bounded, shared by threads, and never another tile's."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from insonify.scene.scatterer_terrain_cache import ScattererTerrainCache

KEYS = np.array([3, -(1 << 60), 0, 1 << 59, 7], np.int64)


def assert_own_points(held, key, size, made=None):
    """What is reported of all points of some tiles: each point states its tile and its rank."""
    key, size = np.asarray(key, np.int64), np.asarray(size, np.int64)

    def make(rows, known):
        if made is not None:
            made.extend(key[rows].tolist())
        each = zip(key[rows].tolist(), known.tolist(), size[rows].tolist(), strict=True)
        return np.concatenate([np.stack([np.full(n - m, k), np.arange(m, n), np.zeros(n - m)], 1) for k, m, n in each])

    rows, start = held.rows_of(key, size, make)
    for k, first, n in zip(key.tolist(), start.tolist(), size.tolist(), strict=True):
        np.testing.assert_array_equal(rows[first : first + n, 0], float(k))
        np.testing.assert_array_equal(rows[first : first + n, 1], np.arange(n))


def test_points_are_worked_out_once_and_fewer_of_them_are_there_too():
    """Five tiles, then fewer points of four of them; of one with more requested, one point is missing."""
    held, made = ScattererTerrainCache(1 << 20), []
    assert_own_points(held, KEYS, [5, 1, 16, 64, 2], made)
    assert_own_points(held, KEYS[1:], [1, 4, 64, 1], made)
    assert made == KEYS.tolist()
    assert_own_points(held, KEYS[:2], [6, 1], made)
    assert made[5:] == [3]
    assert_own_points(held, KEYS[:1], [5], made)
    assert len(made) == 6


@pytest.mark.parametrize("room", [30, 1000])
def test_a_bound_too_small_changes_no_result(room):
    """Random tiles of random sizes, more at a time than there is room for: always the tile's own points."""
    held, rng = ScattererTerrainCache(room * 24), np.random.default_rng(1)
    for _ in range(60):
        key = rng.choice(400, 20, replace=False)
        assert_own_points(held, key, rng.integers(1, 12, 20))


def test_recently_read_tiles_are_kept_longest():
    """Requested in each of many rounds, one tile is worked out once; those of the first round are forgotten."""
    held, made = ScattererTerrainCache(2 * 100 * 24), []
    for number in range(40):
        assert_own_points(held, [-1, 2 * number, 2 * number + 1], [10, 10, 10], made)
    assert made.count(-1) == 1
    assert_own_points(held, [0], [10], made)
    assert made.count(0) == 2


def test_many_tiles_are_all_found():
    """The table grows past its first 4096 slots: 20 000 tiles, none worked out twice."""
    held, made, key = ScattererTerrainCache(1 << 24), [], np.random.default_rng(2).permutation(20_000) << 27
    for part in np.split(key, 10):
        assert_own_points(held, part, np.ones(len(part)), made)
    assert_own_points(held, key, np.ones(len(key)), made)
    assert len(made) == len(key)


def test_threads_share_what_is_held():
    """Eight threads requesting some of few tiles, with memory for a quarter of them: each gets its own points."""
    held, rng = ScattererTerrainCache(400 * 24), np.random.default_rng(3)
    requested = [(rng.choice(80, 6, replace=False), rng.integers(1, 20, 6)) for _ in range(300)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda one: assert_own_points(held, *one), requested))


def test_another_process_begins_with_nothing():
    """Pickled, only the bound goes along."""
    held = ScattererTerrainCache(12345)
    assert_own_points(held, [1], [4])
    other, made = pickle.loads(pickle.dumps(held)), []
    assert_own_points(other, [1], [4], made)
    assert other.max_bytes == 12345 and made == [1]


def test_of_a_tile_that_grows_only_what_is_missing_is_worked_out():
    """4, then 16, then 64 points of a tile: 64 in all, from whichever half those before are in."""
    held, made = ScattererTerrainCache(2 * 80 * 24), []

    def make(rows, known):
        made.extend(known.tolist())
        return np.column_stack([np.arange(known[0], size), np.zeros((size - known[0], 2))])

    for size in (4, 16, 64):
        rows, start = held.rows_of(np.array([5]), np.array([size]), make)
        np.testing.assert_array_equal(rows[start[0] : start[0] + size, 0], np.arange(size))
    assert made == [0, 4, 16]
