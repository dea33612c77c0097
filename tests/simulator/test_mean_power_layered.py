"""The central claim in layered water: the coherent reading's mean power is the incoherent one, shadows included."""

import numpy as np
import pytest

from insonify.simulator import simulate
from oracles.few_of import few_of
from oracles.scenes import each_ping, nominal

THERMO = [[0.0, 1510.0], [8.0, 1510.0], [14.0, 1490.0], [20.0, 1490.0]]
CAUSTIC = [[0.0, 1510.0], [4.0, 1510.0], [8.0, 1490.0], [20.0, 1490.0]]
APART = {"transmit": {"offset": (0.0, 0.0, -0.5)}, "receive": {"offset": (0.0, 0.0, 0.5)}}


def water(profile):
    """Layered and quiet."""
    return {"noise_level_db": None, "absorption_db_per_m": 0.035, "profile": profile}


def pressure(scenario):
    """One ping, one channel."""
    return simulate(scenario, threads=1).pressure.values[0, 0]


def intensity(scenario):
    """Expected intensity of one ping, one channel."""
    return simulate(scenario.model_copy(update={"field": "incoherent"}), threads=1).intensity.values[0, 0]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:water.profile")  # its corner is meant
@few_of(
    (1, 3, 5),
    ("profile", "window", "paths", "ends"),
    [
        (THERMO, (0.17, 0.21), {"max_reflections": 0}, {}),
        (THERMO, (0.198, 0.235), {"families": ("D", "S", "BS"), "max_reflections": 2}, {}),
        (THERMO, (0.198, 0.235), {"families": ("D", "S"), "jitter": 0.5}, {}),
        (THERMO, (0.17, 0.21), {"families": ("D", "S"), "max_reflections": 1}, APART),
        (CAUSTIC, (0.20, 0.24), {"max_reflections": 0}, {}),
        (CAUSTIC, (0.20, 0.24), {"max_reflections": 0, "jitter": 1.0}, {}),
    ],
    ids=["direct, to its end", "multipath", "half jittered", "ends apart", "beyond a caustic", "its rays jittered"],
)
def test_the_mean_coherent_power_is_the_incoherent_reading(profile, window, paths, ends):
    """24 beds of about 240 cells, N = 5800: 0.06 dB standard error, 0.2 dB allowed over the window, 0.4 in thirds."""
    scenario = nominal(water=water(profile), track={"window": window}, paths=paths, **ends)
    received = each_ping([scenario.model_copy(update={"seed": seed}) for seed in range(24)], pressure)
    expected = intensity(scenario)
    strong = expected > 1e-4 * expected.max()
    ratio = (np.mean(np.abs(received) ** 2, axis=0)[strong], expected[strong])
    assert 10 * np.log10(ratio[0].sum() / ratio[1].sum()) == pytest.approx(0, abs=0.2)
    for some, mean in zip(*(np.array_split(one, 3) for one in ratio), strict=True):
        assert 10 * np.log10(some.sum() / mean.sum()) == pytest.approx(0, abs=0.4)
