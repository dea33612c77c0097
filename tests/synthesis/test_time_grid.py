"""The time grid: what is received in a window, and what is not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.synthesis._gridding import deposit_energy, deposit_pressure
from insonify.synthesis._gridding_kernel import kernel_transform, tap_coefficients
from insonify.synthesis.time_grid import ROUNDING, TimeGrid, convolve_energy, convolve_pulse, time_grid
from synthesis.oracle import RATE, carried, pulse_spectrum, relative_rms, series

RINGING = 2e-3
"""The oracle pulse has fallen by 1e-5 this long before and after [s]."""


def window(start=0.02, stop=0.06):
    """A grid that the oracle pulse fits."""
    return time_grid(start, stop, RATE, -RINGING, RINGING)


def receive(grid, delay, weight):
    """The series of a few echoes."""
    cells = grid.cells()
    deposit_pressure(
        cells[0], grid.first_time, grid.cell_rate, np.atleast_1d(delay), np.atleast_1d(weight).astype(np.complex64)
    )
    return convolve_pulse(cells, grid, pulse_spectrum(grid.frequencies))[0]


@given(st.floats(0.0195, 0.0255))
def test_one_echo_is_the_pulse_at_its_delay(delay):
    """A single arrival of weight 1 gives the samples of p(t - delay), wherever it falls between samples."""
    grid = window(0.02, 0.025)
    truth = series([delay], np.ones(1), grid.time)
    assert np.abs(receive(grid, delay, 1.0) - truth).max() <= 3e-6


def test_energy_of_one_echo_is_parseval():
    """The power of a single echo, summed over time, is that of the pulse's spectrum."""
    grid = window()
    received = receive(grid, 0.04, 1.0)
    power = np.sum(np.abs(pulse_spectrum(grid.frequencies)) ** 2) * RATE / grid.padded_samples
    assert np.sum(np.abs(received) ** 2) / RATE == pytest.approx(power, rel=1e-6)


def test_shifting_the_window_shifts_nothing_else():
    """Two overlapping windows agree about the echoes that both receive."""
    delay, weight = np.array([0.0301, 0.0407, 0.0448]), np.array([1, 1j, -2])
    early, late = window(0.02, 0.06), window(0.02 + 100 / RATE, 0.07)
    shared = early.sample_count - 100
    assert relative_rms(receive(late, delay, weight)[:shared], receive(early, delay, weight)[100:]) <= 3e-6


@pytest.mark.parametrize("delay", [-1.0, 0.0, 0.0175, 0.0625, 0.07, 0.5, 1e9, np.nan, np.inf, -np.inf])
def test_an_echo_outside_the_window_is_not_received(delay):
    """Arrivals too early or too late, even a million times stronger, neither wrap around nor break anything."""
    assert np.abs(receive(window(), delay, 1.0)).max() <= 2e-5


@pytest.mark.parametrize("delay", [0.0195, 0.0199, 0.0601, 0.0605])
def test_an_echo_across_the_edge_is_received_in_part(delay):
    """An arrival just outside the window still has its pulse inside, and keeps it."""
    grid = time_grid(0.02, 0.06, RATE, -RINGING, RINGING)
    truth = series([delay], np.ones(1), grid.time)
    assert np.abs(receive(grid, delay, 1.0) - truth).max() <= 3e-6


@given(
    start=st.floats(0, 0.3),
    length=st.floats(1e-4, 0.3),
    before=st.floats(0, 0.02),
    after=st.floats(0, 0.02),
)
def test_nothing_wraps(start, length, before, after):
    """Delays that are received have cells on the grid, and the period is too long for pulses to come round."""
    grid = time_grid(start, start + length, RATE, -before, after)
    period = grid.padded_samples / RATE
    stop = start + grid.sample_count / RATE
    assert grid.first_time < start - after
    assert grid.first_time + period > stop + before
    assert grid.first_time + after <= start
    assert grid.first_time + period - before >= stop
    assert grid.sample_count == pytest.approx(length * RATE, abs=0.51) or grid.sample_count == 1
    assert grid.time[0] == start


def test_frequencies_are_those_of_the_padded_transform():
    """Offsets run over the output band once, one for every padded sample."""
    grid = TimeGrid(start=0.0, sample_rate=1000.0, sample_count=6, lead_samples=1, padded_samples=8)
    np.testing.assert_allclose(grid.frequencies, [0, 125, 250, 375, -500, -375, -250, -125])


def test_kernel_weighs_what_its_transform_predicts():
    """The kernel's cells summed with a phase per cell give its transform, wherever the spike falls (Poisson's sum)."""
    taps = tap_coefficients().astype(float)
    frequency = np.linspace(-0.2, 0.2, 41)
    for place in (-0.5, -0.2, 0.0, 0.31, 0.5):
        heights = np.polynomial.polynomial.polyval(place, taps)
        cells_after_spike = np.arange(len(heights)) - 3 - place
        total = np.exp(-2j * np.pi * np.outer(frequency, cells_after_spike)) @ heights
        np.testing.assert_allclose(total / kernel_transform(frequency), 1, atol=4e-6)


def receive_energy(grid, delay, energy):
    """The expected intensity of a few echoes."""
    cells = grid.energy_cells()
    deposit_energy(cells[0], grid.first_time, grid.energy_rate, np.atleast_1d(delay), np.atleast_1d(energy))
    return convolve_energy(cells, grid, pulse_spectrum(grid.frequencies))[0]


@given(st.floats(0.0195, 0.0255))
def test_energy_of_one_arrival_is_the_squared_pulse(delay):
    """A single arrival of energy 1 gives |p(t - delay)|^2, to 1e-6 of its peak, and never less than nothing."""
    grid = window(0.02, 0.025)
    truth = np.abs(series([delay], np.ones(1), grid.time)) ** 2
    received = receive_energy(grid, delay, 1.0)
    assert np.abs(received - truth).max() <= 1e-6
    assert received.min() >= 0


def test_weak_echoes_survive_a_strong_one():
    """60 dB and 20 ms after a strong echo, a weak one keeps its level to 1e-4: transforms smear nothing."""
    grid = window()
    delay, weight = np.array([0.03, 0.05]), np.array([1.0, 1e-3])
    late = (grid.time > 0.0498) & (grid.time < 0.0504)
    truth = series(delay, weight, grid.time)
    assert relative_rms(receive(grid, delay, weight)[late], truth[late]) <= 1e-4
    power = sum(e * np.abs(series([d], np.ones(1), grid.time)) ** 2 for d, e in zip(delay, [1.0, 1e-6], strict=True))
    assert relative_rms(receive_energy(grid, delay, np.array([1.0, 1e-6]))[late], power[late]) <= 1e-4


def test_rounding_of_the_transforms_is_no_intensity():
    """Rounding leaves 1e-16 of the peak where nothing arrives, and differs between processors: silence is 0 there.

    A short smooth pulse, so that its own ringing ends.
    """
    grid = window()
    cells = grid.energy_cells()
    deposit_energy(cells[0], grid.first_time, grid.energy_rate, np.array([0.03]), np.ones(1))
    smooth = np.exp(-((grid.frequencies / (0.12 * grid.sample_rate)) ** 2))
    received = convolve_energy(cells, grid, smooth / grid.sample_rate)[0]
    assert np.count_nonzero(received) < 100 < received.size
    assert received[received > 0].min() >= ROUNDING * received.max()


def test_carrier_phase_is_the_callers():
    """Weights turned by the carrier give the passband echo's complex envelope."""
    grid = window()
    delay = np.array([0.0312345])
    truth = series(delay, carried(delay, np.ones(1)), grid.time)
    assert relative_rms(receive(grid, delay, carried(delay, np.ones(1))), truth) <= 3e-6


def test_energies_of_channels_are_transformed_alike_in_any_number():
    """40 channels of random energies at once, and each alone: the same bits."""
    grid = window()
    cells = np.random.default_rng(1).random((40, grid.energy_cells(1).shape[1]))
    together = convolve_energy(cells, grid, pulse_spectrum(grid.frequencies))
    alone = [convolve_energy(one[None], grid, pulse_spectrum(grid.frequencies))[0] for one in cells]
    np.testing.assert_array_equal(together, alone)


def test_few_energies_have_the_series_of_the_transforms(monkeypatch):
    """A dozen energies, some at the ends of the period: summed responses are the transforms' series to 1e-13."""
    grid = time_grid(0.0, 0.02, 40e3, -0.2e-3, 0.5e-3)
    cells = grid.energy_cells(2)
    rng = np.random.default_rng(4)
    last = cells.shape[1]
    places = np.concatenate([[0, 1, last - 1, last - 2], rng.integers(0, last, 8)])
    cells[0, places] = rng.random(12) + 0.1
    cells[1, ::3] = rng.random(cells[1, ::3].size)
    summed = convolve_energy(cells, grid, pulse_spectrum(grid.frequencies))
    monkeypatch.setattr("insonify.synthesis.time_grid.FEW", 0)
    transformed = convolve_energy(cells, grid, pulse_spectrum(grid.frequencies))
    np.testing.assert_array_equal(summed[1], transformed[1])
    np.testing.assert_allclose(summed[0], transformed[0], atol=1e-13 * transformed[0].max())
    assert transformed[0].max() > 0
