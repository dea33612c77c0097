"""The tracer and the engine, pair by pair, in waters, over beds and with sonars other than the paper's."""

from itertools import combinations_with_replacement

import numpy as np
import pytest

from oracles.few_of import few_of
from oracles.multipath import Sonar, pair_intensity
from oracles.scenes import point
from oracles.sonar_equation import pulse_energy
from oracles.traced import apart_db, curves, scene

LAMBERT = {"law": "lambert", "strength_db": -22.0}
SHOAL = {"window": (0.05, 0.07), "seabed": {"depth": 8.0, "scattering": LAMBERT, "reflection": 0.6}}


def both(rays=20_000, **changes):
    """Curves of each pair of families by the tracer and by the engine."""
    return tuple(curves(scene(engine, rays=rays, **changes)) for engine in ("tracer", "eigenrays"))


def assert_agree(ours, theirs, tolerance_db, weak_db=60.0):
    """Every pair that is not too weak within a tolerance, and no other pairs in either."""
    strongest_mean = max(power.mean() for power in theirs.values())
    floor = strongest_mean * 10 ** (-weak_db / 10)
    assert {key for key in ours if ours[key].mean() > 2 * floor} <= set(theirs)
    apart = {key: apart_db(ours[key], theirs[key]) for key, power in theirs.items() if power.mean() > floor}
    assert max(np.abs(list(apart.values()))) < tolerance_db, apart
    return apart


@few_of((0, 2), "depth", [2.0, 4.0, 6.5])
def test_shoal_water_rings_the_same_at_any_depth_of_the_sonar(depth):
    """8 m of water, a seabed that mirrors 0.6: six pairs and their sum within 0.05 dB, 37 to 53 m."""
    apart = assert_agree(*both(**SHOAL, track={"position": (0.0, 0.0, depth)}), 0.05)
    assert len(apart) == 7


def test_each_pair_is_the_sum_over_rings_of_the_bed():
    """Both engines and a sum that samples nothing, six pairs in shoal water: all within 0.15 dB of one another."""
    changes = {**SHOAL, "track": {"position": (0.0, 0.0, 3.0)}}
    ours, theirs = both(**changes, water={"noise_level_db": None, "absorption_db_per_m": 0.03})
    sonar = Sonar(3.0, 220.0, 1.5 / 0.015, pulse_energy(duration=0.2e-3, fraction=0.2, band=20e3), 0.1e-3)
    water = {"target": 8.0, "depth": 8.0, "mirror": lambda sine: 0.6 + 0 * sine, "absorption": 0.03}
    for pair in combinations_with_replacement(("D", "S", "BS"), 2):
        known = next(key for key in theirs if key[0] == "seabed" and sorted(key[1].split("-")) == sorted(pair))
        time = np.linspace(0.05, 0.07, theirs[known].size, endpoint=False)
        ring = pair_intensity(time, pair, sonar, strength_db=-22.0, speed=1500.0, span=(1.0, 80.0), **water)
        for found in (ours[known], theirs[known]):
            assert apart_db(found, ring) == pytest.approx(0, abs=0.15), pair


def test_a_beam_that_looks_down_and_astern_receives_the_same():
    """Planar arrays tilted by 12 degrees on a ship that pitches, rolls and heads elsewhere: within 0.1 dB."""
    planar = {"kind": "planar", "length": None, "width": 0.3, "height": 0.06}
    changes = {
        "line": planar, "sonar": {"mounting": {"bearing": np.radians(110), "tilt": np.radians(12)}},
        "track": {"heading": 0.7, "pitch": 0.03, "roll": -0.05},
    }  # fmt: skip
    assert_agree(*both(**changes), 0.1, weak_db=30.0)


def test_two_points_are_received_each_by_its_own_paths():
    """Near the surface and near the seabed, apart in bearing: fifteen pairs of families, to 1e-4 dB."""
    targets = [point(0.0, 75.0, 1.5, label="float"), point(1.0, 74.0, 18.0, strength=3.0, label="buoy")]
    ours, theirs = both(1000, targets=targets, paths={"contributions": ["target"]})
    del ours["target", "all"], theirs["target", "all"]
    assert len(assert_agree(ours, theirs, 1e-4)) == 15
