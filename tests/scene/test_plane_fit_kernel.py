"""Planes fitted to ellipses of the map against least squares in double precision, sample by sample."""

import numpy as np
import pytest

from insonify.propagation.local_planes import _PATTERNS
from insonify.scene.plane_fit_kernel import EllipsePatches, fit_planes
from insonify.scene.plane_fit_samples import COARSE_PATTERN, FINE_PATTERN
from oracles.maps import map_of, swell

CELL = 0.25
SMALL, LARGE = zip((COARSE_PATTERN, FINE_PATTERN), _PATTERNS, strict=True)


def ellipses(seed, count, *, within=20.0, longest=6.0):
    """Random ellipses, and room for what is found of them."""
    rng = np.random.default_rng(seed)
    turn, length = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.3, longest, count)
    made = [*rng.uniform(-within, within, (2, count)), np.cos(turn), np.sin(turn), length,
            length * rng.uniform(0.05, 1, count)]  # fmt: skip
    return EllipsePatches(*made, *np.full((4, count), np.nan))


def fitted(ground, zones, pattern):
    """Fit them all; which are known, and the tiles that are missing."""
    known, missing = np.ones(len(zones.centre_a), bool), ground.no_tiles()
    fit_planes(zones, len(zones.centre_a), pattern, ground.pages, missing, known)
    return known, missing


def samples(zones, disc, q):
    """Places of the samples of one ellipse [m], and their parts of the half axes."""
    u, v = disc[:-1].T
    along, across = u * zones.half_length[q], v * zones.half_width[q]
    return (
        zones.centre_a[q] + along * zones.cosine[q] - across * zones.sine[q],
        zones.centre_b[q] + along * zones.sine[q] + across * zones.cosine[q],
        along,
        across,
    )


@pytest.mark.parametrize("which", [SMALL, LARGE])
@pytest.mark.parametrize("count", [0, 1, 7, 200])
def test_a_plane_is_that_of_least_squares(count, which):
    """Height, both slopes and the mean square left, of rough ground: rounding of the samples' places is all that gives.

    Places are reported to a ten-thousandth of a cell, on slopes of at most 0.6: heights to 2e-5 m.
    """
    disc, pattern = which
    ground, zones = map_of(swell(1), CELL), ellipses(count, count)
    known, missing = fitted(ground, zones, pattern)
    assert known.all() and not missing.any()
    for q in range(count):
        a, b, along, across = samples(zones, disc, q)
        height = ground.read(a, b)
        design = np.stack([np.ones(len(a)), along, across], axis=-1)
        (level, rise, aside), *_ = np.linalg.lstsq(design, height, rcond=None)
        rest = np.mean((height - design @ [level, rise, aside]) ** 2)
        assert zones.height[q] == pytest.approx(level, abs=2e-5)
        assert zones.along[q] * zones.half_length[q] == pytest.approx(rise * zones.half_length[q], abs=3e-5)
        assert zones.across[q] * zones.half_width[q] == pytest.approx(aside * zones.half_width[q], abs=3e-5)
        assert zones.residual_variance[q] == pytest.approx(rest, abs=2e-5 * np.sqrt(rest) + 1e-9)


def test_of_a_plane_nothing_is_left():
    """Inclined ground: its own height and slopes along the ellipse's axes, whatever these are."""
    north, east = 0.08, -0.05
    ground = map_of(lambda a, b: 0.4 + north * a + east * b, CELL)
    zones = ellipses(3, 100)
    fitted(ground, zones, LARGE[1])
    np.testing.assert_allclose(zones.height, 0.4 + north * zones.centre_a + east * zones.centre_b, atol=5e-6)
    np.testing.assert_allclose(zones.along, north * zones.cosine + east * zones.sine, atol=2e-5)
    np.testing.assert_allclose(
        zones.across * zones.half_width, (east * zones.cosine - north * zones.sine) * zones.half_width, atol=1e-5
    )
    np.testing.assert_allclose(zones.residual_variance, 0, atol=3e-9)


def test_ellipses_are_reported_alone_as_in_company_and_on_a_wider_map():
    """Any order and any part of them, more tiles about: the same bits. Those not requested keep what they had."""
    near, wide = map_of(swell(2), CELL), map_of(swell(2), CELL, first=(-5, -4), tiles=(9, 11))
    every = ellipses(4, 120)
    fitted(near, every, LARGE[1])
    order = np.random.default_rng(5).permutation(120)
    for ground, rows in ((near, order), (wide, np.arange(120)), (near, order[:1]), (wide, order[:33])):
        some = EllipsePatches(*(column[rows] for column in ellipses(4, 120)))
        fitted(ground, some, LARGE[1])
        np.testing.assert_array_equal(some, np.array(every)[:, rows])
    some, known = ellipses(4, 120), np.arange(120) % 3 == 0
    fit_planes(some, 120, LARGE[1], near.pages, near.no_tiles(), known)
    np.testing.assert_array_equal(np.array(some)[:, known], np.array(every)[:, known])
    assert np.isnan(np.array(some)[6:, ~known]).all()


def test_long_axes_may_point_either_way_and_a_mirror_turns_slopes_aside():
    """Half a turn: slopes change sign. Port for starboard: only that across does. Height and rest stay."""
    height = swell(6)
    ground, mirrored = map_of(height, CELL), map_of(lambda a, b: height(a, -b), CELL)
    zones = ellipses(7, 80)
    back = zones._replace(
        cosine=-zones.cosine, sine=-zones.sine, **dict(zip(EllipsePatches._fields[6:], np.empty((4, 80)), strict=True))
    )
    other = zones._replace(
        centre_b=-zones.centre_b,
        sine=-zones.sine,
        **dict(zip(EllipsePatches._fields[6:], np.empty((4, 80)), strict=True)),
    )
    for where, one in ((ground, zones), (ground, back), (mirrored, other)):
        fitted(where, one, LARGE[1])
    for name, turned, aside in (("height", 1, 1), ("along", -1, 1), ("across", -1, -1), ("residual_variance", 1, 1)):
        scale = zones.half_width if name == "across" else 1.0
        np.testing.assert_allclose(getattr(back, name) * scale, turned * getattr(zones, name) * scale, atol=3e-5)
        np.testing.assert_allclose(getattr(other, name) * scale, aside * getattr(zones, name) * scale, atol=3e-5)


def test_ground_that_is_unknown_counts_as_the_mean_and_less_than_half_comes_down_to_the_plane():
    """A coast: unknown beyond it. Slopes are those of least squares with the mean put in; faded by twice the share."""
    rough = swell(8)
    ground = map_of(lambda a, b: np.where(a < 0.3 * b, 1 + rough(a, b), np.nan), CELL)
    zones, seen = ellipses(9, 300, within=10.0), []
    fitted(ground, zones, LARGE[1])
    for q in range(300):
        a, b, along, across = samples(zones, LARGE[0], q)
        height = ground.read(a, b)
        there = np.isfinite(height)
        seen.append(there.mean())
        if not there.any():
            np.testing.assert_array_equal([zones.height[q], zones.along[q], zones.across[q]], 0)
            continue
        filled = np.where(there, height, height[there].mean())
        design = np.stack([np.ones(len(a)), along, across], axis=-1)
        plane = np.linalg.lstsq(design, filled, rcond=None)[0] * min(1, 2 * there.mean())
        np.testing.assert_allclose(
            [zones.height[q], zones.along[q] * zones.half_length[q], zones.across[q] * zones.half_width[q]],
            plane * [1, zones.half_length[q], zones.half_width[q]], atol=5e-5,
        )  # fmt: skip
        assert 0 <= zones.residual_variance[q] <= height[there].var() + 1e-6
    assert np.sum(np.array(seen) == 0) > 20 and np.sum((np.array(seen) > 0) & (np.array(seen) < 1)) > 50


def test_missing_tiles_are_reported_and_only_their_reads_are_deferred():
    """A hole in the map: the ellipses with a sample in it; beyond the map the border's first corner."""
    holed = map_of(swell(10), CELL, missing=((0, -1),))
    zones = ellipses(11, 200, within=28.0, longest=2.0)
    known, unread = fitted(holed, zones, LARGE[1])
    reads = []
    for q in range(200):
        a, b, *_ = samples(zones, LARGE[0], q)
        reads.append(np.any((np.floor(a / 16) == 0) & (np.floor(b / 16) == -1)))
    inside = np.maximum(np.abs(zones.centre_a), np.abs(zones.centre_b)) < 28
    np.testing.assert_array_equal(known[inside], ~np.array(reads)[inside])
    assert holed.named(unread) == [[0, -1]]
    far = ellipses(12, 3)._replace(centre_a=np.array([1e3, 0.0, -1e6]))
    known, unread = fitted(holed, far, SMALL[1])
    assert not known[0] and not known[2] and unread[0, 0]


def test_an_ellipse_that_is_no_place_has_the_mean_plane():
    """A bounce that is nowhere: 0, not a wait for ever."""
    zones = ellipses(13, 4)
    zones.centre_a[1], zones.half_length[2] = np.nan, np.inf
    known, missing = fitted(map_of(swell(1), CELL), zones, LARGE[1])
    assert known.all() and not missing.any()
    np.testing.assert_array_equal(np.array(zones)[6:, 1:3], 0)
