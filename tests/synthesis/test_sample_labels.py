"""Kernels of labels by sample, against the same sums written out in NumPy."""

import numpy as np
import pytest

from insonify.synthesis._position_kernel import RUN_LENGTH, SamplePositions, smear_energies, smear_positions
from insonify.synthesis._sample_mask_kernel import Contributions, SampleMasks, fill_masks

NONE = 255
RECEIVER = np.array([10.0, -20.0, 5.0])


def convolved(bins: np.ndarray, pulse: np.ndarray, per_sample: int, samples: int) -> np.ndarray:
    """Sum over the lags of each sample, one sample after the other, shape (samples, columns)."""
    series = np.zeros((samples, bins.shape[1]))
    for n in range(samples):
        first = n // len(pulse) * per_sample
        rows = bins[first : first + pulse.shape[1]]
        series[n] = pulse[n % len(pulse), : len(rows)] @ rows
    return series


@pytest.mark.parametrize(("phases", "per_sample", "lags"), [(1, 1, 29), (1, 4, 35), (2, 1, 7), (4, 1, 2)])
def test_positions_are_means_over_the_lags_of_the_pulse(phases: int, per_sample: int, lags: int) -> None:
    """Energies and mean positions are sums over the lags, across runs of samples, gaps and both ends: to rounding."""
    rng = np.random.default_rng(3)
    samples = 2 * RUN_LENGTH * phases + 37
    bins = rng.random((1, (samples // phases + 9) * per_sample, 5)).astype(np.float32)
    bins[0, 20:300] = 0.0
    pulse = rng.random((phases, lags))
    pulse.setflags(write=False)  # that of a simulation is, and the same machine code serves both
    energy = np.zeros((1, samples))
    smear_energies(bins[..., 0], pulse, per_sample, energy)
    expected = convolved(bins[0].astype(float), pulse, per_sample, samples)
    np.testing.assert_allclose(energy[0], expected[:, 0], rtol=1e-12)
    strongest = np.where((rng.random((1, samples)) < 0.7) & (energy > 0), 2, 1).astype(np.int16)
    means = SamplePositions(*(np.full(size, np.nan) for size in ((1, samples, 3), (1, samples), (1, samples))))
    smear_positions(bins, energy, pulse, per_sample, strongest, 2, RECEIVER, means)
    own = strongest[0] == 2
    relative = expected[own, 1:] / expected[own, :1]
    np.testing.assert_allclose(means.position[0, own], relative[:, :3] + RECEIVER, rtol=1e-12)
    np.testing.assert_allclose(means.distance[0, own], np.linalg.norm(relative[:, :3], axis=1), rtol=1e-12)
    np.testing.assert_allclose(means.grazing[0, own], relative[:, 3], rtol=1e-12)
    assert all(np.isnan(column[0, ~own]).all() for column in means)


def test_masks_follow_from_their_definitions() -> None:
    """Masks and the strongest of seabed and two targets, of 5000 random samples, are those of NumPy's expressions."""
    rng, noise = np.random.default_rng(5), 0.3
    object_row = np.array([0, 1, 1, 2, 1, 0])  # the last two are occluded echoes
    is_occluded, has_surface = np.arange(6) > 3, np.array([0, 0, 1, 0, 0, 0], bool)
    energy = rng.random((6, 2, 5000)) * (rng.random((6, 2, 5000)) < 0.6)
    by_object = np.stack([energy[:4][object_row[:4] == row].sum(axis=0) for row in range(3)], axis=1)
    shape = energy.shape[1:]
    kinds = (float, np.uint8, np.uint8, np.int16, bool, bool, bool, bool)
    masks = SampleMasks(*(np.empty(shape, kind) for kind in kinds))
    contributions = Contributions(energy, object_row, is_occluded, has_surface)
    fill_masks(by_object, np.array([False, True, True]), contributions, 0, noise, NONE, masks)
    received, occluded, target = energy[:4].sum(axis=0) > 0, energy[4:].sum(axis=0), by_object[:, 1:].sum(axis=1)
    dominates = (target > 0) & (target >= by_object[:, 0] + noise)
    ghost = dominates & (energy[2] > energy[1] + energy[3])
    highlight = dominates & ~ghost & (target >= occluded)
    shadow = (occluded > energy[0]) & ~highlight
    strongest = np.where(received, by_object.argmax(axis=1), NONE)
    shadowing = np.where(shadow, np.where(energy[4] > energy[5], 1, 0), NONE)
    eligible = np.where(
        is_occluded[:, None, None],
        object_row[:, None, None] == shadowing,
        (object_row[:, None, None] == strongest) & ~shadow,
    )
    best = np.where(eligible, energy, 0.0)
    contribution = np.where(best.max(axis=0) > 0, best.argmax(axis=0), -1)
    expected = (
        by_object.sum(axis=1), strongest, shadowing, contribution, received, highlight, shadow, ghost,
    )  # fmt: skip
    for name, mask, value in zip(masks._fields, masks, expected, strict=True):
        np.testing.assert_array_equal(mask, value, err_msg=name)
    assert min(highlight.sum(), shadow.sum(), ghost.sum(), (~received).sum()) > 50
