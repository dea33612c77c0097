"""Weak pairs of legs, evaluated at some scatterers: the mean is unbiased and all selections agree."""

import numpy as np
import pytest

from insonify.engines import pair_importance
from insonify.engines._pair_importance_kernel import assign_priorities, mark_sampled_families
from insonify.engines.pair_importance import MIN_KEEP_PROBABILITY, RANGE_BINS, _keep_probabilities
from insonify.records.pairs import PairSampling
from insonify.simulator import arrivals, build_simulator, simulate, simulate_pings
from oracles.arrival_sum import coherent_from_arrivals
from oracles.scenes import nominal
from oracles.time_series import relative_rms

ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}


def scene(**more):
    """Rough ground at 60 m, where legs off the bottom are 15 to 25 dB weaker than all that arrives with them."""
    return nominal(**{
        "seabed": ROUGH, "track": {"window": (0.08, 0.092)},
        "paths": {"max_reflections": 2, "scatterers_per_cell": 2.0},
        **more,
    })  # fmt: skip


def ground(simulator):
    """Pairs of the first blocks of the seabed, sampled."""
    here = simulator.ping_geometry(0)
    blocks = [block for block in simulator.engine.blocks(here) if block().boundary == "seabed"]
    return [simulator.engine.pairs(here, block, include_negligible=False) for block in blocks]


def test_scatterers_stand_for_those_left_out():
    """At 200 000 positions a pair attains its keep probability to 4 standard errors, and squared weights sum to all."""
    rng = np.random.default_rng(1)
    place, count = rng.integers(0, 2**63, 200_000).astype(np.uint64), 200_000
    distance, bearing = rng.uniform(0, 3.0, count), rng.uniform(0, 2 * np.pi, count)
    position = np.stack([5 + distance * np.cos(bearing), distance * np.sin(bearing)], axis=1)
    stretch, number = np.empty(count, np.uint8), np.empty(count, np.float32)
    first = np.array([0, 0, 1, 1], np.uint8)
    assign_priorities(position, 5.0, 0.0, np.array([0, 1.0, 2.0]), first, place, np.uint64(7), stretch, number)
    np.testing.assert_array_equal(stretch, distance >= 1)  # beyond the last is the last
    share = np.array([[[1.0, 1.0], [0.5, 0.04]], [[0.5, 0.04], [0.25, 0.03125]]], np.float32)
    needed = np.empty((2, count), bool)
    mark_sampled_families(number, stretch, share.max(axis=1), needed)
    amplitude_weight = PairSampling(number, stretch, share.reshape(4, 2)).amplitude_weight.reshape(2, 2, count)
    for b in range(2):
        own = stretch == b
        computed, error = (
            (amplitude_weight[..., own] > 0).mean(axis=-1),
            np.sqrt(share[..., b] * (1 - share[..., b]) / own.sum()),
        )
        assert (np.abs(computed - share[..., b]) <= 4 * error).all()
        np.testing.assert_allclose((amplitude_weight[..., own] ** 2).mean(axis=-1) * share[..., b], computed, rtol=1e-5)
    np.testing.assert_array_equal(needed, (amplitude_weight > 0).any(axis=1))


def test_keep_probabilities_follow_what_a_pair_has_of_all():
    """A pair and its twin count together; a quarter of all is whole, the least is received at one position in 32."""
    part = np.zeros((2, 2, RANGE_BINS))
    part[0, 1], part[1, 0], part[1, 1] = 0.02, 0.03, 1e-9
    share = _keep_probabilities(part)
    np.testing.assert_allclose(share[0, 1], 0.2)
    np.testing.assert_array_equal(share[0, 1], share[1, 0])
    assert (share[0, 0] == 1).all() and (share[1, 1] == MIN_KEEP_PROBABILITY).all()
    part[0, 1, 10] = 1.0
    np.testing.assert_array_equal(np.flatnonzero(_keep_probabilities(part)[0, 1] == 1), [9, 10, 11])


def test_a_recording_is_the_sum_of_its_arrivals():
    """Weak pairs sampled in both: to 1e-5 of the rms."""
    scenario = scene(track={"window": (0.08, 0.084)})
    simulator = build_simulator(scenario)
    assert any((pairs.strength == 0).any(axis=1).any() for pairs in ground(simulator))
    received = simulate(scenario, threads=1).pressure.values[0]
    written = coherent_from_arrivals(arrivals(scenario), simulator.ping_geometry(0), simulator.grid)
    assert np.sqrt(np.mean(np.abs(received - written) ** 2) / np.mean(np.abs(received) ** 2)) < 1e-5


def test_a_leg_is_followed_where_any_of_its_pairs_is_evaluated():
    """Legs off the bottom are zero at more than half of the positions; where a pair is evaluated, its legs exist."""
    for pairs in ground(build_simulator(scene())):
        if "BS" not in pairs.transmit_legs.families:
            continue
        row = pairs.transmit_legs.families.index("BS")
        computed = (pairs.strength[(pairs.pair == row).any(axis=1)] > 0).any(axis=0)
        assert computed.mean() < 0.5
        assert (pairs.transmit_legs.amplitude[row][~computed] == 0).all()
        assert (pairs.transmit_legs.amplitude[row][computed] != 0).mean() > 0.5


@pytest.mark.slow
def test_weak_pairs_keep_their_energy(monkeypatch):
    """Bottom legs by themselves, 16 grounds: sampled over whole 0 dB, within 3 standard errors, those below 0.5 dB."""
    ratio = []
    for seed in range(16):
        scenario = scene(seed=seed)
        thinned = simulate(scenario, threads=1).pressure.values[0]
        with monkeypatch.context() as patch:
            patch.setattr(pair_importance, "FULL_SAMPLING_FRACTION", 1e-12)
            whole = dict(simulate_pings(build_simulator(scenario), [0], 1))[0]
            direct = simulate(scenario.model_copy(update={"paths": scenario.paths.model_copy(
                update={"families": ("D", "S")})}), threads=1).pressure.values[0]  # fmt: skip
        ratio.append([np.sum(np.abs(one - direct) ** 2) for one in (thinned, whole)])
    sampled, full = np.array(ratio).T
    error = np.std(sampled - full) / np.sqrt(len(sampled)) / full.mean()
    assert error < 0.12
    assert abs(sampled.mean() / full.mean() - 1) < 3 * error


def test_ends_at_two_depths_may_be_exchanged_over_rough_ground():
    """Transmitter 8 m above the receiver, or below it: equal to 1e-4 (0.2 with keep probabilities of one end alone)."""
    apart = (0.0, 0.0, -4.0), (0.0, 0.0, 4.0)
    one, other = (
        simulate(
            scene(transmit={"offset": sent}, receive={"offset": received}, water={"noise_level_db": None},
                  track={"window": (0.05, 0.054)}),
            threads=1,
        ).pressure.values
        for sent, received in (apart, apart[::-1])
    )  # fmt: skip
    assert np.linalg.norm(one) > 0 and relative_rms(other, one) < 1e-4
