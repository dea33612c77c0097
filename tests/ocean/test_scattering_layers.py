"""Claims about layers of water that scatter: the column holds what was written, down to wherever the water ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from insonify.ocean.scattering_layers import ScatteringPatch, layer_columns
from insonify.ocean.water import Water

DEPTHS = st.lists(st.integers(0, 400), min_size=1, max_size=6, unique=True).map(sorted)
STRENGTHS = st.lists(st.none() | st.floats(-110, -20), min_size=6, max_size=6)


def at(rows, depth):
    """Strength that the row above a depth states [1/m], by looking down the list."""
    found = 0.0
    for top, strength in rows:
        if top < depth:
            found = 0.0 if strength is None else 10 ** (strength / 10)
    return found


@given(DEPTHS, STRENGTHS, st.floats(0.5, 500), st.lists(st.floats(0.01, 1), min_size=5, max_size=5))
def test_every_depth_scatters_as_the_row_above_it_states(depths, strengths, deepest, parts):
    """At any depth of the water exactly the strength of the last row above, and nothing where that is null."""
    rows = tuple(zip(map(float, depths), strengths, strict=False))
    layers = layer_columns(rows, deepest)
    for depth in (part * deepest for part in parts):
        if any(depth == top for top, _ in rows):
            continue
        held = layers[(layers[:, 0] < depth) & (layers[:, 1] >= depth), 2]
        assert len(held) <= 1
        assert held.sum() == pytest.approx(at(rows, depth), rel=1e-12)


@given(DEPTHS, STRENGTHS, st.floats(0.5, 500))
def test_layers_lie_in_order_within_the_water(depths, strengths, deepest):
    """No layer overlaps another, begins above the surface, ends below the bottom or has no height."""
    layers = layer_columns(tuple(zip(map(float, depths), strengths, strict=False)), deepest)
    assert layers.shape[1] == 3
    assert (layers[:, 1] > layers[:, 0]).all() and (layers[1:, 0] >= layers[:-1, 1]).all()
    assert (layers[:, :2] >= 0).all() and (layers[:, 1] <= deepest).all() and (layers[:, 2] > 0).all()


@given(st.floats(-110, -20), st.floats(1, 1000))
def test_one_strength_is_one_row_from_the_surface(strength, deepest):
    """A number alone, and a row at 0 m, are the same water."""
    np.testing.assert_array_equal(layer_columns(strength, deepest), layer_columns(((0.0, strength),), deepest))
    np.testing.assert_allclose(layer_columns(strength, deepest), [[0, deepest, 10 ** (strength / 10)]])


@given(DEPTHS, STRENGTHS, st.floats(10, 400), st.floats(0.01, 0.99))
def test_a_row_may_be_written_twice(depths, strengths, deepest, part):
    """A layer cut in two by a row of the same strength scatters as the whole does, metre for metre."""
    rows = tuple(zip(map(float, depths), strengths, strict=False))
    cut = depths[-1] + part * 50.0
    twice = (*rows, (cut, rows[-1][1]))
    whole, has_parallax = (layer_columns(one, deepest) for one in (rows, twice))
    columns = [float((np.diff(one[:, :2], axis=1)[:, 0] * one[:, 2]).sum()) for one in (whole, has_parallax)]
    assert columns[0] == pytest.approx(columns[1], rel=1e-9, abs=1e-300)


def test_clear_water_scatters_nothing():
    """No strength, rows of null, and rows below the bottom: no layer at all."""
    for written in (None, ((0.0, None),), ((30.0, -60.0),)):
        assert layer_columns(written, 20.0).shape == (0, 3)
    assert not Water().scatters and Water(volume_strength_db=-70).scatters


@pytest.mark.parametrize(("change", "word"), [
    ({"size": (1.0, 0.0, 1.0)}, "size"), ({"position": (0.0, 0.0, -1.0)}, "position"),
    ({"volume_strength_db": 10.0}, "volume_strength_db"), ({"form": "cone"}, "form"),
    ({"size": (1.0, float("nan"), 1.0)}, "size"), ({"position": (0.0, float("inf"), 5.0)}, "position"),
])  # fmt: skip
def test_a_patch_that_cannot_be_is_refused(change, word):
    """Flat, above the sea, stronger than a wall, of no known form, nowhere: the field that is wrong is named."""
    good = {"position": (0.0, 30.0, 10.0), "size": (2.0, 2.0, 1.0), "volume_strength_db": -40.0}
    with pytest.raises(ValidationError, match=word):
        ScatteringPatch(**{**good, **change})
    ScatteringPatch(**good)
