"""Laws of frames, units and random streams that hold whatever the numbers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify import random_keys
from insonify.frames import array_axes, direction, mounting_rotation, pose_rotation
from insonify.units import UNITS, amplitude_ratio, decibels, intensity_ratio, level_db, si

ANGLE = st.floats(-3, 3)
LEAN = st.floats(-1.5, 1.5)


@given(ANGLE, ANGLE, LEAN, ANGLE)
def test_headings_add_up(first, second, pitch, roll):
    """A ship that leans, on a turntable: turning the world adds to the heading and to nothing else."""
    turned = pose_rotation(first) @ pose_rotation(second, pitch, roll)
    np.testing.assert_allclose(turned, pose_rotation(first + second, pitch, roll), atol=1e-12)


@given(ANGLE, LEAN, ANGLE)
def test_a_pose_is_read_back_from_its_axes(heading, pitch, roll):
    """Heading and pitch from the bow, roll from the depths of starboard and keel."""
    axes = pose_rotation(heading, pitch, roll)
    np.testing.assert_allclose(axes[:, 0], direction(heading, -pitch), atol=1e-12)
    assert np.arctan2(axes[2, 1], axes[2, 2]) == pytest.approx(roll, abs=1e-9)


@given(ANGLE, ANGLE, LEAN)
def test_a_level_ship_may_turn_or_its_array_may(heading, bearing, tilt):
    """Heading and mounting bearing add up where the deck is level, and tilt is the elevation of boresight."""
    axes = array_axes(pose_rotation(heading), mounting_rotation(bearing, tilt))
    np.testing.assert_allclose(axes, array_axes(np.eye(3), mounting_rotation(heading + bearing, tilt)), atol=1e-12)
    np.testing.assert_allclose(axes[0], direction(heading + bearing, tilt), atol=1e-12)
    assert axes[1, 2] == pytest.approx(0, abs=1e-12)  # "right" stays level


@given(ANGLE, LEAN)
def test_pitching_down_is_tilting_an_array_that_looks_ahead(heading, angle):
    """Bow down by an angle, or the array tilted down by it: the same axes."""
    pitched = array_axes(pose_rotation(heading, -angle), mounting_rotation(0.0))
    np.testing.assert_allclose(pitched, array_axes(pose_rotation(heading), mounting_rotation(0.0, angle)), atol=1e-12)


@given(ANGLE, LEAN, ANGLE)
def test_the_mirror_ship_has_the_mirror_axes(heading, pitch, roll):
    """Heading and roll change sign in the plane of north and down; pitch does not."""
    mirror = np.diag([1.0, -1.0, 1.0])
    image = mirror @ pose_rotation(heading, pitch, roll) @ mirror
    np.testing.assert_allclose(pose_rotation(-heading, pitch, -roll), image, atol=1e-12)


@given(st.floats(-1e6, 1e6, allow_subnormal=False), st.sampled_from(sorted(UNITS)), st.data())
@settings(max_examples=100)
def test_a_number_written_in_a_unit_and_its_base_agree(number, dimension, data):
    """Any number as Python writes it, exponents too, in any unit; a space more or less does not matter."""
    unit = data.draw(st.sampled_from(sorted(UNITS[dimension])))
    size = UNITS[dimension][unit]
    assert si(f"{number!r} {unit}", dimension) == si(f"  {number!r}{unit} ", dimension) == number * size
    base = next(iter(UNITS[dimension]))
    assert UNITS[dimension][base] == 1.0 and si(f"{number!r}", dimension) == si(f"{number!r} {base}", dimension)


@pytest.mark.parametrize(
    ("one", "other", "dimension"),
    [("1 km", "100000 cm", "length"), ("1 ft", "304.8 mm", "length"), ("60 s", "1 min", "time"),
     ("1 MHz", "1000 kHz", "frequency"), ("36 km/h", "10 m/s", "speed"), ("1 kn", "1.852 km/h", "speed"),
     ("1 deg", f"{1000 * np.pi / 180!r} mrad", "angle"), ("3600 deg/h", "1 deg/s", "turn rate")],
)  # fmt: skip
def test_units_stand_to_one_another_as_defined(one, other, dimension):
    """Definitions: the international foot and knot among them."""
    assert si(one, dimension) == pytest.approx(si(other, dimension), rel=1e-14)


@pytest.mark.parametrize("value", [None, True, 3, 2.5, (1, 2), {"a": 1}])
def test_what_is_no_text_is_handed_on(value):
    """Numbers are SI and decibels already; other things are for others to refuse."""
    assert si(value, "length") is value and decibels(value) is value


@pytest.mark.parametrize("text", ["", " ", "m", "1e", "--3 m", "1,5 m", "nan m", "0x10 m", "one m", ".", "1.2.3 m"])
def test_what_is_no_number_is_refused_with_an_example(text):
    """The message shows how a length is written."""
    with pytest.raises(ValueError, match=r"1\.5 m|not a unit of length"):
        si(text, "length")


@given(st.floats(1e-12, 1e12), st.floats(1e-12, 1e12))
def test_levels_add_where_powers_multiply(one, other):
    """Logarithms: and the intensity ratio is the square of the pressure ratio."""
    total = level_db(one) + level_db(other)
    assert level_db(one * other) == pytest.approx(total, abs=1e-9)
    assert intensity_ratio(total) == pytest.approx(one * other, rel=1e-9)
    assert amplitude_ratio(total) ** 2 == pytest.approx(intensity_ratio(total), rel=1e-12)


@given(st.lists(st.integers(0, 2**32 - 1), min_size=4, max_size=4), st.integers(0, 127))
@settings(max_examples=60)
def test_one_bit_of_a_counter_changes_half_of_the_draw(counters, bit):
    """Avalanche: of 128 bits 64 change, 30 to 98 in all cases (six standard deviations of 5.66)."""
    changed = list(counters)
    changed[bit // 32] ^= 1 << bit % 32
    words = [random_keys.philox(*c, *random_keys.stream_key(7, random_keys.SEABED)) for c in (counters, changed)]
    flipped = sum(int(a ^ b).bit_count() for a, b in zip(*words, strict=True))
    assert 30 <= flipped <= 98


def test_no_counter_stands_for_another():
    """Swapped counters, and a negative first one beside its complement in the others, have draws of their own."""
    counters_of = [(1, 2, 3, 4), (2, 1, 3, 4), (1, 3, 2, 4), (1, 2, 4, 3), (4, 3, 2, 1), (-1, 0, 0, 0), (0, -1, 0, 0)]
    draws = np.array([random_keys.uniforms(1, random_keys.TARGET, *counters) for counters in counters_of])
    assert len(np.unique(draws)) == draws.size
    np.testing.assert_array_equal(draws[5], random_keys.uniforms(1, random_keys.TARGET, 2**32 - 1, 0, 0, 0))


def test_samples_late_in_a_run_are_no_repetition():
    """Beyond 2^33 samples the low words of the counter come round; the noise does not."""
    late = random_keys.complex_normals(1, random_keys.NOISE, 0, 0, 64, start=2**33)
    early = random_keys.complex_normals(1, random_keys.NOISE, 0, 0, 64)
    assert np.abs(late - early).min() > 0
    np.testing.assert_array_equal(
        late[7:], random_keys.complex_normals(1, random_keys.NOISE, 0, 0, 57, start=2**33 + 7)
    )


def test_seeds_are_whole_and_of_64_bits():
    """The last seed is one; numpy's whole numbers do; the next is refused with the range."""
    assert random_keys.stream_key(2**64 - 1, 1) != random_keys.stream_key(0, 1)
    assert random_keys.stream_key(np.int64(5), 1) == random_keys.stream_key(5, 1)
    for seed in (-1, 2**64):
        with pytest.raises(ValueError, match="from 0 to 2"):
            random_keys.complex_normals(seed, random_keys.NOISE, 0, 0, 1)
    assert random_keys.complex_normals(1, random_keys.NOISE, 0, 0, 0).shape == (0,)
