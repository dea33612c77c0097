"""Claims about the delays of uneven water: their size, and which of them are alike."""

import numpy as np
import pytest

from insonify.ocean.inhomogeneity import Inhomogeneity, delay_variance
from insonify.propagation.delay_field import DelayField
from insonify.propagation.image_sources import image_legs
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget
from oracles.few_of import few_of

DEPTH, SPEED = 20.0, 1500.0
SCENE = Scene(seabed={"depth": DEPTH}, water={"sound_speed": SPEED})
PATCHES = Inhomogeneity(rms_index=1e-4, correlation_length=2.0)
HERE, THERE = (0.0, 0.0, 6.0), (40.0, 10.0, 15.0)
SEEDS = 600


def delays(family, start, stop, *, uneven=PATCHES, seeds=SEEDS, time=0.0, lattice=None):
    """What the water of each seed adds to the travel time of one leg [s], shape (seeds,)."""
    point = point_scatterer(PointTarget(position=tuple(map(float, stop))))
    legs = image_legs(SCENE, np.array(start, float), point, (family,), 1e5)
    fields = (DelayField(uneven, seed, DEPTH, lattice or ScattererGrid()) for seed in range(1, seeds + 1))
    moved = (field.with_delays(legs, np.array(start, float), point.position, time) for field in fields)
    return np.array([one.delay[0, 0] - legs.delay[0, 0] for one in moved])


def walked(family, start, stop, count=600):
    """Places along a leg by mirrors in surface and bottom, shape (count, 3), and its length [m]."""
    image = np.array(stop, float)
    for letter in reversed(family.replace("D", "")):
        image[2] = -image[2] if letter == "S" else 2 * DEPTH - image[2]
    part = (np.arange(count)[:, None] + 0.5) / count
    way = np.array(start) + part * (image - start)
    while (way[:, 2] < 0).any() or (way[:, 2] > DEPTH).any():
        way[:, 2] = np.abs(way[:, 2])
        way[:, 2] = np.where(way[:, 2] > DEPTH, 2 * DEPTH - way[:, 2], way[:, 2])
    return way, float(np.linalg.norm(image - start))


def integrals(one, other, length=PATCHES.correlation_length):
    """Covariance of the integrals of a field of unit variance along two legs [m^2], by plain sums."""
    (a, far), (b, away) = walked(*one), walked(*other)
    square = np.sum((a[:, None] - b[None]) ** 2, axis=-1)
    return np.exp(-square / length**2).mean() * far * away


@pytest.mark.parametrize("way", [0.5, 2.0, 30.0])
def test_the_variance_is_that_of_the_integral_along_a_ray(way):
    """Double integral of exp(-(s - s')^2 / l^2), closed form against a plain sum: 1e-4."""
    s = (np.arange(3000) + 0.5) / 3000 * way
    total = np.exp(-((s[:, None] - s) ** 2) / PATCHES.correlation_length**2).mean() * way**2
    assert delay_variance(way, SPEED, PATCHES) == pytest.approx(total * (1e-4 / SPEED) ** 2, rel=1e-4)


def test_over_many_patches_the_phase_is_chernovs():
    """Phi^2 = sqrt(pi) k^2 <mu^2> l R to the patch that both ends cut: l / (sqrt(pi) R)."""
    way, wavenumber = 400.0, 2 * np.pi * 1e5 / SPEED
    phase = (2 * np.pi * 1e5) ** 2 * delay_variance(way, SPEED, PATCHES)
    chernov = np.sqrt(np.pi) * wavenumber**2 * PATCHES.rms_index**2 * PATCHES.correlation_length * way
    assert phase == pytest.approx(chernov * (1 - PATCHES.correlation_length / np.sqrt(np.pi) / way), rel=1e-6)


@pytest.mark.parametrize("family", ["D", "S", "BS"])
def test_delays_have_that_variance_and_no_mean(family):
    """600 seeds, one leg: variance and mean within 3 standard errors, sqrt(2 / 600) and 1 / sqrt(600) of sigma."""
    found = delays(family, HERE, THERE)
    variance = delay_variance(walked(family, HERE, THERE)[1], SPEED, PATCHES)
    assert np.var(found) == pytest.approx(variance, rel=3 * np.sqrt(2 / SEEDS))
    assert abs(found.mean()) < 3 * np.sqrt(variance / SEEDS)


@few_of(
    (1, 4, 5),
    ("one", "other"),
    [
        (("D", HERE, THERE), ("D", HERE, (40.0, 10.0, 14.0))),
        (("D", HERE, THERE), ("D", HERE, (38.8, 14.9, 15.0))),
        (("D", HERE, THERE), ("D", (0.0, 0.0, 8.0), (40.0, 10.0, 17.0))),
        (("D", HERE, THERE), ("S", HERE, THERE)),
        (("S", (0.0, 0.0, 1.0), (40.0, 10.0, 1.5)), ("D", (0.0, 0.0, 1.0), (40.0, 10.0, 1.5))),
        (("B", HERE, THERE), ("BS", HERE, THERE)),
    ],
    ids=["a point above", "a point beside", "parallel", "a surface path", "a grazing surface path", "bottom paths"],
)
def test_legs_are_as_alike_as_the_integrals_along_them(one, other):
    """Correlation over 600 seeds against double sums over both rays, mirrored by hand: 3 SE, and 0.03 of the ends."""
    found = np.corrcoef(delays(*one), delays(*other))[0, 1]
    expected = integrals(one, other) / np.sqrt(integrals(one, one) * integrals(other, other))
    assert found == pytest.approx(expected, abs=3 * (1 - expected**2) / np.sqrt(SEEDS) + 0.03)


def test_the_covariance_is_that_of_the_delays():
    """Covariance of D, S and B to one point, against 600 seeds: within 3 standard errors."""
    start, point = np.array(HERE), point_scatterer(PointTarget(position=THERE))
    legs = image_legs(SCENE, start, point, ("D", "S", "B"), 1e5)
    expected = DelayField(PATCHES, 1, DEPTH, ScattererGrid()).covariance(
        [(legs, start, np.arange(len(legs.families)))], point.position, np.array([0])
    )[0]
    found = np.cov([delays(family, HERE, THERE) for family in "DSB"])
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / size, expected / size, atol=3 * np.sqrt(2 / SEEDS))


def test_the_covariance_of_some_legs_is_part_of_that_of_all():
    """Legs that are not requested change nothing, and their way through the water is not followed."""
    start, point = np.array(HERE), point_scatterer(PointTarget(position=THERE))
    legs = image_legs(SCENE, start, point, ("D", "S", "B", "BS"), 1e5)
    field, once = DelayField(PATCHES, 1, DEPTH, ScattererGrid()), np.array([0])
    whole, part = (
        field.covariance([(legs, start, np.array(rows))], point.position, once) for rows in (range(4), [3, 1])
    )
    np.testing.assert_array_equal(part, whole[:, [[3], [1]], [3, 1]])


def test_glints_decorrelate_after_their_lifetime():
    """exp(-t^2 / T^2) after 0.5 T and 1.5 T, 3 standard errors; without a lifetime the bits stay."""
    slow = PATCHES.model_copy(update={"correlation_time": 20.0})
    first = delays("D", HERE, THERE, uneven=slow)
    for late in (10.0, 30.0):
        found = np.corrcoef(first, delays("D", HERE, THERE, uneven=slow, time=late))[0, 1]
        expected = np.exp(-((late / 20) ** 2))
        assert found == pytest.approx(expected, abs=3 * (1 - expected**2) / np.sqrt(SEEDS))
    still = [delays("D", HERE, THERE, seeds=5, time=t) for t in (0.0, 1e4)]
    np.testing.assert_array_equal(*still)


def test_a_moved_world_keeps_its_water():
    """Delays move with the frame of the scene, to a millionth of their size."""
    turn, moved = 0.7, np.array([300.0, -80.0])
    c, s = np.cos(turn), np.sin(turn)
    ends = [[*(moved + [c * x - s * y, s * x + c * y]), z] for x, y, z in (HERE, THERE)]  # noqa: RUF005
    frame = ScattererGrid(origin=tuple(moved), heading=turn)
    np.testing.assert_allclose(
        delays("S", *ends, seeds=20, lattice=frame), delays("S", HERE, THERE, seeds=20), rtol=0, atol=1e-6 * 8e-7
    )
