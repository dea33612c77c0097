"""Energies of many beams from rows of directions, row by row and with the mean powers of low lobes."""

import numpy as np
import pytest

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.synthesis.direction_powers import LOW_POWER, direction_powers


@pytest.fixture(scope="module")
def powers():
    """Rows of a receiver of 64 elements that forms 256 beams over 130 deg at 900 kHz."""
    scenario = Scenario(**{
        "seabed": {"depth": 5.0, "scattering": {"law": "lambert"}},
        "sonar": {
            "source_level_db": 200,
            "pulse": {"kind": "lfm", "frequency": 900e3, "bandwidth": 30e3, "duration": 0.5e-3},
            "transmit": {"kind": "planar", "width": 0.8e-3, "height": 5e-3, "steer": (0.0,)},
            "receive": {"kind": "planar", "width": 53.3e-3, "height": 5e-3, "columns": 64,
                        "steer": tuple(np.radians(np.linspace(-65, 65, 256)))},
        },
        "track": {"kind": "static", "position": (0.0, 0.0, 3.0), "window": (0.0, 5e-3)},
    })  # fmt: skip
    return direction_powers(build_simulator(scenario).ping_geometry(0))


def test_of_a_diffuse_field_mean_powers_are_those_of_every_row(powers):
    """Random energies from every direction, 0 to 30 dB: beams to 0.01 dB rms, 0.05 dB at most."""
    rng = np.random.default_rng(1)
    sums = 10 ** rng.uniform(0, 3, (powers.beam_powers.shape[1], 50))
    exact, by_lobes = powers.to_beams(sums), powers.to_beams_by_lobes(sums)
    error = 10 * np.log10(by_lobes / exact)
    assert 0 < np.sqrt(np.mean(error**2)) < 0.01 and np.abs(error).max() < 0.05


def test_a_single_direction_is_off_where_the_beam_is_low(powers):
    """One direction alone: no beam is off by more than the power of its low lobes, and of high lobes by rounding."""
    rows = np.eye(powers.beam_powers.shape[1])
    exact, by_lobes = powers.to_beams(rows), powers.to_beams_by_lobes(rows)
    peak = exact.max(axis=1, keepdims=True)
    high = exact > LOW_POWER * peak
    assert np.abs(by_lobes - exact)[high].max() < 1e-6 * peak.max()
    assert (np.abs(by_lobes - exact) <= LOW_POWER * peak).all()
    assert np.count_nonzero(powers.lobe_powers.high) < powers.beam_powers.size / 2  # what it saves
