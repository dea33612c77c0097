"""Lists of samples follow from keep probabilities, and pings of a rolling platform do not depend on others."""

from types import SimpleNamespace

import numpy as np
import pytest

from engines.test_fast_reverberation import GROUND, SIDESCAN, made, quickly, thoroughly
from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation import reverberation, reverberation_plan
from insonify.engines.fast_reverberation._radial_samples_kernel import FULL_PROBABILITY, priority_of
from insonify.engines.fast_reverberation._sample_allocation_kernel import pair_keep_probabilities
from insonify.engines.fast_reverberation.reverberation_plan import _sample_lists, absorption_db, bounce_tables
from insonify.engines.radial_tables import FamilyTable, SampleLists
from insonify.ocean.water import Water
from insonify.recent_results import RecentResults
from insonify.simulator import build_simulator

FAMILIES, STEP, EDGES = ("D", "S", "BS"), 0.07, np.linspace(3.0, 20.0, 9)
PAIR = np.array([(i, j) for i in range(3) for j in range(i, 3)])


def some_radials(count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Radials over a few range bins each, in steps of 1 to 8, and keep probabilities, a third of them 0."""
    random, radials = np.random.default_rng(6), np.zeros((count, 9))
    bearing = random.uniform(0, 2 * np.pi, count)
    radials[:, column.COSINE], radials[:, column.SINE] = np.cos(bearing), np.sin(bearing)
    radials[:, column.START] = random.uniform(3.0, 15.0, count)
    radials[:, column.STOP] = np.minimum(radials[:, column.START] + random.uniform(0.0, 9.0, count), 20.0)
    radials[::7, column.START], radials[::5, column.STOP] = 3.0, 20.0
    radials[:, column.FIRST_SAMPLE], radials[:, column.NUMBER] = random.uniform(0.01, 1, count), np.arange(count)
    radials[:, column.STRIDE] = random.choice([1, 2, 8], count)
    keep = random.integers(1, FULL_PROBABILITY + 1, (count, len(EDGES) - 1, len(PAIR))).astype(np.uint8)
    keep[random.uniform(size=keep.shape) < 1 / 3] = 0
    keep[::9] = 0
    return radials, keep


def lists_of(radials: np.ndarray, keep: np.ndarray) -> SampleLists:
    """Lists of some radials; pairs may interfere in every other range bin."""
    codes, rows, names = bounce_tables(FAMILIES)
    rising = np.array([name.endswith("B") for name in names])
    zeros = np.zeros(len(FAMILIES))
    table = FamilyTable(zeros, codes, rows, np.zeros(len(names)), rising, np.ones((3, 2), np.complex64),
                        np.zeros(0, np.float32), 0.0)  # fmt: skip
    sampling = SimpleNamespace(edges=EDGES, pair=PAIR, interferes=np.arange(len(EDGES) - 1) % 2 == 1)
    return _sample_lists(radials, 0.4, STEP, sampling, keep, table)


def test_lists_have_the_samples_below_the_keep_probability_of_any_pair_and_no_other():
    """60 radials, sample by sample: numbers, families, rows and weights of each pair, ranges of interference."""
    radials, keep = some_radials()
    found, total = lists_of(radials, keep), 0
    for s, radial in enumerate(radials):
        spacing = STEP * radial[column.STRIDE]
        distance = (np.arange(400) + radial[column.FIRST_SAMPLE]) * spacing
        where = np.searchsorted(EDGES, distance, side="right") - 1
        inside = (distance >= radial[column.START]) & (distance < radial[column.STOP]) & (where < len(EDGES) - 1)
        priority = np.array([priority_of(radial[column.NUMBER], k) for k in range(400)])
        taken = inside[:, None] & (priority[:, None] < keep[s, np.clip(where, 0, len(EDGES) - 2)])
        number = np.flatnonzero(taken.any(axis=1))
        listed = slice(*found.list_offsets[s : s + 2])
        np.testing.assert_array_equal(found.sample_number[listed], number)
        np.testing.assert_allclose(found.distance[listed], distance[number], rtol=1e-14)
        bits = np.zeros(len(number), int)
        for p, legs in enumerate(PAIR):
            bits |= np.where(taken[number, p], (1 << legs[0]) | (1 << legs[1]), 0)
            rows = slice(*found.pair_offsets[s, p : p + 2])
            np.testing.assert_array_equal(found.pair_points[rows], np.flatnonzero(taken[number, p]))
            weight = FULL_PROBABILITY / keep[s, where[number[taken[number, p]]], p]
            np.testing.assert_allclose(found.inverse_probability[rows], weight, rtol=1e-6)
        np.testing.assert_array_equal(found.requested_families[listed], bits)
        assert found.family_bits[s] == np.bitwise_or.reduce(bits, initial=0)
        ranges = found.interference_ranges[slice(*found.interference_offsets[s : s + 2])]
        expected = [np.flatnonzero(where[number] == b)[[0, -1]] + [0, 1] for b in np.unique(where[number]) if b % 2]
        np.testing.assert_array_equal(ranges, np.reshape(expected, (-1, 2)))
        total += len(number)
    assert total == len(found.sample_number) == len(found.distance) == len(found.requested_families) > 2000
    assert len(found.pair_points) == len(found.inverse_probability) == found.pair_offsets[-1, -1]


def test_no_radials_have_empty_lists():
    """Arrays without rows, and offsets of 0."""
    found = lists_of(*(part[:0] for part in some_radials()))
    assert found.sample_number.shape == found.pair_points.shape == (0,) and found.list_offsets.tolist() == [0]


def test_keep_probabilities_follow_from_the_energy_of_the_radial_that_was_divided():
    """Radials in any order, each with a row of energies: as with energies in their order, and 0 where none passes."""
    random, (radials, keep) = np.random.default_rng(2), some_radials()
    energy = random.lognormal(-2, 2, keep.shape).astype(np.float32)
    full, received = random.uniform(0.01, 0.1, keep.shape[1:]), random.uniform(size=keep.shape[1:]) < 0.8
    received[:, [0, 3]] = True  # the first of pairs that interfere
    group = np.tile(np.array([0, 0, 2, 3, 3, 3]), (keep.shape[1], 1))
    group[::2] = np.arange(6)
    order, found = random.permutation(len(radials)), np.empty((2, *keep.shape), np.uint8)
    given = full, received, group
    pair_keep_probabilities(radials, EDGES, STEP, energy[order], np.argsort(order), *given, found[0], 32, 1)
    pair_keep_probabilities(radials, EDGES, STEP, energy, np.arange(len(radials)), *given, found[1], 32, 1)
    np.testing.assert_array_equal(*found)
    passes = (EDGES[1:] > radials[:, [column.START]]) & (EDGES[:-1] < radials[:, [column.STOP]])
    np.testing.assert_array_equal(found[0] > 0, passes[..., None] & received)
    assert len(np.unique(found[0])) == FULL_PROBABILITY + 1


MOTION = {
    "roll": {"rms": "2 deg", "period": 5.0}, "pitch": {"rms": "1 deg", "period": 4.0},
    "yaw": {"rms": "1 deg", "period": 7.0}, "heave": {"rms": 0.1, "period": 6.0},
}  # fmt: skip


@pytest.mark.parametrize("order", [0, 2])
def test_both_engines_agree_on_a_rolling_platform(order):
    """Direct paths and 9 pairs, at an attitude and a depth of their own each: 0.05 dB, mean of 850 samples of 3 pings.

    850 samples are some 20 pulses' worth of ground; the attitudes of the pings differ by more than a degree.
    """
    simulator = build_simulator(made(order, track={**SIDESCAN["track"], "interval": 1.1, "motion": MOTION}))
    axes = [simulator.ping_geometry(ping).transmit_beams.axes for ping in range(3)]
    assert all(np.linalg.norm(axes[k] - axes[k - 1]) > np.radians(1) for k in range(3))
    means = []
    for evaluate in (quickly, thoroughly):
        series = [evaluate(simulator, ping)[0, GROUND] for ping in range(3)]
        means.append([part.mean() for part in series])
    assert np.abs(10 * np.log10(np.divide(*means))).max() < 0.05


@pytest.mark.parametrize("families", [1, 3])
def test_radials_without_pairs_in_a_stretch_have_no_points_there(families):
    """Probabilities of 0 in the outer half of all range bins: no point lies beyond, and none of the inner is lost."""
    radials, keep = some_radials()
    keep[..., families * (families + 1) // 2 :] = 0
    whole = lists_of(radials, keep)
    keep[:, len(EDGES) // 2 :] = 0
    inner = lists_of(radials, keep)
    assert inner.distance.max() < EDGES[len(EDGES) // 2] < whole.distance.max()
    nearer = whole.distance < EDGES[len(EDGES) // 2]
    np.testing.assert_array_equal(inner.distance, whole.distance[nearer])
    np.testing.assert_array_equal(inner.requested_families, whole.requested_families[nearer])
    for s in range(len(radials)):
        points = inner.sample_number[slice(*inner.list_offsets[s : s + 2])]
        assert inner.sample_counts[s] >= (points[-1] + 1 if len(points) else 0)
        assert inner.sample_counts[s] <= whole.sample_counts[s]


@pytest.mark.parametrize("order", [0, 2])
def test_a_ping_of_a_rolling_platform_does_not_depend_on_the_pings_before(order):
    """Roll, pitch, yaw and heave: the last of 5 pings has the same bits alone and after the others."""
    simulator = build_simulator(made(order, track={**SIDESCAN["track"], "motion": MOTION}))
    pings = []
    for numbers in ([4], range(5)):
        reverberation._PREPARED, reverberation_plan._PLANS = RecentResults(8), RecentResults(8)
        pings.append([quickly(simulator, ping) for ping in numbers])
    np.testing.assert_array_equal(pings[0][-1], pings[1][-1])
    assert not np.array_equal(pings[1][-1], pings[1][-2])


def test_each_water_and_frequency_has_its_own_absorption():
    """What is kept is that of the same water at the same frequency, evaluated twice and in turns."""
    waters, frequencies = [Water(temperature=celsius) for celsius in (4.0, 20.0)], (5e4, 1e5, 4e5)
    kept = [[[absorption_db(water, f) for f in frequencies] for water in waters] for _ in range(2)]
    expected = [[float(water.absorption(f)) for f in frequencies] for water in waters]
    np.testing.assert_array_equal(kept, [expected, expected])
    assert len(set(np.ravel(expected))) == 6
