"""Claims about tiles that fit in a cache together with those that other threads read, by sets in place of tables."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from insonify.scene._tile_cache_kernel import EMPTY, claim, fits

SIDE, ROWS = 3, 5
TILES = st.lists(
    st.tuples(st.integers(0, 6), st.integers(0, 4)), min_size=1, max_size=4,
    unique_by=lambda tile: (tile[0] % SIDE, tile[1] % SIDE),
)  # fmt: skip


class Cache:
    """Tables of a small cache, with all rows in use from the first claims on."""

    def __init__(self):
        self.slot, self.number = np.full((SIDE, SIDE), -1), np.full((SIDE, SIDE, 2), EMPTY)
        self.row_numbers, self.last_read, self.readers = (
            np.full((ROWS, 2), EMPTY),
            np.zeros(ROWS, int),
            np.zeros(ROWS, int),
        )
        self.reading = self.used = 0

    def claim(self, tiles):
        """Assign rows to tiles in the next reading."""
        self.reading += 1
        _, self.used = claim(
            np.array(tiles), self.slot, self.number, self.row_numbers, self.last_read, self.readers, self.reading,
            self.used, ROWS, 2, np.empty(len(tiles), int),
        )  # fmt: skip

    def fits(self, tiles):
        """Return True if the tiles fit together with those being read."""
        return fits(np.array(tiles), self.slot, self.number, self.readers)

    def cached(self):
        """Row of each cached tile."""
        return {tuple(tile): row for row, tile in enumerate(self.row_numbers.tolist()) if tile[0] != EMPTY}


@given(st.lists(TILES, min_size=1, max_size=6), st.sets(st.integers(0, ROWS - 1)), TILES)
def test_tiles_fit_where_rows_and_slots_suffice_beside_those_being_read(earlier, read_rows, tiles):
    """Rows that are read, and cached ones among the tiles, stay; no missing tile has the slot of one being read."""
    cache = Cache()
    for group in earlier:
        cache.claim(group)
    cached = cache.cached()
    read = {tile for tile, row in cached.items() if row in read_rows}
    cache.readers[[cached[tile] for tile in read]] = 1
    missing = set(tiles) - set(cached)
    slots = {(tile[0] % SIDE, tile[1] % SIDE) for tile in read}
    is_free = not any((tile[0] % SIDE, tile[1] % SIDE) in slots for tile in missing)
    has_rows = len(read | (set(tiles) & set(cached))) + len(missing) <= ROWS
    assert cache.fits(tiles) == (not missing or not read or (is_free and has_rows))
    if cache.fits(tiles):
        cache.claim(tiles)
        assert (read | set(tiles)) <= set(cache.cached())
