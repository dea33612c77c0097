"""Claims about what lies between edges: written out sample by sample, at any dynamic range, with gaps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from insonify.processing import decimate, decimated_time, multilook, slant_to_ground_range
from insonify.processing.bin_overlap import sums_between_edges

SEEDS = st.integers(0, 10**6)


def overlap(edges, count):
    """Length of each sample that lies in each cell, shape (cells, count)."""
    low, high = np.clip(edges[:-1, None], 0, count), np.clip(edges[1:, None], 0, count)
    k = np.arange(count)
    return np.clip(np.minimum(high, k + 1) - np.maximum(low, k), 0, 1)


@given(SEEDS, st.integers(1, 40), st.integers(1, 12))
def test_sums_are_overlaps_times_samples(seed, count, cells):
    """Edges anywhere, on samples or between, beyond both ends, several in one sample or at one place."""
    rng = np.random.default_rng(seed)
    edges = np.sort(np.round(rng.uniform(-3, count + 3, cells + 1) * rng.choice([1, 4, 1000])) / 4)
    values = rng.exponential(size=(3, count))
    np.testing.assert_allclose(sums_between_edges(values, edges), values @ overlap(edges, count).T, atol=1e-12 * count)


@given(SEEDS, st.integers(1, 60), st.integers(1, 60))
def test_an_instrument_counts_samples_by_their_parts(seed, count, expected):
    """The mean of each share, as overlaps in float64 have it, over 300 dB of levels: to a part in 10^9, each."""
    power, kept = 10 ** np.random.default_rng(seed).uniform(-15, 15, (2, count)), min(expected, count)
    part = overlap(np.arange(kept + 1) * (count / kept), count)
    part[part < 1e-9] = 0  # the oracle's own rounding
    np.testing.assert_allclose(decimate(power, kept), power @ part.T * kept / count, rtol=1e-9)


def test_a_weak_echo_after_a_strong_one_keeps_its_level():
    """180 dB down, a strong sample later: as an instrument writes it, and on the ground."""
    level = np.where(np.arange(1000) < 300, 180.0, 0.0)
    few = decimate(10 ** (level / 10), 70)
    np.testing.assert_allclose(few[22:], 1, rtol=1e-12)
    slant, ground = np.arange(1000) * 0.05, np.arange(0.5, 48)
    found = slant_to_ground_range(level[None], slant, np.array([8.0]), ground)[0]
    np.testing.assert_allclose(found[np.hypot(ground - 0.5, 8) > 15.1], 0, atol=1e-9)


@given(SEEDS, st.integers(2, 50), st.integers(1, 50))
def test_a_missing_sample_is_missing_where_it_was(seed, count, expected):
    """NaN in the shares that touch it, by either way of keeping; all others are what they were."""
    rng, kept = np.random.default_rng(seed), min(expected, count)
    power, gap = rng.exponential(size=count), int(rng.integers(count))
    holed = np.where(np.arange(count) == gap, np.nan, power)
    i = np.arange(kept)
    touched = (i * count < (gap + 1) * kept) & ((i + 1) * count > gap * kept)  # whole numbers: no rounding
    for keep in ("mean", "peak"):
        found = decimate(holed, kept, keep=keep)
        np.testing.assert_array_equal(np.isnan(found), touched)
        np.testing.assert_allclose(found[~touched], decimate(power, kept, keep=keep)[~touched], rtol=1e-12)


@given(SEEDS, st.integers(1, 8), st.integers(1, 6), st.integers(1, 5))
def test_in_two_steps_as_in_one(seed, kept, first, second):
    """Whole multiples: the mean of means is the mean, the peak of peaks the peak, the middle of middles the middle."""
    count = kept * first * second
    power, time = np.random.default_rng(seed).exponential(size=count), 0.1 + np.arange(count) * 3e-5
    for keep in ("mean", "peak"):
        np.testing.assert_allclose(
            decimate(decimate(power, kept * second, keep=keep), kept, keep=keep),
            decimate(power, kept, keep=keep),
            rtol=1e-12,
        )
    twice = decimated_time(decimated_time(time, kept * second), kept)
    np.testing.assert_allclose(twice, decimated_time(time, kept), rtol=1e-12)


@given(SEEDS, st.integers(2, 30), st.integers(1, 30))
def test_each_sample_kept_stands_at_the_middle_of_its_share(seed, count, expected):
    """The record reaches half a step beyond its first and last times, and is shared out evenly."""
    kept, step, start = min(expected, count), 1 / 40e3, np.random.default_rng(seed).uniform(0, 1)
    edges = np.linspace(start - step / 2, start + (count - 0.5) * step, kept + 1)
    found = decimated_time(start + np.arange(count) * step, kept)
    np.testing.assert_allclose(found, (edges[1:] + edges[:-1]) / 2, atol=1e-9 * step * count)


@given(SEEDS, st.integers(1, 5), st.integers(1, 5), st.integers(0, 4))
def test_looks_are_means_of_blocks_written_out(seed, rows, columns, more):
    """Any block, with what is left over at the ends left out."""
    power = np.random.default_rng(seed).exponential(size=(2, 3 * rows + more % rows, 4 * columns + more % columns))
    found = multilook(power, (rows, columns))
    assert found.shape == (2, 3, 4)
    for i in range(3):
        for j in range(4):
            block = power[:, i * rows : (i + 1) * rows, j * columns : (j + 1) * columns]
            np.testing.assert_allclose(found[:, i, j], block.reshape(2, -1).mean(axis=1))
