"""Claims about echoes of the water itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.ocean import (
    ScatteringLayer,
    bubble_resonance_frequency,
    resonant_bubble_radius,
    volume_backscattering_coefficient,
    volume_strength_db,
)
from insonify.units import intensity_ratio, level_db
from insonify.validity import PhysicsWarning


def test_a_fish_in_each_hundred_cubic_metres():
    """S_v = TS + 10 log n: -40 dB fish, one in 100 m^3, make -60 dB re 1/m."""
    assert level_db(volume_backscattering_coefficient(0.01, intensity_ratio(-40.0))) == pytest.approx(-60)


def test_twice_as_many_send_back_twice_as_much():
    """Independent scatterers add as powers, and kinds of them too."""
    assert volume_backscattering_coefficient(2.0, 1e-5) == pytest.approx(
        2 * volume_backscattering_coefficient(1.0, 1e-5)
    )
    np.testing.assert_allclose(
        volume_backscattering_coefficient([[1.0], [2.0]], [1e-5, 2e-5]), [[1e-5, 2e-5], [2e-5, 4e-5]]
    )


def test_layers_add_where_they_overlap():
    """Two equal layers are 3 dB above one; between layers the water is clear; a layer ends where the next begins."""
    layers = [ScatteringLayer(0, 20, -70.0), ScatteringLayer(10, 20, -70.0), ScatteringLayer(20, 30, -60.0)]
    strength = volume_strength_db([5.0, 15.0, 20.0, 40.0], layers)
    np.testing.assert_allclose(strength[:3], [-70, -70 + 10 * np.log10(2), -60])
    assert strength[3] == -np.inf


def test_named_layers_span_the_coast():
    """Sparse, moderate and dense water lie 10 dB apart."""
    levels = [ScatteringLayer.named(name, 0, 10).strength_db for name in ("sparse", "moderate", "dense")]
    np.testing.assert_allclose(np.diff(levels), 10)


def test_a_misspelt_layer_is_reported_with_the_nearest():
    """Names are taught, not guessed."""
    with pytest.raises(ValueError, match="'spares' is not a named layer; the nearest are: sparse"):
        ScatteringLayer.named("spares", 0, 10)
    with pytest.raises(ValueError, match="Exchange them"):
        ScatteringLayer(20, 10, -70.0)


def test_a_millimetre_bubble_rings_at_three_kilohertz():
    """Minnaert's rule of thumb, 3.25 m/s over the radius, within 1 %."""
    assert bubble_resonance_frequency(1e-3) == pytest.approx(3250, rel=0.01)


@pytest.mark.parametrize("depth", [10.0, 30.0, 90.0])
def test_pressure_makes_bubbles_ring_higher(depth):
    """As the square root of pressure: sqrt(1 + z/10 m), within 1 %."""
    raised = bubble_resonance_frequency(1e-4, depth) / bubble_resonance_frequency(1e-4)
    assert raised == pytest.approx(np.sqrt(1 + depth / 10), rel=0.01)


@given(st.floats(2e3, 9e4), st.floats(0, 20))
def test_the_bubble_that_resonates_with_a_sonar_rings_at_its_frequency(frequency, depth):
    """Radius and frequency undo one another."""
    radius = resonant_bubble_radius(frequency, depth)
    assert bubble_resonance_frequency(radius, depth) == pytest.approx(frequency, rel=1e-12)


def test_a_bubble_too_small_for_the_law_warns():
    """Below 30 um heat and surface tension matter; nothing rings at no size."""
    with pytest.warns(PhysicsWarning, match=r"Minnaert.*3e-05 to 0.003 m"):
        bubble_resonance_frequency(5e-6)
    with pytest.raises(ValueError, match="radius is 0 m"):
        bubble_resonance_frequency(0.0)
