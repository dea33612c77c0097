"""Priorities and range bins of scatterers, and energy fractions of pairs, by other arithmetic."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.engines._pair_importance_kernel import assign_priorities, mark_sampled_families
from insonify.engines.pair_importance import (
    MIN_KEEP_PROBABILITY,
    RANGE_BINS,
    RANGE_MARGIN,
    _bin_lookup,
    _elevation_cells,
    _keep_probabilities,
    pair_energy_fractions,
)
from insonify.simulator import build_simulator
from oracles.scenes import nominal

ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}
EDGES = np.linspace(0, 1, RANGE_BINS + 1) ** 1.5
MASK = (1 << 64) - 1


def described(position, place, edges=EDGES, middle=(0.0, 0.0), word=12345):
    """Stretches and numbers of some positions, least and greatest stretch."""
    stretch, number = np.empty(len(place), np.uint8), np.empty(len(place), np.float32)
    first = _bin_lookup()
    ends = assign_priorities(
        np.asarray(position, float), *middle, edges, first, place, np.uint64(word), stretch, number
    )
    return stretch, number, ends


def split_mix(word):
    """SplitMix64's output function, in whole numbers of any size."""
    word = ((word ^ (word >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    word = ((word ^ (word >> 27)) * 0x94D049BB133111EB) & MASK
    return word ^ (word >> 31)


@pytest.mark.parametrize("farthest", [0.01, 1.0, 333.3, 1e5])
def test_each_position_lies_in_the_range_bin_that_holds_it(farthest):
    """On edges, a hair before and after them, anywhere, beyond the last: as found by looking through all edges."""
    edges, rng = farthest * EDGES, np.random.default_rng(1)
    distance = np.concatenate([
        edges, np.nextafter(edges, 0), np.nextafter(edges, np.inf), farthest * rng.uniform(0, 1.2, 3000), [0, 1e9],
    ])  # fmt: skip
    position = np.stack([distance, 0 * distance, distance], axis=1)
    stretch, _, ends = described(position, np.arange(len(distance), dtype=np.uint64), edges)
    known = np.clip(np.searchsorted(edges, distance, side="right") - 1, 0, RANGE_BINS - 1)
    np.testing.assert_array_equal(stretch, known)
    assert ends == (known.min(), known.max())


def test_no_position_at_all_has_no_range_bin():
    """None: nothing is written and the least is beyond the greatest; one position: it is both."""
    assert described(np.empty((0, 3)), np.empty(0, np.uint64))[2] == (RANGE_BINS - 1, 0)
    stretch, _, ends = described([[0.5, 0.0, 3.0]], np.ones(1, np.uint64))
    assert ends == (stretch[0], stretch[0])


@settings(max_examples=50, deadline=None)
@given(place=st.lists(st.integers(0, MASK), max_size=30), word=st.integers(0, MASK))
def test_a_priority_is_the_hash_of_the_scatterer_id(place, word):
    """24 bits of SplitMix64 of scatterer id and key, from 0 up to but not including 1, bit for bit."""
    keys = np.array(place, np.uint64)
    _, number, _ = described(np.zeros((len(place), 2)), keys, word=word)
    assert number.tolist() == [(split_mix(one ^ word) >> 40) / 2**24 for one in place]
    assert (number < 1).all()


def test_priorities_do_not_depend_on_the_selection():
    """In any order and selection, from any origin: bit-identical priority, and range bin at the same distance."""
    rng = np.random.default_rng(2)
    place = rng.integers(0, 2**63, 2000).astype(np.uint64)
    position = rng.uniform(-1, 1, (2000, 3))
    stretch, number, _ = described(position, place)
    some = rng.permutation(2000)[:700]
    np.testing.assert_array_equal(described(position[some], place[some])[0], stretch[some])
    np.testing.assert_array_equal(described(position[some] + 5, place[some])[1], number[some])
    moved = described(position * [1, -1, 1] + [4, -2, 0], place, middle=(4.0, -2.0))[0]
    assert (moved != stretch).mean() < 1e-3


def test_two_seeds_select_different_scatterers():
    """Numbers of one position by two keys have nothing in common: |correlation| below 4 / sqrt(N), N = 20 000; even."""
    place = np.arange(20_000, dtype=np.uint64)
    one, other = (described(np.zeros((20_000, 2)), place, word=word)[1].astype(float) for word in (1, 2))
    assert abs(np.corrcoef(one, other)[0, 1]) < 4 / np.sqrt(20_000)
    assert abs(one.mean() - 0.5) < 4 * np.sqrt(1 / 12 / 20_000)
    assert abs(np.corrcoef(one[1:], one[:-1])[0, 1]) < 4 / np.sqrt(20_000)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), count=st.integers(0, 40), families=st.integers(1, 5))
def test_a_family_is_needed_where_its_number_is_low_enough(seed, count, families):
    """Number below the largest keep probability of the stretch, one by one."""
    rng = np.random.default_rng(seed)
    number, stretch = rng.integers(0, 5, count).astype(np.float32) / 4, rng.integers(0, 3, count).astype(np.uint8)
    share, needed = rng.integers(0, 5, (families, 3)).astype(np.float32) / 4, np.empty((families, count), bool)
    mark_sampled_families(number, stretch, share, needed)
    assert needed.tolist() == [[bool(number[n] < row[stretch[n]]) for n in range(count)] for row in share]


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), families=st.integers(1, 4))
def test_more_of_a_pair_is_no_smaller_keep_probability(seed, families):
    """Keep probabilities are between the least and one, alike for twins, and grow with what a pair has of all."""
    part = 10 ** np.random.default_rng(seed).uniform(-6, 0, (families, families, RANGE_BINS))
    share, more = _keep_probabilities(part), _keep_probabilities(1.5 * part)
    assert (share >= MIN_KEEP_PROBABILITY).all() and (share <= 1).all() and (more >= share).all()
    np.testing.assert_array_equal(share, share.swapaxes(0, 1))
    np.testing.assert_array_equal(_keep_probabilities(part[:, :, ::-1]), share[:, :, ::-1])


def sonar(sent=0.0, received=0.0, **more):
    """A point that sends and a point that receives, each so much below 11 m, over rough ground up to 90 m away."""
    one = {"kind": "point", "length": None, "element": "omni"}
    simulator = build_simulator(nominal(**{
        "seabed": ROUGH, "track": {"window": (0.04, 0.12)}, "line": one,
        "transmit": {"offset": (0.0, 0.0, sent)}, "receive": {"offset": (0.0, 0.0, received)}, **more,
    }))  # fmt: skip
    return simulator, simulator.ping_geometry(0)


def parts(simulator, here, families):
    """Of `pair_energy_fractions`."""
    seabed = simulator.engine.scene.seabed
    return pair_energy_fractions(
        simulator.engine.scene, seabed.terrain, here, families, seabed.law(here.frequency, 1500.0)
    )


@pytest.mark.parametrize("sea", [{}, {"reflection": "statistical", "wind_speed": 4.0}])
def test_a_flat_bed_has_the_fractions_of_relief_without_height(sea):
    """Three families, two depths, smooth sea or waves: relief a nanometre high changes no fraction by 1e-6."""
    families = ("D", "S", "BS")
    flat, level = (
        parts(*sonar(-6.0, 5.0, seabed={"depth": 20.0, **relief}, surface=sea), families)
        for relief in ({}, {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 1e-9}})
    )
    assert flat.shape == (3, 3, RANGE_BINS) and (flat[0, :2, 20:40] > 0).all()
    np.testing.assert_allclose(flat, level, rtol=1e-6)


@pytest.mark.parametrize(("sent", "received"), [(0.0, 0.0), (-6.0, 5.0), (7.0, -9.0)])
def test_parts_are_those_of_the_sonar_equation(sent, received):
    """Direct and by the surface, Lambert's law, all directions, two depths: images and overlaps in time, to 3 %."""
    simulator, here = sonar(sent, received)
    found = parts(simulator, here, ("D", "S"))
    speed, loss = here.sound_speed, float(simulator.engine.scene.water.absorption(here.frequency))
    edges = RANGE_MARGIN * speed * here.recorded_delays[1] / 2 * EDGES
    middle = (edges[1:] + edges[:-1]) / 2
    climb = {(end, sign): 20 - sign * (11 + more) for end, more in ((0, sent), (1, received)) for sign in (1, -1)}
    energy, late = {}, {}
    for one in (1, -1):
        for other in (1, -1):
            ways = [np.hypot(middle, climb[0, one]), np.hypot(middle, climb[1, other])]
            sines = climb[0, one] * climb[1, other] / ways[0] / ways[1]
            left = np.prod([10 ** (-loss * way / 10) / way**2 for way in ways], axis=0)
            late[one, other] = (np.hypot(edges, climb[0, one]) + np.hypot(edges, climb[1, other])) / speed
            within = late[one, other][:-1] < here.recorded_delays[1]
            energy[one, other] = sines * left * middle * np.diff(edges) * within
    for row, one in enumerate((1, -1)):
        for column, other in enumerate((1, -1)):
            whole = np.zeros(RANGE_BINS)
            for k in range(RANGE_BINS):
                start, stop = late[one, other][k : k + 2]
                for pair, own in late.items():
                    shared = np.minimum(own[1:], stop) - np.maximum(own[:-1], start)
                    whole[k] += np.sum(energy[pair] * np.maximum(shared, 0) / np.diff(own))
            known = energy[one, other] / np.maximum(whole, 1e-300)
            strong = (energy[one, other] > 0) & (np.arange(RANGE_BINS) > 8)
            np.testing.assert_allclose(found[row, column][strong], known[strong], rtol=0.03)


@pytest.mark.parametrize(("sent", "received"), [(-6.0, 5.0), (0.0, 8.0)])
def test_parts_of_exchanged_ends_are_the_pairs_turned_round(sent, received):
    """D out and S back is S out and D back from the other end, 1e-9; at two depths these differ."""
    families = ("D", "B", "S", "BS")
    one, other = (parts(*sonar(*ends), families) for ends in ((sent, received), (received, sent)))
    np.testing.assert_allclose(other, one.swapaxes(0, 1), rtol=1e-9)
    assert np.abs(one[0, 2, 20:40] / one[2, 0, 20:40] - 1).max() > 0.01
    level = parts(*sonar(sent, sent), families)
    np.testing.assert_allclose(level, level.swapaxes(0, 1), rtol=1e-9)


def test_parts_do_not_depend_on_bearings_or_levels():
    """Lines of a narrow beam turned to another heading, and 20 dB more of source level: the same parts.

    To 0.02 of all that arrives, beyond the first few metres: which bearings are evaluated turns with the beams.
    """
    line = {"kind": "line", "length": 0.5, "element": "baffled"}
    fractions = [
        parts(*sonar(line=line, **more), ("D", "B", "S"))
        for more in ({}, {"track": {"window": (0.04, 0.12), "heading": 1.3}}, {"sonar": {"source_level_db": 200}})
    ]
    for other in fractions[1:]:
        np.testing.assert_allclose(other[..., 8:], fractions[0][..., 8:], atol=0.02)


def test_as_many_elevations_as_an_upright_array_is_long_are_resolved():
    """One for beams and for a line abeam; half a wavelength apart upright, one for each element at most."""
    wave = 1500.0 / 100e3
    elements = {"receiver": {"bandwidth": 8e3, "record": "elements"}}

    def apart(places):
        array = {"kind": "elements", "length": None, "element": "omni", "positions": places}
        return _elevation_cells(sonar(receive=array, sonar=elements)[1])

    assert _elevation_cells(sonar()[1]) == 1
    assert apart([(0.0, 0.0, k * wave / 2) for k in range(6)]) == pytest.approx(6, rel=0.01)
    assert apart([(0.0, 0.0, k * wave / 4) for k in range(9)]) == pytest.approx(5, rel=0.01)
    assert apart([(0.0, 0.0, k * wave) for k in range(6)]) == 6
    assert apart([(0.0, k * wave / 2, 0.0) for k in range(6)]) == pytest.approx(1, abs=1e-6)
