"""Where the points of tiles are held: a table of tiles by key, and their rows. Plain numbers and arrays only."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_SPREAD = np.uint64(0x9E3779B97F4A7C15)


@njit(cache=True, nogil=True)
def slot_of(key: np.int64, table: Integers) -> int:
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
        slot = slot_of(key[n], table)
        new += table[slot, 2] == 0
        if table[slot, 2] < size[n]:
            table[slot, 0], table[slot, 1], table[slot, 2] = key[n], start[n], size[n]
    return new


@njit(cache=True, nogil=True)
def find(
    key: Integers,
    size: Integers,
    table: Integers,
    rows: Floats,
    old_table: Integers,
    old_rows: Floats,
    used: int,
    start: Integers,
    missing: NDArray[np.bool_],
) -> tuple[int, int]:
    """Find the rows of tiles; those of the older table move to the newer, for others room is set apart.

    Args:
        key: Keys of the tiles, shape (n,).
        size: Rows that are wanted of each, likewise.
        table: The newer table, with room for all of them.
        rows: Its rows, likewise, shape (any, 3).
        old_table: The older.
        old_rows: Its rows.
        used: Rows in use.
        start: Result, where in `rows` each tile begins, shape (n,).
        missing: Result, whether its rows are still to be filled and the tile to be put, likewise.

    Returns:
        Rows in use now, and tiles new in the table.
    """
    new = 0
    for n in range(key.size):
        slot = slot_of(key[n], table)
        missing[n] = False
        if table[slot, 2] >= size[n]:
            start[n] = table[slot, 1]
            continue
        before = slot_of(key[n], old_table)
        count = old_table[before, 2]
        start[n] = used
        if count >= size[n]:
            for row in range(size[n]):
                for column in range(3):
                    rows[used + row, column] = old_rows[old_table[before, 1] + row, column]
            new += table[slot, 2] == 0
            table[slot, 0], table[slot, 1], table[slot, 2] = key[n], used, size[n]
        else:
            missing[n] = True
        used += size[n]
    return used, new


@njit(cache=True, nogil=True)
def fill(made: Floats, start: Integers, size: Integers, rows: Floats) -> None:
    """Put the rows of tiles, made (any, 3) one tile after the other, where each begins."""
    done = 0
    for n in range(start.size):
        for row in range(size[n]):
            for column in range(3):
                rows[start[n] + row, column] = made[done + row, column]
        done += size[n]


@njit(cache=True, nogil=True)
def gather(rows: Floats, start: Integers, tile: Integers, rank: Integers, height: Floats, slope: Floats) -> None:
    """The rows of some points of tiles, as height (n,) and slope (n, 2).

    Args:
        rows: Shape (any, 3).
        start: First row of each tile.
        tile: Row of each point's tile in `start`, shape (n,).
        rank: Place of the point in its tile, likewise.
        height: Result.
        slope: Result.
    """
    for n in range(tile.size):
        row = start[tile[n]] + rank[n]
        height[n], slope[n, 0], slope[n, 1] = rows[row, 0], rows[row, 1], rows[row, 2]
