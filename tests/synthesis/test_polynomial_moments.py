"""Claims about echoes that are gathered before they are deposited: they come to the cells that each would come to."""

import numpy as np
import pytest

from insonify.synthesis._polynomial_moments import MARGIN, WINDOW, deposit_moments, empty_window, gather_moments
from insonify.synthesis._waveform_basis_kernel import basis_weight_table, deposit_waveforms


@pytest.mark.parametrize("shapes", [1, 2, 4])
def test_spikes_gathered_in_a_window_are_those_deposited_one_by_one(shapes):
    """2000 spikes at each of 3 elements, within the window, beyond it and off the grid: the same cells, to 1e-6."""
    rng, elements, count = np.random.default_rng(shapes), 3, 2000
    size = elements * count
    at = rng.integers(100 - MARGIN, 100 + 2 * WINDOW, size).astype(np.int32)
    at[rng.uniform(size=size) < 0.1] = -1
    place, x, weight = (rng.uniform(-1, 1, many).astype(np.float32) for many in (size, size, 2 * size))
    cells = np.zeros((2, elements + 1, 1, 500, shapes), np.complex64)
    shaped, window = basis_weight_table(1e-3 * np.arange(shapes), 0.0, 4e-3), empty_window(elements + 1, shapes)
    gather_moments(cells[0], window, 100, 1, elements, count, at, place / 2, weight, x, shaped, count)
    deposit_moments(cells[0], window, 100, 100 + WINDOW, elements + 1)
    deposit_waveforms(
        cells[1], 1, elements, count, at, place / 2, weight, x, shaped, np.zeros((4, 1), np.float32), count
    )
    assert not window.any() and not cells[:, 0].any() and np.abs(cells[0, 1:]).max() > 1
    assert np.linalg.norm(cells[0] - cells[1]) < 1e-6 * np.linalg.norm(cells[1])
