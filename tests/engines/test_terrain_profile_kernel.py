"""Slices of azimuth against plain loops over points, and lines of ground against the map read point by point."""

import numpy as np
import pytest

from insonify.engines._terrain_profile_kernel import (
    MERGE_BLOCK_LOG2,
    SAMPLES_PER_RUN,
    AzimuthSlices,
    ProfileLines,
    group_by_profile,
    profile_bearings,
    profiles_of,
    sample_profiles,
)
from insonify.scene.heightmap_cache import CELLS
from oracles.few_of import few_of
from oracles.maps import map_of, swell

EDGES, COUNTS = np.array([5.0, 20.0, 90.0]), np.array([64, 128, 512])
STARTS = np.array([0, 64, 192, 704])


def sliced(place, position, *, heading=0.0, merged=None, batch=None):
    """Distances, slices, those requested and how many points want them."""
    count = len(position)
    distance, own, unsampled = np.empty(count), np.empty(count, np.int64), np.zeros(STARTS[-1], bool)
    merged = np.zeros(STARTS[-1] >> MERGE_BLOCK_LOG2, np.uint8) if merged is None else merged
    batch = np.full(STARTS[-1], -1, np.int32) if batch is None else batch
    slices = AzimuthSlices(heading, EDGES, COUNTS, STARTS, merged, batch)
    missing = profiles_of(place, position, slices, distance, own, unsampled)
    return distance, own, unsampled, missing


@pytest.mark.parametrize("count", [0, 1, 127, 128, 129, 3000])
def test_the_slice_of_a_point_is_its_bearing_in_steps_of_its_zone(count):
    """The angle of an arc tangent over the width of a slice, but for points within 1e-7 of a border; in fours or not.

    Half of the lines are there: those that are not are requested by just the points in them.
    """
    rng = np.random.default_rng(count)
    place, heading = rng.uniform(-500, 500, 3), 0.7
    position = place[:2] + rng.uniform(-80, 80, (count, 2))
    merged = rng.integers(0, 3, STARTS[-1] >> MERGE_BLOCK_LOG2).astype(np.uint8)
    batch = rng.integers(-1, 1, STARTS[-1]).astype(np.int32)
    distance, own, unsampled, missing = sliced(place, position, heading=heading, merged=merged, batch=batch)
    expected, want = [], set()
    for at, found in zip(position, own, strict=True):
        north, east = at - place[:2]
        zone = min(int(np.searchsorted(EDGES, np.hypot(north, east))), 2)
        among = np.mod(np.arctan2(east, north) - heading, 2 * np.pi) / (2 * np.pi) * COUNTS[zone]
        index = STARTS[zone] + int(among)
        fours = 2 ** int(merged[index // 8])
        index -= index % fours
        expected.append(found if abs(among - round(among)) < 1e-5 else index)
        want |= {int(found)} if batch[found] < 0 else set()
    np.testing.assert_array_equal(own, expected)
    np.testing.assert_allclose(distance, np.hypot(*(position - place[:2]).T), rtol=1e-14)
    assert set(np.flatnonzero(unsampled).tolist()) == want and missing == np.sum(batch[own] < 0)


def test_a_point_right_above_has_a_slice_and_those_on_edges_the_inner_one():
    """No distance at all is the first zone; a position on an edge belongs within; far outside is the last zone."""
    position = np.array([[0.0, 0.0], [5.0, 0.0], [5.0001, 0.0], [20.0, 0.0], [1e6, 0.0]])
    _, own, _, _ = sliced(np.zeros(2), position)
    assert np.searchsorted(STARTS, own, side="right").tolist() == [1, 1, 2, 2, 3]


def test_slices_turn_with_the_scatterer_grid():
    """Position, points and heading turned and moved by kilometres together: the same slices, but on their borders."""
    rng = np.random.default_rng(3)
    position, turn, shift = rng.uniform(-80, 80, (2000, 2)), 1.1, np.array([4000.0, -900.0])
    c, s = np.cos(turn), np.sin(turn)
    _, here, _, _ = sliced(np.zeros(2), position)
    _, there, _, _ = sliced(shift, position @ np.array([[c, s], [-s, c]]) + shift, heading=turn)
    assert np.mean(here == there) > 0.999


def test_port_is_starboard_in_a_mirror():
    """East for west: the slices of a zone are counted from its other end."""
    position = np.random.default_rng(4).uniform(-80, 80, (2000, 2))
    _, one, _, _ = sliced(np.zeros(2), position)
    _, other, _, _ = sliced(np.zeros(2), position * [1, -1])
    zone = np.searchsorted(STARTS, one, side="right") - 1
    np.testing.assert_array_equal(one - STARTS[zone], COUNTS[zone] - 1 - (other - STARTS[zone]))


@pytest.mark.parametrize("count", [0, 1, 500])
def test_points_sorted_by_lines_are_each_there_once_in_their_order(count):
    """As a stable sort of where each one's line is kept; positions not requested are empty."""
    rng = np.random.default_rng(count)
    batch, row = rng.integers(0, 9, 64).astype(np.int32), rng.integers(0, 50, 64).astype(np.int32)
    own, starts = rng.integers(0, 64, count), np.empty(12, np.int64)
    points, rows = np.empty((2, count), np.int64)
    group_by_profile(own, batch, row, starts, points, rows)
    np.testing.assert_array_equal(points, np.argsort(batch[own], kind="stable"))
    np.testing.assert_array_equal(rows, row[own[points]])
    np.testing.assert_array_equal(starts, np.searchsorted(np.sort(batch[own]), np.arange(12)))


@pytest.mark.parametrize("zone", [0, 1, 2])
def test_a_middle_line_is_the_mean_of_the_bearings_that_it_stands_for(zone):
    """One slice or four; the line of a nearer zone is that of the wider slice about it."""
    rng = np.random.default_rng(zone)
    merged = np.where(rng.random(STARTS[-1] >> MERGE_BLOCK_LOG2) < 0.5, 2, 0).astype(np.uint8)
    every = np.arange(STARTS[zone], STARTS[zone + 1])
    first = every[every % 2 ** merged[every >> MERGE_BLOCK_LOG2].astype(int) == 0]
    turn, rays = np.empty((len(first), zone + 1)), np.empty((len(first), zone + 1, 2))
    profile_bearings(first, zone, COUNTS, STARTS, merged, turn, rays)
    width = 2 * np.pi / COUNTS[zone] * 2 ** merged[first >> MERGE_BLOCK_LOG2].astype(float)
    np.testing.assert_allclose(turn[:, -1], (first - STARTS[zone]) * 2 * np.pi / COUNTS[zone] + width / 2)
    np.testing.assert_allclose(rays[..., 0] + 1j * rays[..., 1], np.exp(1j * turn))
    for nearer in range(zone):
        half = np.pi / COUNTS[nearer] * 2 ** merged[
            (STARTS[nearer] + (turn[:, -1] * COUNTS[nearer] / 2 / np.pi).astype(int)) >> MERGE_BLOCK_LOG2
        ].astype(float)  # fmt: skip
        assert np.all(np.abs(turn[:, nearer] - turn[:, -1]) <= half + 1e-12)


@pytest.mark.parametrize("count", [1, SAMPLES_PER_RUN - 1, SAMPLES_PER_RUN, SAMPLES_PER_RUN + 1, 240])
@few_of((1,), "here", [(0.0, 0.0), (-63.99, 31.7)])
def test_ground_along_a_line_is_the_map_read_sample_by_sample(count, here):
    """16 directions, those of the axes among them, across tiles of 32 m: within a ten-thousandth of a cell's slope."""
    ground = map_of(swell(1), 0.5, first=(-6, -6), tiles=(12, 12))
    angle = np.concatenate([np.arange(4) * np.pi / 2, np.random.default_rng(2).uniform(0, 2 * np.pi, 12)])
    rays = np.repeat(np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None], 2, axis=1)
    firsts, depth = np.array([0, count // 2, count]), np.full((16, count), np.nan, np.float32)
    done = np.zeros(int(np.sum(-(-np.diff(firsts) // SAMPLES_PER_RUN))), bool)
    start = np.array(here)
    lines = ProfileLines(start, rays, 0.5, firsts)
    assert sample_profiles(lines, 20.0, ground.pages, ground.no_tiles(), done, depth) and done.all()
    away = (np.arange(count) + 1) * 0.5
    a, b = (start[k] + away * rays[:, :1, k] for k in (0, 1))
    np.testing.assert_allclose(depth, 20 - ground.read(a, b), atol=5e-6)


def test_tiles_that_are_missing_are_named_and_nothing_else_is():
    """One hole of the map: lines that cross it name that tile alone, and are whole when it is there."""
    height, hole = swell(3), (1, 0)
    holed = map_of(height, 0.5, first=(-6, -6), tiles=(12, 12), missing=(hole,))
    angle = np.linspace(-1, 1, 21)
    rays, firsts = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None], np.array([0, 250])
    depth, done, unsampled = np.empty((21, 250), np.float32), np.zeros(4, bool), holed.no_tiles()
    lines = ProfileLines(np.array([3.0, 2.0]), rays, 0.5, firsts)
    assert not sample_profiles(lines, 20.0, holed.pages, unsampled, done, depth)
    assert holed.named(unsampled) == [list(hole)]
    away = (np.arange(250) + 1) * 0.5
    a, b = (2.0 + (k == 0) + away * rays[:, :1, 0 + k] for k in (0, 1))
    inside = (np.floor(a / 0.5 / CELLS) == 1) & (np.floor(b / 0.5 / CELLS) == 0)
    stretch = np.arange(250) // SAMPLES_PER_RUN
    np.testing.assert_array_equal(done, [not inside[:, stretch == k].any() for k in range(4)])
    whole = map_of(height, 0.5, first=(-6, -6), tiles=(12, 12))
    assert sample_profiles(lines, 20.0, whole.pages, whole.no_tiles(), done, depth)
    np.testing.assert_allclose(depth, 20 - whole.read(a, b), atol=5e-6)


def test_beyond_the_map_its_border_is_named():
    """A line that leaves the tiles there are: the first corner of the border represents whatever lies beyond."""
    ground = map_of(swell(4), 0.5, first=(-1, -1), tiles=(2, 2))
    depth, unsampled = np.empty((1, 100), np.float32), ground.no_tiles()
    ray = np.array([[[1.0, 0.0]]])
    lines = ProfileLines(np.zeros(2), ray, 0.5, np.array([0, 100]))
    assert not sample_profiles(lines, 20.0, ground.pages, unsampled, np.zeros(2, bool), depth)
    assert np.argwhere(unsampled).tolist() == [[0, 0]]
