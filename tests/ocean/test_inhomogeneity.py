"""Claims about uneven water: how a travel time's variance grows with the way, the patches and the changes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean.inhomogeneity import Inhomogeneity, delay_variance, wave_parameter

LENGTH, INDEX, WAY = st.floats(0.1, 100), st.floats(1e-6, 1e-2), st.floats(0.01, 1000)


@given(WAY, LENGTH, INDEX, st.floats(1.1, 4))
def test_changes_add_as_amplitudes(way, length, index, factor):
    """So many times the change, as many times the delay: its variance goes with the square, inversely with c^2."""
    one = delay_variance(way, 1500.0, Inhomogeneity(rms_index=index / 4, correlation_length=length))
    more = delay_variance(way, 1500.0, Inhomogeneity(rms_index=index / 4 * factor, correlation_length=length))
    assert more == pytest.approx(factor**2 * one, rel=1e-9)
    slower = delay_variance(way, 750.0, Inhomogeneity(rms_index=index / 4, correlation_length=length))
    assert slower == pytest.approx(4 * one, rel=1e-9)


@given(st.floats(0.1, 100), LENGTH, INDEX, st.floats(1.5, 5))
def test_only_lengths_compared_with_each_other_count(way, length, index, factor):
    """Water enlarged as a whole, patches and way: the variance of the delay by the square of the enlargement."""
    large = min(length * factor, 1000)
    factor = large / length
    small = delay_variance(way, 1500.0, Inhomogeneity(rms_index=index, correlation_length=length))
    found = delay_variance(way * factor, 1500.0, Inhomogeneity(rms_index=index, correlation_length=large))
    assert found == pytest.approx(factor**2 * small, rel=1e-6)


@given(WAY, st.floats(1.01, 3), LENGTH)
def test_a_longer_path_gathers_more_but_no_more_than_in_step(way, factor, length):
    """Between the growth of independent patches (as the way) and that of one patch (as its square)."""
    uneven = Inhomogeneity(rms_index=1e-4, correlation_length=length)
    near, far = delay_variance(way, 1500.0, uneven), delay_variance(way * factor, 1500.0, uneven)
    assert near * factor * (1 - 1e-6) <= far <= near * factor**2 * (1 + 1e-6)


def test_within_one_patch_the_delay_is_the_change_times_the_time():
    """A hundredth of a patch: sigma = rms index times travel time, to 1e-4; no way, no delay."""
    uneven = Inhomogeneity(rms_index=1e-3, correlation_length=100.0)
    assert np.sqrt(delay_variance(1.0, 1500.0, uneven)) == pytest.approx(1e-3 / 1500, rel=1e-4)
    assert delay_variance(0.0, 1500.0, uneven) == 0


@pytest.mark.parametrize("shape", [(), (4,), (3, 2)])
def test_path_lengths_of_any_shape_are_evaluated(shape):
    """One variance for each way, speeds broadcast."""
    uneven = Inhomogeneity(rms_index=1e-4, correlation_length=3.0)
    assert delay_variance(np.full(shape, 40.0), 1500.0, uneven).shape == shape
    assert delay_variance(np.full((3, 1), 40.0), np.full(2, 1500.0), uneven).shape == (3, 2)


@given(st.floats(1, 1000), st.floats(1e-3, 0.1), st.floats(0.5, 50))
def test_patches_scatter_where_a_fresnel_zone_is_as_large_as_they_are(way, wavelength, length):
    """The parameter is 2 / pi times the square of sqrt(wavelength R) over the patch."""
    uneven = Inhomogeneity(rms_index=1e-4, correlation_length=length)
    zone = np.sqrt(wavelength * way)
    assert wave_parameter(way, wavelength, uneven) == pytest.approx(2 / np.pi * (zone / length) ** 2, rel=1e-9)
