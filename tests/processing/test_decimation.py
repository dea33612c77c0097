"""Claims about what an instrument keeps: energy, peaks, looks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.processing import decimate, decimated_time, multilook


@given(st.integers(1, 60), st.integers(1, 60), st.integers(0, 99))
def test_the_mean_keeps_the_energy_and_the_peak_keeps_the_strongest(count, bins, seed):
    """Whatever the two numbers of samples, whole multiples or not."""
    power, samples = np.random.default_rng(seed).exponential(size=(2, count)), min(bins, count)
    mean, peak = decimate(power, samples), decimate(power, samples, keep="peak")
    np.testing.assert_allclose(mean.mean(axis=-1), power.mean(axis=-1))
    np.testing.assert_array_equal(peak.max(axis=-1), power.max(axis=-1))
    assert np.all(peak >= mean - 1e-12)
    # each peak is one of the samples that its share touches
    for i in range(samples):
        share = power[:, i * count // samples : -(-(i + 1) * count // samples)]
        np.testing.assert_array_equal(peak[:, i], share.max(axis=-1))


def test_whole_multiples_are_plain_blocks():
    """Six samples to two, and their times; as many as there are: unchanged."""
    power = np.array([1.0, 2, 3, 10, 0, 2])
    np.testing.assert_allclose(decimate(power, 2), [2, 4])
    np.testing.assert_allclose(decimate(power, 2, keep="peak"), [3, 10])
    np.testing.assert_allclose(decimated_time(np.arange(6) * 0.1, 2), [0.1, 0.4])
    np.testing.assert_allclose(decimate(power, 6), power, atol=1e-12)


def test_a_sample_across_a_border_is_shared():
    """Three to two: one and a half samples each."""
    np.testing.assert_allclose(decimate([3.0, 6.0, 9.0], 2), [(3 + 3) / 1.5, (3 + 9) / 1.5])


def test_speckle_falls_with_the_root_of_the_looks():
    """Exponential intensity, 5000 blocks of 12 looks: deviation over mean 1 / sqrt(12) within 5 % (one is 1 %)."""
    power = np.random.default_rng(2).exponential(size=(300, 200))
    looked = multilook(power, (3, 4))
    assert looked.shape == (100, 50)
    assert looked.std() / looked.mean() == pytest.approx(1 / np.sqrt(12), rel=0.05)
    assert looked.mean() == pytest.approx(power.mean())
    assert multilook(power, (7, 9)).shape == (42, 22)  # what fills no block is left out


def test_what_does_not_fit_is_refused():
    """The value, and what would fit."""
    with pytest.raises(ValueError, match="samples is 7"):
        decimate(np.ones(6), 7)
    with pytest.raises(ValueError, match="keep is 'last'; choose one of mean, peak"):
        decimate(np.ones(6), 2, keep="last")
    with pytest.raises(ValueError, match=r"looks is \(1, 9\)"):
        multilook(np.ones((4, 6)), (1, 9))
