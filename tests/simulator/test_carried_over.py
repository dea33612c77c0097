"""A scenario made ready to ping can be carried to another process, and sounds the same there."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from insonify.simulator import accumulate_ping, build_simulator
from oracles.scenes import nominal

RELIEF = {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.03}}
WATER = {"profile": [[0.0, 1500.0], [20.0, 1490.0]], "noise_level_db": None}


@pytest.mark.parametrize("settings", [{}, {"seabed": RELIEF}, {"seabed": RELIEF, "water": WATER}])
def test_what_is_carried_over_receives_the_same_bits(settings):
    """Flat bed, relief, relief under layered water: pickled before its first ping, and after it."""
    simulator = build_simulator(nominal(track={"window": (0.06, 0.062)}, paths={"max_reflections": 0}, **settings))

    def ping(here):
        with ThreadPoolExecutor(1) as pool:
            (side,) = here.ping_geometries(0)
            return accumulate_ping(here, here.coherent_accumulator(side), side, pool)

    # clusters use this protocol; others make read-only arrays writable, for which kernels are compiled once more
    early = pickle.loads(pickle.dumps(simulator, pickle.HIGHEST_PROTOCOL))
    received = ping(simulator)
    late = pickle.loads(pickle.dumps(simulator, pickle.HIGHEST_PROTOCOL))
    assert np.abs(received).max() > 0
    for other in (early, late):
        np.testing.assert_array_equal(ping(other), received)
