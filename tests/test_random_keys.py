"""Claims about random numbers by key: published bits, fairness, and no memory."""

import csv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from insonify import random_keys
from insonify.random_keys import (
    JITTER,
    NOISE,
    SEABED,
    SLICE,
    SURFACE,
    TARGET,
    complex_normals,
    philox,
    philox_at,
    philox_consecutive,
    stream_key,
    uniform_from_word,
    uniforms,
)

KNOWN = list(csv.DictReader((Path(__file__).parent / "published" / "random123_philox4x32_10.csv").open()))
words = st.integers(0, 2**64 - 1)


@pytest.mark.parametrize("row", KNOWN, ids=lambda row: row["c0"])
def test_philox_gives_the_published_words(row):
    """Random123's known outputs for Philox4x32-10: zeros, ones and the digits of pi, to the bit."""
    arguments = [int(row[name], 16) for name in ("c0", "c1", "c2", "c3", "k0", "k1")]
    assert [int(w) for w in philox(*arguments)] == [int(row[name], 16) for name in ("w0", "w1", "w2", "w3")]


@pytest.mark.parametrize("first", [-3, 5, 2**32 - 4])
def test_words_of_many_counters_are_those_of_each(first):
    """Word for word, also where the counter passes 0 or 2^32."""
    words = np.empty((4, 19), np.uint32)
    philox_consecutive(first, -7, 8, 2**33 + 1, 12345, 67890, words)
    each = [philox(first + n, -7, 8, 2**33 + 1, 12345, 67890) for n in range(19)]
    np.testing.assert_array_equal(words.T, each)


def test_words_of_any_counters_are_those_of_each():
    """Word for word, for counters of either sign and beyond 2^32; what stands behind them is left alone."""
    first, second = np.random.default_rng(1).integers(-(2**34), 2**34, (2, 37))
    words = np.full((4, 40), 9, np.uint32)
    philox_at(first, second, 8, -3, 12345, 67890, words)
    each = [philox(a, b, 8, -3, 12345, 67890) for a, b in zip(first.tolist(), second.tolist(), strict=True)]
    np.testing.assert_array_equal(words[:, :37].T, each)
    assert (words[:, 37:] == 9).all()


def test_cells_west_of_the_origin_are_counters_too():
    """A negative cell number counts by its low 32 bits."""
    assert philox(-1, -2, 0, 0, 1, 2) == philox(2**32 - 1, 2**32 - 2, 0, 0, 1, 2)


def test_a_unit_number_is_never_zero_or_one():
    """The smallest and largest words stay inside (0, 1) by half a step."""
    assert uniform_from_word(0) == 2.0**-33
    assert uniform_from_word(2**32 - 1) == 1 - 2.0**-33


def test_draws_fill_the_unit_interval_evenly():
    """Each of the four words is uniform: Kolmogorov-Smirnov over N = 100 000, p > 0.001."""
    draws = uniforms(7, SEABED, np.arange(100_000))
    assert draws.shape == (100_000, 4)
    for column in draws.T:
        assert stats.kstest(column, "uniform").pvalue > 1e-3


@pytest.mark.parametrize("axis", range(4))
def test_neighbouring_cells_are_independent_of_each_other(axis):
    """Correlation of draws at counters n and n + 1 is 0 within 4/sqrt(N), N = 100 000, on every counter."""
    counters = [0, 0, 0, 0]
    counters[axis] = np.arange(100_001)
    draws = uniforms(3, SEABED, *counters)[:, 0]
    assert abs(np.corrcoef(draws[:-1], draws[1:])[0, 1]) < 4 / np.sqrt(100_000)


def test_streams_and_seeds_are_independent_of_each_other():
    """The same counters in any two streams, or under neighbouring seeds, are uncorrelated (4/sqrt(N), N = 50 000)."""
    cells = np.arange(50_000)
    kinds = [uniforms(1, stream, cells)[:, 0] for stream in (SEABED, SURFACE, TARGET, SLICE, JITTER, NOISE)]
    seeds = [uniforms(seed, SEABED, cells)[:, 0] for seed in (0, 2, 3, 2**32 + 1, 2**63 + 1)]
    off_diagonal = np.corrcoef(kinds + seeds) - np.eye(len(kinds) + len(seeds))
    assert np.abs(off_diagonal).max() < 4 / np.sqrt(50_000)


def test_every_stream_has_its_own_number():
    """No two purposes share a stream."""
    numbers = [v for n, v in vars(random_keys).items() if n.isupper() and not n.startswith("_") and isinstance(v, int)]
    assert len(numbers) >= 11
    assert len(set(numbers)) == len(numbers)


@given(words, st.integers(0, 63))
def test_every_bit_of_the_seed_matters(seed, bit):
    """Flipping any one of the 64 bits of the seed changes the key, and about half of its bits."""
    k0, k1 = stream_key(seed, SEABED)
    l0, l1 = stream_key(seed ^ (1 << bit), SEABED)
    changed = ((k0 ^ l0) | (k1 ^ l1) << 32).bit_count()
    assert 5 <= changed <= 59  # 32 +- 4 expected; 6.7 standard deviations


@pytest.mark.parametrize("seed", [-1, 2**64])
def test_a_seed_beyond_64_bits_is_refused(seed):
    """A seed that would have to be cut is refused, with the range."""
    with pytest.raises(ValueError, match="0 to 2\\^64 - 1"):
        stream_key(seed, SEABED)


def test_a_seed_is_a_whole_number():
    """Seed 1.5 is refused rather than rounded."""
    with pytest.raises(TypeError):
        stream_key(1.5, SEABED)


def test_noise_is_circular_gaussian_of_unit_power():
    """Unit mean power, no preferred phase, Gaussian parts: N = 200 000, four standard errors."""
    w = complex_normals(11, NOISE, ping=3, channel=2, count=200_000)
    error = 4 / np.sqrt(w.size)
    assert np.mean(np.abs(w) ** 2) == pytest.approx(1, abs=error)
    assert abs(np.mean(w)) < error
    assert abs(np.mean(w**2)) < error * np.sqrt(2)
    assert stats.kstest(w.real * np.sqrt(2), "norm").pvalue > 1e-3
    assert stats.kstest(w.imag * np.sqrt(2), "norm").pvalue > 1e-3
    assert abs(np.mean(w[:-1] * w[1:].conj())) < error


def test_pings_and_channels_have_their_own_noise():
    """Noise of two pings, or of two channels, is uncorrelated (4/sqrt(N), N = 50 000)."""
    here, later, beside = (complex_normals(5, NOISE, p, c, 50_000) for p, c in ((0, 0), (1, 0), (0, 1)))
    for other in (later, beside):
        assert abs(np.vdot(here, other)) / here.size < 4 / np.sqrt(here.size)


@given(st.integers(0, 300), st.integers(0, 200))
def test_a_sample_does_not_depend_on_where_the_run_began(start, count):
    """Samples requested alone are bit for bit those of the longer run."""
    whole = complex_normals(9, NOISE, 1, 4, 500)
    assert np.array_equal(complex_normals(9, NOISE, 1, 4, count, start=start), whole[start : start + count])


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_threads_cannot_change_a_bit(threads):
    """Pieces drawn by any number of threads, in any order, join to the whole."""
    starts = range(0, 9_999, 1_111)
    with ThreadPoolExecutor(threads) as pool:
        pieces = list(pool.map(lambda start: complex_normals(2, NOISE, 0, 0, 1_111, start=start), reversed(starts)))
    assert np.array_equal(np.concatenate(pieces[::-1]), complex_normals(2, NOISE, 0, 0, 9_999))


def test_order_of_the_cells_cannot_change_a_bit():
    """Shuffling the cells shuffles their draws, and does nothing else."""
    cells = np.random.default_rng(0).permutation(1_000)
    assert np.array_equal(uniforms(4, SEABED, cells, 5), uniforms(4, SEABED, np.arange(1_000), 5)[cells])


def test_counters_broadcast():
    """A column of cells against a row of cells gives a grid of draws."""
    grid = uniforms(4, SEABED, np.arange(3)[:, None], np.arange(5))
    assert grid.shape == (3, 5, 4)
    assert np.array_equal(grid[2, 3], uniforms(4, SEABED, 2, 3))
