"""Comparison of two recordings: draws of one scene are alike, planted differences are found."""

import numpy as np
import pytest

import insonify
from insonify.formats.store_description import StoreError
from oracles.speckled_recordings import SpeckledScene

SCENE = SpeckledScene()


def test_draws_of_one_scene_do_not_differ():
    """In 4 pairs of draws, of many and of few pings, at most one is called different (5 % each)."""
    pairs = [(SCENE.but(pings=pings), seed) for pings in (24, 2) for seed in (0, 2)]
    found = [insonify.compare(scene.samples_of(seed), scene.samples_of(seed + 1)).different for scene, seed in pairs]
    assert sum(map(bool, found)) <= 1, found


@pytest.mark.validate
@pytest.mark.parametrize("pings", [1, 2])
def test_few_pings_are_called_different_as_often_as_stated(pings):
    """Of 200 pairs of draws, 5 % are called different, within two standard errors (6 pairs)."""
    scene = SCENE.but(pings=pings)
    pairs = [(scene.samples_of(2 * n), scene.samples_of(2 * n + 1)) for n in range(3000, 3200)]
    assert sum(bool(insonify.compare(*pair).different) for pair in pairs) <= 16


@pytest.mark.parametrize(
    ("measure", "changes"),
    [
        ("level against range", {"slope_db": -40.0}),
        ("level against range", {"level_db": 3.0}),
        ("level against range", {"noise_db": -40.0}),
        ("amplitude distribution", {"looks": 4}),
        ("amplitude distribution", {"k_shape": 1.0}),
        ("echo trains", {"multiples_db": -20.0}),
        ("echo trains", {"shift": 4}),
    ],
)
def test_a_planted_difference_is_found(measure, changes):
    """One changed property of a scene of 40 pings is found by the measure that is about it."""
    found = insonify.compare(SCENE.samples_of(1), SCENE.but(**changes).samples_of(2))
    assert measure in found.different, found.summary()


def test_a_recording_is_like_itself():
    """All differences of a recording and itself are zero, and none is found."""
    draw = SCENE.samples_of(3)
    found = insonify.compare(draw, draw)
    assert not found.different
    assert max(abs(v.difference) for f in found.findings for v in f.values if np.isfinite(v.difference)) < 1e-9


def test_the_same_seed_gives_the_same_numbers():
    """Exchange and bootstrap are those of the seed."""
    pair = SCENE.samples_of(1), SCENE.samples_of(2)
    assert insonify.compare(*pair, seed=5).to_json() == insonify.compare(*pair, seed=5).to_json()


def test_ranges_without_overlap_are_refused():
    """Two recordings without a common range name both ranges and the remedy."""
    near, far = SCENE.samples_of(1), SCENE.samples_of(2)
    object.__setattr__(far, "slant_range", far.slant_range + 100)
    with pytest.raises(StoreError, match=r"30\.00 m.*100\.05.*track\.window"):
        insonify.compare(near, far)
