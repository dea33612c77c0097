"""Claims about the innermost loops of element recordings: where the echo is received, and when, from geometry alone."""

import numpy as np
import pytest

from insonify.synthesis._arrival_time_kernel import (
    ArrayWater,
    ArrivalColumns,
    ElementMotion,
    arrival_moving,
    arrival_refracted,
    arrival_stationary,
    transmit_moving,
)
from insonify.synthesis._waveform_basis_kernel import basis_coordinate, basis_weights
from oracles.waveforms import chebyshev_basis

SPEED = 1500.0
NONE = np.zeros(3)


def ways(count=200, nearest=0.3, farthest=80.0):
    """Distances and directions of some scatterers."""
    random = np.random.default_rng(5)
    away = np.exp(random.uniform(np.log(nearest), np.log(farthest), count))
    way = random.normal(size=(3, count))
    return away, way / np.linalg.norm(way, axis=0)


def columns(delay, away, way):
    """Echoes of scatterers at some distances and directions, from a transmitter at rest."""
    return ArrivalColumns(
        delay, 1 / away, away, away * np.hypot(way[0], way[1]), *way, np.ones(away.size), np.zeros((0, away.size))
    )


def water(middle=0.0):
    """Water of one speed without absorption."""
    return ArrayWater(1 / SPEED, 0.0, 0.0, False, middle)


@pytest.mark.parametrize("size", [0.01, 0.5, 3.0])
def test_an_element_receives_from_where_it_stands(size):
    """Spheres: arrays of a centimetre to three metres, scatterers from 0.3 m: exact distances, 1e-13 s, 1e-6."""
    away, way = ways()
    place = size * np.array([0.6, -0.5, 0.3])
    when, fade = np.empty(200), np.empty(200, np.float32)
    arrival_stationary(columns(np.zeros(200), away, way), 200, place, water(), when, fade)
    there = np.linalg.norm(away * way - place[:, None], axis=0)
    np.testing.assert_allclose(when, (there - away) / SPEED, atol=1e-13)
    np.testing.assert_allclose(fade, away / there, rtol=1e-6)


def test_an_element_at_the_scatterer_itself_receives_no_infinity():
    """Nearer than a centimetre the sphere grows no stronger."""
    when, fade = np.empty(1), np.empty(1, np.float32)
    echo = columns(np.zeros(1), np.ones(1), np.eye(3)[:, :1])
    arrival_stationary(echo, 1, np.array([1.0, 0, 0]), water(), when, fade)
    assert np.isfinite(when[0]) and fade[0] == pytest.approx(100.0)


@pytest.mark.parametrize("refracted", [False, True], ids=["spheres", "expansion"])
def test_a_moving_element_crosses_the_wavefront(refracted):
    """The moment solves |rx(t) - scatterer| = c (t - t0): 1e-11 s at 5 m/s and 0.5 m/s^2; both kernels in one speed."""
    away, way = ways(nearest=5.0)
    start = away / SPEED  # the sound left the scatterer then
    place, velocity, acceleration = np.array([0.3, -0.2, 0.1]), np.array([4.0, -3.0, 0.2]), np.array([0.1, 0.5, -0.3])
    when, fade, doppler = np.empty(200), np.empty(200, np.float32), np.empty(200)
    kernel = arrival_refracted if refracted else arrival_moving
    kernel(
        columns(2 * start, away, way), 200, ElementMotion(place, velocity, acceleration), water(), when, fade, doppler
    )
    rx = place[:, None] + velocity[:, None] * when + acceleration[:, None] / 2 * when**2
    there = np.linalg.norm(away * way - rx, axis=0)
    np.testing.assert_allclose(there / SPEED, when - start, atol=1e-11)
    now = velocity[:, None] + acceleration[:, None] * when
    closing = np.sum((away * way - rx) * now, axis=0) / there / SPEED
    np.testing.assert_allclose(doppler, closing, atol=1e-9)
    np.testing.assert_allclose(fade, away / there, rtol=1e-5)


def test_an_echo_is_where_its_middle_is():
    """Half a pulse as it was sent is taken off, whatever the Doppler: shapes are stretched about their middle."""
    away, way = ways(nearest=5.0)
    velocity, middle = np.array([5.0, 0, 0]), 2e-3
    expected = []
    for half in (0.0, middle):
        when, fade, doppler = np.empty(200), np.empty(200, np.float32), np.empty(200)
        motion = ElementMotion(NONE, velocity, NONE)
        arrival_moving(columns(2 * away / SPEED, away, way), 200, motion, water(half), when, fade, doppler)
        expected.append(when)
    np.testing.assert_allclose(expected[0] - expected[1], middle, atol=1e-15)


@pytest.mark.parametrize("count", [2, 3, 8, 31])
def test_shares_are_lagrange_s(count):
    """The running products of the kernel are the polynomials written out: 2e-5, and flat beyond the range."""
    shapes = chebyshev_basis(count, 4e-3, 1e-3)
    where = np.linspace(-6e-3, 8e-3, 300)
    share, x, shaped = (
        np.empty((count, 300), np.float32),
        np.empty(300, np.float32),
        shapes.weight_table,
    )
    basis_coordinate(where, shaped, x)
    basis_weights(x, shaped.node_coordinate, shaped.node_scale, share)
    np.testing.assert_allclose(share, shapes.weights(where), atol=2e-5)


def test_a_moving_transmitter_sends_from_where_it_is_at_the_pulse_s_middle():
    """The middle leaves from velocity times half a pulse: its way, its spreading and its closing by plain vectors."""
    away, way = ways(nearest=2.0)
    velocity, middle = np.array([4.0, -3.0, 0.5]), 3e-3
    later, leaving, growth = np.empty((3, 200))
    transmit_moving(np.ascontiguousarray(way.T), away, velocity, middle, 1 / SPEED, later, leaving, growth)
    left = away * way - (middle * velocity)[:, None]
    length = np.linalg.norm(left, axis=0)
    np.testing.assert_allclose(later, middle + (length - away) / SPEED, atol=1e-13)
    np.testing.assert_allclose(leaving, velocity @ left / length / SPEED, atol=1e-13)
    np.testing.assert_allclose(growth, away / length, rtol=1e-12)


def test_a_transmitter_at_rest_sends_at_the_middle_and_from_its_place():
    """Nothing follows, nothing is stronger; what is later is half the pulse."""
    away, way = ways()
    later, leaving, growth = np.empty((3, 200))
    transmit_moving(np.ascontiguousarray(way.T), away, NONE, 1e-3, 1 / SPEED, later, leaving, growth)
    np.testing.assert_allclose(later, 1e-3, atol=1e-15)
    assert not leaving.any()
    np.testing.assert_allclose(growth[away > 0.02], 1, rtol=1e-12)
