"""Polynomials against the maths library."""

import numpy as np
import pytest
from numba import njit

from insonify.fast_sincos import sincos_cycles, sincos_of_few


@njit(fastmath={"contract"})  # as the kernels compile it
def _all(cycles, sine, cosine):
    for i in range(cycles.size):
        sine[i], cosine[i] = sincos_cycles(cycles[i])


@njit(fastmath={"contract"})
def _few(cycles, sine, cosine):
    for i in range(cycles.size):
        sine[i], cosine[i] = sincos_of_few(cycles[i])


def sincos(cycles):
    """The polynomials over an array."""
    cycles = np.ascontiguousarray(cycles, dtype=float)
    sine, cosine = np.empty(cycles.size, np.float32), np.empty(cycles.size, np.float32)
    _all(cycles, sine, cosine)
    return sine, cosine


@pytest.mark.parametrize("turns", [0, -1, 27_000, -1_234_567, 90_000_000])
def test_a_turn_is_a_turn(turns):
    """Sine and cosine hold to 2e-7 within any turn, near or far from zero."""
    cycles = turns + np.linspace(-1, 1, 200_001)
    within = cycles - np.round(cycles)
    sine, cosine = sincos(cycles)
    assert np.abs(sine - np.sin(2 * np.pi * within)).max() <= 2e-7
    assert np.abs(cosine - np.cos(2 * np.pi * within)).max() <= 2e-7


def test_a_few_turns_in_single_precision():
    """Sine and cosine of float32 cycles, two to either side of zero: 2e-7, in float32."""
    cycles = np.linspace(-2, 2, 100_001).astype(np.float32)
    sine, cosine = np.empty(cycles.size, np.float32), np.empty(cycles.size, np.float32)
    _few(cycles, sine, cosine)
    assert np.abs(sine - np.sin(2 * np.pi * cycles.astype(float))).max() <= 2e-7
    assert np.abs(cosine - np.cos(2 * np.pi * cycles.astype(float))).max() <= 2e-7


def test_quarter_turns():
    """Quarter turns land on the axes, with the right signs."""
    sine, cosine = sincos([0, 0.25, 0.5, 0.75, 1, -0.25, -0.5])
    np.testing.assert_allclose(sine, [0, 1, 0, -1, 0, -1, 0], atol=1.5e-7)
    np.testing.assert_allclose(cosine, [1, 0, -1, 0, 1, 0, -1], atol=1.5e-7)


def test_pythagoras():
    """The square of the sine and of the cosine make one, so a carrier's phase adds no power."""
    sine, cosine = sincos(np.random.default_rng(2).uniform(-1e5, 1e5, 10_000))
    assert np.abs(sine.astype(float) ** 2 + cosine.astype(float) ** 2 - 1).max() <= 4e-7
