"""Claims about strengths that are products of factors of legs, and about pairs evaluated at some scatterers only."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.records.legs import Legs
from insonify.records.pairs import Pairs, PairSampling, SeparableStrengths
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Scatterers

NAMES = ("D", "B", "S", "BS")


def legs(rng, families, count):
    """Legs of which nothing but the sine of the grazing angle counts, from before and from behind."""
    one, way = np.ones((families, count)), np.ones((families, count, 3))
    return Legs(
        NAMES[:families], (0,) * families, one, one, one, one, one + 0j, one.astype(np.uint8), one, way, way,
        rng.uniform(-1, 1, (families, count)), one.astype(np.uint8), one.astype(np.int16),
    )  # fmt: skip


def sampling(rng, pairs, count, stretches=7):
    """Pairs evaluated at 3 in 100 of the scatterers, at a third, at all of them and at none."""
    keep_probability = rng.choice(np.array([0, 0.03, 1 / 3, 1], np.float32), (pairs, stretches))
    range_bin = rng.integers(0, stretches, count).astype(np.uint8)
    return PairSampling(rng.uniform(0, 1, count).astype(np.float32), range_bin, keep_probability)


def product(seed, *, outs=2, backs=3, count=50, rows=5, some=True, alike=False):
    """A random product of so many legs out and back."""
    rng = np.random.default_rng(seed)
    out = legs(rng, outs, count)
    back = out if alike else legs(rng, backs, count)
    pair = np.indices((outs, outs if alike else backs)).reshape(2, -1).T.copy()
    return SeparableStrengths(
        out, back, pair, rng.uniform(0, 2, rows), rng.uniform(0.1, 3, count), rng.uniform(0.5, 2, len(pair)),
        sampling(rng, len(pair), count) if some else None,
    )  # fmt: skip


def written(one):
    """Strengths of a product, number by number."""
    made = np.zeros((len(one.pair), len(one.root_area)))
    sines = np.linspace(0, 1, len(one.direction_factor))
    for p, (i, j) in enumerate(one.pair):
        for n in range(len(one.root_area)):
            parts = [
                np.interp(abs(end.grazing_sine[k, n]), sines, one.direction_factor)
                for end, k in ((one.transmit_legs, i), (one.receive_legs, j))
            ]
            made[p, n] = np.sqrt(parts[0] * parts[1]) * one.root_area[n] * one.weight[p]
            if one.sampling is not None:
                keep_probability = float(one.sampling.keep_probability[p, one.sampling.range_bin[n]])
                made[p, n] *= 1 / np.sqrt(keep_probability) if one.sampling.priority[n] < keep_probability else 0
    return made


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 2**31), outs=st.integers(1, 4), backs=st.integers(1, 4), count=st.integers(0, 20),
    rows=st.integers(2, 6), some=st.booleans(), alike=st.booleans(),
)  # fmt: skip
def test_strengths_are_what_both_legs_contribute(seed, outs, backs, count, rows, some, alike):
    """Any legs, any table of what a direction contributes, thinned or not: float64, one by one, to 1e-6."""
    one = product(seed, outs=outs, backs=backs, count=count, rows=rows, some=some, alike=alike)
    assert one.strengths.shape == (len(one.pair), count)
    np.testing.assert_allclose(one.strengths, written(one), rtol=1e-6)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), rows=st.lists(st.integers(0, 5), max_size=8), some=st.booleans())
def test_some_of_the_pairs_are_those_rows_of_all(seed, rows, some):
    """In any order, some more than once, none: the same bits; and so are what is left of those."""
    whole, chosen = product(seed, some=some), np.array(rows, np.int64)
    part = whole.select(chosen)
    np.testing.assert_array_equal(part.strengths, whole.strengths[chosen])
    np.testing.assert_array_equal(
        part.select(np.arange(len(rows))[::-1].copy()).strengths, whole.strengths[chosen][::-1]
    )


@pytest.mark.parametrize("some", [True, False])
def test_out_and_back_of_a_product_may_be_exchanged(some):
    """A law of two factors is reciprocal: the pair turned round is as strong, to 1e-12."""
    one = product(1, some=some)
    other = replace(
        one,
        transmit_legs=one.receive_legs,
        receive_legs=one.transmit_legs,
        pair=np.ascontiguousarray(one.pair[:, ::-1]),
    )
    np.testing.assert_allclose(other.strengths, one.strengths, rtol=1e-12)


def test_strengths_grow_with_areas_and_weights():
    """Linear in the root of the area, in the weight of the pair, and in the factor, the root of two: bit for bit."""
    one = product(2)
    np.testing.assert_array_equal(replace(one, root_area=2 * one.root_area).strengths, 2 * one.strengths)
    np.testing.assert_array_equal(replace(one, weight=2 * one.weight).strengths, 2 * one.strengths)
    np.testing.assert_array_equal(replace(one, direction_factor=4 * one.direction_factor).strengths, 4 * one.strengths)


def test_what_is_not_weighed_is_weighed_by_one():
    """Weights of one are passed over: the same strengths as by weights of one bit more, to 1e-15."""
    one = replace(product(3), weight=np.ones(6))
    nearly = replace(one, weight=np.nextafter(np.ones(6), 2))
    np.testing.assert_allclose(nearly.strengths, one.strengths, rtol=1e-15)


@pytest.mark.parametrize("keep_probability", [1 / 32, 0.3, 1.0])
def test_the_mean_of_squares_over_all_numbers_is_that_of_all_scatterers(keep_probability):
    """Numbers k / 4096, each once: the sum of squares is as of no thinning; off by one number at most, and 1e-6."""
    count = 4096
    one = replace(product(4, count=count, some=False), root_area=np.ones(count))
    level = (
        replace(one.transmit_legs, grazing_sine=np.full((2, count), np.sin(0.7))),
        replace(one.receive_legs, grazing_sine=np.full((3, count), np.sin(0.4))),
    )
    one = replace(one, transmit_legs=level[0], receive_legs=level[1])
    number = np.random.default_rng(1).permutation(count).astype(np.float32) / count
    some = PairSampling(number, np.zeros(count, np.uint8), np.full((6, 1), keep_probability, np.float32))
    energy, whole = ((part.strengths**2).sum(axis=1) for part in (replace(one, sampling=some), one))
    np.testing.assert_allclose(energy, whole, rtol=1e-6 + 1 / count / keep_probability)


def test_fewer_are_evaluated_where_the_share_is_smaller():
    """Shares that grow: a scatterer that is evaluated stays evaluated, and is stronger the smaller the share.

    By its root, to 1e-6.
    """
    keep_probability = np.array([[0.04], [0.2], [0.6], [1.0]], np.float32)
    number = np.random.default_rng(2).uniform(0, 1, 3000).astype(np.float32)
    amplitude_weight = PairSampling(number, np.zeros(3000, np.uint8), keep_probability).amplitude_weight
    evaluated = amplitude_weight > 0
    assert (evaluated[1:] >= evaluated[:-1]).all() and evaluated[-1].all()
    for row, there, part in zip(amplitude_weight, evaluated, keep_probability[:, 0], strict=True):
        np.testing.assert_allclose(row[there], part**-0.5, rtol=1e-6)


def test_a_number_on_the_edge_of_a_share_is_not_evaluated():
    """Below, not at: a share of 0 includes not even the number 0, and a share of one all numbers below 1."""
    number = np.array([0.0, 0.25, np.nextafter(np.float32(1), np.float32(0))], np.float32)
    some = PairSampling(number, np.zeros(3, np.uint8), np.array([[0.0], [0.25], [1.0]], np.float32))
    np.testing.assert_array_equal(some.amplitude_weight > 0, [[False] * 3, [True, False, False], [True] * 3])


def block(strength, one):
    """Pairs of a block of points."""
    count = len(one.root_area)
    points = Scatterers(
        "seabed", "seabed", Lambert(-27.0), np.zeros((count, 3)), np.tile([0.0, 0.0, -1.0], (count, 1)),
        np.ones(count), np.ones(count, complex), np.arange(count, dtype=np.uint64),
    )  # fmt: skip
    return Pairs(points, one.transmit_legs, one.receive_legs, one.pair, strength)


def test_pairs_do_not_care_whether_their_strengths_are_written():
    """A product, or its strengths: the same names, strengths and parts."""
    one = product(5)
    made, given_ = block(one, one), block(one.strengths, one)
    rows = np.array([4, 0])
    assert made.names() == given_.names() and made.select(rows).rays() == given_.select(rows).rays() == [
        ("B", "B"),
        ("D", "D"),
    ]
    np.testing.assert_array_equal(made.strength, given_.strength)
    np.testing.assert_array_equal(made.select(rows).strength, given_.select(rows).strength)
