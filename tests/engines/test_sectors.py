"""Claims about points sorted by the lines of ground that pass them."""

import numpy as np
import pytest

from insonify.engines.skyline import SLICES, Skylines, StraightLaunches, sighted
from oracles.ridges import Corduroy, bed_of, seen_from


@pytest.mark.parametrize("count", [0, 1, 500])
def test_every_point_lies_in_the_slice_that_passes_it(count):
    """Each point once, in the sector and the slice that its bearing and its distance tell; in their order."""
    skylines = seen_from(bed_of())
    rng = np.random.default_rng(count)
    place, heading = np.array([0.0, 0.0, 10.0]), skylines.bed.ground.terrain.lattice.heading
    position = np.concatenate([rng.uniform(-15, 15, (count, 2)), np.full((count, 1), 20.0)], axis=1)
    seen = sighted(skylines, place, position)
    np.testing.assert_allclose(seen.distance, np.hypot(*position[:, :2].T))
    met = [np.asarray(points) for _, points, _ in seen.groups]
    np.testing.assert_array_equal(np.sort(np.concatenate([np.empty(0, int), *met])), np.arange(count))
    for lines, points, rows in seen.groups:
        assert np.all(np.diff(points) > 0)
        zone = np.searchsorted(skylines.edges, seen.distance[points])
        assert len(set(zone.tolist())) == 1  # all of one zone, as far as its lines reach
        assert lines.depth.shape[1] * skylines.step >= seen.distance[points].max()
        turn = np.mod((seen.azimuth[points] - heading) / (2 * np.pi), 1.0)
        piece = (turn * skylines.slices[zone[0]]).astype(int)
        assert len(set((piece // SLICES).tolist())) == 1
        np.testing.assert_array_equal(piece % SLICES, rows)


def test_lines_reach_as_far_as_is_heard_and_zones_of_like_slices_are_one():
    """Slices differ from zone to zone, and the last zone ends at the farthest distance that is asked."""
    skylines = Skylines(
        bed_of(), np.array([0.0, 0.0, 10.0]), StraightLaunches(10.0, 20.0), farthest=150.0, wavelength=0.015,
        finest_slice=0.01,
    )  # fmt: skip
    assert np.all(np.diff(skylines.slices) > 0) and np.all(np.diff(skylines.edges) > 0)
    assert skylines.edges[-1] == 150.0


def test_the_ground_along_a_line_is_that_of_the_place():
    """Heights read along lines, across pieces of the map, are those of a sine within linear interpolation."""
    wave, height = 8.0, 1.0
    skylines = seen_from(bed_of(Corduroy(wave, height)))
    zone = np.searchsorted(skylines.edges, 40.0)
    count, inner = skylines.slices[zone], skylines.edges[zone - 1]  # nearer ground is that of wider slices
    heading = skylines.bed.ground.terrain.lattice.heading
    azimuth = heading + 2 * np.pi * (np.array([100, 900]) + 0.5) / count  # middles of slices
    groups = skylines.groups_of(azimuth, np.full(2, 40.0))
    assert len(groups) == 2
    for lines, points, rows in groups:
        away, turn = (np.arange(lines.depth.shape[1]) + 1) * skylines.step, azimuth[points[0]]
        true = skylines.bed.depth_at(away * np.cos(turn), away * np.sin(turn))
        # sagitta of both directions: height / 2 (2 pi / wave)^2 cell^2 / 8
        sagitta = height / 2 * (2 * np.pi / wave * skylines.bed.map_cell) ** 2 / 8
        own = away > inner + 2 * skylines.step
        assert np.abs(lines.depth[rows[0]] - true)[own].max() < sagitta + 1e-5
