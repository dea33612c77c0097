"""Features of scenes two at a time, drawn at random: the mean of coherent pings is the expected intensity.

Each feature has tests of its own; here are those that only meet in a user's scenario.
"""

from collections.abc import Mapping
from functools import partial
from itertools import combinations

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles.few_of import few_of
from oracles.scenes import each_ping

BASE = {
    "water": {"noise_level_db": None},
    "seabed": {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27.0}, "reflection": 0.35, "seed": 7},
    "sonar": {
        "source_level_db": 210,
        "pulse": {"kind": "cw", "frequency": 50e3, "duration": 1e-4, "taper": "tukey", "taper_fraction": 0.2},
        "transmit": {"kind": "line", "length": 0.8},
        "receive": {"kind": "line", "length": 0.8},
        "receiver": {"bandwidth": 20e3},
    },
    "track": {"kind": "static", "position": (0.0, 0.0, 11.0), "window": (0.040, 0.046)},
    "paths": {"max_reflections": 1, "contributions": ["seabed"]},
}
FEATURES = {
    "relief": {"seabed": {"relief": [{"kind": "power-law", "hurst": 0.8, "rms": 0.03, "outer_scale": 20.0}]}},
    "texture": {"seabed": {"texture": {"k_shape": 4.0, "correlation_length": 1.0}}},
    "sediment": {"seabed": {"scattering": {"law": "jackson", "sediment": "medium sand"}, "reflection": "medium sand"}},
    "layers": {"water": {"profile": [[0.0, 1512.0], [6.0, 1510.0], [12.0, 1495.0], [20.0, 1494.0]]}},
    "moving sea": {"surface": {"reflection": "statistical", "wind_speed": 3.0}},
    "box": {"targets": [{"shape": "box", "label": "box", "position": (0.0, 30.5), "size": (2.0, 1.0, 1.0)}]},
    "jitter": {"paths": {"jitter": 0.5}},
    "compressed sweep": {
        "sonar": {"pulse": {"kind": "lfm", "frequency": 50e3, "duration": 1e-3, "bandwidth": 10e3},
                  "receiver": {"bandwidth": 20e3, "matched_filter": True}},
    },
    "moving platform": {
        "track": {"kind": "line", "start": (0.0, 0.0, 11.0), "speed": 3.0, "heading": 0.0, "pings": 1,
                  "window": (0.040, 0.046)},
    },
    "two platforms": {"receiver_track": {"kind": "static", "position": (8.0, -5.0, 6.0)}},
    "two bounces": {"paths": {"max_reflections": 2, "contributions": ["seabed"]}},
    "hull": {"sonar": {"hull": {"length": 20.0, "width": 6.0, "reflection": 0.9}},
             "track": {"kind": "static", "position": (0.0, 0.0, 3.0), "window": (0.040, 0.046)}},
    "inhomogeneous water": {"water": {"inhomogeneity": {"rms_index": 3e-4, "correlation_length": 2.0}}},
    "narrow swath": {"sonar": {"transmit": {"kind": "planar", "width": 0.8, "height": 0.05},
                               "mounting": {"tilt": 0.3}}},
    "slice": {"paths": {"geometry": "slice", "max_reflections": 1, "contributions": ["seabed"]}},
}  # fmt: skip
REFUSED = {
    frozenset(pair)
    for pair in (
        ("slice", "two platforms"), ("slice", "hull"), ("two platforms", "hull"), ("hull", "moving sea"),
        ("slice", "moving sea"), ("slice", "inhomogeneous water"), ("slice", "moving platform"),
    )
}  # fmt: skip
"""Pairs that are no scene: refused, or without sound in the window."""
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def is_group(value: object) -> bool:
    """Return True for a group of keys, not one model chosen among several."""
    return isinstance(value, Mapping) and not {"kind", "law"} & value.keys()


def merged(first: Mapping, second: Mapping) -> dict:
    """Both settings; those of the second where both have one."""
    both = dict(first)
    for key, value in second.items():
        both[key] = merged(both[key], value) if is_group(value) and isinstance(both.get(key), Mapping) else value
    return both


def contradict(first: Mapping, second: Mapping) -> bool:
    """Return True for features that set the same key."""
    return any(
        key in first and not (is_group(value) and not contradict(first[key], value)) for key, value in second.items()
    )


PAIRS = [
    pair
    for pair in combinations(FEATURES, 2)
    if frozenset(pair) not in REFUSED and not contradict(FEATURES[pair[0]], FEATURES[pair[1]])
]


def received_power(pair, field, seed, **paths):
    """Mean power of one ping of a pair of features."""
    settings = merged(merged(merged(BASE, FEATURES[pair[0]]), FEATURES[pair[1]]), {"paths": paths})
    sound = simulate(Scenario(**settings, field=field, seed=seed), threads=1)
    return np.mean(sound["intensity"].values if field == "incoherent" else np.abs(sound["pressure"].values) ** 2)


def difference_db(pair, pings, expectations, threads, **paths):
    """Mean of pings re the mean of expectations [dB], and its standard error."""
    coherent = each_ping(range(pings), partial(received_power, pair, "coherent", **paths), threads)
    expected = each_ping(range(expectations), partial(received_power, pair, "incoherent", **paths), threads)
    relative = [np.std(one, ddof=1) / np.mean(one) / np.sqrt(len(one)) for one in (coherent, expected)]
    return 10 * np.log10(coherent.mean() / expected.mean()), 4.34 * np.hypot(*relative)


@pytest.mark.slow
@few_of((1,), "pair", [("relief", "two platforms"), ("texture", "jitter")])
def test_a_few_pings_of_two_features_have_the_expected_power(pair):
    """20 pings against 3 expectations: within four standard errors, of at most 0.3 dB, and 0.1 dB."""
    assert pair in PAIRS
    difference, error = difference_db(pair, 20, 3, threads=1, scatterers_per_cell=2)
    assert abs(difference) < 4 * error + 0.1 and error < 0.3


@pytest.mark.validate
@pytest.mark.parametrize("number", range(24))
def test_the_mean_of_pings_of_two_features_is_the_expectation(number):
    """24 pairs drawn from those that are scenes, 160 pings against 24 expectations: four standard errors and 0.1 dB."""
    pair = PAIRS[np.random.default_rng(3).permutation(len(PAIRS))[number]]
    difference, error = difference_db(pair, 160, 24, threads=2)
    assert abs(difference) < 4 * error + 0.1, f"{pair}: {difference:+.2f} dB, standard error {error:.2f}"
