"""Rows of the cached tiles of a map, and their replacement. Plain numbers and arrays only."""

from typing import Any

from numpy.typing import NDArray

from insonify.jit import njit

Integers = NDArray[Any]

EMPTY = -(2**63)
"""Number that marks an empty slot or row."""


@njit(cache=True, nogil=True)
def fits(tiles: Integers, slot: Integers, number: Integers, readers: Integers) -> bool:
    """Return True if some tiles fit beside those that other threads read; arguments as of `claim`."""
    around, taken, missing, held = slot.shape[0], False, 0, 0
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % around, tiles[w, 1] % around
        row, is_same_tile = slot[a, b], number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]
        missing += 0 if is_same_tile else 1
        taken |= not is_same_tile and row >= 0 and readers[row] > 0
        held += 1 if is_same_tile and readers[row] == 0 else 0
    if missing == 0 or readers.max() == 0:
        return True
    for row in range(readers.size):
        held += 1 if readers[row] > 0 else 0
    return not taken and held + missing <= readers.size


@njit(cache=True, nogil=True)
def claim(
    tiles: Integers, slot: Integers, number: Integers, held: Integers, last_read: Integers, readers: Integers,
    ticket: int, used: int, fresh: int, lately: int, blank: Integers,
) -> tuple[int, int]:  # fmt: skip
    """Assign rows to tiles, replacing the least recently used.

    Args:
        tiles: Numbers of the tiles, each once, (n, 2).
        slot: Row of each tile, by its numbers modulo the size of this table, -1 for none, (around, around).
        number: Numbers of the tile in each slot, (around, around, 2).
        held: Numbers of the tile in each row, (rows, 2).
        last_read: Ticket of the latest reading of each row, (rows,).
        readers: Number of current readers of each row, (rows,).
        ticket: Ticket of this reading.
        used: Number of rows used so far.
        fresh: Number of rows that are used before any is reused.
        lately: Readings within which a tile is likely to be read again.
        blank: Result, rows of tiles that were not cached, (at least n,).

    Returns:
        Number of these rows, and number of rows used so far.
    """
    around, count = slot.shape[0], 0
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % around, tiles[w, 1] % around
        if number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]:
            last_read[slot[a, b]] = ticket
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % around, tiles[w, 1] % around
        if number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]:
            continue
        row = used
        if row >= min(fresh, held.shape[0]):  # first use of new memory takes longer than the synthesis
            oldest, age = 0, ticket + 1
            for k in range(used):
                last = ticket if readers[k] > 0 else last_read[k]
                if last < age:
                    oldest, age = k, last
            if row == held.shape[0] or last_read[oldest] < ticket - lately:
                row = oldest
        used = max(used, row + 1)
        if held[row, 0] != EMPTY:
            slot[held[row, 0] % around, held[row, 1] % around] = -1
            number[held[row, 0] % around, held[row, 1] % around] = EMPTY
        if slot[a, b] >= 0:
            held[slot[a, b]] = EMPTY
        slot[a, b], last_read[row], blank[count] = row, ticket, row
        number[a, b], held[row] = tiles[w], tiles[w]
        count += 1
    return count, used
