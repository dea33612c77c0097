"""Claims about cached heightmap tiles in kernels: each is synthesised once, and read by its own number."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from insonify.scene.heightmap_cache import CELLS, NODES, HeightmapCache

SIDE = 0.5 * CELLS
ORIGIN = np.zeros(2)


def tile(along, across):
    """A page that states at each node where it lies."""
    nodes = np.arange(NODES, dtype=np.float32)
    return (along * CELLS + nodes[:, None]) * 1000 + across * CELLS + nodes


def read(paged, places, drawn=None, extent=(ORIGIN, ORIGIN)):
    """What the map states at nodes, requested page by page as a kernel would: one missing page at a time."""
    found, done = np.zeros(len(places)), np.zeros(len(places), bool)

    def draw(a, b):
        if drawn is not None:
            drawn.append((a, b))
        return tile(a, b)

    def evaluate(pages, requested):
        for n in np.flatnonzero(~done):
            i, j = places[n] - np.array([pages.corner_a, pages.corner_b]) * CELLS
            row, column = i // CELLS, j // CELLS
            if not (0 < row < requested.shape[0] - 1 and 0 < column < requested.shape[1] - 1):
                requested[0, 0] = True
                return False
            at = pages.row_of[row * requested.shape[1] + column]
            if at < 0:
                requested[row, column] = True
                return False
            found[n], done[n] = pages.heights[(at * NODES + i % CELLS) * NODES + j % CELLS], True
        return True

    paged.serve_kernel(0.5, *extent, draw, evaluate)
    return found


@pytest.mark.parametrize("most", [1 << 30, 40 * NODES**2])
def test_a_map_read_by_pages_is_the_map(most):
    """Nodes far from where the question began, many times: right, whether pages are forgotten between or not."""
    paged, rng = HeightmapCache(most), np.random.default_rng(1)
    for _ in range(5):
        places = rng.integers(-600, 600, (40, 2))
        np.testing.assert_array_equal(read(paged, places), places @ [1000, 1])


def test_a_page_is_drawn_once():
    """The same nodes again request nothing."""
    paged, places, drawn = HeightmapCache(), np.random.default_rng(2).integers(-300, 300, (50, 2)), []
    read(paged, places, drawn)
    first = len(drawn)
    read(paged, places, drawn)
    assert first == len(set(drawn)) == len(drawn)


def places_of(tiles):
    """A node in each of some tiles."""
    return np.array([[along * CELLS + 3, across * CELLS + 5] for along, across in tiles])


def test_the_memory_of_a_straight_survey_does_not_grow_and_no_tile_is_drawn_twice():
    """Thousands of tiles in a line, each read by a few successive pings: two halves of the first size."""
    paged, drawn, memory = HeightmapCache(1 << 30, min_tiles=64), [], set()
    for ping in range(1500):
        places = places_of([(ping + k, side) for k in range(4) for side in (-1, 2)])
        read(paged, places, drawn, (0.5 * places.min(axis=0), 0.5 * places.max(axis=0)))
        memory.add(paged._current.heights.ctypes.data)
    assert len(drawn) == len(set(drawn)) == 2 * 1503
    assert len(memory) <= 3 and paged._current.capacity == 64


@pytest.mark.parametrize("calls", [1, 3, 6])
def test_halves_grow_to_hold_what_every_ping_reads(calls):
    """Many more tiles than a half holds at first, in one call or in several: soon none is drawn again."""
    paged, drawn = HeightmapCache(1 << 30, min_tiles=16), []
    tiles = [(a, b) for a in range(12) for b in range(12)]
    for _ in range(20):
        drawn.clear()
        for part in range(calls):
            read(paged, places_of(tiles[part::calls]), drawn)
    assert drawn == []


def test_tiles_that_are_read_stay_while_others_fill_the_memory():
    """A kernel that evaluates for long sees its own tiles, whatever other calls read meanwhile."""
    paged = HeightmapCache(1 << 30, min_tiles=8)

    def evaluate(pages, requested):
        before = pages.heights.copy()
        for number in range(60):
            read(paged, places_of([(number, 0), (number, 3)]))
        np.testing.assert_array_equal(pages.heights[: 2 * NODES**2], before[: 2 * NODES**2])
        return True

    read(paged, places_of([(0, 0), (1, 1)]))
    paged.serve_kernel(0.5, np.zeros(2), np.zeros(2), tile, evaluate)


def test_a_previous_half_is_read_as_it_was_when_the_kernel_began():
    """Another kernel, for which that half is still the current one, may extend its table meanwhile."""
    paged, drawn = HeightmapCache(1 << 30, min_tiles=8), []
    near = places_of([(number, 0) for number in range(6)])
    read(paged, near)
    for number in range(10, 15):  # a new half begins
        read(paged, places_of([(number, 0)]))
    begin, calls = paged._previous.begin, []

    def evaluate(pages, requested):
        calls.append(requested.shape)
        if len(calls) == 1:
            requested[2 - pages.corner_a, -pages.corner_b] = True
            paged._previous.begin = begin[0] + 1, begin[1]  # half extended: the table follows
            return False
        row = pages.row_of[(2 - pages.corner_a) * requested.shape[1] - pages.corner_b]
        np.testing.assert_array_equal(pages.heights[row * NODES**2 : (row + 1) * NODES**2], tile(2, 0).ravel())
        return True

    def draw(along, across):
        drawn.append((along, across))
        return tile(along, across)

    paged.serve_kernel(0.5, ORIGIN, ORIGIN, draw, evaluate)
    assert len(calls) == 2 and drawn == []


def test_threads_share_tiles():
    """Eight readers of one small store, which loses: each reads the map."""
    paged, rng = HeightmapCache(60 * NODES**2), np.random.default_rng(3)
    requested = [rng.integers(-400, 400, (20, 2)) for _ in range(200)]
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda places: read(paged, places), requested))
    for places, heights in zip(requested, found, strict=True):
        np.testing.assert_array_equal(heights, places @ [1000, 1])
