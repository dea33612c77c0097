"""Rows of the cached tiles of a map, and their replacement. Plain numbers and arrays only."""

from typing import Any

from numpy.typing import NDArray

from insonify.jit import njit

Integers = NDArray[Any]

EMPTY = -(2**63)
"""Number that marks an empty slot or row."""


@njit(cache=True, nogil=True)
def fits(tiles: Integers, slot: Integers, number: Integers, readers: Integers) -> bool:
    """Return True if some tiles fit in addition to those that other threads read; for the arguments see `claim`."""
    table_size, is_occupied, missing, available = slot.shape[0], False, 0, 0
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % table_size, tiles[w, 1] % table_size
        row, is_same_tile = slot[a, b], number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]
        missing += 0 if is_same_tile else 1
        is_occupied |= not is_same_tile and row >= 0 and readers[row] > 0
        available += 1 if is_same_tile and readers[row] == 0 else 0
    if missing == 0 or readers.max() == 0:
        return True
    for row in range(readers.size):
        available += 1 if readers[row] > 0 else 0
    return not is_occupied and available + missing <= readers.size


@njit(cache=True, nogil=True)
def claim(
    tiles: Integers, slot: Integers, number: Integers, row_numbers: Integers, last_read: Integers, readers: Integers,
    ticket: int, used: int, min_new_rows: int, recent_reads: int, new_rows: Integers,
) -> tuple[int, int]:  # fmt: skip
    """Assign rows to tiles, replacing the least recently used.

    Args:
        tiles: Numbers of the tiles, each once, (n, 2).
        slot: Row of each tile, by its numbers modulo the size of this table, -1 for none, (table_size, table_size).
        number: Numbers of the tile in each slot, (table_size, table_size, 2).
        row_numbers: Numbers of the tile in each row, (rows, 2).
        last_read: Ticket of the latest reading of each row, (rows,).
        readers: Number of current readers of each row, (rows,).
        ticket: Ticket of this reading.
        used: Number of rows used so far.
        min_new_rows: Number of rows that are used before any is reused.
        recent_reads: Readings within which a tile is likely to be read again.
        new_rows: Result, rows of tiles that were not cached, (at least n,).

    Returns:
        Number of these new rows, and number of rows used afterwards.
    """
    table_size, count = slot.shape[0], 0
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % table_size, tiles[w, 1] % table_size
        if number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]:
            last_read[slot[a, b]] = ticket
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % table_size, tiles[w, 1] % table_size
        if number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]:
            continue
        row = used
        if row >= min(min_new_rows, row_numbers.shape[0]):  # first use of new memory takes longer than the synthesis
            oldest, age = 0, ticket + 1
            for k in range(used):
                last = ticket if readers[k] > 0 else last_read[k]
                if last < age:
                    oldest, age = k, last
            if row == row_numbers.shape[0] or last_read[oldest] < ticket - recent_reads:
                row = oldest
        used = max(used, row + 1)
        if row_numbers[row, 0] != EMPTY:
            slot[row_numbers[row, 0] % table_size, row_numbers[row, 1] % table_size] = -1
            number[row_numbers[row, 0] % table_size, row_numbers[row, 1] % table_size] = EMPTY
        if slot[a, b] >= 0:
            row_numbers[slot[a, b]] = EMPTY
        slot[a, b], last_read[row], new_rows[count] = row, ticket, row
        number[a, b], row_numbers[row] = tiles[w], tiles[w]
        count += 1
    return count, used
