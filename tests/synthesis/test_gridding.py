"""Many spikes on the grid, against sums that share no code with the kernels."""

from concurrent.futures import ThreadPoolExecutor

import finufft
import numpy as np
import pytest

from insonify.synthesis._gridding import deposit_energy, deposit_energy_on_rows, deposit_pressure
from insonify.synthesis.time_grid import convolve_energy, convolve_pulse, time_grid
from synthesis.oracle import RATE, carried, pulse_spectrum, relative_rms, series, spikes

GRID = time_grid(0.0, 0.1, RATE, -2e-3, 2e-3)


def transformed(cells):
    """The series of filled cells."""
    return convolve_pulse(cells[np.newaxis], GRID, pulse_spectrum(GRID.frequencies))[0]


def deposited(kernel, *columns, grid=GRID):
    """Cells filled by a kernel."""
    cells = grid.cells()[0]
    kernel(cells, grid.first_time, grid.cell_rate, *columns)
    return cells


def deposited_carrier(delay, amplitude, grid=GRID):
    """Cells filled by echoes of a carrier."""
    return deposited(deposit_pressure, delay, carried(delay, amplitude).astype(np.complex64), grid=grid)


def test_engine_sum_equals_the_sum_over_frequencies():
    """200 spikes at 100 kHz: the gridded series equals the float64 frequency-domain sum to 2e-6 (bar: 1e-5)."""
    delay, amplitude = spikes(200, 0.0, 0.099)
    truth = series(delay, carried(delay, amplitude), GRID.time)
    assert relative_rms(transformed(deposited_carrier(delay, amplitude)), truth) <= 2e-6


def test_finufft_agrees():
    """An independent non-uniform FFT gives the same series, for 20 000 spikes."""
    delay, amplitude = spikes(20_000, 0.0, 0.099)
    angle = np.mod(2 * np.pi * (delay - GRID.start) * RATE / GRID.padded_samples, 2 * np.pi)
    bins = finufft.nufft1d1(angle, carried(delay, amplitude).astype(complex), GRID.padded_samples, eps=1e-12, isign=-1)
    shaped = np.fft.ifftshift(bins) * pulse_spectrum(GRID.frequencies)
    truth = (np.fft.ifft(shaped) * RATE)[: GRID.sample_count]
    assert relative_rms(transformed(deposited_carrier(delay, amplitude)), truth) <= 3e-6


def test_a_long_chirp_costs_no_accuracy():
    """A 10 ms sweep over the whole band is as exact as a short pulse: the pulse enters only as its spectrum."""

    def chirp(offset):
        flat = np.cos(np.pi / 2 * np.clip((np.abs(offset) / RATE - 0.4) / 0.1, 0, 1)) ** 2
        return flat * np.exp(-1j * np.pi * offset**2 * 10e-3 / (0.8 * RATE)) / RATE

    grid = time_grid(0.0, 0.1, RATE, -0.012, 0.012)
    delay, amplitude = spikes(200, 0.0, 0.099)
    cells = deposited_carrier(delay, amplitude, grid)
    got = convolve_pulse(cells[np.newaxis], grid, chirp(grid.frequencies))[0]
    assert relative_rms(got, series(delay, carried(delay, amplitude), grid.time, chirp)) <= 2e-6


def test_sound_adds():
    """Two crowds received together are the sum of each received alone."""
    one, two = spikes(300, 0, 0.1, seed=1), spikes(300, 0, 0.1, seed=2)
    both = [np.concatenate(columns) for columns in zip(one, two, strict=True)]
    together = deposited_carrier(*both)
    apart = deposited_carrier(*one) + deposited_carrier(*two)
    assert relative_rms(together, apart) <= 3e-7


def test_a_delay_of_one_sample_shifts_the_series():
    """Later by one output sample is the same series one sample on, turned by the carrier."""
    delay, amplitude = spikes(100, 0.01, 0.08)
    turned = carried(delay, amplitude).astype(np.complex64)
    first, later = (
        transformed(deposited(deposit_pressure, delay, turned)),
        transformed(deposited(deposit_pressure, delay + 1 / RATE, turned)),
    )
    assert relative_rms(later[1:], first[:-1]) <= 2e-6


@pytest.mark.parametrize("count", [0, 1, 511, 512, 513, 1025])
def test_no_spike_is_lost_between_blocks(count):
    """Any number of spikes is deposited whole: the cells' sum is the weights' sum, times the kernel's own."""
    delay, weight = np.full(count, 0.05), np.ones(count, np.complex64)
    one = deposited(deposit_pressure, np.array([0.05]), np.ones(1, np.complex64)).sum()
    assert deposited(deposit_pressure, delay, weight).sum() == pytest.approx(count * one, rel=1e-5)


def test_silent_spikes_leave_no_trace():
    """Weights of nothing, delays off the grid and delays that are no number leave the cells at zero."""
    delay = np.array([0.05, -1.0, 7.0, np.nan, np.inf])
    weight = np.array([0, 1, 1, 1, 1], np.complex64)
    assert not deposited(deposit_pressure, delay, weight).any()


def test_threads_do_not_change_a_bit():
    """Fixed chunks, added in order: one thread and two give the same bits."""
    delay, amplitude = spikes(40_000, 0, 0.1)

    def chunk(k):
        part = slice(10_000 * k, 10_000 * (k + 1))
        return deposited_carrier(delay[part], amplitude[part])

    sums = []
    for threads in (1, 2):
        with ThreadPoolExecutor(threads) as pool:
            sums.append(sum(pool.map(chunk, range(4))))
    assert sums[0].tobytes() == sums[1].tobytes()


def test_energies_add():
    """Arrivals that do not interfere add their |p|^2: 12 of them against the sum written out."""
    delay, amplitude = spikes(12, 0.0, 0.1)
    energy = np.abs(amplitude.astype(complex)) ** 2
    cells = GRID.energy_cells()
    deposit_energy(cells[0], GRID.first_time, GRID.energy_rate, delay, energy)
    got = convolve_energy(cells, GRID, pulse_spectrum(GRID.frequencies))[0]
    truth = sum(e * np.abs(series([d], np.ones(1), GRID.time)) ** 2 for d, e in zip(delay, energy, strict=True))
    assert np.abs(got - truth).max() <= 1e-6 * truth.max()


def test_mean_power_is_the_energy():
    """Random phases: the mean power of 4000 draws is the expected intensity (5 %: 3 standard errors at a sample)."""
    delay, amplitude = spikes(12, 0.05, 0.0506)
    random = np.random.default_rng(8)
    grid = time_grid(0.0495, 0.0515, RATE, -2e-3, 2e-3)
    cells = grid.cells(4000)
    for row in cells:
        phase = np.exp(2j * np.pi * random.uniform(size=12))
        deposit_pressure(row, grid.first_time, grid.cell_rate, delay, (amplitude * phase).astype(np.complex64))
    power = np.mean(np.abs(convolve_pulse(cells, grid, pulse_spectrum(grid.frequencies))) ** 2, axis=0)
    energies = grid.energy_cells()
    deposit_energy(energies[0], grid.first_time, grid.energy_rate, delay, np.abs(amplitude.astype(complex)) ** 2)
    expected = convolve_energy(energies, grid, pulse_spectrum(grid.frequencies))[0]
    strong = expected > 0.1 * expected.max()
    np.testing.assert_allclose(power[strong], expected[strong], rtol=0.05)


def test_energies_on_rows_are_shared_by_the_distance_to_both():
    """Single-precision cells of five rows: what double-precision cells of two rows hold, weighted, to rounding."""
    draw = np.random.default_rng(4)
    delay, energy, row = (
        draw.uniform(GRID.start, GRID.start + 0.01, 400),
        draw.uniform(0, 2, 400),
        draw.uniform(0, 4, 400),
    )
    expected = GRID.energy_cells(5)
    for k in range(5):
        share = np.maximum(1 - np.abs(row - k), 0)
        deposit_energy(expected[k], GRID.first_time, GRID.energy_rate, delay, energy * share)
    found = np.zeros(expected.shape, np.float32)
    deposit_energy_on_rows(found, GRID.first_time, GRID.energy_rate, delay, energy, row)
    assert np.count_nonzero(found) > 1000
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6 * expected.max())
