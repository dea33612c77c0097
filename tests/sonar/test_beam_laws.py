"""Laws that every beam satisfies, whatever its array: scale, mirror, energy, period, product."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.frames import direction, pose_rotation
from insonify.sonar import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import beams
from insonify.sonar.two_way_beam import MAX_WIDTH, two_way_footprint, two_way_width

FREQUENCY, SPEED = 100e3, 1500.0
WAVELENGTH = SPEED / FREQUENCY
OMNI = beams(PointTransducer(), FREQUENCY, SPEED)
# Mean square over squared mean of the weight, Harris (1978), table 1: 1.00, 1.23, 1.50, 1.36.
SHADINGS = {"uniform": 1.0, "cosine": np.pi**2 / 8, "hann": 1.5, "hamming": (0.54**2 + 0.46**2 / 2) / 0.54**2}


def line(wavelengths, **changes):
    """Beams of a line so many wavelengths long, in its own frame."""
    return beams(LineArray(length=wavelengths * WAVELENGTH, **changes), FREQUENCY, SPEED)


def everywhere(count=300, seed=1):
    """Unit vectors in all directions, shape (count, 3)."""
    vector = np.random.default_rng(seed).normal(size=(count, 3))
    return vector / np.linalg.norm(vector, axis=1, keepdims=True)


def ahead(right):
    """Unit vectors level with the array, from sines to the right."""
    right = np.asarray(right, float)
    return np.stack([np.sqrt(1 - right**2), right, np.zeros_like(right)], axis=-1)


@given(st.floats(0.1, 20), st.sampled_from(list(SHADINGS)), st.sampled_from(["omni", "baffled", "cosine"]))
@settings(max_examples=20, deadline=None)
def test_only_the_length_in_wavelengths_counts(factor, shading, element):
    """An array and a frequency scaled together have the same beam, and so has another speed of sound."""
    values = {"shading": shading, "element": element, "steer": [0.3]}
    one = beams(LineArray(length=0.2, **values), FREQUENCY, SPEED).gain(everywhere())
    scaled = beams(LineArray(length=0.2 * factor, **values), FREQUENCY / factor, SPEED).gain(everywhere())
    slower = beams(LineArray(length=0.2, **values), FREQUENCY * factor, SPEED * factor).gain(everywhere())
    np.testing.assert_allclose(scaled, one, atol=1e-9)
    np.testing.assert_allclose(slower, one, atol=1e-9)


@pytest.mark.parametrize("element", ["omni", "baffled", "cosine", "piston"])
@pytest.mark.parametrize("elements", [None, 9])
def test_a_beam_steered_the_other_way_is_the_mirror_image(element, elements):
    """Right and left change places with the sign of the steer."""
    values = {"element": element, "elements": elements, "shading": "hann"}
    there, mirror = line(5, steer=[0.4], **values), line(5, steer=[-0.4], **values)
    np.testing.assert_allclose(mirror.gain(everywhere() * [1, -1, 1]), there.gain(everywhere()), atol=1e-12)


def test_a_line_responds_to_all_directions_of_a_cone_alike():
    """Turning about the line itself changes nothing for elements without direction."""
    turn = np.linspace(0, 2 * np.pi, 60)
    for right in (-0.8, 0.0, 0.35):
        level = np.sqrt(1 - right**2)
        ring = np.stack([level * np.cos(turn), np.full(60, right), level * np.sin(turn)], axis=-1)
        gain = line(7, element="omni", steer=[0.3]).gain(ring)[0]
        assert np.ptp(gain) < 1e-12


@pytest.mark.parametrize("steer", [0.0, 0.2, -0.9, 1.3])
@pytest.mark.parametrize("elements", [1, 2, 8, 25])
def test_half_a_wavelength_apart_elements_gain_their_number(elements, steer):
    """Mean power over the sphere is exactly 1 / N at half-wavelength pitch, wherever the line is steered.

    The cross terms are sinc(2 d / wavelength (m - n)) and vanish: Urick (1983), ch. 3 (not verified).
    """
    array = line(elements / 2, elements=elements, element="omni", steer=[steer])
    node, weight = np.polynomial.legendre.leggauss(120)  # a line's sphere is even in the sine to the right
    assert array.gain(ahead(node))[0] ** 2 @ weight / 2 == pytest.approx(1 / elements, rel=1e-6)


@pytest.mark.parametrize("shading", SHADINGS)
def test_shading_widens_the_beam_by_its_noise_bandwidth(shading):
    """Parseval: one-way energy width = wavelength / L times mean square over squared mean of the weight.

    Tolerance: side lobes beyond 90 deg, and azimuth against its sine, 1 % for 100 wavelengths.
    """
    width = two_way_footprint(line(100, shading=shading), OMNI)[0]
    assert width == pytest.approx(SHADINGS[shading] / 100, rel=1e-2)
    if shading != "uniform":  # side lobes fall so fast that the sum is exact
        assert width == pytest.approx(SHADINGS[shading] / 100, rel=2e-4)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8, 1.0])
def test_unequal_lines_have_their_closed_form(share):
    """Integral of sinc^2(a x) sinc^2(b x) dx = (1 - b / 3a) / a for b below a: Parseval with two triangles."""
    width = two_way_footprint(line(80), line(80 * share))[0]
    assert width == pytest.approx((1 - share / 3) / 80, rel=1e-3)


def test_a_beam_repeats_where_its_elements_are_in_step_again():
    """With omnidirectional elements two wavelengths apart, half a unit of sine further the gain is the same."""
    sparse = line(20, elements=10, element="omni", shading="hamming")
    right = np.linspace(-0.99, 0.49, 400)
    np.testing.assert_allclose(np.abs(sparse.gain(ahead(right + 0.5))), np.abs(sparse.gain(ahead(right))), atol=3e-7)


@given(st.floats(0.5, 30), st.floats(0.5, 30))
@settings(max_examples=15, deadline=None)
def test_a_panel_is_a_line_across_times_a_line_down(across, down):
    """Product theorem, for elements that receive all round."""
    panel = PlanarArray(width=across * WAVELENGTH, height=down * WAVELENGTH, element="omni", shading="hann")
    way = everywhere()
    expected = line(across, element="omni", shading="hann").gain(way) * line(down, element="omni").gain(
        way[:, [0, 2, 1]]
    )
    np.testing.assert_allclose(beams(panel, FREQUENCY, SPEED).gain(way), expected, atol=1e-12)


def test_one_beam_of_a_fan_is_that_beam_alone():
    """Picked out of the fan, or steered there by itself: the same gain, bound and width."""
    fan = line(30, steer=[-0.5, 0.0, 0.7])
    for channel, steer in enumerate((-0.5, 0.0, 0.7)):
        alone, way = line(30, steer=[steer]), everywhere()
        np.testing.assert_allclose(fan.single_beam(channel).gain(way)[0], fan.gain(way)[channel], rtol=0, atol=0)
        np.testing.assert_allclose(alone.gain(way)[0], fan.gain(way)[channel], atol=2e-7)
        assert two_way_footprint(fan, fan)[channel] == pytest.approx(two_way_footprint(alone, alone)[0], rel=1e-5)


@given(st.lists(st.integers(0, 36), min_size=1, max_size=12))
def test_a_subset_has_the_gains_of_its_channels(channels):
    """Any channels of a fan of 37, in any order, some more than once: bit for bit the rows of the whole fan."""
    steer = tuple(np.linspace(-1.0, 1.0, 37))
    fan = beams(PlanarArray(width=0.3, height=0.02, steer=steer, shading="hann"), FREQUENCY, SPEED)
    some, way = fan.subset(np.array(channels)), everywhere()
    assert some.channel_count == len(channels)
    np.testing.assert_array_equal(some.gain(way), fan.gain(way)[channels])
    assert some.pattern_key == fan.subset(np.array(channels)).pattern_key


def test_a_single_beam_serves_every_channel():
    """Beside a fan, the one transmit beam is requested by any number."""
    one = line(3)
    assert one.single_beam(7).channel_count == 1
    np.testing.assert_array_equal(one.single_beam(7).gain(everywhere()), one.gain(everywhere()))


@given(st.floats(-np.pi, np.pi), st.floats(-1.5, 1.5), st.floats(-np.pi, np.pi))
@settings(max_examples=30, deadline=None)
def test_a_turned_array_receives_turned_sound_alike(heading, pitch, roll):
    """Turned there and back the beams are as they were; turned, they receive what is turned with them."""
    axes = pose_rotation(heading, pitch, roll)
    own, way = line(6, steer=[0.3], element="cosine"), everywhere(50)
    there = own.rotated(axes.T)
    np.testing.assert_allclose(there.gain(way @ axes.T), own.gain(way), atol=1e-9)
    np.testing.assert_array_equal(there.rotated(np.eye(3)).gain(way), own.gain(way))


@pytest.mark.parametrize("array", [line(12, steer=[0.4]), line(12, elements=6, element="omni"), OMNI])
def test_the_bound_grows_with_its_margin_and_starts_at_the_gain(array):
    """A wider cone holds at least as much; a cone of no width holds the gain; all directions hold the axis."""
    way = everywhere()
    bound = np.array([array.bound(way, margin) for margin in (0.0, 0.01, 0.1, 0.5, np.pi)])
    assert np.all(np.diff(bound, axis=0) >= -1e-12)
    assert np.all(bound[0] >= np.abs(array.gain(way)).max(axis=0) - 1e-9)
    assert np.all(bound[-1] >= 1 - 1e-7)


@pytest.mark.parametrize("steer", [0.0, 0.3, 0.8])
def test_width_goes_as_one_over_length_and_does_not_mind_the_side(steer):
    """Twice the length is half the width; starboard and port steers are as wide."""
    short, long = (two_way_width(line(n, steer=[steer]), line(n, steer=[steer])) for n in (60, 120))
    assert short == pytest.approx(2 * long, rel=3e-3)
    assert two_way_width(line(60, steer=[-steer]), line(60, steer=[-steer])) == pytest.approx(short, rel=1e-9)


def test_two_beams_are_narrower_than_either():
    """Two-way widths shrink from the open water to one beam to two: cap, 0.886 and 0.638 wavelength / length."""
    one, both = two_way_width(line(50), OMNI), two_way_width(line(50), line(50))
    assert two_way_width(OMNI, OMNI) == pytest.approx(MAX_WIDTH)
    assert both < one < MAX_WIDTH
    assert one / both == pytest.approx(0.8859 / 0.6378, rel=2e-3)


def test_energy_within_a_part_of_the_circle_adds_up():
    """More of the circle is more energy; half the circle of an omni pair has its length."""
    array = line(20)
    grown = [two_way_footprint(array, array, within=angle)[0] for angle in (0.05, 0.3, 1.2, np.pi)]
    assert np.all(np.diff(grown) >= 0)
    assert two_way_footprint(OMNI, OMNI, within=0.7)[0] == pytest.approx(1.4, rel=1e-9)


def test_a_cosine_element_is_the_cosine_of_the_angle_from_boresight():
    """In front; and behind there is nothing to receive with a baffle."""
    angle = np.linspace(-1.5, 1.5, 50)
    cosine = beams(PointTransducer(element="cosine"), FREQUENCY, SPEED)
    np.testing.assert_allclose(cosine.gain(direction(angle))[0], np.cos(angle), atol=1e-9)
    np.testing.assert_allclose(cosine.gain(direction(0.0, angle))[0], np.cos(angle), atol=1e-9)
    assert beams(PointTransducer(element="baffled"), FREQUENCY, SPEED).gain(direction(np.pi + angle / 2))[0].max() == 0
