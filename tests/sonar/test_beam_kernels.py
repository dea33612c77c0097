"""Claims about the arithmetic of beams, direction by direction: axes, elements, tables, cones; float64 by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.sonar import LineArray, PlanarArray, PointTransducer, beams
from insonify.sonar.beam_kernels import (
    BAFFLED,
    COSINE,
    OMNI,
    array_cosines,
    beam_amplitude,
    cosine_bounds,
    distance_to_interval,
    element_amplitude,
    element_gain,
    interpolate_majorant,
    interpolate_pattern,
)  # fmt: skip
from oracles.beams import axes, gain

FREQUENCY, SPEED = 100e3, 1500.0
WAVELENGTH = SPEED / FREQUENCY
LINE = {"width": 0.3, "columns": 40, "shading": "hamming"}
PANEL = {"width": 0.2, "height": 0.06, "columns": 24, "rows": 8, "shading": "taylor", "shading_down": "cosine"}


def everywhere(count=40, seed=1):
    """Unit vectors in all directions, (count, 3)."""
    way = np.random.default_rng(seed).normal(size=(count, 3))
    return way / np.linalg.norm(way, axis=1, keepdims=True)


@pytest.mark.parametrize("element", ["omni", "baffled", "cosine", "piston"])
@pytest.mark.parametrize("values", [LINE, PANEL], ids=["line", "panel"])
def test_a_beam_is_its_element_times_what_steering_makes_of_it(values, element):
    """Steered, shaded, turned about three axes: every point of the array added up in the world, to 2e-7."""
    panel = "height" in values
    steers = [(-0.4, 0.2), (0.1, 0.2)] if panel else [(-0.4, 0.0), (0.1, 0.0), (0.6, 0.0)]
    right = tuple(steer[0] for steer in steers)
    if panel:
        array = PlanarArray(**values, element=element, steer=right, steer_down=0.2)
    else:
        rest = {"length": values["width"], "elements": values["columns"], "shading": values["shading"]}
        array = LineArray(**rest, element=element, steer=right)
    frame = axes(heading=0.7, pitch=0.2, roll=-0.3, tilt=0.1)
    made = beams(array, FREQUENCY, SPEED, frame.T).kernel_tables
    for way in everywhere():
        w, u, v = array_cosines(made.axes, *way)
        np.testing.assert_allclose([w, u, v], way @ frame, atol=1e-15)
        one = element_amplitude(made, w, u, v)
        for channel, steer in enumerate(steers):
            whole = gain(way, frame, WAVELENGTH, steer, **values, element=element)
            assert one * beam_amplitude(made, channel, u, v) == pytest.approx(whole, abs=2e-7)


def test_one_beam_of_a_fan_has_the_columns_of_its_own():
    """Kernels of one beam alone, or of the fan: the same numbers, bit for bit."""
    fan = beams(LineArray(length=0.3, element="cosine", steer=(-0.3, 0.0, 0.4)), FREQUENCY, SPEED)
    for channel in range(3):
        alone = fan.single_beam(channel).kernel_tables
        for _, u, v in everywhere(10):
            assert beam_amplitude(alone, 0, u, v) == beam_amplitude(fan.kernel_tables, channel, u, v)
            assert element_amplitude(alone, 0.5, u, v) == element_amplitude(fan.kernel_tables, 0.5, u, v)


def test_a_point_receives_all_directions_alike():
    """No table is a pattern of one; and its majorant is one."""
    made = beams(PointTransducer(), FREQUENCY, SPEED).kernel_tables
    assert {element_amplitude(made, *way) * beam_amplitude(made, 0, *way[1:]) for way in everywhere()} == {1.0}
    assert interpolate_pattern(np.empty((0, 4)), 1.0, 3.0) == interpolate_majorant(np.empty(0), 1.0, 3.0) == 1.0


@settings(max_examples=100, deadline=None)
@given(x=st.floats(-5, 5), per_unit=st.floats(0.5, 4))
def test_a_table_of_cubics_is_even_and_goes_on_as_its_last_row(x, per_unit):
    """Rows of four coefficients, from the axis outwards, by Horner's rule or numpy's."""
    table = np.random.default_rng(1).normal(size=(6, 4))
    place = abs(x) * per_unit
    row = min(int(place), 5)
    assert interpolate_pattern(table, per_unit, x) == pytest.approx(
        np.polynomial.polynomial.polyval(place - row, table[row])
    )
    assert interpolate_pattern(table, per_unit, -x) == interpolate_pattern(table, per_unit, x)


@settings(max_examples=100, deadline=None)
@given(x=st.floats(-5, 5), further=st.floats(0, 3))
def test_what_is_strongest_from_a_place_outwards_grows_no_more(x, further):
    """A majorant that falls row by row: no less than its own row, no more further out, the last row at the end."""
    bound = np.array([1.0, 0.6, 0.3, 0.2, 0.2, 0.1])
    here, beyond = interpolate_majorant(bound, 2.0, x), interpolate_majorant(bound, 2.0, abs(x) + further)
    assert here >= bound[min(int(abs(x) * 2), 5)] and beyond <= here and interpolate_majorant(bound, 2.0, 1e9) == 0.1


def test_elements_receive_before_them():
    """Omni all round; a baffle the front half with its edge; a cosine what it is, and nothing behind."""
    cosines = (-1.0, -1e-9, 0.0, 0.5, 1.0)
    assert [element_gain(OMNI, w) for w in cosines] == [1] * 5
    assert [element_gain(BAFFLED, w) for w in cosines] == [0, 0, 1, 1, 1]
    assert [element_gain(COSINE, w) for w in cosines] == [0, 0, 0, 0.5, 1]


@settings(max_examples=100, deadline=None)
@given(angle=st.floats(0, np.pi), margin=st.floats(0, np.pi))
def test_a_cone_of_directions_spans_its_cosines(angle, margin):
    """Least and greatest cosine to an axis within a margin: of 2001 angles that are as near, to 1e-6 and 2e-3."""
    least, greatest = cosine_bounds(float(np.cos(angle)), float(np.cos(margin)), float(np.sin(margin)))
    around = np.cos(np.clip(angle + margin * np.linspace(-1, 1, 2001), 0, np.pi))
    assert around.min() - 1e-5 <= least <= around.min() + 1e-6
    assert around.max() - 1e-6 <= greatest <= around.max() + 1e-5


@settings(max_examples=100, deadline=None)
@given(ends=st.tuples(st.floats(-1, 1), st.floats(-1, 1)), axis=st.floats(-1, 1))
def test_the_nearest_place_of_an_interval(ends, axis):
    """None within it, else the way to its nearer end; as clipping has it."""
    least, greatest = min(ends), max(ends)
    assert distance_to_interval(least, greatest, axis) == pytest.approx(
        abs(axis - np.clip(axis, least, greatest)), abs=1e-15
    )
