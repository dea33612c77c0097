"""The exponential of numbers up to 0 against the maths library."""

import numpy as np
import pytest
from numba import njit

from insonify.fast_exponential import exp_nonpositive


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
