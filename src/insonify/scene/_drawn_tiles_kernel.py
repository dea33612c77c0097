"""Rows of drawn tiles in memory: a table of tiles by key. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scene.scatterer_grid import DrawnScatterers

Integers = NDArray[np.int64]

_HASH_FACTOR = np.uint64(0x9E3779B97F4A7C15)
_NEIGHBOUR_BITS = 3
"""Bits of the key of which the tiles, 8 side by side, have slots side by side: they are looked up in succession."""


@njit(cache=True, nogil=True)
def find_slot(key: np.int64, table: Integers) -> int:
    """Slot of a key in a table (slots, 3) of key, first row and size, or the empty slot for a new key.

    The number of slots is a power of two, and at least one of them is empty: its size is 0.

    Source: linear probing after multiplicative hashing, Knuth (1998), The Art of Computer Programming 3, 6.4.
    """
    last = table.shape[0] - 1
    group = np.int64(((np.uint64(key) >> np.uint64(_NEIGHBOUR_BITS)) * _HASH_FACTOR) >> np.uint64(40))
    slot = ((group << _NEIGHBOUR_BITS) + (key & ((1 << _NEIGHBOUR_BITS) - 1))) & last
    while table[slot, 2] > 0 and table[slot, 0] != key:
        slot = (slot + 1) & last
    return slot


@njit(cache=True, nogil=True)
def put(key: Integers, start: Integers, size: Integers, table: Integers) -> int:
    """Enter tiles into a table, replacing smaller ones of the same key; return the number of new keys.

    Args:
        key: Keys of the tiles, shape (n,).
        start: First row of each tile, shape (n,).
        size: Number of rows of each tile, shape (n,).
        table: Table, changed, see `find_slot`.
    """
    new = 0
    for n in range(key.size):
        slot = find_slot(key[n], table)
        new += table[slot, 2] == 0
        if table[slot, 2] < size[n]:
            table[slot, 0], table[slot, 1], table[slot, 2] = key[n], start[n], size[n]
    return new


@njit(cache=True, nogil=True)
def find(
    key: Integers, size: Integers, table: Integers, rows: DrawnScatterers, old_table: Integers,
    old_rows: DrawnScatterers, used: int, start: Integers, known: Integers,
) -> tuple[int, int]:  # fmt: skip
    """Find the rows of tiles: rows in the older table are copied to the newer, and rows of others are reserved.

    The known rows of a tile are copied even if more are requested.

    Args:
        key: Keys of the tiles, shape (n,).
        size: Number of requested rows of each tile, shape (n,).
        table: The newer table, with enough empty slots.
        rows: Rows of the newer table, with enough unused ones.
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
        start[n], known[n] = 0, 0
        if size[n] == 0:
            continue
        slot = find_slot(key[n], table)
        if table[slot, 2] >= size[n]:
            start[n], known[n] = table[slot, 1], size[n]
            continue
        old_slot = find_slot(key[n], old_table)
        start[n], known[n] = used, min(max(old_table[old_slot, 2], table[slot, 2]), size[n])
        if old_table[old_slot, 2] >= known[n]:
            _copy(old_rows, old_table[old_slot, 1], known[n], rows, used)
        else:
            _copy(rows, table[slot, 1], known[n], rows, used)
        if known[n] == size[n]:
            new += table[slot, 2] == 0
            table[slot, 0], table[slot, 1], table[slot, 2] = key[n], used, size[n]
        used += size[n]
    return used, new


@njit(cache=True, nogil=True)
def fill(drawn: DrawnScatterers, start: Integers, known: Integers, size: Integers, rows: DrawnScatterers) -> None:
    """Copy drawn rows, tile after tile, to the unknown rows of each tile.

    Args:
        drawn: The unknown rows of all tiles in succession.
        start: First row of each tile in `rows`, shape (n,).
        known: Number of known rows of each tile, shape (n,).
        size: Number of requested rows of each tile, shape (n,).
        rows: Result.
    """
    first = 0
    for n in range(start.size):
        count = size[n] - known[n]
        _copy(drawn, first, count, rows, start[n] + known[n])
        first += count


@njit(cache=True, nogil=True)
def _copy(source: DrawnScatterers, first: int, count: int, target: DrawnScatterers, begin: int) -> None:
    """Copy a number of rows to others, in loops: to compile an assignment of slices takes a second."""
    cell, new_cell = source.cell[first : first + count], target.cell[begin : begin + count]
    for n in range(new_cell.size):
        new_cell[n] = cell[n]
    if target.terrain.shape[0] > 0:
        terrain, new_terrain = source.terrain[first : first + count], target.terrain[begin : begin + count]
        for n in range(new_terrain.shape[0]):
            for column in range(3):
                new_terrain[n, column] = terrain[n, column]
