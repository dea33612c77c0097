"""Cell areas, tiles in reach and their division, against plain loops over tiles."""

import numpy as np
import pytest

from insonify.engines import _resolution_kernel as kernel
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.resolution import Resolution, fill_fraction, tiles_in_view
from insonify.propagation.families import families_reaching
from insonify.scene.scatterer_grid import BASE_PITCH, FINEST_SCALE, TILE, ScattererGrid, Tiles
from insonify.simulator import build_simulator
from oracles.scenes import nominal

RESOLUTION = Resolution(slant_resolution=0.15, beam_width=0.012, scatterers_per_cell=4.0)
LONG_PULSE = Resolution(slant_resolution=0.15, beam_width=0.012, scatterers_per_cell=4.0, pulse_resolution=1.2)


def cell_area(distance, height, pulse=0.15):
    """The smaller of a ground cell by the beam's arc over the number requested, and a square of six ground cells."""
    far = np.hypot(distance, height)
    slant = np.maximum(0.15, np.minimum(pulse, far / 20))
    with np.errstate(divide="ignore"):
        ground = np.minimum(slant * far / distance, np.sqrt(2 * far * slant))
    return np.minimum(ground * far * 0.012 / 4, 36 * ground**2)


@pytest.mark.parametrize("resolution", [RESOLUTION, LONG_PULSE])
@pytest.mark.parametrize("count", [0, 1, 500])
def test_cells_are_those_of_the_range_cell_and_the_beam(count, resolution):
    """From right below the sonar to 300 m, for any array shape; a long pulse where the distance allows it."""
    rng = np.random.default_rng(count)
    distance = np.where(rng.random(count) < 0.1, 0.0, rng.uniform(0, 300, count))
    for height in (0.1, 9.0):
        want = cell_area(distance, height, max(resolution.pulse_resolution, 0.15))
        np.testing.assert_allclose(resolution.cell_area(distance, height), want, rtol=1e-12)
        columns = distance[: count // 2 * 2].reshape(-1, 2)
        np.testing.assert_array_equal(
            resolution.cell_area(columns, height).ravel(), resolution.cell_area(columns.ravel(), height)
        )


@pytest.mark.parametrize("resolution", [RESOLUTION, LONG_PULSE])
def test_no_cell_is_larger_than_the_coarsest_nor_smaller_than_the_finest(resolution):
    """20 stretches of any length, 400 distances in each: between both bounds at one end, above that of two ends."""
    rng = np.random.default_rng(1)
    near, length = rng.uniform(0, 100, 20), 10 ** rng.uniform(-1, 2, 20)
    inside = near + length * np.linspace(0, 1, 400)[:, None]
    for height in (0.5, 9.0, 40.0):
        area = cell_area(inside, height, max(resolution.pulse_resolution, 0.15))
        assert np.all(resolution.finest(near, near + length, height) <= area.min(axis=0) * (1 + 1e-12))
        assert area.max() <= resolution.coarsest(float(inside.max()), height) * (1 + 1e-12)
    # no end alone requests less than both together
    ends = [(near, near + length, 9.0), (near + 3, near + length + 3, 5.0)]
    apart = resolution.finest_bistatic(ends)
    for one, far, height in ends:
        assert np.all(apart <= resolution.finest(one, far, height) * (1 + 1e-12))


@pytest.mark.parametrize("count", [0, 1, 200])
def test_spans_hold_every_position_of_a_tile_and_of_the_track(count):
    """Any position within half a diagonal of the centre, any position within the error of the polyline: in the span."""
    rng = np.random.default_rng(count)
    corners, wander = rng.uniform(-50, 50, (5, 2)), 2.0
    centre, half = rng.uniform(-200, 200, (count, 2)), rng.uniform(0.1, 20, count)
    pieces = np.linspace(corners[:-1], corners[1:], 200).reshape(-1, 2)  # all along the polyline
    away = np.array([np.linalg.norm(pieces - at, axis=1).min() for at in centre])
    nearest, farthest = np.empty((2, count))
    kernel.tile_distance_bounds(centre, half, away, corners, wander, nearest, farthest)
    for n in range(count):
        turn = rng.uniform(0, 2 * np.pi, (2, 300))
        there = centre[n] + half[n] * np.stack([np.cos(turn[0]), np.sin(turn[0])], axis=-1)
        here = pieces[rng.integers(0, len(pieces), 300)] + wander * np.stack([np.cos(turn[1]), np.sin(turn[1])], -1)
        distance = np.linalg.norm(there - here, axis=1)
        assert nearest[n] <= distance.min() and distance.max() <= farthest[n] and nearest[n] >= 0


@pytest.mark.parametrize("widest", [np.inf, 130.0])
@pytest.mark.parametrize("corner", [(0, 0), (-7, 2), (3, -9)])
def test_tiles_in_reach_are_those_that_a_loop_finds(corner, widest):
    """All numbers between two corners, row by row; kept where a circle about the tile may be received; rotated."""
    lattice, here, other = (
        ScattererGrid(origin=(700.0, -30.0), heading=0.9),
        np.array([3.0, -2.0]),
        np.array([-20.0, 9.0]),
    )
    low, high, pitch = np.array(corner), np.array(corner) + np.array([12, 9]), 0.32
    along, across = np.empty((2, 13 * 10), np.int64)
    kernel.tiles_between(low, high, along, across)
    each = [(i, j) for i in range(low[0], high[0] + 1) for j in range(low[1], high[1] + 1)]
    assert list(zip(along.tolist(), across.tolist(), strict=True)) == each
    centre, place = np.empty((2, len(each), 2))
    area = kernel.ReceivableArea(here, other, 20.0, 90.0, widest)
    n = kernel.tiles_in_reach(pitch, along, across, area, lattice.frame, centre, place)
    side = TILE * pitch
    middles, kept = (np.array(each) + 0.5) * side, []
    for tile, middle in zip(each, middles, strict=True):
        own, far = np.linalg.norm(middle - here), np.linalg.norm(middle - other)
        half = side / np.sqrt(2)
        if own - half <= 90 and own + half >= 20 and own + far - 2 * half <= widest:
            kept.append((*tile, *middle))
    assert 0 < n < len(each)
    np.testing.assert_allclose(np.column_stack([along[:n], across[:n], centre[:n]]), kept)
    np.testing.assert_allclose(place[:n], lattice.to_world(*centre[:n].T), atol=1e-9)
    bound = np.random.default_rng(1).random(n)
    before = np.column_stack([along[:n], across[:n], centre[:n]])[bound >= 0.4]
    strong = kernel.tiles_above_floor(bound, 0.4, along, across, centre)
    np.testing.assert_array_equal(np.column_stack([along[:strong], across[:strong], centre[:strong]]), before)


@pytest.mark.parametrize(("level", "count"), [(-4, 5), (0, 5), (3, 0), (3, 1), (4, 300)])
def test_tiles_that_are_too_coarse_are_cut_in_four_and_no_ground_is_lost(level, count):
    """Kept tiles have the keep probability that fills the cells, at most 1 at the finest level."""
    rng = np.random.default_rng(count)
    along, across = rng.permutation(1000)[:count] - 500, rng.integers(-500, 500, count)
    cell = (BASE_PITCH * 2.0**level) ** 2
    finest = cell * 10 ** rng.uniform(-1, 1, count)
    kept_along, kept_across, density, part_along, part_across = kernel.subdivide_tiles(level, along, across, finest)
    fine = (cell <= finest) | (level == FINEST_SCALE)
    np.testing.assert_array_equal([kept_along, kept_across], [along[fine], across[fine]])
    np.testing.assert_allclose(density, np.minimum(cell / finest[fine], 1))
    want = Tiles(np.full(np.sum(~fine), level), along[~fine], across[~fine]).split()
    np.testing.assert_array_equal([part_along, part_across], [want.along, want.across])


def seen(**changes):
    """One ping's ping_geometry, tiles of the seabed, their density, and what fills the cells of this ping."""
    scenario = nominal(**{"paths": {"max_reflections": 1}, **changes})
    simulator = build_simulator(scenario)
    here, families, lattice = (
        simulator.ping_geometry(0),
        families_reaching("seabed", scenario.paths.followed_families),
        scenario.seabed,
    )
    resolution = ping_scatterers(scenario.scene, scenario.paths, scenario.seed, here, simulator.engine.rays).resolution
    tiles, density = tiles_in_view(
        here, lattice.scatterer_grid, 20.0, simulator.engine.rays, families, resolution, 1e-3, widest=2 * 1500.0
    )
    return here, lattice.scatterer_grid, resolution, tiles, density, fill_fraction(here, lattice.scatterer_grid, 20.0,
    resolution, tiles,
                                                                      density)  # fmt: skip


@pytest.mark.parametrize("ends", [{}, {"transmit": {"offset": (0.0, -4.0, 1.0)}, "receive": {"offset": (1.0, 4, 0)}}])
def test_what_fills_a_pings_cells_leaves_none_without_its_scatterers(ends):
    """Grid cell area over keep probability is nowhere above the area required: 50 positions of each tile, both ends."""
    here, lattice, resolution, tiles, density, own = seen(track={"window": (0.02, 0.034)}, **ends)
    assert np.all(own <= density) and np.all(own > 0) and len(own) > 20
    rng = np.random.default_rng(3)
    for t in range(0, len(own), 7):
        side = TILE * tiles.pitch[t]
        place = lattice.to_world(*((at + rng.random(50)) * side for at in (tiles.along[t], tiles.across[t])))
        area = [
            resolution.cell_area(np.linalg.norm(place - end[:2], axis=1), 20.0 - end[2])
            for end in (here.transmit_position, here.receive_position)
        ]
        stands_for = tiles.pitch[t] ** 2 / own[t]
        # at the track's own density no more can be drawn than there are
        assert own[t] == density[t] or np.all(stands_for <= np.min(area, axis=0) * (1 + 1e-9))


def test_tiles_do_not_overlap_and_move_with_the_scatterer_grid():
    """No tile is twice there, nor within another; sonar and lattice moved and turned: the same tiles and densities."""
    window = (0.02, 0.05)
    _, _, _, tiles, density, _ = seen(track={"window": window})
    every = set(zip(*(column.tolist() for column in tiles), strict=True))
    assert len(every) == len(density)
    assert not any((level + up, along >> up, across >> up) in every for level, along, across in every
                   for up in range(1, 12))  # fmt: skip
    moved = seen(
        track={"window": window, "position": (3000.0, -700.0, 11.0), "heading": 0.7},
        seabed={"scatterer_grid": {"origin": (3000.0, -700.0), "heading": 0.7}},
    )
    for one, other in zip((*tiles, density), (*moved[3], moved[4]), strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9)
