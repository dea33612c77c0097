"""Scatterers drawn and evaluated at once against all that there are, drawn and evaluated one by one."""

import numpy as np
import pytest

from insonify import random_keys
from insonify.engines import _gain_envelope_kernel, _keep_probability_kernel
from insonify.engines._draw_kernel import BATCH, KeptScatterers
from insonify.engines.beam_importance import (
    LINEAR_BELOW,
    MIN_KEEP_PROBABILITY,
    PEAK_RATIO,
    BeamImportance,
)
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.resolution import fill_fraction, tiles_in_view
from insonify.propagation.families import families_reaching
from insonify.scene.drawn_tiles import DrawnTiles
from insonify.scene.scatterer_grid import BASE_PITCH, PARTS, SIDE, TILE, Tiles, max_point_count
from insonify.simulator import build_simulator
from oracles.jittered_points import jittered_points
from oracles.scenes import nominal

SEED = 5


def importance_of(*, order=1, importance_sampling=True, window=(0.035, 0.042), **changes):
    """A ping's level over the seabed, its tiles, and the parts of them that fill the sonar's cells."""
    scenario = nominal(
        track={"window": window},
        paths={"max_reflections": order, "importance_sampling": importance_sampling},
        **changes,
    )
    simulator = build_simulator(scenario)
    here, families = simulator.ping_geometry(0), families_reaching("seabed", scenario.paths.followed_families)
    seen = ping_scatterers(scenario.scene, scenario.paths, scenario.seed, here, simulator.engine.rays)
    lattice = scenario.seabed.scatterer_grid
    tiles, density = tiles_in_view(here, lattice, 20.0, seen.rays, families, seen.resolution, 1e-3)
    own = fill_fraction(here, lattice, 20.0, seen.resolution, tiles, density)
    return BeamImportance(here, 20.0, seen.rays, families, lattice, 60.0, importance_sampling), tiles, own


def keep_probability_of(gain, wide=False):
    """The law in words: the square of the gain, below a quarter the gain itself, never less than a thousandth."""
    gain = np.minimum(gain, 1)
    return np.clip(np.maximum(gain**2, 0 if wide else LINEAR_BELOW * gain), MIN_KEEP_PROBABILITY, 1)


def reference_kept(strong, tiles, bounds, *, wide=False):
    """Key, area, position and phase of what is kept, with every cell of every tile drawn and evaluated by itself."""
    drawn, keep_probabilities = (
        jittered_points(tiles, SEED, random_keys.SEABED),
        strong.keep_probabilities(tiles, bounds),
    )
    pitch = BASE_PITCH * 2.0 ** tiles.scale[drawn.tile]
    a, b = ((at / pitch - TILE * tile[drawn.tile]) / SIDE for at, tile in
            ((drawn.along, tiles.along), (drawn.across, tiles.across)))  # fmt: skip
    i, j = np.minimum(a.astype(int), PARTS - 1), np.minimum(b.astype(int), PARTS - 1)
    x, y, corner = a - i, b - j, keep_probabilities.corner
    t = drawn.tile
    between = (1 - x) * ((1 - y) * corner[t, i, j] + y * corner[t, i, j + 1])
    between += x * ((1 - y) * corner[t, i + 1, j] + y * corner[t, i + 1, j + 1])
    own = np.empty(len(t))
    place = strong.scatterer_grid.to_world(drawn.along, drawn.across)
    _gain_envelope_kernel.gain_re_threshold(strong._gains, place, np.zeros(len(t)), own)
    gain = np.where(keep_probabilities.is_peaked[t, i, j], own, between)
    share = np.minimum(bounds.density[t] * keep_probability_of(gain, wide), keep_probabilities.max_probability[t, i, j])
    kept = drawn.priority < share
    found = (
        drawn.scatterer_id[kept],
        (pitch**2 / share)[kept],
        place[kept],
        drawn.phase[kept],
    )
    order = np.argsort(found[0])
    return [column[order] for column in found]


def by_key(kept):
    """Kept scatterers, ordered by scatterer id."""
    order = np.argsort(kept.key)
    return KeptScatterers(*(column[order] for column in kept))


def kept_of(importance, tiles, bounds, seed=SEED, terrain=None):
    """Scatterers that a ping keeps of some tiles."""
    return importance.kept_scatterers(tiles, bounds, DrawnTiles("seabed", seed, terrain), bounds.density)


def tile_of(kept, tiles):
    """Row of the tile of each, by its key."""
    every = jittered_points(tiles, SEED, random_keys.SEABED)
    order = np.argsort(every.scatterer_id)
    return every.tile[order[np.searchsorted(every.scatterer_id, kept.key, sorter=order)]]


CASES = {
    "one family": {"order": 0},
    "all families": {"order": 2},
    "apart": {"transmit": {"offset": (0.0, -3.0, 1.0)}, "receive": {"offset": (0.0, 3.0, 0.0)}},
    "several beams": {"receive": {"steer": [-0.35, 0.0, 0.6]}},
    "elements": {"sonar": {"receiver": {"record": "elements"}}, "receive": {"elements": 4, "length": 0.24}},
    "moved and turned": {"seabed": {"scatterer_grid": {"origin": (900.0, -70.0), "heading": 0.7}}},
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_kept_at_once_is_what_is_kept_one_by_one(case):
    """The same keys; areas, positions, phases to rounding: squares only save questions, and change the order."""
    importance, tiles, density = importance_of(**CASES[case])
    bounds = importance.bounds(tiles, density)
    kept = by_key(kept_of(importance, tiles, bounds))
    key, area, place, phase = reference_kept(importance, tiles, bounds, wide=case == "elements")
    np.testing.assert_array_equal(kept.key, key)
    np.testing.assert_allclose(kept.area, area, rtol=1e-9)
    np.testing.assert_allclose(kept.position[:, :2], place, atol=1e-9)
    assert np.abs(kept.phase - phase).max() < 3e-7  # sine and cosine of whole cycles, to 2e-7 each
    assert np.all(kept.position[:, 2] == 20.0) and BATCH < len(key) < 0.9 * TILE**2 * density.sum()


def test_without_importance_sampling_every_scatterer_that_fills_the_cells_is_kept():
    """`importance_sampling=False`: keep probabilities fill the cells wherever the beams point; areas are their inverse.

    Tile by tile the scatterers of `jittered_points` below it, and the seabed that these represent is the tile's to one
    scatterer.
    """
    importance, tiles, density = importance_of(importance_sampling=False)
    bounds = importance.bounds(tiles, density)
    kept = by_key(kept_of(importance, tiles, bounds))
    whole = np.broadcast_to(density[:, None, None], (len(density), PARTS, PARTS))
    every = jittered_points(tiles, SEED, random_keys.SEABED, whole)
    np.testing.assert_array_equal(kept.key, np.sort(every.scatterer_id))
    np.testing.assert_allclose(importance.expected(bounds), density * TILE**2)
    np.testing.assert_array_equal(importance.mean_keep_probability(np.array([1.0, 30.0])), 1.0)
    pitch = BASE_PITCH * 2.0**tiles.scale
    np.testing.assert_allclose(kept.area, (pitch**2 / density)[tile_of(kept, tiles)], rtol=1e-12)
    ground = np.bincount(tile_of(kept, tiles), kept.area, len(density))
    # of priorities that are stratified as many as not lie below any share
    np.testing.assert_allclose(ground, TILE**2 * pitch**2, atol=1.01 * np.max(pitch**2 / density))
    sampled = importance_of()[0]
    some = by_key(kept_of(sampled, tiles, sampled.bounds(tiles, density)))
    assert set(some.key.tolist()) < set(kept.key.tolist())
    same = np.isin(kept.key, some.key)
    assert np.all(some.area >= kept.area[same] * (1 - 1e-12))


@pytest.mark.parametrize("blocks", [1, 2, 3, 7])
def test_tiles_cut_in_any_blocks_keep_the_same(blocks):
    """All at once or some tiles at a time, an empty block among them: the same bits, position by position."""
    importance, tiles, density = importance_of(order=2)
    bounds, cuts = importance.bounds(tiles, density), np.linspace(0, len(density), blocks + 1).astype(int)
    every = by_key(kept_of(importance, tiles, bounds))
    parts = [slice(a, b) for a, b in zip([0, *cuts], [0, *cuts[1:], cuts[-1]], strict=False)]
    found = [kept_of(importance, tiles.take(rows), bounds.take(rows)) for rows in parts]
    together = by_key(KeptScatterers(*(np.concatenate(column) for column in zip(*found, strict=True))))
    for name in ("position", "normal", "area", "phase", "key"):
        np.testing.assert_array_equal(getattr(together, name), getattr(every, name))


def test_the_mean_ground_kept_is_the_ground():
    """80 seeds, tile by tile: areas add up to the tile's within 4 standard errors, in all within 3.

    Where gains are evaluated by corners, where they are evaluated one by one, and where a thousandth is kept.
    """
    importance, tiles, density = importance_of(order=0, window=(0.035, 0.038))
    bounds = importance.bounds(tiles, density)
    expected = np.stack([
        np.bincount(tile_of(kept, tiles), kept.area, len(density)) for kept in
        (kept_of(importance, tiles, bounds, seed) for seed in range(80))
    ])  # fmt: skip
    ground = (TILE * BASE_PITCH * 2.0**tiles.scale) ** 2
    spread = expected.std(axis=0, ddof=1) / np.sqrt(len(expected))
    off = (expected.mean(axis=0) - ground) / np.maximum(spread, 1e-3 * ground)
    assert np.abs(off[spread < 0.5 * ground]).max() < 4.5 and (spread < 0.5 * ground).mean() > 0.5
    total = expected.sum(axis=1)
    assert total.mean() == pytest.approx(ground.sum(), abs=3 * total.std(ddof=1) / np.sqrt(len(expected)))
    assert (
        importance.keep_probabilities(tiles, bounds).is_peaked.any()
        and importance.keep_probabilities(tiles, bounds).max_probability.min() < 0.01
    )


def test_a_split_scatterer_stands_for_the_same_ground():
    """Half the keep probability, twice the area: on average, area times keep probability is that of the cell."""
    importance, tiles, density = importance_of(order=1)
    bounds = importance.bounds(tiles, density)
    one, half = (kept_of(importance, tiles, bounds._replace(density=part)) for part in
                 (density, density / 2))  # fmt: skip
    both, own, other = np.intersect1d(one.key, half.key, return_indices=True)
    assert set(half.key.tolist()) <= set(one.key.tolist())
    np.testing.assert_allclose(half.area[other] / one.area[own], 2, rtol=1e-9)
    assert len(both) == pytest.approx(len(one.key) / 2, rel=0.05)


def test_no_tiles_keep_nothing():
    """Columns without rows."""
    importance, _, _ = importance_of()
    none = Tiles(*np.empty((3, 0), np.int64))
    kept = kept_of(importance, none, importance.bounds(none, np.empty(0)))
    assert [len(column) for column in kept] == [0] * 5


def test_keep_probabilities_fall_with_the_square_then_with_the_gain_and_never_below_a_thousandth():
    """1 at the edge, 1/4 at half of it, 1/16 at a quarter, then a quarter of the gain; or squared all the way."""
    gain = np.array([0.0, 1e-9, 1e-3, 0.1, 0.25, 0.5, 0.9, 1.0, 7.0, np.inf])
    for fewer, wide in ((LINEAR_BELOW, False), (0.0, True)):
        found = np.empty(len(gain))
        _keep_probability_kernel.keep_probabilities(gain, fewer, MIN_KEEP_PROBABILITY, found)
        np.testing.assert_allclose(found, keep_probability_of(gain, wide), rtol=1e-15)
        assert np.all(np.diff(found) >= 0) and found[0] == MIN_KEEP_PROBABILITY and found[-1] == 1
    np.testing.assert_allclose(keep_probability_of(np.array([0.5, 0.25, 0.1])), [0.25, 0.0625, 0.025])


@pytest.mark.parametrize("count", [0, 1, 9])
def test_keep_probabilities_have_the_documented_layout(count):
    """Random tiles: whole ones, those with parts, those whose middles do not decide; by plain loops."""
    rng = np.random.default_rng(count)
    whole, middle = rng.uniform(0, 2, count), rng.uniform(0, 1, count)
    row, some = np.full(count, -1), rng.random(count) < 0.4
    row[some] = np.arange(some.sum())
    parts = rng.uniform(0, 1.5, (int(some.sum()), PARTS, PARTS))
    many, odd = _keep_probability_kernel.classify_tiles(whole, middle, row, PEAK_RATIO)
    np.testing.assert_array_equal(many, np.flatnonzero(some))
    np.testing.assert_array_equal(odd, np.flatnonzero(~some & (middle < PEAK_RATIO * np.minimum(whole, 1))))
    at_parts, at_ends = rng.random((len(many), PARTS + 1, PARTS + 1)), rng.random((len(odd), 2, 2))
    corner, largest = np.empty((count, PARTS + 1, PARTS + 1)), np.empty((count, PARTS, PARTS))
    bounds = _keep_probability_kernel.GainBounds(rng.uniform(0.2, 1, count), whole, middle, row, parts)
    _keep_probability_kernel.interpolate_corner_gains(
        bounds, many, at_parts.ravel(), odd, at_ends.ravel(), corner, largest
    )
    along = np.linspace(0, 1, PARTS + 1)
    for t in range(count):
        want = np.full((PARTS + 1, PARTS + 1), middle[t])
        if t in many:
            want = at_parts[many.tolist().index(t)]
        if t in odd:
            rows = np.array([np.interp(along, [0, 1], side) for side in at_ends[odd.tolist().index(t)]])
            want = np.array([np.interp(along, [0, 1], rows[:, j]) for j in range(PARTS + 1)]).T
        np.testing.assert_allclose(corner[t], want)
        np.testing.assert_array_equal(largest[t], parts[row[t]] if some[t] else np.full((PARTS, PARTS), whole[t]))
    density, peaked, most = bounds.density, np.empty(largest.shape, bool), np.empty(largest.shape)
    _keep_probability_kernel.find_peaked_parts(
        corner, largest, bounds, PEAK_RATIO, LINEAR_BELOW, MIN_KEEP_PROBABILITY, peaked, most
    )
    for t, i, j in np.ndindex(largest.shape):
        near = corner[t, i : i + 2, j : j + 2].max()
        known = near if some[t] else corner[t, [0, 0, -1, -1], [0, -1, 0, -1]].max()
        assert peaked[t, i, j] == (known < PEAK_RATIO * min(largest[t, i, j], 1))
        top = largest[t, i, j] if peaked[t, i, j] else min(near, largest[t, i, j])
        assert most[t, i, j] == pytest.approx(density[t] * keep_probability_of(top))


def test_positions_in_tiles_are_those_of_the_scatterer_grid():
    """Parts of tiles of many levels, some left out: as the scatterer grid itself puts them into the world."""
    importance, _, _ = importance_of(**CASES["moved and turned"])
    rng = np.random.default_rng(2)
    tiles, rows = Tiles(rng.integers(0, 6, 20), *rng.integers(-300, 300, (2, 20))), np.array([3, 3, 0, 19])
    part = np.array([0.0, 0.3, 1.0])
    side = TILE * BASE_PITCH * 2.0 ** tiles.scale[rows, None, None]
    a, b = (side * (at + way) for at, way in zip((tiles.along[rows, None, None], tiles.across[rows, None, None]),
                                                 (part[:, None], part[None, :]), strict=True))  # fmt: skip
    want = importance.scatterer_grid.to_world(*(x.ravel() for x in np.broadcast_arrays(a, b)))
    np.testing.assert_allclose(importance._positions(tiles, rows, part), want, atol=1e-9)


def test_there_is_room_for_all_that_may_be_drawn():
    """For any keep probabilities: at least the rows that `jittered_points` fills, at most one a part more."""
    rng = np.random.default_rng(9)
    tiles = Tiles(rng.integers(0, 4, 60), *rng.integers(-99, 99, (2, 60)))
    most = np.where(rng.random((60, PARTS, PARTS)) < 0.3, rng.choice([-0.5, 0.0, 1e-9, 1.0, 1.5], (60, PARTS, PARTS)),
                    rng.random((60, PARTS, PARTS)))  # fmt: skip
    for some in (most, most[:1], most[:0], np.ones((2, PARTS, PARTS)), np.zeros((2, PARTS, PARTS))):
        filled = len(jittered_points(tiles.take(slice(len(some))), SEED, random_keys.SEABED, some).along)
        assert filled <= max_point_count(some) <= np.clip(some, 0, 1).sum() * SIDE**2 + some.size
