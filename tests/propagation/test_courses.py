"""Claims about paths off tilted planes.

Fermat's shortest path, mirror angles, and the order in which they are requested.
"""

import numpy as np
import pytest

from insonify.propagation.local_planes import (
    flat_bounces,
    flat_image_paths,
    fresnel_zone,
    local_plane_paths,
    paths_off_planes,
)
from insonify.scene.plane_fit_kernel import MAX_SAMPLES
from insonify.scene.plane_fit_samples import COARSE_PATTERN, FINE_PATTERN
from insonify.scene.seabed import Seabed

SONAR = np.array([1.0, -2.0, 11.0])
DEPTH = 20.0


def tilted(rng, count, mirrors):
    """Planes near the surface and near the bed in turn, tilted by a few per cent; the last is the surface's."""
    anchor, facing = np.zeros((mirrors, count, 3)), np.zeros((mirrors, count, 3))
    for k in range(mirrors):
        bed = (mirrors - k) % 2 == 0
        lean = rng.uniform(-0.03, 0.03, (count, 2))
        normal = np.concatenate([lean, np.full((count, 1), -1.0 if bed else 1.0)], axis=1)
        anchor[k, :, 2] = (DEPTH if bed else 0.0) + rng.uniform(-0.1, 0.1, count)
        facing[k] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return anchor, facing


def points_about(rng, count):
    """Points on about the bed, 20 to 80 m away."""
    distance, azimuth = rng.uniform(20, 80, count), rng.uniform(-np.pi, np.pi, count)
    depth = rng.uniform(14, 19, count)
    return np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), depth], axis=1)


@pytest.mark.parametrize("mirrors", [1, 2, 3, 4])
@pytest.mark.parametrize("count", [1, 128, 300])
def test_a_path_is_a_chain_of_straight_lines_off_its_mirrors(mirrors, count):
    """Bounces lie on their planes, segments add up to the length, and each mirror turns what comes in by its law."""
    rng = np.random.default_rng(mirrors * 1000 + count)
    anchor, facing = tilted(rng, count, mirrors)
    points = points_about(rng, count)
    way = paths_off_planes(SONAR, points, anchor, facing)
    assert way.is_valid.all()
    np.testing.assert_allclose(np.sum((way.bounce_position - anchor) * facing, axis=-1), 0, atol=1e-10)
    stops = np.concatenate([np.broadcast_to(SONAR, (1, count, 3)), way.bounce_position, points[None]])
    segments = np.diff(stops, axis=0)
    lengths = np.linalg.norm(segments, axis=-1)
    np.testing.assert_allclose(lengths.sum(axis=0), way.length, rtol=1e-12)
    np.testing.assert_allclose(np.cumsum(lengths, axis=0)[:-1] / way.length, way.fraction, rtol=1e-9)
    along = segments / lengths[..., None]
    np.testing.assert_allclose(along[0], way.departure, atol=1e-9)
    np.testing.assert_allclose(along[-1], way.arrival, atol=1e-9)
    for k in range(mirrors):
        turned = np.sum(along[k] * facing[k], axis=-1, keepdims=True)
        np.testing.assert_allclose(along[k] - 2 * turned * facing[k], along[k + 1], atol=1e-9)
        np.testing.assert_allclose(np.abs(turned[:, 0]), way.grazing_sine[k], atol=1e-12)


def test_no_path_is_shorter():
    """Fermat: bounces moved by a centimetre on their planes make every way longer."""
    rng = np.random.default_rng(5)
    anchor, facing = tilted(rng, 50, 2)
    points = points_about(rng, 50)
    way = paths_off_planes(SONAR, points, anchor, facing)
    for _ in range(20):
        moved = way.bounce_position + 0.01 * rng.normal(size=way.bounce_position.shape)
        moved -= np.sum((moved - anchor) * facing, axis=-1, keepdims=True) * facing
        stops = np.concatenate([np.broadcast_to(SONAR, (1, 50, 3)), moved, points[None]])
        assert np.all(np.linalg.norm(np.diff(stops, axis=0), axis=-1).sum(axis=0) > way.length)


def test_a_point_below_its_mirror_has_no_way():
    """The bed as a mirror at 20 m: 19.9 m is above it, 20.1 m is not."""
    points = np.array([[30.0, 0.0, 19.9], [30.0, 0.0, 20.1]])
    np.testing.assert_array_equal(flat_image_paths("B", SONAR, points, DEPTH).is_valid, [True, False])


@pytest.mark.parametrize("family", ["B", "S", "BS", "SB", "SBS", "BSB", "BSBS"])
def test_paths_over_a_flat_seabed_are_identified_by_their_lengths(family):
    """Parts of the way before each bounce, by how much it climbs till then: those of images in level planes."""
    points = points_about(np.random.default_rng(6), 50)
    way = flat_image_paths(family, SONAR, points, DEPTH)
    expected = flat_bounces(family, SONAR[2], way.length, np.abs(way.departure[:, 2]), DEPTH)
    np.testing.assert_allclose(expected.fraction, way.fraction, rtol=1e-9)
    np.testing.assert_allclose(expected.grazing_sine, way.grazing_sine, rtol=1e-9)


@pytest.mark.parametrize("family", ["B", "BS", "SBS"])
def test_points_have_their_ways_independent_of_other_points(family):
    """Alone, in another order, among hundreds or after others far off: the same bits, over ground drawn on the way."""
    relief = {"kind": "power-law", "hurst": 0.8, "rms": 0.05}
    points = points_about(np.random.default_rng(7), 150)
    points[:, 1] = 0.05 * np.abs(points[:, 0])

    def ways(rows, *before):
        bed = (
            Seabed(depth=DEPTH, relief=relief, seed=1, cutoff_wavelength=0.5, scattering=None)
            .completed(1, 1e5, 1500.0)
            .terrain
        )
        for place in before:  # widens the map of the bed
            local_plane_paths(family, SONAR + place, points + place, bed, 0.015)
        return local_plane_paths(family, SONAR, points[rows], bed, 0.015)

    order = np.random.default_rng(8).permutation(150)
    every, mixed, few = ways(np.arange(150)), ways(order), ways(np.arange(140, 143))
    for one, other in zip(every, ways(np.arange(150), np.array([-60.0, 30.0, 0.0])), strict=True):
        np.testing.assert_array_equal(one, other)
    for name in ("length", "departure", "arrival", "is_valid"):
        np.testing.assert_array_equal(getattr(mixed, name), getattr(every, name)[order])
        np.testing.assert_array_equal(getattr(few, name), getattr(every, name)[140:143])
    for name in ("bounce_position", "fraction", "grazing_sine", "residual_variance"):
        np.testing.assert_array_equal(getattr(mixed, name), getattr(every, name)[:, order])


def test_ground_without_height_is_the_mean_plane():
    """Ripples of a micrometre: fitted planes give the level ways, to 1e-6 m and 1e-6 rad."""
    bed = Seabed(
        depth=DEPTH, relief={"kind": "ripples", "height": 1e-6, "wavelength": 2.0}, cutoff_wavelength=0.5
    ).terrain
    points = points_about(np.random.default_rng(9), 40)
    found, level = local_plane_paths("BS", SONAR, points, bed, 0.015), flat_image_paths("BS", SONAR, points, DEPTH)
    np.testing.assert_allclose(found.length, level.length, atol=3e-6)
    np.testing.assert_allclose(found.departure, level.departure, atol=1e-5)


def test_an_inclined_bed_is_its_own_plane(tmp_path):
    """A bed that falls by 3 % to the north and rises by as much to the east: the image in it, and nothing left over.

    Whatever the bearings and the sizes of the zones. Where the ground is unknown it is the mean plane.
    """
    nodes = np.arange(-120.0, 121.0, 2.0)
    depth = DEPTH + 0.03 * nodes[:, None] - 0.03 * nodes[None, :]
    np.savez(tmp_path / "survey.npz", depth=depth, north=nodes, east=nodes)
    relief = {"kind": "grid", "file": str(tmp_path / "survey.npz"), "origin": (0.0, 0.0)}
    bed = Seabed(depth=DEPTH, relief=relief).terrain
    points = points_about(np.random.default_rng(4), 200) - [0.0, 0.0, 5.0]  # above the bank
    anchor = np.tile([0.0, 0.0, DEPTH], (1, 200, 1))
    normal = np.array([0.03, -0.03, -1.0]) / np.sqrt(1.0018)
    exact = paths_off_planes(SONAR, points, anchor, np.tile(normal, (1, 200, 1)))
    found = local_plane_paths("B", SONAR, points, bed, 0.015)
    assert found.is_valid.all()
    np.testing.assert_allclose(found.length, exact.length, atol=2e-5)
    np.testing.assert_allclose(found.bounce_position, exact.bounce_position, atol=5e-3)
    np.testing.assert_allclose(found.departure, exact.departure, atol=1e-4)
    np.testing.assert_allclose(found.residual_variance, 0, atol=1e-8)
    beyond = SONAR + np.array([500.0, 0.0, 0.0]), points + np.array([500.0, 0.0, 0.0])
    np.testing.assert_array_equal(
        local_plane_paths("B", *beyond, bed, 0.015).length, flat_image_paths("B", *beyond, DEPTH).length
    )


def test_the_samples_of_a_plane_weigh_as_a_disc():
    """Second moments of both patterns are those of the unit disc, a quarter; no more of them than there is room."""
    for pattern in (FINE_PATTERN, COARSE_PATTERN):
        samples = pattern[:-1]
        np.testing.assert_allclose(samples.T @ samples / len(samples), np.eye(2) / 4, atol=1e-12)
        assert len(samples) <= MAX_SAMPLES


def test_zones_are_those_of_fresnel():
    """Half the width is the distance at which a way round is half a wave longer; the length is that over the sine."""
    points = np.array([[40.0, 0.0, 12.0], [70.0, 10.0, 16.0]])
    way = flat_image_paths("B", SONAR, points, DEPTH)
    length, width = fresnel_zone(way, 0, 0.015)
    before, after = way.fraction[0] * way.length, (1 - way.fraction[0]) * way.length
    round_it = np.hypot(before, width) + np.hypot(after, width)
    np.testing.assert_allclose(round_it - way.length, 0.015 / 2, rtol=0.01)
    np.testing.assert_allclose(length, width / way.grazing_sine[0], rtol=1e-12)


def test_no_points_have_no_ways():
    """Nothing is evaluated at the ground."""
    bed = Seabed(
        depth=DEPTH, relief={"kind": "ripples", "height": 0.02, "wavelength": 2.0}, cutoff_wavelength=0.5
    ).terrain
    assert local_plane_paths("BS", SONAR, np.empty((0, 3)), bed, 0.015).bounce_position.shape == (2, 0, 3)
