"""Claims about the pressure that legs bring: the product of everything that changes it, beam by beam, and no more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.synthesis._leg_pressure_kernel import transmitted_pressure

LEVEL = 3e10


def legs(f=3, n=200, beams=2, seed=1):
    """Amplitudes, ways, phasors, losses and gains of f legs to n places."""
    rng = np.random.default_rng(seed)
    amplitude = rng.normal(size=(f, n)) + 1j * rng.normal(size=(f, n))
    phase = np.exp(2j * np.pi * rng.uniform(size=n))
    return amplitude, rng.uniform(0.5, 2, (f, n)), phase, rng.uniform(0.1, 1, (f, n)), rng.normal(size=(beams, f, n))


def leg_pressure(amplitude, factor, phase, lost, gains, level=LEVEL):
    """What the kernel brings; memory that held something else before."""
    sent = np.full(gains.shape, np.nan + 0j, np.complex64)
    transmitted_pressure(amplitude, factor, phase, level, lost, gains, sent)
    return sent


@pytest.mark.parametrize("beams", [1, 2, 5])
@pytest.mark.parametrize("f", [1, 3])
def test_it_is_the_product_of_all_that_changes_the_sound(f, beams):
    """Amplitude, phasor, level, way, loss and gain multiplied in double: to single precision, and no NaN left."""
    amplitude, factor, phase, lost, gains = legs(f=f, beams=beams)
    expected = LEVEL * (amplitude * phase * factor * lost)[None] * gains
    np.testing.assert_allclose(leg_pressure(amplitude, factor, phase, lost, gains), expected, rtol=3e-7)


def test_without_absorption_there_is_no_loss():
    """An empty table of losses is one of ones, bit by bit."""
    amplitude, factor, phase, lost, gains = legs()
    none = leg_pressure(amplitude, factor, phase, np.empty((0, 0)), gains)
    np.testing.assert_array_equal(none, leg_pressure(amplitude, factor, phase, np.ones_like(lost), gains))


def test_a_leg_that_is_cut_brings_nothing():
    """Amplitude zero, loss zero or gain zero: silence, and nothing taken from the others."""
    amplitude, factor, phase, lost, gains = legs()
    whole = leg_pressure(amplitude, factor, phase, lost, gains)
    amplitude[0, 3], lost[1, 5], gains[1, 2, 7] = 0, 0, 0
    cut = leg_pressure(amplitude, factor, phase, lost, gains)
    silent = np.zeros(cut.shape, bool)
    silent[:, 0, 3] = silent[:, 1, 5] = silent[1, 2, 7] = True
    np.testing.assert_array_equal(cut[silent], 0)
    np.testing.assert_array_equal(cut[~silent], whole[~silent])


@given(st.integers(0, 2**31), st.floats(-np.pi, np.pi))
def test_the_phase_of_a_place_turns_what_arrives_and_keeps_its_size(seed, turn):
    """Every scatterer turned by one angle: all pressures turn by it, in every beam."""
    amplitude, factor, phase, lost, gains = legs(n=20, seed=seed)
    one, other = (leg_pressure(amplitude, factor, phase * p, lost, gains) for p in (1, np.exp(1j * turn)))
    np.testing.assert_allclose(other, one * np.exp(1j * turn), rtol=1e-6, atol=1e-6 * np.abs(one).max())


def test_scatterers_are_independent():
    """Any part of the places by itself has the bits that it has among all: blocks may be cut anywhere."""
    amplitude, factor, phase, lost, gains = legs()
    whole = leg_pressure(amplitude, factor, phase, lost, gains)
    part = np.random.default_rng(2).permutation(200)[:37]
    alone = leg_pressure(*(np.ascontiguousarray(x[..., part]) for x in (amplitude, factor, phase, lost, gains)))
    np.testing.assert_array_equal(alone, whole[..., part])


def test_twice_the_pressure_at_the_source_is_twice_the_pressure():
    """Powers of two change no digit."""
    columns = legs()
    np.testing.assert_array_equal(leg_pressure(*columns, level=2 * LEVEL), 2 * leg_pressure(*columns))
