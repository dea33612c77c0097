"""Launch horizons and crests against a plain walk, and diffraction over them against the strongest single edge."""

import numpy as np
import pytest

from insonify.engines._terrain_diffraction_kernel import (
    CANDIDATES,
    CREST,
    MAX_CRESTS,
    NEGLIGIBLE_CHANGE,
    CrestCandidates,
    CrestRay,
    LaunchHorizon,
    LineRays,
    add_candidates,
    diffract_over_crests,
    diffract_rising_rays,
    launch_horizon,
    multiply_strongest_crests,
    negligible_beyond,
    occlude_terrain_points,
    surely_unobstructed,
)
from insonify.propagation.knife_edge import edge_diffraction_table, knife_edge
from insonify.propagation.knife_edge_kernel import ENDLESS, crest_diffraction_factor

WAVELENGTH, STEP = 0.015, 0.5


def horizon_along(slope, *, rising=False):
    """Launch horizon of some lines with samples every `STEP`."""
    slope = np.array(slope, np.float32)
    return launch_horizon(slope, ((np.arange(slope.shape[1]) + 1) * STEP).astype(np.float32), rising, WAVELENGTH)


def lines_of_ground(seed, count, samples):
    """Launch slopes of straight rays from 9 m above rough ground, with some that are unknown and some that are even."""
    rng = np.random.default_rng(seed)
    depth = 9 + np.cumsum(rng.normal(0, 0.2, (count, samples)), axis=1)
    launch = depth / ((np.arange(samples) + 1) * STEP)
    launch[rng.random(launch.shape) < 0.05] = np.nan
    even = rng.random(launch.shape) < 0.1
    launch[:, 1:][even[:, 1:]] = launch[:, :-1][even[:, 1:]]
    return launch


@pytest.mark.parametrize("rising", [False, True])
@pytest.mark.parametrize("samples", [1, 2, 3, 100])
def test_a_skyline_is_the_least_launch_so_far_and_a_crest_where_it_stops_sinking(samples, rising):
    """50 lines: the running minimum (of rising rays the maximum from the far end), and crests one by one."""
    expected = lines_of_ground(samples, 50, samples)
    launch, bound, crest, computed = horizon_along(expected, rising=rising)
    distance = ((np.arange(samples) + 1) * STEP).astype(np.float32)
    known, sense = np.where(np.isfinite(expected), expected, -np.inf if rising else np.inf), -1 if rising else 1
    np.testing.assert_array_equal(launch, known.astype(np.float32))
    order = slice(None, None, sense)
    walk = (sense * launch)[:, order]
    lowest = np.minimum.accumulate(walk, axis=1)
    np.testing.assert_array_equal(sense * bound[:, order], lowest)
    for s in range(50):
        starts, deepest, last = [], [], -1
        for k in range(samples):
            hidden = np.isfinite(walk[s, k]) and walk[s, k] > lowest[s, k]
            if hidden:
                at = max(j for j in range(k) if walk[s, j] == lowest[s, k] and np.isfinite(walk[s, j]))
                if not starts or starts[-1] != at:
                    starts.append(at)
                    deepest.append(0.0)
                deepest[-1] = max(deepest[-1], (walk[s, k] - lowest[s, k]) * distance[order][k])
                last = len(starts) - 1
            if np.isfinite(walk[s, k]):
                assert crest[s, order][k] == last
        ends = np.array([samples - 1 - at if rising else at for at in starts], int)
        np.testing.assert_array_equal(computed["sample"][s, : len(ends)], ends)
        assert crest[s].max() == len(ends) - 1
        np.testing.assert_array_equal(computed["launch_slope"][s, : len(ends)], launch[s, ends])
        np.testing.assert_allclose(computed["trough_depth"][s, : len(ends)], deepest, rtol=1e-5)
        for number, at in enumerate(ends):
            reported = negligible_beyond(float(distance[at]), float(computed["trough_depth"][s, number]), WAVELENGTH)
            assert computed["negligible_beyond"][s, number] == pytest.approx(reported, rel=1e-6)


def test_a_crest_that_is_no_longer_felt_changes_nothing_that_counts():
    """Nearer than it is felt from, no ray that clears it loses more than WEAK by it: 2000 crests, 200 clearances."""
    rng = np.random.default_rng(2)
    near, hollow = rng.uniform(2, 100, 2000), 10 ** rng.uniform(-4, -1, 2000)
    until = np.array([negligible_beyond(a, h, WAVELENGTH) for a, h in zip(near, hollow, strict=True)])
    some = np.flatnonzero(np.isfinite(until) & (until < 1e4))
    assert len(some) > 100 and np.isinf(until).any() and (until > near).all()
    for n in some:
        # the longer the leg, the wider the zone: beyond the distance it is given for
        length = until[n] * 1.001
        for clear in 10 ** rng.uniform(-6, 1, 2):
            left = crest_diffraction_factor(
                -clear, hollow[n], length - near[n], length, WAVELENGTH, edge_diffraction_table()
            )
            assert abs(left - 1) < NEGLIGIBLE_CHANGE


@pytest.mark.parametrize("samples", [1, 2, 255, 256, 257, 258, 600])
def test_what_never_rises_is_what_falls_at_every_sample(samples):
    """Each launch below the one before, by more than rounding: otherwise, wherever it is, not; nor where none is known.

    Depths of 9 m and less than a mirror wave of ground: a flat seabed never rises, a step of 3 % at any sample does.
    """
    distance = ((np.arange(samples) + 1) * STEP).astype(np.float32)
    level = np.full((3, samples), 20.0, np.float32)
    assert surely_unobstructed(level, distance, np.float32(11), 256)
    for at in {0, samples // 2, samples - 1} - {0}:
        for value in (-1e3, np.nan):
            rough = level.copy()
            # beyond it the launch is less again; the sample itself has a steeper launch than the one before
            rough[1, at] = 11 + 9 * (at + 1) / at * 1.03 if value == -1e3 else value
            assert not surely_unobstructed(rough, distance, np.float32(11), 256)
            above = level.copy()
            above[2, at] = 10.0
            assert not surely_unobstructed(above, distance, np.float32(11), 256)


def test_ground_reported_open_hides_none_of_itself():
    """Growing roughness: where `surely_unobstructed` is true, the walk finds no crest; it is true for some."""
    rng, reported = np.random.default_rng(5), 0
    for rms in np.repeat([0.003, 0.01, 0.03, 0.1], 25):
        depth = (20 + rng.normal(0, rms, (1, 60))).astype(np.float32)
        distance = ((np.arange(60) + 1) * STEP).astype(np.float32)
        if surely_unobstructed(depth, distance, np.float32(11), 16):
            reported += 1
            assert horizon_along((depth - 11) / distance).last_crest.max() == -1
    assert 10 < reported < 90


def factor_of_strongest(computed, s, last, way, distance):
    """Factor that differs most from 1 among those of the last crests of one line."""
    stretch, every = np.hypot(1, way), [1 + 0j]
    for number in range(last, max(last - MAX_CRESTS, -1), -1):
        near = (computed["sample"][s, number] + 1) * STEP
        above = (way - computed["launch_slope"][s, number]) * near / stretch
        hollow = computed["trough_depth"][s, number] / stretch
        behind, length, table = (distance - near) * stretch, distance * stretch, edge_diffraction_table()
        every.append(crest_diffraction_factor(above, hollow, behind, length, WAVELENGTH, table))
    return max(every, key=lambda left: abs(left - 1))


def strongest_crest_factor(horizon, last, blocking, ray):
    """Factor of the crest that changes one ray most."""
    left, candidates = np.ones(1, complex), CrestCandidates(np.empty(8 * CANDIDATES), np.empty(CANDIDATES, np.int64))
    count = add_candidates(horizon, last, blocking, ray, STEP, WAVELENGTH, candidates, 0)
    multiply_strongest_crests(candidates, count, WAVELENGTH, edge_diffraction_table(), left)
    return left[0]


def test_the_crest_that_takes_most_is_found_whatever_is_passed_over():
    """1000 rays over rough lines: what is left is that of the worst of the last crests, within what is called weak."""
    horizon = horizon_along(lines_of_ground(7, 40, 120))
    _, bound, crest, computed = horizon
    rng, checked = np.random.default_rng(8), 0
    for s, k in zip(rng.integers(0, 40, 1000), rng.integers(20, 120, 1000), strict=True):
        if crest[s, k] < 0:
            continue
        way, distance = float(bound[s, k] * rng.uniform(0.9, 1.1)), (k + 1.5) * STEP
        found = strongest_crest_factor(horizon, crest[s, k], -1, CrestRay(s, 0, 1.0, way, ENDLESS, distance))
        assert abs(found - factor_of_strongest(computed, s, crest[s, k], way, distance)) < 2 * NEGLIGIBLE_CHANGE
        checked += 1
    assert checked > 500


def test_ground_that_still_rises_cuts_like_an_endless_screen():
    """No crest, but a ray that dips into its sample: the knife edge's own integral at that height and distance."""
    launch = np.full(50, 0.3, np.float32)
    for way in (0.2, 0.299, 0.3, 0.301, 0.35):
        stretch, near, distance = np.hypot(1, way), 21 * STEP, 40.0
        horizon = LaunchHorizon(launch[None], launch[None], np.empty((1, 50), np.int32), np.empty((1, 1), CREST))
        left = strongest_crest_factor(horizon, -1, np.int32(20), CrestRay(0, 0, 1.0, way, ENDLESS, distance))
        high, d1, d2 = (way - float(launch[20])) * near / stretch, near * stretch, (distance - near) * stretch
        longer = np.hypot(d1, high) - d1 + np.hypot(d2, high) - d2  # than the straight way
        number = np.copysign(2 * np.sqrt(longer / WAVELENGTH), high)
        assert left == pytest.approx(complex(knife_edge(number)), abs=2e-5)


def crest_factor_over(way, reach, horizon, *, ground, soft=True):
    """Visibility of some points of line 0, and the factors of their rays."""
    count = len(reach)
    lit, left = np.ones(count, bool), np.full(count, 1 + 0j)
    rays = LineRays(np.zeros(count, np.int64), np.arange(count), way, reach + 1.0, lit, left)
    if ground:
        occlude_terrain_points(horizon, STEP, rays, reach, WAVELENGTH, edge_diffraction_table(), soft)
    else:
        diffract_over_crests(horizon, STEP, rays, reach, WAVELENGTH, edge_diffraction_table())
    return lit, left


@pytest.mark.parametrize("seed", range(6))
def test_ground_is_visible_where_no_nearer_ground_has_a_flatter_launch(seed):
    """Positions between samples, a launch linear between two: lit where it is not above the least of all before it."""
    horizon = horizon_along(np.nan_to_num(lines_of_ground(seed, 1, 80), nan=0.4))
    launch, bound, _, _ = horizon
    reach = np.random.default_rng(seed).uniform(0.2, 40.4, 400)
    lit, left = crest_factor_over(np.empty(400), reach, horizon, ground=True)
    for far, seen, part in zip(reach, lit, left, strict=True):
        k = min(int(far / STEP) - 1, 78)
        if k < 0:
            assert seen and part == 1
            continue
        between = min(far / STEP - (k + 1), 1.0)
        way = float(launch[0, k]) + between * float(launch[0, k + 1] - launch[0, k])
        if abs(way - float(bound[0, k])) > 1e-6:
            assert seen == (way < bound[0, k])
        assert seen or part != 1  # what is dark is dimmed
    hard, same = crest_factor_over(np.empty(400), reach, horizon, ground=True, soft=False)
    np.testing.assert_array_equal(hard, lit)
    assert np.all(same == 1)


def test_points_do_not_depend_on_the_others_and_are_evaluated_once():
    """Any order, any part of them: bit-identical; rows not requested are unchanged."""
    horizon = horizon_along(lines_of_ground(3, 5, 90))
    rng = np.random.default_rng(4)
    reach, way, rows = rng.uniform(1, 45, 300), rng.uniform(0.1, 0.6, 300), rng.integers(0, 5, 300)

    def left_of(points):
        left = np.full(300, 2 - 1j)
        rays = LineRays(rows[points], points, way, reach + 1.0, np.empty(0, bool), left)
        diffract_over_crests(horizon, STEP, rays, reach, WAVELENGTH, edge_diffraction_table())
        return left

    every, some = left_of(np.arange(300)), rng.permutation(300)[:120]
    np.testing.assert_array_equal(left_of(some)[some], every[some])
    np.testing.assert_array_equal(np.delete(left_of(some), some), 2 - 1j)
    np.testing.assert_array_equal(left_of(np.empty(0, np.int64)), 2 - 1j)


def test_a_ray_that_rises_out_of_ground_is_as_one_that_comes_down_on_it():
    """A lone knife 2 m high half way of a long leg: from below or from above, the same pressure at equal clearance."""
    base = np.full((1, 79), 0.1)
    base[0, 39] = 0.3
    up, down = horizon_along(base, rising=True), horizon_along(-base)
    for clearance in (-0.05, -0.001, 0.0, 0.001, 0.05):
        left = np.full((2, 1), 1 + 0j)
        way = np.array([0.3 - clearance])  # rising rays are launched below the knife's where they are cut
        points, reach = np.zeros(1, np.int64), np.array([40.0])
        rising = LineRays(points, points, way, reach, np.ones(1, bool), left[0])
        falling = LineRays(points, points, -way, reach, np.empty(0, bool), left[1])
        table = edge_diffraction_table()
        diffract_rising_rays(up, STEP, rising, np.ones(1), np.array([79.0]), WAVELENGTH, table)
        diffract_over_crests(down, STEP, falling, np.array([39.5]), WAVELENGTH, table)
        assert left[0, 0] == pytest.approx(left[1, 0], abs=1e-6)
