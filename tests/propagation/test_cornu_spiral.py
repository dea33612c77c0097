"""The straight edge as Cornu drew it: a spiral of unit speed, its turns, its energy, and what moves along it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from insonify.propagation.knife_edge import PER_UNIT, edge_diffraction_table, knife_edge
from insonify.propagation.knife_edge_kernel import edge_diffraction
from oracles.fresnel import fresnel_number

NUMBERS = st.floats(-6, 6)
WAYS = st.floats(0.5, 500)


def power(number):
    """Power behind the edge re that without it."""
    return float(np.abs(knife_edge(number)) ** 2)


@given(NUMBERS)
def test_the_spiral_is_run_at_one_speed(number):
    """Its speed is 1 / sqrt 2 everywhere, and it heads for -(1 + j) exp(-j pi nu^2 / 2)."""
    step = 1e-4
    way = (knife_edge(number + step) - knife_edge(number - step)) / (2 * step)
    assert abs(way) == pytest.approx(1 / np.sqrt(2), rel=1e-6)
    assert way == pytest.approx(-(1 + 1j) / 2 * np.exp(-0.5j * np.pi * number**2), abs=1e-6)


@given(st.floats(-5, 5))
def test_the_spiral_bends_in_proportion_to_the_length_run(number):
    """A clothoid: the change of its heading is pi nu for each unit of nu."""
    step = 1e-3
    ahead, here, back = (complex(knife_edge(number + k * step)) for k in (1, 0, -1))
    turned = np.angle((ahead - here) / (here - back)) / step
    assert turned == pytest.approx(-np.pi * number, abs=1e-4)


@given(NUMBERS)
def test_mirrored_numbers_lie_opposite_on_the_spiral(number):
    """About its middle, 1/2, the spiral is odd."""
    assert knife_edge(number) - 0.5 == pytest.approx(0.5 - knife_edge(-number), abs=1e-14)


@pytest.mark.parametrize(
    ("near", "number", "level"),
    [(-1.2, -1.2172, 1.3704), (-1.9, -1.8725, 0.7782), (-2.3, -2.3445, 1.1993), (-2.7, -2.7390, 0.8432)],
)
def test_fringes_stand_where_fresnel_s_integrals_put_them(near, number, level):
    """First two bright and dark fringes of a straight edge: 1.370, 0.778, 1.199, 0.843 of the power (not verified)."""
    sign = -1 if level > 1 else 1
    fringe = minimize_scalar(lambda v: sign * power(v), bounds=(near - 0.2, near + 0.2), method="bounded",
                             options={"xatol": 1e-9})  # fmt: skip
    assert fringe.x == pytest.approx(number, abs=2e-4)
    assert sign * fringe.fun == pytest.approx(level, abs=2e-4)
    # near where the wave of the edge, an eighth of a turn late, is in step or out of step: nu^2 = 2 n - 1/2
    order = round(number**2 / 2 + 0.25)
    assert abs(number) == pytest.approx(np.sqrt(2 * order - 0.5), abs=0.02)


def test_a_shadow_only_darkens():
    """Behind the edge there are no fringes: the level falls all the way in, and from fringe to fringe outside."""
    inside = np.abs(knife_edge(np.linspace(0, 8, 2000)))
    assert np.all(np.diff(inside) < 0)
    outside = np.abs(knife_edge(np.linspace(-8, 0, 20001)))
    peaks = outside[1:-1][(outside[1:-1] > outside[2:]) & (outside[1:-1] > outside[:-2])]
    assert peaks.size > 12 and np.all(np.diff(peaks) > 0)  # the largest is that nearest to the shadow


def energy(number):
    """Integral of the power from a number on, in closed form: by parts, F' being a pure turn."""
    here = knife_edge(number)
    turn = np.exp(-0.5j * np.pi * number**2)
    return -(number * np.abs(here) ** 2 + ((1j - 1) / np.pi * np.conj(here) * turn).real)


@given(st.floats(-4, 4), st.floats(0.01, 3))
def test_power_between_two_heights_has_a_closed_form(number, span):
    """Integral of |F|^2 = [nu |F|^2 + Re((j - 1) / pi F* exp(-j pi nu^2 / 2))], against quadrature."""
    measured = quad(power, number, number + span, epsabs=1e-11, limit=200)[0]
    assert measured == pytest.approx(float(energy(number) - energy(number + span)), abs=1e-9)


def test_what_the_shadow_gains_the_light_lacks():
    """Energy: 1 / (2 pi) of a unit zone lies behind the edge, and as much is missing before it."""
    behind = quad(power, 0, 30, limit=500)[0] + 1 / (2 * np.pi**2 * 30)  # the tail is 1 / (2 pi^2 nu^2)
    assert behind == pytest.approx(1 / (2 * np.pi), abs=1e-6)
    cut = 40.0
    assert float(energy(-cut)) - cut == pytest.approx(0.0, abs=2 / (np.pi**2 * cut))


@given(st.floats(0, 9))
def test_the_kernel_that_runs_is_the_integral(number):
    """From the table, both sides of the edge: the closed integral to 1e-8, and Babinet's sum is one."""
    shade, light = (edge_diffraction(sign * number, edge_diffraction_table()) for sign in (1.0, -1.0))
    assert shade == pytest.approx(complex(knife_edge(number)), abs=1e-8)
    assert shade + light == pytest.approx(1.0, abs=1e-12)


def test_the_table_is_coarsest_at_the_edge():
    """16 numbers between entries: below 1e-8 before the first entry, where the cubic is one-sided, half beyond it."""
    numbers = np.linspace(0, 9, 9 * PER_UNIT * 16 + 1)
    table = edge_diffraction_table()
    error = np.abs([edge_diffraction(x, table) for x in numbers] - knife_edge(numbers))
    assert error.max() < 1e-8
    assert error[numbers > 1 / PER_UNIT].max() < 5e-9


@given(st.floats(-2, 2), WAYS, WAYS, st.floats(1e-3, 0.1))
def test_the_fresnel_number_is_reciprocal_and_dimensionless(height, before, behind, wavelength):
    """Source and point may change places, and all lengths may grow: the number is a ratio."""
    number = fresnel_number(height, before, behind, wavelength)
    assert fresnel_number(height, behind, before, wavelength) == pytest.approx(number, rel=1e-14)
    grown = fresnel_number(3 * height, 3 * before, 3 * behind, 3 * wavelength)
    assert grown == pytest.approx(number, rel=1e-13)
    assert fresnel_number(-height, before, behind, wavelength) == -number
    far = fresnel_number(height, 1e12, behind, wavelength)
    assert far == pytest.approx(height * np.sqrt(2 / (wavelength * behind)), rel=1e-9)


@given(st.floats(0.01, 0.5), st.floats(20, 300), st.floats(20, 300), st.floats(5e-3, 0.1))
def test_the_number_counts_half_waves_of_detour(height, before, behind, wavelength):
    """Over the edge it is farther by nu^2 / 2 half wavelengths: nu^2 = 4 (detour) / wavelength, to second order."""
    detour = height**2 * (1 / (before + np.hypot(before, height)) + 1 / (behind + np.hypot(behind, height)))
    number = float(fresnel_number(height, before, behind, wavelength))
    assert number**2 == pytest.approx(4 * detour / wavelength, rel=(height / 20) ** 2 + 1e-12)


def test_numbers_of_many_edges_are_broadcast():
    """Heights down, distances across."""
    together = fresnel_number([[0.1], [0.2]], [10.0, 20.0, 30.0], 5.0, 0.015)
    assert together.shape == (2, 3)
    assert together[1, 2] == fresnel_number(0.2, 30.0, 5.0, 0.015)
    assert knife_edge(together).shape == (2, 3)
