"""Exponentials of numbers up to 0 against the maths library."""

import numpy as np
import pytest
from numba import njit

from insonify.fast_exponential import exp2_nonpositive, exp_nonpositive


@njit(fastmath={"contract"})  # as the kernels compile it
def _all(x, result):
    for i in range(x.size):
        result[i] = exp_nonpositive(x[i])


def exponential(x):
    """The function over an array."""
    result = np.empty(x.size)
    _all(x, result)
    return result


@pytest.mark.parametrize("span", [1e-9, 0.7, 30.0, 690.0])
def test_equals_the_maths_library(span):
    """The relative error is 2e-16 (2 + |x|): that of the exponent's own rounding."""
    x = -np.linspace(0, span, 200_001)
    assert np.all(np.abs(exponential(x) / np.exp(x) - 1) <= 2e-16 * (2 - x))


def test_of_zero_is_one():
    """A path without absorption keeps its pressure to the bit."""
    assert exponential(np.array([0.0, -0.0])).tolist() == [1.0, 1.0]


def test_far_below_zero_stays_a_normal_number():
    """Below the smallest power nothing overflows, vanishes or becomes negative."""
    assert exponential(np.array([-1e3, -1e9, -1e300, -np.inf])) == pytest.approx(2.0**-1000, rel=1e-12)


@njit(fastmath={"contract", "reassoc", "nsz", "arcp"})  # as the kernels compile it
def _singles(x, result):
    for i in range(x.size):
        result[i] = exp2_nonpositive(x[i])


def test_powers_of_2_in_single_precision():
    """The relative error is 1e-6 down to 2^-100, below which numbers stay there."""
    x = -np.linspace(0, 100, 200_001).astype(np.float32)
    result = np.empty_like(x)
    _singles(x, result)
    assert np.all(np.abs(result / np.exp2(x.astype(float)) - 1) <= 1e-6)
    far = np.array([-100.5, -1e6, -np.inf], np.float32)
    _singles(far, result[:3])
    assert result[:3] == pytest.approx(2.0**-100, rel=1e-6)
