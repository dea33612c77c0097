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


def skylines_of(finest, *, farthest=200.0):
    """Skylines of flat ground for beams of which a third is so wide."""
    return Skylines(
        bed_of(), np.array([0.0, 0.0, 10.0]), StraightLaunches(10.0, 20.0), farthest=farthest, wavelength=0.015,
        finest_slice=finest,
    )  # fmt: skip


@pytest.mark.parametrize("finest", [0.1, 0.03, 0.01, 0.003, 0.001])
def test_slices_are_no_narrower_than_they_need_be(finest):
    """The narrowest are at most as wide as was asked, or a quarter of a wave of ground: never half as wide as both."""
    skylines = skylines_of(finest)
    width = 2 * np.pi / skylines.slices
    across = max(skylines.bed.ground.finest / 4, skylines.bed.map_cell)
    assert (width > finest / 2 - 1e-12).all() or skylines.slices.max() == 128
    enough = (width <= finest) | (width * skylines.edges <= across * (1 + 1e-9))
    assert enough.all()


def test_a_finer_beam_wants_more_slices_far_away_and_none_near():
    """Halved widths: the innermost zone has as many slices as before, the outermost more until waves decide."""
    counts = [skylines_of(finest).slices for finest in (0.04, 0.02, 0.01)]
    assert {int(slices[0]) for slices in counts} == {128}
    assert [int(slices[-1]) for slices in counts] == [256, 512, 1024]


def test_zones_do_not_depend_on_how_far_is_asked():
    """Ground nearer than the farthest is cut the same however long the window is."""
    near, far = skylines_of(0.01, farthest=60.0), skylines_of(0.01, farthest=200.0)
    distance, azimuth = np.linspace(0.5, 59.5, 200), np.linspace(-3, 3, 200)
    for points in (slice(None, 100), slice(100, None)):
        cut = [
            {(int(at), int(row)) for _, met, rows in one.groups_of(azimuth[points], distance[points])
             for at, row in zip(met, rows, strict=True)}
            for one in (near, far)
        ]  # fmt: skip
        assert cut[0] == cut[1]
