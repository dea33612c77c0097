"""Expected intensity of groups, against the squares written out."""

from itertools import pairwise

import numpy as np
import pytest

from insonify.synthesis.coherent_groups import add_groups, pulse_table

RATE = 25e3


def pulse(time):
    """A smooth pulse, 0.2 ms wide, sweeping; below 1e-9 of its peak outside +-0.6 ms."""
    return np.exp(-((time / 1.3e-4) ** 2) + 2j * np.pi * (2e3 * time + 2e6 * time**2))


TABLE = pulse_table(pulse, -6e-4, 6e-4, RATE)


def intensity(group_first, delay, weight, start=0.01, count=600, **share):
    """What the kernel makes of it."""
    received = np.zeros(count)
    shares = (share.get("interfering", 1.0), share.get("independent", 0.0))
    first = np.asarray(group_first, np.int64)
    add_groups(
        received,
        start,
        RATE,
        TABLE.samples,
        TABLE.start,
        TABLE.rate,
        first,
        np.asarray(delay),
        np.asarray(weight),
        *shares,
    )
    return received


def amplitude_weights(group_first, delay, weight, start=0.01, count=600, interfering=1.0, independent=0.0):
    """The same by whole arrays, one group after another."""
    time = start + np.arange(count) / RATE
    total = np.zeros(count)
    for begin, end in pairwise(group_first):
        echoes = weight[begin:end, None] * pulse(time - delay[begin:end, None])
        total += interfering * np.abs(echoes.sum(0)) ** 2 + independent * (np.abs(echoes) ** 2).sum(0)
    return total


def crowd(count, seed=3):
    """Random delays [s] and weights."""
    random = np.random.default_rng(seed)
    return random.uniform(0.008, 0.036, count), random.normal(size=count) + 1j * random.normal(size=count)


@pytest.mark.parametrize("share", [(1.0, 0.0), (0.0, 1.0), (0.7, 0.4)])
def test_groups_are_squared_after_adding(share):
    """Groups of 0, 1, 9 and 70 arrivals in any order equal the brute-force squares to 1e-5 of the peak."""
    group_first = np.array([0, 9, 9, 10, 80, 82, 82])
    delay, weight = crowd(82)
    knobs = {"interfering": share[0], "independent": share[1]}
    truth = amplitude_weights(group_first, delay, weight, **knobs)
    assert np.abs(intensity(group_first, delay, weight, **knobs) - truth).max() <= 1e-5 * truth.max()


def test_a_mirror_pair_cancels():
    """Two arrivals of one group at one delay in opposite phase are silent; in two groups they add in power."""
    delay, weight = np.array([0.02, 0.02]), np.array([1.0 + 0j, -1.0])
    assert intensity([0, 2], delay, weight).max() <= 1e-20
    alone = intensity([0, 1], delay[:1], weight[:1])
    np.testing.assert_allclose(intensity([0, 1, 2], delay, weight), 2 * alone, rtol=1e-12)


def test_groups_far_apart_do_not_interfere():
    """Arrivals further apart than the pulse give the same intensity in one group and in two."""
    delay, weight = np.array([0.03, 0.012]), np.array([1.0 + 0j, 2j])
    np.testing.assert_allclose(intensity([0, 2], delay, weight), intensity([0, 1, 2], delay, weight), rtol=1e-9)


def test_order_in_a_group_does_not_matter():
    """Reversing the arrivals of a group changes the intensity by rounding only."""
    delay, weight = crowd(20)
    reverse = delay[::-1].copy(), weight[::-1].copy()  # views would have the kernel compiled once more
    forward, backward = intensity([0, 20], delay, weight), intensity([0, 20], *reverse)
    np.testing.assert_allclose(forward, backward, atol=1e-12 * forward.max())


def test_random_phases_of_the_replicas():
    """Jitter up to J = 0.3 wavelengths: the mean of 20 000 draws is sinc^2 J interfering, the rest independent.

    Each sample's mean has a standard error below 1 % of the peak; the bound is 3 %.
    """
    delay, weight = np.array([0.02, 0.02005, 0.0201]), np.array([1.0, 0.5 + 0.5j, -0.8])
    start, count, jitter = 0.0192, 40, 0.3
    time = start + np.arange(count) / RATE
    phase = np.exp(2j * np.pi * jitter * np.random.default_rng(6).uniform(size=(20_000, 3)))
    draws = np.abs((phase * weight) @ pulse(time - delay[:, None])) ** 2
    kept = np.sinc(jitter) ** 2
    expected = intensity([0, 3], delay, weight, start, count, interfering=kept, independent=1 - kept)
    assert np.abs(draws.mean(0) - expected).max() <= 0.03 * expected.max()


def test_a_path_and_its_reverse_are_one_pulse():
    """Arrivals at the same delay, alone or among others, add like any others of their group."""
    delay, weight = crowd(12)
    delay[[3, 7]], delay[5:7] = delay[0], delay[4]
    knobs = {"interfering": 0.6, "independent": 0.3}
    truth = amplitude_weights(np.array([0, 4, 12]), delay, weight, **knobs)
    assert np.abs(intensity([0, 4, 12], delay, weight, **knobs) - truth).max() <= 1e-5 * truth.max()


def test_a_delay_that_is_no_number_spoils_no_other():
    """An arrival without a delay, anywhere in a group, leaves the rest of the group as it was."""
    delay, weight = crowd(8)
    truth = intensity([0, 8], delay, weight)
    for place in range(9):
        spoilt = intensity([0, 9], np.insert(delay, place, np.nan), np.insert(weight, place, 1.0))
        np.testing.assert_allclose(spoilt, truth, atol=1e-12 * truth.max())


def test_window_edges():
    """Pulses cut by the window's edges, delays far outside and delays that are no number do no harm."""
    delay = np.array([0.01, 0.0339, 0.009, 0.0345, -5.0, 80.0, np.nan])
    weight = np.ones(7, complex)
    group_first = np.arange(8)
    truth = amplitude_weights(np.arange(5), delay[:4], weight[:4])
    np.testing.assert_allclose(intensity(group_first, delay, weight), truth, atol=1e-5)


def test_table_must_fit_the_samples():
    """A table whose entries do not fall on the output samples alike is refused."""
    with pytest.raises(ValueError, match="whole number of entries"):
        add_groups(
            np.zeros(8),
            0.0,
            RATE,
            TABLE.samples,
            TABLE.start,
            1.5 * RATE,
            np.array([0, 1]),
            np.zeros(1),
            np.ones(1) + 0j,
            1.0,  # other types of arguments would have the kernel compiled once more
            0.0,
        )
