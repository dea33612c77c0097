"""Bins of labels: their number over a pulse, and their convolution with it."""

import numpy as np
import pytest

from insonify.simulator import build_simulator
from insonify.synthesis.label_bins import bin_grid, pulse_energy, significant_duration, smeared
from oracles.scenes import nominal

PULSES = {
    "short tone": {"pulse": {"kind": "cw", "frequency": 100e3, "duration": 1e-4}},
    "long tone": {"pulse": {"kind": "cw", "frequency": 100e3, "duration": 5e-3}},
    "sweep": {"pulse": {"kind": "lfm", "frequency": 100e3, "bandwidth": 20e3, "duration": 2e-3},
              "receiver": {"bandwidth": 24e3}},
}  # fmt: skip


def accumulator(pulse: str):
    """Incoherent accumulator of a ping with one of the pulses."""
    simulator = build_simulator(nominal(sonar=PULSES[pulse], track={"window": (0.06, 0.08)}))
    return simulator.label_accumulator(simulator.ping_geometry(0)).accumulator


@pytest.mark.parametrize("pulse", PULSES)
def test_eight_bins_cover_the_pulse_and_hardly_more(pulse: str) -> None:
    """Bins are a power of two of samples, or samples of bins: at least 8 over the equivalent duration, below 16."""
    held = accumulator(pulse)
    grid = bin_grid(held, 8.0, 64)
    assert 1 in (grid.per_sample, grid.samples)
    window, rings = held.ping_geometry.window, held.ping_geometry.pulse
    assert grid.start <= window[0] - rings.stop and grid.start + (grid.size - 1) / grid.rate >= window[1] - rings.start
    assert grid.rate == pytest.approx(held.grid.sample_rate * grid.per_sample / grid.samples)
    assert 8 <= held.pulse_duration * grid.rate < 16
    assert held.pulse_duration < significant_duration(held, grid) < 5 * held.pulse_duration + 1e-3


@pytest.mark.parametrize("pulse", PULSES)
def test_an_energy_in_one_bin_is_the_pulse_at_the_samples(pulse: str) -> None:
    """Samples are the energy times the squared envelope at their lag from the bin: to rounding."""
    held = accumulator(pulse)
    grid = bin_grid(held, 8.0, 64)
    row = grid.size // 2
    bins = np.zeros((1, grid.size))
    bins[0, row] = 3.0
    series = smeared([bins], pulse_energy(held, grid), grid, (1, held.grid.sample_count))[0, 0]
    lag = held.grid.time - (grid.start + row / grid.rate)
    expected = 3.0 * np.abs(held.ping_geometry.pulse.samples(lag)) ** 2
    np.testing.assert_allclose(series, expected, atol=1e-5 * expected.max())
    assert series.max() > 0
