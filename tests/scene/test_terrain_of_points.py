"""Cached terrain of points of tiles, in kernels: against a dictionary, a loop and the terrain itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify import random_keys
from insonify.engines.beam_importance import KeptScatterers
from insonify.engines.ping_scatterers import lay_on_terrain
from insonify.scattering.lambert import Lambert
from insonify.scene import _scatterer_terrain_cache_kernel as held
from insonify.scene.scatterer_grid import TILE, ScattererGrid, Tiles, next_positions, tile_prefixes
from insonify.scene.seabed import Seabed
from insonify.scene.seabed_scatterers import seabed_scatterers, tile_scatterers
from insonify.scene.terrain._gradient_rotation_kernel import rotate
from insonify.scene.terrain.relief import TerrainSample
from oracles.jittered_points import jittered_points

SEED = 3
KEYS = st.sampled_from([0, 1, -1, 7, 4096, 1 << 44, -(1 << 60), (1 << 63) - 1, 12345678901])
ENTRIES = st.lists(st.tuples(KEYS, st.integers(0, 50), st.integers(1, 9)), max_size=30)


@given(ENTRIES)
@settings(max_examples=60, deadline=None)
def test_a_table_is_a_dictionary_in_which_the_larger_entry_stays(entries):
    """Keys far apart and next to one another, in 16 slots for 9 keys: each is found, with the first of its largest."""
    table, expected, new = np.zeros((16, 3), np.int64), {}, 0
    columns = np.array(entries, np.int64).reshape(-1, 3).T
    new = held.put(*(np.ascontiguousarray(column) for column in columns), table)
    for key, start, size in entries:
        if size > expected.get(key, (0, 0))[1]:
            expected[key] = (start, size)
    assert new == len(expected) == np.sum(table[:, 2] > 0)
    for key, entry in expected.items():
        assert tuple(table[held.find_slot(np.int64(key), table)]) == (key, *entry)
    assert table[held.find_slot(np.int64(99), table), 2] == 0


@pytest.mark.parametrize("seed", range(5))
def test_what_is_found_moves_over_and_what_is_missing_gets_room(seed):
    """Tiles of a newer and an older half, of neither and of both: known rows are there, and rooms do not overlap."""
    rng = np.random.default_rng(seed)
    rows, old_rows = np.full((4000, 3), np.nan), np.full((2000, 3), np.nan)
    table, old_table = np.zeros((2, 256, 3), np.int64)
    used, first, own = 0, 0, {}
    for key in range(60):
        for half, chance in ((0, 0.5), (1, 0.5)):
            size = int(rng.integers(1, 20))
            if rng.random() > chance:
                continue
            expected = np.stack([np.full(size, key), np.arange(size), np.zeros(size)], axis=-1)
            (rows if half == 0 else old_rows)[(start := used if half == 0 else first) : start + size] = expected
            held.put(*np.array([[key], [start], [size]]), table if half == 0 else old_table)
            used, first = used + size * (half == 0), first + size * (half == 1)
            own[key] = max(own.get(key, 0), size)
    key, size = rng.permutation(80)[:50], rng.integers(1, 25, 50)
    before = {int(k): int(table[held.find_slot(k, table), 2]) for k in key}
    start, known = np.empty((2, 50), np.int64)
    end, new = held.find(key, size, table, rows, old_table, old_rows, used, start, known)
    np.testing.assert_array_equal(known, np.minimum([own.get(int(k), 0) for k in key], size))
    for k, at, there in zip(key, start, known, strict=True):
        np.testing.assert_array_equal(rows[at : at + there, :2], np.stack([np.full(there, k), np.arange(there)], -1))
    rooms = sorted((at, at + n) for k, at, n in zip(key, start, size, strict=True) if before[int(k)] < n)
    assert [a for a, _ in rooms] == [used, *(b for _, b in rooms)][: len(rooms)] and end == max(
        [used, *(b for _, b in rooms)]
    )
    assert new == sum(before[int(k)] == 0 and there == n for k, there, n in zip(key, known, size, strict=True))
    made = np.arange(3.0 * np.sum(size - known)).reshape(-1, 3)
    held.fill(made, start, known, size, rows)
    put = [rows[at + there : at + n] for at, there, n in zip(start, known, size, strict=True)]
    np.testing.assert_array_equal(np.concatenate(put), made)


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, TILE**2 - 1)), max_size=40),
       st.lists(st.floats(1e-3, 1), min_size=6, max_size=6))  # fmt: skip
@settings(max_examples=80, deadline=None)
def test_as_many_are_requested_as_all_that_are_kept_or_a_quarter_or_a_quarter_of_that(kept, density):
    """Never fewer than any rank kept, less than four times and a bit as many, and a part of the whole that quarters."""
    kept = [(t, min(rank, int(np.ceil(density[t] * TILE**2)) - 1)) for t, rank in kept]
    tile, rank = np.array(kept, np.int32).reshape(-1, 2).T
    requested, size = tile_prefixes(np.ascontiguousarray(tile), np.ascontiguousarray(rank), np.array(density))
    assert requested.tolist() == sorted({t for t, _ in kept})
    for t, n in zip(requested.tolist(), size.tolist(), strict=True):
        most, whole = max(rank for tile, rank in kept if tile == t) + 1, np.ceil(density[t] * TILE**2)
        assert most <= n <= whole and (n == whole or n < 4 * most + 1)
        assert n in [int(np.ceil(whole / 4**power)) for power in range(7)]


@pytest.mark.parametrize("heading", [0.0, 0.9, -2.5])
@pytest.mark.parametrize("count", [0, 1, 77])
def test_gradients_turned_are_those_of_the_turned_plane(count, heading):
    """Height goes along; along and across the lattice become north and east by the lattice's own frame."""
    rng, lattice = np.random.default_rng(count), ScattererGrid(heading=heading)
    height, slope, rows = rng.normal(size=count), rng.normal(size=(count, 2)), np.empty((count, 3))
    rotate(height, slope, *lattice.frame[2:], rows)
    np.testing.assert_allclose(rows[:, 1:], lattice.to_world(*slope.T).reshape(-1, 2), atol=1e-15)
    np.testing.assert_array_equal(rows[:, 0], height)
    np.testing.assert_allclose(np.linalg.norm(rows[:, 1:], axis=1), np.linalg.norm(slope, axis=1))


@pytest.mark.parametrize("count", [0, 1, 500])
def test_points_in_rows_are_the_facets_of_their_survey(count):
    """Random rows, holes and land among them, points in any order: bit-identical with `seabed_scatterers` of each."""
    rng = np.random.default_rng(count)
    start = np.array([40, 0, 15, 15])
    tile, rank = rng.integers(0, 4, count).astype(np.int32), rng.integers(0, 15, count).astype(np.int32)
    rows = rng.normal(0, 0.5, (55, 3))
    rows[rng.random(55) < 0.2, 0], rows[rng.random(55) < 0.1, 0] = np.nan, 20.0
    position, area = rng.uniform(-50, 50, (count, 3)), rng.uniform(0.1, 2, count)
    phase, key = np.exp(1j * rng.random(count)), rng.integers(0, 1 << 60, count).astype(np.uint64)
    own = rows[start[tile] + rank]
    want = seabed_scatterers(20.0, TerrainSample(own[:, 0], own[:, 1:]), Lambert(), position[:, :2], area, phase, key)
    found = tile_scatterers(
        20.0, (rows, start), Lambert(), tile, rank, position.copy(), area.copy(), phase.copy(), key.copy()
    )
    assert len(found) == len(want) == np.sum(own[:, 0] < 20.0)
    for name in ("position", "normal", "area", "phase", "scatterer_id"):
        np.testing.assert_array_equal(getattr(found, name), getattr(want, name))


def ground(heading=0.0):
    """The bed of a fractal."""
    relief = {"kind": "power-law", "hurst": 0.8, "rms": 0.2}
    lattice = ScattererGrid(origin=(300.0, -80.0), heading=heading)
    return (
        Seabed(depth=20.0, relief=relief, seed=1, cutoff_wavelength=0.5, scatterer_grid=lattice)
        .completed(1, 100e3, 1500.0)
        .terrain
    )


def some_kept(tiles, share, lattice):
    """The first of some tiles, as a ping may keep them."""
    most = np.broadcast_to(np.asarray(share)[:, None, None], (len(share), 4, 4))
    drawn = jittered_points(tiles, SEED, random_keys.SEABED, most)
    position = np.zeros((len(drawn.along), 3))
    position[:, :2] = lattice.to_world(drawn.along, drawn.across)
    return KeptScatterers(
        position,
        np.ones(len(position)),
        drawn.phase,
        drawn.scatterer_id,
        drawn.tile.astype(np.int32),
        drawn.rank.astype(np.int32),
    )


@pytest.mark.parametrize("heading", [0.0, 0.9])
def test_scatterers_on_held_ground_lie_where_the_ground_is(heading):
    """Pings that keep few, many, none and few again: each lies on the ground and faces as it does, by key the same."""
    bed = ground(heading)
    lattice, seen = bed.relief.resolved.scatterer_grid, {}
    tiles = Tiles(np.array([3, 4, 3]), np.array([1, -2, 5]), np.array([0, 3, -7]))
    for share in ([0.02, 0.01, 0.0], [0.3, 0.2, 0.05], [0.0, 0.0, 0.0], [1.0, 0.01, 0.5], [0.02, 0.01, 0.0]):
        kept = some_kept(tiles, share, lattice)
        found = lay_on_terrain(bed, Lambert(), tiles, np.ones(3), SEED, random_keys.SEABED, kept)
        assert len(found) == len(kept.key) and (len(found) > 0) == (max(share) > 0)
        survey = bed.relief.sample(*found.position[:, :2].T)
        np.testing.assert_allclose(found.position[:, 2], 20.0 - survey.height, atol=1e-9)
        np.testing.assert_allclose(found.normal[:, :2] / -found.normal[:, 2:], -survey.slope, atol=1e-9)
        np.testing.assert_allclose(found.area, np.hypot(1, np.hypot(*survey.slope.T)), rtol=1e-12)
        for key, *place in zip(found.scatterer_id.tolist(), *found.position.T.tolist(), strict=True):
            assert seen.setdefault(key, place) == place


def test_the_next_places_of_a_tile_are_those_drawn():
    """Any stretch of ranks, an empty one and all of them: coordinates of `jittered_points`, by rank."""
    tiles = Tiles(np.array([0, 5, 2, 3]), np.array([-4, 1, 0, 9]), np.array([7, 7, -1, 0]))
    begin, end = np.array([0, 17, 256, 1000]), np.array([1024, 17, 300, 1001])
    found = np.array(next_positions(tiles, SEED, random_keys.SEABED, begin, end))
    drawn = jittered_points(tiles, SEED, random_keys.SEABED)
    order = np.lexsort((drawn.rank, drawn.tile))
    expected = order[(drawn.rank[order] >= begin[drawn.tile[order]]) & (drawn.rank[order] < end[drawn.tile[order]])]
    np.testing.assert_array_equal(found, [drawn.along[expected], drawn.across[expected]])
