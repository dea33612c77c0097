"""Rows of the cached points of tiles: a table of tiles by key. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_HASH_FACTOR = np.uint64(0x9E3779B97F4A7C15)


@njit(cache=True, nogil=True)
def find_slot(key: np.int64, table: Integers) -> int:
    """Slot of a key in a table (slots, 3) of key, first row and size, or the empty slot for a new key.

    The number of slots is a power of two, and at least one of them is empty: its size is 0.

    Source: linear probing after multiplicative hashing, Knuth (1998), The Art of Computer Programming 3, 6.4.
    """
    last = table.shape[0] - 1
    slot = np.int64((np.uint64(key) * _HASH_FACTOR) >> np.uint64(20)) & last
    while table[slot, 2] > 0 and table[slot, 0] != key:
        slot = (slot + 1) & last
    return slot


@njit(cache=True, nogil=True)
def put(key: Integers, start: Integers, size: Integers, table: Integers) -> int:
    """Enter tiles into a table, replacing smaller ones of the same key; return the number of new keys."""
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
    """Find the rows of tiles: rows in the older table are copied to the newer, and rows of others are reserved.

    The known rows of a tile are copied even if more are requested.

    Args:
        key: Keys of the tiles, shape (n,).
        size: Number of requested rows of each tile, shape (n,).
        table: The newer table, with enough empty slots.
        rows: Rows of the newer table, with enough unused ones, shape (any, 3).
        old_table: The older table.
        old_rows: Rows of the older table.
        used: Number of rows in use.
        start: Result, first row of each tile in `rows`, shape (n,).
        known: Result, number of known rows of each tile, shape (n,); if fewer than requested, `fill` and `put` must
            follow.

    Returns:
        Number of rows in use afterwards, and number of new tiles in the table.
    """
    new = 0
    for n in range(key.size):
        slot, old_slot = find_slot(key[n], table), find_slot(key[n], old_table)
        if table[slot, 2] >= size[n]:
            start[n], known[n] = table[slot, 1], size[n]
            continue
        start[n], known[n] = used, min(max(old_table[old_slot, 2], table[slot, 2]), size[n])
        for row in range(known[n]):
            for column in range(3):
                if old_table[old_slot, 2] >= known[n]:
                    rows[used + row, column] = old_rows[old_table[old_slot, 1] + row, column]
                else:
                    rows[used + row, column] = rows[table[slot, 1] + row, column]
        if known[n] == size[n]:
            new += table[slot, 2] == 0
            table[slot, 0], table[slot, 1], table[slot, 2] = key[n], used, size[n]
        used += size[n]
    return used, new


@njit(cache=True, nogil=True)
def fill(computed: Floats, start: Integers, known: Integers, size: Integers, rows: Floats) -> None:
    """Copy computed rows (any, 3), tile after tile, to the unknown rows of each tile."""
    next_row = 0
    for n in range(start.size):
        for row in range(known[n], size[n]):
            for column in range(3):
                rows[start[n] + row, column] = computed[next_row, column]
            next_row += 1
