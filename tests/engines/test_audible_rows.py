"""Claims about which rows of what is audible belong to which pair of legs, and what a run is told of shares ahead."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.engines.audible import LEAST, STRETCHES, Audible, largest_parts, shares_met
from insonify.propagation.families import families_for
from insonify.records.pairs import Thinned
from insonify.simulation import prepare
from oracles.scenes import nominal

NAMES = ("D", "B", "S", "BS")
ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}


def known(seed=1):
    """Four families and a table of shares whose every number is its own, for one place in each of 30 stretches."""
    share = (np.random.default_rng(seed).permutation(16 * 30) + 1).reshape(16, 30).astype(np.float32) / 500
    number, stretch = np.full(30, 1e-4, np.float32), np.arange(30).astype(np.uint8)
    return Audible(NAMES, np.ones((4, 30), bool), Thinned(number, stretch, share))


def row_of(heard, one, other):
    """Shares of one pair of families."""
    return heard.thinned.share[4 * NAMES.index(one) + NAMES.index(other)]


def scene(**more):
    """Rough ground, 30 to 90 m away."""
    return nominal(**{"seabed": ROUGH, "track": {"window": (0.04, 0.12)}, "paths": {"reflections": 2}, **more})


@given(st.lists(st.tuples(st.sampled_from(NAMES), st.sampled_from(NAMES)), max_size=20))
def test_each_pair_has_the_row_of_its_two_names(pairs):
    """Out first and back second, however many pairs, in any order, some more than once."""
    heard, out, back = known(), *(tuple(pair[k] for pair in pairs) for k in (0, 1))
    rows = heard.met(out, back)
    assert rows.louder.shape == (len(pairs), 30)
    for row, (one, other) in zip(rows.share, pairs, strict=True):
        np.testing.assert_array_equal(row, row_of(heard, one, other))


def test_the_way_out_is_told_from_the_way_back():
    """A pair and its twin have rows of their own, though shares make them alike."""
    heard = known()
    there, back = heard.met(("D",), ("B",)).share, heard.met(("B",), ("D",)).share
    assert (there != back).all()


def test_all_pairs_in_their_order_are_the_table_itself():
    """Nothing is copied where everything is asked for as it lies."""
    heard = known()
    out, back = (tuple(NAMES[k] for k in np.indices((4, 4))[axis].ravel()) for axis in (0, 1))
    assert np.shares_memory(heard.met(out, back).share, heard.thinned.share)
    assert not np.shares_memory(heard.met(out[::-1], back[::-1]).share, heard.thinned.share)


def test_glints_of_one_family_share_its_row():
    """A rough surface splits a family into several legs of one name: all are met where the family is."""
    heard = known()
    out, back = ("S", "S", "S", "D"), ("D", "S", "D", "S")
    rows = heard.met(out, back).share
    np.testing.assert_array_equal(rows[0], rows[2])
    np.testing.assert_array_equal(rows[1], row_of(heard, "S", "S"))
    np.testing.assert_array_equal(rows[3], row_of(heard, "D", "S"))


def test_a_pair_is_met_where_the_number_lies_below_its_share():
    """Over all places met, what is louder squared times the share is one; elsewhere nothing is heard."""
    number = np.linspace(0, 1, 1001)[:-1].astype(np.float32)
    share = np.array([[1.0, 0.3], [0.05, 1 / 32]], np.float32)
    stretch = np.repeat([0, 1], 500).astype(np.uint8)
    louder = Thinned(number, stretch, share).louder
    np.testing.assert_array_equal(louder > 0, number < share[:, stretch])
    np.testing.assert_allclose((louder**2 * share[:, stretch])[louder > 0], 1, rtol=1e-6)


def test_where_all_is_met_nothing_is_multiplied():
    """No table, no factor, whatever the pairs; and a family that is not followed has no row."""
    assert Audible(NAMES, None, None).met(("D", "D"), ("B", "S")) is None
    with pytest.raises(KeyError):
        known().met(("SBS",), ("D",))


@pytest.mark.parametrize("reflections", [1, 2])
def test_shares_told_ahead_are_those_of_the_scatterers(reflections):
    """Pairs met by all of a ping's scatterers, by their distances, are those that its blocks meet: to 2 %.

    Some 10 000 scatterers, of which one number each decides: its standard error is below 1 %.
    """
    listening = prepare(scene(paths={"reflections": reflections}))
    here = listening.stance(0)
    met = told = 0.0
    for block in listening.engine.blocks(here):
        points = block()
        heard = listening.engine._audible(here, points)
        distance = np.hypot(*(points.position[:, :2] - here.middle[:2]).T)
        families, share = listening.engine.met(here, distance)
        told += share.sum()
        met += len(heard.families) ** 2 * len(points) if heard.thinned is None else (heard.thinned.louder > 0).sum()
        assert families == families_for("seabed", listening.scenario.paths.followed)
    assert told == pytest.approx(met, rel=0.02)


def test_shares_lie_between_the_least_and_all():
    """Direct pairs everywhere, others from 1 in 32 upwards or, where a leg is not followed, nowhere; twins alike."""
    listening = prepare(scene(paths={"reflections": 4}))
    families, share = listening.engine.met(listening.stance(0), np.linspace(0, 300, 500))
    assert (share[0, 0] == 1).all() and share.max() <= 1
    assert ((share == 0) | (share >= LEAST)).all() and (share == 0).any() and (share == LEAST).any()
    np.testing.assert_array_equal(share, share.swapaxes(0, 1))
    assert share.shape == (len(families), len(families), 500)


def test_a_family_that_is_drowned_has_no_share():
    """Parts of a hundred-thousandth throughout: neither its own pairs nor those with others are met at any place."""
    listening = prepare(scene())
    here, families = listening.stance(0), ("D", "B", "S")
    part = np.full((3, 3, STRETCHES), 0.2)
    part[1], part[:, 1] = 1e-9, 1e-9
    share = shares_met(families, part, here, np.linspace(1, 100, 50))
    assert not share[1].any() and not share[:, 1].any() and (share[0, 2] == 1).all()


@pytest.mark.parametrize("changes", [{"seabed": {"depth": 20.0}}, {"paths": {"geometry": "slice"}}])
def test_where_nothing_is_known_all_is_met(changes):
    """Over a flat bed, and in a slice: no shares."""
    listening = prepare(scene(**changes))
    assert listening.engine.met(listening.stance(0), np.array([50.0])) is None


def test_what_is_alone_is_all_that_is_heard():
    """One family: its pair has all of what arrives with it, to 5 %, wherever anything is heard within the window."""
    listening = prepare(scene(paths={"reflections": 0}))
    here, bed = listening.stance(0), listening.engine.scene.seabed.bed
    law = listening.engine.scene.seabed.law(here.frequency, 1500.0)
    part = largest_parts(listening.engine.scene, bed, here, ("D",), law)
    assert part.shape == (1, 1, STRETCHES) and part.min() >= 0
    np.testing.assert_allclose(part[0, 0, 20:48], 1.0, atol=0.05)
