"""Eigenrays per second: from a sonar at 11 m to points in 20 m of water, one family at a time."""

import numpy as np

from insonify.propagation._eigenray_kernel import solve_eigenrays
from insonify.propagation.eigenray_record import no_rays
from insonify.propagation.families import family_bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from measure import Result, best_seconds

COLUMNS_OF_WATER = {
    "one gradient": ([0, 20], [1510, 1500]),
    "thermocline": ([0, 8, 14, 20], [1510, 1510, 1490, 1490]),
    "8 layers": (np.linspace(0, 20, 9), 1510 - 20 / (1 + np.exp((8 - np.linspace(0, 20, 9)) / 2))),
}
FAMILIES = ("D", "S", "BS")
AT_ONCE = 1024  # points of one call: their rays fit the cache
CALLS = 32
UNIT = "M rays/s, 1 core"


def exact_at_one_depth() -> list[Result]:
    """Points at random ranges to 150 m, 1 m above the seabed."""
    random = np.random.default_rng(1)
    return _rates("exact rays at one depth", np.full(AT_ONCE, 19.0), random.uniform(1, 150, AT_ONCE), "goal 5")


def exact_anywhere() -> list[Result]:
    """Points that share neither range nor depth."""
    random = np.random.default_rng(2)
    return _rates("exact rays anywhere", random.uniform(0, 20, AT_ONCE), random.uniform(1, 150, AT_ONCE), "")


def _rates(what: str, depth: np.ndarray, ranges: np.ndarray, note: str) -> list[Result]:
    solutions, runs, found = no_rays(AT_ONCE), {}, {}
    for water, (z, c) in COLUMNS_OF_WATER.items():
        for family in FAMILIES:
            layers = SoundSpeedLayers(np.array(z, float), np.array(c, float))
            for knots in layers[:2]:  # those of a scene are, and the same machine code serves both
                knots.setflags(write=False)
            arguments = (layers, 11.0, family_bounces(family), depth, ranges, solutions)
            solve_eigenrays(*arguments)
            name = f"{what}, {water}, {family}"
            found[name] = solutions.ray_count.sum()
            runs[name] = lambda arguments=arguments: [solve_eigenrays(*arguments) for _ in range(CALLS)]
    seconds = best_seconds(runs)
    return [Result(name, CALLS * found[name] / best / 1e6, UNIT, note) for name, best in seconds.items()]


SMALL = {"AT_ONCE": 64, "CALLS": 1}
BENCHES = [exact_at_one_depth, exact_anywhere]
