"""Claims about delays to the elements of an array: one wavefront serves them all, where it is smooth enough."""

from itertools import pairwise

import numpy as np
import pytest

from insonify.propagation._eigenray_kernel import COLUMNS, DELAY, MOST, solve_points
from insonify.propagation.elements import element_delays
from insonify.propagation.families import bounces, image_depth
from insonify.propagation.layers import Column

COLUMNS_OF_WATER = {
    "falling": ([0.0, 20.0], [1510.0, 1500.0]),
    "thermocline": ([0.0, 8.0, 14.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0]),
    "with a caustic": ([0.0, 4.0, 8.0, 20.0], [1510.0, 1510.0, 1490.0, 1490.0]),
}


def water(depth, speed):
    """A column of straight lines."""
    return Column(np.array(depth), np.array(speed))


def cross(wide=0.75, high=0.15, elements=21):
    """A horizontal line and an upright one through the same centre."""
    step = np.linspace(-1, 1, elements)
    lying = np.column_stack([0.8 * wide * step, 0.6 * wide * step, 0 * step])
    return np.concatenate([lying, np.column_stack([0 * step, 0 * step, high * step])])


def targets(n, seed, nearest=3.0):
    """Places up to 140 m off, at any depth."""
    random = np.random.default_rng(seed)
    return np.column_stack([random.uniform(-40, 40, n), random.uniform(nearest, 140, n), random.uniform(0.2, 19.8, n)])


@pytest.mark.parametrize("family", ["D", "S", "BS"])
def test_in_water_of_one_speed_the_expansion_is_exact(family):
    """The wavefront is a sphere about the image: delays are straight distances from each element's, to 1e-11 s."""
    place, points, offsets = np.array([0.0, 0.0, 11.0]), targets(200, 1, nearest=0.5), cross()
    found = element_delays(water([0, 20], [1500, 1500]), family, place, points, offsets, method="expansion")
    for e, offset in enumerate(offsets):
        end = place + offset
        image = np.array([*end[:2], image_depth(family, end[2], 20.0)])
        straight = np.linalg.norm(points - image, axis=1) / 1500
        np.testing.assert_allclose(found.delay[0, e], straight, atol=1e-11)


@pytest.mark.parametrize("name", COLUMNS_OF_WATER)
@pytest.mark.parametrize("depth", [5.0, 11.0, 17.0])
def test_the_choice_between_expansion_and_exact_rays_holds_its_tolerance(name, depth):
    """Delays to every element are those of a ray of its own to 1e-9 s; far off mostly without one.

    The ray of an element is found from the element itself, and is the nearest in delay to the chosen one.
    """
    column, place, points, offsets = (
        water(*COLUMNS_OF_WATER[name]),
        np.array([1.0, -2.0, depth]),
        targets(60, 2),
        cross(),
    )
    for family in ("D", "S", "BS"):
        found = element_delays(column, family, place, points, offsets)
        for e, offset in enumerate(offsets):
            own = rays_from(column, family, place + offset, points)
            away = np.abs(own[None] - found.delay[:, e, :, None]).min(axis=2)
            there = np.isfinite(found.delay[:, e]) & (away < 1e-6)  # else the element lies in a shadow of its own
            assert there.sum() > 0.9 * np.isfinite(found.delay[:, e]).sum()
            assert away[there].max() <= 1.1e-9


def rays_from(column, family, end, points):
    """Delays of all rays from one place, (n, MOST); infinite where there are fewer."""
    n, string = len(points), bounces(family)
    rays, count, status = np.zeros((n, MOST, COLUMNS)), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    away = np.hypot(*(points[:, :2] - end[:2]).T)
    solve_points(
        column.depth, column.speed, np.inf, end[2], len(string), string.startswith("S"), points[:, 2].copy(), away,
        rays, count, status,
    )  # fmt: skip
    return np.where(np.arange(MOST) < count[:, None], rays[:, :, DELAY], np.inf)


def test_the_error_grows_with_the_cube_of_the_array():
    """In a gradient an array of twice the size has eight times the error, within the fourth order's share."""
    column, place, points = water([0, 20], [1520, 1490]), np.array([0.0, 0.0, 11.0]), targets(100, 4, nearest=30)
    worst = []
    for size in (1.0, 2.0, 4.0):
        offsets = cross(wide=size, high=size)
        rough, fine = (
            element_delays(column, "D", place, points, offsets, method=method).delay
            for method in ("expansion", "exact")
        )
        worst.append(np.sqrt(np.mean((rough - fine) ** 2)))
    for small, large in pairwise(worst):
        assert large / small == pytest.approx(8, rel=0.15)


def test_far_from_knots_hardly_any_ray_is_solved_again():
    """Sonar in a smooth gradient, 20 to 140 m: the expansion holds 1e-9 s for a 1.5 m array at nearly all places."""
    found = element_delays(
        water([0, 20], [1510, 1500]), "D", np.array([0.0, 0.0, 11.0]), targets(300, 5, nearest=20), cross()
    )
    assert found.exact.mean() < 0.02 and found.error.max() < 3e-9


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"family": "BB"}, "family is 'BB'"),
        ({"method": "fast"}, "give auto, expansion or exact"),
        ({"tolerance": 0.0}, "positive time"),
        ({"place": np.array([0.0, 0.0, 21.0])}, "place: a depth is 21 m; the water goes from 0 to 20 m"),
        ({"offsets": np.array([[0.0, 0.0, 9.5]])}, "offsets: a depth is 20.5 m"),
        ({"points": np.array([[0.0, 5.0, -1.0]])}, "points: a depth is -1 m"),
    ],
)
def test_what_has_no_delay_is_refused(change, words):
    """Each complaint names the value and what may stand there."""
    asked = {"water": water([0, 20], [1500, 1500]), "family": "D", "place": np.array([0.0, 0.0, 11.0]),
             "points": targets(3, 0), "offsets": cross(), **change}  # fmt: skip
    with pytest.raises(ValueError, match=words):
        element_delays(**asked)
