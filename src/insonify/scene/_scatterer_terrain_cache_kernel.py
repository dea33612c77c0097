"""Rows of the cached points of tiles: a table of tiles by key. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_SPREAD = np.uint64(0x9E3779B97F4A7C15)


@njit(cache=True, nogil=True)
def find_slot(key: np.int64, table: Integers) -> int:
    """Row of a table (slots, 3) of key, first row and size that a key has, or the empty one where it would be put.

    The number of slots is a power of two, and one of them at least is empty: its size is 0.

    Source: linear probing after multiplicative hashing, Knuth (1998), The Art of Computer Programming 3, 6.4.
    """
    last = table.shape[0] - 1
    slot = np.int64((np.uint64(key) * _SPREAD) >> np.uint64(20)) & last
    while table[slot, 2] > 0 and table[slot, 0] != key:
        slot = (slot + 1) & last
    return slot


@njit(cache=True, nogil=True)
def put(key: Integers, start: Integers, size: Integers, table: Integers) -> int:
    """Enter tiles into a table; a smaller one of the same key is replaced. Returns how many keys are new."""
    new = 0
    for n in range(key.size):
        slot = find_slot(key[n], table)
        new += table[slot, 2] == 0
        if table[slot, 2] < size[n]:
            table[slot, 0], table[slot, 1], table[slot, 2] = key[n], start[n], size[n]
    return new


@njit(cache=True, nogil=True)
def find(
    key: Integers, size: Integers, table: Integers, rows: Floats, old_table: Integers, old_rows: Floats, used: int,
    start: Integers, known: Integers,
) -> tuple[int, int]:  # fmt: skip
    """Find the rows of tiles; those of the older table are copied to the newer, for others rows are reserved.

    Of a tile of which fewer rows are known these come along.

    Args:
        key: Keys of the tiles, shape (n,).
        size: Number of requested rows of each tile, likewise.
        table: The newer table, large enough for all of them.
        rows: Its rows, likewise, shape (any, 3).
        old_table: The older.
        old_rows: Its rows.
        used: Rows in use.
        start: Result, where in `rows` each tile begins, shape (n,).
        known: Result, how many of its rows are there already, shape (n,); if fewer than requested, the rest is still to
            be filled and the tile to be put.

    Returns:
        Rows in use now, and tiles new in the table.
    """
    new = 0
    for n in range(key.size):
        slot, before = find_slot(key[n], table), find_slot(key[n], old_table)
        if table[slot, 2] >= size[n]:
            start[n], known[n] = table[slot, 1], size[n]
            continue
        start[n], known[n] = used, min(max(old_table[before, 2], table[slot, 2]), size[n])
        for row in range(known[n]):
            for column in range(3):
                if old_table[before, 2] >= known[n]:
                    rows[used + row, column] = old_rows[old_table[before, 1] + row, column]
                else:
                    rows[used + row, column] = rows[table[slot, 1] + row, column]
        if known[n] == size[n]:
            new += table[slot, 2] == 0
            table[slot, 0], table[slot, 1], table[slot, 2] = key[n], used, size[n]
        used += size[n]
    return used, new


@njit(cache=True, nogil=True)
def fill(computed: Floats, start: Integers, known: Integers, size: Integers, rows: Floats) -> None:
    """Put the rows of tiles that were not known, made (any, 3) one tile after the other, where each begins."""
    done = 0
    for n in range(start.size):
        for row in range(known[n], size[n]):
            for column in range(3):
                rows[start[n] + row, column] = computed[done, column]
            done += 1
