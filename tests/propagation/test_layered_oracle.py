"""The exact solver against shooting in 50-digit arithmetic, and that oracle against what is known in closed form."""

import numpy as np
import pytest

from insonify.ocean import SoundSpeedProfile
from insonify.propagation import eigenrays
from oracles.columns import nasty_column, random_column, random_distance
from oracles.layered import FAMILIES, rays, shots
from oracles.water import fold

NEAR_AN_EDGE = 1e-3
"""A point this near to a shadow edge, a fold or a critical launch may be judged either way [m]."""
MOST = 8
"""Rays of one family to one point that the solver gives."""


def solved(depth, speed, source, family, point, distance):
    """Rows of the solver, without those that only state that there is no path."""
    profile = SoundSpeedProfile(np.asarray(depth, float), np.asarray(speed, float))
    found = eigenrays(
        profile, water_depth=float(depth[-1]), source_depth=source, point_depth=point, range=distance, families=[family]
    )
    return found, np.flatnonzero(found.status == "ok")


@pytest.mark.parametrize("family", FAMILIES)
def test_the_oracle_runs_straight_where_sound_has_one_speed(family):
    """Length, delay, angle and spreading are those of the folded straight line."""
    for distance in (0.7, 12.0, 300.0):
        (ray,) = rays([0, 20], [1500, 1500], 11.0, family, 17.5, distance)
        path = fold((0, 0, 11.0), (distance, 0, 17.5), family, 20.0)
        assert ray.length == pytest.approx(path.length, rel=1e-14)
        assert ray.delay == pytest.approx(path.length / 1500, rel=1e-14)
        assert ray.amplitude == pytest.approx(1 / path.length, rel=1e-12)
        assert abs(np.sin(ray.launch)) == pytest.approx(path.sine, rel=1e-12)
        assert ray.caustics == ray.turns == 0


@pytest.mark.parametrize("gradient", [-0.5, 0.3, 5.0, 1e-7])
def test_the_oracle_follows_circles_where_the_gradient_is_one(gradient):
    """T = 2 / |g| asinh(|g| d / (2 sqrt(c1 c2))), d the straight distance; amplitude^2 = c_r^2 / (c_0 c_r d'^2) there.

    Source: Officer (1958), not verified; the delay by hand from the hyperbolic distance of a half plane.
    """
    speed = [1500.0, 1500.0 + 200 * gradient]
    for distance in (3.0, 40.0, 200.0):
        (ray,) = rays([0, 200], speed, 80.0, "D", 120.0, distance)
        c1, c2 = 1500 + 80 * gradient, 1500 + 120 * gradient
        straight = np.hypot(distance, 40.0)
        assert ray.delay == pytest.approx(
            2 / abs(gradient) * np.arcsinh(abs(gradient) * straight / 2 / np.sqrt(c1 * c2)),
            rel=1e-9 if gradient < 1e-3 else 1e-13,
        )


def test_the_oracle_counts_the_caustic_of_a_thermocline_above_still_water():
    """Behind its fold the ray that turned late has touched the caustic once, the flatter one not at all."""
    steep, flat = rays([0, 4, 8, 20], [1510, 1510, 1490, 1490], 11.0, "D", 19.0, 200.0)
    assert (steep.caustics, flat.caustics) == (1, 0)
    assert steep.delay > flat.delay and (steep.turns, flat.turns) == (1, 0)


def disagreements(make, seed):
    """What solver and oracle do not agree on in one random column, in words; and how many rays were compared."""
    rng = np.random.default_rng(seed)
    depth, speed, source, point = make(rng)
    words, compared = [], 0
    for family in FAMILIES:
        distance = random_distance(rng)
        expected = rays(depth, speed, source, family, point, distance)
        found, rows = solved(depth, speed, source, family, point, distance)
        place = f"seed {seed}, {family} over {distance!r} m: "
        pairs, missing = paired(expected, found, rows)
        words += [place + f"{word}" for word in missing]
        words += [place + word for ray, row in pairs for word in differences(ray, found, row)]
        compared += len(pairs)
    return words, compared


def paired(expected, found, rows):
    """Rays of the oracle with rows of the solver, and words on those that have no partner."""
    if len(rows) == MOST < len(expected):
        kept = sorted({int(np.argmin([abs(ray.launch - found.launch_angle[row]) for ray in expected])) for row in rows})
        left = [ray.turns for i, ray in enumerate(expected) if i not in kept]
        if min(left) < max(expected[i].turns for i in kept):
            return [], ["rays with more turns were given than some that were left out"]
        expected = [expected[i] for i in kept]
    if len(expected) != len(rows):
        if min((ray.fold for ray in expected), default=np.inf) < NEAR_AN_EDGE:
            return [], []
        return [], [f"{len(expected)} rays, and {len(rows)} were found ({found.status[0]})"]
    return [(ray, row) for ray, row in zip(expected, rows, strict=True) if ray.fold > NEAR_AN_EDGE], []


def differences(ray, found, row):
    """Words on each number of a ray that is off by more than it may be."""
    level = 20 * np.log10(found.amplitude[row] / ray.amplitude)
    off = {
        "delay": (found.delay[row] - ray.delay, 1e-11), "level": (level, 0.01),
        "launch": (np.degrees(found.launch_angle[row] - ray.launch), 1e-4),
        "arrival": (np.degrees(found.arrival_angle[row] - ray.arrival), 1e-4),
        "length": (found.path_length[row] - ray.length, 1e-7),
        "caustics": (found.caustics[row] - ray.caustics, 0), "turns": (found.turning_points[row] - ray.turns, 0),
    }  # fmt: skip
    return [f"{name} is off by {error:.3g}" for name, (error, most) in off.items() if not abs(error) <= most]


@pytest.mark.slow
def test_random_columns_have_the_rays_that_shooting_finds():
    """12 columns of 2 to 12 knots, about 80 rays: 1e-11 s, 1e-4 deg, 0.01 dB; none missing, none invented."""
    differences = [disagreements(random_column, seed) for seed in range(12)]
    assert [word for words, _ in differences for word in words] == []
    assert sum(compared for _, compared in differences) > 65


@pytest.mark.slow
def test_awkward_columns_have_the_rays_that_shooting_finds():
    """Channels, knots a nanometre apart, hardly a gradient, ends a hair from a knot: 15 columns, as well as those."""
    differences = [disagreements(nasty_column, seed) for seed in range(15)]
    assert [word for words, _ in differences for word in words] == []


@pytest.mark.slow
@pytest.mark.parametrize("make", [random_column, nasty_column])
def test_every_ray_that_is_shot_is_found(make):
    """Launched at random, and down to 1e-9 of the way to a grazing ray: found where it comes down, to 1e-5 deg.

    8 columns; rays that turn eight times or more may be crowded out by others.
    """
    shot = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        depth, speed, source, point = make(rng)
        for family in FAMILIES:
            fair = [one for one in shots(depth, speed, source, family, point, 500.0, rng) if is_fair(one)]
            if not fair:
                continue
            found, rows = solved(depth, speed, source, family, point, np.array([one.distance for one in fair]))
            for i, one in enumerate(fair):
                mine = rows[(found.point[rows] == i) & (found.turning_points[rows] == one.turns)]
                off = np.degrees(np.abs(found.launch_angle[mine] - one.launch).min(initial=1))
                crowded = np.sum(found.point[rows] == i) == MOST
                assert off < 1e-5 or crowded, (
                    f"seed {seed}, {family}, launch {np.degrees(one.launch)!r} deg, {off:.3g} off"
                )
            shot += len(fair)
    assert shot > 60


def is_fair(shot):
    """Whether a shot neither comes down at the end of its branch nor turns so often that others may crowd it out."""
    return shot.distance > NEAR_AN_EDGE and shot.edge > NEAR_AN_EDGE and shot.turns < MOST


@pytest.mark.validate
@pytest.mark.parametrize("make", [random_column, nasty_column])
def test_hundreds_of_columns_have_the_rays_that_shooting_finds(make):
    """600 random columns and as many awkward ones."""
    differences = [disagreements(make, seed) for seed in range(1000, 1600)]
    assert [word for words, _ in differences for word in words] == []
