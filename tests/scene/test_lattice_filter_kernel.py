"""Claims about filters of lattices: those of SciPy, to the bit."""

import numpy as np
import pytest
from scipy.ndimage import correlate1d, spline_filter

from insonify.scene._lattice_filter_kernel import spline_coefficients, symmetric_filter

SHAPES = (17, 5), (2, 30), (128, 128)


@pytest.mark.parametrize("shape", SHAPES)
def test_filters_are_those_of_scipy(shape):
    """A symmetric filter, reaching beyond the lattice or not, and a cubic spline's; none changes its argument."""
    values, weights = np.random.default_rng(1).normal(20, 1, shape), np.array([0.5, 0.2, 0.04, 0.01])
    given, both_sides = values.copy(), np.append(weights[:0:-1], weights)
    correlated = correlate1d(correlate1d(values, both_sides, 0, mode="nearest"), both_sides, 1, mode="nearest")
    np.testing.assert_array_equal(symmetric_filter(values, weights), correlated)
    np.testing.assert_array_equal(spline_coefficients(values), spline_filter(values, mode="mirror"))
    np.testing.assert_array_equal(values, given)
