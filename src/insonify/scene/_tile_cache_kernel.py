"""Cache of the tiles of a map: a table of tile numbers, and rows with the least recently read replaced first.

The table is direct mapped: tile (a, b) can only be in slot (a modulo table_size, b modulo table_size). A slot holds the
row of a cached tile, and that row of another array the tile's heights. Plain numbers and arrays only.
"""

from typing import Any

from numpy.typing import NDArray

from insonify.jit import njit

Integers = NDArray[Any]

EMPTY = -(2**63)
"""Number that marks an empty slot or row."""


@njit(cache=True, nogil=True)
def fits(tiles: Integers, slot: Integers, number: Integers, readers: Integers) -> bool:
    """Return True if all of some tiles can be cached at once without replacing a tile that a thread reads.

    Arguments are those of `claim`. Rows that are being read, and cached tiles among the requested, are retained; the
    others must suffice for the missing tiles, and no missing tile may have the slot of a tile that is being read.
    """
    table_size, is_occupied, missing, retained = slot.shape[0], False, 0, 0
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % table_size, tiles[w, 1] % table_size
        row, is_same_tile = slot[a, b], number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]
        missing += 0 if is_same_tile else 1
        is_occupied |= not is_same_tile and row >= 0 and readers[row] > 0
        retained += 1 if is_same_tile and readers[row] == 0 else 0
    if missing == 0 or readers.max() == 0:
        return True
    for row in range(readers.size):
        retained += 1 if readers[row] > 0 else 0
    return not is_occupied and retained + missing <= readers.size


@njit(cache=True, nogil=True)
def claim(
    tiles: Integers, slot: Integers, number: Integers, row_numbers: Integers, last_read: Integers, readers: Integers,
    reading: int, used: int, min_new_rows: int, recent_reads: int, new_rows: Integers,
) -> tuple[int, int]:  # fmt: skip
    """Assign rows to tiles, replacing the least recently read.

    Args:
        tiles: Numbers of the tiles, each once, (n, 2).
        slot: Row of the tile in each slot of the table, -1 for none, (table_size, table_size); changed.
        number: Numbers of the tile in each slot, `EMPTY` for none, (table_size, table_size, 2); changed.
        row_numbers: Numbers of the tile in each row, `EMPTY` for none, (rows, 2); changed.
        last_read: Number of the latest reading of each row, (rows,); changed.
        readers: Number of threads that read each row at the moment, (rows,).
        reading: Number of this reading, counted up by one for each.
        used: Number of rows used so far.
        min_new_rows: Number of rows that are used before any is replaced.
        recent_reads: Number of latest readings whose tiles are likely to be read again; while all rows are that
            recent, further unused rows are taken.
        new_rows: Result: row of each tile that was not cached, (at least n,).

    Returns:
        Number of new rows, and number of rows used afterwards.
    """
    table_size, count = slot.shape[0], 0
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % table_size, tiles[w, 1] % table_size
        if number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]:
            last_read[slot[a, b]] = reading
    for w in range(tiles.shape[0]):
        a, b = tiles[w, 0] % table_size, tiles[w, 1] % table_size
        if number[a, b, 0] == tiles[w, 0] and number[a, b, 1] == tiles[w, 1]:
            continue
        row = used
        if row >= min(min_new_rows, row_numbers.shape[0]):  # first use of new memory takes longer than the synthesis
            oldest, age = 0, reading + 1
            for k in range(used):
                last = reading if readers[k] > 0 else last_read[k]
                if last < age:
                    oldest, age = k, last
            if row == row_numbers.shape[0] or last_read[oldest] < reading - recent_reads:
                row = oldest
        used = max(used, row + 1)
        if row_numbers[row, 0] != EMPTY:
            slot[row_numbers[row, 0] % table_size, row_numbers[row, 1] % table_size] = -1
            number[row_numbers[row, 0] % table_size, row_numbers[row, 1] % table_size] = EMPTY
        if slot[a, b] >= 0:
            row_numbers[slot[a, b]] = EMPTY
        slot[a, b], last_read[row], new_rows[count] = row, reading, row
        number[a, b], row_numbers[row] = tiles[w], tiles[w]
        count += 1
    return count, used


@njit(cache=True, nogil=True)
def begin_reading(tiles: Integers, slot: Integers, readers: Integers, rows: Integers) -> None:
    """Count one more reader of some cached tiles.

    Args:
        tiles: Numbers of the tiles, each once, (n, 2).
        slot: See `claim`.
        readers: See `claim`; changed.
        rows: Result: row of each tile, (n,).
    """
    table_size = slot.shape[0]
    for w in range(tiles.shape[0]):
        rows[w] = slot[tiles[w, 0] % table_size, tiles[w, 1] % table_size]
        readers[rows[w]] += 1
