"""Rows of a pair selection by pair of legs, and keep probabilities estimated ahead of a run."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.engines.eigenray_engine import MANY_CHANNELS
from insonify.engines.pair_importance import (
    MIN_KEEP_PROBABILITY,
    RANGE_BINS,
    PairSelection,
    _edges,
    keep_probabilities_at,
    pair_energy_fractions,
)
from insonify.propagation.families import families_reaching
from insonify.records.pairs import PairSampling
from insonify.simulator import build_simulator
from oracles.scenes import nominal

NAMES = ("D", "B", "S", "BS")
ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}


def known(seed=1):
    """Four families and a table of distinct keep probabilities, for one position in each of 30 range bins."""
    keep_probability = (np.random.default_rng(seed).permutation(16 * 30) + 1).reshape(16, 30).astype(np.float32) / 500
    number, stretch = np.full(30, 1e-4, np.float32), np.arange(30).astype(np.uint8)
    return PairSelection(NAMES, np.ones((4, 30), bool), PairSampling(number, stretch, keep_probability))


def row_of(received, one, other):
    """Keep probabilities of one pair of families."""
    return received.sampling.keep_probability[4 * NAMES.index(one) + NAMES.index(other)]


def scene(**more):
    """Rough ground, 30 to 90 m away."""
    return nominal(**{"seabed": ROUGH, "track": {"window": (0.04, 0.12)}, "paths": {"max_reflections": 2}, **more})


@given(st.lists(st.tuples(st.sampled_from(NAMES), st.sampled_from(NAMES)), max_size=20))
def test_each_pair_has_the_row_of_its_two_names(pairs):
    """Out first and back second, however many pairs, in any order, some more than once."""
    received, out, back = known(), *(tuple(pair[k] for pair in pairs) for k in (0, 1))
    rows = received.sampling_of(out, back)
    assert rows.amplitude_weight.shape == (len(pairs), 30)
    for row, (one, other) in zip(rows.keep_probability, pairs, strict=True):
        np.testing.assert_array_equal(row, row_of(received, one, other))


def test_the_transmit_leg_is_distinguished_from_the_receive_leg():
    """A pair and its twin have rows of their own, though keep probabilities make them alike."""
    received = known()
    there, back = (
        received.sampling_of(("D",), ("B",)).keep_probability,
        received.sampling_of(("B",), ("D",)).keep_probability,
    )
    assert (there != back).all()


def test_all_pairs_in_their_order_are_the_table_itself():
    """Nothing is copied where everything is requested as it lies."""
    received = known()
    out, back = (tuple(NAMES[k] for k in np.indices((4, 4))[axis].ravel()) for axis in (0, 1))
    assert np.shares_memory(received.sampling_of(out, back).keep_probability, received.sampling.keep_probability)
    assert not np.shares_memory(
        received.sampling_of(out[::-1], back[::-1]).keep_probability, received.sampling.keep_probability
    )


def test_glints_of_one_family_share_its_row():
    """A rough surface splits a family into several legs of one name: all are evaluated where the family is."""
    received = known()
    out, back = ("S", "S", "S", "D"), ("D", "S", "D", "S")
    rows = received.sampling_of(out, back).keep_probability
    np.testing.assert_array_equal(rows[0], rows[2])
    np.testing.assert_array_equal(rows[1], row_of(received, "S", "S"))
    np.testing.assert_array_equal(rows[3], row_of(received, "D", "S"))


def test_a_pair_is_evaluated_where_the_number_lies_below_its_keep_probability():
    """Over all positions evaluated, amplitude weight squared times keep probability is one; elsewhere both are zero."""
    number = np.linspace(0, 1, 1001)[:-1].astype(np.float32)
    keep_probability = np.array([[1.0, 0.3], [0.05, 1 / 32]], np.float32)
    stretch = np.repeat([0, 1], 500).astype(np.uint8)
    amplitude_weight = PairSampling(number, stretch, keep_probability).amplitude_weight
    np.testing.assert_array_equal(amplitude_weight > 0, number < keep_probability[:, stretch])
    np.testing.assert_allclose((amplitude_weight**2 * keep_probability[:, stretch])[amplitude_weight > 0], 1, rtol=1e-6)


def test_without_sampling_amplitude_weights_are_one():
    """No table, no factor, whatever the pairs; and a family that is not followed has no row."""
    assert PairSelection(NAMES, None, None).sampling_of(("D", "D"), ("B", "S")) is None
    with pytest.raises(KeyError):
        known().sampling_of(("SBS",), ("D",))


@pytest.mark.parametrize("reflections", [1, 2])
def test_keep_probabilities_estimated_ahead_are_those_of_the_scatterers(reflections):
    """Pairs evaluated at all of a ping's scatterers, estimated by distance, are those of its blocks: to 2 %.

    Some 10 000 scatterers, of which one number each decides: its standard error is below 1 %.
    """
    simulator = build_simulator(scene(paths={"max_reflections": reflections}))
    here = simulator.ping_geometry(0)
    computed = expected = 0.0
    for block in simulator.engine.blocks(here):
        points = block()
        received = simulator.engine._pair_selection(here, points)
        distance = np.hypot(*(points.position[:, :2] - here.midpoint[:2]).T)
        families, keep_probability = simulator.engine.family_keep_probabilities(here, distance)
        expected += keep_probability.sum()
        computed += (
            len(received.families) ** 2 * len(points)
            if received.sampling is None
            else (received.sampling.amplitude_weight > 0).sum()
        )
        assert families == families_reaching("seabed", simulator.scenario.paths.followed_families)
    assert expected == pytest.approx(computed, rel=0.02)


def test_keep_probabilities_lie_between_the_least_and_all():
    """Direct pairs everywhere, others from 1 in 32 upwards or, where a leg is not followed, nowhere; twins alike."""
    simulator = build_simulator(scene(paths={"max_reflections": 4}))
    families, keep_probability = simulator.engine.family_keep_probabilities(
        simulator.ping_geometry(0), np.linspace(0, 300, 500)
    )
    assert (keep_probability[0, 0] == 1).all() and keep_probability.max() <= 1
    assert (
        ((keep_probability == 0) | (keep_probability >= MIN_KEEP_PROBABILITY)).all()
        and (keep_probability == 0).any()
        and (keep_probability == MIN_KEEP_PROBABILITY).any()
    )
    np.testing.assert_array_equal(keep_probability, keep_probability.swapaxes(0, 1))
    assert keep_probability.shape == (len(families), len(families), 500)


def test_a_family_that_is_negligible_has_no_keep_probability():
    """Fractions of 1e-5 throughout: no pair of the family is evaluated at any position."""
    simulator = build_simulator(scene())
    here, families = simulator.ping_geometry(0), ("D", "B", "S")
    part = np.full((3, 3, RANGE_BINS), 0.2)
    part[1], part[:, 1] = 1e-9, 1e-9
    keep_probability = keep_probabilities_at(families, part, here, np.linspace(1, 100, 50))
    assert not keep_probability[1].any() and not keep_probability[:, 1].any() and (keep_probability[0, 2] == 1).all()


ELEMENTS = {"kind": "planar", "width": 0.24, "length": None, "height": 0.1}
BEAMS = {"steer": {"from": -0.5, "to": 0.5, "step": 1 / (MANY_CHANNELS - 1)}}


@pytest.mark.parametrize("channels", ["elements", "beams"])
def test_weak_pairs_over_a_flat_bed_are_sampled_for_many_channels(monkeypatch, channels):
    """Of the same scatterers, fewer echoes of weak pairs, of the same energy: 4 standard errors; direct ones all."""
    receive = {**ELEMENTS, "columns": MANY_CHANNELS, **(BEAMS if channels == "beams" else {})}
    wide = scene(
        seabed={"depth": 20.0}, transmit=ELEMENTS, receive=receive, track={"window": (0.04, 0.06)},
        sonar={"receiver": {"record": channels, "sub_bands": 1}, "mounting": {"tilt": 0.3}},
    )  # fmt: skip
    simulator = build_simulator(wide)

    def energies():
        """Energies of the direct and of each other pair, at the scatterers where they are not zero."""
        here, found = simulator.ping_geometry(0), {}
        for block in simulator.engine.blocks(here):
            pairs = simulator.engine.pairs(here, block, include_negligible=False)
            if pairs.scatterers.boundary != "seabed":
                continue
            for row, (name, (i, j)) in enumerate(zip(pairs.names(), pairs.pair, strict=True)):
                amplitude = pairs.strength[row] * pairs.transmit_legs.amplitude[i] * pairs.receive_legs.amplitude[j]
                found.setdefault(name, []).append(np.abs(amplitude[amplitude != 0]) ** 2)
        return {name: np.concatenate(parts) for name, parts in found.items()}

    some, sampled = energies(), 0
    monkeypatch.setattr("insonify.engines.eigenray_engine.MANY_CHANNELS", 1000)
    for name, every in energies().items():
        kept, fraction = some[name], len(some[name]) / len(every)
        if fraction == 1:
            np.testing.assert_array_equal(kept, every)
            continue
        error = np.sqrt(np.sum(every**2) * (1 / fraction - 1))
        assert name != ("D", "D") and abs(kept.sum() - every.sum()) < 4 * error < every.sum()
        sampled += 1
    assert sampled >= 4


@pytest.mark.parametrize("changes", [{"seabed": {"depth": 20.0}}, {"paths": {"geometry": "slice"}}])
def test_without_energy_fractions_all_pairs_are_evaluated(changes):
    """Over a flat bed in few channels, and in a slice: no keep probabilities."""
    simulator = build_simulator(scene(**changes))
    assert simulator.engine.family_keep_probabilities(simulator.ping_geometry(0), np.array([50.0])) is None


def test_a_single_pair_has_all_the_energy():
    """One family: its pair has all of what arrives with it, to 5 %, wherever anything is received within the window."""
    simulator = build_simulator(scene(paths={"max_reflections": 0}))
    here, bed = simulator.ping_geometry(0), simulator.engine.scene.seabed.terrain
    law = simulator.engine.scene.seabed.law(here.frequency, 1500.0)
    part = pair_energy_fractions(simulator.engine.scene, bed, here, ("D",), law)
    assert part.shape == (1, 1, RANGE_BINS) and part.min() >= 0
    np.testing.assert_allclose(part[0, 0, 20:48], 1.0, atol=0.05)


LAYERED = {"profile": [[0, 1510.0], [8, 1500.0], [20, 1480.0]], "smoothing": 1.0}


def test_sampled_pairs_of_layered_water_are_those_of_all_pairs():
    """Kept pairs have the strengths and legs of a run with all pairs, and the same energy: within 4 standard errors."""
    simulator, kept, whole, variance = build_simulator(scene(water=LAYERED)), {}, {}, {}
    here = simulator.ping_geometry(0)
    for block in simulator.engine.blocks(here):
        some, every = (simulator.engine.pairs(here, block, include_negligible=choice) for choice in (False, True))
        rows = {name: row for row, name in enumerate(every.names())}
        for row, (name, (i, j)) in enumerate(zip(some.names(), some.pair, strict=True)):
            a, b = every.pair[rows[name]]
            found = some.strength[row] * some.transmit_legs.amplitude[i] * some.receive_legs.amplitude[j]
            expected = every.strength[rows[name]] * every.transmit_legs.amplitude[a] * every.receive_legs.amplitude[b]
            there = (found != 0) & (expected != 0)
            weight = some.strength[row][there] / every.strength[rows[name]][there]
            np.testing.assert_allclose(found[there], weight * expected[there], rtol=1e-9)
            assert weight.min(initial=1.0) >= 1 - 1e-6
            kept[name] = kept.get(name, 0.0) + np.sum(np.abs(found) ** 2)
            whole[name] = whole.get(name, 0.0) + np.sum(np.abs(expected) ** 2)
            mean_weight = np.mean(weight**2) if there.any() else 1.0
            variance[name] = variance.get(name, 0.0) + np.sum(np.abs(expected) ** 4) * (mean_weight - 1)
    sampled = [name for name in kept if variance[name] > 0]
    assert len(sampled) >= 4 and kept["D", "D"] == pytest.approx(whole["D", "D"], rel=1e-12)
    for name in sampled:
        assert abs(kept[name] - whole[name]) < 4 * np.sqrt(variance[name]), name


def test_nearly_uniform_water_has_the_energies_of_uniform_water():
    """2 mm/s over the depth: fractions of all pairs by refracted rays are those by straight ones, to 1e-3."""
    fractions = []
    for speed in (1500.0, 1500.002):
        water = {"profile": [[0, 1500.0], [20, speed]]}
        simulator = build_simulator(scene(water=water))
        here, engine = simulator.ping_geometry(0), simulator.engine
        law = engine.scene.seabed.law(here.frequency, 1500.0)
        fractions.append(engine._energy_fractions(here, law)[1])
    assert fractions[0].shape[0] == 3
    np.testing.assert_allclose(fractions[1], fractions[0], atol=1e-3)


def test_pairs_by_other_families_count_where_no_direct_ray_arrives():
    """A gradient of 4 1/s, up: the last direct ray to the bed ends at 82 m, beyond it those by the surface dominate.

    A ray that is level at the bed leaves at arccos(1 - 9 m / R), R = c / g = 385 m, and reaches it after R sin.
    """
    water = {"profile": [[0, 1460.0], [20, 1540.0]]}
    simulator = build_simulator(scene(water=water, track={"window": (0.04, 0.2)}, paths={"max_reflections": 1}))
    here, engine = simulator.ping_geometry(0), simulator.engine
    families, fraction = engine._energy_fractions(here, engine.scene.seabed.law(here.frequency, 1540.0))
    edges, surface = _edges(here), families.index("S")
    radius = 1540.0 / 4.0
    last = radius * np.sin(np.arccos(1 - 9.0 / radius))
    before, beyond = edges[1:] < 0.95 * last, (edges[:-1] > 1.02 * last) & (edges[1:] < 1.3 * last)
    assert np.isfinite(fraction).all() and before.sum() > 10 and beyond.sum() >= 3
    assert (fraction[0, 0, before] > 0).all() and not fraction[0, 0, beyond].any()
    assert (fraction[surface, surface, beyond] > 0.5).all()
