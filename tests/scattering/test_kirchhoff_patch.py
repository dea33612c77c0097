"""Smooth patches: Fresnel integrals in all their ranges, and patches of known bodies against fine sums."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scattering._kirchhoff_patch_kernel import QUADRATURE_GRADIENT, SERIES_QUADRATIC, fresnel_tail, moments
from insonify.scattering.kirchhoff_patch import KirchhoffPatch, side_offset

TABLE = fresnel_tail()
PANELS = 40
_NODE, _WEIGHT = np.polynomial.legendre.leggauss(30)
NODE = ((_NODE + 1 + 2 * np.arange(PANELS)[:, None]) / PANELS - 1).ravel()
WEIGHT = np.tile(_WEIGHT / PANELS, PANELS)


def summed(slope, bend):
    """The first four moments by Gauss' rule with 30 nodes in each of 40 panels, where phases turn by 27 rad at most."""
    phasor = np.exp(1j * (slope * NODE + bend * NODE**2)) * WEIGHT / 2
    return phasor.sum(), (NODE * phasor).sum(), (NODE**2 * phasor).sum(), (NODE**3 * phasor).sum()


@given(st.floats(-300.0, 300.0), st.floats(-120.0, 120.0))
@settings(max_examples=80)
def test_moments_are_their_integrals(slope, bend):
    """Mean and first three moments of a quadratic phase, within 1e-5."""
    assert moments(slope, bend, TABLE) == pytest.approx(summed(slope, bend), abs=1e-5)


@pytest.mark.parametrize("slope", [QUADRATURE_GRADIENT + 0.2, 40.0, 250.0])
@pytest.mark.parametrize("bend", [0.0, SERIES_QUADRATIC * 0.99, SERIES_QUADRATIC * 1.01, -SERIES_QUADRATIC * 1.01, 0.3])
def test_moments_do_not_jump_where_their_form_changes(slope, bend):
    """At slopes and bends where one form gives way to another: within 1e-5 of the integral."""
    assert moments(slope, bend, TABLE) == pytest.approx(summed(slope, bend), abs=1e-5)


def ring_patch(radius, half, off, k, distance):
    """Echo of one patch of a cylinder re its middle, and the fine sum over it: monostatic, its axis along z."""
    along, around = 0.05, radius * half
    out = np.array([np.cos(off), np.sin(off), 0.0])
    side = np.array([-np.sin(off), np.cos(off), 0.0])
    zero = np.zeros(3)
    rows = [np.array([0, 0, along]), side * around, zero, -out * radius * half**2 / 2, zero, zero, side * half, zero]
    source = np.array([distance, 0.0, 0.02])
    ray = radius * out - source
    length = np.linalg.norm(ray)
    way = (ray / length)[None, None]
    far = np.full((1, 1), length)
    echo = KirchhoffPatch(1.0).echoes(
        np.array([rows]), np.array([4 * along * around]), out[None], way, way, far, far, np.array([k])
    )[0, 0]
    node, weight = np.polynomial.legendre.leggauss(100)
    turn, height = off + half * node[:, None], along * node
    place = np.stack(np.broadcast_arrays(radius * np.cos(turn), radius * np.sin(turn), height), -1)
    outward = np.stack(np.broadcast_arrays(np.cos(turn), np.sin(turn), 0 * height), -1)
    line = place - source
    ways = np.linalg.norm(line, axis=-1)
    sine = -np.sum(line * outward, axis=-1) / ways
    share = along * around * weight[:, None] * weight
    return echo, np.sum(1j * k / (2 * np.pi) * sine * share * np.exp(-2j * k * (ways - length)))


@pytest.mark.parametrize("off", [0.0, 0.05, 0.6])
@pytest.mark.parametrize("distance", [2.0, 80.0])
def test_a_patch_of_a_cylinder_is_its_integral(off, distance):
    """0.3 m of radius at 100 kHz, 4 degrees to each side, near and far: 1 % of what it would send if it were flat."""
    k = 2 * np.pi / 0.015
    echo, expected = ring_patch(0.3, 0.07, off, k, distance)
    assert abs(echo - expected) < 0.01 * k / (2 * np.pi) * 4 * 0.05 * 0.021


def test_a_patch_turned_away_is_silent():
    """Seen from behind by either end."""
    rows = np.zeros((1, 8, 3))
    rows[0, 0, 0] = rows[0, 1, 1] = 0.1
    ways = np.array([[[0.0, 0.0, 1.0]]]), np.array([[[0.0, 0.0, -1.0]]])
    one = np.ones((1, 1))
    for out, back in (ways, ways[::-1]):
        expected = KirchhoffPatch().echoes(
            rows, np.ones(1), np.array([[0.0, 0, -1]]), out, back, one, one, np.ones(1) * 400
        )
        assert expected == 0


def test_both_sides_of_a_patch_are_the_whole():
    """Parts of an oblique flat patch with the delays of its four corners, each at its own phase, add up to it."""
    rows = np.zeros((4, 8, 3))
    rows[:, 0, 0], rows[:, 1, 1] = 0.1, 0.07
    rows[:, 7, :2] = [(-1, -1), (-1, 1), (1, -1), (1, 1)]
    way = np.array([0.5, 0.3, -np.sqrt(1 - 0.34)])
    way = np.tile(way, (1, 4, 1))
    one, normal, k = np.full((1, 4), 9.0), np.tile([0, 0, 1.0], (4, 1)), np.full(4, 400.0)
    sides = KirchhoffPatch().echoes(rows, np.full(4, 0.028), normal, way, way, one, one, k)[0]
    rows[:, 7] = 0
    whole = KirchhoffPatch().echoes(rows, np.full(4, 0.028), normal, way, way, one, one, k)[0, 0]
    rows[:, 7, :2] = [(-1, -1), (-1, 1), (1, -1), (1, 1)]
    shift = np.exp(-2j * 400.0 * np.sum(side_offset(rows) * way[0], axis=1))
    assert np.sum(sides * shift) == pytest.approx(whole, rel=1e-9)
