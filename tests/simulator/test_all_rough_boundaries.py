"""Relief, a moving surface, a rough seabed and a target in one scene: the mean of pings is the expectation."""

from functools import partial

import numpy as np
import pytest

from insonify.simulator import simulate
from oracles.scenes import each_ping, nominal

RELIEF = {"kind": "power-law", "hurst": 0.8, "rms": "5 cm", "outer_scale": "10 m"}
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def received_power(field, seed, **paths):
    """Mean power of one ping 67 to 90 m away by all paths of up to two bounces, over the same relief."""
    sound = simulate(
        nominal(
            seed=seed, field=field, line={"length": 0.1}, track={"window": (0.09, 0.12)},
            box={"position": (0.0, 82.0)}, surface={"reflection": "statistical", "wind_speed": 4.0},
            seabed={"reflecting_interface": "rough", "scattering": {"law": "jackson", "sediment": "medium sand"},
                    "reflection": "medium sand", "relief": RELIEF, "seed": 5},
            paths={"max_reflections": 2, **paths},
        ), threads=1,
    )  # fmt: skip
    return np.mean(sound["intensity"].values if field == "incoherent" else np.abs(sound["pressure"].values) ** 2)


@pytest.mark.slow
def test_a_few_pings_of_a_scene_with_everything_rough_have_the_expected_power():
    """6 pings of 0.8 dB (0.33 dB) against an expectation (0.04 dB): within 1.6 dB, more than four standard errors.

    Beams are cut at -20 dB, which takes 0.002 dB of either.
    """
    coherent, expected = (
        np.mean([received_power(field, seed, scatterers_per_cell=1, beam_cutoff_db=-20) for seed in range(count)])
        for field, count in (("coherent", 6), ("incoherent", 1))
    )
    assert 10 * np.log10(coherent / expected) == pytest.approx(0.0, abs=1.6)


@pytest.mark.validate
def test_the_mean_of_pings_of_a_scene_with_everything_rough_is_the_expectation():
    """900 seeds against 12, standard errors of 0.03 and 0.01 dB: within 0.1 dB."""
    coherent, expected = (
        np.mean(each_ping(range(count), partial(received_power, field)))
        for field, count in (("coherent", 900), ("incoherent", 12))
    )
    assert 10 * np.log10(coherent / expected) == pytest.approx(0.0, abs=0.1)
