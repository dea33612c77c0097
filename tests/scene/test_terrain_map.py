"""The map of the terrain and its grid: tiles that come, stay and go, cubics, keys."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import insonify.scene.terrain_map as module
from insonify import random_keys
from insonify.scene._heightmap_kernel import add_upsampled, synthesize_octaves
from insonify.scene.scatterer_grid import BASE_PITCH, TILE, ScattererGrid, Tiles
from insonify.scene.seabed import Seabed
from insonify.scene.seabed_terrain import TILE_CELLS
from insonify.scene.terrain.octaves import quantiles, unit_octave
from insonify.scene.terrain_map import CACHE_SIDE, TerrainMap, empty_terrain_map, terrain_map
from oracles.few_of import few_of
from oracles.heightmap_tile import heightmap_tile
from oracles.jittered_points import jittered_points

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.1}
RIPPLES = {"kind": "ripples", "wavelength": 2.0, "height": 0.1}


def bed(relief=FRACTAL, **more):
    """The ground of a seabed."""
    return Seabed(depth=20.0, relief=relief, **more).completed(1, 100e3, 1500.0).terrain


def small(monkeypatch, rows=4):
    """A map with room for a few tiles only."""
    monkeypatch.setattr(module, "MAX_TILES", rows)
    return TerrainMap(bed())


def numbers(*rows):
    """Numbers of some tiles."""
    return np.array(rows, np.int64).reshape(-1, 2)


def where(kept, along, across):
    """Row of a tile that is there, or None."""
    i, j = along % CACHE_SIDE, across % CACHE_SIDE
    return int(kept.slot[i, j]) if tuple(kept.number[i, j]) == (along, across) else None


def cubic(coefficient, x):
    """A polynomial of third degree, three columns of it."""
    return np.stack([np.polyval(row, x) for row in coefficient], axis=-1)


@pytest.mark.parametrize("margin", [0, 2])
@pytest.mark.parametrize("count", [9, 13])
def test_cubics_are_filled_in_exactly(margin, count):
    """A product of polynomials of third degree on every second node is itself on all of them."""
    rng, nodes = np.random.default_rng(1), count + 2 * margin
    a, b = rng.normal(size=(2, 3, 4))
    coarse_nodes = 2.0 * np.arange(-2, (nodes - margin + 1) // 2 + 3) / 10
    fine_nodes = (np.arange(nodes) - margin) / 10.0
    coarse = np.moveaxis(cubic(a, coarse_nodes)[:, None] * cubic(b, coarse_nodes)[None], 2, 0)
    expected = np.moveaxis(cubic(a, fine_nodes)[:, None] * cubic(b, fine_nodes)[None], 2, 0)
    fine = np.ones((3, nodes, nodes + 3), np.float32)
    # Coarse nodes start two before the first; with a margin the first fine node is one coarse node before it.
    add_upsampled(np.ascontiguousarray(coarse, np.float32), margin, nodes, fine)
    np.testing.assert_allclose(fine[:, :, :nodes], 1 + expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())
    np.testing.assert_array_equal(fine[:, :, nodes:], 1)


@few_of((0, 2), "tile", [(0, 0), (-3, 700), (40_000, -40_000)])
@pytest.mark.parametrize("per_cell", [0.05, 1.2, 6.0])
def test_an_octave_on_every_node_is_the_octave(tile, per_cell):
    """Vectors of single precision against place after place in double: 1e-5 of the largest, however fine or far."""
    cell, whole = 0.0625, unit_octave(per_cell * 0.0625, seed=3, layer=2)
    turn, shift_a, shift_b, _ = whole.placement()[0]
    k0, k1 = random_keys.stream_key(3, random_keys.TERRAIN)
    octave = np.array([[whole.pitch[0], 2 * np.pi * turn, shift_a, shift_b, whole.amplitude[0]]])
    into = np.empty((TILE_CELLS + 1, TILE_CELLS + 1, 3), np.float32)
    synthesize_octaves(*tile, cell, octave, np.array([[1, 0, 4, k0, k1]]), quantiles(), into)
    along, across = ((number * TILE_CELLS + np.arange(TILE_CELLS + 1)) * cell for number in tile)
    expected = whole.sample(along[:, None], across[None])
    np.testing.assert_allclose(into[..., 0], expected.height, atol=1e-5 * np.abs(expected.height).max())
    np.testing.assert_allclose(into[..., 1:], expected.slope, atol=2e-5 * np.abs(expected.slope).max())


def test_slopes_of_a_tile_are_the_grounds():
    """Octaves filled in by cubics change slopes by 0.7 % in the mean square, and none by more than 5 %."""
    ground = bed()
    kept = TerrainMap(ground)
    kept.synthesize(kept.claim(numbers((-2, 31))))
    along, across = ((number * TILE_CELLS + np.arange(TILE_CELLS + 1)) * kept.cell for number in (-2, 31))
    expected = ground.relief.resolved.sample_in_grid_axes(along[:, None], across[None]).slope
    off, size = kept.nodes[0, ..., 1:] - expected, expected.std()
    assert off.std() < 0.007 * size and np.abs(off).max() < 0.05 * size


@pytest.mark.parametrize("relief", [FRACTAL, RIPPLES, [FRACTAL, RIPPLES]])
@pytest.mark.parametrize("tile", [(0, 0), (-1, 5)])
def test_a_tile_is_the_ground_of_its_numbers(relief, tile):
    """Fractal octaves by cubics, other kinds by their own law: heights within 1 % of their rms, either side of 0."""
    ground = bed(relief)
    kept = TerrainMap(ground)
    (row,) = rows = kept.claim(numbers(tile))
    kept.synthesize(rows)
    expected = heightmap_tile(ground, *tile)
    off = kept.nodes[row, :, :, 0] - expected
    assert np.abs(off).max() < 0.03 * expected.std() and off.std() < 0.01 * expected.std()


def test_slopes_of_a_tile_are_those_of_its_heights():
    """Trapezoid over the slopes along both axes gives the rise from node to node, to the step's square."""
    kept = TerrainMap(bed({**RIPPLES, "wavelength": 4.0}))
    kept.synthesize(kept.claim(numbers((3, -2))))
    tile = kept.nodes[0].astype(float)
    for axis in (0, 1):
        height, slope = np.moveaxis(tile[..., 0], axis, 0), np.moveaxis(tile[..., 1 + axis], axis, 0)
        rise = np.cumsum((slope[1:] + slope[:-1]) / 2 * kept.cell, axis=0)
        np.testing.assert_allclose(rise, height[1:] - height[0], atol=0.03 * np.ptp(height))


def test_neighbouring_tiles_of_the_map_join():
    """The last nodes of one are the first of the next in height and slope, wherever they are kept."""
    kept = TerrainMap(bed())
    kept.synthesize(kept.claim(numbers((0, 0), (1, 0), (0, 1))))
    here, north, east = kept.nodes[:3]
    assert here.shape == (TILE_CELLS + 1, TILE_CELLS + 1, 3)
    np.testing.assert_allclose(here[-1], north[0], atol=2e-6)
    np.testing.assert_allclose(here[:, -1], east[:, 0], atol=2e-6)


def test_a_tile_is_synthesised_once():
    """What is there need not be drawn again, and keeps its row."""
    kept = TerrainMap(bed())
    first = kept.claim(numbers((0, 0), (0, 1)))
    assert kept._tiles[first].tolist() == [[0, 0], [0, 1]]
    second = kept.claim(numbers((0, 1), (5, 5)))
    assert kept._tiles[second].tolist() == [[5, 5]]
    assert where(kept, 0, 1) == first[1] and where(kept, 0, 0) == first[0]


def test_the_least_recently_read_tile_is_replaced(monkeypatch):
    """Four fit: a fifth takes the place of the one that was requested the longest time ago."""
    kept = small(monkeypatch)
    for n in range(4):
        kept.claim(numbers((n, 0)))
    kept.claim(numbers((0, 0)))
    kept.claim(numbers((9, 0)))
    assert where(kept, 1, 0) is None
    assert all(where(kept, n, 0) is not None for n in (0, 2, 3, 9))


def test_tiles_not_read_lately_are_replaced_before_new_memory_is_used(monkeypatch):
    """On a straight survey memory stops growing, though there would be room."""
    monkeypatch.setattr(module, "MIN_NEW_ROWS", 2)
    kept = small(monkeypatch)
    for n in range(2):
        kept.claim(numbers((n, 0)))
    for _ in range(module.RECENT_READS + 1):
        kept.claim(numbers((1, 0)))
    kept.claim(numbers((2, 0)))
    assert where(kept, 0, 0) is None and where(kept, 2, 0) == 0
    kept.claim(numbers((3, 0)))
    assert where(kept, 1, 0) == 1 and where(kept, 3, 0) == 2, "what was requested lately stays"


def test_tiles_requested_together_do_not_replace_each_other(monkeypatch):
    """As many as there is room for, old and new, whatever was there before."""
    kept = small(monkeypatch)
    kept.claim(numbers(*((n, 0) for n in range(4))))
    requested = [(3, 0), (20, 1), (21, 1), (0, 0)]
    kept.claim(numbers(*requested))
    rows = [where(kept, *tile) for tile in requested]
    assert None not in rows and len(set(rows)) == 4


def test_tiles_of_one_slot_replace_each_other():
    """Numbers that are alike modulo the extent of the map are distinguished by their own numbers."""
    kept = TerrainMap(bed())
    kept.claim(numbers((2, 3)))
    missing = kept.claim(numbers((2 + CACHE_SIDE, 3)))
    assert len(missing) == 1 and where(kept, 2, 3) is None
    assert where(kept, 2 + CACHE_SIDE, 3) == missing[0]
    assert len(kept.claim(numbers((2, 3)))) == 1


@given(st.lists(st.lists(st.tuples(st.integers(-3, 3), st.sampled_from([0, 1, CACHE_SIDE])), min_size=1, max_size=4,
                         unique_by=lambda p: (p[0], p[1] % CACHE_SIDE)), min_size=1, max_size=25))  # fmt: skip
@settings(max_examples=25, deadline=None)
def test_the_books_of_the_map_are_kept_straight(requested):
    """After any claims: each slot names a row of its own, that row names the slot, and all requests are there."""
    with pytest.MonkeyPatch.context() as patch:
        kept = small(patch, 5)
    for tile_numbers in requested:
        kept.claim(numbers(*tile_numbers))
        assert all(where(kept, *tile) is not None for tile in tile_numbers)
        used = kept.slot[kept.slot >= 0]
        assert len(np.unique(used)) == len(used) <= 5
        for i, j in zip(*np.nonzero(kept.slot >= 0), strict=True):
            np.testing.assert_array_equal(kept._tiles[kept.slot[i, j]], kept.number[i, j])


def test_readers_at_the_same_time_find_their_ground(monkeypatch):
    """Six threads, room for what two of them want: each reads the tiles it requested, as they are drawn alone."""
    kept, alone = small(monkeypatch, 5), TerrainMap(bed())
    requested = [numbers((n % 4, k * CACHE_SIDE), (n % 4 + 1, k * CACHE_SIDE)) for n in range(12) for k in (0, 1)]

    def read(tile_numbers):
        with kept.reading(tile_numbers):
            rows = [where(kept, *tile) for tile in tile_numbers.tolist()]
            time.sleep(0.001)
            return kept.nodes[rows].copy()

    with ThreadPoolExecutor(6) as pool:
        found = list(pool.map(read, requested))
    for tile_numbers, tiles in zip(requested, found, strict=True):
        for tile, got in zip(tile_numbers.tolist(), tiles, strict=True):
            alone.synthesize(alone.claim(numbers(tile)))
            np.testing.assert_array_equal(got, alone.nodes[where(alone, *tile)])
    assert not kept._readers.any()


def test_a_tile_that_could_not_be_drawn_is_drawn_by_the_next(monkeypatch):
    """A reader that fails leaves no blank tile behind, and no reader waits for it."""
    kept, draw = TerrainMap(bed()), TerrainMap.synthesize
    monkeypatch.setattr(TerrainMap, "synthesize", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError), kept.reading(numbers((0, 0))):
        pass
    monkeypatch.setattr(TerrainMap, "synthesize", draw)
    with kept.reading(numbers((0, 0))):
        assert kept.nodes[where(kept, 0, 0)].std() > 0


def test_a_bed_has_one_map():
    """Requested again the same map comes back; another bed has another; what stands for a flat bed's is flat."""
    one, other = bed(), bed(seed=5)
    assert terrain_map(one) is terrain_map(one) is not terrain_map(other)
    assert not any(part.any() for part in empty_terrain_map())


@given(st.integers(1, 8), st.integers(-500, 500), st.integers(-500, 500))
@settings(max_examples=20, deadline=None)
def test_tiles_of_a_split_lie_side_by_side_in_the_whole(level, along, across):
    """Every cell of the four parts lies in the whole tile, and no two of them overlap."""
    whole = Tiles(*np.array([[level], [along], [across]], np.int64))
    cell = jittered_points(whole.split(), 1, random_keys.SEABED)
    side = TILE * whole.pitch[0]
    edge = np.array([along, across]) * side
    offset = np.stack([cell.along, cell.across], axis=-1) - edge
    assert np.all((offset >= -1e-6) & (offset <= side + 1e-6))
    assert cell.area.sum() == pytest.approx(side**2)
    fine = np.floor(offset / (whole.pitch[0] / 2) + 1e-9).astype(int)
    assert len({(a, b) for a, b in fine.clip(0, 2 * TILE - 1)}) > 0.999 * len(offset)


def test_tiles_are_taken_by_their_rows():
    """By slice or mask, with pitches of their own levels."""
    tiles = Tiles(np.array([0, 1, 5]), np.array([7, 8, 9]), np.array([-1, -2, -3]))
    np.testing.assert_allclose(tiles.pitch, [BASE_PITCH, 2 * BASE_PITCH, 32 * BASE_PITCH])
    part = tiles.take(np.array([True, False, True]))
    np.testing.assert_array_equal(np.stack(part), [[0, 5], [7, 9], [-1, -3]])
    np.testing.assert_allclose(part.centre, tiles.centre[[0, 2]])


@given(st.floats(-6, 6), st.floats(-6, 6), st.floats(-1e3, 1e3))
def test_two_lattices_differ_by_a_turn_and_a_shift(one, other, north):
    """From one frame to the world and into another: distances and handedness stay."""
    first, second = ScattererGrid(origin=(north, 5.0), heading=one), ScattererGrid(origin=(-3.0, north), heading=other)
    own = np.array([[0.0, 0], [1, 0], [0, 1]])
    origin, along, across = second.from_world(first.to_world(*own.T))
    a, b = along - origin, across - origin
    np.testing.assert_allclose(a, [np.cos(one - other), np.sin(one - other)], atol=1e-9)
    np.testing.assert_allclose(b, [-a[1], a[0]], atol=1e-9)
