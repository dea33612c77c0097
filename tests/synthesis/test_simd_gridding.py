"""Claims about spikes that come in several shapes, one by one or gathered: sums of polynomials in float64."""

import numpy as np
import pytest
from numba import njit

from insonify.synthesis._gridding_kernel import DEGREE, WIDTH, tap_coefficients
from insonify.synthesis._polynomial_moments import MARGIN, WINDOW, deposit_moments, empty_window, gather_moments
from insonify.synthesis._simd_gridding import mix_series, moment_vectors
from insonify.synthesis._waveform_basis_kernel import (
    basis_coordinate,
    basis_weight_table,
    basis_weights,
    deposit_waveforms,
    group_layout,
)
from insonify.synthesis.time_grid import convolve_pulse, convolve_waveforms, grid_factors, time_grid
from synthesis.oracle import pulse_spectrum, spikes

CELLS = 400
TAPS = tap_coefficients().astype(float)


def nodes(shapes):
    """Chebyshev's nodes, increasing."""
    return -np.cos((np.arange(shapes) + 0.5) * np.pi / shapes)


def polynomials(node, x):
    """Lagrange's, one of each node, at some places, (shapes, n)."""
    return np.array([np.prod([(x - b) / (a - b) for b in node if b != a], axis=0) + 0 * x for a in node])


def some_spikes(seed, elements, count):
    """First cells, places between cells, weights and places among shapes; the first few at either end of each."""
    rng, size = np.random.default_rng(seed), elements * count
    at = rng.integers(-1, CELLS - 8, size).astype(np.int32)
    place, x = (rng.uniform(-1, 1, size).astype(np.float32) for _ in range(2))
    place, weight = place / 2, rng.normal(size=2 * size).astype(np.float32)
    place[:2], x[:2] = [-0.5, 0.5][:size], [-1, 1][:size]
    return at, place, weight, x


def known(node, elements, count, at, place, weight, x):
    """Grids of these spikes, (elements, cells, shapes)."""
    cells, share = np.zeros((elements, CELLS, len(node)), complex), polynomials(node, x.astype(float))
    for k in range(elements * count):
        for j in range(WIDTH if at[k] >= 0 else 0):
            height = np.polynomial.polynomial.polyval(float(place[k]), TAPS[:, j])
            cells[k // count, at[k] + j] += height * share[:, k] * complex(weight[2 * k], weight[2 * k + 1])
    return cells


@pytest.mark.parametrize("shapes", [1, 2, 3, 4, 5, 8, 9])
@pytest.mark.parametrize("count", [0, 1, 300])
def test_spikes_of_any_number_of_shapes(shapes, count):
    """Two elements, channel 1 and 2 of 4: the sum over spikes and cells, to 1e-6; the others stay silent."""
    at, place, weight, x = some_spikes(shapes, 2, count)
    groups, together = group_layout(shapes)
    cells, shaped = (
        np.zeros((4, groups, CELLS, together), np.complex64),
        basis_weight_table(2e-3 * nodes(shapes), -2e-3, 2e-3),
    )
    share = np.zeros((4 * groups, max(2 * count, 1) if groups > 1 else 1), np.float32)
    if groups > 1 and count:
        basis_weights(x, shaped.node_coordinate, shaped.node_scale, share)
    deposit_waveforms(cells, 1, 2, count, at, place, weight, x, shaped, share, count)
    got = np.moveaxis(cells, 1, 2).reshape(4, CELLS, -1)
    expected = known(nodes(shapes), 2, count, at, place, weight, x)
    assert not got[[0, 3]].any() and not got[..., shapes:].any()
    assert np.linalg.norm(got[1:3, :, :shapes] - expected) <= 1e-6 * np.linalg.norm(expected)


@pytest.mark.parametrize("shapes", [1, 2, 4])
def test_moments_are_what_each_spike_would_have_added(shapes):
    """Three elements, a window that moves over all cells: the float64 sum, to 2e-6, how many there are in a cell."""
    at, place, weight, x = some_spikes(10 + shapes, 3, 2000)
    cells, shaped = np.zeros((3, 1, CELLS, shapes), np.complex64), basis_weight_table(nodes(shapes), -1.0, 1.0)
    window = empty_window(3, shapes)
    assert window.size == 3 * WINDOW * 8 * moment_vectors(shapes) and 4 * moment_vectors(shapes) >= shapes * (
        DEGREE + 1
    )
    for k, begin in enumerate(range(0, CELLS - WINDOW, 60)):
        rows = np.array([e * 2000 + n for e in range(3) for n in range(k, 2000, 6)])
        part = len(rows) // 3
        gather_moments(
            cells,
            window,
            begin,
            0,
            3,
            part,
            at[rows],
            place[rows],
            weight.reshape(-1, 2)[rows].ravel(),
            x[rows],
            shaped,
            part,
        )
        deposit_moments(cells, window, begin, begin + WINDOW, 3)
        assert not window.any()
    expected = known(nodes(shapes), 3, 2000, at, place, weight, x)
    assert np.linalg.norm(cells[:, 0] - expected) < 2e-6 * np.linalg.norm(expected)


def test_a_window_holds_its_first_and_last_cell_and_no_other():
    """Spikes at both its ends wait in it; those one cell before and behind are deposited at once."""
    shaped = basis_weight_table(np.zeros(1), 0.0, 0.0)
    for begin, cell, waits in (
        (100, 100, True),
        (100, 99, False),
        (100, 99 + WINDOW, True),
        (100, 100 + WINDOW, False),
    ):
        cells, window = np.zeros((1, 1, CELLS, 1), np.complex64), empty_window(1, 1)
        one = np.array([cell], np.int32), np.zeros(1, np.float32), np.ones(2, np.float32), np.zeros(1, np.float32)
        gather_moments(cells, window, begin, 0, 1, 1, *one, shaped, 1)
        assert (window.any(), cells.any()) == (waits, not waits)
        deposit_moments(cells, window, begin, begin + WINDOW, 1)
        assert np.flatnonzero(cells[0, 0, :, 0])[0] == cell and 0 < MARGIN < WINDOW


@pytest.mark.parametrize("shapes", range(1, 12))
def test_shares_of_all_shapes_add_to_one(shapes):
    """Anywhere among the nodes, and at a node one shape has it all: 2e-5, by either arithmetic; beyond, the ends'."""
    node = 3e-3 + 2e-3 * nodes(shapes)
    shaped = basis_weight_table(node, 1e-3, 5e-3)
    if shapes == 1:
        assert shaped.half_range == 0
        return
    doppler = np.concatenate([node, np.linspace(node[0], node[-1], 50), [-1.0, 1.0]])
    x, share = np.empty(len(doppler), np.float32), np.zeros((shapes, len(doppler)), np.float32)
    basis_coordinate(doppler, shaped, x)
    assert x.min() == -1 and x.max() == 1
    basis_weights(x, shaped.node_coordinate, shaped.node_scale, share)
    np.testing.assert_allclose(share.sum(axis=0), 1, atol=2e-5)
    np.testing.assert_allclose(share[:, :shapes], np.eye(shapes), atol=2e-5)
    np.testing.assert_allclose(share, polynomials(nodes(shapes), x.astype(float)), atol=2e-5)
    if shapes in (2, 4):
        by_curve = np.polynomial.polynomial.polyval(x.astype(float), shaped.coefficients[:, : 2 * shapes : 2])
        np.testing.assert_allclose(by_curve, share, atol=2e-6)


def test_grids_are_no_more_than_the_shapes_take():
    """One, two, then fours: room for all, less than four too many, four to a cell at most."""
    for shapes in range(1, 60):
        groups, together = group_layout(shapes)
        assert together in (1, 2, 4) and shapes <= groups * together < shapes + 4
        assert (groups == 1) == (shapes <= 4)


@njit
def _mix_channels(polynomials, series, kept, e, begin, count, mixed, columns):
    shape = series.shape[1], kept, series.shape[2], 0, count, mixed.shape[1], columns
    mix_series(polynomials, series, shape, e, begin, mixed)


@pytest.mark.parametrize("columns", [2, 3])
@pytest.mark.parametrize("count", [1, 15, 16, 17, 48])
def test_series_are_summed_as_matrices_are_multiplied(count, columns):
    """Columns, the first from its fourth term on, the others to a few: 1e-6; none beyond a multiple of 16."""
    rng = np.random.default_rng(count)
    polynomials, series = (rng.normal(size=size).astype(np.float32) for size in ((5, 7), (3, 7, 64)))
    mixed = np.full((3, 100), np.nan, np.float32)
    _mix_channels(polynomials, series, 4, 3, 20, count, mixed, columns)
    here, room = slice(20, 20 + count), 20 + 16 * -(-count // 16)
    row, known = polynomials[3].astype(float), series[..., :count].astype(float)
    expected = [row[3:] @ known[0, 3:], row[:4] @ known[1, :4], row[:4] @ known[2, :4]]
    np.testing.assert_allclose(mixed[:columns, here], expected[:columns], atol=3e-6)
    assert np.isnan(mixed[columns:]).all() and np.isnan(mixed[:, :20]).all() and np.isnan(mixed[:, room:]).all()


@pytest.mark.parametrize("dopplers", [1, 2, 3, 5, 9])
def test_shapes_of_a_cell_are_finished_as_each_alone(dopplers):
    """Two bands, two channels, groups of up to four with room to spare that is not silent: the sum of all, 1e-6."""
    grid = time_grid(0.0, 0.01, 25e3, -1e-3, 1e-3)
    groups, together = group_layout(dopplers)
    size = grid.cells().size
    _, noise = spikes(2 * 2 * groups * size * together, 0, 1, seed=dopplers)
    cells = noise.reshape(2, 2, groups, size, together)
    spectra = pulse_spectrum(grid.frequencies) * np.random.default_rng(3).normal(size=(2, dopplers, 1))
    apart = sum(
        convolve_pulse(np.ascontiguousarray(cells[b, :, d // together, :, d % together]), grid, spectra[b, d])
        for b in range(2) for d in range(dopplers)
    )  # fmt: skip
    combined = convolve_waveforms(cells, grid, grid_factors(grid, spectra))
    assert np.abs(combined - apart).max() < 1e-6 * np.abs(apart).max()
