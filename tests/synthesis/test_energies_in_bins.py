"""Claims about bins of energy alone: those of bins with positions, to the bit."""

import numpy as np

from insonify.synthesis._fast_reverberation_energies import DelayCells, WeightedSamples
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._position_kernel import deposit_pair_energies_in_bins, deposit_pair_positions

COUNT, BINS, CELLS = 1500, 90, 400


def random_samples(rng):
    """Samples of two families and three pairs, some of them outside the bins."""
    pair = np.array([[0, 0], [0, 1], [1, 1]])
    weights = rng.normal(size=(2, 2, COUNT)).astype(np.float32)
    rows = np.sort(np.argsort(rng.random((3, COUNT)), axis=1)[:, :1200], axis=1).astype(np.int32)
    return WeightedSamples(
        rng.uniform(-0.01, 0.06, (2, COUNT)), *weights, pair, np.array([1200, 700, 0]), rows,
        rng.random((3, 1200)).astype(np.float32), 1e3, 0.7, 0.2,
    )  # fmt: skip


def test_energies_in_bins_are_those_of_bins_with_positions():
    """Random samples of three pairs, one without any: bins and cells of both kernels, and bins that hold energy."""
    rng = np.random.default_rng(4)
    samples, alone, whole = (
        random_samples(rng),
        np.zeros((3, BINS), np.float32),
        np.zeros((3, BINS, MOMENTS), np.float32),
    )
    cells_alone, cells_whole = np.zeros((2, CELLS))
    deposit_pair_energies_in_bins(samples, DelayCells(cells_alone, 0.0, 4e3), DelayCells(alone, 0.0, 1e3))
    position, grazing = rng.normal(size=(3, COUNT)), rng.random((2, COUNT)).astype(np.float32)
    deposit_pair_positions(samples, DelayCells(cells_whole, 0.0, 4e3), DelayCells(whole, 0.0, 1e3), position, grazing,
                           np.zeros(3))  # fmt: skip
    np.testing.assert_array_equal(alone, whole[..., 0])
    np.testing.assert_array_equal(cells_alone, cells_whole)
    assert (alone[:2] > 0).mean() > 0.9 and not alone[2].any() and cells_alone.any()
