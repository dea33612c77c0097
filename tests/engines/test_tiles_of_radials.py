"""Claims about the tiles of the map that radials cross."""

import numpy as np
import pytest

from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation._radial_terrain_kernel import CELLS, mark_tiles, numbers_of_marked
from insonify.engines.radial_tables import RadialFrame

CELL, STEP = 0.02, 0.03


@pytest.mark.parametrize("stride", [1.0, 8.0, 100.0])
def test_the_tile_of_every_sample_is_marked_and_no_other(stride):
    """Radials all around, of 1, of 16 and of 17 samples and of many: the same tiles as sample by sample."""
    bearing = np.linspace(0, 2 * np.pi, 77)
    counts = np.array([1, 16, 17, int(800 / stride)])
    radials = np.zeros((len(bearing), 9))
    radials[:, column.COSINE], radials[:, column.SINE] = np.cos(bearing), np.sin(bearing)
    radials[:, column.STRIDE], radials[:, column.FIRST_SAMPLE] = stride, np.linspace(0, 3, len(bearing))
    rows = np.arange(len(bearing)) % len(counts)
    frame = RadialFrame(60.3, 60.7, 0.0, STEP)
    crossed = np.zeros((100, 100), bool)
    mark_tiles(frame, radials, counts, rows, CELL, crossed)
    expected = set()
    for radial, row in zip(radials, rows, strict=True):
        along = (np.arange(counts[row]) + radial[column.FIRST_SAMPLE]) * STEP * stride / CELL
        tiles = (np.array([[frame.origin_along], [frame.origin_across]]) / CELL + along * np.array(
            [[radial[column.COSINE]], [radial[column.SINE]]])) // CELLS  # fmt: skip
        expected |= set(map(tuple, tiles.T.astype(int).tolist()))
    assert expected == set(map(tuple, np.argwhere(crossed).tolist()))
    np.testing.assert_array_equal(numbers_of_marked(crossed), np.argwhere(crossed))
