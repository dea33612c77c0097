"""Draws of simulated scenes: no difference where there is none, each planted difference where it is."""

from functools import lru_cache

import numpy as np
import pytest

import insonify
from oracles.compared_scenes import ECHOSOUNDER, SIDESCAN, drawn
from oracles.few_of import few_of

TRIALS = 400
FALSE = 0.05
"""Share of pairs of draws that may be called different."""
PLANTED_TRIALS = 20
SCENES = {"sidescan": SIDESCAN, "echosounder": ECHOSOUNDER}


@lru_cache(maxsize=4)
def undisturbed(scene, seed):
    """A draw of a scene as it is, shared by the planted differences."""
    return drawn(SCENES[scene], seed)


def changed(recording, change):
    """A recording as another recorder would have stored it."""
    made = recording.copy(deep=True)
    pressure, time = made["pressure"].values, made["time"].values
    if change == "wrong TVG":
        made["pressure"].values[:] = pressure * np.maximum(time, 1e-3) ** 0.5  # 10 log10 r
    elif change == "clipped":
        limit = np.quantile(np.abs(pressure), 0.98)
        made["pressure"].values[:] = pressure * np.minimum(1, limit / np.maximum(np.abs(pressure), 1e-30))
    elif change == "shifted":
        made["pressure"].values[:] = np.roll(pressure, 6, axis=-1)
    elif change == "stretched":
        made = made.assign_coords(time=time * 1.05)
        made = made.drop_vars("slant_range")
    return made


def four_looks(seed):
    """Root of the mean intensity of four draws."""
    draws = [drawn(SIDESCAN, 1000 * seed + look) for look in range(4)]
    mean = np.sqrt(np.mean([np.abs(draw["pressure"].values) ** 2 for draw in draws], axis=0))
    draws[0]["pressure"].values[:] = mean
    return draws[0]


PLANTED = {
    "wrong sediment": {"seabed.scattering.sediment": "silty clay"},
    "no multipath": {"paths.max_reflections": 0},
    "4 looks": None,
    "wrong beam": {"sonar.transmit.height": 0.06, "sonar.receive.height": 0.06},
    "wrong TVG": None,
    "clipped": None,
    "wrong noise": {"water.noise_level_db": 51},
    "shifted": None,
    "stretched": None,
    "other K shape": {"seabed.texture": {"k_shape": 0.5, "correlation_length": 0.5}},
}


def pair(planted, seed):
    """A draw of a scene, and another with the planted difference."""
    scene = "echosounder" if planted == "no multipath" else "sidescan"
    first = undisturbed(scene, 2 * seed)
    if planted == "4 looks":
        return first, four_looks(seed)
    if changes := PLANTED[planted]:
        return first, drawn(SCENES[scene], 2 * seed + 1, changes)
    return first, changed(undisturbed(scene, 2 * seed + 1), planted)


@pytest.mark.slow
@few_of((0, 3, 4, 5, 8), "planted", PLANTED)
def test_each_planted_difference_is_found(planted):
    """One pair of draws with one property changed: at least one measure differs at 5 % over all measures."""
    assert insonify.compare(*pair(planted, 5)).different


@pytest.mark.slow
def test_two_draws_of_one_scene_are_alike():
    """Two draws of each scene differ in no measure."""
    for scene in (SIDESCAN, ECHOSOUNDER):
        assert not insonify.compare(drawn(scene, 1), drawn(scene, 2)).different


@pytest.mark.validate
def test_false_differences_stay_below_their_rate():
    """Of 400 pairs of draws, at most 5 % differ in any of the measures."""
    found = [insonify.compare(drawn(SIDESCAN, 2 * n), drawn(SIDESCAN, 2 * n + 1)).different for n in range(TRIALS)]
    assert sum(map(bool, found)) <= FALSE * TRIALS, [names for names in found if names]


@pytest.mark.validate
@pytest.mark.parametrize("planted", PLANTED)
def test_planted_differences_are_found_in_every_trial(planted):
    """Each of ten planted differences is found in 20 of 20 pairs of draws."""
    missed = [n for n in range(PLANTED_TRIALS) if not insonify.compare(*pair(planted, 100 + n)).different]
    assert not missed
