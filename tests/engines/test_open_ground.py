"""Unobstructed terrain, and crests with a negligible effect."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.engines._terrain_diffraction_kernel import (
    NEGLIGIBLE_CHANGE,
    LineRays,
    diffract_over_crests,
    launch_horizon,
    negligible_beyond,
    occlude_terrain_points,
    surely_unobstructed,
)
from insonify.propagation.knife_edge import edge_diffraction_table
from insonify.propagation.knife_edge_kernel import crest_is_negligible, sincos_of_quarter_turns

STEP, WAVE = 0.25, 0.015


def crests_of(depth: np.ndarray, image: np.float32) -> int:
    """Number of crests along lines, by the walk."""
    distance = (np.arange(depth.shape[1], dtype=np.float32) + 1) * np.float32(STEP)
    return int(launch_horizon((depth - image) / distance, distance, False, WAVE).last_crest.max()) + 1


@given(st.integers(0, 10**6), st.floats(0.0, 0.1), st.floats(2.0, 60.0))
def test_lines_that_are_reported_open_have_no_crest(seed: int, rough: float, height: float) -> None:
    """Any ground of up to 10 cm of roughness, seen from 2 to 60 m above: the walk finds nothing either."""
    depth = (20 + rough * np.random.default_rng(seed).standard_normal((3, 400)).cumsum(axis=1) / 20).astype(np.float32)
    distance = (np.arange(400, dtype=np.float32) + 1) * np.float32(STEP)
    image = np.float32(20 - height)
    if surely_unobstructed(depth, distance, image, 64):
        assert crests_of(depth, image) == 0


def test_level_ground_is_open_and_a_step_up_is_not() -> None:
    """A plane is open from any height; with one sample higher by 20 cm, or one unknown, it is not reported open.

    Nor is ground above the image.
    """
    level = np.full((4, 800), 20.0, np.float32)
    distance = (np.arange(800, dtype=np.float32) + 1) * np.float32(STEP)
    assert all(surely_unobstructed(level, distance, np.float32(20 - height), 64) for height in (0.5, 8.0, 60.0))
    for value, image in ((19.8, 18.0), (np.nan, 18.0), (20.0, 20.5)):
        other = level.copy()
        other[2, 500] = value
        assert not surely_unobstructed(other, distance, np.float32(image), 64)


@pytest.mark.parametrize("wavelength", [0.003, 0.015, 0.15])
def test_beyond_its_reach_a_crest_changes_nothing_that_clears_it(wavelength: float) -> None:
    """3000 drawn crests, rays and distances, 10 to 500 kHz: as the full reckoning states, below 60 dB."""
    rng = np.random.default_rng(11)
    expected = 0
    for _ in range(3000):
        near, hollow = rng.uniform(0.1, 200), 10 ** rng.uniform(-4, 0)
        until = negligible_beyond(near, hollow, wavelength)
        if not np.isfinite(until):
            continue
        distance, slope = until * rng.uniform(1.0001, 3), rng.uniform(0, 2)
        stretch = np.sqrt(1 + slope**2)
        length, clear = distance * stretch, 10 ** rng.uniform(-4, 1)
        assert crest_is_negligible(
            clear, hollow / stretch, length - near * stretch, length, wavelength, NEGLIGIBLE_CHANGE**2
        )
        expected += 1
    assert expected > 300


def test_quarters_of_a_turn_are_those_of_sine_and_cosine() -> None:
    """20 001 angles up to 250 turns, on whole quarters and between them, either way: to 1e-11."""
    quarters = np.linspace(-1000, 1000, 20_001)
    found = np.array([sincos_of_quarter_turns(q) for q in quarters])
    np.testing.assert_allclose(found[:, 0], np.cos(np.pi / 2 * quarters), atol=2e-11)
    np.testing.assert_allclose(found[:, 1], np.sin(np.pi / 2 * quarters), atol=2e-11)


def walked_by_hand(launch: np.ndarray, distance: np.ndarray, rising: bool) -> tuple[list, list, list]:
    """Bound, number of the last crest and (sample, launch, hollow) of each, for one line, from their definitions."""
    sense, order = (-1.0, range(len(launch) - 1, -1, -1)) if rising else (1.0, range(len(launch)))
    bound, crest, crests = [0.0] * len(launch), [0] * len(launch), []
    seen: list[int] = []
    dark = False
    for k in order:
        if np.isfinite(launch[k]):
            best = min(seen, key=lambda i: sense * launch[i], default=None)
            if best is None or sense * launch[k] <= sense * launch[best]:
                dark = False
            else:
                best = max((i for i in seen if launch[i] == launch[best]), key=seen.index)
                if not dark:
                    crests.append([best, launch[best], 0.0])
                crests[-1][2] = max(crests[-1][2], sense * (launch[k] - launch[best]) * distance[k])
                dark = True
            seen.append(k)
        bound[k] = sense * min((sense * launch[i] for i in seen), default=np.inf)
        crest[k] = len(crests) - 1
    return bound, crest, crests


@pytest.mark.parametrize("rising", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_crests_are_where_the_skyline_stops_sinking(seed: int, rising: bool) -> None:
    """Lines of 120 drawn samples, some of them unknown: bounds, crests and hollows as their definitions state."""
    rng = np.random.default_rng(seed)
    distance = (np.arange(120, dtype=np.float32) + 1) * np.float32(STEP)
    launch = ((8 + rng.standard_normal((4, 120)).cumsum(axis=1) / 20) / distance).astype(np.float32)
    launch[rng.random(launch.shape) < 0.05] = np.nan
    by_hand = [walked_by_hand(line.astype(float), distance.astype(float), rising) for line in launch]
    _, bound, crest, computed = launch_horizon(launch, distance, rising, WAVE)
    for s, (lowest, last, crests) in enumerate(by_hand):
        np.testing.assert_array_equal(bound[s], np.array(lowest, np.float32))
        np.testing.assert_array_equal(crest[s], last)
        columns = [computed[name][s, : len(crests)] for name in ("sample", "launch_slope", "trough_depth")]
        np.testing.assert_allclose(np.transpose(columns), np.reshape(crests, (-1, 3)), rtol=1e-5)
        assert np.all(computed["negligible_beyond"][s, : len(crests)] > 0)


def test_a_ray_to_ground_is_one_of_that_launch() -> None:
    """At terrain samples, visible or hidden: by the seabed or by the ray's own launch, the factor is the same."""
    rng = np.random.default_rng(5)
    distance = (np.arange(400, dtype=np.float32) + 1) * np.float32(STEP)
    launch = ((8 + rng.standard_normal((2, 400)).cumsum(axis=1) / 30) / distance).astype(np.float32)
    horizon = launch_horizon(launch, distance, False, WAVE)
    points, rows = np.arange(700), np.repeat([0, 1], 350)
    sample = np.tile(np.arange(20, 370), 2)
    reach, steep = distance[sample].astype(float), launch[rows, sample].astype(float)
    expected = []
    for ground in (True, False):
        lit, left = np.ones(700, bool), np.ones(700, complex)
        rays = LineRays(rows, points, steep, reach, lit, left)
        if ground:
            occlude_terrain_points(horizon, STEP, rays, reach, WAVE, edge_diffraction_table(), True)
        else:
            diffract_over_crests(horizon, STEP, rays, reach, WAVE, edge_diffraction_table())
        expected.append((lit, left))
    hidden = steep > horizon.horizon[rows, sample]
    np.testing.assert_array_equal(expected[0][0], ~hidden)
    assert 0.1 < hidden.mean() < 0.9 and np.abs(expected[0][1] - 1).max() > 0.3
    np.testing.assert_allclose(expected[0][1], expected[1][1], atol=1e-6)
