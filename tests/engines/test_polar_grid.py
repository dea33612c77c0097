"""Polar grid: a quadrature of the seabed with weights that add up and points inside their cells."""

import numpy as np
import pytest

from insonify.engines._polar_grid_kernel import GOLDEN, kept_points
from insonify.engines.polar_grid import RINGS_PER_TILE, PolarGrid
from insonify.engines.resolution import Resolution, receivable_range, two_way_gain_bound
from insonify.propagation.families import families_reaching
from insonify.simulator import build_simulator
from oracles.scenes import nominal

DEPTH = 20.0


def rings(per_cell=4.0, window=(0.05, 0.12), slant=0.15, width=0.02, **changes):
    """The cells of the nominal sonar over the flat bed, with what made them."""
    simulator = build_simulator(nominal(track={"window": window}, **changes))
    here = simulator.ping_geometry(0)
    received = receivable_range(here, DEPTH, simulator.engine.rays, ("D",))
    return PolarGrid(here, DEPTH, received, Resolution(slant, width, per_cell)), here, received, simulator


def test_the_cells_fill_the_ring_that_is_received():
    """Areas of all points add up to the annulus between the innermost and the outermost ring, exactly."""
    cells, here, received, _ = rings()
    place, area, _ = cells.points(cells.tiles)
    first, last = (
        cells.tiles[:, 0].min() * RINGS_PER_TILE * cells.slant,
        (cells.tiles[:, 0].max() + 1) * RINGS_PER_TILE * cells.slant,
    )
    height = received.vertical_distance
    assert area.sum() == pytest.approx(np.pi * (last**2 - max(first, height) ** 2), rel=1e-9)
    distance = np.hypot(*(place - here.transmit_position[:2]).T)
    slant = np.hypot(distance, height)
    assert first - 1e-9 <= slant.min() and slant.max() <= last + 1e-9


def test_sparse_rings_are_a_pulse_apart():
    """With fewer than 2 points to a cell its length is not cut, its width is; with more both are, by the root."""
    whole, _, _, _ = rings(1.0)
    for per_cell, along in ((1.5, 1.0), (1.9, 1.0), (4.0, 2.0)):
        cells, _, _, _ = rings(per_cell)
        assert cells.slant == pytest.approx(0.15 / along)
        assert whole.azimuth / cells.azimuth == pytest.approx(per_cell / along, rel=0.1)


def test_what_is_received_lies_within_the_cells():
    """Nearest and farthest distance that the window receives are inside the outermost rings."""
    cells, _, received, _ = rings()
    inner, outer = cells.tiles[:, 0].min() * RINGS_PER_TILE, (cells.tiles[:, 0].max() + 1) * RINGS_PER_TILE
    assert inner * cells.slant <= np.hypot(received.nearest, received.vertical_distance)
    assert outer * cells.slant >= np.hypot(received.farthest, received.vertical_distance)


def test_points_lie_evenly_in_every_direction():
    """Any narrow sector holds its keep probability of the points, and any narrow ring too."""
    cells, here, _, _ = rings()
    place, area, _ = cells.points(cells.tiles)
    away = place - here.transmit_position[:2]
    bearing, distance = np.arctan2(away[:, 1], away[:, 0]), np.hypot(*away.T)
    in_sectors, _ = np.histogram(bearing, 90, weights=area)
    assert np.std(in_sectors) / np.mean(in_sectors) < 0.02
    outer = distance > np.quantile(distance, 0.3)
    edges = np.linspace(distance[outer].min(), distance.max(), 40)
    in_rings, _ = np.histogram(distance[outer], edges, weights=area[outer])
    expected = np.pi * np.diff(edges**2)
    assert np.std((in_rings / expected)[1:-1]) < 0.02


def test_a_smooth_function_of_the_ground_is_integrated_well():
    """A beam-like bump across four resolution widths: within 0.2 % with four points to a cell."""
    cells, here, _, _ = rings()
    place, area, _ = cells.points(cells.tiles)
    away = place - here.transmit_position[:2]
    bearing, distance = np.arctan2(away[:, 1], away[:, 0]), np.hypot(*away.T)
    # boresight is east; the bump is a Gaussian in bearing and in range
    middle, span = 60.0, 5.0
    weight = np.exp(-0.5 * ((bearing - np.pi / 2) / 0.02) ** 2 - 0.5 * ((distance - middle) / span) ** 2)
    exact = 2 * np.pi * 0.02 * span * middle
    assert np.sum(weight * area) == pytest.approx(exact, rel=2e-3)


def test_more_points_to_a_cell_are_finer_in_range_and_azimuth():
    """Sixteen times the points are a quarter of the range step and of the sector."""
    coarse, fine = rings(per_cell=1.0)[0], rings(per_cell=16.0)[0]
    assert coarse.slant / fine.slant == pytest.approx(4)
    assert coarse.azimuth / fine.azimuth == pytest.approx(4, rel=0.2)  # sectors come in whole tiles


def test_keys_distinguish_all_cells():
    """No two cells share a key, and a cell keeps its key whichever tiles it is evaluated with."""
    cells, _, _, _ = rings(window=(0.1, 0.11))
    _, _, key = cells.points(cells.tiles)
    assert len(np.unique(key)) == len(key)
    _, _, some = cells.points(cells.tiles[3:5])
    assert np.isin(some, key).all()


def test_a_lowered_floor_lets_in_more_and_never_less():
    """Tiles above a floor are among those above a lower one; without a floor all are in view."""
    cells, _, _, simulator = rings()
    kept = families_reaching("seabed", ("D", "S", "BS"))
    seen = [
        {tuple(tile) for tile in cells.tiles_above_floor(simulator.engine.rays, kept, floor)}
        for floor in (1e-1, 1e-3, 0)
    ]
    assert seen[0] <= seen[1] <= seen[2] and len(seen[0]) < len(seen[2]) == len(cells.tiles)


def test_the_bound_of_a_beam_is_a_bound():
    """No direction within a neighbourhood has more gain than its bound states, by any family."""
    _, here, _, simulator = rings()
    rng = np.random.default_rng(4)
    bearing, distance = rng.uniform(0, 2 * np.pi, 200), rng.uniform(20, 90, 200)
    centre = here.transmit_position[:2] + distance[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], -1)
    half = rng.uniform(0.1, 4, 200)
    bound = two_way_gain_bound(centre, half, here, DEPTH, simulator.engine.rays, ("D",))
    for _ in range(20):
        shift = rng.normal(size=(200, 2))
        shift *= (half * rng.random(200) / np.linalg.norm(shift, axis=1))[:, None]
        way = np.column_stack([centre + shift - here.transmit_position[:2], np.full(200, DEPTH - 11.0)])
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        gain = np.abs(here.transmit_beams.gain(way)[0] * here.receive_beams.gain(way)[0])
        assert np.all(gain <= bound * (1 + 1e-9) + 1e-12)


def test_the_bound_over_rising_ground_is_no_lower():
    """Ground that may stand higher can only be nearer to some direction: the bound grows with the rise."""
    _, here, _, simulator = rings()
    centre, half = np.array([[5.0, 60.0], [-20.0, 40.0]]), np.array([1.0, 2.0])
    flat, raised = (
        two_way_gain_bound(centre, half, here, DEPTH, simulator.engine.rays, ("D", "S"), rise=rise)
        for rise in (0.0, 3.0)
    )
    assert np.all(raised >= flat)


def test_ground_that_rises_is_received_from_nearer_and_from_farther():
    """A seabed that may stand 2 m higher or lie 2 m deeper widens the distances that a window reaches."""
    _, here, received, simulator = rings()
    more = receivable_range(here, DEPTH, simulator.engine.rays, ("D",), rise=2.0)
    assert more.nearest < received.nearest and more.farthest > received.farthest


def test_points_lie_in_the_cells_of_their_keys():
    """At every kept cell: one point, between its rings and its sectors, at its bearing to rounding; areas add up."""
    tiles, rings, sectors, slant, height, azimuth = np.array([[3, 2], [5, 0]]), 8, 6, 0.25, 4.0, 0.01
    keep = np.random.default_rng(3).uniform(0.2, 1, (2, 4, sectors))
    shape = len(tiles) * rings * sectors
    position, area, key = np.empty((shape, 2)), np.empty(shape), np.empty(shape, np.uint64)
    origin = 12.0, -5.0, 0.7
    count = kept_points(tiles, keep, rings, slant, height, azimuth, origin, position, area, key)
    assert 0.3 * shape < count < 0.9 * shape
    ring, sector = (key[:count] >> np.uint64(29)).astype(int), (key[:count] % np.uint64(1 << 29)).astype(int)
    assert len(set(key[:count].tolist())) == count
    offset = position[:count] - origin[:2]
    reach, turn = np.hypot(np.linalg.norm(offset, axis=1), height), np.arctan2(offset[:, 1], offset[:, 0]) - origin[2]
    assert (reach >= ring * slant - 1e-9).all() and (reach <= (ring + 1) * slant + 1e-9).all()
    shift = (ring + 0.5) * GOLDEN
    np.testing.assert_allclose(turn, (sector + shift - np.floor(shift)) * azimuth, rtol=0, atol=1e-12)
    tile = (ring >= 5 * rings).astype(int)
    cell = np.diff(np.maximum((ring[:, None] + [0, 1]) * slant, height) ** 2, axis=1)[:, 0] / 2 * azimuth
    probability = keep[tile, ring % rings // 2, sector - tiles[tile, 1] * sectors]
    np.testing.assert_allclose(area[:count] * probability, cell, rtol=1e-12)
