"""Claims about the keys that distinguish beams of different arrays, whatever their attitude."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.frames import mounting_rotation
from insonify.sonar import LineArray, PlanarArray, PointTransducer, beams

FREQUENCY, SPEED = 100e3, 1500.0
ARRAYS = [
    LineArray(length=1.0),
    LineArray(length=1.0, elements=32, steer=["-10 deg", 0, "10 deg"]),
    PlanarArray(width=0.4, height=0.1, steer="20 deg"),
    PointTransducer(),
]
KINDS = [array.kind for array in ARRAYS]


@pytest.mark.parametrize("array", ARRAYS, ids=KINDS)
@given(st.floats(-np.pi, np.pi), st.floats(-1.5, 1.5))
def test_turned_beams_are_the_same_beams(array, bearing, tilt):
    """Attitude is no part of the pattern: whatever is kept by it serves a sonar that rolls."""
    bare = beams(array, FREQUENCY, SPEED)
    turned = bare.rotated(mounting_rotation(bearing, tilt))
    assert turned.pattern_key == bare.pattern_key and hash(turned.pattern_key) == hash(bare.pattern_key)
    assert beams(array, FREQUENCY, SPEED, mounting_rotation(bearing, tilt)).pattern_key == bare.pattern_key


@pytest.mark.parametrize("array", ARRAYS, ids=KINDS)
def test_the_same_array_has_the_same_pattern_when_requested_again(array):
    """Two models of equal fields share their tables, and with them the pattern."""
    again = type(array)(**array.model_dump())
    assert beams(again, FREQUENCY, SPEED).pattern_key == beams(array, FREQUENCY, SPEED).pattern_key


@pytest.mark.parametrize(
    "changes", [{"steer": "5 deg"}, {"length": 1.1}, {"shading": "hann"}, {"elements": 32}, {"element": "cosine"}],
    ids=lambda changes: next(iter(changes)),
)  # fmt: skip
def test_another_steer_size_shading_or_element_is_another_pattern(changes):
    """Whatever changes a gain changes the pattern: nothing that is kept for one is given to the other."""
    one, other = (beams(LineArray(**{"length": 1.0, **more}), FREQUENCY, SPEED) for more in ({}, changes))
    angle = np.linspace(-1.4, 1.4, 301)
    way = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    assert not np.allclose(one.gain(way), other.gain(way), atol=1e-6)
    assert one.pattern_key != other.pattern_key


def test_another_frequency_is_another_pattern():
    """The same metres are more wavelengths."""
    one, other = (beams(LineArray(length=1.0), frequency, SPEED) for frequency in (100e3, 101e3))
    assert one.pattern_key != other.pattern_key


def test_one_beam_of_many_is_distinguished_from_the_others():
    """Each channel alone has a pattern of its own, and none has that of all."""
    fan = beams(ARRAYS[1], FREQUENCY, SPEED)
    keys = {fan.single_beam(channel).pattern_key for channel in range(3)}
    assert len(keys) == 3 and fan.pattern_key not in keys
    assert fan.single_beam(1).pattern_key == fan.single_beam(1).pattern_key


@pytest.mark.parametrize(
    "other", [*ARRAYS, PlanarArray(width=0.4, height=0.1, steer="21 deg")], ids=lambda one: one.kind
)
@pytest.mark.parametrize("array", ARRAYS, ids=KINDS)
def test_equal_beams_have_equal_gains_and_no_others_are_equal(array, other):
    """Beams of two arrays are equal where the arrays are, whether the fields of one were written or are defaults."""
    again = type(other)(**other.model_dump())
    one, two = (beams(some, FREQUENCY, SPEED) for some in (array, again))
    assert one.equals(two) == two.equals(one) == (array == other)
