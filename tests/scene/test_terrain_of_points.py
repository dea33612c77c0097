"""Cached terrain of points of tiles, in kernels: against a dictionary, a loop and the terrain itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scene import _drawn_tiles_kernel as held
from insonify.scene.scatterer_grid import PARTS, TILE, DrawnScatterers, ScattererGrid, prefix_sizes
from insonify.scene.terrain._gradient_rotation_kernel import rotate

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
    rows, old_rows = (DrawnScatterers(np.zeros(n, np.uint16), np.full((n, 3), np.nan)) for n in (4000, 2000))
    table, old_table = np.zeros((2, 256, 3), np.int64)
    used, first, own = 0, 0, {}
    for key in range(60):
        for half, chance in ((0, 0.5), (1, 0.5)):
            size = int(rng.integers(1, 20))
            if rng.random() > chance:
                continue
            start = used if half == 0 else first
            target = rows if half == 0 else old_rows
            target.terrain[start : start + size] = np.stack(
                [np.full(size, key), np.arange(size), np.zeros(size)], axis=-1
            )
            target.cell[start : start + size] = 100 * key + np.arange(size)
            held.put(*np.array([[key], [start], [size]]), table if half == 0 else old_table)
            used, first = used + size * (half == 0), first + size * (half == 1)
            own[key] = max(own.get(key, 0), size)
    key, size = rng.permutation(80)[:50], rng.integers(0, 25, 50)
    before = {int(k): int(table[held.find_slot(k, table), 2]) for k in key}
    start, known = np.empty((2, 50), np.int64)
    end, new = held.find(key, size, table, rows, old_table, old_rows, used, start, known)
    np.testing.assert_array_equal(known, np.minimum([own.get(int(k), 0) for k in key], size))
    for k, at, there in zip(key, start, known, strict=True):
        expected = np.stack([np.full(there, k), np.arange(there)], -1)
        np.testing.assert_array_equal(rows.terrain[at : at + there, :2], expected)
        np.testing.assert_array_equal(rows.cell[at : at + there], 100 * k + np.arange(there))
    rooms = sorted((at, at + n) for k, at, n in zip(key, start, size, strict=True) if before[int(k)] < n)
    assert [a for a, _ in rooms] == [used, *(b for _, b in rooms)][: len(rooms)] and end == max(
        [used, *(b for _, b in rooms)]
    )
    assert new == sum(before[int(k)] == 0 and there == n > 0 for k, there, n in zip(key, known, size, strict=True))
    count = int(np.sum(size - known))
    made = DrawnScatterers(np.arange(count).astype(np.uint16), np.arange(3.0 * count).reshape(-1, 3))
    held.fill(made, start, known, size, rows)
    for column, source in zip(rows, made, strict=True):
        put = [column[at + there : at + n] for at, there, n in zip(start, known, size, strict=True)]
        np.testing.assert_array_equal(np.concatenate(put), source)


@given(st.lists(st.lists(st.floats(-0.1, 1), min_size=PARTS**2, max_size=PARTS**2), min_size=1, max_size=6),
       st.floats(1e-3, 1))  # fmt: skip
@settings(max_examples=80, deadline=None)
def test_as_many_are_requested_as_may_be_kept_or_a_quarter_or_a_quarter_of_that(shares, density):
    """Never fewer than any that may be kept, less than four times and a bit as many, part of a whole that quarters."""
    fractions = np.minimum(np.array(shares).reshape(-1, PARTS, PARTS), density)
    size = prefix_sizes(fractions, np.full(len(fractions), density))
    for most, n in zip(fractions.max(axis=(1, 2)), size.tolist(), strict=True):
        needed, whole = np.ceil(max(most, 0) * TILE**2), np.ceil(density * TILE**2)
        assert needed <= n <= whole and (n > 0) == (needed > 0) and (n == whole or n < 4 * needed + 1)
        assert n in [0, *(int(np.ceil(whole / 4**power)) for power in range(7))]


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
